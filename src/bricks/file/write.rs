//! Writing: slices arrive once, in order, and little more than a layer of bricks of each level is
//! in memory.

use super::{Entry, HASH, Listing, Numbers, Stored, brick::encode};
#[cfg(test)]
use crate::bricks::{Brick, Bricks};
use crate::{
    Error, Result,
    bricks::{Header, REACH, SIDE, cut::Slices, level, pyramid::Pyramid},
    container::{
        Cursor, Spill, Spilled, Target,
        directory::{Contents, Kind, Layout, Place},
        pack::Compressor,
    },
    formats::VolumeStream,
    parallel::prelude::*,
    progress::{Watch, tell},
    volume::{Scalar, Volume, steps::Steps},
};
use std::{
    borrow::Cow,
    io::{self, Write},
    ops::Range,
    path::Path,
};

/// Descriptions that are stored in the file.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct WriteOptions {
    /// The name of the world's unit.
    pub unit: String,
    /// The name of the source.
    pub source: String,
}

/// The compression level of zstd. Higher levels take much longer and save a few percent.
const LEVEL: i32 = 3;

/// Slices that are read at a time.
const PIECE: usize = 8;

/// Bricks that are encoded in parallel before they are written.
const BATCH: usize = 256;

/// Returns approximately how many bytes of memory [`convert`] needs. For level 0, it holds the
/// slices of a layer of bricks, those that reach into it and those being read. Each further level
/// needs a quarter of the one before. Packing needs a little more.
pub fn memory_of(dims: [usize; 3], scalar: Scalar) -> u64 {
    let slice =
        (dims[0] as u64).saturating_mul(dims[1] as u64).saturating_mul(scalar.bytes() as u64);
    let slices = (SIDE + 2 * REACH + 4 * PIECE).min(dims[2].saturating_mul(2)) as u64;
    slice.saturating_mul(slices).saturating_mul(4) / 3 + (64 << 20)
}

/// Writes a volume in memory: a temporary file beside `path`, renamed when it is complete. `watch`
/// is called with the number of slices done and the number in all.
///
/// # Errors
/// [`Error::Argument`] for a lattice that is not Cartesian, and for a volume that was built by hand
/// and is inconsistent; [`Error::Output`] if the file cannot be written.
pub fn write(
    volume: &Volume,
    path: impl AsRef<Path>,
    options: &WriteOptions,
    watch: Watch<'_>,
) -> Result<()> {
    let path = path.as_ref();
    volume.validate().map_err(Error::Argument)?;
    if volume.is_label_map() {
        return Err(Error::Argument(
            "a label map has no coarser levels: labels have no mean; draw the original file".into(),
        ));
    }
    let spill = || Spill::beside(path);
    all(
        &header(volume, options),
        path,
        spill,
        || Target::at(path),
        |z| Ok(slices(volume, z)),
        watch,
    )
    .map(|_| ())
}

/// Like [`write`](write()), from a file that is read slice by slice: it needs [`memory_of`] bytes,
/// whatever the file's size. The caller passes the range of the values, which takes a pass over the
/// file ([`VolumeStream::range`]).
///
/// # Errors
/// As [`write`](write()), and also for a range that is not finite or descends.
pub fn convert(
    stream: &VolumeStream,
    range: [f64; 2],
    path: impl AsRef<Path>,
    options: &WriteOptions,
    watch: Watch<'_>,
) -> Result<()> {
    let path = path.as_ref();
    let WriteOptions { unit, source } = options.clone();
    let header = Header {
        lattice: stream.lattice().clone(),
        scalar: stream.scalar(),
        range,
        frame: stream.frame(),
        unit,
        source,
    };
    let slices = |z| Ok(Cow::Owned(stream.slices(z)?.bytes().to_vec()));
    all(&header, path, || Spill::beside(path), || Target::at(path), slices, watch).map(|_| ())
}

/// Returns the bytes of the file that [`write`](write()) would write.
#[cfg(test)]
pub fn to_bytes(volume: &Volume, options: &WriteOptions) -> Result<Vec<u8>> {
    let memory = || Ok(Spill::Memory(Vec::new()));
    let target = || Ok(Target::Memory(Vec::new()));
    all(
        &header(volume, options),
        Path::new("memory"),
        memory,
        target,
        |z| Ok(slices(volume, z)),
        None,
    )
}

/// Returns the bytes of a file whose bricks a function has changed, so that they contradict each
/// other.
#[cfg(test)]
pub fn with_changes(bricks: &Bricks, change: impl Fn(usize, u32, &mut Brick)) -> Vec<u8> {
    let header = bricks.header();
    let mut kept = Kept::new(header, || Ok(Spill::Memory(Vec::new()))).unwrap();
    let mut packer = Compressor::new(LEVEL).unwrap();
    for (number, level) in bricks.levels().iter().enumerate() {
        for brick in 0..level.bricks() as u32 {
            let mut content = bricks.read(number, brick).unwrap();
            change(number, brick, &mut content);
            let (entry, bytes) = encode(&content, header.scalar, &mut packer).unwrap();
            kept.push(number, entry, &bytes).unwrap();
        }
    }
    kept.finish(header, Target::Memory(Vec::new())).unwrap().end(Path::new("memory")).unwrap()
}

fn header(volume: &Volume, options: &WriteOptions) -> Header {
    let WriteOptions { unit, source } = options.clone();
    Header {
        lattice: volume.lattice.clone(),
        scalar: volume.samples.scalar(),
        range: volume.range,
        frame: volume.about.frame,
        unit,
        source,
    }
}

/// Returns the bytes of a range of slices.
fn slices(volume: &Volume, z: Range<usize>) -> Cow<'_, [u8]> {
    let slice = volume.lattice.dims[0] * volume.lattice.dims[1] * volume.samples.sample_bytes();
    Cow::Borrowed(&volume.samples.bytes()[z.start * slice..z.end * slice])
}

fn all<'a>(
    header: &Header,
    path: &Path,
    spill: impl Fn() -> Result<Spill>,
    target: impl FnOnce() -> Result<Target>,
    slices: impl Fn(Range<usize>) -> Result<Cow<'a, [u8]>>,
    watch: Watch<'_>,
) -> Result<Vec<u8>> {
    header.validate().map_err(Error::Argument)?;
    let dims = header.lattice.dims;
    let mut coder = Coder::new(header, spill)?;
    let mut pyramid = Pyramid::new(header.scalar, dims);
    let fail = |e| Error::output(path, e);
    for first in (0..dims[2]).step_by(PIECE) {
        let z = first..(first + PIECE).min(dims[2]);
        tell(watch, first as u64, dims[2] as u64);
        let piece = slices(z)?;
        pyramid
            .push(&piece, |level, layer, slices| coder.layer(level, layer, slices).map_err(fail))?;
    }
    coder.kept.finish(header, target()?).map_err(fail)?.end(path)
}

/// Cuts and packs bricks.
struct Coder {
    scalar: Scalar,
    steps: Steps,
    kept: Kept,
}

impl Coder {
    fn new(header: &Header, spill: impl Fn() -> Result<Spill>) -> Result<Self> {
        let steps = Steps::new(header.scalar, header.range);
        Ok(Self { scalar: header.scalar, steps, kept: Kept::new(header, spill)? })
    }

    fn layer(&mut self, level: usize, layer: usize, slices: &Slices) -> std::io::Result<()> {
        let [nx, ny, _] = slices.level.brick_dims;
        let Self { scalar, steps, kept } = self;
        let of_place = |packer: &mut std::io::Result<Compressor>, place: usize| {
            let packer =
                packer.as_mut().map_err(|e| std::io::Error::new(e.kind(), e.to_string()))?;
            encode(&slices.brick([place % nx, place / nx, layer], steps), *scalar, packer)
        };
        for first in (0..nx * ny).step_by(BATCH) {
            let batch = (first..(first + BATCH).min(nx * ny)).into_par_iter();
            let coded: Vec<_> = batch.map_init(|| Compressor::new(LEVEL), of_place).collect();
            for coded in coded {
                let (entry, bytes) = coded?;
                kept.push(level, entry, &bytes)?;
            }
        }
        Ok(())
    }
}

/// Bricks on their way to the file. Their entries wait too, in the order of bricks of each level,
/// with the place where the brick waits.
struct Kept {
    spill: Spill,
    entries: Vec<Spill>,
}

impl Kept {
    /// Begins to keep bricks; `spill` creates storage.
    fn new(header: &Header, spill: impl Fn() -> Result<Spill>) -> Result<Self> {
        let levels = level::levels(header.lattice.dims);
        let entries = levels.iter().map(|_| spill()).collect::<Result<_>>()?;
        Ok(Self { entries, spill: spill()? })
    }

    fn push(&mut self, level: usize, mut entry: Entry, bytes: &[u8]) -> io::Result<()> {
        entry.place.offset = self.spill.push(bytes)?;
        let mut record = Vec::with_capacity(Listing::ENTRY);
        entry.put(&mut record);
        self.entries[level].push(&record)?;
        Ok(())
    }

    /// Assembles the file.
    fn finish(self, header: &Header, mut out: Target) -> io::Result<Target> {
        let mut stored = Stored { header: header.clone(), file_bytes: 0 };
        let numbers = Numbers::new(level::levels(header.lattice.dims));
        let count = numbers.count;
        let spilled = self.entries.into_iter().map(Spill::end).collect::<io::Result<Vec<_>>>()?;
        let (mut entries, mut spill) = (Entries { numbers, spilled }, self.spill);
        let mut layout = Layout::new(count, stored.length() as u64, &mut entries)?;
        stored.file_bytes = layout.end + HASH as u64;
        let (root, waiting) = layout.encode(&mut entries, &mut spill)?;
        let mut hash = blake3::Hasher::new();
        let mut put = |bytes: &[u8]| {
            hash.update(bytes);
            out.write_all(bytes)
        };
        put(&stored.encode())?;
        put(&root)?;
        layout.write(&mut entries, &waiting, &mut spill.end()?, &mut put)?;
        out.write_all(hash.finalize().as_bytes())?;
        Ok(out)
    }
}

/// The entries of all levels, as they wait.
struct Entries {
    numbers: Numbers,
    spilled: Vec<Spilled>,
}

impl Entries {
    /// Returns the level of a number, and its entry.
    fn entry(&mut self, number: u32) -> io::Result<(usize, Entry)> {
        let (level, brick) = self.numbers.brick(number);
        let mut record = [0; Listing::ENTRY];
        self.spilled[level].read(u64::from(brick) * Listing::ENTRY as u64, &mut record)?;
        let entry = Entry::read(&mut Cursor::new(&record)).ok_or(io::ErrorKind::InvalidData)?;
        Ok((level, entry))
    }
}

impl Contents<Listing> for Entries {
    fn measure(&mut self, number: u32) -> io::Result<(u32, u8)> {
        let (level, entry) = self.entry(number)?;
        // There are at most 64 levels.
        Ok((entry.place.bytes, level as u8))
    }

    fn record(&mut self, number: u32, offset: u64, out: &mut Vec<u8>) -> io::Result<[u8; 2]> {
        let (_, mut entry) = self.entry(number)?;
        entry.place.offset = offset;
        entry.put(out);
        Ok(entry.range)
    }

    fn waiting(&mut self, number: u32) -> io::Result<Place> {
        Ok(self.entry(number)?.1.place)
    }
}
