//! Makes a set of trained Gaussians from the numbers of a file.

use crate::{
    Result,
    gaussians::{Broken, Gaussians, harmonics::terms},
    input::{Source, positions},
    math::keep::{Keeper, around},
    parallel::prelude::*,
    warning,
};
use glam::{DVec3, Quat, Vec3};

/// One Gaussian as a reader finds it.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Trained {
    pub center: DVec3,
    /// Standard deviations along its axes.
    pub scale: Vec3,
    /// Of any length; [`settle`] gives it the length 1.
    pub rotation: Quat,
    /// From 0 to 1.
    pub opacity: f32,
}

impl Trained {
    /// Returns why it cannot be drawn, if so. Trainers leave Gaussians with numbers that are not
    /// finite in their files; every viewer shows nothing there.
    fn fault(&self, color: &[[f32; 3]]) -> Option<Fault> {
        // The squares of larger numbers do not fit in 32 bits.
        const LARGEST: f64 = 1e18;
        const LEAST_ROTATION: f32 = 1e-24;
        let length = self.rotation.length_squared();
        let is_finite = self.center.abs().max_element() <= LARGEST
            && self.center.is_finite()
            && f64::from(self.scale.max_element()) <= LARGEST
            && self.scale.is_finite()
            && self.scale.min_element() >= 0.0
            && length.is_finite()
            && (0.0..=1.0).contains(&self.opacity)
            && color.as_flattened().iter().all(|v| v.is_finite());
        match is_finite {
            false => Some(Fault::NotFinite),
            true => (length <= LEAST_ROTATION).then_some(Fault::WithoutRotation),
        }
    }
}

/// Why a Gaussian cannot be drawn.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Fault {
    NotFinite,
    WithoutRotation,
}

/// Gaussians per parallel task, and those that are made before they are put in a row.
const CHUNK: usize = 1 << 12;
const BATCH: usize = 1 << 20;

/// Makes the set of `count` Gaussians. `one` returns a Gaussian by its number, and fills in the
/// coefficients of its colour, in the order of [`Gaussians::harmonics`]. Those that cannot be drawn
/// are left out and counted.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) if none is left; [`Error::Limit`](crate::Error::Limit) and
/// [`Error::Memory`](crate::Error::Memory) for too many; those of `one`.
pub(crate) fn settle(
    source: &Source,
    count: usize,
    degree: u32,
    one: impl Fn(usize, &mut [[f32; 3]]) -> Result<Trained> + Sync,
) -> Result<Gaussians> {
    let terms = terms(degree);
    source.room::<[f32; 3]>("the colours", count.saturating_mul(terms))?;
    source.room::<(Trained, [Vec3; 2], Quat, f32)>("the Gaussians", count)?;
    let mut colors = vec![[0.0; 3]; count * terms];
    let (mut all, mut faults) = (Vec::with_capacity(count), Vec::with_capacity(count));
    for (batch, colors) in colors.chunks_mut(BATCH * terms).enumerate() {
        let parts: Vec<Vec<(Trained, Option<Fault>)>> = colors
            .par_chunks_mut(CHUNK * terms)
            .enumerate()
            .map(|(part, colors)| {
                source.check_time()?;
                let each = colors.chunks_exact_mut(terms).enumerate();
                let made = each.map(|(at, color)| {
                    let made = one(batch * BATCH + part * CHUNK + at, color)?;
                    Ok((made, made.fault(color)))
                });
                made.collect()
            })
            .collect::<Result<_>>()?;
        for (made, fault) in parts.into_iter().flatten() {
            all.push(made);
            faults.push(fault);
        }
    }
    let broken = leave_out_broken(source, &faults, &mut all, &mut colors, terms)?;
    drop(faults);
    let place = |index| format!("Gaussian {index}");
    let (origin, centers) = positions::settle(source, all.len(), |i| all[i].center, place)?;
    Ok(Gaussians {
        origin,
        centers,
        scales: positions::collected(source, all.len(), |i| all[i].scale)?,
        rotations: positions::collected(source, all.len(), |i| all[i].rotation.normalize())?,
        opacities: positions::collected(source, all.len(), |i| all[i].opacity)?,
        degree,
        harmonics: colors,
        broken,
        about: Default::default(),
    })
}

/// Leaves out the Gaussians that cannot be drawn, and counts them.
fn leave_out_broken(
    source: &Source,
    faults: &[Option<Fault>],
    all: &mut Vec<Trained>,
    colors: &mut Vec<[f32; 3]>,
    terms: usize,
) -> Result<Broken> {
    let count = |fault| faults.iter().filter(|other| **other == Some(fault)).count() as u64;
    let broken = Broken {
        not_finite: count(Fault::NotFinite),
        without_rotation: count(Fault::WithoutRotation),
    };
    let total = all.len();
    if broken.all() == total as u64 {
        let message = if total == 0 {
            "contains no Gaussians".into()
        } else {
            format!("none of the {total} Gaussians has finite numbers and a rotation")
        };
        return Err(source.error("file", message));
    }
    if broken.all() > 0 {
        warning::give!(
            "{}: {} of {total} Gaussians have numbers that are not finite, or no rotation; they \
             are left out",
            source.path.display(),
            broken.all()
        );
        let mut each_fault = faults.iter();
        all.retain(|_| each_fault.next().is_some_and(Option::is_none));
        let mut each = faults.iter().flat_map(|fault| std::iter::repeat_n(fault, terms));
        colors.retain(|_| each.next().is_some_and(Option::is_none));
    }
    Ok(broken)
}

/// Checks that a format keeps where Gaussians are. `stored` returns what becomes of a place.
///
/// # Errors
/// [`Error::Argument`](crate::Error::Argument) for a set that is too far away.
pub(crate) fn check_places(
    format: &'static str,
    set: &Gaussians,
    stored: impl Fn(DVec3) -> DVec3 + Sync,
) -> Result<()> {
    let keeper = Keeper::new(format, around(set.centers.iter().map(|at| at.as_dvec3())));
    set.centers.par_iter().try_for_each(|center| {
        let (center, place) = (center.as_dvec3(), set.origin + center.as_dvec3());
        keeper.check(place, (stored(place) - set.origin) - center)
    })
}

/// Returns the opacity of a logit. ±∞ are 0 and 1.
pub(crate) fn opacity_of_logit(logit: f32) -> f32 {
    (1.0 / (1.0 + (-f64::from(logit)).exp())) as f32
}

/// Returns the logit of an opacity from 0 to 1, at most 16 from 0.
pub(crate) fn logit_of_opacity(opacity: f32) -> f32 {
    let opacity = f64::from(opacity);
    (opacity / (1.0 - opacity)).ln().clamp(-16.0, 16.0) as f32
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{input::Limits, math::keep::single};
    use std::path::Path;

    #[test]
    fn broken_ones_are_left_out() {
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.ply"), &[], &limits).unwrap();
        let good = Trained {
            center: DVec3::X,
            scale: Vec3::ONE,
            rotation: Quat::from_xyzw(0.0, 0.0, 0.0, 2.0),
            opacity: 0.5,
        };
        let mut all = vec![good; 9];
        all[1].center.x = f64::NAN;
        all[2].scale.x = f32::INFINITY;
        all[3].rotation = Quat::from_xyzw(0.0, 0.0, 0.0, 0.0);
        all[4].opacity = f32::NAN;
        all[8].scale = Vec3::ZERO;
        let set = settle(&source, 9, 1, |i, color| {
            color.fill([i as f32; 3]);
            if i == 5 {
                color[3][2] = f32::NAN;
            }
            Ok(all[i])
        })
        .unwrap();
        assert_eq!(set.broken, Broken { not_finite: 4, without_rotation: 1 });
        assert_eq!((set.len(), set.validate()), (4, Ok(())));
        let first: Vec<f32> = set.harmonics.chunks_exact(4).map(|terms| terms[0][0]).collect();
        assert_eq!(first, [0.0, 6.0, 7.0, 8.0]);
        assert_eq!(set.rotations[0], Quat::IDENTITY);
        let none = settle(&source, 1, 0, |_, _| Ok(all[1])).unwrap_err();
        assert!(none.to_string().contains("none of the 1"), "{none}");
    }

    #[test]
    fn sets_of_several_batches_keep_their_order_and_the_time() {
        let count = BATCH + CHUNK + 7;
        let one = |i: usize| Trained {
            center: DVec3::X * i as f64,
            scale: Vec3::ONE,
            rotation: Quat::IDENTITY,
            opacity: if i % 1000 == 1 { f32::NAN } else { 0.5 },
        };
        let limits = Limits::default();
        let source = Source::from_bytes(Path::new("a.ply"), &[], &limits).unwrap();
        let set = settle(&source, count, 0, |i, color| {
            color.fill([i as f32; 3]);
            Ok(one(i))
        })
        .unwrap();
        let kept: Vec<usize> = (0..count).filter(|i| i % 1000 != 1).collect();
        let left_out = (count - kept.len()) as u64;
        assert_eq!((set.len(), set.broken.not_finite), (kept.len(), left_out));
        let places = set.centers.iter().map(|center| set.origin.x + f64::from(center.x));
        assert!(places.zip(&kept).all(|(x, &i)| x == i as f64));
        assert!(set.harmonics.iter().zip(&kept).all(|(color, &i)| color[0] == i as f32));
        let limits = Limits { seconds: 0, ..Limits::default() };
        let source = Source::from_bytes(Path::new("a.ply"), &[], &limits).unwrap();
        let error = settle(&source, 10, 0, |i, _| Ok(one(i + 2))).unwrap_err().to_string();
        assert!(error.contains("the reading time in seconds"), "{error}");
    }

    #[test]
    fn sets_are_checked_around_their_origin() {
        let centers = vec![Vec3::ZERO, Vec3::new(1.0, 0.33, 0.7)];
        for (far, is_kept) in [(0.0, true), (1e4, true), (1e7, false), (1e20, false), (1e39, false)]
        {
            let set = Gaussians {
                origin: DVec3::splat(far),
                centers: centers.clone(),
                ..Gaussians::default()
            };
            assert_eq!(check_places("this", &set, single).is_ok(), is_kept, "{far}");
        }
    }

    #[test]
    fn logits() {
        for opacity in [0.0f32, 0.001, 0.5, 0.99] {
            assert!((opacity_of_logit(logit_of_opacity(opacity)) - opacity).abs() < 1e-6);
        }
        assert_eq!(opacity_of_logit(f32::INFINITY), 1.0);
        assert_eq!(opacity_of_logit(f32::NEG_INFINITY), 0.0);
        assert!(opacity_of_logit(f32::NAN).is_nan());
    }
}
