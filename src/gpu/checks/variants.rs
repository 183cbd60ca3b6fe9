//! The variants of pictures, as the engine itself derives them, of scenes of every kind.

use super::scenes::{self, Case, methods};
use crate::{
    bricks::Bricks,
    gpu::{
        budget::Budget,
        scene::field::{FOUR, gathered_volume, kind_of},
        variant::{Request, Variant, variant},
    },
    hierarchy::Detail,
    math::Projection,
    scene::{Classification, Gradient, Item, Lighting, Mode, Optics, Order, Scene, Settings},
    volume::{Shade, TransferFunction, Volume},
};
use std::{
    collections::HashSet,
    sync::{Arc, LazyLock},
};

/// The scenes of the integration tests.
fn cases() -> Vec<Case> {
    let mut all = vec![
        scenes::ellipsoids_in_perspective(),
        scenes::ellipsoids_orthographic(),
        scenes::ellipsoids_unlit(),
        scenes::ellipsoids_without_normals(),
        scenes::huge_among_small(),
        scenes::splats_below_a_pixel(),
        scenes::flat_discs_head_on(),
        scenes::camera_among_ellipsoids(),
        scenes::wide_angle(),
        scenes::scattered_samples(),
        scenes::scattered_samples_orthographic(),
        scenes::blobs_analytic(),
        scenes::blobs_central(),
        scenes::blobs_orthographic(),
        scenes::blobs_unshaded(),
        scenes::camera_inside_a_volume(),
        scenes::marschner_lobb(),
        scenes::sheared_lattice(),
        scenes::sheared_lattice_central(),
        scenes::constant_field(),
        scenes::surface_in_a_volume(),
        scenes::surface_in_a_volume_orthographic(),
        methods::body_centred(),
        methods::body_centred_from_afar(),
        methods::rectilinear(),
        methods::b_spline(),
        methods::table_of_a_gaussian(),
        methods::closed_form_of_that_gaussian(),
        methods::thin_shells(),
        methods::one_value_far_off(),
        methods::points_far_off(),
        methods::post_classified(),
        methods::pre_classified(),
        methods::axis_sheets(),
        methods::axis_sheets_body_centred_orthographic(),
        methods::single_splats(Order::FrontToBack),
        methods::single_splats(Order::BackToFront),
        methods::single_ellipsoids(),
        methods::orthographic(methods::rectilinear()),
        methods::from_inside(methods::isosurfaces_in_fog()),
        methods::samples_with_slopes(Classification::PreIntegrated),
        methods::samples_with_slopes(Classification::Post),
        methods::samples_with_slopes(Classification::Pre),
        methods::gradient_opacity(),
        methods::uncertain_light(),
        methods::one_isosurface(),
        methods::isosurfaces_in_fog(),
        methods::maximum(),
        methods::x_ray(),
        methods::clipped_volume(),
        methods::clipped_surface_in_a_volume(),
        methods::sharp(),
        methods::sharp_body_centred(),
    ];
    all.extend([0.25, 9.0, 20.0].map(bricks).into_iter().chain([labels()]));
    all.extend(scenes::facets::all().into_iter().chain([scenes::facets::textured()]));
    all.extend(scenes::gaussians::all());
    all.extend(scenes::fields::all().into_iter().filter(|case| case.scene.beyond_gpu().is_none()));
    all
}

/// A label map.
fn labels() -> Case {
    let mut case = scenes::blobs_analytic();
    let Item::Volume(volume, kernel, _) = &case.scene.items[0] else {
        panic!("{} has a volume", case.name)
    };
    let values = (0..volume.lattice.len()).map(|i| volume.value(i).clamp(0.0, 255.0) as u8);
    let samples = crate::volume::Samples::U8(values.collect());
    let labels = Volume::new(volume.lattice.clone(), samples).expect("a full lattice");
    let labels = labels.with_labels(Vec::new());
    let transfer = TransferFunction::automatic(&labels);
    case.scene = Scene::new().with_volume(labels, kernel.clone(), transfer);
    Case { name: "labels", ..case }
}

/// Blobs in bricks, at a given number of pixels a sample.
fn bricks(pixels: f64) -> Case {
    let mut case = scenes::blobs_analytic();
    let Item::Volume(volume, kernel, transfer) = &case.scene.items[0] else {
        panic!("{} has a volume", case.name)
    };
    // Several levels.
    let mut lattice = volume.lattice.clone();
    lattice.dims = [70, 40, 33];
    let samples = vec![100; lattice.len()];
    let large = Volume::new(lattice, crate::volume::Samples::U8(samples)).expect("a full lattice");
    let bricks = Bricks::from_volume(Arc::new(large)).expect("a volume in bricks");
    case.scene = Scene::new().with_bricks(bricks, kernel.clone(), transfer.clone());
    case.settings.detail = Detail::Pixels(pixels);
    Case { name: "bricks", ..case }
}

/// The settings of a case, and those that differ from them in one point.
fn neighbours(case: &Case) -> Vec<Settings> {
    let base = || case.settings.clone();
    let shade =
        Some(Shade { ambient: 0.1, diffuse: 0.8, specular: 0.1, power: 8.0, certain: None });
    let mut all = vec![
        base(),
        Settings { optics: Optics::EmissionAbsorption, ..base() },
        Settings { optics: Optics::Maximum, ..base() },
        Settings { optics: Optics::XRay, ..base() },
        Settings { gradient: Gradient::Analytic, ..base() },
        Settings { gradient: Gradient::Central, ..base() },
        Settings { occlusion: !case.settings.occlusion, ..base() },
        Settings { volume_shade: Some(None), surface_shade: None, ..base() },
        Settings { volume_shade: Some(shade), surface_shade: shade, ..base() },
        Settings { lighting: Lighting::key(), ..base() },
        Settings { clips: Vec::new(), ..base() },
        Settings { clips: methods::clipped_volume().settings.clips, ..base() },
    ];
    let classifications =
        [Classification::PreIntegrated, Classification::Post, Classification::Pre];
    all.extend(classifications.map(|classification| Settings { classification, ..base() }));
    let [front, back] = [Order::FrontToBack, Order::BackToFront].map(Mode::Splats);
    let modes = [Mode::Sheets, Mode::AxisSheets, front, back];
    all.extend(modes.map(|mode| Settings { mode, ..base() }));
    all
}

/// The cameras of a case: its own, one from afar, and one with parallel rays.
fn cameras(case: &Case) -> [Case; 3] {
    let alike = || Case {
        name: case.name,
        scene: case.scene.clone(),
        camera: case.camera.clone(),
        settings: case.settings.clone(),
    };
    let mut afar = alike();
    let away = afar.camera.position - afar.camera.focal_point;
    afar.camera.position = afar.camera.focal_point + 30.0 * away;
    afar.camera.projection = Projection::Perspective { view_angle: 1.0 };
    [alike(), afar, methods::orthographic(alike())]
}

/// Adds the variants of a case in some settings: on a GPU and in software, gathered and scattered.
/// `is_usual` says whether the settings are the case's own.
fn add(case: &Case, settings: &Settings, is_usual: bool, variants: &mut DistinctVariants) {
    if case.scene.validate_settings(settings).is_err() {
        return;
    }
    let Ok(view) = case.camera.view(settings.size) else { return };
    let bounds = case.scene.bounds();
    let choice = case.scene.choice(&view, settings, settings.detail, usize::MAX, &bounds);
    let sheets = case.scene.sheets_of(&view, settings, choice.as_slice(), &bounds);
    let mut kinds = vec![None];
    if let Ok(volume) = gathered_volume(&case.scene, settings, &sheets) {
        // Settings do not change how samples are read, so one of them is enough for all types.
        let kind = kind_of(volume.samples.scalar());
        kinds.extend(if is_usual { 0..=FOUR } else { kind..=kind }.map(Some));
    }
    let stopping = Budget { tile_entries: Some(500), ..Budget::default() };
    for gathered in kinds {
        for (is_software, budget) in
            [(false, Budget::default()), (true, Budget::default()), (false, stopping)]
        {
            let (scene, view, choice) = (&case.scene, &view, choice.as_ref());
            let shows = |item: &Item| match item {
                Item::Facets(set) => !set.texture_coordinates.is_empty(),
                _ => false,
            };
            let images = scene.items.iter().any(shows);
            variants.add(
                case.name,
                variant(&Request {
                    scene,
                    view,
                    settings,
                    budget,
                    choice,
                    gathered,
                    images,
                    is_software,
                }),
            );
        }
    }
}

/// Variants, each with the scene that it was first found in.
#[derive(Default)]
struct DistinctVariants {
    seen: HashSet<Variant>,
    list: Vec<(&'static str, Variant)>,
}

impl DistinctVariants {
    fn add(&mut self, name: &'static str, variant: Variant) {
        if self.seen.insert(variant) {
            self.list.push((name, variant));
        }
    }
}

/// The variants of all cases, in the settings around their own, each with a scene's name.
pub static ALL: LazyLock<Vec<(&str, Variant)>> = LazyLock::new(|| {
    let mut variants = DistinctVariants::default();
    for case in cases() {
        for case in cameras(&case) {
            for (number, settings) in neighbours(&case).iter().enumerate() {
                add(&case, settings, number == 0, &mut variants);
            }
        }
    }
    variants.list
});

/// Returns the variants of one scene with splats and a volume, gathered and scattered.
pub fn usual() -> Vec<Variant> {
    let case = scenes::surface_in_a_volume();
    let mut variants = DistinctVariants::default();
    add(&case, &case.settings, true, &mut variants);
    variants.list.into_iter().map(|(_, variant)| variant).collect()
}
