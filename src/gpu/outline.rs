//! The plan of a frame, made before anything is drawn: what it shows, in which detail, on which
//! sheets, in which strips.

use crate::{
    Result,
    bricks::{Choice, slot_bytes},
    gpu::{
        device::Gpu,
        frame::Passes,
        scene::{
            PreparedScene,
            bricks::{Listed, Room, SLOT_SAMPLES},
            chunk::{RUN, list_bytes},
            field,
        },
        targets,
    },
    hierarchy::Detail,
    math::{Sheets, View},
    plan::gathering,
    scene::Settings,
};

/// The plan of a frame.
#[derive(Debug)]
pub struct Outline {
    /// The cut of hierarchies, in pixels.
    pub cut_pixels: f64,
    /// The bricks of a volume.
    pub choice: Option<Choice>,
    /// The number of these bricks that were read for the picture.
    pub read_bricks: u64,
    pub sheets: Sheets,
    /// Whether the field is gathered.
    pub gather: bool,
}

/// A picture to plan.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    pub view: &'a View,
    pub settings: &'a Settings,
    /// The detail of levels and bricks.
    pub detail: Detail,
    /// The cut of hierarchies, in pixels.
    pub cut_pixels: f64,
}

impl Request<'_> {
    /// Plans the frame, and brings the data that it needs to the GPU.
    pub fn outline(
        self,
        gpu: &Gpu,
        passes: &Passes,
        prepared: &mut PreparedScene,
    ) -> Result<Outline> {
        let Self { view, settings, detail, cut_pixels } = self;
        let reads =
            |prepared: &PreparedScene| prepared.brick_cache.as_ref().map_or(0, |cache| cache.reads);
        let before = reads(prepared);
        let pixels = if let Detail::Pixels(pixels) = detail { pixels } else { Detail::PIXELS };
        prepared.update_levels(gpu, view, pixels)?;
        passes.recolor.update(gpu, prepared, view)?;
        prepared.update_solids(gpu, settings)?;
        prepared.update_facets(view, settings);
        prepared.update_forests(gpu, view, settings, cut_pixels)?;
        let choice = self.bring_bricks(gpu, passes, prepared)?;
        let sheets = prepared.scene.sheets_of(view, settings, choice.as_slice(), &prepared.bounds);
        let gather = gathering::is_chosen(&prepared.scene.items, settings, || {
            field::obstacle(&prepared.scene, settings, &sheets, gpu)
        })?;
        if gather {
            prepared.update_field(gpu, settings)?;
        } else {
            let all = prepared.scene.mixes_afar(settings, &sheets, choice.as_ref());
            passes.select.list(gpu, prepared, view, all)?;
        }
        Ok(Outline { cut_pixels, choice, read_bricks: reads(prepared) - before, sheets, gather })
    }

    /// Chooses the bricks of a view and brings them to the GPU. If they show more samples than a
    /// picture can have, coarser bricks are chosen.
    fn bring_bricks(
        &self,
        gpu: &Gpu,
        passes: &Passes,
        prepared: &mut PreparedScene,
    ) -> Result<Option<Choice>> {
        let Self { view, settings, detail, .. } = *self;
        let choose = |prepared: &PreparedScene, most| {
            prepared.scene.choice(view, settings, detail, most, &prepared.bounds)
        };
        let Some(brick_cache) = &prepared.brick_cache else { return Ok(None) };
        // The other half of the memory is for the lists of visible samples.
        let room = prepared.room_to_read(gpu);
        let bytes = settings.controls.page_memory.min(room / 2);
        let held = usize::try_from(bytes / slot_bytes(&brick_cache.bricks)).unwrap_or(usize::MAX);
        let Some(wanted) = choose(prepared, held) else { return Ok(None) };
        let most_runs = u64::from(targets::most_runs(gpu)).saturating_sub(prepared.other_runs());
        let most_runs = most_runs.min((room - bytes) / list_bytes(u64::from(RUN)));
        // For a resting view, the number found last time is used.
        let mut most =
            prepared.brick_cache.as_ref().and_then(|cache| cache.fitting(&wanted, most_runs));
        loop {
            let choice =
                most.and_then(|most| choose(prepared, most)).unwrap_or_else(|| wanted.clone());
            // The single coarsest brick is always listed. If even its list takes too much memory,
            // that is an error.
            let runs = if choice.bricks.len() > 1 { most_runs } else { u64::MAX };
            let room = Room { bytes, runs };
            let Listed::TooMany { runs, most: fit } =
                passes.select_bricks.list(gpu, prepared, view, &choice, room)?
            else {
                if let (Some(most), Some(brick_cache)) = (most, &mut prepared.brick_cache) {
                    brick_cache.set_fitting(&wanted, most_runs, most);
                }
                return Ok(Some(choice));
            };
            // `alike` bricks show few enough samples if each shows as many as the average here;
            // `certain` bricks do so even if all their samples show.
            let alike = (choice.bricks.len() as f64 * (fit as f64 / runs as f64)) as usize;
            let certain = fit * u64::from(RUN) / u64::from(SLOT_SAMPLES);
            most = Some(alike.max(certain as usize).clamp(1, choice.bricks.len() - 1));
        }
    }
}

/// A part of a picture: whole rows.
#[derive(Debug)]
pub struct Rows {
    pub view: View,
    /// The first row in the picture.
    pub first: u32,
}

/// Splits a view into strips of whole rows, for a scene with this number of fields. The colours of
/// a strip (16 bytes a pixel) fit a binding, and its tiles have enough bins for all sheets.
pub fn strips(gpu: &Gpu, view: &View, sheets: &Sheets, fields: usize) -> Vec<Rows> {
    let [width, height] = view.size;
    let colors = gpu.binding_size() - targets::most_slot_bytes(gpu, fields);
    let most = (colors / (16 * u64::from(width))).min(targets::most_rows(width, sheets.count()));
    let rows = u32::try_from(most).unwrap_or(u32::MAX).clamp(1, height);
    let strip = |first: u32| {
        let mut view = view.clone();
        view.size[1] = rows.min(height - first);
        view.center.y -= f64::from(first);
        Rows { view, first }
    };
    (0..height).step_by(rows as usize).map(strip).collect()
}
