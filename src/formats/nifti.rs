//! NIfTI volumes of versions 1 and 2, in one file or a pair, also packed by gzip. Follows
//! `nifti1.h` (Cox et al. 2004) and `nifti2.h` (Harms et al. 2011).

mod header;
mod place;
#[cfg(test)]
mod tests;

use super::{
    Endian, ReadOptions, SampleType, raw,
    shared::{anatomy::Anatomy, colors, holes, luminance::luminance, rescale::rescaled, several},
};
use crate::{
    Result,
    about::Modality,
    input::Source,
    volume::{Samples, Volume},
    warning,
};
use flate2::read::MultiGzDecoder;
use header::{Header, LONGEST};
use std::{
    borrow::Cow,
    io::{self, Read},
    path::{Path, PathBuf},
    sync::Arc,
};

/// The intents of vectors of three or four components that are colours: RGB and RGBA.
const COLOR_VECTORS: [i64; 2] = [2003, 2004];

/// Bytes that are skipped between two checks of the time limit.
const PORTION: u64 = 16 << 20;

/// The first bytes of a file packed by gzip.
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Returns whether the first bytes of a file are those of NIfTI, also packed by gzip.
pub(super) fn is_nifti(bytes: &[u8]) -> bool {
    if !bytes.starts_with(&GZIP) {
        return header::is_header(bytes);
    }
    let mut first = Vec::new();
    // A damaged stream may still begin with a header.
    MultiGzDecoder::new(bytes).take(LONGEST as u64).read_to_end(&mut first).ok();
    header::is_header(&first)
}

/// Reads one volume: of a file with several times, the first or the one that
/// [`ReadOptions::time`] names. Positions are in the world of the file (RAS: x to the subject's
/// right, y to the front, z to the head), in millimetres if the file gives its unit of length.
///
/// The header's matrix (“sform”) places the samples, else its rotation (“qform”), else the steps
/// alone. Values are scaled by the header's slope and intercept. Complex numbers become their
/// magnitude. Colours are kept, with their luminance as samples. Files with vectors become their
/// length, or the component that [`ReadOptions::scalar`] names (`:x` or `:0`).
///
/// A name that ends with `.hdr` or `.img` is one of a pair, which lies beside it. Headers of
/// Analyze 7.5 are read too; they do not say how the subject lies.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a malformed header, a type that is not read (bits,
/// 128-bit floats), a time that the file does not have, and samples that are cut off.
/// [`Error::Limit`](crate::Error::Limit) for sizes over the limits.
pub fn read(source: &Source, options: &ReadOptions) -> Result<Volume> {
    if !has_extension(source.path, "img") {
        let header = Header::read(source, &first_bytes(source)?)?;
        if !header.is_pair {
            return volume(source, source, &header, options);
        }
        let path = partner(source, "img")?;
        let image = source.open_beside(&path)?;
        return image.unless_changed(volume(source, &image, &header, options));
    }
    match (partner(source, "hdr"), &options.raw) {
        (Ok(path), _) => {
            let beside = source.open_beside(&path)?;
            let header = Header::read(&beside, &first_bytes(&beside)?)?;
            beside.unless_changed(volume(&beside, source, &header, options))
        }
        // Many programs call raw samples an image.
        (Err(_), Some(layout)) => raw::read(source, layout, options),
        (Err(error), None) => Err(error.hint(
            "put the header beside it; if there is none, give the layout of the samples with \
             --dims and --type",
        )),
    }
}

/// Returns whether a name ends with an extension, or with it and `.gz`.
fn has_extension(path: &Path, extension: &str) -> bool {
    let name = path.file_name().unwrap_or_default().to_string_lossy().to_ascii_lowercase();
    name.strip_suffix(".gz").unwrap_or(&name).ends_with(&format!(".{extension}"))
}

/// Returns the path of the other file of a pair: of the same name with another extension.
fn partner(source: &Source, extension: &str) -> Result<PathBuf> {
    let name = source.path.file_name().unwrap_or_default().to_string_lossy();
    let stem = name.strip_suffix(".gz").or_else(|| name.strip_suffix(".GZ")).unwrap_or(&name);
    let stem = stem.rsplit_once('.').map_or(stem, |(stem, _)| stem);
    let upper = extension.to_ascii_uppercase();
    let names = [extension, &format!("{extension}.gz"), &upper, &format!("{upper}.GZ")];
    let mut paths = names.map(|extension| source.neighbour("pair", &format!("{stem}.{extension}")));
    let there = paths.iter().position(Result::is_ok).unwrap_or(0);
    std::mem::replace(&mut paths[there], Ok(PathBuf::new()))
}

/// Returns the first bytes of a file, unpacked.
fn first_bytes<'a>(source: &'a Source) -> Result<Cow<'a, [u8]>> {
    let bytes = source.bytes();
    if !bytes.starts_with(&GZIP) {
        return Ok(bytes[..bytes.len().min(LONGEST)].into());
    }
    let mut first = Vec::new();
    let read = MultiGzDecoder::new(bytes).take(LONGEST as u64).read_to_end(&mut first);
    read.map_err(|e| source.error("gzip stream", format!("cannot be unpacked: {e}")))?;
    Ok(first.into())
}

/// How the values of a type become scalars.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Form {
    Scalar,
    /// Two numbers, of which the magnitude is taken.
    Complex,
    /// This many bytes, of which the first three are colours.
    Color(usize),
}

/// Returns the type of a sample's numbers, and what they mean.
fn form(source: &Source, header: &Header) -> Result<(SampleType, Form)> {
    Ok(match header.datatype {
        2 => (SampleType::U8, Form::Scalar),
        4 => (SampleType::I16, Form::Scalar),
        8 => (SampleType::I32, Form::Scalar),
        16 => (SampleType::F32, Form::Scalar),
        32 => (SampleType::F32, Form::Complex),
        64 => (SampleType::F64, Form::Scalar),
        128 => (SampleType::U8, Form::Color(3)),
        256 => (SampleType::I8, Form::Scalar),
        512 => (SampleType::U16, Form::Scalar),
        768 => (SampleType::U32, Form::Scalar),
        1024 => (SampleType::I64, Form::Scalar),
        1280 => (SampleType::U64, Form::Scalar),
        1792 => (SampleType::F64, Form::Complex),
        2304 => (SampleType::U8, Form::Color(4)),
        code => {
            let name = match code {
                1 => " (bits)",
                1536 => " (128-bit floats)",
                2048 => " (256-bit complex numbers)",
                _ => "",
            };
            let message = format!("{code}{name} is not a type that can be read");
            let hint = "write the file again with a type of 8 to 64 bits, such as float32";
            return Err(source.error("header, datatype", message).hint(hint));
        }
    })
}

/// The intent of volumes whose values are labels (`NIFTI_INTENT_LABEL`).
const LABELS: i64 = 1002;

/// Reads the volume that the options choose. The header is from one source, the samples from
/// another, or from the same.
fn volume(
    header_file: &Source,
    image: &Source,
    header: &Header,
    options: &ReadOptions,
) -> Result<Volume> {
    let (kind, form) = form(header_file, header)?;
    let [nx, ny, nz, times, components, more @ ..] = header.dims;
    let claimed = [nx, ny, nz].map(|n| usize::try_from(n).unwrap_or(usize::MAX));
    let (lattice, is_stated) = place::lattice(header, claimed);
    lattice.check().map_err(|message| header_file.error("header", message))?;
    if more != [1, 1] {
        let message =
            format!("the file has {} axes, of which the first five are read", header.axes);
        warning::give!("{}: header: {message}", header_file.path.display());
    }
    let numbers = match form {
        Form::Scalar => 1,
        Form::Complex => 2,
        Form::Color(bytes) => bytes,
    };
    let wide = kind.bytes_of(claimed).and_then(|bytes| bytes.checked_mul(numbers as u64));
    let size = image.check_bytes("the size of the samples in bytes", wide.unwrap_or(u64::MAX))?;
    let time = several::time(header_file, "header, dim[4]", times, options)? as u64;
    let components_read = wanted(header_file, header, options)?;
    let mut parts = Vec::new();
    let mut colors: Option<Arc<[[u8; 4]]>> = None;
    for component in components_read {
        let number = u64::from(component) * times + time;
        let is_last = number + 1 == times.saturating_mul(components);
        let at = start(header_file, header)?.saturating_add(number.saturating_mul(size as u64));
        let bytes = bytes(image, at, size, is_last)?;
        if let (Form::Color(channels), None) = (form, &options.scalar) {
            image.spend("the size of the colours in bytes", 4 * bytes.len() as u64)?;
            colors = Some(colors::of_pixels(&bytes, channels).into());
        }
        parts.push(decoded(image, bytes, header, kind, form)?);
    }
    let is_color = COLOR_VECTORS.contains(&header.intent) && options.scalar.is_none();
    let samples = match <[Samples; 1]>::try_from(parts) {
        Ok([one]) => one,
        Err(several) if is_color && several.len() >= 3 => {
            let pixels = colors::of_channels(image, &several)?;
            let brightness = colors::brightness(&pixels);
            colors = Some(pixels);
            brightness
        }
        Err(several) => length(image, &several)?,
    };
    let mut volume = holes::volume(image, lattice, samples, options)?;
    if let Some(colors) = colors {
        colors::attach(&mut volume, colors);
    }
    describe(&mut volume, header, is_stated);
    volume.about.modality = modality(header_file.path, header);
    Ok(if header.intent == LABELS { volume.with_labels(Vec::new()) } else { volume })
}

/// Fills in what the header says beyond the values.
fn describe(volume: &mut Volume, header: &Header, is_stated: bool) {
    if is_stated {
        Anatomy::RAS.place(volume);
    }
    let about = &mut volume.about;
    about.name.clone_from(&header.name);
    let [low, high] = header.window;
    about.window = (low < high && low.is_finite() && high.is_finite()).then_some(header.window);
    if place::millimetres(header).is_some() {
        about.length = "mm".into();
    }
}

/// Returns what measured the values, as the name of a file in a data set of BIDS says
/// (`sub-01_T1w.nii.gz`), or the times of echoes in the description (dcm2niix, SPM).
fn modality(path: &Path, header: &Header) -> Option<Modality> {
    let name = path.file_name()?.to_string_lossy();
    let stem = name.split('.').next().unwrap_or_default();
    let of_bids = |(entities, suffix): (&str, &str)| {
        entities.starts_with("sub-").then(|| Modality::named(suffix)).flatten()
    };
    let has_echo = || ["TE=", "TR="].iter().any(|time| header.description.contains(time));
    stem.rsplit_once('_').and_then(of_bids).or_else(|| has_echo().then_some(Modality::Mr))
}

/// Returns the components to read: one, or all of a vector.
fn wanted(source: &Source, header: &Header, options: &ReadOptions) -> Result<std::ops::Range<u32>> {
    const VECTOR: i64 = 1007;
    let count = header.dims[4];
    let name = options.scalar.as_deref().unwrap_or_default();
    let part = name.rsplit_once(':').map_or(name, |(_, part)| part);
    let chosen = match part {
        "magnitude" => None,
        "x" | "y" | "z" => Some(u64::from(part.as_bytes()[0] - b'x')),
        // The file has no other names.
        _ if part == header.name && !part.is_empty() => None,
        "" if header.intent == VECTOR || COLOR_VECTORS.contains(&header.intent) => None,
        "" => {
            if count > 1 {
                let path = source.path.display();
                warning::give!(
                    "{path}: shows the first of {count} components; --scalar :1 shows the second"
                );
            }
            Some(0)
        }
        _ => Some(part.parse().unwrap_or(u64::MAX)),
    };
    // Vectors have few components.
    let all = u32::try_from(count).ok().filter(|&count| count <= 64).unwrap_or(1);
    match chosen {
        None => Ok(0..all),
        Some(one) if one < count => Ok(one as u32..one as u32 + 1),
        Some(_) => {
            let message = format!("has {count} components, but no “{name}”");
            let hint = "choose one by its number (:0), by :x, :y or :z, or :magnitude";
            Err(source.error("header, dim[5]", message).hint(hint))
        }
    }
}

/// Returns where the samples begin.
fn start(source: &Source, header: &Header) -> Result<u64> {
    let start = header.start;
    // Some programs leave it out.
    if start == 0.0 {
        let after = if header.version == 2 { 544 } else { 352 };
        return Ok(if header.is_pair { 0 } else { after });
    }
    if !(0.0..1e18).contains(&start) || start.fract() != 0.0 {
        let message = format!("is {start}, but a number of bytes was expected");
        return Err(source.error("header, vox_offset", message));
    }
    Ok(start as u64)
}

/// Returns bytes of the samples' file, unpacked. If they are the last, the rest of a packed file is
/// unpacked too, which checks its checksum.
fn bytes<'a>(source: &'a Source, at: u64, size: usize, is_last: bool) -> Result<Cow<'a, [u8]>> {
    let all = source.bytes();
    if !all.starts_with(&GZIP) {
        let rest = usize::try_from(at).ok().and_then(|at| all.get(at..)).unwrap_or_default();
        return rest.get(..size).map(Cow::Borrowed).ok_or_else(|| {
            let there = rest.len();
            let message = format!("there are {there} bytes where {size} were expected");
            source.error(format!("samples, byte {at}"), message)
        });
    }
    let mut stream = MultiGzDecoder::new(all);
    let place = "gzip stream";
    let failed =
        |e: io::Error| source.error(place, format!("cannot be unpacked to the samples: {e}"));
    let mut left = at;
    while left > 0 {
        source.check_time()?;
        let portion = left.min(PORTION);
        let read = io::copy(&mut stream.by_ref().take(portion), &mut io::sink()).map_err(failed)?;
        if read < portion {
            let message = format!("unpacks to {} bytes; samples begin at {at}", at - left + read);
            return Err(source.error(place, message));
        }
        left -= portion;
    }
    let unpacked = source.unpack(place, stream.by_ref().take(size as u64), size)?;
    let mut is_over = !is_last;
    while !is_over {
        source.check_time()?;
        let read = io::copy(&mut stream.by_ref().take(PORTION), &mut io::sink());
        let read = read.map_err(|e| source.error(place, format!("is damaged at its end: {e}")))?;
        is_over = read == 0;
    }
    Ok(unpacked.into())
}

/// Returns the scaled values of one volume's bytes.
fn decoded(
    source: &Source,
    bytes: Cow<[u8]>,
    header: &Header,
    kind: SampleType,
    form: Form,
) -> Result<Samples> {
    let what = "the size of the samples in bytes";
    source.spend(what, kind.decoded_bytes(bytes.len()))?;
    if let Form::Color(channels) = form {
        return Ok(Samples::U8(luminance(&bytes, channels)));
    }
    // A slope of 0 means that there is none.
    let is_scaled = header.slope.is_finite() && header.slope != 0.0;
    let (slope, intercept) = if is_scaled { (header.slope, header.intercept) } else { (1.0, 0.0) };
    let intercept = if intercept.is_finite() { intercept } else { 0.0 };
    if is_scaled && (slope, intercept) != (1.0, 0.0) {
        source.spend(what, 4 * (bytes.len() / kind.bytes()) as u64)?;
    }
    if form == Form::Complex {
        return Ok(magnitudes(&bytes, kind, header.endian, [slope, intercept]));
    }
    Ok(rescaled(kind.decode(bytes, header.endian), slope, intercept))
}

/// Returns the magnitudes of complex numbers, whose parts are scaled.
fn magnitudes(bytes: &[u8], kind: SampleType, endian: Endian, scale: [f64; 2]) -> Samples {
    let [slope, intercept] = scale;
    let parts = kind.doubles(bytes, endian);
    let (pairs, _) = parts.as_chunks::<2>();
    let magnitude = |pair: &[f64; 2]| {
        let [real, imaginary] = pair.map(|part| slope * part + intercept);
        real.hypot(imaginary) as f32
    };
    Samples::F32(pairs.iter().map(magnitude).collect())
}

/// Returns the length of vectors, whose components are given one after the other.
fn length(source: &Source, components: &[Samples]) -> Result<Samples> {
    let count = components.first().map_or(0, Samples::len);
    source.room::<f32>("the lengths of the vectors", count)?;
    let at = |i: usize| components.iter().map(|part| part.value(i).powi(2)).sum::<f64>().sqrt();
    Ok(Samples::F32((0..count).map(|i| at(i) as f32).collect()))
}
