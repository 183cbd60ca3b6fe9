//! Volumes that need no file, for tests, the demo and the documentation. Each is a function of
//! position, sampled over the cube from −1 to 1. Most have values in 0 … 1.

use super::{Lattice, Samples, Volume, head::head};
use crate::{Error, Result, memory, parallel::prelude::*};
use glam::{DMat3, DVec3};
use std::f64::consts::PI;

/// A function of position.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Phantom {
    /// The test signal of Marschner and Lobb (“An Evaluation of Reconstruction Filters for Volume
    /// Rendering”, 1994), with their f_M = 6 and α = 0.25: rings that 41³ samples can just
    /// represent.
    MarschnerLobb,
    /// A ball that fades from 1 at its centre to 0 at radius 0.9: (1 − (r/0.9)²)².
    Ball,
    /// What a CT scanner would see of an invented fruit in air (0). It has a rind (0.35) and soft
    /// flesh (0.15). Inside the flesh are a hard lattice along a gyroid (0.7 … 0.8) and a dense
    /// stone (1). A wedge is cut out to show the inside.
    Specimen,
    /// Two slabs across the z axis, in air of value 0.5. The front slab has value 1 (0.025 < z <
    /// 0.175). The slab directly behind it has value 0 (down to −0.275). No edge of a slab passes
    /// through the other's value. Both end at 0.9 from the axis.
    Slabs,
    /// A head as a CT scanner would see it, in Hounsfield units; 1 stands for 100 mm. It has skin
    /// and flesh, skull, jaw and neck bones, brain, and arteries with contrast agent. The face is
    /// towards −y.
    Head,
    /// One value everywhere.
    Constant(f64),
}

impl Phantom {
    /// The phantoms that [`named`](Self::named) knows.
    pub const NAMES: [&'static str; 5] = ["marschner-lobb", "ball", "specimen", "slabs", "head"];

    /// Returns the phantom of a name.
    pub fn named(name: &str) -> Option<Self> {
        let at = Self::NAMES.iter().position(|known| *known == name)?;
        [Self::MarschnerLobb, Self::Ball, Self::Specimen, Self::Slabs, Self::Head].get(at).copied()
    }

    /// Returns the value at a position in the cube from −1 to 1.
    pub fn value(self, p: DVec3) -> f64 {
        match self {
            Self::MarschnerLobb => marschner_lobb(p),
            Self::Ball => (1.0 - p.length_squared() / 0.81).max(0.0).powi(2),
            Self::Specimen => specimen(p),
            Self::Slabs => slabs(p),
            Self::Head => head(p),
            Self::Constant(value) => value,
        }
    }

    /// Returns 32-bit samples at evenly spaced positions. The first and the last of each axis are
    /// at −1 and 1 in world space; the sample of an axis of one is at 0.
    ///
    /// # Errors
    /// [`Error::Argument`] for a dimension of 0 or more samples than memory can hold
    /// ([`memory::most`]).
    pub fn sample(self, dims: [usize; 3]) -> Result<Volume> {
        self.sample_on(lattice(dims)?)
    }

    /// Returns 32-bit samples at the positions of any lattice. Samples outside the cube get the
    /// function's value there.
    ///
    /// # Errors
    /// [`Error::Argument`] for an invalid lattice ([`Lattice::validate`]) or more samples than
    /// memory can hold.
    pub fn sample_on(self, lattice: Lattice) -> Result<Volume> {
        lattice.validate()?;
        let values = self.fill(&lattice, |value| value as f32)?;
        Volume::new(lattice, Samples::F32(values))
    }

    /// Like [`sample`](Self::sample), with 8-bit samples: 0 … 1 become 0 … 255, rounded.
    ///
    /// # Errors
    /// As [`sample`](Self::sample).
    pub fn sample_bytes(self, dims: [usize; 3]) -> Result<Volume> {
        let lattice = lattice(dims)?;
        let values = self.fill(&lattice, byte)?;
        Volume::new(lattice, Samples::U8(values))
    }

    /// Returns the samples of [`sample_bytes`](Self::sample_bytes) slice by slice, for volumes that
    /// do not fit in memory.
    ///
    /// # Errors
    /// [`Error::Argument`] for a dimension of 0 or a slice that memory cannot hold.
    pub fn byte_slices(self, dims: [usize; 3]) -> Result<ByteSlices> {
        let [nx, ny, _] = dims;
        let lattice = lattice(dims)?;
        memory::check(&format!("a slice of {nx} × {ny} samples"), (nx * ny) as u64)
            .map_err(Error::Argument)?;
        Ok(ByteSlices { phantom: self, lattice })
    }

    fn fill<T: Send>(self, lattice: &Lattice, turn: impl Fn(f64) -> T + Sync) -> Result<Vec<T>> {
        let [nx, ny, nz] = lattice.dims;
        let bytes = (lattice.len() as u64).saturating_mul(size_of::<T>() as u64);
        memory::check(&format!("a volume of {nx} × {ny} × {nz} samples"), bytes)
            .map_err(Error::Argument)?;
        let value = |index: usize| turn(self.value(lattice.sample_position(index)));
        Ok((0..lattice.len()).into_par_iter().map(value).collect())
    }
}

/// The slices of a phantom across the last axis.
#[derive(Debug, Clone)]
pub struct ByteSlices {
    phantom: Phantom,
    lattice: Lattice,
}

impl ByteSlices {
    /// Where the samples lie.
    pub fn lattice(&self) -> &Lattice {
        &self.lattice
    }

    /// Returns the samples of a slice.
    pub fn slice(&self, k: usize) -> Vec<u8> {
        let Lattice { dims: [nx, ny, _], .. } = self.lattice;
        let sample = |index: usize| {
            byte(self.phantom.value(self.lattice.sample_position(k * nx * ny + index)))
        };
        (0..nx * ny).into_par_iter().map(sample).collect()
    }
}

fn byte(value: f64) -> u8 {
    (value * 255.0).round() as u8
}

fn lattice(dims: [usize; 3]) -> Result<Lattice> {
    let step = dims.map(|n| if n > 1 { 2.0 / (n - 1) as f64 } else { 2.0 });
    let origin = dims.map(|n| if n > 1 { -1.0 } else { 0.0 });
    let axes = DMat3::from_diagonal(DVec3::from_array(step));
    let lattice = Lattice::cartesian(dims, DVec3::from_array(origin), axes);
    lattice.validate()?;
    Ok(lattice)
}

fn marschner_lobb(p: DVec3) -> f64 {
    let (frequency, alpha) = (6.0, 0.25);
    let rings = (2.0 * PI * frequency * (PI * p.truncate().length() / 2.0).cos()).cos();
    (1.0 - (PI * p.z / 2.0).sin() + alpha * (1.0 + rings)) / (2.0 * (1.0 + alpha))
}

fn specimen(p: DVec3) -> f64 {
    let r = p.length();
    if r > 0.93 {
        return 0.0;
    }
    // Edges are a few hundredths wide, like the blur of a scanner.
    let inside = |distance: f64| smooth((distance / 0.03 + 1.0) / 2.0);
    let mut value = 0.15 * inside(0.9 - r);
    value = over(value, 0.35, inside(r - 0.83) * inside(0.9 - r));
    let shell = inside(0.74 - r) * inside(r - 0.36);
    if shell > 0.0 {
        // The lattice's value rises outwards. The gyroid's walls are thicker where its function
        // varies slowly.
        let (sin, cos) = (p.map(|x| (9.0 * x).sin()), p.map(|x| (9.0 * x).cos()));
        let gyroid = sin.x * cos.y + sin.y * cos.z + sin.z * cos.x;
        value = over(value, 0.7 + 0.1 * r / 0.74, shell * inside((0.45 - gyroid.abs()) / 12.0));
    }
    value = over(value, 1.0, inside(0.26 - r));
    // The wedge leaves the stone whole.
    let wedge = inside(p.x) * inside(-p.y) * inside(p.z) * inside(r - 0.32);
    over(value, 0.0, wedge)
}

fn slabs(p: DVec3) -> f64 {
    if p.truncate().abs().max_element() > 0.9 {
        return 0.5;
    }
    match p.z {
        z if 0.025 < z && z < 0.175 => 1.0,
        z if -0.275 < z && z <= 0.025 => 0.0,
        _ => 0.5,
    }
}

fn over(below: f64, above: f64, share: f64) -> f64 {
    below + (above - below) * share
}

/// 0 below 0, 1 above 1, a cubic between.
fn smooth(t: f64) -> f64 {
    let t = t.clamp(0.0, 1.0);
    t * t * (3.0 - 2.0 * t)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{math::Bounds, volume::TransferFunction};

    #[test]
    fn values_by_hand() {
        // At the centre: (1 + 0.25·(1 + cos 12π)) / 2.5. At the top the sine cancels the 1.
        assert!((Phantom::MarschnerLobb.value(DVec3::ZERO) - 0.6).abs() < 1e-12);
        assert!((Phantom::MarschnerLobb.value(DVec3::Z) - 0.2).abs() < 1e-12);
        assert_eq!((Phantom::Ball.value(DVec3::ZERO), Phantom::Ball.value(DVec3::X)), (1.0, 0.0));
        assert_eq!(
            (Phantom::Specimen.value(DVec3::ZERO), Phantom::Specimen.value(DVec3::ONE)),
            (1.0, 0.0)
        );
        assert!((Phantom::Specimen.value(DVec3::NEG_X * 0.865) - 0.35).abs() < 1e-9);
    }

    #[test]
    fn every_name_has_a_phantom() {
        assert!(
            Phantom::NAMES.iter().all(|name| Phantom::named(name).is_some())
                && Phantom::named("knot").is_none()
        );
        assert_eq!(Phantom::named("ball"), Some(Phantom::Ball));
        let slab = |z: f64| Phantom::Slabs.value(DVec3::new(0.3, -0.3, z));
        assert_eq!([0.2, 0.1, 0.0, -0.2, -0.4].map(slab), [0.5, 1.0, 0.0, 0.0, 0.5]);
    }

    #[test]
    fn samples_lie_where_they_should() {
        let volume = Phantom::Ball.sample([5, 3, 1]).unwrap();
        let (min, max) = (DVec3::new(-1.0, -1.0, 0.0), DVec3::new(1.0, 1.0, 0.0));
        assert_eq!(volume.bounds(), Bounds { min, max });
        assert_eq!((volume.value(7), volume.range), (1.0, [0.0, 1.0]));
        assert_eq!(Phantom::Constant(0.5).sample_bytes([2, 2, 2]).unwrap().range, [128.0, 128.0]);
        assert!(Phantom::Ball.sample([0, 2, 2]).is_err());
        for dims in [[1 << 20; 3], [1 << 21; 3], [usize::MAX, 1, 1]] {
            let messages = [Phantom::Ball.sample(dims), Phantom::Ball.sample_bytes(dims)]
                .map(|volume| volume.unwrap_err().to_string());
            assert!(messages.iter().all(|message| message.contains("memory")), "{messages:?}");
        }
        let lattice = Lattice::body_centred([usize::MAX, 1, 1], DVec3::ZERO, DMat3::IDENTITY);
        assert!(Phantom::Ball.sample_on(lattice).unwrap_err().to_string().contains("memory"));
        assert!(
            Phantom::Ball
                .byte_slices([1 << 25, 1 << 25, 4])
                .unwrap_err()
                .to_string()
                .contains("memory")
        );
        assert!(Phantom::Ball.byte_slices([8, 8, 1 << 40]).is_ok());
        let slices = Phantom::Ball.byte_slices([5, 3, 4]).unwrap();
        let whole = Phantom::Ball.sample_bytes([5, 3, 4]).unwrap();
        let bytes = (0..4).flat_map(|k| slices.slice(k)).collect();
        assert_eq!((Samples::U8(bytes), slices.lattice()), (whole.samples, &whole.lattice));
    }

    #[test]
    fn any_lattice_can_be_sampled() {
        let lattice = Lattice::body_centred([2, 2, 3], DVec3::splat(-0.5), DMat3::IDENTITY);
        let volume = Phantom::Ball.sample_on(lattice).unwrap();
        // The first sample of the middle layer is displaced by half an edge: to the ball's centre.
        assert_eq!((volume.value(4), volume.len()), (1.0, 12));
        assert_eq!(volume.value(0), f64::from(Phantom::Ball.value(DVec3::splat(-0.5)) as f32));
        assert!(
            Phantom::Ball
                .sample_on(Lattice::body_centred([0, 1, 1], DVec3::ZERO, DMat3::IDENTITY))
                .is_err()
        );
    }

    #[test]
    fn the_specimen_has_its_parts_and_clear_air() {
        let volume = Phantom::Specimen.sample_bytes([48; 3]).unwrap();
        assert_eq!(volume.range, [0.0, 255.0]);
        let counts = volume.histogram(10).unwrap();
        assert!(
            counts[0] > 40_000 && [1, 3, 7].iter().all(|&bin| counts[bin] > 1000),
            "{counts:?}"
        );
        let transfer = TransferFunction::automatic(&volume);
        assert_eq!(transfer.opacity(0.0), 0.0);
        assert!(transfer.opacity(0.75 * 255.0) > 0.1);
    }
}
