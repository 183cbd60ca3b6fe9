//! Light, and what surfaces and fields reflect of it.

use crate::{
    scene::{Aside, Lighting},
    volume::Shade,
};
use glam::DVec3;

/// The light that reaches a place: the mean direction of that from all sides, in view space, its
/// amount, and the share of the key lamp's light.
#[derive(Debug, Clone, Copy)]
pub(super) struct Reaching {
    pub side: DVec3,
    /// The same direction in the open.
    pub clear_side: DVec3,
    pub open: f64,
    pub key: f64,
}

impl Reaching {
    /// Returns the light between this place and another.
    pub fn mixed(&self, other: &Self, share: f64) -> Self {
        let mix = |a: f64, b: f64| a + share * (b - a);
        Self {
            side: self.side.lerp(other.side, share),
            clear_side: self.clear_side,
            open: mix(self.open, other.open),
            key: mix(self.key, other.key),
        }
    }
}

/// The lights of a picture, and what of them reaches a place.
pub(super) type Lit = Option<(Lighting, Reaching)>;

/// Returns a lit colour by Blinn and Phong's reflection (Blinn 1977) with a light at the eye, and
/// perhaps one beside it, on both sides of a surface. `normal` may have any length. If it has none,
/// the ambient and diffuse parts of the colour count in full. If the shade says which gradients are
/// certain, `normal` is a gradient in value per world length, and others are lit the less the
/// shorter they are.
pub(super) fn lit(
    color: DVec3,
    normal: DVec3,
    ray: DVec3,
    shade: &Shade,
    aside: Option<&Aside>,
) -> DVec3 {
    with_light(color, light((normal, 1.0), (ray, aside), shade, &None))
}

/// Returns the share of the light from the eye and from beside it that a surface gets, and the
/// cosine of its highlight. The normal has length 1 and points towards the eye.
fn from_the_eye(normal: DVec3, ray: DVec3, aside: Option<&Aside>) -> [f64; 2] {
    let facing = (-normal.dot(ray)).min(1.0);
    // The light comes from the eye, so the half vector is the light's own direction.
    let Some(Aside { direction, share }) = aside else { return [facing; 2] };
    let towards = direction.normalize();
    // A surface that is seen from its edge may be turned to the eye by either side.
    let counts = (10.0 * facing).min(1.0);
    let light = (1.0 - share) * facing + counts * share * normal.dot(towards).max(0.0);
    // The brightest place of a ball on the optical axis has the light 1.
    let brightest = ((1.0 - share) * DVec3::NEG_Z + share * towards).length();
    // The half vector of a lamp between both, in the middle of the picture.
    let half = (share * towards - (2.0 - share) * DVec3::Z).normalize();
    [(light / brightest).min(1.0), normal.dot(half).max(0.0)]
}

/// Returns a colour in light: a factor on it, and the highlight that is added to it.
pub(super) fn with_light(color: DVec3, [factor, highlight]: [f64; 2]) -> DVec3 {
    (color * factor + DVec3::splat(highlight)).min(DVec3::ONE)
}

/// Returns a normal of length 1 that points towards the eye; zero for one without length.
fn towards(normal: DVec3, ray: DVec3) -> DVec3 {
    let normal = normal.normalize_or_zero();
    if normal.dot(ray) > 0.0 { -normal } else { normal }
}

/// Returns a normal of any length as long as it is certain, towards the eye.
pub(super) fn certain_normal(normal: DVec3, ray: DVec3, shade: &Shade) -> DVec3 {
    certainty_of(normal, shade) * towards(normal, ray)
}

/// Returns how far a normal's direction counts.
fn certainty_of(normal: DVec3, shade: &Shade) -> f64 {
    match shade.certain {
        _ if normal.try_normalize().is_none() => 0.0,
        Some(certain) => certainty(normal.length(), certain),
        None => 1.0,
    }
}

/// Returns the factor on a colour and the highlight of [`lit`], or with other lights. With the
/// normal comes how far it counts, with the ray the light beside the eye.
pub(super) fn light(
    (normal, share): (DVec3, f64),
    (ray, aside): (DVec3, Option<&Aside>),
    shade: &Shade,
    lit: &Lit,
) -> [f64; 2] {
    let Shade { ambient, diffuse, specular, power, .. } = *shade;
    let certain = share * certainty_of(normal, shade);
    let normal = towards(normal, ray);
    let shown = |cosine: f64| 1.0 - certain * (1.0 - cosine);
    let [facing, middle] = from_the_eye(normal, ray, aside);
    let gloss = |cosine: f64| certain * specular * cosine.max(0.0).powf(power);
    let Some((lighting, reaching)) = lit else {
        return [ambient + diffuse * shown(facing), gloss(middle)];
    };
    let all_sides = |amount: f64, side: DVec3| amount + 2.0 * certain * side.dot(normal);
    let open = all_sides(reaching.open, reaching.side);
    let open = open.min(all_sides(1.0, reaching.clear_side)).max(0.0);
    let sky = lighting.sky.map_or(0.0, |sky| sky.share);
    let mut factor = open * (ambient + diffuse * (lighting.head * shown(facing) + sky));
    let mut highlight = open * lighting.head * gloss(middle);
    if let Some(key) = lighting.key {
        let share = key.share * reaching.key;
        let direction = key.direction.normalize();
        let cosine = normal.dot(direction).clamp(0.0, 1.0);
        factor += share * diffuse * shown(cosine);
        if cosine > 0.0 {
            highlight += share * gloss(normal.dot((direction - ray).normalize_or_zero()));
        }
    }
    [factor, highlight]
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
            let lit_color = lit(color, normal, DVec3::Z, &shade, None);
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
        assert_eq!(lit(color, DVec3::Z, DVec3::Z, &bright, None), DVec3::ONE);
    }

    #[test]
    fn light_from_beside_the_eye_by_hand() {
        let shade = Shade { ambient: 0.1, diffuse: 0.5, specular: 0.2, power: 2.0, certain: None };
        let light = |normal: DVec3, direction: DVec3, share: f64| {
            let aside = Some(&Aside { direction, share });
            light((normal, 1.0), (DVec3::Z, aside), &shade, &None)
        };
        let close = |actual: [f64; 2], expected: [f64; 2]| {
            let far = |i: usize| (actual[i] - expected[i]).abs() > 1e-12;
            assert!(!far(0) && !far(1), "{actual:?} {expected:?}");
        };
        let (left, half) = (3.0 * DVec3::NEG_X, 0.5_f64.sqrt());
        // Without a share, it is the eye's light.
        close(light(DVec3::NEG_Z, left, 0.0), [0.6, 0.2]);
        // Between the eye and a lamp at its left is the brightest place.
        close(light(DVec3::new(-1.0, 0.0, -1.0), left, 0.5), [0.6, 0.2 * 0.8]);
        // Half of the light is 0.5 of the brightest, which is half the diagonal of a square. The
        // half vector is three parts of the eye's direction and one of the lamp's.
        close(light(DVec3::NEG_Z, left, 0.5), [0.1 + 0.5 * half, 0.2 * 0.9]);
        // Where the surface is seen from its edge, the lamp does not count.
        close(light(DVec3::NEG_X, left, 0.5), [0.1, 0.2 * 0.1]);
        let edge = DVec3::new(-1.0, 0.0, -0.05).normalize();
        let cosine = -edge.z;
        let expected = 0.5 * (cosine + 10.0 * cosine * -edge.x) / half;
        assert!((light(edge, left, 0.5)[0] - (0.1 + 0.5 * expected)).abs() < 1e-12);
        // What faces away from the lamp only has the eye's, on both sides.
        for normal in [DVec3::new(1.0, 0.0, -1.0), DVec3::new(-1.0, 0.0, 1.0)] {
            close(light(normal, left, 0.5), [0.1 + 0.5 * 0.5, 0.2 * 0.2]);
        }
        // All of it from the lamp.
        let slant = DVec3::new(-1.0, 0.0, -1.0);
        close(light(slant, left, 1.0), [0.1 + 0.5 * half, 0.2]);
        close(light(DVec3::ZERO, left, 0.5), [0.6, 0.0]);
    }

    #[test]
    fn light_fades_with_the_certainty_of_the_gradient() {
        let plain = Shade { ambient: 0.1, diffuse: 0.5, specular: 0.2, power: 2.0, certain: None };
        let shade = Shade { certain: Some([2.0, 4.0]), ..plain };
        let color = DVec3::new(1.0, 0.5, 0.0);
        let of = |normal: DVec3, shade: &Shade| lit(color, normal, DVec3::Z, shade, None);
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
