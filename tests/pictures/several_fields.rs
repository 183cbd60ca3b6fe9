//! Pictures of several fields: what they have in common with pictures of one, and what is refused.

use crate::{
    scenes::{self, Case, fields},
    testing::{gpu::gpu, psnr::measured},
};
use splatkit::{
    Device, Error, Renderer,
    bricks::Bricks,
    cpu::CpuRenderer,
    math::Kernel,
    picture::Picture,
    reference,
    scene::{Classification, Item, Mode, Optics, Scene, Settings},
    volume::TransferFunction,
};
use std::sync::Arc;

fn drawn(case: &Case) -> Picture {
    let mut renderer = CpuRenderer::new(&case.scene).expect(case.name);
    renderer.render(&case.camera, &case.settings).expect(case.name).0
}

fn referenced(case: &Case) -> Picture {
    reference::render(&case.scene, &case.camera, &case.settings).expect(case.name)
}

/// The same case with other items.
fn of_items(case: &Case, items: Vec<Item>) -> Case {
    let (camera, settings) = (case.camera.clone(), case.settings.clone());
    Case { name: case.name, scene: Scene::from(items), camera, settings }
}

fn largest_difference(a: &Picture, b: &Picture) -> f32 {
    let pairs = a.color.iter().flatten().zip(b.color.iter().flatten());
    pairs.map(|(a, b)| (a - b).abs()).fold(0.0, f32::max)
}

fn hidden() -> TransferFunction {
    TransferFunction { opacity: vec![(0.0, 0.0)], ..TransferFunction::default() }
}

/// Returns a case with one field, of which another item shows nothing, and the case without that
/// item. Both items lie on one lattice, so that the sheets are the same.
fn with_an_invisible_field(case: &Case) -> [Case; 3] {
    let field = case.scene.fields()[0];
    let Item::Volume(volume, kernel, _) = &case.scene.items[field] else {
        panic!("{}: no volume", case.name)
    };
    let invisible = Item::Volume(volume.clone(), kernel.clone(), hidden());
    let items = &case.scene.items;
    let before = std::iter::once(invisible.clone()).chain(items.iter().cloned()).collect();
    let behind = items.iter().cloned().chain([invisible]).collect();
    [of_items(case, items.clone()), of_items(case, before), of_items(case, behind)]
}

#[test]
fn an_invisible_field_changes_nothing() {
    let cases = [scenes::blobs_analytic(), scenes::surface_in_a_volume(), scenes::methods::x_ray()];
    for case in cases {
        let [alone, before, behind] = with_an_invisible_field(&case);
        let (expected, true_picture) = (drawn(&alone), referenced(&alone));
        assert!(expected.color.iter().any(|pixel| pixel[3] > 0.5), "{}", case.name);
        for other in [before, behind] {
            let picture = drawn(&other);
            assert_eq!(picture.color, expected.color, "{}", case.name);
            assert_eq!(picture.depth, expected.depth, "{}", case.name);
            let difference = largest_difference(&referenced(&other), &true_picture);
            assert_eq!(difference, 0.0, "{}", case.name);
        }
    }
}

#[test]
fn the_order_of_the_items_does_not_matter() {
    for case in fields::all() {
        let mut items = case.scene.items.clone();
        items.reverse();
        let reversed = of_items(&case, items);
        let difference = largest_difference(&drawn(&case), &drawn(&reversed));
        assert!(difference <= 1e-6, "{}: {difference:e}", case.name);
    }
}

/// Two media of half the density and the same colour are one medium.
#[test]
fn two_halves_are_one_field() {
    for xray in [false, true] {
        let mut case = scenes::blobs_unshaded();
        if xray {
            case.settings.optics = Optics::XRay;
        }
        let Item::Volume(volume, kernel, transfer) = &case.scene.items[0] else {
            panic!("{}", case.name)
        };
        // The optical depth of a length is inverse to the unit of the opacities.
        let half = TransferFunction { unit: 2.0 * transfer.unit, ..transfer.clone() };
        let half = Item::Volume(volume.clone(), kernel.clone(), half);
        let halves = of_items(&case, vec![half.clone(), half]);
        for (one, two) in [(drawn(&case), drawn(&halves)), (referenced(&case), referenced(&halves))]
        {
            let psnr = measured(&one, &two);
            println!("x-ray {xray}: {psnr:.1} dB");
            // Within a sheet, light falls off in one dense medium faster than in a thin one.
            assert!(psnr > 45.0, "x-ray {xray}: {psnr:.1} dB");
        }
    }
}

#[test]
fn each_field_has_its_own_transfer_function() {
    let case = fields::two_volumes();
    let other = TransferFunction {
        color: vec![(0.0, [0.9, 0.2, 0.2])],
        opacity: vec![(0.3, 0.0), (1.0, 0.8)],
        ..TransferFunction::default()
    };
    let mut renderer = CpuRenderer::new(&case.scene).expect("a scene");
    let render = |renderer: &mut CpuRenderer| {
        renderer.render(&case.camera, &case.settings).expect("a picture").0
    };
    let before = render(&mut renderer);
    renderer.set_transfer(1, &other).expect("the second field");
    let picture = render(&mut renderer);
    let mut items = case.scene.items.clone();
    if let Item::Volume(_, _, transfer) = &mut items[1] {
        transfer.clone_from(&other);
    }
    assert_eq!(picture.color, drawn(&of_items(&case, items)).color);
    assert_ne!(picture.color, before.color);
    assert!(renderer.set_transfer(2, &other).is_err(), "there is no such item");
    let surfels = scenes::ellipsoids_in_perspective();
    let mut renderer = CpuRenderer::new(&surfels.scene).expect("a scene");
    let error = renderer.set_transfer(0, &other).expect_err("surfels have no field");
    assert!(error.to_string().contains("item 0"), "{error}");
}

#[test]
fn sheets_suit_the_finest_field() {
    let case = fields::two_volumes();
    let view = case.camera.view(case.settings.size).expect("a view");
    let thickness = |items: &[Item]| {
        let scene = Scene::from(items.to_vec());
        scene.sheets(&view, &case.settings).step
    };
    let both = thickness(&case.scene.items);
    let [fine, coarse] = [0, 1].map(|item| thickness(&case.scene.items[item..=item]));
    assert!(fine < coarse, "{fine} {coarse}");
    assert!((both / fine - 1.0).abs() < 1e-9, "{both} {fine}");
}

#[test]
fn what_several_fields_cannot_do_is_told() {
    let case = fields::two_volumes();
    assert_eq!(case.scene.fields(), [0, 1]);
    assert_eq!(case.scene.beyond_gpu(), None);
    let bricks = Arc::new(Bricks::from_volume(Arc::new(fields::other_volume())).expect("bricks"));
    let add = |scene: Scene| {
        scene.with_bricks(bricks.clone(), Kernel::default(), TransferFunction::default())
    };
    let one = add(case.scene.clone());
    assert_eq!(one.beyond_gpu(), None);
    assert_eq!(add(one).beyond_gpu().as_deref(), Some("several volumes in bricks"));
    let mut renderer = CpuRenderer::new(&case.scene).expect("a scene");
    let usual = || case.settings.clone();
    let refused = [
        (Settings { classification: Classification::Pre, ..usual() }, "after interpolation"),
        (Settings { mode: Mode::AxisSheets, ..usual() }, "after interpolation"),
    ];
    for (settings, word) in refused {
        let of_engine = renderer.render(&case.camera, &settings).expect_err(word);
        let of_reference = reference::render(&case.scene, &case.camera, &settings).expect_err(word);
        for error in [of_engine, of_reference] {
            assert!(matches!(&error, Error::Argument(text) if text.contains(word)), "{error}");
        }
    }
    let volume = Arc::new(fields::other_volume());
    let of = |count: usize| {
        let add = |scene: Scene, _| {
            scene.with_volume(volume.clone(), Kernel::default(), TransferFunction::default())
        };
        (0..count).fold(Scene::new(), add)
    };
    assert!(of(Scene::MAX_FIELDS).validate().is_ok());
    let error = of(Scene::MAX_FIELDS + 1).validate().expect_err("too many").to_string();
    assert!(error.contains("8 volumes") && error.contains("has 9"), "{error}");
}

/// Channels of a microscope, as its programs show them: the sum of a picture for each.
#[test]
fn the_light_of_maxima_is_added() {
    let mut case = fields::two_volumes();
    case.settings.optics = Optics::Maximum;
    let expected = referenced(&case);
    let alone =
        [0, 1].map(|item| referenced(&of_items(&case, vec![case.scene.items[item].clone()])));
    for (at, pixel) in expected.color.iter().enumerate() {
        let [a, b] = [&alone[0].color[at], &alone[1].color[at]];
        let sum = [0, 1, 2].map(|channel| (a[channel] + b[channel]).min(1.0));
        assert_eq!(pixel[..3], sum);
        assert!((pixel[3] - (a[3] + b[3] - a[3] * b[3])).abs() < 1e-6);
    }
    for device in [Device::Cpu, Device::Gpu(gpu().clone(), Default::default())] {
        let mut renderer = Renderer::new(&device, &case.scene).expect("a scene");
        let render = |renderer: &mut Renderer, settings: &Settings| {
            renderer.render(&case.camera, settings).expect("a picture").0
        };
        let usual = Settings { optics: Optics::EmissionAbsorption, ..case.settings.clone() };
        let before = render(&mut renderer, &usual);
        let psnr = measured(&render(&mut renderer, &case.settings), &expected);
        println!("{}: {psnr:.1} dB", device.name());
        assert!(psnr > 60.0, "{}: {psnr:.1} dB", device.name());
        assert!(render(&mut renderer, &usual).color == before.color, "all fields are back");
    }
}
