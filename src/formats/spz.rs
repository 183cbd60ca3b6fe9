//! SPZ, the packed trained Gaussians of Niantic Spatial, versions 1 to 4. Numbers have 8 to 24
//! bits; the attributes of all Gaussians follow each other. Versions 1 to 3 are one gzip stream.
//! Version 4 has a plain header, a table of contents, and a zstd stream for each attribute, which
//! needs the feature `files`.
//!
//! Numbers are read in the frame that they are stored in. The format's library names that frame
//! “right, up, back” where it is told the frame of its input. But its converter from PLY does not
//! tell it, and neither do other converters, so their files have the frame of the PLY. Only an
//! extension says which frame it is; then the direction that is up is taken from there.
//!
//! The mark of scenes that were trained with antialiasing changes nothing here.

mod decode;
mod extensions;
#[cfg(test)]
mod tests;
mod write;

pub use write::write;
#[cfg(feature = "files")]
pub use write::write_streams;

use super::shared::trained::settle;
use crate::{
    Result,
    gaussians::{Gaussians, MOST_DEGREE, harmonics::terms},
    input::Source,
};
use flate2::bufread::GzDecoder;
use std::io::Read;

const MAGIC: [u8; 4] = *b"NGSP";
const GZIP: [u8; 2] = [0x1f, 0x8b];

/// Bytes of a gzip stream that are unpacked to look for the magic number. More come before it only
/// if the stream has a long comment.
const LOOKED_AT: usize = 1 << 12;

/// Bytes of the header, in one stream and in version 4.
const HEADER: usize = 16;
const LONG_HEADER: usize = 32;

/// The first version with a stream for each attribute.
const STREAMS: u32 = 4;

/// Flag of a file with extensions.
const EXTENDED: u8 = 2;

/// Bytes behind the attributes that are looked at.
const MOST_EXTENSIONS: u64 = 1 << 20;

/// Bytes that a packed byte unpacks to, at most. Version 4 files that claim more are refused, as by
/// the format's library.
const RATIO: u64 = 1024;

/// The least and the most window of zstd: powers of two, in bytes. The most is its own default.
#[cfg(feature = "files")]
const LEAST_WINDOW: u32 = 10;
#[cfg(feature = "files")]
const MOST_WINDOW: u32 = 27;

/// The attributes, in their order.
const ATTRIBUTES: [&str; 6] =
    ["positions", "opacities", "colours", "scales", "rotations", "harmonics"];

/// The unpacked attributes of all Gaussians.
type Attributes = [Vec<u8>; ATTRIBUTES.len()];

/// What the header says.
struct Header {
    version: u32,
    count: usize,
    degree: u32,
    /// Bits of a position that are behind the point.
    fraction: u8,
    flags: u8,
}

/// A file, unpacked.
struct Packed {
    header: Header,
    attributes: Attributes,
    /// The number of the coordinate system, if an extension says it.
    system: Option<u32>,
}

/// Returns whether these are the first bytes of an SPZ file.
pub fn is_spz(bytes: &[u8]) -> bool {
    if !bytes.starts_with(&GZIP) {
        return bytes.starts_with(&MAGIC);
    }
    let mut head = [0; MAGIC.len()];
    let mut stream = GzDecoder::new(bytes.get(..LOOKED_AT).unwrap_or(bytes));
    stream.read_exact(&mut head).is_ok() && head == MAGIC
}

/// Reads the Gaussians.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for a version or a degree of the harmonics that cannot be
/// read, for contents that do not match the header, and for version 4 in a build without the
/// feature `files`. [`Error::Limit`](crate::Error::Limit) for more Gaussians or bytes than the
/// limits allow.
pub fn read(source: &Source) -> Result<Gaussians> {
    let bytes = source.bytes();
    let packed = if bytes.starts_with(&GZIP) {
        in_one_stream(source, GzDecoder::new(bytes))?
    } else if number(bytes, 4).is_some_and(|version| version >= STREAMS) {
        in_streams(source)?
    } else {
        in_one_stream(source, bytes)?
    };
    let Packed { header, attributes, system } = packed;
    let mut set = settle(source, header.count, header.degree, |index, colors| {
        Ok(decode::gaussian(&header, &attributes, index, colors))
    })?;
    set.about.orientation = system.and_then(|system| extensions::orientation(source, system));
    Ok(set)
}

/// Returns a number of four bytes.
fn number(bytes: &[u8], at: usize) -> Option<u32> {
    bytes.get(at..)?.first_chunk().map(|&bytes| u32::from_le_bytes(bytes))
}

impl Header {
    /// Reads the fields that all versions have.
    fn of(source: &Source, head: &[u8; HEADER]) -> Result<Self> {
        let fail = |message: String| source.error("header", message);
        let field = |at| number(head, at).unwrap_or_default();
        if !head.starts_with(&MAGIC) {
            return Err(fail("does not begin with “NGSP”, so it is not SPZ".into()));
        }
        let version = field(4);
        if !(1..=STREAMS).contains(&version) {
            return Err(fail(format!(
                "has the version {version}, but the versions 1 to {STREAMS} are read"
            ))
            .hint("write the file again as version 3"));
        }
        let (degree, fraction, flags) = (u32::from(head[12]), head[13], head[14]);
        if degree > MOST_DEGREE {
            return Err(fail(format!(
                "has harmonics of the degree {degree}, but at most {MOST_DEGREE} is drawn"
            ))
            .hint("write the file again with fewer harmonics"));
        }
        if fraction > 31 {
            return Err(fail(format!(
                "has {fraction} fractional bits, but at most 31 are allowed"
            )));
        }
        let count = source.check_points("the number of Gaussians", u64::from(field(8)))?;
        if count == 0 {
            return Err(fail("counts no Gaussians".into()));
        }
        Ok(Self { version, count, degree, fraction, flags })
    }

    /// Returns the unpacked sizes of the attributes, in bytes.
    fn sizes(&self) -> [usize; ATTRIBUTES.len()] {
        let position = if self.version == 1 { 6 } else { 9 };
        let rotation = if self.version < 3 { 3 } else { 4 };
        let harmonics = 3 * (terms(self.degree) - 1);
        [position, 1, 3, 3, rotation, harmonics].map(|size| size.saturating_mul(self.count))
    }
}

/// Unpacks versions 1 to 3. Bytes behind the attributes are extensions, or are ignored.
fn in_one_stream(source: &Source, mut stream: impl Read) -> Result<Packed> {
    let head = source.unpack("header", stream.by_ref().take(HEADER as u64), HEADER)?;
    let Some(head) = head.first_chunk() else {
        return Err(source.error("header", "is too short"));
    };
    let header = Header::of(source, head)?;
    if header.version >= STREAMS {
        let message = format!("has the version {}, which is not packed by gzip", header.version);
        return Err(source.error("header", message));
    }
    let mut attributes = Attributes::default();
    for ((attribute, what), size) in attributes.iter_mut().zip(ATTRIBUTES).zip(header.sizes()) {
        *attribute = source.unpack(what, stream.by_ref().take(size as u64), size)?;
    }
    // Reading on to the end also checks the checksum.
    let mut rest = Vec::new();
    stream.take(MOST_EXTENSIONS).read_to_end(&mut rest).map_err(|error| {
        source.error("end of the gzip stream", format!("cannot be unpacked: {error}"))
    })?;
    let system = (header.flags & EXTENDED != 0).then(|| extensions::system(&rest)).flatten();
    Ok(Packed { header, attributes, system })
}

/// Unpacks version 4.
fn in_streams(source: &Source) -> Result<Packed> {
    let bytes = source.bytes();
    let Some((head, _)) = bytes.split_first_chunk::<LONG_HEADER>() else {
        let message = format!("ends after {} of {LONG_HEADER} bytes", bytes.len());
        return Err(source.error("header", message));
    };
    let (halves, _) = head.as_chunks::<HEADER>();
    let header = Header::of(source, &halves[0])?;
    let sizes = header.sizes();
    if sizes[0] as u64 > (bytes.len() as u64).saturating_mul(RATIO) {
        let (count, size) = (header.count, bytes.len());
        let message = format!("counts {count} Gaussians, more than {size} bytes can hold");
        return Err(source.error("header", message));
    }
    // Attributes without bytes have no stream.
    let wanted = sizes.iter().filter(|&&size| size > 0).count();
    let streams = usize::from(head[HEADER - 1]);
    if streams != wanted {
        let message = format!("counts {streams} streams, but {wanted} are expected");
        return Err(source.error("header", message));
    }
    let table_at = number(head, HEADER).map_or(0, |at| at as usize);
    if table_at < LONG_HEADER {
        let message = format!("places the table of contents at byte {table_at}, inside the header");
        return Err(source.error("header", message));
    }
    let table =
        bytes.get(table_at..).and_then(|rest| rest.get(..wanted * 16)).ok_or_else(|| {
            source.error(format!("byte {table_at}"), "the file ends before its table of contents")
        })?;
    let attributes = unpacked(source, table, table_at + table.len(), sizes)?;
    let system = (header.flags & EXTENDED != 0)
        .then(|| extensions::system(bytes.get(LONG_HEADER..table_at)?))
        .flatten();
    Ok(Packed { header, attributes, system })
}

/// Unpacks the streams of a table of contents. The first begins at `start`.
fn unpacked(
    source: &Source,
    table: &[u8],
    mut start: usize,
    sizes: [usize; ATTRIBUTES.len()],
) -> Result<Attributes> {
    let mut attributes = Attributes::default();
    let (numbers, _) = table.as_chunks::<8>();
    let (rows, _) = numbers.as_chunks::<2>();
    let each = attributes.iter_mut().zip(ATTRIBUTES).zip(sizes);
    for (((attribute, what), size), row) in each.zip(rows) {
        let [packed, claimed] = row.map(u64::from_le_bytes);
        if claimed != size as u64 {
            let message = format!("the {what} have {claimed} bytes where {size} are expected");
            return Err(source.error("table of contents", message));
        }
        let rest = source.bytes().get(start..).unwrap_or_default();
        let stream = usize::try_from(packed).ok().and_then(|packed| rest.get(..packed));
        let stream = stream.ok_or_else(|| {
            let message =
                format!("the {what} need {packed} bytes, but the file has only {}", rest.len());
            source.error(format!("byte {start}"), message)
        })?;
        *attribute = unzstd(source, what, stream, size)?;
        start += stream.len();
    }
    Ok(attributes)
}

#[cfg(feature = "files")]
fn unzstd(source: &Source, what: &str, stream: &[u8], size: usize) -> Result<Vec<u8>> {
    // The decoder is C code, and mapped bytes may change while it reads them.
    source.room::<u8>("the packed attributes", stream.len())?;
    let copy = stream.to_vec();
    let broken = |error| source.error(what, format!("cannot be unpacked: {error}"));
    let mut decoder = zstd::stream::read::Decoder::with_buffer(&copy[..]).map_err(broken)?;
    // The stream says how much of what was unpacked the decoder keeps.
    let most = source.limits.bytes.max(1).ilog2().clamp(LEAST_WINDOW, MOST_WINDOW);
    decoder.window_log_max(most).map_err(broken)?;
    source.unpack(what, decoder, size)
}

#[cfg(all(not(feature = "files"), target_family = "wasm"))]
fn unzstd(source: &Source, what: &str, stream: &[u8], size: usize) -> Result<Vec<u8>> {
    let decoder = ruzstd::decoding::StreamingDecoder::new(stream);
    let broken = |error| source.error(what, format!("cannot be unpacked: {error}"));
    source.unpack(what, decoder.map_err(broken)?, size)
}

#[cfg(all(not(feature = "files"), not(target_family = "wasm")))]
fn unzstd(source: &Source, what: &str, _: &[u8], _: usize) -> Result<Vec<u8>> {
    let message = "is packed by zstd, which comes with the feature “files” of the crate splatkit, \
                   and this program was built without";
    Err(source.error(what, message).hint("write the file again as version 3"))
}
