//! The splats of a scene's items: which ones a view needs, and their records.

use super::{
    bins::BATCH,
    brick_cache::{BESIDE, BrickCache, SLOT, SLOT_SIDE},
    footprint::{Candidate, Carried, Record, counted, record, widened},
    page_cache::PageCache,
    plan::{FieldOutline, Outline, Plan},
    project::Projector,
    project_facets::FacetProjector,
    spare::{Spare, spare_for},
    vector::lanes,
};
use crate::{
    Error, Result,
    bricks::{BLOCK, BLOCKS, Choice, SIDE},
    cells::Solid,
    facet::FacetSet,
    gaussians::{Eye, Gaussians},
    hierarchy::{Cut, Levels},
    math::{Kernel, Pose, View},
    parallel::prelude::*,
    plan::{source::Source, tables::Values},
    scene::{Item, Settings},
    splat::{Common, Splat, Splats, TrainedSplats},
    volume::{Arrangement, Lattice, SampleSlice, Samples, Volume, reach::EVERYTHING},
};
use fearless_simd::Level;
use glam::{Mat3, Vec3};
use std::sync::Arc;

/// Samples along each side of a block. A block's samples are listed together, so that neighbours in
/// the list are neighbours in space.
const LIST_BLOCK: usize = 4;

/// The data of an item that is kept between pictures.
#[derive(Debug)]
pub enum Prepared {
    /// A set of splats: its levels of detail, and the set that replaces it in the last view.
    Set {
        levels: Option<Box<Levels>>,
        drawn: Splats,
    },
    Facets(Arc<FacetSet>),
    /// A solid, and what the clips of the last picture left of it.
    Solid {
        solid: Arc<Solid>,
        /// Where it is moved to.
        pose: Pose,
        drawn: Arc<FacetSet>,
    },
    /// Trained Gaussians, and the splats that the eye of the last view saw.
    Gaussians {
        set: Arc<Gaussians>,
        seen: Option<(Eye, TrainedSplats)>,
    },
    Hierarchy(Box<PageCache>),
    /// A volume. If it is scattered, also the extremes around each sample, and the list of visible
    /// samples for a transfer function.
    Volume {
        volume: Arc<Volume>,
        kernel: Kernel,
        ranges: Option<Vec<[u8; 2]>>,
        listed: Option<(Box<[u16; 256]>, Vec<u32>)>,
    },
    Bricks(Box<BrickCache>),
    /// Cells: all that a picture needs of them is made for it.
    Cells,
}

impl Prepared {
    pub fn new(item: &Item) -> Self {
        let set = |drawn: Splats| Self::Set { levels: Levels::new(&drawn).map(Box::new), drawn };
        match item {
            Item::Radiance(splats) => set(Splats::Surfels(splats.clone())),
            Item::Scalar(splats, _) => set(Splats::Samples(splats.clone())),
            Item::Facets(set) => Self::Facets(set.clone()),
            Item::Solid(solid) => {
                let (pose, drawn) = (Pose::IDENTITY, solid.boundary().clone());
                Self::Solid { solid: solid.clone(), pose, drawn }
            }
            Item::Gaussians(set) => Self::Gaussians { set: set.clone(), seen: None },
            Item::Hierarchy(hierarchy) => Self::Hierarchy(Box::new(PageCache::new(hierarchy))),
            Item::Volume(volume, kernel, _) => Self::Volume {
                volume: volume.clone(),
                kernel: kernel.clone(),
                ranges: None,
                listed: None,
            },
            Item::Bricks(bricks, kernel, _) => {
                Self::Bricks(Box::new(BrickCache::new(bricks, kernel)))
            }
            Item::Cells(..) => Self::Cells,
        }
    }

    /// Takes the item's pose, and the lattice of a volume.
    pub fn update(&mut self, item: &Item, moved: Pose) {
        match (self, item) {
            (Self::Hierarchy(pages), _) => pages.pose = moved,
            (Self::Solid { pose, .. }, _) => *pose = moved,
            (Self::Volume { volume, .. }, Item::Volume(moved, ..)) => *volume = moved.clone(),
            _ => {}
        }
    }

    /// Updates the levels of detail of a set for a view; `pixels` is as in
    /// [`crate::hierarchy::Detail::Pixels`].
    pub fn update_levels(&mut self, view: &View, pixels: f64) -> Result<()> {
        if let Self::Set { levels: Some(levels), drawn } = self {
            *drawn = levels.drawn(&Cut::new(view, levels.origin(), pixels, false))?;
        }
        Ok(())
    }

    /// Returns the bytes of memory held for drawing, besides the scene's own.
    pub fn bytes(&self) -> u64 {
        match self {
            Self::Set { .. } | Self::Facets(_) | Self::Solid { .. } | Self::Cells => 0,
            Self::Gaussians { seen, .. } => {
                seen.as_ref().map_or(0, |(_, seen)| size_of_val(&seen.splats[..]) as u64)
            }
            Self::Hierarchy(pages) => pages.bytes(),
            Self::Volume { ranges, listed, .. } => {
                let ranges = ranges.as_ref().map_or(0, |ranges| 2 * ranges.len() as u64);
                ranges + 4 * listed.as_ref().map_or(0, |(_, list)| list.len() as u64)
            }
            Self::Bricks(bricks) => bricks.bytes(),
        }
    }

    /// Returns the records of all splats that meet the picture, in batches of [`BATCH`] candidates.
    /// `view` is the plan's as it is from the item's data, and `field` is what the picture draws of
    /// the item's field, if it has one.
    pub fn records(
        &mut self,
        (plan, view): (&Plan, &View),
        settings: &Settings,
        outline: &Outline,
        field: Option<&FieldOutline>,
        spare: &mut Spare,
    ) -> Result<Vec<Vec<Record>>> {
        let cut_pixels = &outline.cut_pixels;
        let choice = field.and_then(|field| field.choice.as_ref());
        let visible = field.map_or(&EVERYTHING, |field| &field.visible_ranges);
        match self {
            Self::Set { drawn: Splats::Surfels(set), .. } => {
                Ok(radiance((plan, view), &set.common(), &set.splats, spare))
            }
            Self::Gaussians { set, seen } => {
                let eye = Eye::of(view);
                match seen {
                    Some((last, _)) if *last == eye || !set.depends_on_eye() => {}
                    Some((last, splats)) => {
                        *last = eye;
                        set.recolor(eye, &mut splats.splats);
                    }
                    None => *seen = Some((eye, set.seen_from(eye))),
                }
                Ok(seen.as_ref().map_or_else(Vec::new, |(_, seen)| {
                    radiance((plan, view), &seen.common(), &seen.splats, spare)
                }))
            }
            Self::Set { drawn: Splats::Samples(set), .. } => {
                let source = Source::of_splats(view, &set.common());
                let to_record =
                    |splat: &Splat| record(plan, &source, &widened(plan, &source, splat));
                Ok(batches(&set.splats, spare, |_, batch, records| {
                    records.extend(batch.iter().filter_map(to_record));
                }))
            }
            Self::Facets(set) => Ok(facets((plan, view), set, settings, spare)),
            Self::Solid { solid, pose, drawn } => {
                *drawn = solid.facets(&pose.clips(&settings.clips)?);
                Ok(facets((plan, view), drawn, settings, spare))
            }
            Self::Hierarchy(pages) => {
                pages.update(plan.view, settings, *cut_pixels)?;
                Ok(pages.records(plan, settings, *cut_pixels, spare))
            }
            Self::Volume { volume, kernel, ranges, listed } => {
                let ranges = ranges.get_or_insert_with(|| volume.drawn_ranges(kernel).into_owned());
                if listed.as_ref().is_none_or(|(held, _)| **held != *visible) {
                    *listed = Some((
                        Box::new(*visible),
                        list(volume.drawn_lattice().dims, ranges, visible),
                    ));
                }
                let Some((_, list)) = listed else { return Ok(Vec::new()) };
                let lattice = LatticeSource::new(plan, volume, kernel);
                let to_record = |index: &u32| lattice.record(plan, *index as usize);
                Ok(batches(list, spare, |_, batch, records| {
                    records.extend(batch.iter().filter_map(to_record));
                }))
            }
            Self::Cells => Ok(Vec::new()),
            Self::Bricks(cache) => {
                let records = |choice| brick_records(plan, cache, choice);
                Ok(choice.map_or_else(Vec::new, records))
            }
        }
    }
}

/// Returns the records of splats that carry their own colour.
fn radiance(
    (plan, view): (&Plan, &View),
    set: &Common,
    splats: &[Splat],
    spare: &mut Spare,
) -> Vec<Vec<Record>> {
    let projector = Projector::new(plan, Source::of_splats(view, set));
    batches(splats, spare, |_, batch: &[Splat], records| {
        lanes!(Level::new(), simd => projector.add(
            simd,
            batch.iter().map(|splat| (splat, 1.0)),
            records,
        ));
    })
}

/// Returns the records of facets.
fn facets(
    (plan, view): (&Plan, &View),
    set: &Arc<FacetSet>,
    settings: &Settings,
    spare: &mut Spare,
) -> Vec<Vec<Record>> {
    let projector = FacetProjector::new(plan, view, set, settings);
    batches(&set.facets, spare, |first, batch, records| {
        lanes!(Level::new(), simd => projector.add(simd, first, batch, records));
    })
}

/// Returns the records of candidates; `add` appends those of a batch, which begins with a number.
fn batches<T: Sync>(
    candidates: &[T],
    spare: &mut Spare,
    add: impl Fn(usize, &[T], &mut Vec<Record>) + Sync,
) -> Vec<Vec<Record>> {
    let mut records = spare_for(spare, candidates.len().div_ceil(BATCH));
    records
        .par_iter_mut()
        .zip(candidates.par_chunks(BATCH))
        .enumerate()
        .for_each(|(number, (records, batch))| add(number * BATCH, batch, records));
    records
}

/// Returns the visible samples, block by block.
fn list(dims: [usize; 3], ranges: &[[u8; 2]], visible: &[u16; 256]) -> Vec<u32> {
    let shows = |[low, high]: [u8; 2]| u16::from(high) >= visible[usize::from(low)];
    let layer = |layer: usize| {
        let mut list = Vec::new();
        let along = |block: usize, axis: usize| {
            block * LIST_BLOCK..((block + 1) * LIST_BLOCK).min(dims[axis])
        };
        for row in 0..dims[1].div_ceil(LIST_BLOCK) {
            for column in 0..dims[0].div_ceil(LIST_BLOCK) {
                for z in along(layer, 2) {
                    for y in along(row, 1) {
                        let start = (z * dims[1] + y) * dims[0];
                        let indices = along(column, 0).map(|x| start + x);
                        list.extend(
                            indices.filter(|index| shows(ranges[*index])).map(|index| index as u32),
                        );
                    }
                }
            }
        }
        list
    };
    let layers: Vec<Vec<u32>> =
        (0..dims[2].div_ceil(LIST_BLOCK)).into_par_iter().map(layer).collect();
    layers.concat()
}

/// A lattice in view space.
struct LatticeSource<'a> {
    volume: &'a Volume,
    lattice: &'a Lattice,
    source: Source,
    /// The map from steps of the lattice to gradients in view space.
    field_axes: Mat3,
}

impl<'a> LatticeSource<'a> {
    fn new(plan: &Plan, volume: &'a Volume, kernel: &Kernel) -> Self {
        let lattice = volume.drawn_lattice();
        let source = Source::of_lattice(plan.view, lattice, kernel);
        Self { volume, lattice, field_axes: Mat3::from_cols_array_2d(&plan.field.axes), source }
    }

    fn value(&self, plan: &Plan, index: usize) -> f32 {
        match &self.volume.coefficients {
            Some(_) => counted(plan, self.volume.drawn_value(index) as f32),
            None => sample(plan, &self.volume.samples, index),
        }
    }

    fn record(&self, plan: &Plan, number: usize) -> Option<Record> {
        let [nx, ny, _] = self.lattice.dims;
        let index = [number % nx, number / nx % ny, number / (nx * ny)];
        let mut steps = Vec3::from_array(index.map(|n| n as f32));
        let mut covariance = self.source.covariance;
        match &self.lattice.arrangement {
            Arrangement::Cartesian => {}
            Arrangement::BodyCentred => {
                let displaced = 0.5 * (index[2] % 2) as f32;
                steps = Vec3::new(steps.x + displaced, steps.y + displaced, 0.5 * steps.z);
            }
            Arrangement::Rectilinear(coordinates) => {
                steps = Vec3::from_array(std::array::from_fn(|axis| {
                    (coordinates[axis][index[axis]] - coordinates[axis][0]) as f32
                }));
                let unit = self.lattice.unit(index).as_vec3() * self.source.unit;
                let axes = self.source.to_view * Mat3::from_diagonal(unit);
                covariance = axes * axes.transpose();
            }
        }
        let value = self.value(plan, number);
        let mut gradient = Vec3::ZERO;
        if plan.has_slopes || (plan.is_classified && plan.lit_surfaces) {
            let slopes: [f32; 3] = std::array::from_fn(|axis| self.slope(plan, axis, index, value));
            gradient = self.field_axes * Vec3::from_array(slopes);
        }
        let candidate = Candidate {
            center: self.source.origin + self.source.to_view * steps,
            covariance,
            extent: self.source.extent,
            rim: self.source.extent,
            strength: value,
            carried: Carried::Scalar { weight: 1.0, gradient },
        };
        record(plan, &self.source, &candidate)
    }

    /// Returns the derivative along an axis, per step or per coordinate: central if there are
    /// neighbours on both sides.
    fn slope(&self, plan: &Plan, axis: usize, index: [usize; 3], value: f32) -> f32 {
        let dims = self.lattice.dims;
        // Layers of the same cubic lattice of a body-centred lattice lie two apart.
        let stride =
            if axis == 2 && self.lattice.arrangement == Arrangement::BodyCentred { 2 } else { 1 };
        let place = |at: usize| match &self.lattice.arrangement {
            Arrangement::Rectilinear(coordinates) => {
                (coordinates[axis][at] - coordinates[axis][0]) as f32
            }
            _ => at as f32 / stride as f32,
        };
        let beside = |at: usize| {
            let mut other = index;
            other[axis] = at;
            let sample = (other[2] * dims[1] + other[1]) * dims[0] + other[0];
            (self.value(plan, sample), place(at))
        };
        let here = place(index[axis]);
        let before = index[axis].checked_sub(stride).map(|at| {
            let (other, there) = beside(at);
            ((value - other) / (here - there).max(1e-30), here - there)
        });
        let after = (index[axis] + stride < dims[axis]).then(|| {
            let (other, there) = beside(index[axis] + stride);
            ((other - value) / (there - here).max(1e-30), there - here)
        });
        match (before, after) {
            (Some((before, to_before)), Some((after, to_after))) => {
                (after * to_before + before * to_after) / (to_before + to_after)
            }
            (Some((slope, _)), None) | (None, Some((slope, _))) => slope,
            (None, None) => 0.0,
        }
    }
}

/// Returns the records of the samples in bricks.
fn brick_records(plan: &Plan, cache: &BrickCache, choice: &Choice) -> Vec<Vec<Record>> {
    let sources: Vec<Source> = choice
        .levels
        .iter()
        .map(|(level, _)| {
            Source::of_lattice(plan.view, &cache.bricks.lattice(*level), &cache.kernel)
        })
        .collect();
    // A batch is a quarter of a brick.
    const QUARTER: usize = BATCH / (SIDE * SIDE);
    let mut bricks = choice.bricks.clone();
    bricks.sort_unstable();
    let batches: Vec<(usize, u32, usize)> = bricks
        .iter()
        .flat_map(|&(level, brick)| (0..SIDE / QUARTER).map(move |quarter| (level, brick, quarter)))
        .collect();
    let place_in_slot =
        |[x, y, z]: [usize; 3]| ((z + BESIDE) * SLOT_SIDE + y + BESIDE) * SLOT_SIDE + x + BESIDE;
    let batch = |&(level, brick, quarter): &(usize, u32, usize)| {
        let Some(part) = choice.levels.iter().position(|(other, _)| *other == level) else {
            return Vec::new();
        };
        let Some(slot) = cache.slot(level, brick) else { return Vec::new() };
        let blocks = cache.blocks(slot);
        let (source, weight) = (&sources[part], choice.levels[part].1 as f32);
        let &Source { to_view, origin, covariance, .. } = source;
        let dims = cache.bricks.level(level).dims;
        let first = cache.bricks.level(level).place(brick).map(|at| at * SIDE);
        let mut records = Vec::new();
        for z in quarter * QUARTER..(quarter + 1) * QUARTER {
            for y in 0..SIDE {
                for x in 0..SIDE {
                    let within = [x, y, z];
                    let block = within.map(|at| at / BLOCK);
                    let [low, high] = blocks[(block[2] * BLOCKS + block[1]) * BLOCKS + block[0]];
                    let is_inside = (0..3).all(|axis| first[axis] + within[axis] < dims[axis]);
                    if u16::from(high) < choice.first_visible[usize::from(low)] || !is_inside {
                        continue;
                    }
                    let steps = Vec3::from_array(std::array::from_fn(|axis| {
                        (first[axis] + within[axis]) as f32
                    }));
                    let candidate = Candidate {
                        center: origin + to_view * steps,
                        covariance,
                        extent: source.extent,
                        rim: source.extent,
                        strength: sample(
                            plan,
                            cache.samples(),
                            slot * SLOT + place_in_slot(within),
                        ),
                        carried: Carried::Scalar { weight, gradient: Vec3::ZERO },
                    };
                    records.extend(record(plan, source, &candidate));
                }
            }
        }
        records
    };
    batches.par_iter().map(batch).collect()
}

/// Returns a sample in entries of the transfer function's table.
fn sample(plan: &Plan, samples: &Samples, index: usize) -> f32 {
    match samples.as_slice() {
        // A 32-bit float cannot hold the whole integer.
        SampleSlice::I32(values) => {
            let low = values[index] & 0xffff;
            let Values { zero, per_value, .. } = plan.field.values;
            ((((values[index] - low) as f32 - zero) + low as f32) * per_value).clamp(-1e30, 1e30)
        }
        _ => counted(plan, samples.value(index) as f32),
    }
}

/// Returns an error if there are more records than record numbers.
pub fn check_count(records: &[Vec<Record>]) -> Result<()> {
    if records.len() <= u32::MAX as usize / BATCH {
        return Ok(());
    }
    Err(Error::Argument(
        "the picture needs more than 4,294,967,295 splats; choose a coarser cut".into(),
    ))
}
