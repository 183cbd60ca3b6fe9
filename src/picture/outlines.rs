//! Lines around what stands in front of something farther away, as in an illustration.

use super::Picture;
use crate::{math::View, parallel::prelude::*};

/// Lines along the outlines of a picture's things ([`Picture::with_outlines`]).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outlines {
    /// Their width in pixels.
    pub width: f64,
    /// Their colour: red, green and blue in 0 … 1.
    pub color: [f32; 3],
}

/// By how many pixels, at its depth, a thing must stand in front of another to have an outline
/// there.
const LEAST: f32 = 4.0;
/// A jump of the depth counts beyond the slopes beside it, times this: a steep surface has none.
const SLOPES: f32 = 2.0;

/// Depths that are linear across the picture of a plane: larger is nearer.
struct Depths<'a> {
    view: &'a View,
    z: &'a [f32],
    size: [usize; 2],
}

/// A pixel of a thing's outline: its column, and the nearest depth that counts as behind it.
type Rim = (usize, f32);

impl Depths<'_> {
    /// Returns the depth of a pixel; `None` outside the picture.
    fn at(&self, [x, y]: [usize; 2]) -> Option<f32> {
        (x < self.size[0] && y < self.size[1]).then(|| self.z[y * self.size[0] + x])
    }

    /// Returns the nearness of a depth, which is linear across the picture of a plane. That of an
    /// empty pixel in perspective is 0.
    fn nearness(&self, z: f32) -> f32 {
        if self.view.perspective { 1.0 / z } else { -z }
    }

    /// Returns how much nearer the first of three pixels in a row is than the second, with the
    /// sign; 0 if one is empty or outside the picture.
    fn slope(&self, from: [usize; 2], to: Option<[usize; 2]>) -> f32 {
        let ends = [Some(from), to].map(|pixel| pixel.and_then(|pixel| self.at(pixel)));
        match ends {
            [Some(a), Some(b)] if a.is_finite() && b.is_finite() => {
                self.nearness(a) - self.nearness(b)
            }
            _ => 0.0,
        }
    }

    /// Returns the nearest depth that counts as behind a pixel, if it stands in front of one
    /// beside it.
    fn behind(&self, [x, y]: [usize; 2]) -> Option<f32> {
        let z = self.at([x, y]).filter(|z| z.is_finite())?;
        let pixel = if self.view.perspective { z } else { 1.0 } / self.view.scale as f32;
        let least = self.nearness(z) - self.nearness(z + LEAST * pixel);
        let limit = |[right, down]: [isize; 2]| {
            let step = |count: isize| {
                Some([x.checked_add_signed(right * count)?, y.checked_add_signed(down * count)?])
            };
            let beside = step(1)?;
            let other = self.at(beside)?;
            if !other.is_finite() {
                return Some(if self.view.perspective { 2.0 * z } else { f32::INFINITY });
            }
            let jump = self.nearness(z) - self.nearness(other);
            let slopes = [
                self.slope([x, y], step(-1)),
                step(2).map_or(0.0, |next| self.slope(beside, Some(next))),
            ];
            let steepest = slopes[0].abs().max(slopes[1].abs());
            // Halfway to what lies behind.
            (jump > least + SLOPES * steepest).then_some(0.5 * (z + other))
        };
        [[1, 0], [-1, 0], [0, 1], [0, -1]].into_iter().filter_map(limit).reduce(f32::min)
    }
}

impl Picture {
    /// Draws lines along the outlines of what stands in front of something farther away or of
    /// nothing: on the pixels behind, up to a width. Surfaces keep all of their pixels. In the
    /// colour of the background, the lines are halos. `view` must be the view of the picture.
    ///
    /// A pixel stands in front of another beside it if its depth (where half of the light is
    /// absorbed) is smaller by more than four pixels, beyond twice the slopes on both sides.
    #[must_use]
    pub fn with_outlines(mut self, view: &View, outlines: &Outlines) -> Self {
        let size = [self.width as usize, self.height as usize];
        if size.contains(&0) {
            return self;
        }
        let width = outlines.width as f32;
        let depths = Depths { view, z: &self.depth, size };
        let rims: Vec<Vec<Rim>> = (0..size[1])
            .into_par_iter()
            .map(|y| (0..size[0]).filter_map(|x| Some((x, depths.behind([x, y])?))).collect())
            .collect();
        // Pixels farther than this from a rim have no line.
        let reach = (width + 1.0).ceil() as usize;
        let depth = &self.depth;
        self.color.par_chunks_mut(size[0]).enumerate().for_each(|(y, row)| {
            let mut shares = vec![0.0f32; size[0]];
            let beside = rims.iter().enumerate().take(y + reach + 1).skip(y.saturating_sub(reach));
            for (other, rims) in beside {
                let down = other.abs_diff(y) as f32;
                for &(at, behind) in rims {
                    for x in at.saturating_sub(reach)..(at + reach + 1).min(size[0]) {
                        let distance = down.hypot(at.abs_diff(x) as f32);
                        if depth[y * size[0] + x] >= behind {
                            shares[x] = shares[x].max((width + 1.0 - distance).clamp(0.0, 1.0));
                        }
                    }
                }
            }
            for (x, pixel) in row.iter_mut().enumerate().filter(|(x, _)| shares[*x] > 0.0) {
                // The edge of a thing is smooth: what it leaves of an empty pixel has the line.
                let is_empty = !depth[y * size[0] + x].is_finite();
                let over = shares[x] * if is_empty { 1.0 - pixel[3] } else { 1.0 };
                let left = if is_empty { 1.0 } else { 1.0 - over };
                let [red, green, blue] = outlines.color;
                let line = [red, green, blue, 1.0];
                *pixel = std::array::from_fn(|i| pixel[i] * left + line[i] * over);
            }
        });
        self
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::math::{Camera, Projection};
    use glam::DVec3;

    const WHITE: [f32; 4] = [1.0; 4];
    const RED: [f32; 4] = [1.0, 0.0, 0.0, 1.0];

    /// Draws outlines of red over a white picture with these depths, which is empty where they are
    /// infinite. A pixel at depth 1 is one unit wide.
    fn outlined(projection: Projection, width: u32, depth: Vec<f32>, line: f64) -> Vec<[f32; 4]> {
        let height = depth.len() as u32 / width;
        let camera = Camera {
            position: DVec3::ZERO,
            focal_point: DVec3::NEG_Z,
            view_up: DVec3::Y,
            projection,
        };
        let view = camera.view([width, height]).expect("a view");
        let color = depth.iter().map(|z| if z.is_finite() { WHITE } else { [0.0; 4] }).collect();
        let picture = Picture { width, height, color, depth };
        picture.with_outlines(&view, &Outlines { width: line, color: [1.0, 0.0, 0.0] }).color
    }

    fn flat(height: f64) -> Projection {
        Projection::Orthographic { height }
    }

    #[test]
    fn lines_lie_behind_what_is_nearer() {
        // One pixel is one unit. The second jump is too small.
        let depths = vec![1.0, 1.0, 9.0, 9.0, 9.0, 12.0, 12.0, 12.0];
        assert_eq!(
            outlined(flat(1.0), 8, depths.clone(), 1.0),
            [WHITE, WHITE, RED, WHITE, WHITE, WHITE, WHITE, WHITE]
        );
        let wider = outlined(flat(1.0), 8, depths, 1.5);
        assert_eq!([wider[1], wider[2], wider[4]], [WHITE, RED, WHITE]);
        assert_eq!(wider[3], [1.0, 0.5, 0.5, 1.0]);
    }

    #[test]
    fn what_stands_before_nothing_has_a_line() {
        let far = f32::INFINITY;
        let depths = vec![far, far, 5.0, far, far];
        let around = [[0.0; 4], RED, WHITE, RED, [0.0; 4]];
        for projection in [flat(1.0), Projection::Perspective { view_angle: 60.0 }] {
            assert_eq!(outlined(projection, 5, depths.clone(), 1.0), around);
        }
    }

    #[test]
    fn slanted_planes_have_no_lines() {
        let flat_depths: Vec<f32> = (0..9).map(|x| 10.0 + 30.0 * x as f32).collect();
        assert_eq!(outlined(flat(1.0), 9, flat_depths, 2.0), [WHITE; 9]);
        // In perspective, one over the depth of a plane is linear.
        let plane: Vec<f32> = (0..9).map(|x| 1.0 / (1.0 - 0.11 * x as f32)).collect();
        let view = Projection::Perspective { view_angle: 1.0 };
        assert_eq!(outlined(view, 9, plane.clone(), 2.0), [WHITE; 9]);
        // A step on it has one.
        let mut stepped = plane;
        stepped[6..].iter_mut().for_each(|z| *z *= 9.0);
        assert!(outlined(view, 9, stepped, 2.0).contains(&RED));
    }
}
