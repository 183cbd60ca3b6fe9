//! Eye-dome lighting (Boucheny 2009): pixels are dimmed where others beside them are nearer.

use super::Picture;
use crate::{math::View, parallel::prelude::*};

/// How much a pixel is dimmed per pixel that others lie nearer, for a strength of 1.
const PER_PIXEL: f32 = 0.2;
/// The most pixels by which a neighbour counts as nearer: farther ones would be black.
const MOST: f32 = 20.0;
/// The directions to neighbours: right and down.
const AROUND: [[f32; 2]; 8] = [
    [1.0, 0.0],
    [0.707, 0.707],
    [0.0, 1.0],
    [-0.707, 0.707],
    [-1.0, 0.0],
    [-0.707, -0.707],
    [0.0, -1.0],
    [0.707, -0.707],
];

impl Picture {
    /// Dims each pixel by the depths of eight others at a distance of `radius` pixels around it: by
    /// e to the power −0.2·strength·d. d is the mean of how much nearer they are, in pixels at
    /// their depth, 20 at most; farther ones count as 0. It shows the shape of what has no normals,
    /// such as a cloud of dots, and outlines everything.
    #[must_use]
    pub fn with_eye_dome(mut self, view: &View, strength: f64, radius: u32) -> Self {
        let (width, height) = (self.width as usize, self.height as usize);
        if width == 0 {
            return self;
        }
        let depth = &self.depth;
        let offsets = AROUND.map(|way| way.map(|part| (part * radius as f32).round() as isize));
        let near_at = |x: usize, y: usize| {
            let z = depth[y * width + x];
            if !z.is_finite() {
                return 0.0;
            }
            let pixel = if view.perspective { f64::from(z) } else { 1.0 } / view.scale;
            let nearer = |[right, down]: [isize; 2]| {
                let [x, y] = [x.checked_add_signed(right)?, y.checked_add_signed(down)?];
                let other = *depth.get(y * width + x).filter(|_| x < width && y < height)?;
                Some(((z - other) / pixel as f32).clamp(0.0, MOST))
            };
            offsets.into_iter().filter_map(nearer).sum::<f32>() / AROUND.len() as f32
        };
        let per_pixel = PER_PIXEL * strength as f32;
        self.color.par_chunks_mut(width).enumerate().for_each(|(y, row)| {
            for (x, [red, green, blue, _]) in row.iter_mut().enumerate() {
                let dimmed = (-per_pixel * near_at(x, y)).exp();
                [red, green, blue].into_iter().for_each(|channel| *channel *= dimmed);
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

    /// A white picture with these depths, 3 pixels wide.
    fn picture(depth: Vec<f32>) -> Picture {
        let (width, height) = (3, depth.len() as u32 / 3);
        Picture { width, height, color: vec![[1.0; 4]; depth.len()], depth }
    }

    fn view(projection: Projection, size: [u32; 2]) -> View {
        let camera = Camera {
            position: DVec3::ZERO,
            focal_point: DVec3::NEG_Z,
            view_up: DVec3::Y,
            projection,
        };
        camera.view(size).expect("a view")
    }

    #[test]
    fn what_is_farther_is_dimmed_by_the_pixels_between() {
        // Six pixels for six units: a pixel is one unit.
        let view = view(Projection::Orthographic { height: 3.0 }, [3, 3]);
        let far = f32::INFINITY;
        let drawn = picture(vec![4.0, 4.0, 4.0, 4.0, 6.0, 4.0, 4.0, far, 90.0]);
        let dimmed = drawn.with_eye_dome(&view, 1.0, 1);
        let brightness: Vec<f32> = dimmed.color.iter().map(|pixel| pixel[0]).collect();
        // Six neighbours of the middle are two pixels nearer.
        assert!((brightness[4] - (-0.2f32 * 12.0 / 8.0).exp()).abs() < 1e-6, "{brightness:?}");
        // Nothing is nearer than the nearest, and emptiness stays.
        assert_eq!([brightness[0], brightness[7]], [1.0, 1.0]);
        // The farthest has three neighbours; one of them has no depth.
        assert!((brightness[8] - (-0.2f32 * 40.0 / 8.0).exp()).abs() < 1e-6, "{brightness:?}");
        assert!(dimmed.color.iter().all(|pixel| pixel[3] == 1.0));
    }

    #[test]
    fn in_perspective_a_pixel_grows_with_the_depth() {
        let view = view(Projection::Perspective { view_angle: 90.0 }, [3, 3]);
        let at = |scale: f32| {
            let depths = [2.0, 2.0, 2.0, 3.0, 3.0, 3.0, 3.0, 3.0, 3.0].map(|z| z * scale);
            picture(depths.to_vec()).with_eye_dome(&view, 1.0, 1).color[4][0]
        };
        assert!((at(1.0) - at(50.0)).abs() < 1e-6 && at(1.0) < 0.99);
    }
}
