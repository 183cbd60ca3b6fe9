//! The phantom of a head: ellipsoids and tubes with the values of a CT scan.

use glam::DVec3;

/// Hounsfield units of the tissues of a head.
const AIR: f64 = -1000.0;
const FLESH: f64 = 40.0;
const BRAIN: f64 = 36.0;
const WATER: f64 = 8.0;
const BONE: f64 = 1000.0;
const TOOTH: f64 = 1400.0;
const CONTRAST: f64 = 330.0;

/// Half the width of the blur on edges, as from a scanner.
const BLUR: f64 = 0.016;

/// Returns the value at a position; 1 stands for 100 mm, z is up and the face is towards −y.
pub fn head(p: DVec3) -> f64 {
    let skull = ellipsoid(p, [0.0, 0.06, 0.2], [0.64, 0.78, 0.66]);
    let jaw = ellipsoid(p, [0.0, -0.28, -0.42], [0.42, 0.42, 0.34]);
    let neck = tube(p, &[[0.0, 0.14, -0.2], [0.0, 0.2, -1.2]], 0.36);
    let nose = ellipsoid(p, [0.0, -0.74, -0.02], [0.11, 0.18, 0.2]);
    let ear = ellipsoid(mirrored(p), [0.66, 0.1, 0.05], [0.07, 0.13, 0.18]);
    let skin =
        [skull - 0.08, jaw - 0.07, neck, nose, ear].into_iter().fold(f64::INFINITY, f64::min);
    let sockets = ellipsoid(mirrored(p), [0.26, -0.64, 0.12], [0.17, 0.2, 0.15]);
    let nasal = ellipsoid(p, [0.0, -0.62, -0.08], [0.1, 0.26, 0.2]);

    let mut value = fill(AIR, FLESH, skin);
    // The skull is a shell, open at the eyes and the nose, and the brain fills it.
    value = fill(value, BONE, skull);
    value = fill(value, BRAIN, skull + 0.07);
    value = fill(value, WATER, ellipsoid(mirrored(p), [0.09, 0.02, 0.28], [0.06, 0.28, 0.1]));
    value = fill(value, FLESH, sockets.max(skin));
    value = fill(value, WATER, ellipsoid(mirrored(p), [0.26, -0.66, 0.12], [0.12; 3]).max(skin));
    // The jaw: an arch of bone with teeth along it.
    let bow = [[0.36, 0.1, -0.2], [0.38, -0.05, -0.5], [0.26, -0.42, -0.58], [0.0, -0.58, -0.6]];
    value = fill(value, BONE, tube(mirrored(p), &bow, 0.075));
    let teeth =
        tube(mirrored(p), &[[0.26, -0.34, -0.46], [0.16, -0.52, -0.46], [0.0, -0.58, -0.46]], 0.06);
    value = fill(value, TOOTH, teeth.max(0.03 - (22.0 * p.x).sin().abs() * 0.06));
    value = fill(value, AIR, nasal.max(skin + 0.04));
    // The spine, with its canal.
    let spine = [[0.0, 0.24, -0.38], [0.0, 0.28, -1.2]];
    let discs = 0.02 * (24.0 * p.z).sin();
    value = fill(value, BONE, tube(p, &spine, 0.13 + discs));
    value = fill(value, BRAIN, tube(p, &[[0.0, 0.3, -0.2], [0.0, 0.34, -1.2]], 0.05));
    value = fill(value, AIR, tube(p, &[[0.0, -0.02, -0.5], [0.0, 0.02, -1.2]], 0.07));
    arteries(p, value)
}

/// The carotid arteries, their ring below the brain, and the branches over it.
fn arteries(p: DVec3, value: f64) -> f64 {
    let side = mirrored(p);
    let carotid = [
        [0.22, 0.06, -1.2],
        [0.22, 0.04, -0.55],
        [0.25, 0.1, -0.3],
        [0.14, 0.0, -0.12],
        [0.14, -0.1, -0.06],
        [0.12, -0.06, 0.04],
    ];
    let front = [
        [0.12, -0.06, 0.04],
        [0.03, -0.26, 0.08],
        [0.03, -0.5, 0.3],
        [0.03, -0.3, 0.62],
        [0.03, 0.2, 0.68],
    ];
    let middle = [[0.12, -0.06, 0.04], [0.38, -0.1, 0.1], [0.5, 0.06, 0.3], [0.42, 0.3, 0.5]];
    let back = [[0.12, -0.06, 0.04], [0.1, 0.14, 0.02], [0.14, 0.42, 0.1], [0.1, 0.66, 0.24]];
    let value = fill(value, CONTRAST, tube(side, &carotid, 0.042));
    let value = fill(value, CONTRAST, tube(side, &front, 0.026));
    let value = fill(value, CONTRAST, tube(side, &middle, 0.03));
    fill(value, CONTRAST, tube(side, &back, 0.026))
}

/// Maps both halves of the head onto the side of positive x.
fn mirrored(p: DVec3) -> DVec3 {
    DVec3::new(p.x.abs(), p.y, p.z)
}

/// Returns the value after a part is added whose surface is at this signed distance (negative
/// inside).
fn fill(below: f64, part: f64, distance: f64) -> f64 {
    let t = (0.5 - 0.5 * distance / BLUR).clamp(0.0, 1.0);
    below + (part - below) * t * t * (3.0 - 2.0 * t)
}

/// Returns approximately the distance to an ellipsoid's surface.
fn ellipsoid(p: DVec3, center: [f64; 3], radii: [f64; 3]) -> f64 {
    let (q, radii) = (p - DVec3::from_array(center), DVec3::from_array(radii));
    let scaled = (q / radii).length();
    let slope = (q / (radii * radii)).length();
    if slope > 0.0 { scaled * (scaled - 1.0) / slope } else { -radii.min_element() }
}

/// Returns the distance to a tube around a chain of points.
fn tube(p: DVec3, points: &[[f64; 3]], radius: f64) -> f64 {
    let segment = |ends: &[[f64; 3]]| {
        let (a, b) = (DVec3::from_array(ends[0]), DVec3::from_array(ends[1]));
        let along = ((p - a).dot(b - a) / (b - a).length_squared()).clamp(0.0, 1.0);
        (p - a - along * (b - a)).length()
    };
    points.windows(2).map(segment).fold(f64::INFINITY, f64::min) - radius
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_head_has_its_parts() {
        let at = |x, y, z| head(DVec3::new(x, y, z));
        assert_eq!((at(0.95, 0.95, 0.95), at(0.0, -0.95, 0.6)), (AIR, AIR));
        assert_eq!((at(0.3, 0.3, 0.5), at(0.25, -0.62, 0.12)), (BRAIN, WATER));
        assert_eq!((at(0.0, 0.06, 0.83), at(0.0, 0.06, 0.9)), (BONE, FLESH));
        assert_eq!((at(0.22, 0.05, -0.8), at(-0.22, 0.05, -0.8)), (CONTRAST, CONTRAST));
    }
}
