//! The `.splat` files of antimatter15's viewer: 32 bytes for each trained Gaussian, without a
//! header. All numbers are little-endian. A record has the centre and the standard deviations as
//! three 32-bit floats each, then one byte each for red, green, blue, the opacity, and the
//! quaternion with w first, (byte − 128) / 128.
//!
//! Colours do not depend on the view. The frame is that of the trainer's PLY. Some writers put
//! large and opaque Gaussians first, so that a viewer can show them before the rest is there; the
//! order means nothing else.

use super::shared::trained::{Trained, check_places, settle};
use crate::{
    Error, Result, disk,
    gaussians::{
        Gaussians,
        harmonics::{CONSTANT, constant_of},
    },
    input::Source,
    math::keep::single,
};
use glam::{Quat, Vec3};
use std::{io::Write, path::Path};

/// Bytes of a Gaussian.
const RECORD: usize = 32;

/// Reads the Gaussians. A quaternion of zeros is no turn, as in the viewer.
///
/// # Errors
/// [`Error::Input`] for an empty file, for one that ends inside a Gaussian, and if none of them has
/// finite numbers; [`Error::Limit`] for more Gaussians than the limits allow.
pub fn read(source: &Source) -> Result<Gaussians> {
    let (records, rest) = source.bytes().as_chunks::<RECORD>();
    if !rest.is_empty() {
        let message = format!(
            "the file ends after {} of the {RECORD} bytes of Gaussian {}",
            rest.len(),
            records.len()
        );
        let place = format!("byte {}", records.len() * RECORD);
        return Err(source.error(place, message).hint("the file is cut off or in another format"));
    }
    if records.is_empty() {
        return Err(source.error("file", "is empty"));
    }
    let count = source.check_points("the number of Gaussians", records.len() as u64)?;
    settle(source, count, 0, |index, colors| {
        let (one, color) = decode(&records[index]);
        colors.fill(color);
        Ok(one)
    })
}

/// Returns a Gaussian and the constant term of its colour.
fn decode(record: &[u8; RECORD]) -> (Trained, [f32; 3]) {
    let (words, _) = record.as_chunks::<4>();
    let number = |at: usize| f32::from_le_bytes(words[at]);
    let [r, g, b, alpha] = words[6].map(|byte| f32::from(byte) / 255.0);
    let [w, x, y, z] = words[7].map(|byte| (f32::from(byte) - 128.0) / 128.0);
    let turn = Quat::from_xyzw(x, y, z, w);
    let one = Trained {
        center: Vec3::new(number(0), number(1), number(2)).as_dvec3(),
        scale: Vec3::new(number(3), number(4), number(5)),
        rotation: if turn.length_squared() > 0.0 { turn } else { Quat::IDENTITY },
        opacity: alpha,
    };
    (one, [r, g, b].map(constant_of))
}

/// Writes Gaussians in their order, with 32-bit world positions. Only the constant term of a colour
/// is kept, from 0 to 1. Colours, opacities and rotations are rounded to 8 bits.
///
/// # Errors
/// [`Error::Argument`] for a set that is empty, contradicts itself, or is so far away that 32 bits
/// do not hold its shape; [`Error::Output`] if the file cannot be written.
pub fn write(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    set.validate().map_err(Error::Argument)?;
    check_places(".splat", set, single)?;
    if set.is_empty() {
        return Err(Error::Argument("there are no Gaussians to write".into()));
    }
    disk::write_with(path.as_ref(), |out| {
        (0..set.len()).try_for_each(|index| out.write_all(&record(set, index)))
    })
}

/// Returns the bytes of one Gaussian. Casts to bytes keep to 0 … 255.
fn record(set: &Gaussians, index: usize) -> [u8; RECORD] {
    let center = (set.origin + set.centers[index].as_dvec3()).as_vec3();
    let Vec3 { x, y, z } = set.scales[index];
    let numbers = [center.x, center.y, center.z, x, y, z].map(f32::to_le_bytes);
    let color = set.harmonics_of(index)[0];
    let [r, g, b] = color.map(|term| ((0.5 + CONSTANT * term) * 255.0).round() as u8);
    let alpha = (set.opacities[index] * 255.0).round() as u8;
    let [x, y, z, w] = set.rotations[index].to_array();
    let turn = [w, x, y, z].map(|part| (part * 128.0 + 128.0).round() as u8);
    let mut record = [0; RECORD];
    record[..24].copy_from_slice(numbers.as_flattened());
    record[24..28].copy_from_slice(&[r, g, b, alpha]);
    record[28..].copy_from_slice(&turn);
    record
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::input::testing::*;
    use glam::DVec3;

    /// A Gaussian that is turned by 90° about x.
    fn bytes() -> Vec<u8> {
        let numbers = [1.5f32, -2.0, 0.25, 0.5, 1.0, 2.0].map(f32::to_le_bytes);
        let mut bytes = numbers.as_flattened().to_vec();
        bytes.extend([255, 0, 51, 204, 218, 218, 128, 128]);
        bytes
    }

    #[test]
    fn numbers_are_those_of_the_record() {
        let folder = Folder::new();
        let path = folder.write("a.splat", bytes());
        let set = read_with(&path, read).unwrap();
        assert_eq!((set.len(), set.degree, set.broken.all(), set.validate()), (1, 0, 0, Ok(())));
        let center = set.origin + set.centers[0].as_dvec3();
        assert_eq!(center, DVec3::new(1.5, -2.0, 0.25));
        assert_eq!(set.scales[0], Vec3::new(0.5, 1.0, 2.0));
        assert_eq!(set.opacities[0], 0.8);
        let turn = Quat::from_rotation_x(std::f32::consts::FRAC_PI_2);
        assert!(set.rotations[0].dot(turn) > 0.999_999, "{}", set.rotations[0]);
        // The constant terms of the colours 1, 0 and 0.2.
        let wanted = [1.772_453_9f32, -1.772_453_9, -1.063_472_3];
        for (actual, wanted) in set.harmonics[0].iter().zip(wanted) {
            assert!((actual - wanted).abs() < 1e-5, "{actual} {wanted}");
        }
    }

    #[test]
    fn cuts_and_empty_files_are_errors() {
        let folder = Folder::new();
        every_cut(&folder, "a.splat", &bytes(), read);
        let mut two = [bytes(), bytes()].concat();
        two.truncate(40);
        let path = folder.write("b.splat", two);
        let error = read_with(&path, read).unwrap_err().to_string();
        assert!(error.contains("byte 32: the file ends after 8 of the 32"), "{error}");
        let path = folder.write("c.splat", b"");
        let error = read_with(&path, read).unwrap_err().to_string();
        assert!(error.contains("is empty"), "{error}");
    }

    #[test]
    fn broken_ones_are_left_out_and_no_turn_is_none() {
        let folder = Folder::new();
        let (mut still, mut broken) = (bytes(), bytes());
        still[28..].fill(128);
        broken[..4].copy_from_slice(&f32::NAN.to_le_bytes());
        let path = folder.write("a.splat", [bytes(), broken, still].concat());
        let set = read_with(&path, read).unwrap();
        assert_eq!((set.len(), set.broken.all(), set.rotations[1]), (2, 1, Quat::IDENTITY));
    }

    #[test]
    fn a_written_set_is_read_again() {
        let folder = Folder::new();
        let set = Gaussians {
            origin: DVec3::new(0.0, 100.0, 0.0),
            centers: vec![Vec3::X, Vec3::new(-3.0, 2.0, 0.125)],
            scales: vec![Vec3::ONE, Vec3::new(0.1, 0.0, 3.0)],
            rotations: vec![
                Quat::from_rotation_y(-1.0),
                Quat::from_xyzw(0.1, 0.7, -0.1, 0.7).normalize(),
            ],
            opacities: vec![1.0, 0.3],
            degree: 1,
            // The second colour is outside of 0 … 1.
            harmonics: vec![[0.5, -0.5, 0.1], [9.0; 3], [9.0; 3], [9.0; 3]]
                .into_iter()
                .chain([[4.0, -4.0, 0.0], [9.0; 3], [9.0; 3], [9.0; 3]])
                .collect(),
            ..Gaussians::default()
        };
        let path = folder.path("a.splat");
        write(&set, &path).unwrap();
        let loaded = read_with(&path, read).unwrap();
        assert_eq!((loaded.len(), loaded.degree, &loaded.scales), (2, 0, &set.scales));
        let half = 0.5 / 255.0 / CONSTANT + 1e-5;
        let wanted = [set.harmonics[0], [0.5 / CONSTANT, -0.5 / CONSTANT, 0.0]];
        for (index, wanted) in wanted.iter().enumerate() {
            let place = |set: &Gaussians| set.origin + set.centers[index].as_dvec3();
            assert_eq!(place(&loaded), place(&set));
            assert!((loaded.opacities[index] - set.opacities[index]).abs() < 0.002);
            assert!(loaded.rotations[index].dot(set.rotations[index]).abs() > 0.999_9);
            let color = loaded.harmonics_of(index)[0];
            let near = color.iter().zip(wanted).all(|(a, b)| (a - b).abs() < half);
            assert!(near, "{color:?} {wanted:?}");
        }
        let none = write(&Gaussians::default(), folder.path("b.splat"));
        assert!(matches!(none, Err(Error::Argument(_))));
        let mut wrong = set;
        wrong.scales.pop();
        assert!(matches!(write(&wrong, &path), Err(Error::Argument(_))));
    }
}
