//! Segmentations as label maps: frames say where each segment lies, and the labels are the numbers
//! of the segments.

use super::{
    file::File,
    frames::{Frame, Mark},
    head::Head,
    name,
    pixels::Decoder,
    segmentation::Kind,
};
use crate::{
    Result,
    formats::{
        ReadOptions,
        shared::{anatomy::Anatomy, holes},
    },
    input::Source,
    volume::{Lattice, Samples, Volume},
    warning,
};
use glam::{DMat3, DVec3};

/// Frames whose distance from a slice is below this part of a step lie on it.
const EVEN: f64 = 0.1;

/// Most slices, from the first to the last frame.
const MOST_SLICES: f64 = 65_536.0;

/// A frame: the number of its file, where it lies along the normal, and its segment.
struct Place<'a> {
    file: usize,
    frame: &'a Frame,
    depth: f64,
    segment: u16,
}

/// The slices of a segmentation: those that frames lie on, and those without a segment between.
struct Slices {
    lattice: Lattice,
    first: f64,
    step: f64,
}

/// Reads a segmentation as a label map. Where segments overlap, the later one counts.
pub fn read(source: &Source, heads: &[Head], options: &ReadOptions) -> Result<Volume> {
    let places = places(heads);
    let slices = slices(source, heads, &places)?;
    let [columns, rows, _] = slices.lattice.dims;
    let size = columns * rows;
    let bytes = (slices.lattice.len() as u64).saturating_mul(2);
    source.check_bytes("the size of the labels in bytes", bytes)?;
    source.spend("the size of the labels in bytes", bytes)?;
    let mut labels = vec![0u16; slices.lattice.len()];
    let mut overlaps = 0;
    for (file, head) in heads.iter().enumerate() {
        let Some(segmentation) = &head.segmentation else { continue };
        let beside;
        let opened = if head.path == source.path {
            source
        } else {
            beside = source.open_beside(&head.path)?;
            &beside
        };
        let data = File::open(opened)?;
        let decoder = Decoder::new(&data, head.layout)?;
        for place in places.iter().filter(|place| place.file == file) {
            opened.check_time()?;
            let decoded = opened.unless_changed(decoder.frame(place.frame.number))?.samples;
            if decoded.len() != size {
                let message = format!("{} pixels where {size} were expected", decoded.len());
                return Err(opened.error("pixel data", message));
            }
            let slice = ((place.depth - slices.first) / slices.step).round() as usize;
            let to = &mut labels[slice * size..][..size];
            for (i, label) in to.iter_mut().enumerate() {
                let value = decoded.value(i);
                let segment = match segmentation.kind {
                    Kind::Labels => value as u16,
                    Kind::Mask(least) => place.segment * u16::from(value >= least),
                };
                if segment != 0 {
                    overlaps += u64::from(*label != 0 && *label != segment);
                    *label = segment;
                }
            }
        }
    }
    if overlaps > 0 {
        let path = source.path.display();
        warning::give!(
            "{path}: segments overlap in {overlaps} voxels, which belong to the later one"
        );
    }
    let mut volume = holes::volume(source, slices.lattice, Samples::U16(labels), options)?;
    volume.about.length = "mm".into();
    Anatomy::LPS.place(&mut volume);
    let tables = heads.iter().filter_map(|head| head.segmentation.as_ref());
    Ok(volume.with_labels(tables.flat_map(|segmentation| segmentation.table.clone()).collect()))
}

/// Returns where the frames lie. Those without positions follow each other within a segment.
fn places(heads: &[Head]) -> Vec<Place<'_>> {
    let mut places: Vec<Place<'_>> = Vec::new();
    let normal = heads.iter().find_map(|head| head.frames.first()).map_or(DVec3::Z, Frame::normal);
    // Successive frames of one segment.
    let mut run = (0, -1);
    for (file, head) in heads.iter().enumerate() {
        for frame in &head.frames {
            // The segment is the second mark of a frame.
            let segment = if let Mark::Number(number) = frame.marks[1] { number as u16 } else { 1 };
            run = if run.0 == segment { (segment, run.1 + 1) } else { (segment, 0) };
            let in_order = || frame.step.unwrap_or(1.0) * f64::from(run.1);
            let depth = frame.position.map_or_else(in_order, |position| position.dot(normal));
            places.push(Place { file, frame, depth, segment });
        }
    }
    places
}

/// Finds the slices on which the frames of a segmentation lie.
fn slices(source: &Source, heads: &[Head], places: &[Place]) -> Result<Slices> {
    let first = &heads[0];
    let lowest = places.iter().min_by(|a, b| a.depth.total_cmp(&b.depth));
    let lowest = lowest.ok_or_else(|| source.error("segmentation", "has no frames"))?;
    let size = [first.layout.columns, first.layout.rows];
    let is_alike = |place: &Place| {
        let layout = heads[place.file].layout;
        [layout.columns, layout.rows] == size && lowest.frame.is_parallel(place.frame)
    };
    if let Some(other) = places.iter().find(|place| !is_alike(place)) {
        let name = name(&heads[other.file].path);
        let message = format!("frames of several sizes or directions ({name}) are not joined");
        let hint = "resample the segmentation onto one grid, for example in 3D Slicer";
        return Err(source.error("segmentation", message).hint(hint));
    }
    let mut depths: Vec<f64> = places.iter().map(|place| place.depth).collect();
    depths.sort_by(f64::total_cmp);
    let gaps = depths.windows(2).map(|pair| pair[1] - pair[0]).filter(|&gap| gap > 1e-3);
    let least = gaps.fold(f64::INFINITY, f64::min);
    let length = depths[depths.len() - 1] - depths[0];
    let is_even = |&step: &f64| {
        let off = |depth: &f64| (depth - depths[0]) / step - ((depth - depths[0]) / step).round();
        step > 0.0 && depths.iter().all(|depth| off(depth).abs() < EVEN)
    };
    // Segments may miss every second slice, so the file's own step comes first.
    let steps = [lowest.frame.step.unwrap_or(0.0), least];
    let step = if length > 0.0 {
        steps.into_iter().find(is_even).ok_or_else(|| {
            let message = format!("the distances between its frames are not multiples of {least}");
            let hint = "resample the segmentation onto one grid, for example in 3D Slicer";
            source.error("segmentation", message).hint(hint)
        })?
    } else {
        lowest.frame.step.unwrap_or(1.0)
    };
    let count = (length / step).round() + 1.0;
    if !(1.0..=MOST_SLICES).contains(&count) {
        let message = format!("its frames lie on {count} slices, but at most 65536 are read");
        return Err(source.error("segmentation", message));
    }
    let [dx, dy] = lowest.frame.spacing.unwrap_or([1.0; 2]);
    let [x, y] = lowest.frame.axes();
    let axes = DMat3::from_cols(x * dx, y * dy, lowest.frame.normal() * step);
    let dims = [size[0], size[1], count as usize];
    let lattice = Lattice::cartesian(dims, lowest.frame.position.unwrap_or(DVec3::ZERO), axes);
    lattice.check().map_err(|message| source.error("positions", message))?;
    Ok(Slices { lattice, first: depths[0], step })
}
