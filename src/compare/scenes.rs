//! Measures how much two scenes differ: the distances of their points from each other, and the
//! values of nearest points.

use crate::{Error, Result, edit::Editable, math::neighbours::Neighbours, parallel::prelude::*};
use glam::{DVec3, Vec3};

/// Distances of the points of one scene from the nearest ones of another, in world units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distances {
    /// The mean.
    pub mean: f64,
    /// The root of the mean square.
    pub rms: f64,
    /// The distance that half of the points do not exceed.
    pub median: f64,
    /// The distance that 95 % of the points do not exceed.
    pub most: f64,
    /// The largest one.
    pub largest: f64,
}

/// How much a value differs between each point of the first scene and the nearest one of the other.
/// Where as many points of both are at one place, they are paired in the order of their values;
/// where several others are nearest, the one with the nearest value counts.
#[derive(Debug, Clone, PartialEq)]
pub struct ValueDifference {
    /// The name of the value, which both scenes have.
    pub name: String,
    /// The number of points at which neither value is missing.
    pub count: u64,
    /// The mean of the differences' sizes.
    pub mean: f64,
    /// The largest one.
    pub largest: f64,
}

/// The result of [`compare_scenes`].
#[derive(Debug, Clone, PartialEq)]
pub struct SceneComparison {
    /// The points of both scenes.
    pub counts: [u64; 2],
    /// The distances of the first scene's points from the second scene.
    pub there: Distances,
    /// The distances of the second scene's points from the first scene.
    pub back: Distances,
    /// The values that both have.
    pub values: Vec<ValueDifference>,
    /// The names of values that one of the scenes lacks.
    pub unmatched: [Vec<String>; 2],
}

/// Compares the points, vertices or Gaussians of two scenes.
///
/// # Errors
/// [`Error::NothingToDraw`] for a scene without points.
pub fn compare_scenes(a: &dyn Editable, b: &dyn Editable) -> Result<SceneComparison> {
    if a.count() == 0 || b.count() == 0 {
        return Err(Error::NothingToDraw("a scene without points has no distances".into()));
    }
    let origin = a.place(a.count() / 2).round();
    let (places_a, places_b) = (places(a, origin), places(b, origin));
    let (there, nearest) = distances(&places_a, &places_b);
    let (back, _) = distances(&places_b, &places_a);
    let [at_one_place, others] = [&places_a, &places_b].map(|places| Stacks::of(places));
    let (names_a, names_b) = (a.names(), b.names());
    let mut values = Vec::new();
    for name in names_a.iter().filter(|name| names_b.contains(name)) {
        let (Some(one), Some(other)) = (a.column(name), b.column(name)) else { continue };
        let mut sizes = Vec::with_capacity(one.len());
        for stack in at_one_place.all() {
            let other = values_of(others.with(nearest[stack[0] as usize]), &other);
            differences(values_of(stack, &one), other, &mut sizes);
        }
        values.push(ValueDifference {
            name: name.clone(),
            count: sizes.len() as u64,
            mean: sizes.iter().sum::<f64>() / sizes.len().max(1) as f64,
            largest: sizes.iter().copied().fold(0.0, f64::max),
        });
    }
    let only = |names: &[String], others: &[String]| {
        names.iter().filter(|name| !others.contains(name)).cloned().collect()
    };
    Ok(SceneComparison {
        counts: [a.count() as u64, b.count() as u64],
        there,
        back,
        values,
        unmatched: [only(&names_a, &names_b), only(&names_b, &names_a)],
    })
}

/// Points by their places: those at one place follow each other.
struct Stacks {
    /// The first point at the place of each point.
    first: Vec<u32>,
    order: Vec<u32>,
    /// Where in the order the stack of each first point begins.
    starts: Vec<u32>,
}

impl Stacks {
    fn of(places: &[Vec3]) -> Self {
        let first = Neighbours::first_of_equals(places);
        let mut order: Vec<u32> = (0..places.len() as u32).collect();
        order.par_sort_unstable_by_key(|&at| (first[at as usize], at));
        let mut starts = vec![0; places.len()];
        for (at, start) in order.iter().zip(0..) {
            if first[*at as usize] == *at {
                starts[*at as usize] = start;
            }
        }
        Self { first, order, starts }
    }

    /// Returns all stacks.
    fn all(&self) -> impl Iterator<Item = &[u32]> {
        self.order.chunk_by(|one, other| self.first[*one as usize] == self.first[*other as usize])
    }

    /// Returns the points at the place of a first point.
    fn with(&self, first: u32) -> &[u32] {
        let there = &self.order[self.starts[first as usize] as usize..];
        let count = there.iter().take_while(|at| self.first[**at as usize] == first).count();
        &there[..count]
    }
}

/// Returns the values of some points, smallest first, without missing ones.
fn values_of(points: &[u32], values: &[f64]) -> Vec<f64> {
    let values = points.iter().map(|at| values[*at as usize]);
    let mut values: Vec<f64> = values.filter(|value| !value.is_nan()).collect();
    values.sort_by(f64::total_cmp);
    values
}

/// Adds the sizes of the differences of values at one place from those of the points there.
fn differences(values: Vec<f64>, others: Vec<f64>, sizes: &mut Vec<f64>) {
    if values.len() == others.len() {
        // Smallest with smallest: no other pairs differ less in all.
        sizes.extend(values.iter().zip(&others).map(|(value, other)| (value - other).abs()));
    } else if !others.is_empty() {
        let least = |value: &f64| {
            others.iter().map(|other| (value - other).abs()).fold(f64::INFINITY, f64::min)
        };
        sizes.extend(values.iter().map(least));
    }
}

fn places(scene: &dyn Editable, origin: DVec3) -> Vec<Vec3> {
    let place = |index: usize| (scene.place(index) - origin).as_vec3();
    (0..scene.count()).into_par_iter().map(place).collect()
}

/// Returns the distances of points from others, and the index of the nearest one of each. Of points
/// at one place, the first counts.
fn distances(from: &[Vec3], to: &[Vec3]) -> (Distances, Vec<u32>) {
    let first = Neighbours::first_of_equals(to);
    let kept: Vec<u32> =
        (0..).zip(&first).filter(|(at, first)| at == *first).map(|p| p.0).collect();
    let points: Vec<Vec3> = kept.par_iter().map(|&at| to[at as usize]).collect();
    let tree = Neighbours::new(&points);
    let nearest: Vec<(f64, u32)> = from
        .par_iter()
        .map(|place| {
            let (distance, index) = tree.nearest(*place);
            (distance, kept[index as usize])
        })
        .collect();
    let mut sorted: Vec<f64> = nearest.iter().map(|(distance, _)| *distance).collect();
    sorted.sort_by(f64::total_cmp);
    let count = sorted.len();
    let at = |share: f64| sorted[((count as f64 * share).ceil() as usize).clamp(1, count) - 1];
    let squares: f64 = sorted.iter().map(|distance| distance * distance).sum();
    let distances = Distances {
        mean: sorted.iter().sum::<f64>() / count as f64,
        rms: (squares / count as f64).sqrt(),
        median: at(0.5),
        most: at(0.95),
        largest: at(1.0),
    };
    (distances, nearest.into_iter().map(|(_, index)| index).collect())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{edit::Surface, surface::Mesh};

    fn cloud(places: &[Vec3], reds: &[u8]) -> Surface {
        let colors = reds.iter().map(|red| [*red, 0, 0, 255]).collect();
        Surface::from(Mesh { positions: places.to_vec(), colors, ..Mesh::default() })
    }

    #[test]
    fn distances_and_values_are_measured_both_ways() {
        let a = cloud(&[Vec3::ZERO, Vec3::X, Vec3::X], &[10, 20, 30]);
        let b = cloud(&[Vec3::new(1.0, 0.5, 0.0), Vec3::ZERO, Vec3::splat(10.0)], &[24, 13, 0]);
        let compared = compare_scenes(&a, &b).unwrap();
        assert_eq!((compared.there.largest, compared.there.median), (0.5, 0.5));
        assert!((compared.there.mean - 1.0 / 3.0).abs() < 1e-12);
        assert!(compared.back.largest > 16.0 && compared.back.median == 0.5);
        let red = &compared.values[0];
        assert_eq!((red.name.as_str(), red.count, red.largest), ("red", 3, 6.0));
        assert!((red.mean - 13.0 / 3.0).abs() < 1e-12);
        assert_eq!(compared.unmatched, [Vec::<String>::new(), Vec::new()]);
        let same = compare_scenes(&a, &a).unwrap();
        assert_eq!((same.there.largest, same.back.rms), (0.0, 0.0));
        assert_eq!(same.values[0].largest, 0.0);
        assert!(compare_scenes(&a, &cloud(&[], &[])).is_err());
        let bare = cloud(&[Vec3::ZERO], &[]);
        assert_eq!(compare_scenes(&a, &bare).unwrap().unmatched[0].len(), 4);
    }

    #[test]
    fn points_at_one_place_are_paired_by_their_values() {
        let places = [Vec3::X, Vec3::ZERO, Vec3::X, Vec3::X];
        let red = |reds: &[u8], others: &[u8]| {
            let [a, b] = [reds, others].map(|reds| cloud(&places[..reds.len()], reds));
            let red = compare_scenes(&a, &b).unwrap().values.swap_remove(0);
            (red.count, red.largest)
        };
        assert_eq!(red(&[10, 20, 30, 40], &[10, 20, 30, 40]), (4, 0.0));
        // Another order is no difference, and another value is.
        assert_eq!(red(&[10, 20, 30, 40], &[40, 20, 10, 30]), (4, 0.0));
        assert_eq!(red(&[10, 20, 30, 40], &[41, 20, 10, 30]), (4, 1.0));
        assert_eq!(red(&[10, 20, 10, 40], &[10, 20, 40, 40]), (4, 30.0));
        // Copies that the other scene lacks have the nearest value.
        assert_eq!(red(&[10, 20, 30, 40], &[10, 20, 38]), (4, 8.0));
    }
}
