//! The fields of a scene, each with the data that is kept for it between pictures.

use super::{
    blend::{Blend, Way},
    brick_cache::{BrickCache, Grid, most_bricks},
    cells::CellField,
    field::Typed,
    gather::{self, Gather},
    items::Prepared,
    march::{DrawnField, Means},
    plan::{FieldOutline, Plan},
    visible::Visible,
};
use crate::{
    Result,
    bricks::{Bricks, Choice},
    hierarchy::Detail,
    math::{Bounds, Kernel, Pose, Sheets, Tensor, View},
    plan::{
        gathering,
        visible::{self, VisibleBlocks},
        weighting::{Weighting, deviation, weighting},
    },
    scene::{Item, Optics, Scene, Settings},
    volume::{
        Lattice, Volume, label_shares,
        reach::{EVERYTHING, first_visible},
    },
};
use std::{slice, sync::Arc};

/// A field of a scene.
#[derive(Debug)]
pub struct FieldState {
    /// The number of its item.
    pub number: usize,
    pub item: Item,
    /// Where the item's data are moved to, unless they are moved themselves.
    pub pose: Pose,
    /// The ranges of the field around the samples of a gathered lattice.
    ranges: Option<Vec<[u8; 2]>>,
    /// The kernel sums of a gathered lattice, if four weights an axis do not suffice.
    blend: Option<Blend>,
    /// The shares of each sample's own label around it, of a gathered label map.
    shares: Option<Vec<u8>>,
    /// The visible samples of a gathered lattice, and the transfer function's visibility table for
    /// which they were found.
    visible_samples: Option<([u16; 256], VisibleBlocks)>,
    /// The levels of a gathered volume in bricks, for the bricks of the last picture.
    levels: Option<(Choice, Vec<(Grid, VisibleBlocks)>)>,
    /// Whether parts of the file were missed when these levels were made.
    is_partial: bool,
}

impl FieldState {
    /// Returns the fields of a scene.
    pub fn all(scene: &Scene) -> Vec<Self> {
        scene.fields().into_iter().map(|number| Self::new(scene, number)).collect()
    }

    /// Returns the field of an item.
    pub fn new(scene: &Scene, number: usize) -> Self {
        Self {
            number,
            item: scene.items[number].clone(),
            pose: scene.view_pose(number),
            ranges: None,
            blend: None,
            shares: None,
            visible_samples: None,
            levels: None,
            is_partial: false,
        }
    }

    /// Takes the item as it is in the scene, and its pose.
    pub fn update(&mut self, item: &Item, pose: Pose) {
        if let (Item::Volume(last, ..), Item::Volume(volume, ..)) = (&self.item, item)
            && !Arc::ptr_eq(last, volume)
        {
            // Its sums are on a lattice of the last pose.
            self.blend = None;
        }
        (self.item, self.pose) = (item.clone(), pose);
    }

    /// Returns the bytes of memory held for drawing.
    pub fn bytes(&self) -> u64 {
        let samples = self.visible_samples.as_ref().map_or(0, |(_, samples)| samples.bytes());
        let ranges = self.ranges.as_ref().map_or(0, |ranges| size_of_val(ranges.as_slice()) as u64);
        samples + ranges + self.shares.as_ref().map_or(0, |shares| shares.len() as u64)
    }

    /// Returns the bricks that a view of the scene needs, if the field is a volume in bricks.
    /// `bounds` are those of the whole scene.
    pub fn choice(
        &self,
        scene: &Scene,
        view: &View,
        settings: &Settings,
        detail: Detail,
        bounds: &Bounds,
    ) -> Option<Choice> {
        let Item::Bricks(bricks, ..) = &self.item else { return None };
        let most = most_bricks(bricks, settings);
        scene.with_one_field(self.number).choice(view, settings, detail, most, bounds)
    }

    /// Returns what a picture draws of the field.
    ///
    /// # Errors
    /// [`Error::Argument`] if the field can't be drawn by the method of the settings.
    pub fn outline(
        &self,
        settings: &Settings,
        sheets: &Sheets,
        choice: Option<Choice>,
    ) -> Result<FieldOutline> {
        let mut visible_ranges = EVERYTHING;
        if let Item::Volume(volume, _, transfer) = &self.item
            && !self.item.mixes_afar(settings, sheets, choice.as_ref())
        {
            visible_ranges = first_visible(transfer, volume.range);
        }
        let gathers = self.gathers(settings, sheets, choice.as_ref())?;
        Ok(FieldOutline { choice, visible_ranges, gathers })
    }

    /// Whether the field is gathered.
    fn gathers(
        &self,
        settings: &Settings,
        sheets: &Sheets,
        choice: Option<&Choice>,
    ) -> Result<bool> {
        let items = slice::from_ref(&self.item);
        let parts = gathering::parts(items, sheets, choice);
        gathering::is_chosen(items, settings, || {
            gathering::obstacle(items, settings, parts, gather::unsuited)
        })
    }

    /// Finds what is visible of a gathered field. `prepared` is that of its item.
    pub fn prepare_gather(&mut self, plan: &Plan, outline: &FieldOutline, prepared: &Prepared) {
        match (&self.item, prepared, &outline.choice) {
            (Item::Volume(volume, kernel, transfer), ..) => {
                let first = match plan.optics {
                    Optics::Maximum => EVERYTHING,
                    _ => first_visible(transfer, volume.range),
                };
                if let (None, Ok(Way::Blend(taps))) = (&self.blend, Way::of(volume, kernel)) {
                    self.blend = Some(Blend::new(volume, kernel, taps));
                }
                if volume.is_label_map() {
                    self.shares.get_or_insert_with(|| label_shares(volume));
                }
                let ranges = self.ranges.get_or_insert_with(|| match &self.blend {
                    Some(blend) => blend.ranges(volume, kernel),
                    None => visible::field_ranges(volume, kernel),
                });
                let dims = self.blend.as_ref().map_or(volume.drawn_lattice(), Blend::cells).dims;
                self.visible_samples.take_if(|(held, _)| *held != first);
                self.visible_samples
                    .get_or_insert_with(|| (first, VisibleBlocks::new(dims, ranges, &first)));
            }
            (Item::Bricks(..), Prepared::Bricks(cache), Some(choice))
                if self.is_partial
                    || self.levels.as_ref().is_none_or(|(held, _)| held != choice) =>
            {
                let level = |(level, _): &(usize, f64)| {
                    (
                        Grid::new(cache, choice, *level),
                        VisibleBlocks::of_bricks(cache, choice, *level),
                    )
                };
                self.levels = Some((choice.clone(), choice.levels.iter().map(level).collect()));
                self.is_partial = cache.bricks.lacks();
            }
            _ => {}
        }
    }

    /// Returns the field as all tiles of a picture need it.
    pub fn drawn<'a>(
        &'a self,
        plan: &'a Plan<'a>,
        sheets: &Sheets,
        outline: &FieldOutline,
        prepared: &'a Prepared,
        visible: &'a Visible,
    ) -> DrawnField<'a> {
        let (mut means, mut marks) = (Means::Nothing, Vec::new());
        if let Item::Cells(cells, _) = &self.item {
            means = Means::Cells(CellField::new(plan, &self.pose.view(plan.view), cells, visible));
        } else if !outline.gathers {
            means = if plan.has_field { Means::Scattered } else { Means::Nothing };
        } else if let Some(gather) = self.gather(plan, sheets, outline, prepared, visible) {
            marks = self.marks(plan, sheets, outline, &gather);
            means = Means::Gathered(gather);
        }
        DrawnField { plan, means, visible, marks }
    }

    /// Returns the gathered field, or `None` if none of its bricks is visible.
    fn gather<'a>(
        &'a self,
        plan: &'a Plan<'a>,
        sheets: &Sheets,
        outline: &FieldOutline,
        prepared: &'a Prepared,
        visible: &'a Visible,
    ) -> Option<Gather<'a>> {
        let zero = plan.tables.values.zero;
        let levels = match (&self.item, prepared) {
            (Item::Volume(volume, kernel, _), _) => vec![self.whole_level(volume, kernel, zero)?],
            (Item::Bricks(bricks, kernel, _), Prepared::Bricks(cache))
                if !cache.samples().is_empty() =>
            {
                self.levels_of_bricks(bricks, cache, weighting(kernel)?, zero)?
            }
            _ => return None,
        };
        let [finest, _] = levels.first()?.cells;
        let steps = (0..3).map(|axis| {
            let [x, y, z] = plan.field.axes[axis];
            f64::from(x * x + y * y + z * z).sqrt() * f64::from(finest[axis])
        });
        let steps = steps.fold(0.0, f64::max) * sheets.step;
        let parts = (steps / visible::MOST_APART).ceil() as usize;
        let lookups = if parts <= 1 { 0 } else { parts };
        let parts = gathering::parts(slice::from_ref(&self.item), sheets, outline.choice.as_ref());
        let deviation = self.item.kernel().and_then(deviation);
        let ends = deviation.map(|deviation| (1.0 / deviation) as f32);
        let (is_blended, zero) = (self.blend.is_some(), zero as f32);
        let is_label_map = self.item.is_label_map();
        let kernel = self.item.kernel().and_then(Kernel::as_tensor);
        let has_far_gradient = kernel == Some(Tensor::Linear);
        Some(Gather {
            plan,
            levels,
            parts,
            ends,
            lookups,
            is_blended,
            is_label_map,
            has_far_gradient,
            visible,
            zero,
        })
    }

    /// Returns a volume in memory as the only level. Values are relative to `zero`.
    fn whole_level<'a>(
        &'a self,
        volume: &'a Volume,
        kernel: &Kernel,
        zero: f64,
    ) -> Option<gather::Level<'a>> {
        let (_, visible_samples) = self.visible_samples.as_ref()?;
        let field = match (&self.blend, Way::of(volume, kernel)) {
            (Some(blend), _) => Typed::blended(volume, blend, zero),
            (None, Ok(Way::Plain(Weighting::Labels))) => {
                Typed::labels(volume, self.shares.as_ref()?, zero)
            }
            (None, Ok(Way::Plain(weighting))) => Typed::new(volume, weighting, zero),
            (None, _) => return None,
        };
        // Coefficients begin before the samples.
        let drawn = volume.drawn_lattice();
        let before = volume.lattice.axes.inverse() * (volume.lattice.origin - drawn.origin);
        let shift = before.as_vec3().to_array();
        let to_cells = |blend: &Blend| blend.to_cells(shift);
        Some(gather::Level {
            field,
            dims: drawn.dims,
            grid: None,
            visible_samples,
            share: 1.0,
            scale: [1.0; 3],
            shift,
            cells: self.blend.as_ref().map_or([[1.0; 3], shift], to_cells),
        })
    }

    /// Returns the levels of a volume in bricks, the finer first.
    fn levels_of_bricks<'a>(
        &'a self,
        bricks: &Bricks,
        cache: &'a BrickCache,
        weighting: Weighting,
        zero: f64,
    ) -> Option<Vec<gather::Level<'a>>> {
        let (choice, grids) = self.levels.as_ref()?;
        let fine = &bricks.header().lattice;
        let level = |((level, share), (grid, visible_samples)): (
            &(usize, f64),
            &'a (Grid, VisibleBlocks),
        )| {
            let (lattice, dims) = (bricks.lattice(*level), bricks.level(*level).dims);
            let to_level = lattice.axes.inverse();
            let scale = (to_level * fine.axes).to_cols_array_2d();
            let shift = (to_level * (fine.origin - lattice.origin)).as_vec3().to_array();
            let scale = [0, 1, 2].map(|axis| scale[axis][axis] as f32);
            gather::Level {
                field: Typed::of_bricks(cache.samples(), dims, grid, weighting, zero),
                dims,
                grid: Some(grid),
                visible_samples,
                share: *share as f32,
                scale,
                shift,
                cells: [scale, shift],
            }
        };
        Some(choice.levels.iter().zip(grids).map(level).collect())
    }

    /// Returns the lattices of the gathered levels.
    fn lattices(&self, outline: &FieldOutline) -> Vec<Lattice> {
        match (&self.item, &outline.choice) {
            (Item::Volume(volume, ..), _) => {
                vec![self.blend.as_ref().map_or(volume.drawn_lattice(), Blend::cells).clone()]
            }
            (Item::Bricks(bricks, ..), Some(choice)) => {
                choice.levels.iter().map(|(level, _)| bricks.lattice(*level)).collect()
            }
            _ => Vec::new(),
        }
    }

    /// Returns a bit for each sheet of each tile in which the gathered field may be visible.
    fn marks(
        &self,
        plan: &Plan,
        sheets: &Sheets,
        outline: &FieldOutline,
        gather: &Gather,
    ) -> Vec<Vec<u64>> {
        let mut marks: Vec<Vec<u64>> = Vec::new();
        for (level, lattice) in gather.levels.iter().zip(self.lattices(outline)) {
            let level_marks = level.visible_samples.sheets_of_tiles(&lattice, plan.view, sheets);
            if marks.is_empty() {
                marks = level_marks;
                continue;
            }
            for (tile, other) in marks.iter_mut().zip(level_marks) {
                tile.iter_mut().zip(other).for_each(|(a, b)| *a |= b);
            }
        }
        marks
    }
}
