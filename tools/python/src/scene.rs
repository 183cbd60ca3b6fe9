//! Scenes: the half of `pysplatkit.Scene` that holds its items.

use crate::{
    arrays::{numbers, positions, rows, samples},
    camera::{framing, to_json},
    cells::CellArrays,
    draw::{Added, Draw, Stage, Viewpoint},
    errors::{options, raise, wrong},
    page::Collected,
    parts::{appearance, reading},
    picture::{Layers, Picture},
    worker::run,
};
use numpy::PyArray1;
use pyo3::prelude::*;
use serde::Deserialize;
use splatkit::{
    Deadline, Error, Stop,
    about::{About, Channel, Frame, Label, Modality, Orientation},
    formats,
    gaussians::{Gaussians, harmonics},
    glam::{DMat3, DVec3, Quat, Vec3},
    input::Limits,
    interaction::Effort,
    scattered::Points,
    scene::Optics,
    session::{
        AppearanceEntry, CameraEntry, Data, Description, EditEntry, Engine, Framing, InputEntry,
        Layer, Name, OverlayEntry, PictureEntry, ReadingEntry, TransformEntry,
    },
    surface::Mesh,
    volume::{Arrangement, Lattice, TransferFunction, Volume},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
};

/// What is drawn together. If it is collected for a page, nothing is drawn.
#[pyclass(frozen, module = "pysplatkit._pysplatkit")]
#[derive(Default)]
pub struct Scene(Arc<Stage>, Option<Arc<Collected>>);

/// What a caller says of an array.
#[derive(Debug, Clone, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct ArrayFacts {
    name: String,
    /// World position of the first sample.
    origin: Option<[f64; 3]>,
    spacing: Option<[f64; 3]>,
    /// The rows of the matrix whose columns are the directions of the axes.
    axes: Option<[[f64; 3]; 3]>,
    /// Where samples are along the axes, in units of the spacing, if they are not evenly spaced.
    coordinates: Option<[Vec<f64>; 3]>,
    missing: Option<f64>,
    modality: Option<String>,
    value_name: String,
    value_unit: String,
    unit: String,
    up: Option<[f64; 3]>,
    /// The frame of a patient, `lps` or `ras`.
    frame: Option<String>,
    labels: Option<ArrayLabels>,
    /// The names of the channels, if there are several.
    channel_names: Option<Vec<String>>,
    /// Where the item is moved to.
    transform: TransformEntry,
}

/// How a file is added.
#[derive(Debug, Default, Deserialize)]
#[serde(deny_unknown_fields, default)]
struct FileFacts {
    /// Where the item is moved to.
    transform: TransformEntry,
    /// What is changed before it is drawn.
    edits: Vec<EditEntry>,
    /// What pictures compute of fields. Other optics than light show values alone: of a volume that
    /// has colours its brightness, and of cells the field inside.
    optics: Option<Optics>,
}

/// What a caller says of the values of a volume: whether they are labels, the labels' names, or a
/// file of them.
#[derive(Debug, Clone, Deserialize)]
#[serde(untagged)]
enum ArrayLabels {
    Are(bool),
    Table(PathBuf),
    Names(Vec<(i32, String)>),
}

impl ArrayLabels {
    /// Returns a volume with labels as the caller says; without a word, they are guessed.
    fn apply(labels: Option<&Self>, volume: Volume) -> Result<Volume, Error> {
        let named = |(value, name): &(i32, String)| Label {
            value: *value,
            name: name.clone(),
            ..Label::default()
        };
        Ok(match labels {
            None => volume.with_guessed_labels(),
            Some(Self::Are(false)) => volume,
            Some(Self::Are(true)) => volume.with_labels(Vec::new()),
            Some(Self::Names(names)) => volume.with_labels(names.iter().map(named).collect()),
            Some(Self::Table(path)) => {
                volume.with_labels(formats::read_labels(path, &Limits::default())?)
            }
        })
    }
}

impl ArrayFacts {
    fn about(&self) -> Result<About, Error> {
        let mut about = About::default();
        about.name.clone_from(&self.value_name);
        about.unit.clone_from(&self.value_unit);
        about.length.clone_from(&self.unit);
        if let Some(name) = self.modality.as_deref() {
            let known = Modality::ALL.into_iter().find(|modality| modality.name() == name);
            about.modality = Some(known.ok_or_else(|| {
                wrong(format!(
                    "the modality “{name}” is none of ct, mr, emission, ultrasound and microscopy"
                ))
            })?);
        }
        about.orientation = match self.frame.as_deref() {
            Some("lps" | "ras") => Some(Orientation::RAS),
            _ => None,
        };
        if about.orientation.is_some() {
            about.frame = Frame::Patient;
        }
        if let Some(up) = self.up {
            let up = DVec3::from_array(up).try_normalize();
            let up = up.ok_or_else(|| wrong("up is a direction with a length above 0"))?;
            about.orientation = Some(Orientation::with_up(up));
        }
        Ok(about)
    }

    /// Returns the channels of an array that has this many.
    fn channels(&self, count: usize) -> Vec<Channel> {
        let names = self.channel_names.as_deref().unwrap_or_default();
        let name = |number: usize| names.get(number).cloned().unwrap_or_default();
        (0..count).map(|number| Channel { name: name(number), ..Channel::default() }).collect()
    }

    fn lattice(&self, dims: [usize; 3]) -> Lattice {
        let spacing = DMat3::from_diagonal(self.spacing.map_or(DVec3::ONE, DVec3::from_array));
        let axes =
            self.axes.map_or(DMat3::IDENTITY, |rows| DMat3::from_cols_array_2d(&rows).transpose());
        let origin = self.origin.map_or(DVec3::ZERO, DVec3::from_array);
        // A patient's world is RAS, whatever the frame of the arrays is.
        let turn = match self.frame.as_deref() {
            Some("lps") => DMat3::from_diagonal(DVec3::new(-1.0, -1.0, 1.0)),
            _ => DMat3::IDENTITY,
        };
        let mut lattice = Lattice::cartesian(dims, turn * origin, turn * axes * spacing);
        if let Some(coordinates) = &self.coordinates {
            lattice.arrangement = Arrangement::Rectilinear(Arc::new(coordinates.clone()));
        }
        lattice
    }
}

/// The arrays of a mesh or of points; `None` where there are none.
#[derive(FromPyObject)]
struct MeshArrays<'py> {
    #[pyo3(item)]
    positions: Bound<'py, PyAny>,
    #[pyo3(item)]
    faces: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    normals: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    colors: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    values: Option<Bound<'py, PyAny>>,
    /// The radius of each point of a cloud, in world units.
    #[pyo3(item)]
    radii: Option<Bound<'py, PyAny>>,
}

impl MeshArrays<'_> {
    fn mesh(&self, about: About) -> Result<Mesh, Error> {
        let (origin, positions) = positions(&self.positions)?;
        let mut mesh = Mesh { origin, positions, about, ..Mesh::default() };
        if let Some(faces) = &self.faces {
            mesh.triangles = rows::<u32, 3>(faces)?;
            let count = mesh.positions.len() as u32;
            let bad =
                mesh.triangles.iter().position(|triangle| triangle.iter().any(|&at| at >= count));
            if let Some(face) = bad {
                return Err(wrong(format!(
                    "face {face} names the vertices {:?}, but there are {count}",
                    mesh.triangles[face]
                )));
            }
        }
        if let Some(normals) = &self.normals {
            let given = rows::<f32, 3>(normals)?.into_iter();
            let unit = |row| Vec3::from_array(row).as_dvec3().normalize_or_zero().as_vec3();
            mesh.normals = given.map(unit).collect();
        }
        if let Some(colors) = &self.colors {
            mesh.colors = rows::<u8, 4>(colors)?;
        }
        if let Some(values) = &self.values {
            mesh.values = numbers::<f32>(values)?;
            mesh.about.holes = mesh.values.iter().filter(|value| !value.is_finite()).count() as u64;
            let no_value = |value: &mut f32| *value = f32::NAN;
            mesh.values.iter_mut().filter(|value| !value.is_finite()).for_each(no_value);
        }
        if let Some(radii) = &self.radii {
            mesh.radii = numbers::<f32>(radii)?;
        }
        let lists = [
            ("normals", mesh.normals.len()),
            ("colors", mesh.colors.len()),
            ("values", mesh.values.len()),
            ("radii", mesh.radii.len()),
        ];
        let count = mesh.positions.len();
        match lists.into_iter().find(|(_, length)| *length > 0 && *length != count) {
            Some((name, length)) => {
                Err(wrong(format!("there are {length} {name} for {count} positions")))
            }
            None => Ok(mesh),
        }
    }
}

/// The arrays of scattered samples.
#[derive(FromPyObject)]
struct SampleArrays<'py> {
    #[pyo3(item)]
    positions: Bound<'py, PyAny>,
    #[pyo3(item)]
    values: Bound<'py, PyAny>,
    #[pyo3(item)]
    radii: Option<Bound<'py, PyAny>>,
    #[pyo3(item)]
    covariances: Option<Bound<'py, PyAny>>,
}

impl SampleArrays<'_> {
    fn points(&self, about: About, missing: Option<f64>) -> Result<Points, Error> {
        let (origin, positions) = positions(&self.positions)?;
        let values = numbers::<f32>(&self.values)?;
        let radii = self.radii.as_ref().map(numbers::<f32>).transpose()?.unwrap_or_default();
        let covariances = self.covariances.as_ref().map(rows::<f32, 6>).transpose()?;
        let covariances = covariances.unwrap_or_default();
        let mut points = Points { origin, positions, values, radii, covariances, about };
        let is_hole = |value: f32| !value.is_finite() || missing.is_some_and(|m| value == m as f32);
        if points.values.len() == points.positions.len()
            && points.values.iter().any(|v| is_hole(*v))
        {
            points = without_holes(points, is_hole);
        }
        points.validate()?;
        Ok(points)
    }
}

/// Leaves out the samples without a value.
fn without_holes(points: Points, is_hole: impl Fn(f32) -> bool) -> Points {
    let Points { origin, positions, values, radii, covariances, mut about } = points;
    let keeps: Vec<bool> = values.iter().map(|value| !is_hole(*value)).collect();
    about.holes = keeps.iter().filter(|kept| !**kept).count() as u64;
    fn kept<T>(list: Vec<T>, keeps: &[bool]) -> Vec<T> {
        list.into_iter().zip(keeps).filter_map(|(item, keep)| keep.then_some(item)).collect()
    }
    Points {
        origin,
        positions: kept(positions, &keeps),
        values: kept(values, &keeps),
        radii: kept(radii, &keeps),
        covariances: kept(covariances, &keeps),
        about,
    }
}

/// The arrays of trained Gaussians.
#[derive(FromPyObject)]
struct GaussianArrays<'py> {
    #[pyo3(item)]
    centers: Bound<'py, PyAny>,
    #[pyo3(item)]
    scales: Bound<'py, PyAny>,
    #[pyo3(item)]
    rotations: Bound<'py, PyAny>,
    #[pyo3(item)]
    opacities: Bound<'py, PyAny>,
    /// Rows of red, green and blue: the terms of the first Gaussian, then those of the second, …
    #[pyo3(item)]
    harmonics: Bound<'py, PyAny>,
}

impl GaussianArrays<'_> {
    fn set(&self, about: About) -> Result<Gaussians, Error> {
        let (origin, centers) = positions(&self.centers)?;
        let scales = rows::<f32, 3>(&self.scales)?.into_iter().map(Vec3::from_array).collect();
        let turn = |[w, x, y, z]: [f32; 4]| Quat::from_xyzw(x, y, z, w);
        let rotations: Vec<Quat> = rows::<f32, 4>(&self.rotations)?.into_iter().map(turn).collect();
        let has_length = |turn: &Quat| turn.length_squared() > 0.0;
        if let Some(index) = rotations.iter().position(|turn| !has_length(turn)) {
            return Err(wrong(format!("the rotation of Gaussian {index} has no length")));
        }
        let rotations = rotations.into_iter().map(Quat::normalize).collect();
        let opacities = numbers::<f32>(&self.opacities)?;
        let harmonics = rows::<f32, 3>(&self.harmonics)?;
        let terms = harmonics.len() / centers.len().max(1);
        let degree = harmonics::degree_of(terms).ok_or_else(|| {
            wrong(format!("{terms} terms of harmonics are no degree; 1, 4, 9 or 16 are"))
        })?;
        let set = Gaussians {
            origin,
            centers,
            scales,
            rotations,
            opacities,
            degree,
            harmonics,
            about,
            ..Gaussians::default()
        };
        set.validate().map_err(wrong)?;
        Ok(set)
    }
}

impl Scene {
    /// Returns what is drawn.
    pub fn stage(&self) -> &Arc<Stage> {
        &self.0
    }

    /// Returns what was collected.
    fn collected(&self) -> Result<Arc<Collected>, Error> {
        self.1.clone().ok_or_else(|| wrong("nothing was collected for a page"))
    }

    /// Adds what an array has become, with its appearance.
    fn add(
        &self,
        py: Python<'_>,
        mut input: Data,
        facts: ArrayFacts,
        more: (ReadingEntry, AppearanceEntry),
    ) -> PyResult<()> {
        input.warn_of_holes(&facts.name);
        let moved = facts.transform.apply(Path::new(&facts.name), &mut input);
        moved.map_err(|error| raise(py, &error))?;
        let stop = Stop::default();
        if let Some(collected) = self.1.clone() {
            let appearance = more.1;
            return run(py, &stop, move || collected.add_array(input, &facts.name, appearance));
        }
        let (stage, (load, appearance)) = (self.0.clone(), more);
        let name = Name { text: facts.name, is_file: false };
        let worker_stop = stop.clone();
        run(py, &stop, move || {
            let showing = load.complete(appearance.showing(&load.limits())?, Deadline::NEVER)?;
            stage.add(Added { name, input, showing }, &worker_stop)
        })
    }
}

/// Channels are quantities.
fn no_labels(volume: &Volume) -> Option<&'static ArrayLabels> {
    (volume.about.channels.len() > 1).then_some(&ArrayLabels::Are(false))
}

/// Returns the numbers of the channels of an array to draw: those that are named, all, or the first
/// one.
fn channels_read(
    facts: &ArrayFacts,
    count: usize,
    named: Option<&[String]>,
) -> Result<Vec<usize>, Error> {
    let Some(named) = named else { return Ok(vec![0]) };
    if count > Channel::MOST && named.is_empty() {
        let most = Channel::MOST;
        return Err(wrong(format!(
            "the array has {count} channels, but a picture shows at most {most}; channels= chooses \
             some"
        )));
    }
    let all = facts.channels(count);
    let number = |name: &String| {
        let by_number = name.parse().ok().filter(|number| *number < count);
        let is_it = |channel: &Channel| channel.name.eq_ignore_ascii_case(name);
        by_number.or_else(|| all.iter().position(is_it)).ok_or_else(|| {
            let names: Vec<String> =
                (0..count).map(|number| Channel::name_of(&all, number)).collect();
            wrong(format!("there is no channel “{name}”; there are {}", names.join(", ")))
        })
    };
    match named {
        [] => Ok((0..count).collect()),
        _ if count == 1 => Ok(vec![0]),
        named => named.iter().map(number).collect(),
    }
}

/// Reads the options of an array.
fn array_options(
    facts: &str,
    load: &str,
    appearance: &str,
) -> Result<(ArrayFacts, (ReadingEntry, AppearanceEntry)), Error> {
    let facts: ArrayFacts = options(facts)?;
    facts.transform.validate()?;
    Ok((facts, (reading(load)?, self::appearance(appearance)?)))
}

#[pymethods]
impl Scene {
    #[new]
    fn new() -> Self {
        Self::default()
    }

    /// Returns an empty scene that collects for a page what is added, instead of drawing it.
    #[staticmethod]
    fn collecting() -> Self {
        Self(Arc::default(), Some(Arc::default()))
    }

    /// Sets the transfer functions of the input that was collected last, one for each field.
    fn show_last(&self, py: Python<'_>, transfers: Vec<String>) -> PyResult<()> {
        let read = transfers.iter().map(|text| TransferFunction::from_json(text));
        let set = read.collect::<Result<Vec<_>, _>>().and_then(|transfers| {
            let collected = self.1.as_ref();
            collected.map_or(Ok(()), |collected| collected.show_last(transfers))
        });
        set.map_err(|error| raise(py, &error))
    }

    /// Makes a page of what was collected. Returns what was written, as JSON.
    fn page(&self, py: Python<'_>, described: &str, wanted: &str) -> PyResult<String> {
        let made = self.collected().and_then(|collected| {
            let mut scene = self::described(described)?;
            scene.inputs = collected.inputs();
            Ok((collected, scene, options(wanted)?))
        });
        let (collected, scene, wanted) = made.map_err(|error| raise(py, &error))?;
        run(py, &Stop::default(), move || collected.page(&scene, &wanted))
    }

    /// Adds a file.
    fn add_file(
        &self,
        py: Python<'_>,
        path: PathBuf,
        load: &str,
        appearance: &str,
        facts: &str,
    ) -> PyResult<()> {
        let parsed = reading(load)
            .and_then(|load| Ok((load, self::appearance(appearance)?, options(facts)?)));
        let parsed: (_, _, FileFacts) = parsed.map_err(|error| raise(py, &error))?;
        let (load, appearance, facts) = parsed;
        if let Some(collected) = &self.1 {
            let FileFacts { transform, edits, .. } = facts;
            let new = InputEntry::new(path);
            collected.add(InputEntry { reading: load, appearance, transform, edits, ..new });
            return Ok(());
        }
        let (stage, stop) = (self.0.clone(), Stop::default());
        let worker_stop = stop.clone();
        run(py, &stop, move || {
            // One deadline covers reading the input and making its splats.
            let FileFacts { transform, edits, .. } = facts;
            let input = InputEntry { transform, edits, ..InputEntry::new(path) };
            let mut scene = Description::new([]);
            (scene.reading, scene.appearance) = (load.begun(), appearance);
            scene.picture.optics = facts.optics;
            let read = scene.read_input(&input)?;
            let name = Name::of_file(&input.file);
            stage.add(Added { name, input: read.data, showing: read.showing }, &worker_stop)
        })
    }

    /// Returns a scene of the first inputs alone, which shares what they were made into.
    fn forked(&self, count: usize) -> Self {
        Self(Arc::new(self.0.forked(count)), None)
    }

    /// Adds the samples of an array for each channel, and those that say how opaque they are.
    fn add_volume(
        &self,
        py: Python<'_>,
        arrays: (Vec<Bound<'_, PyAny>>, Option<Bound<'_, PyAny>>),
        facts: &str,
        load: &str,
        appearance: &str,
    ) -> PyResult<()> {
        let (channels, opacity) = arrays;
        let (facts, more) =
            array_options(facts, load, appearance).map_err(|error| raise(py, &error))?;
        let read = channels_read(&facts, channels.len(), more.1.channels_read().as_deref());
        let made = read.and_then(|read| {
            let parts = read.iter().map(|number| samples(&channels[*number]));
            let parts = parts.collect::<Result<Vec<_>, _>>()?;
            Ok((read, parts, opacity.as_ref().map(samples).transpose()?, facts.about()?))
        });
        let (read, parts, opacity, about) = made.map_err(|error| raise(py, &error))?;
        let (lattice, missing) = (facts.lattice(parts[0].0), facts.missing);
        let labels = facts.labels.clone();
        let names = facts.channels(channels.len());
        let measured = move || {
            let plain = |samples| Volume::with_missing(lattice.clone(), samples, missing);
            let mut volumes = read.into_iter().zip(parts).map(|(number, (_, samples))| {
                let mut volume = plain(samples)?;
                let holes = std::mem::replace(&mut volume.about, about.clone()).holes;
                volume.about.holes = holes;
                if names.len() > 1 {
                    volume.about.name.clone_from(&names[number].name);
                    (volume.about.channels, volume.about.channel) = (names.clone(), number);
                }
                Ok::<_, Error>(volume)
            });
            let first = volumes.next().expect("a volume has at least one channel")?;
            let mut volume = Volume { more_channels: volumes.collect::<Result<_, _>>()?, ..first };
            volume.opacities =
                opacity.map(|(_, samples)| plain(samples)).transpose()?.map(Arc::new);
            ArrayLabels::apply(labels.as_ref().or(no_labels(&volume)), volume)
        };
        let volume: Volume = run(py, &Stop::default(), measured)?;
        self.add(py, Data::Volume(volume), facts, more)
    }

    /// Adds a mesh, or points if there are no faces.
    fn add_mesh(
        &self,
        py: Python<'_>,
        arrays: MeshArrays<'_>,
        facts: &str,
        load: &str,
        appearance: &str,
    ) -> PyResult<()> {
        let made = array_options(facts, load, appearance)
            .and_then(|(facts, more)| Ok((arrays.mesh(facts.about()?)?, facts, more)));
        let (mesh, facts, more) = made.map_err(|error| raise(py, &error))?;
        self.add(py, Data::Mesh(mesh), facts, more)
    }

    /// Adds cells.
    fn add_cells(
        &self,
        py: Python<'_>,
        arrays: CellArrays<'_>,
        facts: &str,
        appearance: &str,
    ) -> PyResult<()> {
        let made = array_options(facts, "{}", appearance).and_then(|(facts, more)| {
            Ok((arrays.cells(facts.about()?, facts.missing)?, facts, more))
        });
        let (cells, facts, more) = made.map_err(|error| raise(py, &error))?;
        self.add(py, Data::Cells(cells), facts, more)
    }

    /// Adds samples at any positions.
    fn add_samples(
        &self,
        py: Python<'_>,
        arrays: SampleArrays<'_>,
        facts: &str,
        load: &str,
        appearance: &str,
    ) -> PyResult<()> {
        let made = array_options(facts, load, appearance).and_then(|(facts, more)| {
            Ok((arrays.points(facts.about()?, facts.missing)?, facts, more))
        });
        let (points, facts, more) = made.map_err(|error| raise(py, &error))?;
        self.add(py, Data::Samples(points), facts, more)
    }

    /// Adds trained Gaussians.
    fn add_gaussians(
        &self,
        py: Python<'_>,
        arrays: GaussianArrays<'_>,
        facts: &str,
    ) -> PyResult<()> {
        let made = array_options(facts, "{}", "{}")
            .and_then(|(facts, more)| Ok((arrays.set(facts.about()?)?, facts, more)));
        let (set, facts, more) = made.map_err(|error| raise(py, &error))?;
        self.add(py, Data::Gaussians(set), facts, more)
    }

    /// What the scene holds: kind, number of the input, and the number of splats or samples.
    #[getter]
    fn contents(&self) -> Vec<(&'static str, usize, u64)> {
        self.0.contents()
    }

    /// The smallest and the largest coordinates; `None` for an empty scene.
    #[getter]
    fn bounds(&self) -> Option<[[f64; 3]; 2]> {
        self.0.bounds().map(|bounds| [bounds.min.to_array(), bounds.max.to_array()])
    }

    /// Where the work of a picture lies: x, y, z and a weight, row by row.
    fn weights<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let stage = self.0.clone();
        let rows = run(py, &Stop::default(), move || stage.weights())?;
        Ok(PyArray1::from_slice(py, rows.as_flattened()))
    }

    /// Refuses options of drawing that the scene cannot be drawn with.
    fn check(&self, py: Python<'_>, draw: &str) -> PyResult<()> {
        let draw = Draw::parse(draw).map_err(|error| raise(py, &error))?;
        let stage = self.0.clone();
        run(py, &Stop::default(), move || stage.check(&draw))
    }

    /// The camera that is fitted to the scene, as JSON.
    fn camera(&self, py: Python<'_>, fit: &str, draw: &str) -> PyResult<String> {
        let parsed = framing(fit).and_then(|fit| Ok((fit, Draw::parse(draw)?)));
        let (fit, draw) = parsed.map_err(|error| raise(py, &error))?;
        let stage = self.0.clone();
        run(py, &Stop::default(), move || stage.camera(&fit, &draw).map(|camera| to_json(&camera)))
    }

    /// The cameras of a turntable, as JSON.
    fn turntable(
        &self,
        py: Python<'_>,
        frames: u32,
        fit: &str,
        draw: &str,
    ) -> PyResult<Vec<String>> {
        let parsed = framing(fit).and_then(|fit| Ok((fit, Draw::parse(draw)?)));
        let (fit, draw) = parsed.map_err(|error| raise(py, &error))?;
        let stage = self.0.clone();
        run(py, &Stop::default(), move || {
            Ok(stage.turntable(&fit, &draw, frames)?.iter().map(to_json).collect())
        })
    }

    /// Draws layers of the picture that a camera takes.
    fn layers(
        &self,
        py: Python<'_>,
        camera: String,
        draw: &str,
        wanted: Vec<String>,
    ) -> PyResult<Layers> {
        let layer = |name: &String| {
            let known = Layer::ALL.into_iter().find(|layer| layer.name() == name);
            let names = Layer::ALL.map(Layer::name).join(", ");
            known.ok_or_else(|| wrong(format!("there is no layer “{name}”; there are {names}")))
        };
        let wanted = wanted.iter().map(layer).collect::<Result<Vec<_>, _>>();
        let parsed = wanted.and_then(|wanted| Ok((wanted, Draw::parse(draw)?)));
        let (wanted, draw) = parsed.map_err(|error| raise(py, &error))?;
        let (stage, stop) = (self.0.clone(), Stop::default());
        let worker_stop = stop.clone();
        let layers = run(py, &stop, move || stage.layers(&camera, &draw, &wanted, &worker_stop))?;
        Ok(layers.into())
    }

    /// Draws a picture by a camera, or else by one that is fitted to the scene.
    fn render(
        &self,
        py: Python<'_>,
        camera: Option<String>,
        fit: &str,
        draw: &str,
    ) -> PyResult<Picture> {
        let parsed = framing(fit).and_then(|fit| Ok((fit, Draw::parse(draw)?)));
        let (fit, draw) = parsed.map_err(|error| raise(py, &error))?;
        let (stage, stop) = (self.0.clone(), Stop::default());
        let worker_stop = stop.clone();
        let drawn = run(py, &stop, move || {
            let viewpoint = match &camera {
                Some(camera) => Viewpoint::Camera(camera),
                None => Viewpoint::Fitted(&fit),
            };
            stage.draw(viewpoint, &draw, Effort::EXACT, &worker_stop)
        })?;
        Ok(drawn.into())
    }
}

/// Reads a scene file. Returns as JSON its visible inputs, with how each is read, moved and shown;
/// its camera, how one is fitted, the picture, what is written over it, and what draws.
#[pyfunction]
pub fn read_scene(py: Python<'_>, path: PathBuf, is_trusted: bool) -> PyResult<String> {
    run(py, &Stop::default(), move || {
        let limits = Limits::default();
        let scene = match is_trusted {
            true => Description::read_trusted(&path, &limits)?,
            false => Description::read(&path, &limits)?,
        };
        let input = |input: &InputEntry| {
            serde_json::json!({
                "file": input.file,
                "reading": scene.reading_of(input),
                "transform": input.transform,
                "edits": input.edits,
                "appearance": scene.appearance_of(input),
            })
        };
        let inputs: Vec<_> = scene.visible().map(input).collect();
        let Description { camera, framing, picture, overlay, engine, .. } = &scene;
        let engine = Some(engine).filter(|engine| **engine != Engine::default());
        let described = serde_json::json!({
            "inputs": inputs, "camera": camera, "framing": framing, "picture": picture,
            "overlay": overlay, "engine": engine,
        });
        Ok(described.to_string())
    })
}

/// How the picture of a scene file is drawn: the parts that [`read_scene`] returns.
#[derive(Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Described {
    camera: Option<CameraEntry>,
    framing: Framing,
    picture: PictureEntry,
    overlay: OverlayEntry,
    engine: Option<Engine>,
}

/// Returns a scene without inputs.
fn described(text: &str) -> Result<Description, Error> {
    let Described { camera, framing, picture, overlay, engine } = options(text)?;
    let mut scene = Description::new([]);
    (scene.camera, scene.framing) = (camera, framing);
    (scene.picture, scene.overlay) = (picture, overlay);
    scene.engine = engine.unwrap_or_default();
    Ok(scene)
}

/// Writes a scene file: inputs with how each is read, shown and moved as JSON, and how the picture
/// is drawn.
#[pyfunction]
pub fn write_scene(
    py: Python<'_>,
    path: PathBuf,
    inputs: Vec<(PathBuf, String, String, String, String)>,
    described: &str,
) -> PyResult<()> {
    let made = || -> Result<Description, Error> {
        let mut scene = self::described(described)?;
        for (file, load, appearance, transform, edits) in inputs {
            let (reading, appearance) = (reading(&load)?, self::appearance(&appearance)?);
            let (transform, edits) = (options(&transform)?, options(&edits)?);
            let new = InputEntry::new(file);
            scene.inputs.push(InputEntry { reading, appearance, transform, edits, ..new });
        }
        scene.check().map_err(|(place, message)| wrong(format!("{place}: {message}")))?;
        Ok(scene)
    };
    let scene = made().map_err(|error| raise(py, &error))?;
    run(py, &Stop::default(), move || scene.write(&path))
}
