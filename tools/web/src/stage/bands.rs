//! The bands of a frame: whole rows that the processor draws at once, here or in the engine of a
//! helper, which has opened the same scene. A band is the same picture wherever it is drawn.

use super::{Stage, Work};
use crate::stage::painter::Painter;
use glam::DVec2;
use serde_json::{Value, json};
use splatkit::{
    Error, Result,
    interaction::Effort,
    math::View,
    picture::Picture,
    scene::Settings,
    session::{CameraEntry, ClipEntry},
    volume::TransferFunction,
};
use std::ops::Range;

/// Bands of a moving frame begin where tiles do.
const TILE: u32 = 8;

/// The numbers of a pixel: its colour, its opacity and its depth.
const NUMBERS: usize = 5;

#[derive(Debug, Clone, Copy, PartialEq)]
enum Band {
    Waits,
    Lent,
    Drawn,
}

/// The bands of a frame.
#[derive(Debug)]
pub struct Bands {
    height: u32,
    rows: u32,
    bands: Vec<Band>,
}

impl Bands {
    /// Bands of so many rows each.
    pub fn new(height: u32, rows: u32) -> Self {
        let count = height.div_ceil(rows.max(1)) as usize;
        Self { height, rows, bands: vec![Band::Waits; count] }
    }

    /// As many bands as there are engines.
    pub fn among(height: u32, engines: u32) -> Self {
        Self::new(height, height.div_ceil(engines.max(1)).div_ceil(TILE) * TILE)
    }

    /// Returns the rows of a band.
    pub fn rows(&self, band: usize) -> Range<u32> {
        let first = band as u32 * self.rows;
        first..self.height.min(first + self.rows)
    }

    /// Returns the first band that nobody draws.
    pub fn next(&self) -> Option<usize> {
        self.bands.iter().position(|band| *band == Band::Waits)
    }

    /// Lends the last band that nobody draws.
    fn lend(&mut self) -> Option<usize> {
        let band = self.bands.iter().rposition(|band| *band == Band::Waits)?;
        self.bands[band] = Band::Lent;
        Some(band)
    }

    pub fn set_drawn(&mut self, band: usize) {
        self.bands[band] = Band::Drawn;
    }

    pub fn are_drawn(&self) -> bool {
        self.bands.iter().all(|band| *band == Band::Drawn)
    }

    /// Whether there is more than one.
    pub fn are_several(&self) -> bool {
        self.bands.len() > 1
    }
}

/// Draws rows of a view, at once.
pub fn drawn(
    painter: &mut Painter,
    view: &View,
    settings: &Settings,
    rows: Range<u32>,
) -> Result<Picture> {
    let size = [settings.size[0], rows.end - rows.start];
    let above = DVec2::new(0.0, f64::from(rows.start));
    let view = View { center: view.center - above, size, ..view.clone() };
    painter.draw(&view, &Settings { size, ..settings.clone() })
}

/// Draws with helpers.
impl Stage {
    /// Says how many helpers draw along.
    pub fn set_helpers(&mut self, count: u32) {
        self.helpers = count;
    }

    /// Lends a band of the frame that is being drawn to a helper. Returns what
    /// [`help`](Self::help) takes there: JSON, with the numbers `frame` and `band`.
    pub fn lend(&mut self) -> Option<String> {
        let is_shared = self.helpers > 0 && !self.painter.is_gpu();
        let work = self.work.as_mut().filter(|_| is_shared)?;
        let band = work.bands.lend()?;
        let rows = work.bands.rows(band);
        let Effort { pixel, coarseness } = work.effort;
        let job = json!({
            "frame": work.number, "band": band, "rows": [rows.start, rows.end],
            "camera": CameraEntry::from(&work.camera), "state": work.state,
            "pixel": pixel, "coarseness": coarseness,
        });
        Some(job.to_string())
    }

    /// Returns the work that has lent a band, unless it was given up.
    fn lender(&mut self, frame: u64, band: usize) -> Option<&mut Work> {
        let is_lent = |work: &&mut Work| {
            work.number == frame && work.bands.bands.get(band) == Some(&Band::Lent)
        };
        self.work.as_mut().filter(is_lent)
    }

    /// Takes a band that a helper has drawn.
    ///
    /// # Errors
    /// [`Error::Argument`] if it has other numbers than were asked for.
    pub fn give_back(&mut self, frame: u64, band: usize, numbers: &[f32]) -> Result<()> {
        let Some(work) = self.lender(frame, band) else { return Ok(()) };
        let (rows, width) = (work.bands.rows(band), work.settings.size[0]);
        let height = rows.end - rows.start;
        if numbers.len() != width as usize * height as usize * NUMBERS {
            return Err(Error::Argument(format!("a helper has drawn {} numbers", numbers.len())));
        }
        let pixels = || numbers.chunks_exact(NUMBERS);
        let color = pixels().map(|pixel| std::array::from_fn(|at| pixel[at])).collect();
        let depth = pixels().map(|pixel| pixel[NUMBERS - 1]).collect();
        work.picture.paste(&Picture { width, height, color, depth }, [0, rows.start])?;
        work.bands.set_drawn(band);
        Ok(())
    }

    /// Takes a band back that a helper did not draw.
    pub fn take_back(&mut self, frame: u64, band: usize) {
        if let Some(work) = self.lender(frame, band) {
            work.bands.bands[band] = Band::Waits;
        }
    }

    /// Returns what helpers must know of the scene beside its files.
    pub(super) fn state(&self) -> String {
        let clips = &self.description.picture.clips;
        json!({ "size": self.size, "clips": clips, "transfers": self.transfers }).to_string()
    }

    /// Draws a band that another stage has lent, of the same scene. Returns its numbers.
    ///
    /// # Errors
    /// [`Error::Argument`] for something else, and those of drawing.
    pub fn help(&mut self, job: &str) -> Result<Vec<f32>> {
        let job: Value = serde_json::from_str(job).map_err(wrong)?;
        self.take_state(job["state"].as_str().unwrap_or(""))?;
        let camera: CameraEntry = taken(&job["camera"])?;
        let camera = camera.camera().map_err(Error::Argument)?;
        let effort =
            Effort { pixel: taken(&job["pixel"])?, coarseness: taken(&job["coarseness"])? };
        let exact = &self.drawing.settings;
        let settings = effort.settings(exact, exact.sheet_thickness.or(self.sheet));
        let [start, end]: [u32; 2] = taken(&job["rows"])?;
        if start >= end || end > settings.size[1] {
            return Err(Error::Argument(format!("there are no rows {start} to {end}")));
        }
        let view = camera.view(settings.size)?;
        let picture = drawn(&mut self.painter, &view, &settings, start..end)?;
        let pixels = picture.color.iter().zip(&picture.depth);
        Ok(pixels.flat_map(|([r, g, b, a], depth)| [*r, *g, *b, *a, *depth]).collect())
    }

    /// Sets what another stage has set.
    fn take_state(&mut self, state: &str) -> Result<()> {
        if state == self.taken {
            return Ok(());
        }
        let value: Value = serde_json::from_str(state).map_err(wrong)?;
        let size: [u32; 2] = taken(&value["size"])?;
        let clips: Vec<ClipEntry> = taken(&value["clips"])?;
        let transfers: Vec<(usize, TransferFunction)> = taken(&value["transfers"])
            .map(|all: std::collections::BTreeMap<usize, _>| all.into_iter().collect())?;
        self.size = size;
        (self.description.picture.size, self.description.picture.clips) = (Some(size), clips);
        self.redraw()?;
        for (field, transfer) in transfers {
            if self.transfers.get(&field) != Some(&transfer) {
                self.set_transfer(field, &transfer)?;
            }
        }
        state.clone_into(&mut self.taken);
        Ok(())
    }
}

fn taken<T: serde::de::DeserializeOwned>(value: &Value) -> Result<T> {
    serde_json::from_value(value.clone()).map_err(wrong)
}

fn wrong(error: serde_json::Error) -> Error {
    Error::Argument(format!("a helper does not understand what it is asked for: {error}"))
}
