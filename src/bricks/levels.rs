//! Bricks of an image that is stored in levels of its own, as OME-Zarr has them.
//!
//! The levels of bricks are halved along each axis, whatever the image's are. A level of bricks is
//! read from the coarsest level of the image that is at least as fine along each axis; its samples
//! are means of that level's where it is finer. Levels that would need many samples for each of
//! their own are made when the image is opened, and stay in memory.

use super::{Brick, Header, Level, REACH, SIDE, cut::Slices, halve::halve, level};
use crate::{
    Error, Result,
    formats::{ReadOptions, zarr::Field},
    input::Source,
    volume::{Lattice, Samples, Scalar, steps::Steps},
};

/// Most samples of the image that a sample is the mean of, of levels that are read.
const MOST_MEAN: f64 = 64.0;

/// Most samples of the level whose values give the range of all.
const OVERVIEW: usize = 1 << 21;

/// A channel in levels of bricks.
pub struct Leveled {
    field: Field,
    levels: Vec<Level>,
    sources: Vec<Origin>,
    /// The value of samples that have none.
    low: f64,
    missing: Option<f64>,
    steps: Steps,
}

/// Where the samples of a level of bricks come from.
enum Origin {
    /// A level of the image, and how many of its samples there are for each along each axis.
    Image(usize, [f64; 3]),
    /// The bytes of all samples.
    Memory(Vec<u8>),
}

impl Leveled {
    /// Opens a channel. Returns it with the properties of the volume.
    ///
    /// # Errors
    /// [`Error::Input`] for an image that cannot be cut into bricks, and those of reading it.
    pub fn open(source: &Source, field: Field, options: &ReadOptions) -> Result<(Self, Header)> {
        let wrong = |message: String| source.error("levels", message);
        let scalar = field.scalar();
        let mut lattice = field.levels()[0].lattice.clone();
        if let Some(spacing) = options.spacing {
            lattice = lattice.with_steps_of(spacing).map_err(wrong)?;
        }
        level::refusal(&lattice).map_err(wrong)?;
        let levels = level::levels(lattice.dims);
        let steps = Steps::new(scalar, [0.0, 1.0]);
        let low = options.missing.unwrap_or(f64::NAN);
        let missing = options.missing;
        let mut stored = Self { field, levels, sources: Vec::new(), low, missing, steps };
        for number in 0..stored.levels.len() {
            let origin = stored.origin(number);
            stored.sources.push(match origin {
                Origin::Image(_, ratio)
                    if number > 0 && ratio.iter().product::<f64>() > MOST_MEAN =>
                {
                    source.check_time()?;
                    let below = stored.whole(number - 1)?;
                    let dims = stored.levels[number - 1].dims;
                    Origin::Memory(halve(scalar, &below, dims))
                }
                origin => origin,
            });
        }
        let range = stored.measured().map_err(|error| error.in_file(source.path))?;
        let Some(range) = range else {
            return Err(wrong("has no sample with a value".into()));
        };
        (stored.low, stored.steps) = (range[0], Steps::new(scalar, range));
        let unit = stored.field.image.unit.clone();
        let header = Header { lattice, scalar, range, unit, ..Header::empty() };
        header.validate().map_err(wrong)?;
        Ok((stored, header))
    }

    /// Returns the levels of bricks.
    pub fn levels(&self) -> &[Level] {
        &self.levels
    }

    /// Returns the level of the image that a level of bricks is read from.
    fn origin(&self, number: usize) -> Origin {
        let fine = &self.field.levels()[0];
        let wanted = steps(fine.dims, number);
        let ratios = self.field.levels().iter().map(|level| {
            let factors = factors([fine.dims, level.dims], [&fine.lattice, &level.lattice]);
            [0, 1, 2].map(|axis| wanted[axis] / factors[axis])
        });
        let fits = |(_, ratio): &(usize, [f64; 3])| ratio.iter().all(|ratio| *ratio >= 0.99);
        let best = ratios.enumerate().filter(fits).min_by(|(_, a), (_, b)| {
            a.iter().product::<f64>().total_cmp(&b.iter().product::<f64>())
        });
        // The finest level fits every level of bricks.
        let (level, ratio) = best.unwrap_or((0, wanted));
        Origin::Image(level, ratio)
    }

    /// Returns all samples of a level that is read, by their bytes.
    fn whole(&self, number: usize) -> Result<Vec<u8>> {
        let dims = self.levels[number].dims;
        let mut all = Vec::new();
        for z in (0..dims[2]).step_by(SIDE) {
            let count = [dims[0], dims[1], SIDE.min(dims[2] - z)];
            all.extend_from_slice(&self.window(number, [[0, 0, z], count])?);
        }
        Ok(all)
    }

    /// Returns the range of the values of a level that is quickly read, wider than they are if
    /// other levels may have values beyond; `None` if no sample has a value.
    fn measured(&self) -> Result<Option<[f64; 2]>> {
        let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= OVERVIEW;
        let number = self.levels.iter().position(is_quick).unwrap_or(self.levels.len() - 1);
        let scalar = self.field.scalar();
        let bytes = self.whole(number)?;
        let values = bytes.chunks_exact(scalar.bytes()).map(|bytes| scalar.value(bytes));
        let [mut low, mut high] = [f64::INFINITY, f64::NEG_INFINITY];
        for value in values.filter(|value| !self.is_hole(*value)) {
            (low, high) = (low.min(value), high.max(value));
        }
        if low > high {
            return Ok(None);
        }
        if number == 0 {
            return Ok(Some([low, high]));
        }
        let (least, most) = match scalar {
            Scalar::U8 => (0.0, f64::from(u8::MAX)),
            Scalar::U16 => (0.0, f64::from(u16::MAX)),
            Scalar::I16 => (f64::from(i16::MIN), f64::from(i16::MAX)),
            Scalar::I32 => (f64::from(i32::MIN), f64::from(i32::MAX)),
            Scalar::F32 => (f64::from(f32::MIN) / 4.0, f64::from(f32::MAX) / 4.0),
        };
        let least = if low >= 0.0 { 0.0 } else { least };
        let width = high - low;
        Ok(Some([(low - 0.25 * width).max(least), (high + 0.5 * width).min(most)]))
    }

    fn is_hole(&self, value: f64) -> bool {
        !value.is_finite() || self.missing == Some(value)
    }

    /// Returns the first sample of a brick with those around it, and how many there are.
    fn part(&self, number: usize, brick: u32) -> [[usize; 3]; 2] {
        let level = self.levels[number];
        let place = level.place(brick);
        let from = place.map(|at| (at * SIDE).saturating_sub(REACH));
        let end = |axis: usize| ((place[axis] + 1) * SIDE + REACH).min(level.dims[axis]);
        [from, [0, 1, 2].map(|axis| end(axis) - from[axis])]
    }

    /// Reads the chunks of bricks that are read soon. Bricks that do not exist are left out.
    pub fn fetch(&self, bricks: impl Iterator<Item = (usize, u32)>) {
        let mut parts = vec![Vec::new(); self.field.levels().len()];
        for (number, brick) in bricks {
            let exists = self.levels.get(number).is_some_and(|l| (brick as usize) < l.bricks());
            let Some(&Origin::Image(level, ratio)) = self.sources.get(number).filter(|_| exists)
            else {
                continue;
            };
            let (_, part) = self.spans((level, ratio), self.part(number, brick));
            parts[level].push(part);
        }
        for (level, parts) in parts.iter().enumerate().filter(|(_, parts)| !parts.is_empty()) {
            self.field.fetch(level, parts);
        }
    }

    /// Reads a brick.
    ///
    /// # Errors
    /// Those of reading chunks.
    pub fn read(&self, number: usize, brick: u32) -> Result<Brick> {
        let level = self.levels[number];
        let place = level.place(brick);
        let [from, count] = self.part(number, brick);
        let samples = self.window(number, [from, count])?;
        let scalar = self.field.scalar();
        let slices =
            Slices { level, scalar, first: from, row: count[0], rows: count[1], samples: &samples };
        Ok(slices.brick(place, &self.steps))
    }

    /// Returns the bytes of a box of samples, x fastest.
    fn window(&self, number: usize, [from, count]: [[usize; 3]; 2]) -> Result<Vec<u8>> {
        let scalar = self.field.scalar();
        match self.sources.get(number) {
            Some(Origin::Memory(bytes)) => {
                let [nx, ny, _] = self.levels[number].dims;
                let mut out = Vec::with_capacity(count.iter().product::<usize>() * scalar.bytes());
                for (k, j) in (0..count[2]).flat_map(|k| (0..count[1]).map(move |j| (k, j))) {
                    let start = ((from[2] + k) * ny + from[1] + j) * nx + from[0];
                    let row = start * scalar.bytes()..(start + count[0]) * scalar.bytes();
                    out.extend_from_slice(&bytes[row]);
                }
                Ok(out)
            }
            Some(&Origin::Image(level, ratio)) => self.means((level, ratio), [from, count]),
            None => Err(Error::Argument(format!("there is no level {number}"))),
        }
    }

    /// Returns for each sample of a box, along each axis, the first and the last sample of the
    /// image behind it; and the box of the image that has all of them.
    fn spans(
        &self,
        (level, ratio): (usize, [f64; 3]),
        [from, count]: [[usize; 3]; 2],
    ) -> ([Vec<[usize; 2]>; 3], [[usize; 3]; 2]) {
        let dims = self.field.levels()[level].dims;
        let spans: [Vec<[usize; 2]>; 3] = std::array::from_fn(|axis| {
            let span = |at: usize| span(from[axis] + at, ratio[axis], dims[axis]);
            (0..count[axis]).map(span).collect()
        });
        let first = spans.each_ref().map(|spans| spans[0][0]);
        let size = [0, 1, 2].map(|axis| spans[axis][count[axis] - 1][1] - first[axis]);
        (spans, [first, size])
    }

    /// Returns the means of samples of a level of the image.
    fn means(
        &self,
        (level, ratio): (usize, [f64; 3]),
        [from, count]: [[usize; 3]; 2],
    ) -> Result<Vec<u8>> {
        let (spans, [first, size]) = self.spans((level, ratio), [from, count]);
        let samples = self.field.window(level, [first, size], &|| Ok(()))?;
        let is_same = size == count && spans.iter().flatten().all(|[from, to]| to - from == 1);
        let has_holes = self.missing.is_some() || matches!(samples, Samples::F32(_));
        if is_same && !has_holes {
            return Ok(samples.bytes().to_vec());
        }
        let mut out = Writer { scalar: self.field.scalar(), bytes: Vec::new() };
        for ([k0, k1], [j0, j1]) in
            spans[2].iter().flat_map(|k| spans[1].iter().map(move |j| (k, j)))
        {
            for [i0, i1] in &spans[0] {
                let (mut sum, mut number) = (0.0, 0u32);
                for (k, j) in (*k0..*k1).flat_map(|k| (*j0..*j1).map(move |j| (k, j))) {
                    let row = ((k - first[2]) * size[1] + j - first[1]) * size[0];
                    for i in *i0..*i1 {
                        let value = samples.value(row + i - first[0]);
                        if !self.is_hole(value) {
                            (sum, number) = (sum + value, number + 1);
                        }
                    }
                }
                out.push(if number > 0 { sum / f64::from(number) } else { self.low });
            }
        }
        Ok(out.bytes)
    }
}

/// Takes values as the bytes of samples.
struct Writer {
    scalar: Scalar,
    bytes: Vec<u8>,
}

impl Writer {
    fn push(&mut self, value: f64) {
        match self.scalar {
            Scalar::U8 => self.bytes.push(value.round() as u8),
            Scalar::U16 => self.bytes.extend_from_slice(&(value.round() as u16).to_ne_bytes()),
            Scalar::I16 => self.bytes.extend_from_slice(&(value.round() as i16).to_ne_bytes()),
            Scalar::I32 => self.bytes.extend_from_slice(&(value.round() as i32).to_ne_bytes()),
            Scalar::F32 => self.bytes.extend_from_slice(&(value as f32).to_ne_bytes()),
        }
    }
}

/// Returns the first sample of an image, and the one after the last, that a sample is the mean of.
fn span(at: usize, ratio: f64, count: usize) -> [usize; 2] {
    const SLACK: f64 = 1e-6;
    let first = ((at as f64 * ratio + SLACK).floor() as usize).min(count - 1);
    let end = (((at + 1) as f64 * ratio - SLACK).ceil() as usize).clamp(first + 1, count);
    [first, end]
}

/// Returns how many samples of level 0 a sample of a level of bricks stands for along each axis.
fn steps(mut dims: [usize; 3], level: usize) -> [f64; 3] {
    let mut steps = [1.0; 3];
    for _ in 0..level {
        for (n, step) in dims.iter_mut().zip(&mut steps).filter(|(n, _)| **n > 1) {
            (*n, *step) = (n.div_ceil(2), 2.0 * *step);
        }
    }
    steps
}

/// Returns how many samples of the finest level a sample of another level of the image stands for:
/// as the distances say, if the number of samples agrees.
fn factors([fine, coarse]: [[usize; 3]; 2], lattices: [&Lattice; 2]) -> [f64; 3] {
    let [fine_steps, steps] = lattices.map(|lattice| lattice.spacing().to_array());
    [0, 1, 2].map(|axis| {
        let (count, fine_count) = (coarse[axis] as f64, fine[axis] as f64);
        let by_steps = steps[axis] / fine_steps[axis];
        let agrees = by_steps >= 0.99 && (count * by_steps - fine_count).abs() <= by_steps;
        if agrees { by_steps } else { fine_count / count }
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        bricks::Bricks,
        input::{Limits, testing::Folder},
    };
    use std::{fs, sync::Arc};

    /// Writes an array of bytes of Zarr 2, in chunks of 16³.
    fn put(folder: &Folder, name: &str, dims: [usize; 3], value: impl Fn([usize; 3]) -> u8) {
        let path = folder.path(name);
        fs::create_dir_all(&path).unwrap();
        let [nx, ny, nz] = dims;
        let metadata = format!(
            "{{\"zarr_format\": 2, \"shape\": [{nz}, {ny}, {nx}], \"chunks\": [16, 16, 16], \
             \"dtype\": \"|u1\", \"compressor\": null, \"fill_value\": 0, \"order\": \"C\"}}"
        );
        fs::write(path.join(".zarray"), metadata).unwrap();
        let along = |n: usize| 0..n.div_ceil(16);
        let chunks = along(nz).flat_map(|k| along(ny).map(move |j| (k, j)));
        for (k, j, i) in chunks.flat_map(|(k, j)| along(nx).map(move |i| (k, j, i))) {
            let at = |n: usize| [16 * i + n % 16, 16 * j + n / 16 % 16, 16 * k + n / 256];
            let bytes: Vec<u8> = (0..4096).map(|n| value(at(n))).collect();
            fs::write(path.join(format!("{k}.{j}.{i}")), bytes).unwrap();
        }
    }

    /// An image of two levels, of which the second is halved along x and y alone.
    fn image(folder: &Folder) {
        put(folder, "a.zarr/0", [70, 36, 40], |[x, y, z]| (x + 2 * y + z) as u8);
        put(folder, "a.zarr/1", [35, 18, 40], |[_, _, z]| 5 * z as u8);
        let level = |path: &str, step: f64| {
            format!(
                "{{\"path\": \"{path}\", \"coordinateTransformations\": \
                 [{{\"type\": \"scale\", \"scale\": [3, {step}, {step}]}}]}}"
            )
        };
        let attributes = format!(
            "{{\"multiscales\": [{{\"datasets\": [{}, {}]}}]}}",
            level("0", 1.0),
            level("1", 2.0)
        );
        fs::write(folder.path("a.zarr/.zattrs"), attributes).unwrap();
    }

    #[test]
    fn bricks_are_read_from_the_levels_of_an_image() {
        let folder = Folder::new();
        image(&folder);
        let (path, limits) = (folder.path("a.zarr"), Limits::default());
        let source = Source::open_any(&path, &limits).unwrap();
        let bricks = Bricks::open_store(&source, &ReadOptions::default()).unwrap();
        let dims: Vec<_> = bricks.levels().iter().map(|level| level.dims).collect();
        assert_eq!(dims, [[70, 36, 40], [35, 18, 20], [18, 9, 10]]);
        assert_eq!(bricks.header().range, [0.0, 178.0]);
        assert_eq!(bricks.header().lattice.spacing().to_array(), [1.0, 1.0, 3.0]);
        assert!(bricks.ranges(0).iter().all(|range| *range == [0, 255]));
        // As of a volume in memory: the samples, and the ranges of blocks with what is around.
        let volume = Arc::new(bricks.volume(0).unwrap());
        let value = |at: usize| volume.value(at);
        assert_eq!([0, 1, 70, 70 * 36].map(value), [0.0, 1.0, 2.0, 1.0]);
        let memory = Bricks::from_volume(volume.clone()).unwrap();
        for brick in 0..bricks.level(0).bricks() as u32 {
            assert_eq!(bricks.read(0, brick).unwrap(), memory.read(0, brick).unwrap(), "{brick}");
        }
        // Coarser levels: means of two, and of four samples along z.
        for (level, step, first) in [(1, 10.0, 3.0), (2, 20.0, 8.0)] {
            let volume = bricks.volume(level).unwrap();
            let slice = volume.lattice.dims[0] * volume.lattice.dims[1];
            for at in 0..volume.len() {
                assert_eq!(volume.value(at), first + step * (at / slice) as f64, "{level}: {at}");
            }
        }
        // A chunk that is cut off is an error of its file.
        fs::write(folder.path("a.zarr/0/0.0.0"), [0; 5]).unwrap();
        let source = Source::open_any(&path, &limits).unwrap();
        let error = Bricks::open_store(&source, &ReadOptions::default()).unwrap_err().to_string();
        assert!(error.contains("0.0.0: chunk (0, 0, 0): has 5 bytes"), "{error}");
    }

    #[test]
    fn samples_are_means_of_those_that_they_cover() {
        assert_eq!([0, 1, 2].map(|at| span(at, 1.0, 3)), [[0, 1], [1, 2], [2, 3]]);
        assert_eq!([0, 1, 2].map(|at| span(at, 2.0, 5)), [[0, 2], [2, 4], [4, 5]]);
        // A level that was rounded down has no sample for the last one.
        assert_eq!(span(2, 1.0, 2), [1, 2]);
        assert_eq!(span(1, 4.0 / 3.0, 9), [1, 3]);
        assert_eq!(steps([100, 3, 1], 3), [8.0, 4.0, 1.0]);
    }

    #[test]
    fn factors_are_those_of_the_distances_if_they_fit() {
        let lattice = |step: f64| Lattice::with_spacing([2; 3], glam::DVec3::splat(step));
        let of = |step: f64| factors([[101; 3], [50; 3]], [&lattice(0.5), &lattice(step)])[0];
        assert_eq!((of(1.0), of(0.5)), (2.0, 101.0 / 50.0));
    }
}
