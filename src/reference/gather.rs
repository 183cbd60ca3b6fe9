//! The kernels of a scene, in view space.

use super::{
    Trained,
    kernel::{Amount, Kernel, Load, Radiance, Sample},
    profile::Profile,
};
use crate::{
    math::{self, View},
    scene::{Item, Scene},
    splat::{
        Common, FOOTPRINT_BLUR, Payload, STEP_BACK, Splat, TRAINED_BLUR, TRAINED_BLUR_ALONG,
        decode_normal, decode_trained_color,
    },
    volume::{Arrangement, Lattice, TransferFunction, Volume},
};
use glam::{DMat3, DVec3};

/// How samples are classified before interpolation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Before {
    /// Whether the samples need normals.
    pub lit: bool,
}

/// Returns all kernels of a scene that are radiance, in the scene's order. If `before` is set,
/// samples become radiance.
pub(super) fn radiance<'a>(
    (scene, trained): (&'a Scene, &Trained),
    view: &View,
    before: Option<Before>,
) -> Vec<Kernel<'a>> {
    let mut kernels = Vec::new();
    for (number, item) in scene.items.iter().enumerate() {
        if item.transfer().is_none() || before.is_some() {
            add_item(&mut kernels, item, before, &scene.view_of(number, view));
        }
        if let Some(set) = trained.get(&number) {
            let (common, view) = (set.common(), scene.view_of(number, view));
            let to_kernel = |splat| from_splat(&common, splat, None, &view);
            kernels.extend(set.splats.iter().filter_map(to_kernel));
        }
    }
    kernels
}

/// Returns the samples of an item, to be classified after interpolation.
pub(super) fn samples<'a>(item: &'a Item, view: &View) -> Vec<Kernel<'a>> {
    let mut kernels = Vec::new();
    add_item(&mut kernels, item, None, view);
    kernels
}

/// Appends the kernels of an item.
fn add_item<'a>(
    kernels: &mut Vec<Kernel<'a>>,
    item: &'a Item,
    before: Option<Before>,
    view: &View,
) {
    match item {
        Item::Radiance(set) => {
            let common = set.common();
            let to_kernel = |splat| from_splat(&common, splat, None, view);
            kernels.extend(set.splats.iter().filter_map(to_kernel));
        }
        // Facets are no kernels. Hierarchies, Gaussians, solids and bricks have become other items
        // by now, or splats beside the items.
        Item::Facets(_)
        | Item::Solid(_)
        | Item::Gaussians(_)
        | Item::Hierarchy(_)
        | Item::Bricks(..)
        | Item::Cells(..) => {}
        Item::Scalar(set, transfer) => {
            let before = before.map(|before| (before, transfer));
            let common = set.common();
            let to_kernel = |splat| from_splat(&common, splat, before, view);
            kernels.extend(set.splats.iter().filter_map(to_kernel));
        }
        // Tensor products are not radial functions: their field is evaluated point by point
        // (product.rs).
        Item::Volume(_, kernel, _) if kernel.as_tensor().is_some() => {}
        // Labels are not summed (labels.rs).
        Item::Volume(volume, ..) if volume.is_label_map() => {}
        Item::Volume(volume, kernel, transfer) => {
            let before = before.map(|before| (before, transfer));
            from_volume(kernels, volume, kernel, before, view);
        }
    }
}

/// Returns the weight of a splat's colour and normal within a sheet: splats that face the eye hide
/// those that face away. The transition spans a quarter of the cosine's range. Far sides keep
/// enough weight to have a colour when they are alone.
fn facing(normal: DVec3, center: DVec3, view: &View) -> f64 {
    let ray = if view.perspective { center.normalize_or_zero() } else { DVec3::Z };
    (0.5 - 4.0 * normal.dot(ray)).clamp(1.0 / 255.0, 1.0)
}

/// Returns a sample as radiance, `density` times as dense as its transfer function says. The normal
/// points to smaller values, because fields are mostly dense inside, and surfaces face outward.
fn classified(
    value: f64,
    density: f64,
    slope: DVec3,
    center: DVec3,
    (before, transfer): (Before, &TransferFunction),
    view: &View,
) -> Load {
    let normal = (-slope).try_normalize().filter(|_| before.lit);
    Load::Radiance(Radiance {
        amount: Amount::Extinction(transfer.extinction(value) * density),
        color: DVec3::from(transfer.color(value)),
        normal,
        facing: normal.map_or(1.0, |normal| facing(normal, center, view)),
    })
}

/// Returns a splat's kernel, widened so that it cannot fall between pixels; `None` if the splat has
/// no volume or is not finite.
fn from_splat<'a>(
    set: &Common,
    splat: &Splat,
    before: Option<(Before, &TransferFunction)>,
    view: &View,
) -> Option<Kernel<'a>> {
    let center = view.to_view(set.origin + DVec3::from(splat.center.map(f64::from)));
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    let columns = [DVec3::new(b00, b10, b20), DVec3::new(0.0, b11, b21), DVec3::new(0.0, 0.0, b22)];
    let sharp = view.rotation * DMat3::from_cols(columns[0], columns[1], columns[2]);
    // Trained Gaussians are widened by pixels of the plane of their centres, as their trainer does.
    let is_trained = set.payload == Payload::Trained;
    let distance = if is_trained { center.z.abs() } else { center.length() };
    let pixel = if view.perspective { distance } else { 1.0 } / view.scale;
    let blur = if is_trained {
        TRAINED_BLUR * DVec3::new(1.0, 1.0, TRAINED_BLUR_ALONG)
    } else {
        DVec3::splat(FOOTPRINT_BLUR)
    };
    let blur = DMat3::from_diagonal((blur * pixel).powf(2.0));
    let factor = cholesky(sharp * sharp.transpose() + blur)?;
    let mut center = center;
    let load = match set.payload {
        Payload::Scalar { overlap } => {
            let (weight, slope) = splat.weight_and_slope();
            // A widened sample keeps its weight over space. Otherwise a sample far smaller than a
            // pixel would drown its surroundings.
            let thinner = (sharp.determinant() / factor.determinant()).abs();
            let (value, weight) = (f64::from(splat.strength), f64::from(weight) * thinner);
            // A slope across a flat kernel has no meaning in space.
            let slope = Some(sharp.inverse().transpose() * slope.as_dvec3())
                .filter(|slope| slope.is_finite());
            let slope = slope.unwrap_or(DVec3::ZERO);
            match before {
                Some(before) => {
                    classified(value, weight / f64::from(overlap), slope, center, before, view)
                }
                None => Load::Sample(Sample { value, weight, slope }),
            }
        }
        Payload::Trained => Load::Radiance(Radiance {
            amount: match f64::from(splat.strength) {
                opacity if opacity < 0.0 => Amount::Opacity(-opacity),
                depth => Amount::Depth(depth),
            },
            color: DVec3::from(decode_trained_color(splat).map(f64::from)),
            normal: None,
            facing: 1.0,
        }),
        Payload::Radiance => {
            let [red, green, blue, opacity] =
                splat.color.to_le_bytes().map(|byte| f64::from(byte) / 255.0);
            let normal =
                decode_normal(splat.normal).map(|normal| view.rotation * normal.as_dvec3());
            let toward = if view.perspective { center.normalize() } else { DVec3::Z };
            if let Some(normal) = normal {
                let thickness = |factor: DMat3| (factor.transpose() * normal).length();
                center -= STEP_BACK * (thickness(factor) - thickness(sharp)) * normal;
            }
            // A translucent splat keeps its optical depth times its area in the picture. Opaque
            // ones stay opaque however small they are.
            let thinner =
                if opacity < 1.0 { area(sharp, toward) / area(factor, toward) } else { 1.0 };
            Load::Radiance(Radiance {
                amount: Amount::Depth(f64::from(splat.strength) * opacity * thinner),
                color: DVec3::new(red, green, blue),
                normal,
                facing: normal.map_or(1.0, |normal| facing(normal, center, view)),
            })
        }
    };
    Some(Kernel::new(center, factor, set.extent.into(), Profile::Gaussian, load))
}

/// Returns the product of the two standard deviations of a kernel seen along a direction. B maps
/// the unit sphere to the kernel; the area of its shadow is that of the cofactor matrix.
fn area(factor: DMat3, toward: DVec3) -> f64 {
    let DMat3 { x_axis: a, y_axis: b, z_axis: c } = factor;
    DVec3::new(b.cross(c).dot(toward), c.cross(a).dot(toward), a.cross(b).dot(toward)).length()
}

/// Appends the kernels of a volume's samples.
fn from_volume<'a>(
    kernels: &mut Vec<Kernel<'a>>,
    volume: &Volume,
    shape: &'a math::Kernel,
    before: Option<(Before, &TransferFunction)>,
    view: &View,
) {
    let lattice = volume.drawn_lattice();
    let value = |at: usize| volume.drawn_value(at);
    let sloped = matches!(lattice.arrangement, Arrangement::Rectilinear(_));
    let density = 1.0 / overlap(shape, lattice);
    kernels.extend((0..lattice.len()).map(|at| {
        let center = view.to_view(lattice.sample_position(at));
        let unit = DMat3::from_diagonal(lattice.unit(lattice.index(at)));
        let factor = view.rotation * lattice.axes * unit * shape.unit();
        let slope = || view.rotation * slope(lattice, at, value);
        let load = match before {
            Some(before) => {
                let slope = if before.0.lit { slope() } else { DVec3::ZERO };
                classified(value(at), density, slope, center, before, view)
            }
            None => {
                let slope = if sloped { slope() } else { DVec3::ZERO };
                Load::Sample(Sample { value: value(at), weight: 1.0, slope })
            }
        };
        Kernel::new(center, factor, shape.radius(), Profile::of(shape), load)
    }));
}

/// Returns the average sum of the kernels at all samples of a lattice.
fn overlap(shape: &math::Kernel, lattice: &Lattice) -> f64 {
    match lattice.arrangement {
        // Each cubic cell has two samples, and kernels are in units of √½ of its edge.
        Arrangement::BodyCentred => {
            shape.integral() * std::f64::consts::FRAC_1_SQRT_2.powi(3) / 0.5
        }
        Arrangement::Cartesian | Arrangement::Rectilinear(_) => shape.integral(),
    }
}

/// Returns the gradient at a sample of a lattice, in world space. Along each axis it is the slope
/// of the parabola through the sample and its two neighbours, one-sided at the border, and 0 along
/// an axis with one sample. On a body-centred lattice, the neighbours are those of the same cubic
/// lattice.
fn slope(lattice: &Lattice, at: usize, value: impl Fn(usize) -> f64) -> DVec3 {
    let index = lattice.index(at);
    let [nx, ny, _] = lattice.dims;
    let strides = match lattice.arrangement {
        Arrangement::BodyCentred => [1, 1, 2],
        _ => [1, 1, 1],
    };
    let here = (lattice.steps(index), value(at));
    let along = DVec3::from_array(std::array::from_fn(|axis| {
        let neighbour = |place: Option<usize>| {
            let place = place.filter(|place| *place < lattice.dims[axis])?;
            let mut index = index;
            index[axis] = place;
            let distance = (lattice.steps(index)[axis] - here.0[axis]).abs();
            Some((value(index[0] + nx * (index[1] + ny * index[2])) - here.1, distance))
        };
        let before = neighbour(index[axis].checked_sub(strides[axis]));
        let after = neighbour(Some(index[axis] + strides[axis]));
        match (before, after) {
            (Some((fall, d0)), Some((rise, d1))) => (rise * d0 / d1 - fall * d1 / d0) / (d0 + d1),
            (None, Some((rise, distance))) => rise / distance,
            (Some((fall, distance)), None) => -fall / distance,
            (None, None) => 0.0,
        }
    }));
    lattice.axes.inverse().transpose() * along
}

/// Returns the lower triangular L with L·Lᵀ = `matrix`; `None` if the matrix is not positive
/// definite.
fn cholesky(matrix: DMat3) -> Option<DMat3> {
    let row = |r: usize, c: usize| matrix.col(c)[r];
    let pivot = |squared: f64| (squared > 0.0 && squared.is_finite()).then(|| squared.sqrt());
    let l00 = pivot(row(0, 0))?;
    let (l10, l20) = (row(1, 0) / l00, row(2, 0) / l00);
    let l11 = pivot(row(1, 1) - l10 * l10)?;
    let l21 = (row(2, 1) - l20 * l10) / l11;
    let l22 = pivot(row(2, 2) - l20 * l20 - l21 * l21)?;
    Some(DMat3::from_cols(
        DVec3::new(l00, l10, l20),
        DVec3::new(0.0, l11, l21),
        DVec3::new(0.0, 0.0, l22),
    ))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        math::{Camera, Projection},
        splat::NO_NORMAL,
        volume::Samples,
    };
    use std::sync::Arc;

    #[test]
    fn splats_are_widened_and_no_more() {
        let splat = Splat {
            center: [0.4, -0.3, 0.2],
            strength: 1.0,
            factor: [0.5, -0.2, 0.3, 0.4, 0.1, 0.25],
            color: u32::MAX,
            normal: NO_NORMAL,
        };
        let origin = DVec3::new(0.1, 0.2, 0.3);
        let set = Common { origin, extent: 8.0, payload: Payload::Radiance };
        for projection in
            [Projection::Perspective { view_angle: 50.0 }, Projection::Orthographic { height: 3.0 }]
        {
            let position = DVec3::new(2.0, -2.5, 1.0);
            let camera =
                Camera { position, focal_point: DVec3::ZERO, view_up: DVec3::Z, projection };
            let view = camera.view([40, 30]).unwrap();
            let kernel = from_splat(&set, &splat, None, &view).unwrap();
            let pixel = if view.perspective { kernel.center.length() } else { 1.0 } / view.scale;
            // The rows of B give Σ along the world's axes: Σ_xx is 0.5² and Σ_xy is −0.1.
            let covariance =
                |a: DVec3, b: DVec3| kernel.covariance(view.rotation * a, view.rotation * b);
            assert!((covariance(DVec3::X, DVec3::X) - 0.25 - (0.35 * pixel).powi(2)).abs() < 1e-9);
            assert!((covariance(DVec3::X, DVec3::Y) + 0.1).abs() < 1e-7);
        }
        assert!(cholesky(DMat3::from_diagonal(DVec3::new(1.0, 0.0, 1.0))).is_none());
        assert!(cholesky(DMat3::from_diagonal(DVec3::new(1.0, f64::NAN, 1.0))).is_none());
    }

    #[test]
    fn slopes_of_linear_fields_are_exact_on_every_lattice() {
        let axes = DMat3::from_cols(
            DVec3::new(0.3, 0.1, 0.0),
            DVec3::new(0.0, 0.2, 0.1),
            DVec3::new(0.05, 0.0, 0.4),
        );
        let gradient = DVec3::new(1.0, -2.0, 0.5);
        let places =
            Arc::new([vec![0.0, 1.0, 1.5, 4.0], vec![-1.0, 0.5, 1.0], vec![0.0, 0.1, 3.0, 3.5]]);
        for arrangement in
            [Arrangement::Cartesian, Arrangement::BodyCentred, Arrangement::Rectilinear(places)]
        {
            let lattice =
                Lattice { arrangement, ..Lattice::cartesian([4, 3, 4], DVec3::ONE, axes) };
            let values: Vec<f32> = (0..lattice.len())
                .map(|at| gradient.dot(lattice.sample_position(at)) as f32)
                .collect();
            let volume = Volume::new(lattice, Samples::F32(values)).unwrap();
            for at in 0..volume.len() {
                let computed = slope(&volume.lattice, at, |at| volume.value(at));
                assert!((computed - gradient).length() < 1e-5, "{computed} at {at}");
            }
        }
        // The slope of a parabola is exact too, between unequal neighbours.
        let places = Arc::new([vec![0.0, 1.0, 4.0], vec![0.0], vec![0.0]]);
        let arrangement = Arrangement::Rectilinear(places);
        let lattice =
            Lattice { arrangement, ..Lattice::with_spacing([3, 1, 1], DVec3::splat(0.5)) };
        let computed = slope(&lattice, 1, |at| lattice.sample_position(at).x.powi(2));
        assert!((computed - DVec3::X).length() < 1e-12, "{computed}");
    }
}
