//! Pages for browsers: a scene in one file, or in a folder. Arrays become files first.

use crate::errors::{of_media, wrong};
use serde::Deserialize;
use splatkit::{
    Error,
    disk::TemporaryFolder,
    session::{AppearanceEntry, Data, Description, InputEntry, TransferEntry},
    volume::{TransferFunction, Volume},
};
use splatkit_media::page::{Page, Viewer, Wish, write_data};
use std::{
    path::PathBuf,
    sync::{Mutex, MutexGuard, PoisonError},
};

/// The inputs of a scene, for a page.
#[derive(Default)]
pub struct Collected(Mutex<Inputs>);

#[derive(Default)]
struct Inputs {
    /// Where arrays are written to.
    folder: Option<TemporaryFolder>,
    entries: Vec<InputEntry>,
    /// The first entry of the last input: it has one for each channel.
    last: usize,
}

/// What a caller wants of a page.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Wanted {
    path: PathBuf,
    title: Option<String>,
    /// The share of points, triangles, Gaussians and samples.
    quality: Option<f64>,
    /// Most bytes.
    limit: Option<u64>,
    /// The folder of the viewer.
    viewer: Option<PathBuf>,
}

impl Collected {
    fn locked(&self) -> MutexGuard<'_, Inputs> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Adds a file.
    pub fn add(&self, entry: InputEntry) {
        let mut inputs = self.locked();
        inputs.last = inputs.entries.len();
        inputs.entries.push(entry);
    }

    /// Adds what an array has become.
    pub fn add_array(
        &self,
        data: Data,
        name: &str,
        appearance: AppearanceEntry,
    ) -> Result<(), Error> {
        let mut inputs = self.locked();
        inputs.last = inputs.entries.len();
        let parts = match data {
            Data::Volume(mut volume) => {
                let more = std::mem::take(&mut volume.more_channels);
                let channels: Vec<Volume> = [volume].into_iter().chain(more).collect();
                channels.into_iter().map(Data::Volume).collect()
            }
            data => vec![data],
        };
        let is_one = parts.len() == 1;
        let letters = name.chars().map(|c| if c.is_alphanumeric() { c } else { '-' });
        let name: String = letters.collect();
        for data in parts {
            let stem = match inputs.entries.len() {
                0 => name.clone(),
                number => format!("{name}-{}", number + 1),
            };
            let mut appearance = appearance.clone();
            if !is_one {
                appearance.channels = None;
            }
            if inputs.folder.is_none() {
                inputs.folder = Some(TemporaryFolder::new()?);
            }
            let Some(folder) = &inputs.folder else { continue };
            let written = write_data(&data, (folder.path(), &stem), &mut appearance);
            let file = written.map_err(of_media)?;
            inputs.entries.push(InputEntry { appearance, ..InputEntry::new(file) });
        }
        Ok(())
    }

    /// Sets the transfer functions of the last input, one for each field.
    pub fn show_last(&self, transfers: Vec<TransferFunction>) -> Result<(), Error> {
        let mut inputs = self.locked();
        let last = inputs.last;
        let entries = &mut inputs.entries[last..];
        if entries.len() != transfers.len() {
            return Err(wrong(
                "pages show a file with the functions that it has for all its channels, or with \
                 one that is set for its only field",
            ));
        }
        for (entry, transfer) in entries.iter_mut().zip(transfers) {
            let drawn = &mut entry.appearance;
            drawn.transfer = Some(TransferEntry::Whole(transfer));
            (drawn.range, drawn.opacity_unit, drawn.isosurfaces) = (None, None, None);
            (drawn.gradient_opacity, drawn.colormap, drawn.log_colors) = (None, None, false);
        }
        Ok(())
    }

    /// Returns the inputs.
    pub fn inputs(&self) -> Vec<InputEntry> {
        self.locked().entries.clone()
    }

    /// Writes the page of a scene. Returns what was written, as JSON.
    pub fn page(&self, scene: &Description, wanted: &Wanted) -> Result<String, Error> {
        scene.check().map_err(|(place, message)| wrong(format!("{place}: {message}")))?;
        let extension = wanted.path.extension().map(|end| end.to_ascii_lowercase());
        let is_one_file = match extension.as_ref().and_then(|end| end.to_str()) {
            Some("html" | "htm") => true,
            None => false,
            Some(_) if wanted.path.is_dir() => false,
            Some(other) => {
                return Err(wrong(format!(
                    "{}: a page is an .html file, or a folder, whose name has no extension; not \
                     .{other}",
                    wanted.path.display()
                )));
            }
        };
        let viewer = Viewer::find(wanted.viewer.as_deref()).map_err(of_media)?;
        let mut loaded = scene.load(&|_| ())?;
        let wish = Wish {
            title: wanted.title.clone(),
            share: wanted.quality,
            limit: wanted.limit,
            is_one_file,
        };
        let written = Page::new(scene, &mut loaded, &viewer, &wish, &|_| ()).and_then(|page| {
            let bytes = match is_one_file {
                true => page.write_file(&wanted.path, &viewer)?,
                false => page.write_folder(&wanted.path, &viewer)?,
            };
            Ok(serde_json::json!({
                "bytes": bytes, "share": page.share, "psnr": page.likeness,
            }))
        });
        written.map(|written| written.to_string()).map_err(of_media)
    }
}
