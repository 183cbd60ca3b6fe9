//! Samples within a cell of space, merged into one: levels of detail for pictures that cannot
//! resolve the separate samples.

use super::splats::{WEIGHTS, factor};
use crate::{
    parallel::prelude::*,
    splat::{SampleSplats, Splat},
};
use glam::{DMat3, DVec3, Vec3};

/// Cells along an axis that fit in a key.
const MOST_CELLS: f64 = (1u64 << 21) as f64;

/// Returns the set with the samples merged per cell of a grid. Cells are `edge` long in world
/// units, and the grid begins at the set's origin. A merged sample keeps the sums over its samples:
/// of their kernels, of kernels times position and value, and of the products that give its
/// covariance and slope. The same set always gives the same result. A set that spans too many cells
/// is returned unchanged.
pub(crate) fn merged(set: &SampleSplats, edge: f64) -> SampleSplats {
    let centers = || set.splats.par_iter().map(|splat| Vec3::from_array(splat.center));
    let low = centers().reduce(|| Vec3::INFINITY, Vec3::min).as_dvec3();
    let high = centers().reduce(|| Vec3::NEG_INFINITY, Vec3::max).as_dvec3();
    let first = (low / edge).floor();
    if !((high / edge).floor() - first).cmplt(DVec3::splat(MOST_CELLS)).all() {
        return set.clone();
    }
    let key = |splat: &Splat| {
        let [x, y, z] =
            ((Vec3::from_array(splat.center).as_dvec3() / edge).floor() - first).to_array();
        (x as u64) << 42 | (y as u64) << 21 | z as u64
    };
    let numbered = set.splats.par_iter().zip(0..set.splats.len() as u32);
    let mut order: Vec<(u64, u32)> = numbered.map(|(splat, index)| (key(splat), index)).collect();
    order.par_sort_unstable();
    let cells: Vec<&[(u64, u32)]> = order.chunk_by(|a, b| a.0 == b.0).collect();
    let splats = cells.par_iter().map(|cell| one_of(set, cell)).collect();
    SampleSplats { splats, ..*set }
}

/// Returns the sample that stands for those of a cell.
fn one_of(set: &SampleSplats, cell: &[(u64, u32)]) -> Splat {
    let members = || cell.iter().map(|&(_, index)| &set.splats[index as usize]);
    let first = &set.splats[cell[0].1 as usize];
    if cell.len() == 1 {
        return *first;
    }
    let origin = DVec3::from_array(first.center.map(f64::from));
    let (mut mass, mut place, mut value) = (0.0, DVec3::ZERO, 0.0);
    for part in members().map(Part::of) {
        mass += part.mass;
        place += part.mass * (part.center - origin);
        value += part.mass * part.value;
    }
    let (middle, value) = (origin + place / mass, value / mass);
    let (mut covariance, mut rise) = (DMat3::ZERO, DVec3::ZERO);
    for part in members().map(Part::of) {
        let d = part.center - middle;
        let share = part.mass / mass;
        covariance += share
            * (part.factor * part.factor.transpose() + DMat3::from_cols(d * d.x, d * d.y, d * d.z));
        // The kernel's own contribution is Σ·g with g = B⁻ᵀ·s.
        rise += share * ((part.value - value) * d + part.factor * part.slope);
    }
    let DMat3 { x_axis, y_axis, z_axis } = covariance;
    let terms =
        [x_axis.x, x_axis.y, x_axis.z, y_axis.y, y_axis.z, z_axis.z].map(|term| term as f32);
    let Some([b00, b10, b11, b20, b21, b22]) = factor(&terms) else { return *first };
    // Slopes are per whitened length: B⁻¹ times the covariance of value and position.
    let x = rise.x / b00;
    let y = (rise.y - b10 * x) / b11;
    let z = (rise.z - b20 * x - b21 * y) / b22;
    let slope = DVec3::new(x, y, z);
    let weight = (mass / (b00 * b11 * b22)).clamp(WEIGHTS[0], WEIGHTS[1]);
    let factor = [b00, b10, b11, b20, b21, b22].map(|term| term as f32);
    Splat::sample(middle.as_vec3(), value as f32, factor, weight as f32, slope.as_vec3())
}

/// A sample in the form that sums need.
struct Part {
    /// The integral of its kernel over space, up to a common factor.
    mass: f64,
    center: DVec3,
    value: f64,
    factor: DMat3,
    slope: DVec3,
}

impl Part {
    fn of(splat: &Splat) -> Self {
        let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
        let (weight, slope) = splat.weight_and_slope();
        Self {
            mass: (f64::from(weight) * b00 * b11 * b22).abs().max(f64::MIN_POSITIVE),
            center: DVec3::from_array(splat.center.map(f64::from)),
            value: f64::from(splat.strength),
            factor: DMat3::from_cols(
                DVec3::new(b00, b10, b20),
                DVec3::new(0.0, b11, b21),
                DVec3::new(0.0, 0.0, b22),
            ),
            slope: slope.as_dvec3(),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scattered::{Points, SampleOptions};

    /// Merged samples keep a linear field, and the sum of all kernels.
    #[test]
    fn merged_samples_keep_a_linear_field() {
        let field = |p: Vec3| 3.0 + 2.0 * p.x - p.y + 0.5 * p.z;
        let place =
            |i: u32| Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, (i / 256) as f32) * 0.11;
        let positions: Vec<Vec3> = (0..16 * 16 * 16).map(place).collect();
        let values = positions.iter().map(|&p| field(p)).collect();
        let points = Points { positions, values, ..Points::default() };
        let set = points.to_splats(&SampleOptions::default()).expect("splats");
        let few = merged(&set, 0.5);
        assert!(few.splats.len() * 27 < set.splats.len() * 2, "{}", few.splats.len());
        let mass =
            |set: &SampleSplats| set.splats.iter().map(|splat| Part::of(splat).mass).sum::<f64>();
        assert!((mass(&few) / mass(&set) - 1.0).abs() < 2e-3, "{} {}", mass(&few), mass(&set));
        for splat in &few.splats {
            let part = Part::of(splat);
            let truth = f64::from(field(part.center.as_vec3()));
            assert!((part.value - truth).abs() < 2e-2, "{} {truth}", part.value);
            // The slope along whitened axes is Bᵀ times the gradient.
            let slope = part.factor.transpose() * DVec3::new(2.0, -1.0, 0.5);
            assert!(
                (part.slope - slope).length() < 0.05 * slope.length(),
                "{} {slope}",
                part.slope
            );
        }
    }

    #[test]
    fn a_set_over_too_many_cells_stays_as_it_is() {
        let positions = vec![Vec3::ZERO, Vec3::splat(1e-3), Vec3::splat(1e9)];
        let points = Points { positions, values: vec![1.0; 3], ..Points::default() };
        let set = points
            .to_splats(&SampleOptions { slopes: false, ..SampleOptions::default() })
            .expect("splats");
        assert_eq!(merged(&set, 1e-2).splats, set.splats);
        assert_eq!(merged(&set, 1e4).splats.len(), 2);
    }
}
