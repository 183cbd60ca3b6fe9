use super::*;
use crate::{
    Error,
    math::Bounds,
    splat::{SampleSplats, Splat},
};

/// Evenly distributed numbers in 0 … 1, always the same sequence.
struct Random(u64);

impl Random {
    fn next(&mut self) -> f32 {
        self.0 =
            self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 40) as f32 / (1 << 24) as f32
    }

    fn place(&mut self) -> Vec3 {
        Vec3::new(self.next(), self.next(), self.next())
    }
}

fn points(positions: Vec<Vec3>, value: impl Fn(Vec3) -> f32) -> Points {
    let values = positions.iter().map(|&p| value(p)).collect();
    Points { positions, values, ..Points::default() }
}

fn random(count: usize, value: impl Fn(Vec3) -> f32) -> Points {
    let mut random = Random(1);
    points((0..count).map(|_| random.place()).collect(), value)
}

fn splats(points: &Points) -> SampleSplats {
    points.to_splats(&SampleOptions::default()).unwrap()
}

/// The weighted kernel sum and the normalised sum at a position, over all splats.
fn field(set: &SampleSplats, at: Vec3) -> (f64, f64) {
    let (mut sum, mut values) = (0.0, 0.0);
    for splat in &set.splats {
        let d = (at - Vec3::from(splat.center)).as_dvec3();
        let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
        let x = d.x / b00;
        let y = (d.y - b10 * x) / b11;
        let x = DVec3::new(x, y, (d.z - b20 * x - b21 * y) / b22);
        if x.length() <= f64::from(set.extent) {
            let (weight, slope) = splat.weight_and_slope();
            let kernel = f64::from(weight) * (-0.5 * x.length_squared()).exp();
            sum += kernel;
            values += kernel * (f64::from(splat.strength) + slope.as_dvec3().dot(x));
        }
    }
    (sum, values / sum)
}

fn deviation(set: &SampleSplats, index: usize) -> f32 {
    let [b00, b10, b11, b20, b21, b22] = set.splats[index].factor;
    assert_eq!((b00, b10, b20, b21, b22), (b11, 0.0, 0.0, 0.0, b00), "round");
    b00
}

#[test]
fn kernels_follow_the_room_between_samples() {
    let grid = |n: [usize; 3]| {
        let place = |i: usize| {
            Vec3::new((i % n[0]) as f32, (i / n[0] % n[1]) as f32, (i / n[0] / n[1]) as f32) * 10.0
        };
        splats(&points((0..n[0] * n[1] * n[2]).map(place).collect(), |_| 1.0))
    };
    // 16 neighbours: the farthest is √2 steps away in space, √5 in a plane, 8 on a line.
    for (n, middle, spacing) in [
        ([9, 9, 9], 364, 10.0 * 2f64.sqrt() * (4.0 / 3.0 * std::f64::consts::PI / 16.0).cbrt()),
        ([9, 9, 1], 40, 10.0 * 5f64.sqrt() * (std::f64::consts::PI / 16.0).sqrt()),
        ([33, 1, 1], 16, 10.0),
    ] {
        let set = grid(n);
        assert!((f64::from(deviation(&set, middle)) - 0.7 * spacing).abs() < 1e-4, "{n:?}");
        assert!((0.8..1.01).contains(&(spacing / 10.0)), "about a step: {spacing}");
        assert!(set.splats.iter().all(|splat| splat.weight_and_slope() == (1.0, Vec3::ZERO)));
        assert_eq!(set.extent, 3.0);
    }
}

/// Random samples leave no hole between them, at 1,000 positions.
#[test]
fn no_place_inside_is_left_out() {
    let set = splats(&random(8000, |_| 1.0));
    let mut random = Random(2);
    let sums: Vec<f64> = (0..1000).map(|_| field(&set, random.place()).0).collect();
    let least = sums.iter().copied().fold(f64::INFINITY, f64::min);
    assert!(least > 0.5, "{least}");
    let mean = sums.iter().sum::<f64>() / sums.len() as f64;
    // (2π)^1.5 · 0.7³ = 5.4, plus each sample's own kernel when measured at the samples.
    assert!(
        (5.0..6.5).contains(&mean) && (f64::from(set.overlap) - mean).abs() < 1.5,
        "{mean} {}",
        set.overlap
    );
}

/// A linear field is reproduced, at the border and beyond it too. The remaining error comes from
/// rounding slopes to 2⁻¹² of their largest component: over the extent of the widest kernel here,
/// at a corner, 2⁻¹² · 3 · 0.45.
#[test]
fn linear_fields_are_exact() {
    let truth = |p: Vec3| 3.0 + 2.0 * p.x - 5.0 * p.y + 0.5 * p.z;
    let mut samples = random(4000, truth);
    samples.origin = DVec3::splat(1e7);
    let worst = |samples: &Points, options: &SampleOptions| {
        let set = samples.to_splats(options).unwrap();
        let mut random = Random(3);
        let places = (0..500).map(|_| random.place() * 1.02 - 0.01);
        places.map(|at| (field(&set, at).1 - f64::from(truth(at))).abs()).fold(0.0, f64::max)
    };
    let adapted = worst(&samples, &SampleOptions::default());
    assert!(adapted < 4e-4, "{adapted}");
    let flat = worst(&samples, &SampleOptions { slopes: false, ..SampleOptions::default() });
    assert!(flat > 0.1, "without slopes the border is far off: {flat}");
    samples.radii = vec![0.1; samples.len()];
    let given = worst(&samples, &SampleOptions::default());
    assert!(given < 4e-4, "{given}");
    samples.covariances = vec![[4e-3, 1e-3, 0.0, 2e-3, -5e-4, 1e-3]; samples.len()];
    let slanted = worst(&samples, &SampleOptions::default());
    assert!(slanted < 4e-4, "{slanted}");
}

/// One half has eight times the density of samples. A linear field across the border between them
/// does not show it.
#[test]
fn the_density_of_samples_does_not_show() {
    let mut positions = Vec::new();
    let mut random = Random(4);
    while positions.len() < 9000 {
        let at = random.place();
        if at.x < 0.5 || random.next() < 0.125 {
            positions.push(at);
        }
    }
    let truth = |p: Vec3| 4.0 * p.x + p.y;
    let mut samples = points(positions, truth);
    // Mean and largest error in the layer around the border.
    let error = |set: &SampleSplats| {
        let mut random = Random(5);
        let places =
            (0..400).map(|_| random.place() * Vec3::new(0.1, 0.6, 0.6) + Vec3::new(0.45, 0.2, 0.2));
        let errors: Vec<f64> = places.map(|at| field(set, at).1 - f64::from(truth(at))).collect();
        (
            errors.iter().sum::<f64>() / 400.0,
            errors.iter().fold(0.0f64, |most, error| most.max(error.abs())),
        )
    };
    let (shift, most) = error(&splats(&samples));
    assert!(shift.abs() < 2e-5 && most < 3e-4, "{shift} {most}");
    // Kernels of one size, without slopes: only the weights keep the dense side from pulling the
    // mean towards its own values.
    samples.radii = vec![0.15; samples.len()];
    let mut set =
        samples.to_splats(&SampleOptions { slopes: false, ..SampleOptions::default() }).unwrap();
    let mean_weight = |dense: bool| {
        let of_side = set.splats.iter().filter(|splat| (splat.center[0] < 0.5) == dense);
        let weights: Vec<f32> = of_side.map(|splat| splat.weight_and_slope().0).collect();
        weights.iter().sum::<f32>() / weights.len() as f32
    };
    let ratio = mean_weight(false) / mean_weight(true);
    assert!((6.0..10.0).contains(&ratio), "{ratio}");
    let (weighted, _) = error(&set);
    for splat in &mut set.splats {
        *splat = Splat::sample(splat.center.into(), splat.strength, splat.factor, 1.0, Vec3::ZERO);
    }
    let (pulled, _) = error(&set);
    assert!(weighted.abs() < 0.04 && pulled < -0.15, "{weighted} {pulled}");
}

#[test]
fn coincident_samples_give_their_mean_and_no_trouble() {
    let mut samples = random(500, |_| 2.0);
    for value in [0.0, 10.0] {
        samples.positions.extend([Vec3::splat(0.5); 2000]);
        samples.values.extend([value; 2000]);
    }
    let set = splats(&samples);
    assert_eq!(set.splats.len(), 4500);
    let of_many: f32 = set.splats[500..].iter().map(|splat| splat.weight_and_slope().0).sum();
    let of_one = set.splats[0].weight_and_slope().0;
    assert!((of_many / of_one - 1.0).abs() < 0.01, "{of_many} {of_one}");
    let pair = points(vec![Vec3::ONE; 2], |_| 0.0);
    let set = splats(&Points { values: vec![1.0, 4.0], ..pair });
    assert_eq!((field(&set, Vec3::splat(1.2)).1, deviation(&set, 0)), (2.5, 0.5));
}

#[test]
fn few_samples_and_flat_ones_are_fine() {
    let one = splats(&points(vec![Vec3::X], |_| 7.0));
    assert_eq!(
        (deviation(&one, 0), one.splats[0].weight_and_slope(), one.overlap),
        (0.5, (1.0, Vec3::ZERO), 1.0)
    );
    let given = SampleOptions { radius: Some(3.0), ..SampleOptions::default() };
    let one = points(vec![Vec3::X], |_| 7.0).to_splats(&given).unwrap();
    assert_eq!((deviation(&one, 0), one.splats[0].weight_and_slope().0), (1.5, 1.0));
    // Two samples 1 apart.
    let two = splats(&points(vec![Vec3::ZERO, Vec3::X], |p| p.x));
    assert!((deviation(&two, 0) - 0.7).abs() < 1e-6);
    assert!((field(&two, Vec3::X * 0.25).1 - 0.25).abs() < 1e-3);
    // A slanted plane, and a slanted line: linear in them, constant across.
    for flat in [DVec3::new(1.0, 1.0, 0.0), DVec3::ZERO] {
        let mut random = Random(6);
        let along = DVec3::new(1.0, -1.0, 0.5);
        let mut place = || along * f64::from(random.next()) + flat * f64::from(random.next());
        let samples = points((0..400).map(|_| place().as_vec3()).collect(), |p| p.x);
        let set = splats(&samples);
        let at = (along * 0.4 + flat * 0.3).as_vec3();
        assert!((field(&set, at).1 - f64::from(at.x)).abs() < 1e-3);
        let slope = set.splats[7].weight_and_slope().1;
        assert!(slope.length() > 0.0);
        let across = if flat == DVec3::ZERO {
            Vec3::new(1.0, 1.0, 0.0)
        } else {
            Vec3::new(0.25, -0.25, -1.0)
        };
        assert!(slope.dot(across).abs() < 1e-3 * slope.length(), "{slope}");
    }
}

/// A step stays near its values, because its gradient is limited.
#[test]
fn steps_overshoot_little() {
    let set = splats(&random(4000, |p| if p.x > 0.5 { 1.0 } else { 0.0 }));
    let mut random = Random(7);
    let extremes = (0..1000)
        .map(|_| field(&set, random.place() * 0.9 + 0.05).1)
        .fold([0.0f64; 2], |[low, high], value| [low.min(value), high.max(value)]);
    assert!(extremes[0] > -0.25 && extremes[1] < 1.25, "{extremes:?}");
}

#[test]
fn radii_of_any_ratio_are_no_trouble() {
    let mut samples = random(100_000, |p| p.x);
    samples.radii = (0..100_000).map(|i| 1e-4 * 10f32.powf((i % 1001) as f32 / 250.0)).collect();
    let set = splats(&samples);
    assert!(set.overlap.is_finite() && set.overlap > 0.0);
    let weights = || set.splats.iter().map(|splat| splat.weight_and_slope().0);
    assert!(weights().all(|weight| (9.9e-5..=6.01e4).contains(&weight)));
    assert!(weights().any(|weight| weight > 5e4) && weights().any(|weight| weight < 2e-4));
    assert!(set.splats.iter().all(|splat| splat.weight_and_slope().1.is_finite()));
}

#[test]
fn covariances_become_factors() {
    let terms = [4.0, 1.0, -2.0, 3.0, 0.5, 6.0];
    let samples =
        Points { covariances: vec![terms; 2], ..points(vec![Vec3::ZERO, Vec3::X], |p| p.x) };
    let [b00, b10, b11, b20, b21, b22] = splats(&samples).splats[0].factor;
    let products = [
        b00 * b00,
        b00 * b10,
        b00 * b20,
        b10 * b10 + b11 * b11,
        b10 * b20 + b11 * b21,
        b20 * b20 + b21 * b21 + b22 * b22,
    ];
    assert!(products.iter().zip(terms).all(|(a, b)| (a - b).abs() < 1e-5), "{products:?}");
    // A radius in the options takes precedence.
    let round = samples
        .to_splats(&SampleOptions { radius: Some(1.0), ..SampleOptions::default() })
        .unwrap();
    assert_eq!(deviation(&round, 0), 0.5);
}

/// The field is the same in any unit of values, and with large values alone.
#[test]
fn slopes_of_any_unit_are_no_trouble() {
    let places = |set: &SampleSplats| {
        let mut random = Random(9);
        (0..50).map(|_| field(set, random.place()).1).collect::<Vec<f64>>()
    };
    let expected = places(&splats(&random(100, |p| p.x)));
    for unit in [1e-30, 1e-12, 1e8, 1e12, 1e30] {
        let scaled = places(&splats(&random(100, |p| unit * p.x)));
        for (actual, expected) in scaled.iter().zip(&expected) {
            assert!(
                (actual / f64::from(unit) - expected).abs() < 1e-3,
                "{unit}: {actual} {expected}"
            );
        }
    }
    let set = splats(&random(100, |p| 1e6 + p.x));
    assert!((field(&set, Vec3::splat(0.5)).1 - 1e6 - 0.5).abs() < 0.1);
}

#[test]
fn what_is_wrong_is_told() {
    let good = random(3, |p| p.x);
    let identity = [1.0, 0.0, 0.0, 1.0, 0.0, 1.0];
    for (bad, word) in [
        (Points::default(), "no samples"),
        (Points { values: vec![1.0], ..good.clone() }, "1 values for 3 positions"),
        (Points { radii: vec![1.0; 2], ..good.clone() }, "2 radii for 3 positions"),
        (Points { radii: vec![1.0, 0.0, 1.0], ..good.clone() }, "radius of sample 1 is 0"),
        (Points { radii: vec![1.0, 1.0, f32::NAN], ..good.clone() }, "radius of sample 2 is NaN"),
        (Points { values: vec![1.0, f32::NAN, 1.0], ..good.clone() }, "value of sample 1 is NaN"),
        (Points { positions: vec![Vec3::INFINITY; 3], ..good.clone() }, "position"),
        (Points { origin: DVec3::NAN, ..good.clone() }, "origin"),
        (
            Points {
                covariances: vec![identity, [1.0, 1.0, 0.0, 1.0, 0.0, 1.0], identity],
                ..good.clone()
            },
            "sample 1 is not",
        ),
        (
            Points { covariances: vec![[f32::NAN; 6]; 3], ..good.clone() },
            "sample 0 is not positive definite",
        ),
    ] {
        let message = match bad.to_splats(&SampleOptions::default()) {
            Err(Error::Argument(message)) => message,
            other => panic!("{word}: {other:?}"),
        };
        assert!(message.contains(word), "{message}");
    }
    for (options, word) in [
        (SampleOptions { neighbours: 3, ..SampleOptions::default() }, "4 to 64"),
        (SampleOptions { radius: Some(0.0), ..SampleOptions::default() }, "radius above 0"),
        (SampleOptions { deviations: f64::NAN, ..SampleOptions::default() }, "deviations above 0"),
    ] {
        assert!(good.to_splats(&options).unwrap_err().to_string().contains(word), "{word}");
    }
}

#[test]
fn ranges_bounds_and_histograms() {
    let samples = Points {
        origin: DVec3::X,
        values: vec![-4.0, 0.0, 4.0],
        ..points(vec![Vec3::ZERO, Vec3::X, Vec3::new(-1.0, 2.0, 0.0)], |p| p.x)
    };
    assert_eq!((samples.range(), samples.histogram(4).unwrap()), ([-4.0, 4.0], vec![1, 0, 1, 1]));
    assert!(matches!(samples.histogram(usize::MAX), Err(crate::Error::Argument(_))));
    let bounds = Bounds { min: DVec3::ZERO, max: DVec3::new(2.0, 2.0, 0.0) };
    assert_eq!(samples.bounds(), bounds);
    let transfer = samples.automatic_transfer();
    transfer.validate().unwrap();
    assert!(!transfer.visible([-4.0, -4.0]) && transfer.visible([4.0, 4.0]));
}

/// Timings for the documentation.
#[test]
#[ignore = "takes seconds, measures only"]
fn a_million_samples() {
    let samples = random(1_000_000, |p| p.x);
    let start = std::time::Instant::now();
    let set = splats(&samples);
    println!("{} splats in {:?}", set.splats.len(), start.elapsed());
}

#[test]
fn neighbours_keep_to_the_deadline() {
    let options = SampleOptions { deadline: crate::Deadline::after(0), ..SampleOptions::default() };
    let error = random(100, |_| 1.0).to_splats(&options).unwrap_err().to_string();
    assert_eq!(error, "finding the neighbours of samples takes longer than the limit of 0 s");
}
