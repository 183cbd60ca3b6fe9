//! Writes E57, points with colours and intensities in one scan, piece by piece.
//!
//! The crate's writer of a scan borrows its writer of files, so both live on a thread of their own,
//! which ends the file when no more points come.

use crate::{
    Error, Result,
    disk::AtomicFile,
    formats::{
        Attribute, NumberType, Records,
        points::{PointLayout, PointWriter, columns},
    },
    math::keep::Keeper,
    warning,
};
use ::e57::{E57Writer, RawValues, Record, RecordDataType, RecordName, RecordValue};
use glam::DVec3;
use std::{
    error::Error as _,
    io,
    path::{Path, PathBuf},
    sync::mpsc::{self, SyncSender},
    thread::{self, JoinHandle},
};

/// Pieces that may wait for the thread.
const WAITING: usize = 2;

/// The attribute that scans have a place for.
const INTENSITY: &str = "intensity";

/// Attributes that points have beside their colours, of which they are the source.
const CHANNELS: [&str; 3] = ["red", "green", "blue"];

/// What the numbers of a record are.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Kind {
    Single,
    Double,
    Whole([i64; 2]),
    /// Steps from an offset, with their size, and the least and the greatest number of them.
    Steps {
        size: f64,
        offset: f64,
        ends: [i64; 2],
    },
}

impl Kind {
    /// Returns the kind that holds the numbers of an attribute.
    fn of(kind: NumberType) -> Self {
        match kind {
            NumberType::F32 => Self::Single,
            // Whole numbers beyond 53 bits are not exact here either.
            NumberType::F64 | NumberType::U64 | NumberType::I64 => Self::Double,
            _ => kind.whole().map_or(Self::Double, |ends| Self::Whole(ends.map(|end| end as i64))),
        }
    }

    fn data_type(self) -> RecordDataType {
        match self {
            Self::Single => RecordDataType::Single { min: None, max: None },
            Self::Double => RecordDataType::Double { min: None, max: None },
            Self::Whole([min, max]) => RecordDataType::Integer { min, max },
            Self::Steps { size, offset, ends: [min, max] } => {
                RecordDataType::ScaledInteger { min, max, scale: size, offset }
            }
        }
    }

    /// Returns what is left of a number.
    fn stored(self, value: f64) -> f64 {
        match self.value(value) {
            RecordValue::Single(single) => single.into(),
            RecordValue::Double(double) => double,
            RecordValue::Integer(whole) => whole as f64,
            RecordValue::ScaledInteger(steps) => match self {
                Self::Steps { size, offset, .. } => steps as f64 * size + offset,
                _ => f64::NAN,
            },
        }
    }

    fn value(self, value: f64) -> RecordValue {
        match self {
            Self::Single => RecordValue::Single(value as f32),
            Self::Double => RecordValue::Double(value),
            Self::Whole([low, high]) => {
                RecordValue::Integer((value.round() as i64).clamp(low, high))
            }
            Self::Steps { size, offset, ends: [low, high] } => {
                let steps = ((value - offset) / size).round() as i64;
                RecordValue::ScaledInteger(steps.clamp(low, high))
            }
        }
    }
}

/// The records of a point, in their order.
struct Shape {
    axes: [Kind; 3],
    keeper: Keeper,
    /// Colours have 8 bits, because some readers take no others.
    has_colors: bool,
    intensity: Option<(Attribute, Kind)>,
}

impl Shape {
    fn new(layout: &PointLayout) -> Self {
        let intensity = layout.attributes.iter().find(|attribute| attribute.name == INTENSITY);
        Self {
            axes: axes(layout),
            keeper: Keeper::new("E57", layout.bounds),
            has_colors: layout.has_colors,
            intensity: intensity.map(|attribute| (attribute.clone(), Kind::of(attribute.kind))),
        }
    }

    /// Returns the names of attributes that have no place.
    fn left_out(&self, layout: &PointLayout) -> Vec<String> {
        let has_place =
            |name: &str| name == INTENSITY || self.has_colors && CHANNELS.contains(&name);
        let normals = layout.has_normals.then(|| "normals".to_owned());
        let names = layout.attributes.iter().map(|attribute| &attribute.name);
        normals.into_iter().chain(names.filter(|name| !has_place(name)).cloned()).collect()
    }

    fn prototype(&self) -> Vec<Record> {
        let axes = [RecordName::CartesianX, RecordName::CartesianY, RecordName::CartesianZ];
        let mut records: Vec<(RecordName, Kind)> = axes.into_iter().zip(self.axes).collect();
        if self.has_colors {
            let channels = [RecordName::ColorRed, RecordName::ColorGreen, RecordName::ColorBlue];
            records.extend(channels.map(|name| (name, Kind::Whole([0, 255]))));
        }
        if let Some((_, kind)) = &self.intensity {
            records.push((RecordName::Intensity, *kind));
        }
        let record =
            |(name, kind): (RecordName, Kind)| Record { name, data_type: kind.data_type() };
        records.into_iter().map(record).collect()
    }

    /// Returns the values of points, in the order of the records. Missing intensities are 0 among
    /// whole numbers.
    fn values(&self, records: &Records) -> Result<Vec<RawValues>> {
        for place in &records.positions {
            let stored = [0, 1, 2].map(|axis| self.axes[axis].stored(place[axis]));
            self.keeper.check(*place, DVec3::from_array(stored) - *place)?;
        }
        let column = self.intensity.as_ref().and_then(|(attribute, _)| {
            columns(records, std::slice::from_ref(attribute)).pop().flatten()
        });
        let point = |(row, place): (usize, &DVec3)| {
            let axes = self.axes.iter().zip(place.to_array());
            let mut values: RawValues = axes.map(|(kind, part)| kind.value(part)).collect();
            if self.has_colors {
                let [r, g, b, _] = records.colors.get(row).copied().unwrap_or([255; 4]);
                values.extend([r, g, b].map(|part| RecordValue::Integer(part.into())));
            }
            if let Some((_, kind)) = &self.intensity {
                values.push(kind.value(column.map_or(f64::NAN, |column| column[row])));
            }
            values
        };
        Ok(records.positions.iter().enumerate().map(point).collect())
    }
}

/// Returns how coordinates are stored: as steps if the points have such, else with 32 bits unless
/// they are too far from the origin.
fn axes(layout: &PointLayout) -> [Kind; 3] {
    let [low, high] = layout.bounds;
    let Some([size, offset]) = layout.grid else {
        return [if layout.needs_64_bits() { Kind::Double } else { Kind::Single }; 3];
    };
    [0, 1, 2].map(|axis| {
        let steps = |place: f64| (place - offset[axis]) / size[axis];
        let low = steps(low[axis]).floor() as i64;
        // Readers cannot count points that take no bits.
        let high = (steps(high[axis]).ceil() as i64).max(low.saturating_add(1));
        Kind::Steps { size: size[axis], offset: offset[axis], ends: [low, high] }
    })
}

/// Returns a name that is unlike those of other scans.
fn identifier(path: &Path, layout: &PointLayout, what: &str) -> String {
    let text = format!("{what} {} {layout:?}", path.display());
    let hash = blake3::hash(text.as_bytes()).to_hex();
    let part = |from: usize, to: usize| hash.get(from..to).unwrap_or_default();
    let parts = [part(0, 8), part(8, 12), part(12, 16), part(16, 20), part(20, 32)];
    format!("{{{}}}", parts.join("-"))
}

/// Returns the error of the system behind one of the crate, if there is one.
fn because(error: ::e57::Error) -> io::Error {
    let mut cause = error.source();
    while let Some(inner) = cause {
        if let Some(inner) = inner.downcast_ref::<io::Error>() {
            return io::Error::new(inner.kind(), inner.to_string());
        }
        cause = inner.source();
    }
    io::Error::other(error.to_string())
}

/// An E57 file that is being written.
pub struct Writer {
    path: PathBuf,
    shape: Shape,
    left_out: Vec<String>,
    count: u64,
    /// Takes points to the thread; `None` once no more come.
    points: Option<SyncSender<Vec<RawValues>>>,
    thread: Option<JoinHandle<io::Result<AtomicFile>>>,
}

impl Writer {
    /// Begins a file. A warning names the attributes that it has no place for.
    pub(crate) fn create(path: &Path, layout: &PointLayout) -> Result<Self> {
        let shape = Shape::new(layout);
        let left_out = shape.left_out(layout);
        if !left_out.is_empty() {
            warning::give!(
                "{}: E57 has no place for {}, which are left out; .laz and .points.ply keep all \
                 attributes",
                path.display(),
                left_out.join(", ")
            );
        }
        let (file, prototype) = (AtomicFile::create(path)?, shape.prototype());
        let [of_file, of_scan] = ["file", "scan"].map(|what| identifier(path, layout, what));
        let (points, pieces) = mpsc::sync_channel::<Vec<RawValues>>(WAITING);
        let write = move || {
            let mut file = file;
            let mut writer = E57Writer::new(&mut file, &of_file).map_err(because)?;
            let mut scan = writer.add_pointcloud(&of_scan, prototype).map_err(because)?;
            for point in pieces.into_iter().flatten() {
                scan.add_point(point).map_err(because)?;
            }
            scan.finalize().map_err(because)?;
            writer.finalize().map_err(because)?;
            drop(writer);
            Ok(file)
        };
        let thread = thread::Builder::new().name("E57".into()).spawn(write);
        let thread = thread.map_err(|error| Error::output(path, error))?;
        let (points, thread) = (Some(points), Some(thread));
        Ok(Self { path: path.to_owned(), shape, left_out, count: 0, points, thread })
    }

    /// Waits for the thread, and returns the file, which has no name yet.
    fn end(&mut self) -> Result<AtomicFile> {
        drop(self.points.take());
        let gone = || io::Error::other("the thread that writes it has ended early");
        let result = self.thread.take().and_then(|thread| thread.join().ok());
        result.unwrap_or_else(|| Err(gone())).map_err(|error| Error::output(&self.path, error))
    }
}

impl PointWriter for Writer {
    fn put(&mut self, records: &Records) -> Result<()> {
        let values = self.shape.values(records)?;
        self.count += values.len() as u64;
        let sent = self.points.as_ref().map(|points| points.send(values));
        // The thread is gone only after an error.
        if matches!(sent, Some(Ok(()))) { Ok(()) } else { self.end().map(drop) }
    }

    fn left_out(&self) -> &[String] {
        &self.left_out
    }

    fn finish(mut self: Box<Self>) -> Result<u64> {
        self.end()?.commit()?;
        Ok(self.count)
    }
}

impl Drop for Writer {
    /// Removes the file if it is not finished, before the process can end.
    fn drop(&mut self) {
        if self.thread.is_some() {
            self.end().ok();
        }
    }
}

#[cfg(test)]
mod tests;
