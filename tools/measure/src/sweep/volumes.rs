//! The axes of volumes: the specimen in bytes, lit and translucent. One parameter changes at a
//! time.

use super::{
    Effort,
    asked::{Content, Field},
    plan::{Plan, Shared, Step, in_order, in_pairs, shared, with_first},
    views,
};
use glam::{DMat3, DVec3};
use splatkit::{
    Result,
    bricks::Bricks,
    math::{Bounds, Camera, Kernel, Tensor},
    scene::{Scene, Settings},
    volume::{Arrangement, Lattice, Samples, Shade, TransferFunction, Volume, phantoms::Phantom},
};
use std::sync::Arc;

/// Samples along each side of the volume, and pixels along each side of the picture.
const SIDE: usize = 128;
const SIZE: u32 = 512;
/// The opacity over a length of one sample.
const OPACITY: f64 = 0.1;
/// The byte that stands for the phantom's 1.
const SCALE: f64 = 255.0;

/// Makes the volume of most steps.
fn usual(effort: Effort) -> Shared<Arc<Volume>> {
    shared(move || cube(effort.side(SIDE)))
}

fn cube(side: usize) -> Result<Arc<Volume>> {
    volume(box_lattice([side; 3], DVec3::ONE))
}

/// Samples the specimen in bytes.
fn volume(lattice: Lattice) -> Result<Arc<Volume>> {
    let volume = Phantom::Specimen.sample_on(lattice)?;
    let bytes = (0..volume.len()).map(|i| (SCALE * volume.value(i)).round() as u8).collect();
    Ok(Arc::new(Volume::new(volume.lattice, Samples::U8(bytes))?))
}

/// Returns a Cartesian lattice that fills the box from `-half` to `half`.
fn box_lattice(dims: [usize; 3], half: DVec3) -> Lattice {
    let cells = DVec3::from(dims.map(|n| n.saturating_sub(1).max(1) as f64));
    Lattice::cartesian(dims, -half, DMat3::from_diagonal(2.0 * half / cells))
}

/// Returns how a volume is shown: bytes above 20, with the same opacity over a length on all
/// lattices.
fn transfer(effort: Effort, opacity: f64) -> TransferFunction {
    TransferFunction {
        color: vec![(20.0, [0.7, 0.3, 0.2]), (255.0, [1.0, 0.9, 0.7])],
        opacity: vec![(20.0, 0.0), (60.0, opacity)],
        unit: 2.0 / effort.side(SIDE) as f64,
        shade: Some(Shade::default()),
        ..TransferFunction::default()
    }
}

/// A volume and how it is shown.
#[derive(Clone)]
struct Show {
    volume: Arc<Volume>,
    kernel: Kernel,
    transfer: TransferFunction,
    is_in_bricks: bool,
    settings: Settings,
}

impl Show {
    fn new(effort: Effort, volume: Arc<Volume>) -> Self {
        let settings = Settings::new([effort.pixels(SIZE); 2]);
        let transfer = transfer(effort, OPACITY);
        Self { volume, kernel: Kernel::default(), transfer, is_in_bricks: false, settings }
    }

    fn bounds(&self) -> Bounds {
        self.volume.bounds()
    }

    /// Returns the step as `bench` sees it.
    fn step(self) -> Result<Step> {
        let camera = views::usual(&self.bounds(), DVec3::Z);
        self.seen(camera)
    }

    fn seen(self, camera: Camera) -> Result<Step> {
        let bounds = self.bounds();
        let Self { volume, kernel, transfer, is_in_bricks, settings } = self;
        let field = Field {
            phantom: Phantom::Specimen,
            scale: SCALE,
            transfer: transfer.clone(),
            bounds,
            samples: volume.len(),
            density: density(&volume.lattice, &bounds),
            extent: kernel.extent,
        };
        let scene = if is_in_bricks {
            Scene::new().with_bricks(Bricks::from_volume(volume)?, kernel, transfer)
        } else {
            Scene::new().with_volume(volume, kernel, transfer)
        };
        Ok(Step { scene, content: Content::Field(Box::new(field)), camera, settings })
    }
}

/// Returns the mean number of samples per unit length along each axis. Layers of a body-centred
/// lattice count with their distance in a Cartesian lattice of as many samples.
fn density(lattice: &Lattice, bounds: &Bounds) -> DVec3 {
    let [x, y, z] = lattice.dims.map(|n| n as f64);
    let (counts, more) = match lattice.arrangement {
        Arrangement::BodyCentred => (DVec3::new(x, y, 0.5 * z), 2f64.cbrt()),
        Arrangement::Cartesian | Arrangement::Rectilinear(_) => (DVec3::new(x, y, z), 1.0),
    };
    more * counts / bounds.size()
}

/// Plans one step for each value, with the usual volume changed by it.
fn each<T: Copy + 'static>(
    effort: Effort,
    values: &[T],
    name: impl Fn(T) -> String,
    change: fn(Show, T) -> Result<Step>,
) -> Vec<Plan> {
    let volume = usual(effort);
    let plan = |&value: &T| {
        let volume = volume.clone();
        Plan::new(name(value), move || change(Show::new(effort, volume()?), value))
    };
    values.iter().map(plan).collect()
}

pub fn distances(effort: Effort) -> Vec<Plan> {
    in_order(each(
        effort,
        &views::DISTANCES,
        |times| times.to_string(),
        |show, times| {
            let camera = views::at_distance(times, &show.bounds(), DVec3::Z);
            show.seen(camera)
        },
    ))
}

pub fn angles(effort: Effort) -> Vec<Plan> {
    in_order(each(
        effort,
        &views::ANGLES,
        |[azimuth, elevation]| format!("{azimuth:.0}°, {elevation:.0}°"),
        |show, angle| {
            let camera = views::from_angle(angle, &show.bounds());
            show.seen(camera)
        },
    ))
}

/// Plans angles to a volume whose slices are five times as far apart as its samples.
pub fn slice_angles(effort: Effort) -> Vec<Plan> {
    let volume = shared(move || volume(stretched(effort, 5.0)));
    let plan = |&angle: &[f64; 2]| {
        let volume = volume.clone();
        let [azimuth, elevation] = angle;
        Plan::new(format!("{azimuth:.0}°, {elevation:.0}°"), move || {
            let show = Show::new(effort, volume()?);
            let camera = views::from_angle(angle, &show.bounds());
            show.seen(camera)
        })
    };
    in_order(views::ANGLES.iter().map(plan).collect())
}

pub fn zooms(effort: Effort) -> Vec<Plan> {
    in_order(each(
        effort,
        &views::ZOOMS,
        |factor| factor.to_string(),
        |show, factor| {
            let camera = views::zoomed(factor, &show.bounds());
            show.seen(camera)
        },
    ))
}

pub fn lenses(effort: Effort) -> Vec<Plan> {
    let mut plans = each(
        effort,
        &[()],
        |()| "orthographic".into(),
        |show, ()| {
            let mut camera = views::usual(&show.bounds(), DVec3::Z);
            camera.make_orthographic();
            show.seen(camera)
        },
    );
    plans.extend(each(
        effort,
        &views::LENSES,
        |angle| format!("{angle}°"),
        |show, angle| {
            let camera = views::through_lens(angle, &show.bounds());
            show.seen(camera)
        },
    ));
    in_order(plans)
}

pub fn sizes(effort: Effort) -> Vec<Plan> {
    in_order(each(
        effort,
        &super::SIZES.map(|size| effort.pixels(size)),
        |size| format!("{size}²"),
        |mut show, size| {
            show.settings.size = [size; 2];
            show.step()
        },
    ))
}

pub fn samples(effort: Effort) -> Vec<Plan> {
    let plan = |side: usize| {
        let side = effort.side(side);
        Plan::new(format!("{side}³"), move || Show::new(effort, cube(side)?).step())
    };
    in_order([32, 64, 128, 192, 256].map(plan).into())
}

pub fn lattices(effort: Effort) -> Vec<Plan> {
    let side = effort.side(SIDE);
    let on = |name: &str, lattice: fn(usize) -> Lattice| {
        Plan::new(name, move || Show::new(effort, volume(lattice(side))?).step())
    };
    let bricks = Plan::new("bricks", move || {
        Show { is_in_bricks: true, ..Show::new(effort, cube(side)?) }.step()
    });
    with_first(vec![
        on("Cartesian", |side| box_lattice([side; 3], DVec3::ONE)),
        on("Cartesian, sheared", sheared),
        on("body-centred", body_centred),
        on("rectilinear, even steps", |side| rectilinear(side, 0.0)),
        on("rectilinear, steps of 1 to 4", |side| rectilinear(side, 0.6)),
        bricks,
    ])
}

/// Returns a lattice whose slices are each shifted a little from the one before, as from a tilted
/// scanner.
fn sheared(side: usize) -> Lattice {
    let mut lattice = box_lattice([side; 3], DVec3::ONE);
    lattice.axes.z_axis.x = 0.2 * lattice.axes.z_axis.z;
    lattice.origin.x -= 0.2;
    lattice
}

/// Returns a body-centred lattice of about `side`³ samples.
fn body_centred(side: usize) -> Lattice {
    let cells = (side as f64 / 2f64.cbrt()).round();
    let edge = 2.0 / (cells - 0.5);
    let dims = [cells as usize, cells as usize, 2 * cells as usize];
    Lattice::body_centred(dims, DVec3::NEG_ONE, DMat3::from_diagonal(DVec3::splat(edge)))
}

/// Returns a lattice with steps that are longer at the ends: (1 + bend) / (1 − bend) times as long
/// as in the middle.
fn rectilinear(side: usize, bend: f64) -> Lattice {
    let last = side.saturating_sub(1).max(1) as f64;
    let place = |i: usize| {
        let x = 2.0 * i as f64 / last - 1.0;
        // Ascending from −1 to 1.
        x + bend * (std::f64::consts::PI * x).sin() / -std::f64::consts::PI
    };
    let places: [Vec<f64>; 3] = std::array::from_fn(|_| (0..side).map(place).collect());
    Lattice {
        dims: [side; 3],
        origin: DVec3::ZERO,
        axes: DMat3::IDENTITY,
        arrangement: Arrangement::Rectilinear(Arc::new(places)),
    }
}

/// Returns a lattice of about as many samples in the same cube, with slices `ratio` times as far
/// apart as the samples in them.
fn stretched(effort: Effort, ratio: f64) -> Lattice {
    let side = effort.side(SIDE) as f64;
    let (within, across) = ((side * ratio.cbrt()).round(), (side * ratio.powf(-2.0 / 3.0)).round());
    box_lattice([within as usize, within as usize, across as usize], DVec3::ONE)
}

pub fn steps(effort: Effort) -> Vec<Plan> {
    let plan = |ratio: f64| {
        let lattice = stretched(effort, ratio);
        let [x, y, z] = lattice.dims;
        Plan::new(format!("1:{ratio} ({x}×{y}×{z})"), move || {
            Show::new(effort, volume(lattice.clone())?).step()
        })
    };
    let mut plans: Vec<_> =
        [1.0, 1.02, 1.114, 1.3, 1.5, 2.0, 2.2, 3.0, 5.0, 10.0, 30.0].map(plan).into();
    // One flat stack, whose slices come closer and closer.
    let stack = |ratio: f64| {
        let dims = [effort.side(300), effort.side(300), effort.side(9).max(5)];
        let [x, y, z] = dims;
        let depth = ratio * (z - 1) as f64 / (x - 1) as f64;
        let lattice = box_lattice(dims, DVec3::new(1.0, 1.0, depth));
        Plan::new(format!("stack of 1:{ratio} ({x}×{y}×{z})"), move || {
            Show::new(effort, volume(lattice.clone())?).step()
        })
    };
    plans.extend([30.0, 10.0, 5.0, 2.0, 1.0].map(stack));
    in_order(plans)
}

/// Returns the kernel of this name.
fn kernel(name: &str) -> Result<Kernel> {
    Ok(match name {
        "b-spline" => Kernel::b_spline(2.0)?,
        "hann" => Kernel::hann(3.0)?,
        "linear" => Kernel::tensor(Tensor::Linear),
        "catmull-rom" => Kernel::tensor(Tensor::CatmullRom),
        "cubic-b-spline" => Kernel::tensor(Tensor::CubicBSpline),
        _ => Kernel::default(),
    })
}

pub fn kernels(effort: Effort) -> Vec<Plan> {
    let names = ["gaussian", "b-spline", "hann", "linear", "catmull-rom", "cubic-b-spline"];
    with_first(each(effort, &names, str::to_owned, |show, name| {
        Show { kernel: kernel(name)?, ..show }.step()
    }))
}

pub fn extents(effort: Effort) -> Vec<Plan> {
    in_order(each(
        effort,
        &[1.5, 1.8, 2.0, 2.5, 3.0],
        |extent| extent.to_string(),
        |show, extent| {
            Show { kernel: Kernel::gaussian(Kernel::default().unit(), extent)?, ..show }.step()
        },
    ))
}

pub fn sharp(effort: Effort) -> Vec<Plan> {
    let steps =
        ["gaussian", "b-spline", "cubic-b-spline"].map(|name| [(name, false), (name, true)]);
    let name =
        |(name, is_sharp): (&str, bool)| format!("{name}{}", if is_sharp { ", sharp" } else { "" });
    in_pairs(each(effort, steps.as_flattened(), name, |show, (name, is_sharp)| {
        let kernel = kernel(name)?;
        let volume = match is_sharp {
            true => Arc::new(Volume::clone(&show.volume).sharpened(&kernel)?),
            false => show.volume.clone(),
        };
        Show { volume, kernel, ..show }.step()
    }))
}

pub fn thicknesses(effort: Effort) -> Vec<Plan> {
    let samples = [0.25, 0.5, 1.0, 1.33, 1.5, 2.0, 2.2, 2.5, 3.0, 4.0, 8.0];
    in_order(each(
        effort,
        &samples,
        |samples| samples.to_string(),
        |mut show, samples| {
            show.settings.sheet_thickness = Some(samples * show.volume.lattice.kernel_spacing());
            show.step()
        },
    ))
}

pub fn opacities(effort: Effort) -> Vec<Plan> {
    let opacities = [0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 0.6, 0.9, 0.999];
    // The length is one sample of the step's own volume.
    in_order(each(
        effort,
        &opacities,
        |opacity| opacity.to_string(),
        |mut show, opacity| {
            show.transfer.opacity = vec![(20.0, 0.0), (60.0, opacity)];
            show.step()
        },
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lattices_have_as_many_samples() {
        let cartesian = SIDE.pow(3) as f64;
        let others =
            [body_centred(SIDE), stretched(Effort::Usual, 30.0), stretched(Effort::Usual, 1.114)];
        for lattice in others.into_iter().chain([rectilinear(SIDE, 0.6), sheared(SIDE)]) {
            lattice.validate().unwrap();
            assert!(
                (0.95..1.05).contains(&(lattice.len() as f64 / cartesian)),
                "{:?}",
                lattice.dims
            );
            let bounds = lattice.bounds();
            let Bounds { min, max } = bounds;
            assert!(min.max_element() < -0.97 && max.min_element() > 0.97, "{min} {max}");
            let cube: f64 = density(&lattice, &bounds).to_array().iter().product();
            assert!(
                (0.8..1.2).contains(&(cube / (0.5 * SIDE as f64).powi(3)))
                    || lattice.axes.z_axis.x != 0.0,
                "{cube}"
            );
        }
    }

    #[test]
    fn uneven_steps_ascend() {
        let lattice = rectilinear(32, 0.6);
        let Arrangement::Rectilinear(places) = &lattice.arrangement else { panic!("{lattice:?}") };
        let steps: Vec<_> = places[0].windows(2).map(|two| two[1] - two[0]).collect();
        let [least, most] =
            steps.iter().fold([f64::MAX, 0.0], |[a, b], &step| [step.min(a), step.max(b)]);
        assert!(least > 0.0 && (3.5..4.5).contains(&(most / least)), "{least} {most}");
    }
}
