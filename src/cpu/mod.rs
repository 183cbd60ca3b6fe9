//! The engine for processors: draws the field of a lattice without a GPU.
//!
//! The engine of `src/engine` scatters: each splat is added to the pixels that it covers. This one gathers: each pixel asks
//! which kernels reach the planes between its sheets. A Gaussian on a lattice is a product of Gaussians along the axes, so the
//! sum of the 64 kernels in reach, and its gradient, take sixteen rows of four samples (`field`). Sheets, classification, light
//! and compositing are the same; pictures agree (tests/cpu_equals_reference.rs).
//!
//! | module | does |
//! |---|---|
//! | `skip` | which sheets may show something in which tiles |
//! | `march` | walks the rays of a tile, front to back |
//! | `field` | the field at a place, and its gradient |
//! | `close` | classifies, lights and composites a sheet |
//! | `vector` | functions of eight numbers at once |

mod close;
mod field;
mod march;
mod skip;
mod vector;

use crate::{
    Error, Result,
    engine::{
        tables::Tables,
        uniforms::{Frame, clip_counts},
    },
    math::{Camera, Kernel, Sheets, View},
    picture::Picture,
    scene::{Classification, Gradient, Item, Mode, Optics, Scene, Settings},
    volume::{
        Arrangement, TransferFunction, Volume,
        reach::{EVERYTHING, first_visible},
    },
};
use close::{Look, Visible};
use fearless_simd::{Level, dispatch};
use field::{Field, Sample, Typed};
use march::{March, Tile};
use rayon::prelude::*;
use skip::{Shown, TILE};
use std::sync::Arc;

/// Sheets thicker than this many of a sample's least steps hold more than a parabola tells.
const THICKEST: f64 = 2.2;

/// A scene and what was made of it to draw it. Cameras and settings may change from picture to picture.
#[derive(Debug)]
pub struct CpuRenderer {
    scene: Scene,
    volume: Arc<Volume>,
    kernel: Kernel,
    ranges: Vec<[u8; 2]>,
    /// What shows, for the transfer function's table of that.
    shown: Option<([u16; 256], Shown)>,
    level: Level,
}

impl CpuRenderer {
    /// Prepares a scene.
    ///
    /// # Errors
    /// [`Error::Argument`] for a scene that [`Scene::validate`] refuses, and for one that only the other engine draws: the
    /// message names what it is.
    pub fn new(scene: &Scene) -> Result<Self> {
        scene.validate()?;
        let (volume, kernel, _) = volume_of(scene)?;
        if !matches!(volume.lattice.arrangement, Arrangement::Cartesian) {
            return Err(not_drawn("body-centred and rectilinear lattices"));
        }
        if volume.coefficients.is_some() && kernel.as_tensor().is_none() {
            return Err(not_drawn("sharp volumes of radial kernels"));
        }
        if field::weighting(kernel).is_none() {
            return Err(not_drawn("kernels other than tensor products and Gaussians that reach two samples"));
        }
        let ranges = volume.drawn_ranges(kernel).into_owned();
        let (volume, kernel) = (volume.clone(), kernel.clone());
        Ok(Self { scene: scene.clone(), volume, kernel, ranges, shown: None, level: Level::new() })
    }

    /// Draws a picture.
    ///
    /// # Errors
    /// [`Error::Argument`] for a camera or settings that make no picture of this scene, and for settings that only the other
    /// engine draws.
    pub fn render(&mut self, camera: &Camera, settings: &Settings) -> Result<Picture> {
        self.scene.validate_settings(settings)?;
        let view = camera.view(settings.size)?;
        let bounds = self.scene.bounds();
        view.validate_for(&bounds)?;
        let sheets = self.scene.sheets_of(&view, settings, None, &bounds);
        check_settings(settings)?;
        let least = self.volume.lattice.least_kernel_spacing();
        if sheets.step > THICKEST * least {
            return Err(not_drawn("sheets thicker than two samples"));
        }
        let (_, _, transfer) = volume_of(&self.scene)?;
        let first = match settings.optics {
            Optics::Maximum => EVERYTHING,
            _ => first_visible(transfer, self.volume.range),
        };
        if self.shown.as_ref().is_none_or(|(own, _)| *own != first) {
            self.shown = Some((first, Shown::new(&self.volume, &self.ranges, &first)));
        }
        let Some((_, shown)) = &self.shown else { return Err(not_drawn("this")) };
        let tables = Tables::new(transfer, self.volume.range, Some(&self.kernel));
        let mut frame = Frame::new(&self.scene, &view, &sheets, settings, None);
        frame.set_tables(&tables, transfer, &view, &sheets);
        let is_lit = settings.optics == Optics::EmissionAbsorption;
        let look = Look {
            frame: &frame,
            tables: &tables,
            optics: settings.optics,
            is_lit: is_lit && settings.shade_of(transfer).is_some(),
            has_gradient_opacity: !transfer.gradient.is_empty() && settings.optics != Optics::Maximum,
            is_integrated: settings.classification == Classification::PreIntegrated,
            isosurfaces: if is_lit { transfer.isosurfaces.len() } else { 0 },
        };
        let Some(weighting) = field::weighting(&self.kernel) else { return Err(not_drawn("this kernel")) };
        let planes = Planes { view: &view, sheets: &sheets, settings };
        Ok(match Typed::new(&self.volume, weighting, tables.values[0]) {
            Typed::U8(field) => self.draw(field, look, shown, &planes, transfer),
            Typed::U16(field) => self.draw(field, look, shown, &planes, transfer),
            Typed::I16(field) => self.draw(field, look, shown, &planes, transfer),
            Typed::I32(field) => self.draw(field, look, shown, &planes, transfer),
            Typed::F32(field) => self.draw(field, look, shown, &planes, transfer),
        })
    }

    fn draw<T: Sample>(
        &self,
        field: Field<T>,
        look: Look,
        shown: &Shown,
        planes: &Planes,
        transfer: &TransferFunction,
    ) -> Picture {
        let &Planes { view, sheets, settings } = planes;
        let marks = shown.sheets_of_tiles(&self.volume, view, sheets);
        let march = March {
            visible: Visible::new(&look),
            look,
            field,
            shown,
            dims: self.volume.lattice.dims,
            view,
            planes: sheets.planes.iter().map(|plane| *plane as f32).collect(),
            clips: clip_counts(settings)[0] as usize,
        };
        let columns = (view.size[0] as usize).div_ceil(TILE);
        let tiles: Vec<Tile> = marks
            .par_iter()
            .enumerate()
            .map(|(number, own)| {
                let at = [number % columns, number / columns];
                dispatch!(self.level, simd => march.tile(simd, at, own))
            })
            .collect();
        let is_maximum = settings.optics == Optics::Maximum;
        let pixel = |index: usize| {
            let [x, y] = [index % view.size[0] as usize, index / view.size[0] as usize];
            let (color, hit) = tiles[y / TILE * columns + x / TILE][y % TILE * TILE + x % TILE];
            if is_maximum {
                return (of_largest(hit, transfer, march.look.frame), f32::INFINITY);
            }
            if color[3] < 0.5 {
                return (color, f32::INFINITY);
            }
            let at = glam::DVec2::new(x as f64 + 0.5, y as f64 + 0.5);
            (color, hit * view.ray(at).1.z as f32)
        };
        let pixels = view.size[0] as usize * view.size[1] as usize;
        let (color, depth) = (0..pixels).into_par_iter().map(pixel).unzip();
        Picture { width: view.size[0], height: view.size[1], color, depth }
    }
}

/// Where the sheets of a picture lie.
struct Planes<'a> {
    view: &'a View,
    sheets: &'a Sheets,
    settings: &'a Settings,
}

/// The colour of a pixel by the largest value on its ray: its opacity is that of a unit of length.
fn of_largest(value: f32, transfer: &TransferFunction, frame: &Frame) -> [f32; 4] {
    if value <= -3e38 {
        return [0.0; 4];
    }
    let value = f64::from(frame.transfer[0]) + f64::from(value) / f64::from(frame.transfer[1]);
    let opacity = 1.0 - (-transfer.extinction(value) * transfer.unit).exp();
    let [red, green, blue] = transfer.color(value);
    [red, green, blue, 1.0].map(|part| (part * opacity) as f32)
}

fn volume_of(scene: &Scene) -> Result<(&Arc<Volume>, &Kernel, &TransferFunction)> {
    match scene.items.as_slice() {
        [Item::Volume(volume, kernel, transfer)] => Ok((volume, kernel, transfer)),
        _ => Err(not_drawn("anything but a single volume")),
    }
}

fn check_settings(settings: &Settings) -> Result<()> {
    if settings.classifies_samples() {
        return Err(not_drawn("samples that are classified before interpolation"));
    }
    if settings.mode != Mode::Sheets {
        return Err(not_drawn("modes other than image-aligned sheets"));
    }
    if settings.gradient == Gradient::Central {
        return Err(not_drawn("gradients from neighbouring pixels"));
    }
    if clip_counts(settings)[1] > 0 {
        return Err(not_drawn("boxes that are cut out"));
    }
    Ok(())
}

fn not_drawn(what: &str) -> Error {
    Error::Argument(format!("the CPU engine does not draw {what} yet; the GPU engine does"))
}
