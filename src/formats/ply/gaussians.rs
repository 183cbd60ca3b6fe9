//! Writes splats as the PLY of 3D Gaussian scenes (Kerbl et al. 2023), which many viewers open. The
//! file is binary and little-endian. Each vertex has position, normal, colour as the constant
//! spherical harmonic, opacity, logarithms of the standard deviations, and a quaternion.

use super::header::Element;
use crate::{
    Error, Result, disk,
    input::Source,
    math::eigen,
    splat::{Payload, Splat, SplatSet, decode_normal},
};
use glam::{DMat3, DQuat, DVec3};
use std::{io::Write, path::Path};

/// The constant spherical harmonic, 1 / (2·√π).
const HARMONIC: f64 = 0.282_094_791_773_878_14;

const PROPERTIES: [&str; 17] = [
    "x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2", "opacity", "scale_0", "scale_1",
    "scale_2", "rot_0", "rot_1", "rot_2", "rot_3",
];

/// Writes splats as 3D Gaussians, in 32-bit world coordinates. Apart from that precision, their
/// shading and the extent of their footprints are lost.
///
/// # Errors
/// [`Error::Argument`] for scalar splats, which have no colours; [`Error::Output`] if the file
/// cannot be written.
pub fn write_gaussians(set: &SplatSet, path: impl AsRef<Path>) -> Result<()> {
    if set.payload != Payload::Radiance {
        return Err(Error::Argument(
            "samples of a volume have no colours to write as Gaussians".into(),
        ));
    }
    disk::write_with(path.as_ref(), |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", set.splats.len())?;
        PROPERTIES.iter().try_for_each(|name| writeln!(out, "property float {name}"))?;
        writeln!(out, "end_header")?;
        for splat in &set.splats {
            let bytes = gaussian(splat, set.origin).map(|value| (value as f32).to_le_bytes());
            out.write_all(bytes.as_flattened())?;
        }
        Ok(())
    })
}

/// Returns whether a vertex has the properties that trainers of 3D Gaussian scenes write.
pub(super) fn are_gaussians(element: &Element) -> bool {
    ["f_dc_0", "opacity", "scale_0", "rot_0"].iter().all(|name| element.column(&[name]).is_some())
}

/// Warns that a file contains 3D Gaussians: read as points, they do not look like the scene.
pub(in super::super) fn warn(source: &Source) {
    tracing::warn!(
        "{}: contains trained 3D Gaussians, whose shapes and colours are not read yet; their \
         centres are drawn as points",
        source.path.display()
    );
}

/// Returns the numbers of one splat, in the order of [`PROPERTIES`].
fn gaussian(splat: &Splat, origin: DVec3) -> [f64; PROPERTIES.len()] {
    let center = origin + DVec3::from(splat.center.map(f64::from));
    let normal = decode_normal(splat.normal).unwrap_or_default().as_dvec3();
    let color =
        [0, 8, 16].map(|shift| (f64::from(splat.color >> shift & 255) / 255.0 - 0.5) / HARMONIC);
    let depth = f64::from(splat.strength) * f64::from(splat.color >> 24) / 255.0;
    // The logit of 1 − e^−depth is the logarithm of e^depth − 1. If that is not finite, the clamp
    // makes the opacity almost 0 or 1.
    let opacity = depth.exp_m1().ln().clamp(-16.0, 16.0);
    let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
    let b = DMat3::from_cols(
        DVec3::new(b00, b10, b20),
        DVec3::new(0.0, b11, b21),
        DVec3::new(0.0, 0.0, b22),
    );
    let (squares, [first, second, _]) = eigen(b * b.transpose());
    let [s0, s1, s2] = squares.map(|square| 0.5 * square.max(f64::from(f32::MIN_POSITIVE)).ln());
    let turn = DQuat::from_mat3(&DMat3::from_cols(first, second, first.cross(second))).normalize();
    let [r, g, b] = color;
    let (place, n) = (center, normal);
    [
        place.x, place.y, place.z, n.x, n.y, n.z, r, g, b, opacity, s0, s1, s2, turn.w, turn.x,
        turn.y, turn.z,
    ]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{input::testing::Folder, surface::Mesh};

    #[test]
    fn gaussians_are_the_splats() {
        let folder = Folder::new();
        let path = folder.path("scene.ply");
        let set = Mesh::sphere(2).surfels(&Default::default()).unwrap();
        write_gaussians(&set, &path).unwrap();
        let bytes = std::fs::read(&path).unwrap();
        let end = bytes.windows(11).position(|w| w == b"end_header\n").unwrap() + 11;
        let header = crate::input::copy::text(&bytes[..end]).unwrap();
        assert!(header.contains(&format!("element vertex {}\n", set.splats.len())));
        let rows: Vec<[f32; 17]> = bytes[end..]
            .chunks_exact(68)
            .map(|row| {
                std::array::from_fn(|i| {
                    f32::from_le_bytes(row[4 * i..4 * i + 4].try_into().unwrap())
                })
            })
            .collect();
        assert_eq!((rows.len(), bytes[end..].len() % 68), (set.splats.len(), 0));
        for (row, splat) in rows.iter().zip(&set.splats) {
            let center = set.origin + DVec3::from(splat.center.map(f64::from));
            assert!(
                center.distance(DVec3::new(row[0].into(), row[1].into(), row[2].into())) < 1e-6
            );
            let depth = f64::from(splat.strength) * f64::from(splat.color >> 24) / 255.0;
            let opacity = 1.0 / (1.0 + (-f64::from(row[9])).exp());
            assert!((opacity - (1.0 - (-depth).exp())).abs() < 1e-6);
            let color = f64::from(row[6]) * HARMONIC + 0.5;
            assert!((color - f64::from(splat.color & 255) / 255.0).abs() < 1e-6);
            // R · diag(σ²) · Rᵀ is B · Bᵀ.
            let [w, x, y, z] = [row[13], row[14], row[15], row[16]].map(f64::from);
            let turn = DMat3::from_quat(DQuat::from_xyzw(x, y, z, w));
            let scale = DVec3::new(row[10].into(), row[11].into(), row[12].into()).exp();
            let found = turn * DMat3::from_diagonal(scale * scale) * turn.transpose();
            let [b00, b10, b11, b20, b21, b22] = splat.factor.map(f64::from);
            let b = DMat3::from_cols(
                DVec3::new(b00, b10, b20),
                DVec3::new(0.0, b11, b21),
                DVec3::new(0.0, 0.0, b22),
            );
            let wanted = b * b.transpose();
            let miss = (found - wanted).to_cols_array().iter().map(|v| v.abs()).fold(0.0, f64::max);
            assert!(miss < 1e-5 * scale.x * scale.x, "{miss}");
            let normal = DVec3::new(row[3].into(), row[4].into(), row[5].into());
            assert!((normal.length() - 1.0).abs() < 1e-5);
        }
    }

    #[test]
    fn samples_are_refused() {
        let folder = Folder::new();
        let mut set = Mesh::sphere(1).surfels(&Default::default()).unwrap();
        set.payload = Payload::Scalar;
        let path = folder.path("samples.ply");
        assert!(matches!(write_gaussians(&set, &path), Err(Error::Argument(_))));
        assert!(!path.exists());
    }
}
