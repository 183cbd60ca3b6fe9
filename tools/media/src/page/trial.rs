//! Reading a page's scene as the viewer does, before anybody else has to.

use super::{
    content::{Content, unread},
    published::{Published, name_of},
};
use crate::Failure;
use splatkit::{
    Device, Error,
    compare::compare_pictures,
    input::Parts,
    picture::Picture,
    scene::Item,
    session::{CameraEntry, Description, Loaded, Samples},
};
use std::{
    collections::BTreeMap,
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

/// The least likeness of the pictures of a scene and of what its inputs were converted to, in dB.
/// Splats in place of triangles stay above it.
const LEAST_ALIKE: f64 = 24.0;

/// Reads a page's scene as the viewer does, so that a page which cannot be shown is an error here.
/// If inputs were converted, small pictures of both are compared: returns their likeness in dB.
/// `loses` says whether the page is to show less than the scene.
pub fn try_reading(
    published: &Published,
    scene: &Description,
    loaded: &mut Loaded,
    loses: bool,
) -> Result<Option<f64>, Failure> {
    let sources = Sources::of(&published.files)?;
    let mut again = sources.load(&published.scene)?;
    if !published.is_converted {
        return Ok(None);
    }
    let is_label_map = |items: &[Item]| items.iter().map(Item::is_label_map).collect::<Vec<_>>();
    if is_label_map(&loaded.scene.items) == is_label_map(&again.scene.items) {
        let scene = small(scene);
        // Both from the same place: the camera of a part may be fitted a little differently.
        let camera = Some(CameraEntry::from(&loaded.camera(&scene)?));
        let (before, _) = loaded.draw(&scene, &Device::Cpu)?;
        let after = sources.draw(&mut again, &Description { camera, ..small(&published.scene) })?;
        let likeness = compare_pictures(&before, &after)?.psnr;
        if loses || likeness.is_none_or(|likeness| likeness >= LEAST_ALIKE) {
            return Ok(likeness);
        }
    }
    let names = scene.visible().map(|input| name_of(&input.file)).collect::<Vec<_>>();
    let message = "would look different in a page: its colours or labels would be lost when it is \
                   converted";
    let hint = "write it in a format that pages read: docs/browser.md lists them";
    Err(Error::input(Path::new(&names.join(", ")), "inputs", message).hint(hint).into())
}

/// Most bytes of a file in parts in memory while it is read.
const MOST_HELD: u64 = 1 << 28;

/// The files of a page as the viewer reads them: whole, or in parts.
struct Sources {
    whole: BTreeMap<PathBuf, Vec<u8>>,
    in_parts: BTreeMap<PathBuf, Parts>,
    /// The files behind those in parts.
    files: Vec<(PathBuf, File, Parts)>,
}

impl Sources {
    fn of(contents: &BTreeMap<String, Content>) -> Result<Self, Failure> {
        let mut sources =
            Self { whole: BTreeMap::new(), in_parts: BTreeMap::new(), files: Vec::new() };
        for (name, content) in contents {
            match content {
                Content::Held(bytes) => {
                    sources.whole.insert(name.into(), bytes.clone());
                }
                Content::Kept(path) | Content::Made(path, _) => {
                    let file = File::open(path).map_err(|source| unread(path, &source))?;
                    let parts = Parts::new(content.size()?, MOST_HELD);
                    sources.in_parts.insert(name.into(), parts.clone());
                    sources.files.push((path.clone(), file, parts));
                }
            }
        }
        Ok(sources)
    }

    /// Reads the scene.
    fn load(&self, scene: &Description) -> Result<splatkit::session::Loaded, Failure> {
        loop {
            self.begin();
            let loaded = scene.load_in_parts(&self.whole, &self.in_parts, &|_| {});
            if !self.come()? {
                return Ok(loaded?);
            }
        }
    }

    /// Draws the scene.
    fn draw(
        &self,
        loaded: &mut splatkit::session::Loaded,
        scene: &Description,
    ) -> Result<Picture, Failure> {
        loop {
            self.begin();
            let drawn = loaded.draw(scene, &Device::Cpu);
            if !self.come()? {
                return Ok(drawn?.0);
            }
        }
    }

    fn begin(&self) {
        self.files.iter().for_each(|(.., parts)| parts.begin());
    }

    /// Hands in the parts that were missed. Returns whether there were any.
    fn come(&self) -> Result<bool, Failure> {
        let mut any = false;
        for (path, file, parts) in &self.files {
            for range in parts.requests() {
                any = true;
                let mut bytes = vec![0; (range.end - range.start) as usize];
                let mut file = file;
                file.seek(SeekFrom::Start(range.start))
                    .and_then(|_| file.read_exact(&mut bytes))
                    .map_err(|source: io::Error| unread(path, &source))?;
                parts.arrive(range.start, &bytes)?;
            }
        }
        Ok(any)
    }
}

/// Returns a scene with a small picture.
fn small(scene: &Description) -> Description {
    let mut scene = scene.clone();
    let picture = &mut scene.picture;
    (picture.size, picture.width, picture.height) = (Some([160, 120]), None, None);
    picture.views.clear();
    (picture.columns, picture.panel_labels) = (None, None);
    picture.samples = Some(Samples::Factor(1));
    scene
}
