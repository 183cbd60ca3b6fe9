//! Light from the eye.

use crate::volume::Shade;
use glam::DVec3;

/// Returns a lit colour by Blinn and Phong's reflection (Blinn 1977) with a light at the eye, on
/// both sides of a surface. `normal` may have any length. If it has none, the ambient and diffuse
/// parts of the colour count in full. If the shade says which gradients are certain, `normal` is a
/// gradient in value per world length, and others are lit the less the shorter they are.
pub(super) fn lit(color: DVec3, normal: DVec3, ray: DVec3, shade: &Shade) -> DVec3 {
    with_light(color, light(normal, ray, shade))
}

/// Returns a colour in light: a factor on it, and the highlight that is added to it.
pub(super) fn with_light(color: DVec3, [factor, highlight]: [f64; 2]) -> DVec3 {
    (color * factor + DVec3::splat(highlight)).min(DVec3::ONE)
}

/// Returns the factor on a colour and the highlight of [`lit`].
pub(super) fn light(normal: DVec3, ray: DVec3, shade: &Shade) -> [f64; 2] {
    let Shade { ambient, diffuse, specular, power, certain } = *shade;
    let certainty = certain.map_or(1.0, |certain| certainty(normal.length(), certain));
    match normal.try_normalize() {
        // The light comes from the eye, so the half vector is the light's own direction. Turning
        // the normal towards the light gives the cosine's magnitude.
        Some(normal) => {
            let cosine = normal.dot(ray).abs().min(1.0);
            let facing = 1.0 - certainty * (1.0 - cosine);
            let highlight = certainty * specular * cosine.powf(power);
            [ambient + diffuse * facing, highlight]
        }
        None => [ambient + diffuse, 0.0],
    }
}

/// Returns how far a gradient counts, 0 … 1: linear between two magnitudes.
fn certainty(magnitude: f64, [low, high]: [f64; 2]) -> f64 {
    if magnitude >= high { 1.0 } else { ((magnitude - low) / (high - low)).max(0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_by_hand() {
        let shade = Shade { ambient: 0.1, diffuse: 0.5, specular: 0.2, power: 2.0, certain: None };
        let color = DVec3::new(1.0, 0.5, 0.0);
        let close = |normal: DVec3, expected: [f64; 3]| {
            let lit_color = lit(color, normal, DVec3::Z, &shade);
            assert!((lit_color - DVec3::from(expected)).length() < 1e-12, "{lit_color}");
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

    #[test]
    fn light_fades_with_the_certainty_of_the_gradient() {
        let plain = Shade { ambient: 0.1, diffuse: 0.5, specular: 0.2, power: 2.0, certain: None };
        let shade = Shade { certain: Some([2.0, 4.0]), ..plain };
        let color = DVec3::new(1.0, 0.5, 0.0);
        let of = |normal: DVec3, shade: &Shade| lit(color, normal, DVec3::Z, shade);
        let (across, slanted) = (DVec3::X, DVec3::new(0.0, 0.6, 0.8));
        for direction in [across, slanted] {
            let (full, none) = (of(direction, &plain), of(DVec3::ZERO, &plain));
            for (length, share) in [(1.0, 0.0), (2.0, 0.0), (2.5, 0.25), (4.0, 1.0), (9.0, 1.0)] {
                let expected = none + share * (full - none);
                let lit_color = of(direction * length, &shade);
                assert!(
                    (lit_color - expected).length() < 1e-12,
                    "{length}: {lit_color} {expected}"
                );
            }
        }
        // A step.
        let step = Shade { certain: Some([3.0, 3.0]), ..plain };
        assert_eq!(of(across * 2.9, &step), of(DVec3::ZERO, &plain));
        assert_eq!(of(across * 3.0, &step), of(across, &plain));
    }
}
