//! `splatkit publish`: a page that shows a scene, as one file or as a folder for a static host.
//!
//! The page itself is made by `splatkit_media::page`, which the Python package uses, too.

#[cfg(feature = "serve")]
mod answer;
#[cfg(feature = "serve")]
mod serve;

use crate::{
    failure::Failure, given::Given, job::Job, output, parse, progress::Progress, render::Render,
    timing::milliseconds,
};
use clap::Args;
#[cfg(feature = "serve")]
pub use serve::Serve;
use splatkit_media::page::{Page, Viewer, Wish};
use std::{
    path::{Path, PathBuf},
    time::Instant,
};

/// Flags of `render` that are not for pages, which have their own sizes and one view.
const NOT_OF_PAGES: [&str; 18] = [
    "depth",
    "layers",
    "turntable",
    "path",
    "times",
    "fps",
    "raw",
    "reference",
    "bits",
    "views",
    "split-channels",
    "columns",
    "panel-labels",
    "size",
    "width",
    "height",
    "dpi",
    "engine",
];

#[derive(Args, Debug)]
// A page has its own output; the flags that write pictures are `render`'s.
#[command(
    mut_arg("output", |flag| flag.required(true).help(OUTPUT).long_help(OUTPUT)),
    mut_arg("json", |flag| flag.help("Print what was written to stdout, as JSON.")),
    mut_arg("depth", |flag| flag.hide(true)),
    mut_arg("layers", |flag| flag.hide(true)),
    mut_arg("turntable", |flag| flag.hide(true)),
    mut_arg("path", |flag| flag.hide(true)),
    mut_arg("times", |flag| flag.hide(true)),
    mut_arg("fps", |flag| flag.hide(true)),
    mut_arg("raw", |flag| flag.hide(true)),
    mut_arg("reference", |flag| flag.hide(true)),
    mut_arg("bits", |flag| flag.hide(true)),
    mut_arg("views", |flag| flag.hide(true)),
    mut_arg("split_channels", |flag| flag.hide(true)),
    mut_arg("columns", |flag| flag.hide(true)),
    mut_arg("panel_labels", |flag| flag.hide(true)),
    mut_arg("size", |flag| flag.hide(true)),
    mut_arg("width", |flag| flag.hide(true)),
    mut_arg("height", |flag| flag.hide(true)),
    mut_arg("dpi", |flag| flag.hide(true)),
    mut_arg("engine", |flag| flag.hide(true)),
)]
pub struct Publish {
    #[command(flatten)]
    scene: Render,
    #[command(flatten)]
    page: PageFlags,
    /// Show this share of points, triangles, Gaussians and samples, such as 40%: the page has fewer
    /// bytes
    #[arg(long, value_name = "PERCENT", value_parser = quality, help_heading = "Page")]
    quality: Option<f64>,
    /// Show as much as a page of this size can hold, such as 20MB. The viewer has about 2.3 MB in
    /// one file, and 9 MB in a folder
    #[arg(long, value_name = "SIZE", value_parser = parse::bytes, help_heading = "Page")]
    limit: Option<u64>,
}

/// What a page is made of, besides the scene.
#[derive(Args, Debug)]
struct PageFlags {
    /// Set the title of the page [default: the names of the inputs]
    #[arg(long, value_name = "TEXT", help_heading = "Page")]
    title: Option<String>,
    /// Take the viewer from this folder, which tools/web/build has made [default: the one that this
    /// program contains, or the folder `viewer` beside it]
    #[arg(long, value_name = "FOLDER", help_heading = "Page")]
    viewer: Option<PathBuf>,
}

/// What `-o` is for.
const OUTPUT: &str = "Write the page to this .html file, which has everything inside and opens by \
                      a double click; or to this folder, for any static host";

impl Publish {
    pub fn run(self, given: &Given, progress: &Progress) -> Result<(), Failure> {
        check_flags(given)?;
        let job = self.scene.job(given)?;
        let target = self.target()?;
        target.check(self.scene.overwrites())?;
        let viewer = Viewer::find(self.page.viewer.as_deref())?;
        let (share, limit) = (self.quality, self.limit);
        let is_one_file = matches!(target, Target::File(_));
        let wish = Wish { share, limit, is_one_file, ..self.page.wish() };
        let page = page_of(&self.scene, &job, &viewer, (&wish, progress));
        let written = target.path();
        page.and_then(|page| target.write(&page, &viewer, (self.scene.prints_json(), progress)))
            .map_err(|failure| job.blamed(failure, &[written]))
    }

    /// Returns where the page goes.
    fn target(&self) -> Result<Target, Failure> {
        let path = self.scene.output().ok_or_else(|| Failure::Usage(OUTPUT.into()))?.to_owned();
        let extension = path.extension().map(|end| end.to_string_lossy().to_ascii_lowercase());
        match extension.as_deref() {
            Some("html" | "htm") => Ok(Target::File(path)),
            None => Ok(Target::Folder(path)),
            Some(_) if path.is_dir() => Ok(Target::Folder(path)),
            Some(other) => Err(Failure::Usage(format!(
                "{}: a page is an .html file, or a folder, whose name has no extension; not \
                 .{other}",
                path.display()
            ))),
        }
    }
}

/// Refuses flags of pictures.
fn check_flags(given: &Given) -> Result<(), Failure> {
    match NOT_OF_PAGES.into_iter().find(|flag| given.has(flag)) {
        Some(flag) => Err(Failure::Usage(format!(
            "--{flag} is for pictures (`splatkit render`), not for pages"
        ))),
        None => Ok(()),
    }
}

impl PageFlags {
    /// Returns what is wanted of the page.
    fn wish(&self) -> Wish {
        Wish { title: self.title.clone(), ..Wish::default() }
    }
}

/// Reads a share in percent.
fn quality(text: &str) -> Result<f64, String> {
    let number = text.trim().trim_end_matches('%').trim().parse().ok();
    let share = number.filter(|percent: &f64| *percent > 0.0 && *percent <= 100.0);
    share.map(|percent| percent / 100.0).ok_or("a share is above 0 % and at most 100 %".into())
}

/// Reads the inputs, and makes the page of them.
fn page_of(
    scene: &Render,
    job: &Job,
    viewer: &Viewer,
    (wish, progress): (&Wish, &Progress),
) -> Result<Page, Failure> {
    let start = Instant::now();
    let mut loaded = job.load(progress)?;
    if let Some(warning) = job.idle(&loaded.scene) {
        progress.warn(warning);
    }
    if job.scene.overlay != Default::default() {
        progress.warn(
            "texts over pictures (--scalar-bar, --axes, --scale-bar, --caption) are not shown in \
             pages yet",
        );
    }
    let written = scene.output().unwrap_or(Path::new(""));
    output::check_unneeded(written, &loaded.files)?;
    progress.stage("Collecting the inputs");
    let page = Page::new(&job.scene, &mut loaded, viewer, wish, &|step| progress.stage(step))?;
    tracing::info!(milliseconds = milliseconds(start), "read and collected");
    Ok(page)
}

/// Where a page goes.
enum Target {
    File(PathBuf),
    Folder(PathBuf),
}

impl Target {
    fn path(&self) -> &Path {
        match self {
            Self::File(path) | Self::Folder(path) => path,
        }
    }

    /// Refuses what exists already.
    fn check(&self, overwrite: bool) -> Result<(), Failure> {
        match self {
            Self::File(path) => output::check(path, overwrite),
            Self::Folder(path) => {
                let is_empty =
                    |path: &Path| path.read_dir().is_ok_and(|mut all| all.next().is_none());
                let hint = match path.symlink_metadata() {
                    Ok(meta) if !meta.is_dir() => "give the name of a folder",
                    Ok(_) if !overwrite && !is_empty(path) => "give --overwrite, or another name",
                    _ => return Ok(()),
                };
                let message = "exists already".to_owned();
                Err(Failure::Output { file: path.clone(), message, hint: Some(hint) })
            }
        }
    }

    /// Writes the page, and says how many bytes it has.
    fn write(
        &self,
        page: &Page,
        viewer: &Viewer,
        (is_json, progress): (bool, &Progress),
    ) -> Result<(), Failure> {
        progress.stage(format!("Writing {}", self.path().display()));
        let bytes = match self {
            Self::File(path) => page.write_file(path, viewer)?,
            Self::Folder(path) => page.write_folder(path, viewer)?,
        };
        progress.clear();
        if is_json {
            let mut files = serde_json::Map::new();
            for (name, content) in page.files() {
                files.insert(name.clone(), content.size()?.into());
            }
            return output::json(&serde_json::json!({
                "output": self.path().to_string_lossy(),
                "bytes": bytes,
                "files": files,
                "share": page.share,
                "psnr": page.likeness,
            }));
        }
        let megabytes = bytes as f64 / 1e6;
        let shown = match page.share {
            share if share < 1.0 => format!(", {}", shown(share, page.likeness)),
            _ => String::new(),
        };
        output::line(format_args!("{}: {megabytes:.2} MB{shown}", self.path().display()))?;
        if let Self::Folder(path) = self {
            let place = path.display();
            progress.note(format_args!(
                "browsers show {place} from a server, not by a double click; for a look: splatkit \
                 serve {place}"
            ));
        }
        Ok(())
    }
}

/// Says how much a page shows, and how alike its picture is.
fn shown(share: f64, likeness: Option<f64>) -> String {
    let percent = 100.0 * share;
    let digits = if percent < 10.0 { 1 } else { 0 };
    let likeness = likeness.map(|psnr| format!(", a small picture of it has {psnr:.1} dB"));
    format!("{percent:.digits$} % of the inputs{}", likeness.unwrap_or_default())
}

#[cfg(test)]
mod tests {
    use super::quality;

    #[test]
    fn shares_are_read() {
        assert_eq!(quality("40%"), Ok(0.4));
        assert_eq!(quality(" 100 "), Ok(1.0));
        for wrong in ["0", "101", "-3%", "half", "NaN"] {
            assert!(quality(wrong).is_err(), "{wrong}");
        }
    }
}
