//! Where the frames of a file lie, and how their values are scaled.

use super::{element::Set, tags};
use crate::{Result, input::Source, warning};
use glam::DVec3;

/// One picture of a file.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Its number in the file, from 0.
    pub number: u32,
    /// Where the centre of the first pixel lies; `None` if the file does not say.
    pub position: Option<DVec3>,
    /// The directions in which the numbers of columns and of rows grow, of unit length; `None` if
    /// the file does not say.
    pub directions: Option<[DVec3; 2]>,
    /// The steps from column to column and from row to row; `None` if the file does not say.
    pub spacing: Option<[f64; 2]>,
    /// The step to the next slice if there are no positions.
    pub step: Option<f64>,
    pub slope: f64,
    pub intercept: f64,
    /// The lowest and the highest value to show.
    pub window: Option<[f64; 2]>,
    /// What tells volumes of one series apart, in the order in which it is tried.
    pub marks: [Mark; MARKS],
    /// The order of frames if nothing else tells it.
    pub order: f64,
}

impl Frame {
    /// Returns the directions of columns and rows; along x and y if the file does not say.
    pub fn axes(&self) -> [DVec3; 2] {
        self.directions.unwrap_or([DVec3::X, DVec3::Y])
    }

    /// Returns the direction across the frame.
    pub fn normal(&self) -> DVec3 {
        let [x, y] = self.axes();
        x.cross(y).normalize_or(DVec3::Z)
    }

    /// Returns whether another frame has the same directions.
    pub fn is_parallel(&self, other: &Self) -> bool {
        let [a, b] = [self.axes(), other.axes()];
        (0..2).all(|axis| a[axis].dot(b[axis]) > 1.0 - 1e-4)
    }
}

/// The index of a time, an echo, and so on.
#[derive(Debug, Clone, PartialEq)]
pub enum Mark {
    None,
    Number(f64),
    Word(String),
}

/// How many marks tell volumes of one series apart.
pub const MARKS: usize = 9;

/// Reads the frames of a file, whose pixels take some bytes.
pub fn frames(source: &Source, set: &Set, bytes: usize) -> Result<Vec<Frame>> {
    // No frame takes less than a byte.
    let most = bytes.clamp(1, 1 << 24) as f64;
    let count = match set.decimal(tags::FRAMES) {
        None => 1,
        Some(count) if count >= 1.0 && count.fract() == 0.0 && count <= most => count as u32,
        Some(count) => {
            let message = format!("is {count}, but the pixels have {bytes} bytes");
            return Err(source.error("Number of Frames", message));
        }
    };
    let shared = set.item(tags::SHARED_GROUPS)?;
    let groups = set.items(tags::FRAME_GROUPS)?;
    let whole = whole(set)?;
    if groups.is_empty() && shared.is_none() {
        return classic(source, set, &whole, count);
    }
    source.room::<Frame>("the frames", count as usize)?;
    let mut frames = Vec::new();
    for number in 0..count {
        let mut frame = Frame { number, order: number.into(), ..whole.clone() };
        // What holds for all frames, then what holds for this one.
        for group in shared.iter().chain(groups.get(number as usize)) {
            add_group(&mut frame, group)?;
        }
        frames.push(frame);
    }
    Ok(frames)
}

/// Reads what the data set says of all its frames.
fn whole(set: &Set) -> Result<Frame> {
    let detector = set.item(tags::DETECTORS)?;
    let vector = |tag| {
        let of_set = set.vector::<3>(tag);
        of_set.or_else(|| detector.as_ref().and_then(|item| item.vector(tag))).map(DVec3::from)
    };
    let orientation = |set: &Set| directions(set.vector(tags::ORIENTATION)?);
    let positive = |tag| set.decimal(tag).map(f64::abs).filter(|&step| step > 0.0);
    Ok(Frame {
        number: 0,
        // Files of before 1993 have a location alone.
        position: vector(tags::POSITION)
            .or_else(|| set.decimal(tags::SLICE_LOCATION).map(|along| DVec3::Z * along)),
        directions: orientation(set).or_else(|| detector.as_ref().and_then(orientation)),
        spacing: spacing(set)?,
        step: positive(tags::SPACING_BETWEEN_SLICES).or_else(|| positive(tags::SLICE_THICKNESS)),
        slope: slope(set).unwrap_or(1.0),
        intercept: set.decimal(tags::INTERCEPT).unwrap_or(0.0),
        window: window(set),
        marks: [
            mark(set.decimal(tags::TEMPORAL_POSITION)),
            mark(set.decimal(tags::ECHO_NUMBER)),
            mark(set.decimal(tags::ECHO_TIME)),
            mark(set.decimal(tags::TRIGGER_TIME)),
            mark(set.doubles(tags::DIFFUSION_B_VALUE).first().copied()),
            mark(set.decimal(tags::ACQUISITION_NUMBER)),
            set.text(tags::IMAGE_TYPE).map_or(Mark::None, Mark::Word),
            mark(set.decimal(tags::ACQUISITION_TIME)),
            mark(set.decimal(tags::CONTENT_TIME)),
        ],
        order: set.decimal(tags::INSTANCE_NUMBER).unwrap_or(0.0),
    })
}

fn mark(number: Option<f64>) -> Mark {
    number.map_or(Mark::None, Mark::Number)
}

/// Returns the unit directions of six numbers, unless they do not span a plane.
fn directions([a, b, c, d, e, f]: [f64; 6]) -> Option<[DVec3; 2]> {
    let [x, y] = [DVec3::new(a, b, c), DVec3::new(d, e, f)];
    let (x, y) = (x.try_normalize()?, y.try_normalize()?);
    (x.cross(y).length() > 0.1).then_some([x, y])
}

/// Returns the slope, unless it is 0, which some files say instead of nothing.
fn slope(set: &Set) -> Option<f64> {
    let slope = set.decimal(tags::SLOPE).or_else(|| set.decimal(tags::DOSE_SCALE));
    slope.filter(|&slope| slope != 0.0)
}

fn window(set: &Set) -> Option<[f64; 2]> {
    let (center, width) = (set.decimal(tags::WINDOW_CENTER)?, set.decimal(tags::WINDOW_WIDTH)?);
    (width > 0.0).then_some([center - 0.5 * width, center + 0.5 * width])
}

/// Returns the steps from column to column and from row to row.
fn spacing(set: &Set) -> Result<Option<[f64; 2]>> {
    let pair = |tag| {
        let pair = set.vector::<2>(tag)?;
        // The first is the step from row to row.
        pair.iter().all(|&step| step > 0.0).then_some([pair[1], pair[0]])
    };
    if let Some(steps) = pair(tags::PIXEL_SPACING).or_else(|| pair(tags::IMAGER_PIXEL_SPACING)) {
        return Ok(Some(steps));
    }
    if let Some(region) = set.item(tags::ULTRASOUND_REGIONS)? {
        const CENTIMETRES: u16 = 3;
        let delta = |tag| region.doubles(tag).first().map(|step| 10.0 * step.abs());
        let steps = delta(tags::REGION_DELTA_X).zip(delta(tags::REGION_DELTA_Y));
        let is_length = region.short(tags::REGION_UNIT_X) == Some(CENTIMETRES);
        if let Some((x, y)) = steps.filter(|&(x, y)| is_length && x > 0.0 && y > 0.0) {
            return Ok(Some([x, y]));
        }
    }
    Ok(None)
}

/// Adds what a group of functions says of a frame.
fn add_group(frame: &mut Frame, group: &Set) -> Result<()> {
    if let Some(item) = group.item(tags::PIXEL_MEASURES)? {
        frame.spacing = spacing(&item)?.or(frame.spacing);
        let step = |tag| item.decimal(tag).map(f64::abs).filter(|&step| step > 0.0);
        frame.step = step(tags::SPACING_BETWEEN_SLICES)
            .or_else(|| step(tags::SLICE_THICKNESS))
            .or(frame.step);
    }
    if let Some(item) = group.item(tags::PLANE_POSITIONS)? {
        frame.position = item.vector(tags::POSITION).map(DVec3::from).or(frame.position);
    }
    if let Some(item) = group.item(tags::PLANE_ORIENTATIONS)? {
        let axes = item.vector(tags::ORIENTATION).and_then(directions);
        frame.directions = axes.or(frame.directions);
    }
    if let Some(item) = group.item(tags::VALUE_TRANSFORMATIONS)? {
        frame.slope = slope(&item).unwrap_or(frame.slope);
        frame.intercept = item.decimal(tags::INTERCEPT).unwrap_or(frame.intercept);
    }
    if let Some(item) = group.item(tags::FRAME_WINDOWS)? {
        frame.window = window(&item).or(frame.window);
    }
    let mut set = |at: usize, number: Option<f64>| {
        if let Some(number) = number {
            frame.marks[at] = Mark::Number(number);
        }
    };
    if let Some(item) = group.item(tags::FRAME_CONTENTS)? {
        set(0, item.longs(tags::TEMPORAL_INDEX).first().map(|&index| index.into()));
    }
    if let Some(item) = group.item(tags::SEGMENT_IDENTIFICATIONS)? {
        set(1, item.short(tags::SEGMENT_NUMBER).map(Into::into));
    }
    if let Some(item) = group.item(tags::ECHOES)? {
        set(2, item.doubles(tags::EFFECTIVE_ECHO_TIME).first().copied());
    }
    if let Some(item) = group.item(tags::DIFFUSIONS)? {
        set(4, item.doubles(tags::DIFFUSION_B_VALUE).first().copied());
    }
    Ok(())
}

/// Places the frames of a file without groups of functions: along the third axis, or one after the
/// other in time.
fn classic(source: &Source, set: &Set, whole: &Frame, count: u32) -> Result<Vec<Frame>> {
    if count == 1 {
        return Ok(vec![whole.clone()]);
    }
    source.room::<Frame>("the frames", count as usize)?;
    let grid = set.decimals(tags::GRID_OFFSETS);
    let normal = whole.directions.map_or(DVec3::Z, |[x, y]| x.cross(y));
    let frame = |number: u32| Frame { number, order: number.into(), ..whole.clone() };
    if grid.len() == count as usize {
        let first = whole.position.unwrap_or(DVec3::ZERO);
        // Offsets count from the first slice, or are positions along z.
        let start = if grid[0] == 0.0 { 0.0 } else { first.dot(normal) };
        let at = |number: u32| first + normal * (grid[number as usize] - start);
        return Ok((0..count).map(|n| Frame { position: Some(at(n)), ..frame(n) }).collect());
    }
    if is_film(set) {
        let in_time = |number: u32| {
            let mut frame = frame(number);
            frame.marks[0] = Mark::Number(number.into());
            frame
        };
        return Ok((0..count).map(in_time).collect());
    }
    let step = whole.step.or(whole.spacing.map(|spacing| spacing[0])).unwrap_or_else(|| {
        warning::give!("{}: no step from frame to frame is given", source.path.display());
        1.0
    });
    let step = set.decimal(tags::SPACING_BETWEEN_SLICES).filter(|&s| s != 0.0).unwrap_or(step);
    let at = |n: u32| whole.position.map(|first| first + normal * (step * f64::from(n)));
    Ok((0..count).map(|n| Frame { position: at(n), step: Some(step.abs()), ..frame(n) }).collect())
}

/// Returns whether the frames of a file show one plane at several times.
fn is_film(set: &Set) -> bool {
    let pointer = set.shorts(tags::FRAME_INCREMENT);
    let tag = match pointer[..] {
        [group, number, ..] => u32::from(group) << 16 | u32::from(number),
        _ => 0,
    };
    let has_times = matches!(tag, tags::FRAME_TIME | tags::FRAME_TIMES)
        || set.decimal(tags::FRAME_TIME).is_some();
    let modality = set.text(tags::MODALITY).unwrap_or_default();
    let of_time = ["US", "XA", "RF", "ES", "XC", "IVUS"].contains(&modality.as_str());
    let is_tomography = set.words(tags::IMAGE_TYPE).iter().any(|word| word.contains("TOMO"));
    let has_depth = set.decimal(tags::SPACING_BETWEEN_SLICES).is_some_and(|step| step != 0.0);
    !has_depth && (has_times || of_time || modality == "NM" && !is_tomography)
}
