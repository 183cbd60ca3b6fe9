//! HDF5 files: a data set of numbers as a volume. NetCDF-4, Imaris, ilastik and BigDataViewer write
//! HDF5 as well.

mod attributes;
mod coordinates;
mod file;
mod span;
mod vtkhdf;

use super::{
    Endian, Kind, ReadOptions, SampleType,
    array::{Array, Place},
    foreign,
    npy::{self, Shaped},
    shared::{grid::Element, listing},
};
use crate::{
    Result, about::Orientation, cells::Cells, input::Source, surface::Mesh, volume::Volume,
};
use attributes::Attributes;
use coordinates::Coordinates;
use file::{File, StoredSet};
use hdf5_pure::{Datatype, DatatypeByteOrder};
use vtkhdf::DataSet;

/// A byte of a compressed data set unpacks to fewer bytes than this. Parts that were never written
/// take no bytes, so a false size could make any number of them.
const MOST_UNPACKED: u64 = 1 << 13;

/// Returns the kind of data: cells or a surface for these data sets of VTKHDF, else a volume.
///
/// # Errors
/// As [`read`], for the file.
pub fn kind(source: &Source) -> Result<Kind> {
    // Meshes of solvers are HDF5 too, and their arrays are no volumes.
    if let Some(error) = foreign::mesh_by_name(source) {
        return Err(error);
    }
    let file = File::open(source)?;
    DataSet::of(source, &file)?.map_or(Ok(Kind::Volume), |data| data.kind())
}

/// Reads an unstructured grid of VTKHDF. [`ReadOptions::scalar`] names its values.
///
/// # Errors
/// As [`read`].
pub fn read_cells(source: &Source, options: &ReadOptions) -> Result<Cells> {
    let file = File::open(source)?;
    match DataSet::of(source, &file)? {
        Some(data) if data.kind()? == Kind::Cells => data.cells(options),
        _ => Err(vtkhdf::other_kind(source)),
    }
}

/// Reads a surface of VTKHDF. [`ReadOptions::scalar`] names its values.
///
/// # Errors
/// As [`read`].
pub fn read_mesh(source: &Source, options: &ReadOptions) -> Result<Mesh> {
    let file = File::open(source)?;
    match DataSet::of(source, &file)? {
        Some(data) if data.kind()? == Kind::Mesh => data.mesh(options),
        _ => Err(vtkhdf::other_kind(source)),
    }
}

/// Reads the data set that [`ReadOptions::dataset`] names (`group/name`), as a volume; otherwise
/// the largest of three dimensions, or if there is none of two, which is a picture. Its last
/// dimension is x ([`npy::read_volume`] says what a fourth one means). Storage may be
/// contiguous, compact or in chunks, with the filters deflate, shuffle, Fletcher-32, LZF and
/// scale-offset.
///
/// Image data of VTKHDF are read as such: with their origin, spacing and directions, and the array
/// that [`ReadOptions::scalar`] names.
///
/// Attributes of the data set that name the distance between samples along its dimensions are
/// followed: `element_size_um` (ilastik, Fiji), `voxel_size`, `spacing`. `scale_factor`,
/// `add_offset`, `_FillValue` and `missing_value` have the meaning of NetCDF: values are scaled,
/// and samples of these values are holes. `units` and `long_name` name the values.
///
/// Dimension scales (the coordinate variables of NetCDF) place the samples, at even or uneven
/// distances and in either direction. Of a data set of four dimensions with scales, the first
/// volume is read, or the one that [`ReadOptions::time`] names.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed file, and for data sets that are no
/// numbers. Also for an unknown name, with those that the file contains, and for an unknown filter,
/// with its number. [`Error::Limit`](crate::Error::Limit) for a data set over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    let file = File::open(source)?;
    if options.dataset.is_none()
        && let Some(data) = DataSet::of(source, &file)?
    {
        return match data.kind()? {
            Kind::Volume => data.volume(options),
            _ => Err(vtkhdf::other_kind(source)),
        };
    }
    let sets = file.data_sets()?;
    let chosen = chosen(source, &sets, options)?;
    let coordinates = Coordinates::of(source, &sets, chosen);
    let mut shaped = shaped(source, chosen)?;
    let counted = shaped.counted_axes();
    if let (Some(names), [first, ..]) = (&mut shaped.outer, &counted[..]) {
        *names = coordinates.names(*first);
    }
    let data = file.bytes(chosen, shaped.bytes())?;
    let attributes = Attributes::of(&chosen.attributes);
    let missing = options.missing.or(attributes.missing);
    let options = ReadOptions { missing, ..options.clone() };
    let mut volume = npy::volume_of(source, &shaped, data.into(), &options)?;
    attributes.apply(source, &mut volume)?;
    if let Some(dimensions) = shaped.space() {
        let are_placed = coordinates.apply(source, &file, &mut volume, dimensions, &options)?;
        if are_placed && shaped.is_picture() {
            // Coordinates ascend upwards, whatever the order of the rows is.
            volume.about.orientation = Some(Orientation::Y_UP);
        }
    }
    Ok(volume)
}

/// Lists the data sets.
///
/// # Errors
/// As [`read`], for the file.
pub fn arrays(source: &Source, options: &ReadOptions) -> Result<Vec<Array>> {
    let file = File::open(source)?;
    if options.dataset.is_none()
        && let Some(data) = DataSet::of(source, &file)?
    {
        return data.list(options);
    }
    let sets = file.data_sets()?;
    let drawn = chosen(source, &sets, options).ok().map(|chosen| chosen.path.clone());
    let array = |set: &StoredSet| Array {
        name: set.path.clone(),
        place: Place::Points,
        kind: described(set),
        components: 1,
        range: None,
        is_drawn: drawn.as_ref() == Some(&set.path),
    };
    Ok(sets.iter().map(array).collect())
}

/// Returns the type and the shape of a data set.
fn described(set: &StoredSet) -> String {
    let shape: Vec<String> = set.shape.iter().map(ToString::to_string).collect();
    let kind = number_type(&set.datatype)
        .map_or_else(|| set.datatype.to_string(), |(element, ..)| element.name());
    format!("{} ({})", kind.chars().take(40).collect::<String>(), shape.join(", "))
}

/// Returns the data set to draw.
fn chosen<'a>(
    source: &Source,
    sets: &'a [StoredSet],
    options: &ReadOptions,
) -> Result<&'a StoredSet> {
    let list = || listing(sets.iter().map(|set| format!("“{}”, {}", set.path, described(set))));
    if let Some(name) = &options.dataset {
        let name = name.trim_matches('/');
        return sets.iter().find(|set| set.path == name).ok_or_else(|| {
            source
                .error("file", format!("has no data set “{name}”; it has {}", list()))
                .hint("name one of these with --dataset")
        });
    }
    let is_volume = |set: &&StoredSet| shaped(source, set).is_ok_and(|shaped| shaped.is_volume());
    let samples = |set: &&StoredSet| set.shape.iter().fold(1u64, |all, &n| all.saturating_mul(n));
    // Of several that are as large, the first.
    let volumes = sets.iter().filter(is_volume).rev();
    let is_picture = |set: &&StoredSet| shaped(source, set).is_ok_and(|shaped| shaped.is_picture());
    let pictures = || sets.iter().filter(is_picture).rev().max_by_key(samples);
    volumes.max_by_key(samples).or_else(pictures).ok_or_else(|| {
        let message = "has neither numbers of three dimensions nor a picture of two; it has";
        source
            .error("file", format!("{message} {}", list()))
            .hint("choose a data set with --dataset, and one of several times with --time")
    })
}

/// Returns what is known of the dimensions of a data set.
fn shaped(source: &Source, set: &StoredSet) -> Result<Shaped> {
    let place = format!("data set “{}”", set.path);
    let (element, endian, inner) = number_type(&set.datatype).ok_or_else(|| {
        let kind: String = set.datatype.to_string().chars().take(80).collect();
        source.error(&place, format!("holds values of the type {kind}, which are not numbers"))
    })?;
    let sizes = set.shape.iter().copied().chain(inner).collect();
    // The dimensions of NetCDF have names, and those before space are mostly times.
    let outer = set.has_scales.then(|| "times".to_owned());
    Ok(Shaped { element, endian, sizes, shape_text: described(set), place, outer })
}

/// Returns the type of numbers, their byte order, and the dimensions that each value has itself.
fn number_type(datatype: &Datatype) -> Option<(Element, Endian, Vec<u64>)> {
    let order = |order: &DatatypeByteOrder| match order {
        DatatypeByteOrder::LittleEndian => Some(Endian::Little),
        DatatypeByteOrder::BigEndian => Some(Endian::Big),
        _ => None,
    };
    match datatype {
        Datatype::FixedPoint { size, byte_order, layout } if layout.bit_offset == 0 => {
            let kind = match (size, layout.signed) {
                (1, false) => SampleType::U8,
                (1, true) => SampleType::I8,
                (2, false) => SampleType::U16,
                (2, true) => SampleType::I16,
                (4, false) => SampleType::U32,
                (4, true) => SampleType::I32,
                (8, false) => SampleType::U64,
                (8, true) => SampleType::I64,
                _ => return None,
            };
            Some((Element::Real(kind), order(byte_order)?, Vec::new()))
        }
        Datatype::FloatingPoint { size, byte_order, layout } if layout.bit_offset == 0 => {
            let element = match (size, layout.exponent_size) {
                (2, 5) => Element::Half,
                (4, 8) => Element::Real(SampleType::F32),
                (8, 11) => Element::Real(SampleType::F64),
                _ => return None,
            };
            Some((element, order(byte_order)?, Vec::new()))
        }
        Datatype::BitField { size: 1, .. } => {
            Some((Element::Real(SampleType::U8), Endian::Little, Vec::new()))
        }
        // Truth values are an enumeration of bytes.
        Datatype::Enumeration { base_type, .. } => number_type(base_type),
        Datatype::Array { base_type, dimensions } => {
            let (element, endian, inner) = number_type(base_type)?;
            let outer = dimensions.iter().map(|&size| u64::from(size));
            Some((element, endian, outer.chain(inner).collect()))
        }
        Datatype::Compound { size, members } => complex(*size, members),
        _ => None,
    }
}

/// Returns the type of complex numbers: two floats, one after the other.
fn complex(
    size: u32,
    members: &[hdf5_pure::CompoundMember],
) -> Option<(Element, Endian, Vec<u64>)> {
    let [real, imaginary] = members else { return None };
    let (Element::Real(part), endian, inner) = number_type(&real.datatype)? else { return None };
    let bytes = part.bytes() as u64;
    let is_pair = real.byte_offset == 0
        && imaginary.byte_offset == bytes
        && u64::from(size) == 2 * bytes
        && number_type(&imaginary.datatype)? == (Element::Real(part), endian, inner.clone());
    let is_float = matches!(part, SampleType::F32 | SampleType::F64);
    (is_pair && is_float && inner.is_empty()).then_some((Element::Complex(part), endian, inner))
}

#[cfg(test)]
mod tests;
#[cfg(test)]
mod vtkhdf_tests;
