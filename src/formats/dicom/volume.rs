//! A series as a volume.

use super::{
    file::File,
    head::{Colors, Head, Layout},
    label_map, name,
    pixels::{Decoded, Decoder},
    stack::{Slice, Stack, stacks},
};
use crate::{
    Result,
    about::Orientation,
    formats::{
        ReadOptions,
        shared::{anatomy::Anatomy, colors, holes, rescale::rescaled, several},
    },
    input::Source,
    parallel::{self, prelude::*},
    volume::{Samples, Scalar, Volume, each_type},
    warning,
};

/// Reads the volume of a series that the options choose.
pub fn read(source: &Source, heads: Vec<Head>, options: &ReadOptions) -> Result<Volume> {
    if heads.first().is_some_and(|head| head.segmentation.is_some()) {
        return label_map::read(source, &heads, options);
    }
    let mut stack = chosen(source, &heads, options)?;
    let first = &heads[stack.slices[0].file];
    let layout = first.layout;
    let lattice = stack.lattice(layout.columns, layout.rows);
    lattice.check().map_err(|message| {
        source
            .error("positions", format!("{message} (the slices begin with {})", name(&first.path)))
    })?;
    let one = &stack.slices[0].frame;
    let is_even = stack.slices.iter().all(|slice| {
        let slice_layout = heads[slice.file].layout;
        (slice.frame.slope, slice.frame.intercept) == (one.slope, one.intercept)
            && slice_layout.scalar() == layout.scalar()
            && slice_layout.padding == layout.padding
    });
    let (mut samples, colors) = joined(source, &heads, &stack.slices, is_even)?;
    if is_even && (one.slope, one.intercept) != (1.0, 0.0) {
        source.room::<f32>("the scaled samples", samples.len())?;
        samples = rescaled(samples, one.slope, one.intercept);
    }
    let mut padded = 0;
    if let Some(range) = layout.padding.filter(|_| is_even) {
        let ends = range.map(|end| one.slope * end + one.intercept);
        padded = fill(&mut samples, [ends[0].min(ends[1]), ends[0].max(ends[1])]);
    }
    let mut volume = holes::volume(source, lattice, samples, options)?;
    volume.about.holes += padded;
    if let Some(colors) = colors.filter(|_| options.scalar.is_none()) {
        colors::attach(&mut volume, colors.into());
    }
    describe(&mut volume, first, &stack);
    if layout.colors == Colors::Inverted {
        volume = inverted(source, volume)?;
    }
    tell(source, &stack);
    Ok(volume)
}

/// Replaces padding, values in a range, by the lowest of the other values. Returns how many there
/// were; none if all values lie in the range, because then it is wrong.
fn fill(samples: &mut Samples, [low, high]: [f64; 2]) -> u64 {
    fn of<T: Copy + PartialOrd + Into<f64>>(values: &mut [T], is: impl Fn(T) -> bool) -> u64 {
        let others = values.iter().copied().filter(|&value| !is(value));
        let lowest = others.reduce(|a, b| if b < a { b } else { a });
        let Some(lowest) = lowest else { return 0 };
        let padding = values.iter_mut().filter(|value| is(**value));
        padding.map(|value| *value = lowest).count() as u64
    }
    let is = |value: f64| low <= value && value <= high;
    each_type!(mut samples, values => of(values, |value| is(f64::from(value))))
}

/// Returns the stack of the series that the options choose.
fn chosen(source: &Source, heads: &[Head], options: &ReadOptions) -> Result<Stack> {
    let mut stacks = stacks(heads);
    let count = stacks.len();
    let sizes = || stacks.iter().map(|stack| stack.slices.len());
    let most = sizes().max().unwrap_or(0);
    let first = sizes().position(|size| size == most).unwrap_or(0);
    let wanted = ReadOptions { time: options.time.or(Some(first)), ..ReadOptions::default() };
    let at = several::time(source, "series", count as u64, &wanted)?;
    let mut stack = stacks.swap_remove(at);
    if count > 1 && options.time.is_none() {
        let names = "times, echoes or other repetitions";
        let word = match at {
            0 => format!("shows the first of {count} {names}; --time 1 shows the second"),
            _ => format!("shows number {at} of {count} {names}; --time 0 shows the first"),
        };
        stack.words.push(word);
    }
    Ok(stack)
}

/// The frames of one file: for each, its place among the slices.
struct Job<'a> {
    head: &'a Head,
    frames: Vec<(usize, &'a Slice)>,
}

/// Returns the samples of all slices, as they are stored, or scaled one by one; and their colours,
/// if all slices are in colours.
fn joined(
    source: &Source,
    heads: &[Head],
    slices: &[Slice],
    is_even: bool,
) -> Result<(Samples, Option<Vec<[u8; 4]>>)> {
    let layout = &heads[slices[0].file].layout;
    let scalar = if is_even { layout.scalar() } else { Scalar::F32 };
    let size = layout.columns.saturating_mul(layout.rows);
    let bytes = (size as u64).saturating_mul((slices.len() * scalar.bytes()) as u64);
    let bytes = source.check_bytes("the size of the samples in bytes", bytes)?;
    let mut jobs: Vec<Job> = Vec::new();
    let mut order: Vec<(usize, &Slice)> = slices.iter().enumerate().collect();
    order.sort_by_key(|(_, slice)| slice.file);
    for part in order.chunk_by(|a, b| a.1.file == b.1.file) {
        jobs.push(Job { head: &heads[part[0].1.file], frames: part.to_vec() });
    }
    let is_colored = slices.iter().all(|slice| heads[slice.file].layout.is_colored());
    let mut out: Option<Samples> = None;
    let mut colors: Option<Vec<[u8; 4]>> = None;
    for batch in jobs.chunks(2 * parallel::current_num_threads()) {
        source.check_time()?;
        let decoded: Vec<Result<Vec<(usize, Decoded)>>> =
            batch.par_iter().map(|job| frames(source, job, is_even)).collect();
        for decoded in decoded {
            for (at, Decoded { samples, colors: frame_colors }) in decoded? {
                // Memory is taken once there is a frame, which has the bytes that it claims.
                if out.is_none() {
                    source.spend("the size of the samples in bytes", bytes as u64)?;
                    if is_colored {
                        let bytes = 4 * (size * slices.len()) as u64;
                        source.spend("the size of the colours in bytes", bytes)?;
                        colors = Some(vec![[0; 4]; size * slices.len()]);
                    }
                }
                if let (Some(colors), Some(frame_colors)) = (&mut colors, frame_colors) {
                    colors[at * size..(at + 1) * size].copy_from_slice(&frame_colors);
                }
                let out = out.get_or_insert_with(|| zeros(scalar, size * slices.len()));
                let (start, end) = (at * size, (at + 1) * size);
                each_type!(mut out, values => {
                    bytemuck::cast_slice_mut(&mut values[start..end])
                        .copy_from_slice(samples.bytes());
                });
            }
        }
    }
    Ok((out.ok_or_else(|| source.error("series", "has no slices"))?, colors))
}

fn zeros(scalar: Scalar, count: usize) -> Samples {
    match scalar {
        Scalar::U8 => Samples::U8(vec![0; count]),
        Scalar::U16 => Samples::U16(vec![0; count]),
        Scalar::I16 => Samples::I16(vec![0; count]),
        Scalar::I32 => Samples::I32(vec![0; count]),
        Scalar::F32 => Samples::F32(vec![0.0; count]),
    }
}

/// Decodes the frames of one file.
fn frames(source: &Source, job: &Job, is_even: bool) -> Result<Vec<(usize, Decoded)>> {
    let path = job.head.path.as_path();
    let beside;
    let opened = if path == source.path {
        source
    } else {
        beside = source.open_beside(path)?;
        &beside
    };
    let file = File::open(opened)?;
    let decoder = Decoder::new(&file, job.head.layout)?;
    let expected = job.head.layout.columns * job.head.layout.rows;
    let decode = |&(at, slice): &(usize, &Slice)| {
        opened.check_time()?;
        let mut decoded = decoder.frame(slice.frame.number)?;
        let count = decoded.samples.len();
        if count != expected
            || decoded.colors.as_ref().is_some_and(|colors| colors.len() != expected)
        {
            let message = format!("{count} pixels where {expected} were expected");
            return Err(opened.error("pixel data", message));
        }
        if !is_even {
            decoded.samples = scaled(&decoded.samples, slice, &job.head.layout);
        }
        Ok((at, decoded))
    };
    let decoded: Result<Vec<_>> = job.frames.par_iter().map(decode).collect();
    opened.unless_changed(decoded)
}

/// Returns the values of a slice as floats. Padding is not a number.
fn scaled(samples: &Samples, slice: &Slice, layout: &Layout) -> Samples {
    let frame = &slice.frame;
    let value = |stored: f64| match layout.padding {
        Some([low, high]) if low <= stored && stored <= high => f32::NAN,
        _ => (frame.slope * stored + frame.intercept) as f32,
    };
    Samples::F32((0..samples.len()).map(|i| value(samples.value(i))).collect())
}

/// Fills in what the files say beyond the values.
fn describe(volume: &mut Volume, head: &Head, stack: &Stack) {
    let middle = &stack.slices[stack.slices.len() / 2].frame;
    let about = &mut volume.about;
    about.modality = head.nature.modality;
    about.unit.clone_from(&head.nature.unit);
    about.window = middle.window;
    if middle.spacing.is_some() {
        about.length = "mm".into();
    }
    if let Some([x, y]) = middle.directions {
        // One slice is seen from its front, as on film.
        if stack.slices.len() == 1 {
            let front = -x.cross(y).normalize_or(y.any_orthonormal_vector());
            about.orientation = Some(Orientation { up: -y, front });
        }
        Anatomy::LPS.place(volume);
    } else if stack.slices.len() == 1 {
        let [x, y] = [glam::DVec3::X, glam::DVec3::Y];
        about.orientation = Some(Orientation { up: -y, front: -x.cross(y) });
    }
}

/// Returns a volume in which the highest values are the lowest, because they mean dark.
fn inverted(source: &Source, mut volume: Volume) -> Result<Volume> {
    let [low, high] = volume.range;
    source.room::<f32>("the inverted samples", volume.len())?;
    volume.samples = match &volume.samples {
        Samples::U8(values) => {
            let sum = (low + high) as u16;
            Samples::U8(values.iter().map(|&value| (sum - u16::from(value)) as u8).collect())
        }
        other => rescaled(rescaled(other.clone(), -1.0, 0.0), 1.0, low + high),
    };
    volume.range = [low, high];
    volume.about.window =
        volume.about.window.map(|[from, to]| [low + high - to, low + high - from]);
    Ok(volume)
}

/// Says what was left out.
fn tell(source: &Source, stack: &Stack) {
    let path = source.path.display();
    stack.words.iter().for_each(|word| warning::give!("{path}: {word}"));
    if stack.slices.len() == 1 && source.folder().is_none() {
        warning::give!("{path}: holds one slice; name its folder to draw the whole series");
    }
}
