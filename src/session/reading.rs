//! Opening an input of any kind, which its name decides, then its first bytes.

use super::Data;
use crate::{
    Error, Result,
    about::Modality,
    bricks::Bricks,
    formats::{
        self, Array, Content, FORMATS, Format, Kind, RawLayout, ReadOptions, Series, Times,
        VolumeStream,
    },
    hierarchy::Hierarchy,
    input::{Limits, Parts, Source},
    volume::Volume,
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// How inputs are read: what of them, what their bytes mean, and what they may take.
#[derive(Debug, Clone, Default)]
pub struct Reading {
    /// What to read, and what files do not say themselves. Label maps also take names and colours
    /// from the [table](Self::with_label_table), if there is one.
    pub options: ReadOptions,
    label_table: Option<PathBuf>,
    /// What measured the values of volumes, whatever their files say.
    modality: Option<Modality>,
    /// The array that says how opaque a volume is.
    opacity_from: Option<String>,
    limits: Limits,
    /// The limits of an input that is read as a whole.
    whole: Limits,
}

/// Reads a file of any kind, a folder of pictures, or a remote object, as [`Reading`] does by
/// default.
///
/// ```no_run
/// use splatkit::session::Data;
///
/// match splatkit::read("scan.ply")? {
///     Data::Mesh(mesh) => println!("{} points", mesh.positions.len()),
///     data => println!("{:?}", data.kind()),
/// }
/// # Ok::<(), splatkit::Error>(())
/// ```
///
/// # Errors
/// Those of [`Reading::open`] and [`Opened::read`].
pub fn read(path: impl AsRef<Path>) -> Result<Data> {
    Reading::default().open(path.as_ref())?.read()
}

impl Reading {
    /// Creates the way to read inputs within these limits.
    pub fn new(options: ReadOptions, limits: Limits) -> Self {
        Self { options, whole: limits.clone(), limits, ..Self::default() }
    }

    /// Lets an input that is read as a whole take no more than these bytes of memory. Hierarchies
    /// and bricks are read in parts.
    pub fn within_memory(mut self, bytes: Option<u64>) -> Self {
        // The limit also counts data that is dropped on the way, such as the file and its unpacked
        // bytes.
        let most = bytes.map_or(u64::MAX, |bytes| bytes.saturating_mul(2));
        self.whole.bytes = self.limits.bytes.min(most);
        self
    }

    /// Takes names and colours of labels from this file ([`formats::read_labels`]).
    pub fn with_label_table(mut self, file: Option<PathBuf>) -> Self {
        self.label_table = file;
        self
    }

    /// Takes this as what measured the values of volumes, whatever their files say.
    pub fn with_modality(mut self, modality: Option<Modality>) -> Self {
        self.modality = modality;
        self
    }

    /// Also reads the values that say how opaque volumes are, from an array of the same file by
    /// the name that chooses it: of [`ReadOptions::dataset`] for HDF5, NPZ and Zarr, else of
    /// [`ReadOptions::scalar`].
    pub fn with_opacity_from(mut self, array: Option<String>) -> Self {
        self.opacity_from = array;
        self
    }

    /// Returns the limits of every file.
    pub fn limits(&self) -> &Limits {
        &self.limits
    }

    /// Opens a file, the pictures of a folder, or a remote object.
    ///
    /// # Errors
    /// Those of [`Source::open_any`]; [`Error::Input`] for a file of no kind that is read.
    pub fn open<'a>(&'a self, path: &'a Path) -> Result<Opened<'a>> {
        self.open_colored(path, None)
    }

    /// As [`open`](Self::open). A mesh or point cloud has the values of this attribute, if one is
    /// named. Unlike [`ReadOptions::scalar`], an attribute makes no samples of points.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn open_colored<'a>(
        &'a self,
        path: &'a Path,
        attribute: Option<&'a str>,
    ) -> Result<Opened<'a>> {
        if let Some(kind @ (Kind::Hierarchy | Kind::Bricks)) = Kind::at_once(path, &self.limits)? {
            let source = None;
            let (is_raw, parts) = (false, None);
            return Ok(Opened { reading: self, path, attribute, source, parts, kind, is_raw });
        }
        self.opened(Source::open_any(path, &self.whole)?, attribute)
    }

    /// Opens bytes in memory, for programs that get their data from elsewhere, such as browsers.
    /// `name` stands for the path in errors, and its extension says the format as a file's does.
    /// Files that the bytes refer to are not read.
    ///
    /// ```
    /// use splatkit::{formats::Kind, session::Reading};
    ///
    /// let reading = Reading::default();
    /// let opened = reading.open_bytes("a.xyz".as_ref(), b"0 0 0\n1 0 0\n0 1 0\n")?;
    /// assert_eq!(opened.kind(), Kind::Mesh);
    /// assert_eq!(opened.read()?.count(), 3);
    /// # Ok::<(), splatkit::Error>(())
    /// ```
    ///
    /// # Errors
    /// [`Error::Limit`] for more bytes than the limits allow; [`Error::Input`] for bytes of no kind
    /// that is read.
    pub fn open_bytes<'a>(&'a self, name: &'a Path, bytes: &'a [u8]) -> Result<Opened<'a>> {
        self.open_held(name, bytes, None)
    }

    /// As [`open_bytes`](Self::open_bytes), with the values of an attribute as
    /// [`open_colored`](Self::open_colored) has.
    pub(super) fn open_held<'a>(
        &'a self,
        name: &'a Path,
        bytes: &'a [u8],
        attribute: Option<&'a str>,
    ) -> Result<Opened<'a>> {
        self.opened(Source::from_bytes(name, bytes, &self.whole)?, attribute)
    }

    /// As [`open_bytes`](Self::open_bytes), for a hierarchy or a volume in bricks that comes in
    /// parts.
    ///
    /// # Errors
    /// [`Error::Absent`] until its beginning has come; [`Error::Input`] for other kinds of files.
    pub(super) fn open_parts<'a>(&'a self, path: &'a Path, parts: &Parts) -> Result<Opened<'a>> {
        let kind = match Kind::of_parts(parts)? {
            Some(kind) => kind,
            None => {
                let message = "is neither a hierarchy (.splk) nor a volume in bricks (.splv)";
                return Err(Error::input(path, "file", message).hint("hand it in as a whole"));
            }
        };
        let (source, parts, attribute) = (None, Some(parts.clone()), None);
        Ok(Opened { reading: self, path, attribute, source, parts, kind, is_raw: false })
    }

    fn opened<'a>(&'a self, source: Source<'a>, attribute: Option<&'a str>) -> Result<Opened<'a>> {
        let path = source.path;
        let kind = match attribute {
            None => Kind::of_source(&source, &self.options)?,
            Some(_) => {
                let options = ReadOptions { scalar: None, ..self.options.clone() };
                Kind::of_source(&source, &options)?.map(|kind| as_cloud(path, kind))
            }
        };
        let (kind, is_raw) = match kind {
            Some(kind) => (kind, false),
            None if self.options.raw.is_some() => (Kind::Volume, true),
            None => return Err(foreign(&source).unwrap_or_else(|| unknown(path))),
        };
        let (source, parts) = (Some(source), None);
        Ok(Opened { reading: self, path, attribute, source, parts, kind, is_raw })
    }

    /// Returns the kind of an input, even if it is damaged, or larger than memory. An object on a
    /// server is not fetched if its name or its first bytes decide.
    ///
    /// # Errors
    /// Those of [`open`](Self::open).
    pub fn kind(&self, path: &Path) -> Result<Kind> {
        match Kind::of(path, &self.limits, &self.options)? {
            Some(kind) => Ok(kind),
            None if self.options.raw.is_some() => Ok(Kind::Volume),
            None => {
                let source = Source::open_any(path, &self.limits)?;
                Err(foreign(&source).unwrap_or_else(|| unknown(path)))
            }
        }
    }

    /// Opens a volume that can be read slice by slice. Returns `None` for volumes that are read as
    /// a whole.
    ///
    /// # Errors
    /// Those of [`VolumeStream::open`].
    pub fn stream(&self, path: &Path) -> Result<Option<VolumeStream>> {
        let options = &self.options;
        let stream = VolumeStream::open(path, &self.limits, options.raw.as_ref())?;
        let stream = stream.map(|stream| stream.with_missing(options.missing));
        Ok(match (stream, options.spacing) {
            (Some(stream), Some(spacing)) => Some(stream.with_spacing(spacing)?),
            (stream, _) => stream,
        })
    }

    /// Returns the layout of raw volumes.
    pub fn layout(&self) -> Option<&RawLayout> {
        self.options.raw.as_ref()
    }
}

/// An input whose kind is known.
pub struct Opened<'a> {
    reading: &'a Reading,
    path: &'a Path,
    attribute: Option<&'a str>,
    /// None for files of hierarchies and bricks, which map or fetch parts.
    source: Option<Source<'a>>,
    /// A file that comes in parts.
    parts: Option<Parts>,
    kind: Kind,
    is_raw: bool,
}

impl Opened<'_> {
    /// Returns what it holds.
    pub fn kind(&self) -> Kind {
        self.kind
    }

    /// Returns whether the caller gave the layout of the file, because it has no format of its own.
    pub fn is_raw(&self) -> bool {
        self.is_raw
    }

    /// Returns the limits of reading it.
    pub(super) fn limits(&self) -> &Limits {
        &self.reading.limits
    }

    /// Returns what to read of it.
    pub(super) fn options(&self) -> &ReadOptions {
        &self.reading.options
    }

    /// Returns where it is read from; `None` for files of hierarchies and bricks.
    pub(super) fn source(&self) -> Option<&Source<'_>> {
        self.source.as_ref()
    }

    /// Returns its path, or the address of a remote object.
    pub fn path(&self) -> &Path {
        self.path
    }

    /// Reads it, and warns of missing values.
    ///
    /// # Errors
    /// Those of the kind's reader in [`formats`].
    pub fn read(&self) -> Result<Data> {
        let Reading { limits, options, label_table, .. } = self.reading;
        let data = match (self.kind, &self.source) {
            (Kind::Bricks, _) => Data::Bricks(Arc::new(self.bricks()?)),
            (Kind::Hierarchy, _) | (_, None) => Data::Hierarchy(Arc::new(self.hierarchy()?)),
            (Kind::Mesh, Some(source)) => {
                let mut options = options.clone();
                options.scalar = self.attribute.map(str::to_owned).or(options.scalar);
                Data::Mesh(formats::read_mesh(source, &options)?)
            }
            (Kind::Volume, Some(source)) => {
                let mut options = options.clone();
                if let Some(table) = label_table {
                    options.labels = formats::read_labels(table, limits)?;
                }
                let mut volume = formats::read_volume(source, &options)?;
                volume.about.modality = self.reading.modality.or(volume.about.modality);
                volume.opacities = self.opacities(source)?.map(Arc::new);
                Data::Volume(volume)
            }
            (Kind::Samples, Some(source)) => Data::Samples(formats::read_samples(source, options)?),
            (Kind::Cells, Some(source)) => {
                let mut options = options.clone();
                options.scalar = self.attribute.map(str::to_owned).or(options.scalar);
                Data::Cells(formats::read_cells(source, &options)?)
            }
            (Kind::Gaussians, Some(source)) => {
                Data::Gaussians(formats::read_gaussians(source, options)?)
            }
        };
        data.warn_of_holes(&self.path.display().to_string());
        Ok(data)
    }

    /// Reads the values that say how opaque a volume is, if an array of them is named.
    fn opacities(&self, source: &Source) -> Result<Option<Volume>> {
        let Some(array) = &self.reading.opacity_from else { return Ok(None) };
        let mut options = self.reading.options.clone();
        let by_data_set = Format::of_path(self.path).is_some_and(|format| {
            ["HDF", "NPZ", "Zarr"].iter().any(|word| format.name.contains(word))
        });
        match by_data_set {
            true => (options.dataset, options.scalar) = (Some(array.clone()), None),
            false => options.scalar = Some(array.clone()),
        }
        options.channels = None;
        formats::read_volume(source, &options).map(Some)
    }

    /// Opens a hierarchy.
    pub(super) fn hierarchy(&self) -> Result<Hierarchy> {
        let limits = &self.reading.limits;
        match (self.held(), &self.parts) {
            (_, Some(parts)) => Hierarchy::from_parts(parts, self.path, limits),
            (Some(bytes), _) => Hierarchy::from_bytes(bytes.to_vec(), self.path, limits),
            (None, None) => Hierarchy::open(self.path, limits),
        }
    }

    /// Opens a volume in bricks.
    pub(super) fn bricks(&self) -> Result<Bricks> {
        #[cfg(feature = "zarr")]
        if let Some(source) = self.image_in_levels() {
            return Bricks::open_store(source, &self.reading.options);
        }
        let limits = &self.reading.limits;
        match (self.held(), &self.parts) {
            (_, Some(parts)) => Bricks::from_parts(parts, self.path, limits),
            (Some(bytes), _) => Bricks::from_bytes(bytes.to_vec(), self.path),
            (None, None) => Bricks::open(self.path, limits),
        }
    }

    /// Returns the source of an image that is stored in levels of its own, of those that are read
    /// as bricks.
    pub(super) fn image_in_levels(&self) -> Option<&Source<'_>> {
        // Files of bricks in memory are sources too.
        let is_image =
            |source: &&Source| !source.held().is_some_and(|held| held.starts_with(b"SPLV"));
        self.source.as_ref().filter(|_| self.kind == Kind::Bricks).filter(is_image)
    }

    /// Returns the file, if it comes in parts.
    pub(super) fn parts(&self) -> Option<&Parts> {
        self.parts.as_ref()
    }

    /// Returns the bytes of the caller, if there is no file.
    pub(super) fn held(&self) -> Option<&[u8]> {
        self.source.as_ref().and_then(Source::held)
    }

    /// Gives a point cloud that was read from this input the radii that an attribute holds, if one
    /// is named. Other data stays as it is.
    ///
    /// # Errors
    /// Those of reading; [`Error::Input`] for an attribute that points do not have.
    pub fn give_radii(&self, data: &mut Data, attribute: Option<&str>) -> Result<()> {
        let (Some(attribute), Data::Mesh(mesh), Some(source)) = (attribute, data, &self.source)
        else {
            return Ok(());
        };
        let scalar = Some(attribute.to_owned());
        let options = ReadOptions { scalar, ..self.reading.options.clone() };
        let values = formats::read_mesh(source, &options)?.values;
        if values.len() != mesh.positions.len() {
            let message = format!("“{attribute}” is no attribute of points");
            return Err(Error::input(self.path, "attributes", message)
                .hint("`splatkit info` lists the attributes"));
        }
        mesh.radii = values;
        Ok(())
    }

    /// Returns the values of an attribute of a mesh or point cloud; `None` for other inputs.
    pub(super) fn values(&self, attribute: &str) -> Result<Option<Vec<f32>>> {
        let Some(source) = &self.source else { return Ok(None) };
        let scalar = Some(attribute.to_owned());
        let options = ReadOptions { scalar, ..self.reading.options.clone() };
        Ok(Some(formats::read_mesh(source, &options)?.values))
    }

    /// Returns the files opened so far: its own, those it refers to, and a table of labels.
    pub fn files(&self) -> Vec<PathBuf> {
        let opened = self.source.as_ref().map_or_else(|| vec![self.path.to_owned()], Source::files);
        let table = self.reading.label_table.clone().filter(|_| self.kind == Kind::Volume);
        opened.into_iter().chain(table).collect()
    }

    /// Returns the arrays of a file that holds several; none for the kinds that name none.
    ///
    /// # Errors
    /// Those of [`formats::arrays`].
    pub fn arrays(&self) -> Result<Vec<Array>> {
        match (&self.source, self.kind) {
            (None, _) | (_, Kind::Gaussians | Kind::Hierarchy) => Ok(Vec::new()),
            (Some(source), _) => formats::arrays(source, &self.reading.options),
        }
    }

    /// Returns the times of a file that was [read](Self::read); `None` if it holds only one.
    pub fn times(&self) -> Option<Times> {
        self.source.as_ref().and_then(formats::times)
    }

    /// Returns the series of a folder of pictures, or of a file that lists others; none for other
    /// inputs.
    ///
    /// # Errors
    /// Those of [`formats::series`].
    pub fn series(&self) -> Result<Vec<Series>> {
        let source = self.source.as_ref();
        source.map_or(Ok(Vec::new()), |source| formats::series(source, &self.reading.options))
    }
}

/// Returns the kind of a file of which an attribute is named to colour it: a point cloud, if it can
/// be read as one.
fn as_cloud(path: &Path, kind: Kind) -> Kind {
    let holds_cloud =
        |format: &Format| format.holds.iter().any(|one| one.content == Content::PointCloud);
    let may_be_cloud = Format::of_path(path).is_some_and(holds_cloud);
    if kind == Kind::Samples && may_be_cloud { Kind::Mesh } else { kind }
}

/// Returns the error for a file of a kind that is known, but not read.
fn foreign(source: &Source) -> Option<Error> {
    let advice = formats::advice(source).filter(|_| source.folder().is_none())?;
    let message = format!("is {}, which is not read", advice.what);
    Some(source.error("file", message).hint(advice.hint))
}

/// Returns the error for a file in no known format, with a hint that lists the known ones.
fn unknown(path: &Path) -> Error {
    if path.is_dir() {
        let message =
            "is not a regular file but a folder, in which no series of pictures was found";
        let hint = "name one of its files, or a folder with slices as DICOM or TIFF files";
        return Error::input(path, "path", message).hint(hint);
    }
    let lists = Content::ALL.map(|content| {
        let holds = |format: &&Format| format.holds.iter().any(|one| one.content == content);
        let extensions: Vec<String> = FORMATS
            .iter()
            .filter(holds)
            .flat_map(|format| format.extensions)
            .map(|extension| format!(".{extension}"))
            .collect();
        let raw = match content {
            Content::Volume => ", and raw samples (also packed by gzip) with --dims and --type",
            _ => "",
        };
        format!("{}: {}{raw}", content.plural(), extensions.join(", "))
    });
    Error::input(path, "file", "is in no format that can be read").hint(lists.join("; "))
}
