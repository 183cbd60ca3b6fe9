//! The headers of a file, and where the parts of its sections are.

use super::{float_at, half_at};
use crate::{Result, gaussians::harmonics::terms, input::Source};
use glam::DVec3;

/// Bytes of the header, and of the header of a section.
const HEADER: usize = 4096;
const SECTION: usize = 1024;

/// Bytes of the centre of a bucket.
const BUCKET: usize = 12;

/// The highest degree of harmonics that the viewer writes.
const MOST_DEGREE: u32 = 2;

/// Steps from the centre of a bucket to its side, where a file has none.
const STEPS: u32 = 32767;

/// The least and the greatest harmonic of [`Level::Bytes`], where a file has none.
const HARMONICS: [f32; 2] = [-1.5, 1.5];

/// How the numbers of a file are compressed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Level {
    Floats,
    Halves,
    Bytes,
}

impl Level {
    /// Returns the bytes of a number that is not a harmonic.
    pub fn number(self) -> usize {
        if self == Self::Floats { 4 } else { 2 }
    }

    /// Returns the bytes of a harmonic.
    fn harmonic(self) -> usize {
        match self {
            Self::Floats => 4,
            Self::Halves => 2,
            Self::Bytes => 1,
        }
    }

    /// Returns a number that is not a harmonic.
    pub fn float(self, record: &[u8], at: usize) -> f32 {
        if self == Self::Floats { float_at(record, at) } else { half_at(record, at) }
    }

    /// Returns the bytes of a Gaussian.
    pub fn record(self, degree: u32) -> usize {
        10 * self.number() + 4 + 3 * (terms(degree) - 1) * self.harmonic()
    }
}

/// What the header says.
pub struct Header {
    pub level: Level,
    /// The number of Gaussians.
    pub count: u64,
    /// The number of headers of sections.
    sections: usize,
    /// The least and the greatest harmonic of [`Level::Bytes`].
    range: [f32; 2],
}

impl Header {
    pub fn read(source: &Source) -> Result<Self> {
        let bytes = source.bytes();
        let fail = |message: String| source.error("header", message);
        let Some(head) = bytes.first_chunk::<HEADER>() else {
            let message = format!("the file ends inside its header of {HEADER} bytes");
            let place = format!("byte {}", bytes.len());
            return Err(source.error(place, message).hint("the file is cut off or is no .ksplat"));
        };
        let [major, minor, ..] = *head;
        if major != 0 || minor == 0 {
            let message = format!("has the version {major}.{minor}, but only 0.1 is read");
            return Err(fail(message).hint("the file is in another format, or too new"));
        }
        let level = match u16::from_le_bytes([head[20], head[21]]) {
            0 => Level::Floats,
            1 => Level::Halves,
            2 => Level::Bytes,
            other => {
                return Err(fail(format!(
                    "has the compression level {other}, but only 0, 1 and 2 are read"
                )));
            }
        };
        let range = [36, 40].map(|at| float_at(&head[at..], 0));
        // The viewer takes a zero for none, too.
        let range = [0, 1].map(|end| if range[end] == 0.0 { HARMONICS[end] } else { range[end] });
        let count = u64::from(field(head, 16));
        if count == 0 {
            return Err(fail("counts no Gaussians".into()));
        }
        source.check_points("the number of Gaussians", count)?;
        let sections = u64::from(field(head, 4));
        let end = HEADER as u64 + sections * SECTION as u64;
        if end > bytes.len() as u64 {
            let message = format!(
                "counts {sections} sections, whose headers end at byte {end}, but the file has {} \
                 bytes",
                bytes.len()
            );
            return Err(fail(message).hint("the file is cut off"));
        }
        Ok(Self { level, count, sections: sections as usize, range })
    }

    /// Returns a term above the constant one, by its number in the record.
    pub fn harmonic(&self, record: &[u8], at: usize) -> f32 {
        match self.level {
            Level::Floats => float_at(record, at),
            Level::Halves => half_at(record, at),
            Level::Bytes => {
                let [low, high] = self.range;
                low + f32::from(record[at]) / 255.0 * (high - low)
            }
        }
    }
}

/// Returns a number of four bytes.
fn field(bytes: &[u8], at: usize) -> u32 {
    u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
}

/// A section, whose parts lie inside the file.
#[derive(Debug)]
pub struct Section {
    /// The number of Gaussians in the sections before.
    pub first: usize,
    pub degree: u32,
    count: usize,
    /// The byte where the centres of the buckets begin.
    centers: usize,
    /// The byte where the records begin.
    records: usize,
    /// The size of a step of a position.
    step: f64,
    /// Steps from the centre of a bucket to its side.
    steps: u32,
    /// Gaussians of a full bucket. Full ones come before the partial ones.
    bucket: usize,
    /// The number of the Gaussian behind each partial bucket.
    ends: Vec<usize>,
    full: usize,
}

/// Reads the headers of all sections, and the lengths of their buckets.
pub fn sections(source: &Source, header: &Header) -> Result<Vec<Section>> {
    source.room::<Section>("the sections", header.sections)?;
    let mut sections = Vec::with_capacity(header.sections);
    let mut start = (HEADER + header.sections * SECTION) as u64;
    let mut first = 0;
    for number in 0..header.sections {
        source.check_time()?;
        let place = format!("section {number} (byte {})", HEADER + number * SECTION);
        let section = Section::read(source, header.level, (number, &place), &mut start, first)?;
        first += section.count;
        sections.push(section);
    }
    if first as u64 != header.count {
        let message = format!("counts {} Gaussians, but its sections have {first}", header.count);
        return Err(source.error("header", message));
    }
    Ok(sections)
}

impl Section {
    /// Reads the header of a section whose data begin at `start`, and moves `start` behind them.
    fn read(
        source: &Source,
        level: Level,
        (number, place): (usize, &str),
        start: &mut u64,
        first: usize,
    ) -> Result<Self> {
        let bytes = source.bytes();
        let fail = |message: String| Err(source.error(place, message));
        let head = &bytes[HEADER + number * SECTION..][..SECTION];
        let [count, room, bucket, buckets] = [0, 4, 8, 12].map(|at| field(head, at));
        let [full, partial] = [32, 36].map(|at| field(head, at));
        let degree = u32::from(u16::from_le_bytes([head[40], head[41]]));
        if degree > MOST_DEGREE {
            return fail(format!(
                "has harmonics of the degree {degree}, but .ksplat has at most {MOST_DEGREE}"
            ));
        }
        if count > room {
            return fail(format!("counts {count} Gaussians in room for {room}"));
        }
        let of_bucket = u64::from(u16::from_le_bytes([head[20], head[21]]));
        let centers = *start + 4 * u64::from(partial);
        let records = centers + of_bucket * u64::from(buckets);
        let end = records + level.record(degree) as u64 * u64::from(room);
        if end > bytes.len() as u64 {
            let message = format!(
                "lies in the bytes {start} to {end}, but the file has {} bytes",
                bytes.len()
            );
            return Err(source.error(place, message).hint("the file is cut off"));
        }
        let lengths = &bytes[*start as usize..centers as usize];
        *start = end;
        let mut section = Self {
            first,
            degree,
            count: count as usize,
            centers: centers as usize,
            records: records as usize,
            step: 0.0,
            steps: Some(field(head, 24)).filter(|&steps| steps > 0).unwrap_or(STEPS),
            bucket: bucket as usize,
            ends: Vec::new(),
            full: full as usize,
        };
        if level != Level::Floats && count > 0 {
            section.read_buckets(source, place, head, lengths)?;
        }
        Ok(section)
    }

    /// Reads the sizes of the buckets from the header of the section and from their `lengths`.
    fn read_buckets(
        &mut self,
        source: &Source,
        place: &str,
        head: &[u8],
        lengths: &[u8],
    ) -> Result<()> {
        let fail = |message: String| Err(source.error(place, message));
        let (buckets, partial) = (field(head, 12), field(head, 36));
        let of_bucket = usize::from(u16::from_le_bytes([head[20], head[21]]));
        if of_bucket != BUCKET {
            return fail(format!("has {of_bucket} bytes for a bucket, but {BUCKET} are expected"));
        }
        if self.full as u64 + u64::from(partial) > u64::from(buckets) {
            return fail(format!(
                "has {} full and {partial} partial buckets, but counts {buckets}",
                self.full
            ));
        }
        let side = float_at(head, 4);
        if !(side.is_finite() && side > 0.0) {
            return fail(format!("has blocks of the size {side}; a positive number is expected"));
        }
        self.step = f64::from(side) / 2.0 / f64::from(self.steps);
        let (lengths, _) = lengths.as_chunks::<4>();
        source.room::<usize>("the buckets", lengths.len())?;
        let mut end = self.full.saturating_mul(self.bucket);
        self.ends.reserve_exact(lengths.len());
        for &length in lengths {
            end = end.saturating_add(u32::from_le_bytes(length) as usize);
            self.ends.push(end);
        }
        if end < self.count {
            return fail(format!("has {} Gaussians, but its buckets have {end}", self.count));
        }
        Ok(())
    }

    /// Returns the bytes of a Gaussian.
    pub fn record<'a>(&self, bytes: &'a [u8], level: Level, index: usize) -> &'a [u8] {
        let size = level.record(self.degree);
        &bytes[self.records + size * index..][..size]
    }

    /// Returns the centre of a Gaussian with a position in steps.
    pub fn center(&self, bytes: &[u8], index: usize, steps: DVec3) -> DVec3 {
        let in_full = self.full.saturating_mul(self.bucket);
        let bucket = if index < in_full {
            index / self.bucket
        } else {
            self.full + self.ends.partition_point(|&end| end <= index)
        };
        let center = &bytes[self.centers + BUCKET * bucket..][..BUCKET];
        let center = DVec3::from_array([0, 1, 2].map(|axis| float_at(center, axis).into()));
        center + (steps - f64::from(self.steps)) * self.step
    }
}
