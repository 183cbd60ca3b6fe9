//! What inputs are converted to that a page cannot take as they are. Its viewer does not read them,
//! or less of them is wanted, or they are too large to be read at once.

use super::content::{Content, unread};
use crate::Failure;
use splatkit::{
    Error,
    bricks::{self, WriteOptions},
    disk::TemporaryFolder,
    edit::{Edit, Thin},
    formats::{self, Kind},
    scene::Item,
    session::{
        AppearanceEntry, Data, Description, EditEntry, InputEntry, Loaded, LoadedInput, ReadInput,
        ReadingEntry, SurfaceColor, TransferEntry, convert::Conversion,
    },
    surface::Mesh,
    volume::{Arrangement, TransferFunction, Volume},
};
use std::{
    fs,
    path::{Path, PathBuf},
    slice,
};

/// A page that reads files in parts takes those as they are that are no larger than this, in bytes.
/// A browser holds them.
const LARGE: u64 = 1 << 26;

/// How much of the inputs is wanted, and how.
#[derive(Debug, Clone, Copy)]
pub struct Wanted {
    /// The share of points, vertices, Gaussians and samples, above 0 to 1.
    pub share: f64,
    /// Whether the page reads files in parts.
    pub in_parts: bool,
}

/// A file that an input has become, and its entry in the scene.
pub type Entry = (InputEntry, Content);

/// A scene whose inputs are converted.
pub struct Converter<'a> {
    pub scene: &'a Description,
    pub loaded: &'a Loaded,
    pub wanted: Wanted,
}

impl Converter<'_> {
    /// Returns whether less of an input is wanted than it has, and a part can be taken.
    pub fn thins(&self, read: &LoadedInput) -> bool {
        let has_parts = match read.kind {
            Kind::Mesh | Kind::Gaussians | Kind::Volume | Kind::Hierarchy => true,
            Kind::Samples | Kind::Cells | Kind::Bricks => false,
        };
        self.wanted.share < 1.0 && has_parts && !read.has_lines
    }

    /// Returns whether an input becomes a file in parts.
    pub fn divides(&self, read: &LoadedInput) -> bool {
        let bytes = || read.file.metadata().map_or(0, |meta| meta.len());
        self.wanted.in_parts
            && match read.kind {
                Kind::Mesh | Kind::Gaussians => bytes() > LARGE && !read.has_lines,
                Kind::Volume => self
                    .plain_volume(read)
                    .is_some_and(|volume| volume.samples.bytes().len() as u64 > LARGE),
                Kind::Hierarchy | Kind::Bricks | Kind::Samples | Kind::Cells => false,
            }
    }

    /// Returns the volume of an input, if bricks hold all that it is.
    fn plain_volume(&self, read: &LoadedInput) -> Option<&Volume> {
        let items = &self.loaded.scene.items[read.items.clone()];
        let [Item::Volume(volume, ..)] = items else { return None };
        let is_plain = volume.lattice.arrangement == Arrangement::Cartesian
            && !volume.is_label_map()
            && volume.colors.is_none()
            && volume.opacities.is_none()
            && volume.about.channels.len() < 2;
        is_plain.then_some(volume)
    }

    /// Converts an input to one file, or to one for each channel. `entry` is what a page says of
    /// it.
    ///
    /// # Errors
    /// Those of reading the input and of writing the files; [`Error::Input`] for what pages do not
    /// show.
    pub fn entries(
        &self,
        (input, read): (&InputEntry, &LoadedInput),
        mut entry: InputEntry,
    ) -> Result<Vec<Entry>, Failure> {
        let thin = self.thins(read).then_some(self.wanted.share);
        let mut wanted = input.clone();
        let is_hierarchy = read.kind == Kind::Hierarchy;
        if let (Some(share), false) = (thin, is_hierarchy || read.kind == Kind::Volume) {
            let thin = EditEntry::parse(&format!("thin:{}%", 100.0 * share));
            wanted.edits.push(thin.map_err(Error::Argument)?);
        }
        let ReadInput { data, .. } = self.scene.read_input(&wanted)?;
        // The converted file has one array, is as the input was moved and edited, and knows its own
        // layout.
        entry.reading = ReadingEntry::default();
        (entry.transform, entry.edits) = Default::default();
        let (kind, is_divided) = (read.kind, self.divides(read));
        let file = File { converter: self, input: &wanted, kind, thin, is_divided };
        let items = &self.loaded.scene.items[read.items.clone()];
        match data {
            Data::Volume(volume) if !volume.more_channels.is_empty() => {
                let of_channel = |item: &Item| {
                    let Item::Volume(channel, _, transfer) = item else { return None };
                    let volume = Volume { more_channels: Vec::new(), ..(**channel).clone() };
                    let name = channel.about.name.clone();
                    Some(file.of(
                        entry.clone(),
                        Some(transfer.clone()),
                        &name,
                        Data::Volume(volume),
                    ))
                };
                items.iter().filter_map(of_channel).collect()
            }
            data => {
                let is_field = matches!(data.kind(), Kind::Volume | Kind::Cells);
                let transfer = items.iter().find_map(Item::transfer).filter(|_| is_field).cloned();
                Ok(vec![file.of(entry, transfer, "", data)?])
            }
        }
    }
}

/// The file that an input becomes.
struct File<'a> {
    converter: &'a Converter<'a>,
    input: &'a InputEntry,
    /// What the input holds.
    kind: Kind,
    /// The share that is wanted of volumes and hierarchies, which edits do not thin.
    thin: Option<f64>,
    /// Whether it is read in parts.
    is_divided: bool,
}

impl File<'_> {
    /// Writes data, and completes its entry.
    fn of(
        &self,
        mut entry: InputEntry,
        transfer: Option<TransferFunction>,
        channel: &str,
        data: Data,
    ) -> Result<Entry, Failure> {
        let data = match (data, self.thin) {
            (Data::Volume(volume), Some(share)) => Data::Volume(volume.coarser(share)?),
            (data, _) => data,
        };
        if let Some(transfer) = transfer {
            let drawn = &mut entry.appearance;
            drawn.transfer = Some(TransferEntry::Whole(transfer));
            (drawn.range, drawn.opacity_unit, drawn.isosurfaces) = (None, None, None);
            (drawn.gradient_opacity, drawn.colormap, drawn.channels) = (None, None, None);
        }
        match &data {
            Data::Mesh(mesh) if self.is_plain(mesh) => colored_alike(&mut entry.appearance, mesh),
            // A hierarchy has the colours that the input was shown in.
            Data::Mesh(_) | Data::Hierarchy(_) => entry.appearance = AppearanceEntry::default(),
            _ => {}
        }
        let name = format!("{}.{}", self.stem(channel), self.extension(&data)?);
        entry.file = name.into();
        let content = self.written(&entry.file, &data)?;
        Ok((entry, content))
    }

    /// Returns whether a mesh is written as one: PLY has neither textures nor lines.
    fn is_plain(&self, mesh: &Mesh) -> bool {
        !self.is_divided && mesh.materials.is_empty() && mesh.lines.is_empty()
    }

    fn stem(&self, channel: &str) -> String {
        let mut stem =
            self.input.file.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        if !channel.is_empty() {
            let letters = channel.chars().map(|c| if c.is_alphanumeric() { c } else { '-' });
            stem += &format!("-{}", letters.collect::<String>());
        }
        stem
    }

    fn extension(&self, data: &Data) -> Result<&'static str, Failure> {
        match data {
            Data::Volume(_) if self.is_divided => Ok("splv"),
            Data::Volume(_) => Ok("nrrd"),
            Data::Gaussians(_) if self.is_divided => Ok("splk"),
            Data::Gaussians(_) => Ok("spz"),
            Data::Cells(_) => Ok("vtu"),
            Data::Mesh(mesh) if self.is_plain(mesh) => Ok("ply"),
            Data::Mesh(_) => Ok("splk"),
            Data::Hierarchy(_) if self.thin.is_some() => Ok("splk"),
            Data::Samples(_) | Data::Hierarchy(_) | Data::Bricks(_) => {
                let what = format!("{:?}", data.kind()).to_lowercase();
                let message = format!("is read by this program, but not by pages: it holds {what}");
                let hint = "name a file on this machine; docs/browser.md lists what pages read";
                Err(Error::input(&self.input.file, "file", message).hint(hint).into())
            }
        }
    }

    /// Writes data to a file of this name: in memory, or on the disk if it is read in parts.
    fn written(&self, name: &Path, data: &Data) -> Result<Content, Failure> {
        let folder = TemporaryFolder::new()?;
        let path = folder.path().join(name);
        match data {
            Data::Volume(volume) if self.is_divided => {
                bricks::write(volume, &path, &WriteOptions::default(), None)
            }
            Data::Volume(volume) => formats::nrrd::write(volume, &path),
            Data::Gaussians(set) if !self.is_divided => formats::spz::write(set, &path),
            Data::Cells(cells) => formats::write_cells(cells, &path),
            Data::Mesh(mesh) if self.is_plain(mesh) => formats::ply::write(mesh, &path),
            _ => self.hierarchy(&path),
        }?;
        match self.is_divided {
            true => Ok(Content::made(folder, path)),
            false => Ok(Content::Held(fs::read(&path).map_err(|source| unread(&path, &source))?)),
        }
    }

    /// Writes the hierarchy of a mesh, a cloud, Gaussians or a hierarchy.
    fn hierarchy(&self, path: &Path) -> Result<(), Error> {
        let scene = self.converter.scene;
        let appearance = scene.appearance_of(self.input);
        let moved = self.input.transform.motion().map(Edit::Move);
        let edits = self.input.edits.iter().map(|entry| entry.edit().clone());
        let edits = moved.into_iter().chain(edits);
        // The edits of others thin them already.
        let thin = self
            .thin
            .filter(|_| self.kind == Kind::Hierarchy)
            .map(|share| Edit::Thin(Thin::Share(share)));
        let conversion = Conversion {
            edits: edits.chain(thin).collect(),
            reading: scene.reading_of(self.input).reading(),
            coloring: appearance.coloring(),
            radius_scale: appearance.radius_scale.unwrap_or(1.0),
            ..Conversion::default()
        };
        conversion.convert(slice::from_ref(&self.input.file), path, &()).map(drop)
    }
}

/// Writes data that no file holds yet to a file in a folder, exactly: PLY, NRRD or VTU. Returns its
/// path. `appearance` is how the data is shown, and becomes how the file is.
///
/// # Errors
/// [`Failure::Usage`] for data that no file of a page holds; those of writing.
pub fn write_data(
    data: &Data,
    (folder, stem): (&Path, &str),
    appearance: &mut AppearanceEntry,
) -> Result<PathBuf, Failure> {
    let path = |extension: &str| folder.join(format!("{stem}.{extension}"));
    let (path, written) = match data {
        Data::Mesh(mesh) => {
            colored_alike(appearance, mesh);
            (path("ply"), formats::ply::write(mesh, path("ply")))
        }
        Data::Gaussians(set) => (path("ply"), formats::ply::write_gaussians(set, path("ply"))),
        Data::Volume(volume) if volume.colors.is_none() && volume.opacities.is_none() => {
            (path("nrrd"), formats::nrrd::write(volume, path("nrrd")))
        }
        Data::Cells(cells) => (path("vtu"), formats::write_cells(cells, path("vtu"))),
        Data::Volume(_) | Data::Samples(_) | Data::Hierarchy(_) | Data::Bricks(_) => {
            return Err(Failure::Usage(format!(
                "{stem}: pages show no arrays of scattered samples yet, nor volumes with colours \
                 or opacities of their own"
            )));
        }
    };
    written?;
    Ok(path)
}

/// Says how a mesh that is written as PLY is coloured as before: by its values, which have a name
/// there.
fn colored_alike(appearance: &mut AppearanceEntry, mesh: &Mesh) {
    let by_values = match appearance.color {
        None | Some(SurfaceColor::Values | SurfaceColor::Attribute(_)) => !mesh.values.is_empty(),
        Some(_) => false,
    };
    if by_values {
        appearance.color = Some(SurfaceColor::Attribute(formats::ply::value_name(mesh)));
    }
    if !mesh.radii.is_empty() {
        appearance.point_radius = Some(formats::ply::RADIUS.into());
    }
}
