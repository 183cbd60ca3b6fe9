//! Light from the eye.

use crate::volume::Shade;
use glam::DVec3;

/// Returns a lit colour by Blinn and Phong's reflection (Blinn 1977) with a light at the eye, on
/// both sides of a surface. `normal` may have any length. If it has none, the ambient and diffuse
/// parts of the colour count in full.
pub(super) fn lit(color: DVec3, normal: DVec3, ray: DVec3, shade: &Shade) -> DVec3 {
    let Shade { ambient, diffuse, specular, power } = *shade;
    let lit = match normal.try_normalize() {
        // The light comes from the eye, so the half vector is the light's own direction. Turning
        // the normal towards the light gives the cosine's magnitude.
        Some(normal) => {
            let cosine = normal.dot(ray).abs().min(1.0);
            color * (ambient + diffuse * cosine) + DVec3::splat(specular * cosine.powf(power))
        }
        None => color * (ambient + diffuse),
    };
    lit.min(DVec3::ONE)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_by_hand() {
        let shade = Shade { ambient: 0.1, diffuse: 0.5, specular: 0.2, power: 2.0 };
        let color = DVec3::new(1.0, 0.5, 0.0);
        let close = |normal: DVec3, expected: [f64; 3]| {
            let found = lit(color, normal, DVec3::Z, &shade);
            assert!((found - DVec3::from(expected)).length() < 1e-12, "{found}");
        };
        close(DVec3::Z * 1e-30, [0.8, 0.5, 0.2]);
        close(DVec3::NEG_Z * 7.0, [0.8, 0.5, 0.2]);
        close(DVec3::X, [0.1, 0.05, 0.0]);
        close(DVec3::new(0.0, 1.0, 1.0), {
            let d = 0.5_f64.sqrt();
            [0.1 + 0.5 * d + 0.1, 0.05 + 0.25 * d + 0.1, 0.1]
        });
        close(DVec3::ZERO, [0.6, 0.3, 0.0]);
        let bright = Shade { specular: 3.0, ..shade };
        assert_eq!(lit(color, DVec3::Z, DVec3::Z, &bright), DVec3::ONE);
    }
}
