//! Trained Gaussians by the formulas of their trainer, as ground truth for whole splats.

use super::{composite::Composite, composite::Medium, picture};
use crate::{
    Error, Result,
    gaussians::{Eye, Gaussians},
    math::{Camera, View},
    parallel::prelude::*,
    picture::Picture,
    scene::{Scene, Settings},
    splat::{TRAINED_BLUR, TRAINED_OPACITIES, decode_trained_color},
};
use glam::{DMat2, DMat3, DVec2, DVec3};

/// Gaussians nearer than this along the view's axis are left out, in world units.
const NEAREST: f64 = 0.2;

/// A ray ends before less light than this would be left.
const LEAST_LIGHT: f64 = 1e-4;

/// Beyond this many times the tangent of half the view's angle, the slope of the projection stays
/// as it is there.
const WIDEST: f64 = 1.3;

/// A Gaussian in the picture.
struct Footprint {
    /// z of its centre in view space.
    depth: f64,
    /// In pixels.
    center: DVec2,
    /// The inverse of its covariance.
    conic: DMat2,
    opacity: f64,
    color: DVec3,
}

/// Draws a trained scene by the formulas of Kerbl et al. (2023), pixel by pixel. Footprints are
/// those of the projection's linear part at each centre, widened by 0.3 in the variances. They are
/// composited in the order of the centres' depths along the view's axis. A Gaussian covers α =
/// min(0.99, o·G) of a pixel, and nothing where α < 1/255. A ray ends before less than 10⁻⁴ of its
/// light would be left.
///
/// Unlike the trainer's rasteriser, all pixels of a footprint count, not only those in the tiles
/// that the square of three standard deviations meets.
///
/// # Errors
/// [`Error::Argument`] for a parallel view, and for Gaussians and cameras that cannot be drawn.
pub fn trained(set: &Gaussians, camera: &Camera, settings: &Settings) -> Result<Picture> {
    Scene::new().with_gaussians(set.clone()).validate()?;
    let view = camera.view(settings.size)?;
    if !view.perspective {
        return Err(Error::Argument("trained Gaussians are projected in perspective only".into()));
    }
    let splats = set.seen_from(Eye::of(&view)).splats;
    let mut footprints: Vec<Footprint> = (0..set.len())
        .into_par_iter()
        .filter_map(|index| {
            let color = decode_trained_color(&splats[index]).map(f64::from);
            footprint(set, index, &view, DVec3::from(color))
        })
        .collect();
    footprints.sort_by(|a, b| a.depth.total_cmp(&b.depth));
    let [width, height] = settings.size;
    let row = |row: u32| {
        let pixel = |column: u32| {
            let place = DVec2::new(f64::from(column) + 0.5, f64::from(row) + 0.5);
            composite(&footprints, place, &view)
        };
        (0..width).map(pixel).collect()
    };
    Ok(picture(&view, (0..height).into_par_iter().map(row).collect()))
}

/// Projects a Gaussian; `None` if it is too near, or flat in the picture.
fn footprint(set: &Gaussians, index: usize, view: &View, color: DVec3) -> Option<Footprint> {
    let center = view.to_view(set.origin + set.centers[index].as_dvec3());
    if center.z <= NEAREST {
        return None;
    }
    let half = DVec2::new(f64::from(view.size[0]), f64::from(view.size[1])) / (2.0 * view.scale);
    let slope = (center.truncate() / center.z).clamp(-WIDEST * half, WIDEST * half);
    let (f, z) = (view.scale, center.z);
    // The rows of the projection's slope at the centre.
    let [x, y] =
        [DVec3::new(f / z, 0.0, -f * slope.x / z), DVec3::new(0.0, f / z, -f * slope.y / z)];
    let axes = view.rotation * axes(set, index);
    let covariance = axes * axes.transpose();
    let widened = |a: DVec3, b: DVec3| a.dot(covariance * b);
    let blur = TRAINED_BLUR * TRAINED_BLUR;
    let (xx, xy, yy) = (widened(x, x) + blur, widened(x, y), widened(y, y) + blur);
    let matrix = DMat2::from_cols(DVec2::new(xx, xy), DVec2::new(xy, yy));
    (matrix.determinant() > 0.0).then(|| Footprint {
        depth: z,
        center: view.center + f * center.truncate() / z,
        conic: matrix.inverse(),
        opacity: set.opacities[index].into(),
        color,
    })
}

/// Returns the axes of a Gaussian as columns, each as long as its standard deviation.
fn axes(set: &Gaussians, index: usize) -> DMat3 {
    let turn = DMat3::from_quat(set.rotations[index].as_dquat().normalize());
    turn * DMat3::from_diagonal(set.scales[index].as_dvec3())
}

/// Composites the footprints at a place of the picture, front to back.
fn composite(footprints: &[Footprint], place: DVec2, view: &View) -> Composite {
    let [least, most] = TRAINED_OPACITIES;
    let mut composite = Composite::EMPTY;
    let toward = ((place - view.center) / view.scale).extend(1.0).length();
    for footprint in footprints {
        let offset = place - footprint.center;
        let power = -0.5 * offset.dot(footprint.conic * offset);
        let alpha = (footprint.opacity * power.exp()).min(most);
        if alpha < least {
            continue;
        }
        if (1.0 - composite.opacity) * (1.0 - alpha) < LEAST_LIGHT {
            break;
        }
        let medium = Medium { depth: -(-alpha).ln_1p(), color: footprint.color };
        composite.pass(medium, [footprint.depth * toward; 2]);
    }
    composite
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{gaussians::harmonics::constant_of, math::Projection};
    use glam::{Quat, Vec3};

    fn camera() -> Camera {
        Camera {
            position: DVec3::new(0.0, 0.0, -4.0),
            focal_point: DVec3::ZERO,
            view_up: DVec3::Y,
            projection: Projection::Perspective { view_angle: 40.0 },
        }
    }

    fn pair() -> Gaussians {
        Gaussians {
            centers: vec![Vec3::Z, Vec3::ZERO],
            scales: vec![Vec3::splat(0.3); 2],
            rotations: vec![Quat::IDENTITY; 2],
            opacities: vec![1.0, 0.5],
            harmonics: vec![[constant_of(1.0), -9.0, -9.0], [-9.0, constant_of(1.0), -9.0]],
            ..Gaussians::default()
        }
    }

    #[test]
    fn the_middle_of_two_is_what_they_cover() {
        let settings = Settings::new([33, 33]);
        let picture = trained(&pair(), &camera(), &settings).unwrap();
        let [red, green, blue, opacity] = picture.color[16 * 33 + 16].map(f64::from);
        // The nearer one covers half, and the other 0.99 of the rest.
        assert!((green - 0.5).abs() < 1e-4 && (red - 0.495).abs() < 1e-4, "{red} {green}");
        assert!(blue == 0.0 && (opacity - 0.995).abs() < 1e-4);
    }

    #[test]
    fn parallel_views_are_refused() {
        let projection = Projection::Orthographic { height: 2.0 };
        let camera = Camera { projection, ..camera() };
        assert!(trained(&pair(), &camera, &Settings::new([8, 8])).is_err());
    }
}
