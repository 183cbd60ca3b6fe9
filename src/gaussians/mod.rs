//! Trained 3D Gaussians: a captured scene as ellipsoids with an opacity each, and with colours that
//! depend on the view (Kerbl et al. 2023).
//!
//! Trainers choose the numbers so that the pictures of one rule look like the photographs: a
//! Gaussian covers a pixel by its opacity times its projection there. So an opacity is no density.
//! The engines keep the rule and turn what is covered into an optical depth, −ln(1 − α).

mod colors;
pub mod harmonics;
mod phantom;
mod seen;
mod surfels;
mod survey;
pub mod turn;

pub use colors::Colors;
pub use phantom::phantom;
pub use seen::{EXTENT, Eye};
pub use survey::Survey;

use crate::{
    Error, Result,
    about::About,
    math::{Bounds, eigen},
    parallel::prelude::*,
};
use glam::{DMat3, DQuat, DVec3, Mat3, Quat, Vec3};
use std::ops::Range;

/// The highest degree of the spherical harmonics.
pub const MOST_DEGREE: u32 = 3;

/// A trained scene. All lists have one entry a Gaussian; harmonics have
/// [`harmonics::terms`] entries.
#[derive(Debug, Clone, Default)]
pub struct Gaussians {
    /// World position that the centres are relative to.
    pub origin: DVec3,
    /// World positions, relative to the origin.
    pub centers: Vec<Vec3>,
    /// Standard deviations along the axes of each Gaussian, in world units; none is negative.
    pub scales: Vec<Vec3>,
    /// The turns from the axes of each Gaussian to the world's, of unit length.
    pub rotations: Vec<Quat>,
    /// What each covers at its centre, from 0 to 1.
    pub opacities: Vec<f32>,
    /// The degree of the spherical harmonics, 0 to [`MOST_DEGREE`].
    pub degree: u32,
    /// The coefficients of the colours: for each Gaussian its [`harmonics::terms`] in their order,
    /// each with red, green and blue. [`harmonics::color`] says what they mean.
    pub harmonics: Vec<[f32; 3]>,
    /// The Gaussians of the file that were left out. Viewers of such files show nothing at their
    /// places.
    pub broken: Broken,
    /// What the file says about the scene.
    pub about: About,
}

/// Numbers of Gaussians that cannot be drawn.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Broken {
    /// One of their numbers is NaN or infinite, or beyond what 32 bits hold.
    pub not_finite: u64,
    /// Their quaternion is zero.
    pub without_rotation: u64,
}

impl Broken {
    /// Returns the number of both.
    pub fn all(self) -> u64 {
        self.not_finite + self.without_rotation
    }
}

/// Returns the deviations and the turn of a Gaussian of this covariance, the longest axis first.
pub(crate) fn shape_of(covariance: DMat3) -> (Vec3, Quat) {
    let (squares, [first, second, _]) = eigen(covariance);
    let turn = DQuat::from_mat3(&DMat3::from_cols(first, second, first.cross(second)));
    let scales = squares.map(|square| square.max(0.0).sqrt() as f32);
    (Vec3::from(scales), turn.normalize().as_quat())
}

impl Gaussians {
    /// Returns the number of Gaussians.
    pub fn len(&self) -> usize {
        self.centers.len()
    }

    /// Returns whether there are none.
    pub fn is_empty(&self) -> bool {
        self.centers.is_empty()
    }

    /// Returns the harmonics of one Gaussian.
    pub fn harmonics_of(&self, index: usize) -> &[[f32; 3]] {
        let terms = harmonics::terms(self.degree);
        &self.harmonics[index * terms..][..terms]
    }

    /// Returns the axes of one Gaussian as columns, each as long as its standard deviation. The
    /// covariance is M·Mᵀ.
    pub fn axes(&self, index: usize) -> Mat3 {
        Mat3::from_quat(self.rotations[index]) * Mat3::from_diagonal(self.scales[index])
    }

    /// Adds the Gaussians of another scene; all stay where they are in the world. The degree is the
    /// higher one of both.
    ///
    /// # Errors
    /// [`Error::Argument`] if 32-bit coordinates around this scene's origin are too coarse for the
    /// other's places: if their steps exceed a quarter of its mean deviation.
    pub fn join(&mut self, mut other: Self) -> Result<()> {
        let shift = other.origin - self.origin;
        let moved = |center: &Vec3| (center.as_dvec3() + shift).as_vec3();
        let centers: Vec<Vec3> = other.centers.par_iter().map(moved).collect();
        let farthest = centers.iter().map(|c| c.abs().max_element()).fold(0.0, f32::max);
        let sizes = other.scales.iter().map(|s| f64::from(s.length())).sum::<f64>();
        let size = sizes / other.len().max(1) as f64;
        let step = f64::from(farthest) * f64::from(f32::EPSILON);
        if shift != DVec3::ZERO && step > 0.25 * size {
            return Err(Error::Argument(format!(
                "Gaussians are up to {farthest:.0} from the first input, where 32-bit coordinates \
                 have steps of {step:.3}, but their mean deviation is {size:.3}; convert inputs \
                 this far apart to separate files"
            )));
        }
        let degree = self.degree.max(other.degree);
        self.set_degree(degree);
        other.set_degree(degree);
        self.centers.extend(centers);
        self.scales.append(&mut other.scales);
        self.rotations.append(&mut other.rotations);
        self.opacities.append(&mut other.opacities);
        self.harmonics.append(&mut other.harmonics);
        self.broken.not_finite += other.broken.not_finite;
        self.broken.without_rotation += other.broken.without_rotation;
        Ok(())
    }

    /// Returns some of the Gaussians, of the same scene.
    ///
    /// # Panics
    /// If the range reaches beyond them.
    pub fn part(&self, range: Range<usize>) -> Self {
        let terms = harmonics::terms(self.degree);
        Self {
            origin: self.origin,
            centers: self.centers[range.clone()].to_vec(),
            scales: self.scales[range.clone()].to_vec(),
            rotations: self.rotations[range.clone()].to_vec(),
            opacities: self.opacities[range.clone()].to_vec(),
            degree: self.degree,
            harmonics: self.harmonics[range.start * terms..range.end * terms].to_vec(),
            broken: self.broken,
            about: self.about.clone(),
        }
    }

    /// Returns these Gaussians, in this order.
    ///
    /// # Panics
    /// If there is no such Gaussian.
    pub fn chosen(&self, indices: &[u32]) -> Self {
        let all = |list: &[Vec3]| indices.iter().map(|&i| list[i as usize]).collect();
        let harmonics = indices.iter().flat_map(|&i| self.harmonics_of(i as usize));
        Self {
            origin: self.origin,
            centers: all(&self.centers),
            scales: all(&self.scales),
            rotations: indices.iter().map(|&i| self.rotations[i as usize]).collect(),
            opacities: indices.iter().map(|&i| self.opacities[i as usize]).collect(),
            degree: self.degree,
            harmonics: harmonics.copied().collect(),
            broken: self.broken,
            about: self.about.clone(),
        }
    }

    /// Gives the colours this degree. Added terms are 0; those above it are dropped.
    pub fn set_degree(&mut self, degree: u32) {
        let (old, new) = (harmonics::terms(self.degree), harmonics::terms(degree));
        if old == new {
            return;
        }
        let resized = |terms: &[[f32; 3]]| {
            let mut all = [[0.0; 3]; harmonics::MOST_TERMS];
            all[..old.min(new)].copy_from_slice(&terms[..old.min(new)]);
            all[..new].to_vec()
        };
        self.harmonics = self.harmonics.par_chunks_exact(old).flat_map_iter(resized).collect();
        self.degree = degree;
    }

    /// Returns the box around all footprints, in world coordinates.
    pub fn bounds(&self) -> Bounds {
        let none = (Vec3::INFINITY, Vec3::NEG_INFINITY);
        let one = |index: usize| {
            let axes = self.axes(index);
            let reach = EXTENT
                * Vec3::new(axes.row(0).length(), axes.row(1).length(), axes.row(2).length());
            (self.centers[index] - reach, self.centers[index] + reach)
        };
        let both = |a: (Vec3, Vec3), b: (Vec3, Vec3)| (a.0.min(b.0), a.1.max(b.1));
        let (low, high) = (0..self.len()).into_par_iter().map(one).reduce(|| none, both);
        Bounds::between(self.origin, [low, high])
    }

    /// Returns what is wrong with the lists: their lengths, or a number out of its range.
    ///
    /// # Errors
    /// A message that names the first wrong Gaussian.
    pub fn validate(&self) -> std::result::Result<(), String> {
        if self.degree > MOST_DEGREE {
            return Err(format!(
                "harmonics have the degree {}, but at most {MOST_DEGREE} is drawn",
                self.degree
            ));
        }
        let count = self.len();
        for (what, given, wanted) in [
            ("scales", self.scales.len(), count),
            ("rotations", self.rotations.len(), count),
            ("opacities", self.opacities.len(), count),
            ("harmonics", self.harmonics.len(), count * harmonics::terms(self.degree)),
        ] {
            if given != wanted {
                return Err(format!("{count} Gaussians need {wanted} {what}, but have {given}"));
            }
        }
        let bad = (0..count).into_par_iter().find_first(|&index| self.problem(index).is_some());
        let message = |index| self.problem(index).map(|what| format!("Gaussian {index}: {what}"));
        bad.and_then(message).map_or(Ok(()), Err)
    }

    /// Returns what is wrong with the numbers of one Gaussian.
    fn problem(&self, index: usize) -> Option<String> {
        let (center, scale) = (self.centers[index], self.scales[index]);
        let (turn, opacity) = (self.rotations[index], self.opacities[index]);
        // The squares of larger numbers do not fit in 32 bits.
        const LARGEST: f32 = 1e18;
        let holds = |v: Vec3| v.is_finite() && v.abs().max_element() <= LARGEST;
        if !holds(center) || !self.origin.is_finite() {
            return Some(format!("its centre {center} is not a position"));
        }
        if !holds(scale) || scale.min_element() < 0.0 {
            return Some(format!("its deviations {scale} are not from 0 to {LARGEST:e}"));
        }
        if !(0.999..=1.001).contains(&turn.length_squared()) {
            return Some(format!("its rotation {turn} has not unit length"));
        }
        if !(0.0..=1.0).contains(&opacity) {
            return Some(format!("its opacity {opacity} is not from 0 to 1"));
        }
        let is_color = self.harmonics_of(index).as_flattened().iter().all(|v| v.is_finite());
        (!is_color).then(|| "its colour is not finite".into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn one() -> Gaussians {
        Gaussians {
            centers: vec![Vec3::X],
            scales: vec![Vec3::new(1.0, 2.0, 3.0)],
            rotations: vec![Quat::from_rotation_z(std::f32::consts::FRAC_PI_2)],
            opacities: vec![0.5],
            harmonics: vec![[0.0; 3]],
            ..Gaussians::default()
        }
    }

    #[test]
    fn the_box_holds_the_turned_footprint() {
        let Bounds { min, max } = one().bounds();
        // The turn exchanges x and y.
        let half = f64::from(EXTENT) * DVec3::new(2.0, 1.0, 3.0);
        assert!((min - (DVec3::X - half)).length() < 1e-5, "{min}");
        assert!((max - (DVec3::X + half)).length() < 1e-5, "{max}");
    }

    #[test]
    fn scenes_join_where_they_are() {
        let mut all = one();
        let mut other = one();
        other.set_degree(2);
        other.harmonics[8] = [1.0; 3];
        other.origin = DVec3::Y;
        all.join(other).unwrap();
        assert_eq!((all.len(), all.degree, all.validate()), (2, 2, Ok(())));
        assert_eq!(all.centers[1], Vec3::new(1.0, 1.0, 0.0));
        assert_eq!((all.harmonics_of(0)[8], all.harmonics_of(1)[8]), ([0.0; 3], [1.0; 3]));
        all.set_degree(0);
        assert_eq!((all.harmonics.len(), all.validate()), (2, Ok(())));
        let far = Gaussians { origin: DVec3::X * 1e9, ..one() };
        assert!(all.join(far).unwrap_err().to_string().contains("from the first input"));
    }

    #[test]
    fn what_is_wrong_is_named() {
        assert_eq!(one().validate(), Ok(()));
        type Change = fn(&mut Gaussians);
        let change: [(Change, &str); 8] = [
            (|g| g.degree = 4, "degree 4"),
            (|g| g.degree = 1, "need 4 harmonics"),
            (|g| g.scales.clear(), "need 1 scales"),
            (|g| g.centers[0].x = f32::NAN, "centre"),
            (|g| g.scales[0].y = -1.0, "deviations"),
            (|g| g.rotations[0] = Quat::from_xyzw(0.0, 0.0, 0.0, 0.5), "unit length"),
            (|g| g.opacities[0] = 1.5, "opacity 1.5"),
            (|g| g.harmonics[0][1] = f32::INFINITY, "colour"),
        ];
        for (change, word) in change {
            let mut wrong = one();
            change(&mut wrong);
            let message = wrong.validate().unwrap_err();
            assert!(message.contains(word), "{message}");
        }
    }
}
