//! The data that all tiles of a picture share: the view, the sheets, the tables, and the methods of
//! drawing.

use crate::{
    Stop,
    bricks::Choice,
    facet::FacetSet,
    math::{Bounds, Profile, Sheets, View},
    plan::{
        TILE,
        field::Field,
        frame::{Frame, from_eye},
        lamps::Lamps,
        tables::Tables,
    },
    scene::{Classification, Gradient, Item, Mode, Optics, Order, Region, Scene, Settings},
    volume::Arrangement,
};
use glam::Vec3;
use std::sync::Arc;

/// The place of a plane in front of or behind all others.
const NOWHERE: f32 = 3e38;

/// What a picture draws of the scene, decided before drawing.
pub struct Outline {
    /// The cut of hierarchies, in pixels.
    pub cut_pixels: f64,
    pub sheets: Sheets,
    /// In the order of the scene.
    pub fields: Vec<FieldOutline>,
    /// Whether drawing is to end.
    pub stop: Stop,
}

/// What a picture draws of a field.
pub struct FieldOutline {
    pub choice: Option<Choice>,
    /// The ranges of values that are visible.
    pub visible_ranges: [u16; 256],
    /// Whether the field is gathered.
    pub gathers: bool,
}

/// The plan of a picture for one of its fields, and for what carries colours of its own.
///
/// Sheets are numbered from 1; sheet n lies between planes n and n + 1. Sheet 0 is everything in
/// front of the first plane and is not drawn.
pub struct Plan<'a> {
    /// The number of the field.
    pub number: u8,
    pub view: &'a View,
    pub frame: Frame,
    pub field: Field,
    pub tables: Tables,
    pub planes: Vec<f32>,
    /// The number of the last sheet.
    pub sheets: usize,
    pub mode: Mode,
    pub optics: Optics,
    /// The scene has a field that is classified after interpolation.
    pub has_field: bool,
    /// The scene has a field whose samples are classified before interpolation.
    pub is_classified: bool,
    /// The field's samples lie on a lattice and fill its box.
    pub on_lattice: bool,
    /// The samples of the field have slopes.
    pub has_slopes: bool,
    /// The field's kernel is looked up in tables.
    pub table_kernel: bool,
    pub is_lit: bool,
    pub has_gradient_opacity: bool,
    /// Gradients across the picture are differences of neighbouring pixels.
    pub central: bool,
    /// Tiles share pixels with their neighbours, because some field needs them.
    has_apron: bool,
    /// The transfer function is integrated between values, not looked up at the mean of a sheet.
    pub is_integrated: bool,
    pub isosurfaces: usize,
    /// The scene has splats of radiance.
    pub has_radiance: bool,
    /// Some of them may have normals. Trained Gaussians have none.
    pub has_normals: bool,
    /// The scene has facets.
    pub has_facets: bool,
    /// Some facets are rods.
    pub has_rods: bool,
    /// The sets of facets that show images.
    pub with_images: Vec<Arc<FacetSet>>,
    pub lit_surfaces: bool,
    /// The lights, unless all light comes from the eye.
    pub lamps: Option<Lamps>,
    /// The scene has trained Gaussians, which are not lit.
    pub has_trained: bool,
    /// Trained Gaussians are drawn alone, each at the depth of its centre.
    pub by_centers: bool,
    /// The largest channel of a colour of radiance.
    pub brightest: f32,
    /// The number of boxes that are cut out.
    pub holes: usize,
    /// The lower and the upper corner of the region that is drawn, relative to the eye.
    pub region: Option<[Vec3; 2]>,
}

/// Returns the facets of an item that show images.
fn set_with_images(item: &Item) -> Option<Arc<FacetSet>> {
    match item {
        Item::Facets(set) if !set.texture_coordinates.is_empty() => Some(set.clone()),
        _ => None,
    }
}

impl<'a> Plan<'a> {
    /// Returns the plan of one field of a scene, by the number of its item and with its choice of
    /// bricks; or of a scene without fields.
    pub fn new(
        scene: &Scene,
        field: Option<(usize, Option<&Choice>)>,
        view: &'a View,
        sheets: &Sheets,
        settings: &Settings,
    ) -> Self {
        let frame = Frame::new(scene, view, sheets, settings);
        let mut plan = Self {
            number: 0,
            view,
            holes: frame.holes.len(),
            frame,
            field: Field::default(),
            tables: Tables::default(),
            planes: planes_of(sheets),
            sheets: sheets.count(),
            mode: settings.mode,
            optics: settings.optics,
            has_field: false,
            is_classified: false,
            on_lattice: false,
            has_slopes: false,
            table_kernel: false,
            is_lit: false,
            has_gradient_opacity: false,
            central: false,
            has_apron: false,
            is_integrated: settings.classification == Classification::PreIntegrated,
            isosurfaces: 0,
            has_radiance: false,
            has_normals: false,
            has_facets: false,
            has_rods: false,
            with_images: Vec::new(),
            lit_surfaces: false,
            lamps: None,
            has_trained: scene.items.iter().any(Item::is_trained),
            by_centers: scene.is_by_centers(settings),
            brightest: scene.brightest(),
            region: settings
                .region
                .map(|Region { bounds: Bounds { min, max }, .. }| from_eye(view, [min, max])),
        };
        // Only emission and absorption is lit.
        let emits = settings.optics == Optics::EmissionAbsorption;
        let is_lit = emits && settings.surface_shade.is_some();
        for item in &scene.items {
            match item {
                Item::Facets(_) | Item::Solid(_) => {
                    plan.has_facets = true;
                    plan.lit_surfaces |= is_lit;
                    plan.has_rods |= matches!(item, Item::Facets(set) if set.rods.is_some());
                    plan.with_images.extend(set_with_images(item));
                }
                Item::Radiance(_) | Item::Gaussians(_) | Item::Hierarchy(_) => {
                    plan.has_radiance = true;
                    plan.has_normals |= !item.is_trained();
                    plan.lit_surfaces |= is_lit && !item.is_trained();
                }
                Item::Scalar(..) | Item::Volume(..) | Item::Bricks(..) | Item::Cells(..) => {}
            }
        }
        if let Some((number, choice)) = field {
            plan.set_field(sheets, settings, &scene.items[number], choice);
        }
        plan.has_apron = plan.central;
        plan
    }

    /// Numbers the plans of the fields of one picture, whose tiles are the same.
    pub fn join(plans: &mut [Self]) {
        let has_apron = plans.iter().any(|plan| plan.central);
        for (number, plan) in plans.iter_mut().enumerate() {
            // There are at most `Scene::MAX_FIELDS`.
            (plan.number, plan.has_apron) = (number as u8, has_apron);
        }
    }

    /// Sets what an item's field needs, if it has one.
    fn set_field(
        &mut self,
        sheets: &Sheets,
        settings: &Settings,
        item: &Item,
        choice: Option<&Choice>,
    ) {
        let (Some(transfer), Some(range)) = (item.transfer(), item.value_range()) else { return };
        let kernel = item.kernel();
        self.on_lattice = item.lattice().is_some();
        self.has_slopes = match item {
            Item::Scalar(..) => true,
            Item::Volume(volume, ..) => {
                matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_))
            }
            _ => false,
        };
        self.tables = Tables::of(item, transfer, range);
        self.field = Field::new(item, self.view, settings, choice);
        let light = item.light(settings);
        self.field.set_tables(&self.tables, transfer, light, self.view, sheets);
        self.table_kernel =
            kernel.is_some_and(|kernel| !matches!(kernel.profile, Profile::Gaussian(_)));
        let emits = settings.optics == Optics::EmissionAbsorption;
        let is_shaded = emits && settings.shade_of(transfer).is_some();
        if settings.classifies_samples() {
            self.is_classified = true;
            self.has_slopes = false;
            self.lit_surfaces |= is_shaded;
            self.has_normals |= is_shaded;
            return;
        }
        self.has_field = true;
        // Nothing lies between two labels.
        self.is_integrated &= !item.is_label_map();
        self.is_lit = is_shaded;
        self.has_gradient_opacity =
            !transfer.gradient.is_empty() && settings.optics != Optics::Maximum;
        self.isosurfaces = if emits { transfer.isosurfaces.len() } else { 0 };
        self.central = self.has_gradients() && settings.gradient == Gradient::Central;
    }

    /// Whether the field's gradient is used.
    pub fn has_gradients(&self) -> bool {
        self.has_field && (self.is_lit || self.has_gradient_opacity)
    }

    /// Whether clips leave anything out.
    pub fn has_clips(&self) -> bool {
        !self.frame.clips.is_empty() || self.holes > 0
    }

    /// Whether splats are drawn whole, in the sheet of their centre.
    pub fn is_whole(&self) -> bool {
        self.mode != Mode::Sheets
    }

    /// Returns the order of splats if they are composited one by one.
    pub fn single(&self) -> Option<Order> {
        if let Mode::Splats(order) = self.mode { Some(order) } else { None }
    }

    /// Returns what splats are sorted by if they are composited one by one: the distance of their
    /// centre, or its depth along the view's axis in scenes with trained Gaussians.
    pub fn key(&self, center: Vec3) -> f32 {
        if self.view.perspective && !self.has_trained { center.length() } else { center.z }
    }

    /// Returns the number of pixels that tiles share with each neighbour.
    pub fn apron(&self) -> i32 {
        i32::from(self.has_apron)
    }

    /// Returns the number of pixels from a tile to the next one.
    pub fn tile_step(&self) -> usize {
        TILE - 2 * usize::from(self.has_apron)
    }

    /// Returns the number of columns and rows of tiles.
    pub fn tiles(&self) -> [usize; 2] {
        self.view.size.map(|side| (side as usize).div_ceil(self.tile_step()))
    }

    /// Returns the first pixel of a tile, which may lie outside the picture.
    pub fn corner(&self, tile: [usize; 2]) -> [i32; 2] {
        tile.map(|at| (at * self.tile_step()) as i32 - self.apron())
    }

    /// Returns the middle of a sheet.
    pub fn middle(&self, sheet: usize) -> f32 {
        0.5 * (self.planes[sheet] + self.planes[sheet + 1])
    }

    /// Returns the first of the two sheets whose middles enclose a depth. `sheet` contains it.
    pub fn sheet_before(&self, sheet: usize, depth: f32) -> usize {
        let is_before = sheet > 0 && depth < self.middle(sheet);
        (sheet - usize::from(is_before)).clamp(1, self.sheets.max(2) - 1)
    }

    /// Returns the sheet that contains a distance.
    pub fn sheet_of(&self, distance: f32) -> usize {
        let frame = &self.frame;
        let near = self.planes[1];
        if distance < near {
            return 0;
        }
        let geometric = frame.geometric_sheets as usize;
        let turn = self.planes[1 + geometric];
        let estimate = if distance < turn {
            1.0 + ((distance / near).log2() * frame.per_ratio_log2).floor()
        } else {
            1.0 + geometric as f32 + ((distance - turn) * frame.per_step).floor()
        };
        let mut sheet = estimate.clamp(1.0, self.sheets as f32) as usize;
        // The closed form may be off by one where rounding meets a plane. The list decides.
        if distance < self.planes[sheet] {
            sheet -= 1;
        } else if distance >= self.planes[sheet + 1] && sheet < self.sheets {
            sheet += 1;
        }
        sheet
    }
}

/// Returns the planes between all sheets: one before the first sheet, and four behind the last.
fn planes_of(sheets: &Sheets) -> Vec<f32> {
    let mut planes = vec![-NOWHERE];
    planes.extend(sheets.planes.iter().map(|plane| *plane as f32));
    planes.extend([NOWHERE; 4]);
    planes
}
