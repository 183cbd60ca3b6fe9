//! Pages for browsers: one file with everything inside, or a folder for a static host.
//!
//! A page has a scene file, the files of its inputs, and the viewer of tools/web, which draws by
//! the engines of this library.
//!
//! | module | purpose |
//! |---|---|
//! | `published` | which files a page has |
//! | `convert` | what inputs are converted to |
//! | `trial` | reading the scene as the viewer does |
//! | `fit` | as much of the inputs as a limit allows |
//! | `packing` | how bytes lie in one file |
//! | `viewer` | where the viewer is |

mod content;
mod convert;
mod fit;
mod packing;
mod published;
mod trial;
mod viewer;

use crate::Failure;
pub use content::{Content, unread};
use convert::Wanted;
pub use convert::write_data;
use packing::Packed;
use published::Published;
pub use published::name_of;
use splatkit::{
    Error, disk,
    session::{Description, Loaded},
};
use std::{collections::BTreeMap, fmt::Write as _, fs, path::Path};
pub use viewer::Viewer;

/// What a caller wants of a page.
#[derive(Debug, Clone, Default)]
pub struct Wish {
    /// The title; by default the names of the inputs.
    pub title: Option<String>,
    /// The share of points, vertices, Gaussians and samples that is shown, above 0 to 1; by default
    /// all.
    pub share: Option<f64>,
    /// The most bytes of the page, with the viewer.
    pub limit: Option<u64>,
    /// Whether everything is in one file.
    pub is_one_file: bool,
}

/// What a page shows.
pub struct Page {
    /// The title.
    pub title: String,
    /// The share of the inputs that it shows.
    pub share: f64,
    /// How alike its picture is to that of the inputs, in dB, if inputs were converted and it
    /// differs.
    pub likeness: Option<f64>,
    /// The scene, and the files that it names.
    published: Published,
    /// The files as they lie in one file.
    packed: BTreeMap<String, Packed>,
}

/// The scripts of a page in one file.
const BOOT: &str = include_str!("boot.js");

/// What a page in one file may do: nothing but run what is inside. WebAssembly is compiled, and no
/// text becomes a program.
const POLICY: &str = "default-src 'none'; script-src 'unsafe-inline' 'wasm-unsafe-eval' blob:; \
                      worker-src blob:; style-src 'unsafe-inline'; img-src blob: data:";

/// What the page of a folder may do: run the scripts beside it, and read the files beside it.
const FOLDER_POLICY: &str = "default-src 'none'; script-src 'self' 'wasm-unsafe-eval'; worker-src \
                             'self'; connect-src 'self'; style-src 'unsafe-inline'; img-src blob: \
                             data:";

impl Page {
    /// Makes the page of a scene that was loaded. `tell` hears what is done.
    ///
    /// # Errors
    /// [`Failure::Usage`] for limits that no page keeps, and for more bytes than one file may have;
    /// those of reading and converting inputs.
    pub fn new(
        scene: &Description,
        loaded: &mut Loaded,
        viewer: &Viewer,
        wish: &Wish,
        tell: &dyn Fn(&str),
    ) -> Result<Self, Failure> {
        let usual = || {
            let names = scene.visible().map(|input| name_of(&input.file));
            names.collect::<Vec<_>>().join(", ")
        };
        let title = wish.title.clone().unwrap_or_else(usual);
        let read: &Loaded = loaded;
        let make = |share: f64| {
            let wanted = Wanted { share, in_parts: !wish.is_one_file };
            let published = published::published(scene, read, wanted, tell)?;
            let (title, packed) = (title.clone(), BTreeMap::new());
            let mut page = Self { title, published, share, likeness: None, packed };
            if wish.is_one_file {
                tell("Packing the page");
                page.pack()?;
            }
            Ok::<_, Failure>(page)
        };
        let share = wish.share.unwrap_or(1.0);
        let mut page = match wish.limit {
            None => make(share)?,
            Some(limit) => fit::fitted(limit, share, |share| {
                let page = make(share)?;
                let bytes = match wish.is_one_file {
                    true => page.bytes_of_file(viewer)?,
                    false => page.bytes_of_folder(viewer)?,
                };
                Ok((page, bytes))
            })?,
        };
        tell("Reading the page");
        page.likeness = trial::try_reading(&page.published, scene, loaded, page.share < 1.0)?;
        Ok(page)
    }

    /// Returns the files of the inputs, by their names.
    pub fn files(&self) -> &BTreeMap<String, Content> {
        &self.published.files
    }

    /// Returns the scene file.
    fn scene(&self) -> String {
        published::text_of(&self.published.scene)
    }

    /// Packs the files for one file.
    fn pack(&mut self) -> Result<(), Failure> {
        for (name, content) in &self.published.files {
            self.packed.insert(name.clone(), packed(&content.bytes()?)?);
        }
        Ok(())
    }

    /// Returns the bytes of one file, and of all in it that is not of inputs.
    fn bytes_of_file(&self, viewer: &Viewer) -> Result<[u64; 2], Failure> {
        let files: usize = self.packed.values().map(|packed| packed.letters.len()).sum();
        let all = self.file(viewer)?.len();
        Ok([all as u64, (all - files) as u64])
    }

    /// Returns the bytes of a folder, and of all in it that is not of inputs.
    fn bytes_of_folder(&self, viewer: &Viewer) -> Result<[u64; 2], Failure> {
        let mut sums = [0; 2];
        for (name, content) in self.in_files(viewer)? {
            let bytes = content.size()?;
            sums[0] += bytes;
            sums[1] += if self.files().contains_key(&name) { 0 } else { bytes };
        }
        Ok(sums)
    }

    /// Returns one file with everything inside.
    ///
    /// # Errors
    /// For a viewer that cannot be in a page.
    pub fn file(&self, viewer: &Viewer) -> Result<String, Failure> {
        let mut text = self.head(POLICY);
        writeln!(text, "<splatkit-viewer label=\"{}\"></splatkit-viewer>", escaped(&self.title))
            .ok();
        text += NO_SCRIPT;
        writeln!(
            text,
            "<script type=\"application/json\" id=\"scene\">{}</script>",
            // No text inside can end the element.
            self.scene().replace('<', "\\u003c")
        )
        .ok();
        let unpacker = Packed::gzip(&viewer.unpacker).map_err(unpacked)?;
        add(&mut text, "id=\"unpacker\"", &unpacker);
        add(&mut text, "id=\"worker\"", &packed(&viewer.worker)?);
        add(&mut text, "id=\"engine\"", &Packed::lzip(&viewer.engine));
        for (name, packed) in &self.packed {
            add(&mut text, &format!("data-file=\"{}\"", escaped(name)), packed);
        }
        let element = String::from_utf8_lossy(&viewer.element);
        if [&*element, BOOT].iter().any(|script| script.contains("</script")) {
            let message = "its scripts cannot be put into a page: they contain “</script”";
            return Err(Error::input(Path::new("viewer"), "scripts", message).into());
        }
        write!(text, "<script type=\"module\">\n{element}\n{BOOT}</script>\n</body>\n</html>\n")
            .ok();
        Ok(text)
    }

    /// Writes one file with everything inside. Returns its bytes.
    ///
    /// # Errors
    /// Those of [`file`](Self::file); [`Failure::Library`] if it cannot be written.
    pub fn write_file(&self, path: &Path, viewer: &Viewer) -> Result<u64, Failure> {
        let text = self.file(viewer)?;
        disk::write(path, text.as_bytes())?;
        Ok(text.len() as u64)
    }

    /// Writes a folder for a static host. Returns the bytes of all files.
    ///
    /// # Errors
    /// For files that cannot be read or written.
    pub fn write_folder(&self, folder: &Path, viewer: &Viewer) -> Result<u64, Failure> {
        let mut sum = 0;
        for (name, content) in self.in_files(viewer)? {
            let path = folder.join(name);
            let above = path.parent().unwrap_or(folder);
            fs::create_dir_all(above).map_err(|error| Failure::output(above, error))?;
            disk::may_replace(&path, true);
            sum += content.write(&path)?;
        }
        Ok(sum)
    }

    /// Returns the files of a folder, by their names.
    ///
    /// # Errors
    /// For a damaged viewer.
    pub fn in_files(&self, viewer: &Viewer) -> Result<Vec<(String, Content)>, Failure> {
        let mut text = self.head(FOLDER_POLICY);
        writeln!(
            text,
            "<splatkit-viewer src=\"scene.json\" label=\"{}\"></splatkit-viewer>",
            escaped(&self.title)
        )
        .ok();
        text += NO_SCRIPT;
        text += "<script type=\"module\" src=\"splatkit-viewer.js\"></script>\n</body>\n</html>\n";
        let held = |bytes: &[u8]| Content::Held(bytes.to_vec());
        let mut all = vec![
            ("index.html".into(), held(text.as_bytes())),
            ("scene.json".into(), held(self.scene().as_bytes())),
        ];
        all.extend(viewer.files()?.map(|(name, bytes)| (name.into(), Content::Held(bytes))));
        all.extend(self.files().clone());
        Ok(all)
    }

    /// Returns the beginning of a page.
    fn head(&self, policy: &str) -> String {
        let title = escaped(&self.title);
        let policy =
            format!("<meta http-equiv=\"Content-Security-Policy\" content=\"{policy}\">\n");
        let background = self.published.scene.picture.background();
        let behind = background.map_or("Canvas".into(), |color| {
            let [red, green, blue] = color.map(|part| (255.0 * part).round());
            format!("rgb({red} {green} {blue})")
        });
        format!(
            "<!doctype html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n{policy}\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <meta name=\"generator\" content=\"splatkit {}\">\n<title>{title}</title>\n\
             <link rel=\"icon\" href=\"data:,\">\n<style>\n\
             :root {{ color-scheme: light dark; }}\n\
             html, body {{ margin: 0; height: 100%; background: {behind}; }}\n\
             splatkit-viewer {{ position: fixed; inset: 0; }}\n</style>\n</head>\n<body>\n",
            env!("CARGO_PKG_VERSION")
        )
    }
}

/// Browsers have no longer texts.
const MOST_LETTERS: usize = 500_000_000;

const NO_SCRIPT: &str = "<noscript>This page shows a scene in three dimensions. It needs \
                         JavaScript.</noscript>\n";

/// Packs bytes for one file.
fn packed(bytes: &[u8]) -> Result<Packed, Failure> {
    let packed = Packed::new(bytes).map_err(unpacked)?;
    if packed.letters.len() > MOST_LETTERS {
        let megabytes = bytes.len() / 1_000_000;
        return Err(Failure::Usage(format!(
            "an input has {megabytes} MB, too much for a page in one file: publish a folder, or \
             give a limit"
        )));
    }
    Ok(packed)
}

/// The failure of what cannot be packed.
fn unpacked(error: std::io::Error) -> Failure {
    Failure::output(Path::new("page"), error)
}

/// Adds packed bytes to a page as an element.
fn add(text: &mut String, attribute: &str, packed: &Packed) {
    let Packed { by, count, strides, letters } = packed;
    writeln!(
        text,
        "<script type=\"text/plain\" {attribute} data-by=\"{by}\" data-count=\"{count}\" \
         data-strides=\"{strides}\">{letters}</script>"
    )
    .ok();
}

/// Returns a text as HTML, also within quotation marks.
fn escaped(text: &str) -> String {
    let mut out = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => out += "&amp;",
            '<' => out += "&lt;",
            '>' => out += "&gt;",
            '"' => out += "&quot;",
            other => out.push(other),
        }
    }
    out
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn names_of_files_are_no_markup() {
        let name = "<script>\"a\" & b</script>.ply";
        assert_eq!(escaped(name), "&lt;script&gt;&quot;a&quot; &amp; b&lt;/script&gt;.ply");
    }
}
