use super::*;
use crate::{
    about::Modality,
    volume::{Lattice, Samples, phantoms::Phantom},
};
use glam::DVec3;

const SIDE: usize = 40;

/// A volume of values at places from −1 to 1, with whole values of 16 bits.
fn volume(value: impl Fn(DVec3) -> f64) -> Volume {
    let values = places().map(|at| value(at).round() as i16).collect();
    Volume::new(lattice(), Samples::I16(values)).unwrap()
}

/// The same with floats.
fn floats(value: impl Fn(DVec3) -> f64) -> Volume {
    Volume::new(lattice(), Samples::F32(places().map(|at| value(at) as f32).collect())).unwrap()
}

fn lattice() -> Lattice {
    Lattice::with_spacing([SIDE; 3], DVec3::splat(0.5))
}

fn places() -> impl Iterator<Item = DVec3> {
    (0..SIDE.pow(3)).map(|i| {
        let index = [i % SIDE, i / SIDE % SIDE, i / SIDE / SIDE];
        DVec3::from_array(index.map(|n| n as f64 / (SIDE - 1) as f64 * 2.0 - 1.0))
    })
}

/// Noise of standard deviation 1, the same in every run: a sum of evenly distributed numbers.
fn noise(at: DVec3) -> f64 {
    let mut state = (at.x * 1e3).to_bits()
        ^ (at.y * 1e6).to_bits().rotate_left(21)
        ^ (at.z * 1e9).to_bits().rotate_left(42);
    let mut next = || {
        state = state.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = state;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        ((z ^ (z >> 31)) >> 40) as f64 / f64::from(1u32 << 24)
    };
    (0..12).map(|_| next()).sum::<f64>() - 6.0
}

/// A core inside a shell, over a border of a sample each, in a background.
fn nested([background, shell, core]: [f64; 3], noisy: f64) -> impl Fn(DVec3) -> f64 {
    move |at| {
        let step = |radius: f64| ((radius - at.length()) * 20.0 + 0.5).clamp(0.0, 1.0);
        background
            + (shell - background) * step(0.8)
            + (core - shell) * step(0.4)
            + noisy * noise(at)
    }
}

/// The largest opacity within three deviations of a noisy value.
fn seen(transfer: &TransferFunction, value: f64, noisy: f64) -> f64 {
    (-30..=30).map(|i| transfer.opacity(value + noisy * f64::from(i) / 10.0)).fold(0.0, f64::max)
}

#[test]
fn the_background_is_clear_on_either_side() {
    for values in [[20.0, 200.0, 200.0], [200.0, 20.0, 20.0], [100.0, 120.0, 120.0]] {
        let transfer = TransferFunction::automatic(&volume(nested(values, 2.0)));
        transfer.validate().unwrap();
        assert_eq!(seen(&transfer, values[0], 2.0), 0.0, "{values:?}: {transfer:?}");
        assert!(transfer.opacity(values[2]) > 0.5, "{values:?}: {transfer:?}");
    }
}

/// The shell shows at its border only, and lets the solid core be seen. Both differ in colour.
#[test]
fn what_is_inside_shows() {
    for values in [[0.0, 300.0, 800.0], [2000.0, 1500.0, 900.0]] {
        let transfer = TransferFunction::automatic(&volume(nested(values, 8.0)));
        let [background, shell, core] = values;
        assert_eq!(seen(&transfer, background, 8.0), 0.0, "{transfer:?}");
        assert_eq!(seen(&transfer, shell, 8.0), 0.0, "{transfer:?}");
        assert!(transfer.opacity(core) > 0.5, "{transfer:?}");
        let border = background + 0.4 * (shell - background);
        let film = transfer.opacity(border);
        assert!(film > 0.02 && film < 0.5 * transfer.opacity(core), "{film}: {transfer:?}");
        let apart: f64 =
            (0..3).map(|i| (transfer.color(border)[i] - transfer.color(core)[i]).powi(2)).sum();
        assert!(apart.sqrt() > 0.2, "{transfer:?}");
    }
}

/// Light counts from gradients on that the noise does not have.
#[test]
fn light_begins_beyond_the_noise() {
    let certain = |noisy: f64| {
        let transfer = TransferFunction::automatic(&volume(nested([0.0, 300.0, 800.0], noisy)));
        transfer.shade.unwrap().certain.unwrap()
    };
    let [low, high] = certain(10.0);
    // 0.7 and 2.5 deviations over half a unit.
    assert!((low / 14.0 - 1.0).abs() < 0.15 && (high / 50.0 - 1.0).abs() < 0.15, "{low} {high}");
    let (more, none) = (certain(20.0)[0], certain(0.0)[0]);
    assert!(more > 1.7 * low && none < 0.2 * low, "{more} {none}");
}

/// Sides of the background differ in hue: blue below, red above.
#[test]
fn fields_of_both_signs_have_two_hues() {
    let dipole = |at: DVec3| {
        let bump = |x: f64| (-8.0 * (at - DVec3::X * x).length_squared()).exp();
        3e-9 * (bump(0.4) - bump(-0.4))
    };
    let transfer = TransferFunction::automatic(&floats(dipole));
    let [low, high] = [transfer.color(-2e-9), transfer.color(2e-9)];
    assert!(low[2] > low[0] && high[0] > high[2], "{transfer:?}");
    assert!(transfer.opacity(-2e-9) > 0.01 && transfer.opacity(2e-9) > 0.01, "{transfer:?}");
    assert_eq!(transfer.opacity(0.0), 0.0);
}

#[test]
fn labels_have_colours_and_masks_are_solid() {
    let octant = |at: DVec3| {
        1.0 + f64::from(u8::from(at.z > 0.0) + 2 * u8::from(at.y > 0.0) + 4 * u8::from(at.x > 0.0))
    };
    let label = |at: DVec3| if at.length() < 0.7 { octant(at) } else { 0.0 };
    let transfer = TransferFunction::automatic(&volume(label));
    let colors: Vec<[f64; 3]> = (1..=8).map(|n| transfer.color(f64::from(n))).collect();
    for (n, color) in colors.iter().enumerate() {
        assert!(transfer.opacity(n as f64 + 1.0) > 0.5, "{n}: {transfer:?}");
        assert!(colors[..n].iter().all(|other| other != color), "{n}: {transfer:?}");
    }
    assert_eq!(transfer.opacity(0.0), 0.0);
    for (inside, outside) in [(1.0, 0.0), (0.0, 255.0)] {
        let mask = volume(|at: DVec3| if at.length() < 0.6 { inside } else { outside });
        let transfer = TransferFunction::automatic(&mask);
        assert!(transfer.opacity(inside) > 0.5 && transfer.opacity(outside) == 0.0);
    }
}

/// Values that a broken sensor has do not change what is made of the others.
#[test]
fn outliers_change_little() {
    let of = |outlier: f64| {
        let inside = nested([0.0, 300.0, 800.0], 8.0);
        let broken = |at: DVec3| (at - DVec3::new(0.33, 0.31, 0.37)).length() < 0.03;
        TransferFunction::automatic(&floats(|at| if broken(at) { outlier } else { inside(at) }))
    };
    let usual = of(800.0);
    for outlier in [32e3, 1e9, -1e9] {
        let transfer = of(outlier);
        transfer.validate().unwrap();
        for value in [0.0, 120.0, 300.0, 550.0, 800.0] {
            let (a, b) = (transfer.opacity(value), usual.opacity(value));
            assert!((a - b).abs() < 0.1, "{outlier} at {value}: {a} {b}");
        }
        // What cannot be told apart beside the outliers cannot be drawn.
        let [low, high] = transfer.span();
        assert!(high - low > 2e-6 * outlier.abs());
    }
}

/// The same function for any unit and zero of the values, and any unit of length.
#[test]
fn units_change_nothing() {
    let of = |unit: f64, zero: f64, length: f64| {
        let inside = nested([0.0, 300.0, 800.0], 8.0);
        let mut volume = floats(|at| zero + unit * inside(at));
        volume.lattice.axes *= length;
        TransferFunction::automatic(&volume)
    };
    let usual = of(1.0, 0.0, 1.0);
    for (unit, zero, length) in
        [(1e12, 0.0, 1.0), (1e-12, 0.0, 1.0), (1.0, 1e5, 1.0), (1.0, 0.0, 1e-6), (1.0, 0.0, 1e6)]
    {
        let transfer = of(unit, zero, length);
        assert!((transfer.unit / usual.unit / length - 1.0).abs() < 1e-6);
        for i in 0..=80 {
            let value = f64::from(i) * 10.0;
            let (a, b) = (transfer.opacity(zero + unit * value), usual.opacity(value));
            assert!((a - b).abs() < 0.02, "{unit} {zero} {length} at {value}: {a} {b}");
        }
        let certain = |t: &TransferFunction| t.shade.unwrap().certain.unwrap()[0];
        assert!((certain(&transfer) * length / unit / certain(&usual) - 1.0).abs() < 0.02);
    }
}

/// Skin is a shell, bone is solid, and air is clear, whether or not the file says what it holds.
#[test]
fn hounsfield_units_show_skin_and_bone() {
    for modality in [None, Some(Modality::Ct)] {
        let mut head = Phantom::Head.sample([64; 3]).unwrap();
        head.about.modality = modality;
        let transfer = TransferFunction::automatic(&head);
        assert_eq!((transfer.opacity(-1000.0), transfer.opacity(40.0)), (0.0, 0.0));
        let (skin, bone) = (transfer.opacity(-350.0), transfer.opacity(900.0));
        assert!(skin > 0.01 && bone > 0.6 && skin < bone, "{transfer:?}");
    }
    let mut head = Phantom::Head.sample([32; 3]).unwrap();
    head.about.modality = Some(Modality::Emission);
    let transfer = TransferFunction::automatic(&head);
    assert_eq!(transfer.shade, None, "what emits light is not lit");
}

/// A coil that is more sensitive on one side, noise as magnitudes have it, and a few bright samples
/// change the values that stand out little.
#[test]
fn what_stands_out_is_robust() {
    let body = nested([0.0, 500.0, 500.0], 0.0);
    let magnitude = |bias: f64| {
        let body = &body;
        volume(move |at: DVec3| {
            let signal = body(at) * (1.0 + bias * at.x) + 15.0 * noise(at);
            signal.hypot(15.0 * noise(at + 7.0))
        })
    };
    let [low, high] = magnitude(0.0).foreground();
    assert!((40.0..250.0).contains(&low) && (480.0..600.0).contains(&high), "{low} {high}");
    let mut bright = magnitude(0.0);
    if let Samples::I16(values) = &mut bright.samples {
        values[SIDE * SIDE * SIDE / 2] = 20_000;
    }
    bright.range[1] = 20_000.0;
    assert!(bright.foreground()[1] < 700.0, "{:?}", bright.foreground());
    let biased = magnitude(0.4).foreground();
    assert!((40.0..250.0).contains(&biased[0]) && biased[1] < 800.0, "{biased:?}");
    let flat = volume(|_| 3.0);
    assert_eq!(flat.foreground(), [3.0; 2]);
}

#[test]
fn a_window_limits_the_values() {
    let mut windowed = floats(|at| 1000.0 * (1.0 - at.length()).max(0.0).powi(2) + noise(at));
    let usual = TransferFunction::automatic(&windowed);
    windowed.about.window = Some([100.0, 300.0]);
    let transfer = TransferFunction::automatic(&windowed);
    assert!(transfer.span()[1] <= 301.0 && usual.span()[1] > 400.0, "{transfer:?} {usual:?}");
    // A window beside the values says nothing.
    windowed.about.window = Some([5000.0, 6000.0]);
    assert_eq!(TransferFunction::automatic(&windowed), usual);
}

#[test]
fn every_field_gets_a_valid_function() {
    for (dims, values) in [
        ([3, 3, 3], vec![-5i16; 27]),
        ([1, 1, 1], vec![-5]),
        ([2, 1, 1], vec![0, 1]),
        ([5, 1, 1], vec![0, 100, 200, 300, 32_000]),
    ] {
        let lattice = Lattice::with_spacing(dims, DVec3::ONE);
        let volume = Volume::new(lattice, Samples::I16(values)).unwrap();
        let transfer = TransferFunction::automatic(&volume);
        transfer.validate().unwrap();
        assert!(transfer.visible(volume.range));
    }
    for phantom in Phantom::NAMES.iter().filter_map(|name| Phantom::named(name)) {
        for modality in [
            None,
            Some(Modality::Ct),
            Some(Modality::Mr),
            Some(Modality::Emission),
            Some(Modality::Ultrasound),
            Some(Modality::Microscopy),
        ] {
            let mut volume = phantom.sample([24; 3]).unwrap();
            volume.about.modality = modality;
            let transfer = TransferFunction::automatic(&volume);
            transfer.validate().unwrap();
            assert!(transfer.visible(volume.range), "{phantom:?} {modality:?}");
        }
    }
    TransferFunction::automatic(&floats(noise)).validate().unwrap();
    let none = TransferFunction::of_values(&[], 1.0, &About::default());
    none.validate().unwrap();
    let holes = TransferFunction::of_values(&[f32::NAN, 1.0, 2.0, 3.0], 1.0, &About::default());
    assert!(holes.visible([1.0, 3.0]));
}

#[test]
fn a_single_slice_is_a_picture() {
    let lattice = Lattice::with_spacing([3, 2, 1], DVec3::new(1.0, 1.0, 5.0));
    let samples = Samples::I16(vec![-1000, -20, 0, 40, 80, 1000]);
    let mut volume = Volume::new(lattice, samples).unwrap();
    let grey = |volume: &Volume| TransferFunction::automatic(volume).color(0.0);
    assert_eq!(grey(&volume), [0.5; 3]);
    volume.about.window = Some([-100.0, 300.0]);
    assert_eq!(grey(&volume), [0.25; 3]);
    // A window beside the values is not that of these values.
    volume.about.window = Some([2000.0, 3000.0]);
    assert_eq!(grey(&volume), [0.5; 3]);
    let transfer = TransferFunction::automatic(&volume);
    assert!(transfer.shade.is_none() && transfer.opacity(-1000.0) == 1.0);
    assert_eq!(transfer.unit, 0.5);
}
