//! Chooses the variant of a picture: the features of the shaders that its scene, view and settings
//! need.

use super::Variant;
use crate::{
    bricks::Choice,
    gpu::budget::Budget,
    math::{Kernel, Profile, View},
    plan::{frame::clip_counts, tables},
    scene::{Classification, Gradient, Item, Optics, Scene, Settings},
    volume::{Arrangement, Lattice, TransferFunction},
};

/// The things on which the variant of a picture depends.
#[derive(Debug, Clone, Copy)]
pub struct Request<'a> {
    pub scene: &'a Scene,
    pub view: &'a View,
    pub settings: &'a Settings,
    pub budget: Budget,
    /// The levels and bricks that are drawn, of a volume in bricks.
    pub choice: Option<&'a Choice>,
    /// The type of the samples (value.wgsl), if the field is gathered.
    pub gathered: Option<u32>,
    /// Whether facets show images.
    pub images: bool,
    /// Whether the adapter runs on the processor.
    pub is_software: bool,
}

/// Returns the variant of a picture. Its lighting and its sources decide what is compiled.
pub fn variant(request: &Request<'_>) -> Variant {
    let &Request { scene, settings, budget, gathered, .. } = request;
    let mut variant = without_items(request);
    for item in &scene.items {
        match item {
            Item::Facets(_) | Item::Solid(_) => {
                if let Item::Facets(set) = item {
                    variant.rods |= set.rods.is_some();
                }
                variant.facets = true;
                variant.images = request.images;
                variant.surface_shaded |= is_lit(settings) && settings.surface_shade.is_some();
            }
            Item::Radiance(_) | Item::Gaussians(_) | Item::Hierarchy(_) => {
                variant.radiance = true;
                variant.trained |= item.is_trained();
                variant.surface_shaded |= is_lit(settings) && settings.surface_shade.is_some();
            }
            // Not drawn: `PreparedScene::new` returns an error.
            Item::Cells(..) => {}
            Item::Scalar(_, transfer)
            | Item::Volume(_, _, transfer)
            | Item::Bricks(_, _, transfer) => {
                add_field(&mut variant, settings, item, transfer);
                add_samples(&mut variant, request, item);
            }
        }
    }
    variant.lamps &= variant.volume_shaded || variant.surface_shaded;
    // At the end of a pass, march meets splats again and closes sheets twice. That costs more for a
    // field than for a surface. A GPU draws most before it is worth while to wait and look.
    variant.least_share = budget.least_share.unwrap_or(match (variant.staged, variant.scalar) {
        (true, _) => 1 << 23,
        (false, true) => 1 << 21,
        (false, false) => 1 << 18,
    });
    variant.central = variant.gradients() && settings.gradient == Gradient::Central;
    // With differences between pixels, a tile's invocations wait for each other already.
    variant.staged = variant.staged && !variant.central;
    if gathered.is_some() && variant.rows > 1 {
        // Each pixel evaluates the samples around its own ray, so the pixels of an invocation would
        // share nothing.
        variant.rows = GATHERED_ROWS;
        variant.most_entries = variant.most_entries.min(GATHERED_ENTRIES);
    }
    // The code of a sheet is repeated for each pixel and field. With four rows, the software driver
    // shows the first picture of two volumes after 13 s, with one row after 5 s. Later frames then
    // take a third longer.
    if variant.fields > 1 {
        variant.rows = 1;
    }
    variant
}

/// Returns the variant of a picture without any item.
fn without_items(request: &Request<'_>) -> Variant {
    let &Request { scene, view, settings, budget, gathered, is_software, .. } = request;
    let like_gpu = budget.staged.unwrap_or(!is_software);
    let staged = like_gpu && budget.tile_entries.is_none();
    let most_entries = if is_software && !staged { SOFTWARE_ENTRIES } else { u32::MAX };
    let [clips, holes] = clip_counts(settings);
    Variant {
        perspective: view.perspective,
        mode: settings.mode,
        classification: settings.classification,
        optics: settings.optics,
        scalar: false,
        classified: false,
        fields: request.scene.fields().len().max(1) as u32,
        samples: false,
        lattice: false,
        body_centred: false,
        rectilinear: false,
        gather: gathered.is_some(),
        sample_kind: 0,
        labels: false,
        two_levels: false,
        radiance: false,
        trained: false,
        by_centers: scene.is_by_centers(settings),
        facets: false,
        images: false,
        rods: false,
        isotropic: false,
        general: false,
        table_kernel: false,
        beyond: false,
        volume_shaded: false,
        surface_shaded: false,
        lamps: !settings.lighting.is_plain(),
        gradient_opacity: false,
        occlusion: settings.occlusion && settings.hides() && scene.can_hide(),
        least_share: 0,
        isosurfaces: 0,
        clips,
        holes,
        central: false,
        // A software adapter runs eight invocations at once: eight columns of eight pixels fill a
        // tile.
        rows: if is_software && !staged { 8 } else { 1 },
        staged,
        // The answer takes a GPU longer than the field.
        asks_first: !like_gpu,
        most_entries: budget.tile_entries.unwrap_or(most_entries),
    }
}

/// Whether lighting is visible: only with emission and absorption.
fn is_lit(settings: &Settings) -> bool {
    settings.optics == Optics::EmissionAbsorption
}

/// Adds what the transfer function of a field needs.
fn add_field(variant: &mut Variant, settings: &Settings, item: &Item, transfer: &TransferFunction) {
    let is_lit = is_lit(settings);
    let shaded = is_lit && settings.shade_of(transfer).is_some();
    if settings.classifies_samples() {
        variant.classified = true;
        variant.surface_shaded |= shaded;
    } else {
        variant.scalar = true;
        variant.volume_shaded |= shaded;
        variant.gradient_opacity |=
            !transfer.gradient.is_empty() && settings.optics != Optics::Maximum;
        let isosurfaces = if is_lit { transfer.isosurfaces.len() as u32 } else { 0 };
        variant.isosurfaces = variant.isosurfaces.max(isosurfaces);
    }
    // Finding the range of scattered samples would take longer.
    let range = item.lattice().and_then(|_| item.value_range());
    variant.beyond |= range.is_none_or(|range| tables::leaves_out(transfer, range));
}

/// Adds what the samples and the kernel of an item need.
fn add_samples(variant: &mut Variant, request: &Request<'_>, item: &Item) {
    let &Request { choice, gathered, .. } = request;
    match item {
        Item::Volume(volume, kernel, _) => {
            let arrangement = &volume.lattice.arrangement;
            variant.lattice = true;
            variant.body_centred |= *arrangement == Arrangement::BodyCentred;
            variant.rectilinear |= matches!(arrangement, Arrangement::Rectilinear(_));
            variant.table_kernel |= !matches!(kernel.profile, Profile::Gaussian(_));
            variant.sample_kind = gathered.unwrap_or(0);
            if volume.is_label_map() {
                variant.labels = true;
                // Nothing lies between two labels.
                variant.classification = Classification::Post;
            }
        }
        Item::Bricks(..) => {
            variant.lattice = true;
            variant.two_levels |= choice.is_some_and(|choice| choice.levels.len() > 1);
        }
        _ => variant.samples = true,
    }
    let is_isotropic = request.is_isotropic(item);
    variant.isotropic |= is_isotropic;
    variant.general |= !is_isotropic;
}

impl Request<'_> {
    /// Whether the samples of an item are drawn with sections that do not depend on the pixel.
    pub fn is_isotropic(&self, item: &Item) -> bool {
        let Self { view, settings, choice, gathered, .. } = *self;
        let flat = |lattice: &Lattice, kernel| are_flat(lattice, kernel, view, item);
        match item {
            Item::Volume(volume, kernel, _) => {
                let lattice = &volume.lattice;
                gathered.is_none()
                    && !settings.classifies_samples()
                    && matches!(kernel.profile, Profile::Gaussian(_))
                    && !matches!(lattice.arrangement, Arrangement::Rectilinear(_))
                    && flat(lattice, kernel)
            }
            Item::Bricks(bricks, kernel, _) => choice.is_some_and(|choice| {
                choice.levels.iter().all(|&(level, _)| flat(&bricks.lattice(level), kernel))
            }),
            _ => false,
        }
    }
}

/// Mesa's software driver ends all loops of an invocation after 65,535 iterations in total. In
/// march an entry takes up to six: its own, and those that find its sheet and close the sheets
/// before it.
const SOFTWARE_ENTRIES: u32 = 10_000;

/// The same beside a gathered field, where all sheets may lie between two entries.
const GATHERED_ENTRIES: u32 = 5_000;

/// Pixels of an invocation of march on a software driver, beside a gathered field.
const GATHERED_ROWS: u32 = 1;

/// Distance, in footprint radii, beyond which the sections of an isotropic kernel count as the same
/// for all pixels. The error is at most a hundredth of the radius, at the footprint's rim;
/// tests/pictures/cases.rs bounds the error of the picture.
const ISOTROPIC_DISTANCE: f64 = 50.0;

/// Whether the kernels of a lattice are round, and so far away that their sections are the same for
/// all pixels.
fn are_flat(lattice: &Lattice, kernel: &Kernel, view: &View, item: &Item) -> bool {
    let near = view.distances(&item.bounds())[0];
    // The sections of a kernel shift by ρ²σ²/2|c| between its centre and radius ρσ.
    let reach = kernel.extent * lattice.spacing().max_element();
    (!view.perspective || near > ISOTROPIC_DISTANCE * reach) && is_isotropic(lattice.axes)
}

/// Whether the steps have equal length and are at right angles.
fn is_isotropic(axes: glam::DMat3) -> bool {
    let product = axes.transpose() * axes;
    let size = product.x_axis.x;
    let difference = product - glam::DMat3::from_diagonal(glam::DVec3::splat(size));
    difference.to_cols_array().iter().all(|d| d.abs() <= 1e-4 * size)
}
