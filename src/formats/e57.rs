//! E57, the format of terrestrial laser scanners (ASTM E2807): all scans of a file as one point
//! cloud, read by the `e57` crate.

mod description;
mod streams;
#[cfg(test)]
mod tests;
mod write;

pub(crate) use write::Writer;

use super::shared::{
    attribute,
    cloud::{Cloud, greys},
};
use crate::{
    Result,
    about::{About, Orientation},
    input::{Source, growing::Growing, isolate::isolated},
    surface::Mesh,
};
use ::e57::{CartesianCoordinate, E57Reader, Point, PointCloud, RecordDataType, RecordName};
use glam::DVec3;
use std::{
    io::{Cursor, Read, Seek},
    ops::Range,
};

/// Points that are read between two checks of the time limit.
const POINTS: u64 = 1 << 16;

/// Reads all scans, each transformed by its pose. Points have Cartesian or spherical coordinates,
/// and colours. If no scan has colours, intensities are drawn as greys. Points without a valid
/// position are left out.
///
/// A scanner stood at the origin of its scan, unless the points are in world coordinates already.
/// This is assumed of a scan without a pose of its own whose points are neither spherical nor in
/// rows and columns.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed file, a page with a wrong checksum, and
/// scans that end before their last point; [`Error::Limit`](crate::Error::Limit) for more points
/// than the limits allow.
pub fn read(source: &Source) -> Result<Mesh> {
    read_named(source, None)
}

/// As [`read`], with the values of the attribute that `scalar` names: `intensity`.
///
/// # Errors
/// Those of [`read`]; [`Error::Input`](crate::Error::Input) for another name.
pub fn read_named(source: &Source, scalar: Option<&str>) -> Result<Mesh> {
    let named = scalar.map(|name| attribute::named(source, "scans", name, &["intensity"]));
    let has_values = named.transpose()?.is_some();
    // The crate asserts on numbers of the file and clamps by them, which may panic.
    let cloud = isolated(source, "scans", || read_scans(source, has_values))?;
    cloud.into_mesh(source)
}

/// Reads the points of all scans.
fn read_scans(source: &Source, has_values: bool) -> Result<Cloud> {
    let unreadable =
        |error: ::e57::Error| source.error("file", format!("cannot be read as E57: {error}"));
    let xml = E57Reader::raw_xml(Cursor::new(source.bytes())).map_err(unreadable)?;
    description::check(source, &xml)?;
    let mut file = E57Reader::new(Cursor::new(source.bytes())).map_err(unreadable)?;
    let scans = file.pointclouds();
    let claimed = scans.iter().fold(0u64, |sum, scan| sum.saturating_add(scan.records));
    source.check_points("the number of points", claimed)?;
    let mut points = Points::new(source);
    for (number, scan) in scans.iter().enumerate() {
        points.add_scan(&mut file, scan, number)?;
    }
    let left_out = claimed.saturating_sub(points.positions.len() as u64);
    if left_out > 0 {
        tracing::info!(points = left_out, "points without a valid position are left out");
    }
    points.into_cloud(has_values)
}

/// The points of the scans that are read so far.
struct Points<'a> {
    source: &'a Source<'a>,
    positions: Growing<'a, DVec3>,
    /// White for points without a colour.
    colors: Growing<'a, [u8; 4]>,
    has_colors: bool,
    /// NaN for points without an intensity.
    intensities: Growing<'a, f32>,
    sensors: Vec<(DVec3, Range<usize>)>,
}

impl<'a> Points<'a> {
    fn new(source: &'a Source<'a>) -> Self {
        Self {
            source,
            positions: Growing::new(source, "the positions"),
            colors: Growing::new(source, "the colours"),
            has_colors: false,
            intensities: Growing::new(source, "the intensities"),
            sensors: Vec::new(),
        }
    }

    /// Adds the points of a scan, and its scanner.
    fn add_scan(
        &mut self,
        file: &mut E57Reader<impl Read + Seek>,
        scan: &PointCloud,
        number: usize,
    ) -> Result<()> {
        let source = self.source;
        let wrong = |message: String| source.error(format!("scan {number}"), message);
        check(scan).map_err(|message| wrong(message.into()))?;
        streams::check(source, scan, number, streams::MOST_WAITING)?;
        let start = self.positions.len();
        let mut points = file.pointcloud_simple(scan).map_err(|error| wrong(error.to_string()))?;
        points.intensity_to_color(false);
        points.normalize_intensity(false);
        let mut index = 0u64;
        for point in points {
            let point = match point {
                Ok(point) => point,
                // The crate returns this for a packet that completes no point, such as an index
                // packet. The next call reads on, and reaches the end of the file at the latest.
                Err(::e57::Error::Internal { .. }) => {
                    source.check_time()?;
                    continue;
                }
                Err(error) => return Err(wrong(format!("ends after {index} points: {error}"))),
            };
            index += 1;
            // Points without a position are not kept, but take time.
            if index.is_multiple_of(POINTS) {
                source.check_time()?;
            }
            self.add(&point)?;
        }
        if let Some(sensor) = sensor(scan) {
            self.sensors.push((sensor, start..self.positions.len()));
        }
        Ok(())
    }

    /// Adds a point if it has a valid position.
    fn add(&mut self, point: &Point) -> Result<()> {
        let CartesianCoordinate::Valid { x, y, z } = point.cartesian else { return Ok(()) };
        self.positions.push(DVec3::new(x, y, z))?;
        let color = point.color.as_ref().map(|color| [color.red, color.green, color.blue]);
        self.has_colors |= color.is_some();
        // Points without a colour are white if others have colours.
        let [r, g, b] = color.unwrap_or([1.0; 3]).map(|part| (part * 255.0).round() as u8);
        self.colors.push([r, g, b, 255])?;
        self.intensities.push(point.intensity.unwrap_or(f32::NAN))
    }

    fn into_cloud(self, has_values: bool) -> Result<Cloud> {
        // `greys` sorts a copy of the intensities.
        self.source.room::<f32>("the intensities", self.intensities.len())?;
        let colors =
            if self.has_colors { self.colors.into_inner() } else { greys(&self.intensities) };
        let mut about = About::default();
        if self.intensities.iter().any(|value| value.is_finite()) {
            about.attributes = vec!["intensity".into()];
        }
        if has_values {
            about.name = "intensity".into();
        }
        Ok(Cloud {
            positions: self.positions.into_inner(),
            colors,
            sensors: self.sensors,
            values: if has_values { self.intensities.into_inner() } else { Vec::new() },
            about: About { orientation: Some(Orientation::SURVEY), ..about },
            ..Cloud::default()
        })
    }
}

/// Returns an error for a scan whose values all take zero bits: nothing would end the crate's
/// iteration over it.
fn check(scan: &PointCloud) -> Result<(), &'static str> {
    let takes_bits = scan.prototype.iter().any(|record| match record.data_type {
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            min < max
        }
        _ => true,
    });
    if !takes_bits { Err("has points that take zero bits") } else { Ok(()) }
}

/// Returns where the scanner of a scan stood.
fn sensor(scan: &PointCloud) -> Option<DVec3> {
    let has = |name: RecordName| scan.prototype.iter().any(|record| record.name == name);
    let as_scanned = has(RecordName::SphericalRange)
        || has(RecordName::RowIndex) && has(RecordName::ColumnIndex);
    let place = scan.transform.as_ref().map(|pose| &pose.translation);
    let place = place.map_or(DVec3::ZERO, |place| DVec3::new(place.x, place.y, place.z));
    (place.is_finite() && (place != DVec3::ZERO || as_scanned)).then_some(place)
}
