//! Sharp volumes pass through their samples, hold what Marschner and Lobb's signal has, and keep inside their ranges.

use glam::{DMat3, DVec3};
use splatkit::{
    math::Kernel,
    volume::{Lattice, Reconstruction, Samples, Volume, body_centred, phantoms::Phantom},
};

/// A small generator of random numbers in 0 … 1 (Marsaglia's xorshift, 2003).
struct Random(u64);

impl Random {
    fn next(&mut self) -> f64 {
        self.0 ^= self.0 << 13;
        self.0 ^= self.0 >> 7;
        self.0 ^= self.0 << 17;
        (self.0 >> 11) as f64 / (1u64 << 53) as f64
    }

    fn place(&mut self) -> DVec3 {
        DVec3::new(self.next(), self.next(), self.next())
    }
}

fn kernels() -> Vec<Kernel> {
    vec![
        Kernel::default(),
        Kernel::gaussian(0.7, 3.0).unwrap(),
        Kernel::gaussian(0.5, 2.3).unwrap(),
        Kernel::b_spline(2.0).unwrap(),
    ]
}

/// Cartesian and body-centred, of unequal and sheared axes, thin and long.
fn lattices() -> Vec<Lattice> {
    let sheared = DMat3::from_cols(DVec3::new(0.3, 0.1, 0.0), DVec3::new(0.0, 2.0, -0.4), DVec3::new(0.2, 0.0, 1.1));
    let origin = DVec3::new(-5.0, 7.0, 0.5);
    vec![
        Lattice::with_spacing([9, 8, 7], DVec3::ONE),
        Lattice::cartesian([5, 11, 6], origin, sheared),
        Lattice::cartesian([13, 1, 2], origin, sheared),
        Lattice::cartesian([1, 1, 1], origin, sheared),
        Lattice::body_centred([5, 6, 9], DVec3::ZERO, DMat3::IDENTITY),
        Lattice::body_centred([4, 7, 8], origin, sheared),
        Lattice::body_centred([1, 3, 2], origin, sheared),
    ]
}

fn noise(lattice: Lattice, random: &mut Random) -> Volume {
    let values = (0..lattice.len()).map(|_| (100.0 + 20.0 * random.next()) as f32).collect();
    Volume::new(lattice, Samples::F32(values)).unwrap()
}

#[test]
fn sharp_volumes_pass_through_their_samples() {
    let mut random = Random(5);
    for kernel in kernels() {
        for lattice in lattices() {
            let volume = noise(lattice, &mut random).sharpened(&kernel).unwrap();
            let field = Reconstruction::new(&volume, &kernel).unwrap();
            let range = (volume.range[1] - volume.range[0]).max(1.0);
            for sample in 0..volume.len() {
                let found = field.value_at(volume.lattice.sample_position(sample)).unwrap();
                let error = (found - volume.value(sample)).abs() / range;
                assert!(error < 1e-4, "{kernel:?} on {:?}: sample {sample} is off by {error:e}", volume.lattice);
            }
        }
    }
}

/// The reconstruction at places all around each sample lies in the range that stands for it.
#[test]
fn ranges_hold_what_is_reconstructed() {
    let mut random = Random(11);
    let edges = |lattice: &Lattice, random: &mut Random| {
        // Plateaus with single outliers: the worst that ringing can do to a range.
        let values = (0..lattice.len()).map(|_| if random.next() < 0.03 { 255 } else { 0 }).collect();
        Volume::new(lattice.clone(), Samples::U8(values)).unwrap()
    };
    let mut tightest = f64::INFINITY;
    for kernel in kernels() {
        for dims in [[16, 15, 14], [7, 30, 3]] {
            for lattice in [
                Lattice::with_spacing(dims, DVec3::new(1.0, 2.0, 0.5)),
                Lattice::body_centred(dims, DVec3::ZERO, DMat3::IDENTITY),
            ] {
                for volume in [noise(lattice.clone(), &mut random), edges(&lattice, &mut random)] {
                    let volume = volume.sharpened(&kernel).unwrap();
                    let field = Reconstruction::new(&volume, &kernel).unwrap();
                    let coefficients = volume.coefficients.clone().unwrap();
                    let [low, high] = volume.range;
                    let unit = coefficients.lattice.axes * DMat3::from_diagonal(coefficients.lattice.unit([0; 3]));
                    for (sample, range) in coefficients.ranges.iter().enumerate() {
                        for _ in 0..4 {
                            let offset = kernel.extent * (2.0 * random.place() - 1.0);
                            let position = coefficients.lattice.sample_position(sample) + unit * offset;
                            // Splats are drawn around the volume; beyond it, sums are not whole.
                            let steps = volume.lattice.axes.inverse() * (position - volume.lattice.origin);
                            let [first, last] = volume.lattice.step_range();
                            if offset.length() > kernel.extent || steps.clamp(first, last) != steps {
                                continue;
                            }
                            let value = field.value_at(position).unwrap();
                            let step = ((value - low) / (high - low) * 255.0).clamp(0.0, 255.0);
                            let inside = step - f64::from(range[0]) > -0.01 && f64::from(range[1]) - step > -0.01;
                            assert!(inside, "{kernel:?}, {dims:?}: {step} outside {range:?} of sample {sample}");
                            if range[1] < 255 {
                                tightest = tightest.min(f64::from(range[1]) - step);
                            }
                        }
                    }
                }
            }
        }
    }
    println!("the tightest range leaves {tightest:.2} of 255 steps");
}

/// Root mean square error ×100 of a field against the signal, at random places of the cube, some spacings inside.
fn error(field: impl Fn(DVec3) -> f64) -> f64 {
    let mut random = Random(3);
    let count = 60_000;
    let squares = (0..count).map(|_| {
        let place = (2.0 * random.place() - 1.0) * 0.9;
        (field(place) - Phantom::MarschnerLobb.value(place)).powi(2)
    });
    100.0 * (squares.sum::<f64>() / f64::from(count)).sqrt()
}

fn reconstructed(volume: &Volume, kernel: &Kernel) -> f64 {
    let field = Reconstruction::new(volume, kernel).unwrap();
    error(|place| field.value_at(place).unwrap())
}

fn sharp(volume: Volume, kernel: &Kernel) -> f64 {
    reconstructed(&volume.sharpened(kernel).unwrap(), kernel)
}

fn signal(samples: usize) -> Volume {
    Phantom::MarschnerLobb.sample([samples; 3]).unwrap()
}

/// The same from the middle of the first of `samples` cells along each axis to that of the last.
fn in_cells(samples: usize) -> Volume {
    let step = 2.0 / samples as f64;
    let lattice =
        Lattice::cartesian([samples; 3], DVec3::splat(0.5 * step - 1.0), DMat3::from_diagonal(DVec3::splat(step)));
    Phantom::MarschnerLobb.sample_on(lattice).unwrap()
}

/// The signal on a body-centred lattice of the unit of `samples` Cartesian ones, reaching beyond the cube.
fn on_body_centred(samples: usize) -> Volume {
    let edge = std::f64::consts::SQRT_2 * 2.0 / (samples - 1) as f64;
    let across = (2.0 / edge).ceil() as usize + 1;
    let dims = [across, across, 2 * across];
    let origin = DVec3::splat(-1.0 - 0.25 * edge);
    let lattice = Lattice::body_centred(dims, origin, DMat3::from_diagonal(DVec3::splat(edge)));
    Phantom::MarschnerLobb.sample_on(lattice).unwrap()
}

fn trilinear(volume: &Volume, place: DVec3) -> f64 {
    let lattice = &volume.lattice;
    let steps = (place - lattice.origin) / lattice.spacing();
    let (low, part) = (steps.floor(), steps.fract());
    let corner = |corner: usize| {
        let [i, j, k] = [corner & 1, corner >> 1 & 1, corner >> 2];
        let share = |at: usize, part: f64| if at == 1 { part } else { 1.0 - part };
        let index =
            (((low.z as usize + k) * lattice.dims[1]) + low.y as usize + j) * lattice.dims[0] + low.x as usize + i;
        volume.value(index) * share(i, part.x) * share(j, part.y) * share(k, part.z)
    };
    (0..8).map(corner).sum()
}

#[test]
fn marschner_and_lobb() {
    for samples in [40, 41, 64] {
        println!(
            "{samples}³ trilinear {:.3} (corners) {:.3} (cells)",
            error({
                let v = signal(samples);
                move |place| trilinear(&v, place)
            }),
            error({
                let v = in_cells(samples);
                move |place| trilinear(&v, place)
            })
        );
        for (name, kernel) in [
            ("σ 0.5 R 2", Kernel::gaussian(0.5, 2.0)),
            ("σ 0.6 R 2", Kernel::gaussian(0.6, 2.0)),
            ("σ 0.7 R 3", Kernel::gaussian(0.7, 3.0)),
            ("B-spline", Kernel::b_spline(2.0)),
        ] {
            let kernel = kernel.unwrap();
            let bcc = on_body_centred(samples);
            println!(
                "{samples}³ {name}: smooth {:.3}, sharp {:.3} / cells {:.3}; body-centred smooth {:.3}, sharp {:.3}; resampled {:.3}",
                reconstructed(&signal(samples), &kernel),
                sharp(signal(samples), &kernel),
                sharp(in_cells(samples), &kernel),
                reconstructed(&bcc, &kernel),
                sharp(bcc, &kernel),
                sharp(body_centred(&signal(samples)).unwrap(), &kernel)
            );
        }
    }
}
