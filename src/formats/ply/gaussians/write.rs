//! Writes the PLY of trainers of 3D Gaussian scenes, which most viewers open.

use super::log_of_scale;
use crate::{
    Error, Result, disk,
    formats::shared::trained::{check_places, logit_of_opacity},
    gaussians::{Gaussians, harmonics::terms},
    math::keep::single,
};
use std::{io::Write, path::Path};

/// The properties before and after the harmonics above the constant. Trainers write normals of
/// zero, and some programs expect them.
const BEFORE: [&str; 9] = ["x", "y", "z", "nx", "ny", "nz", "f_dc_0", "f_dc_1", "f_dc_2"];
const BEHIND: [&str; 8] =
    ["opacity", "scale_0", "scale_1", "scale_2", "rot_0", "rot_1", "rot_2", "rot_3"];

/// Writes trained Gaussians as their trainers do: binary, little-endian, with 32-bit world
/// coordinates.
///
/// # Errors
/// [`Error::Argument`] if the set is not valid ([`Gaussians::validate`]), or so far away that 32
/// bits do not hold its shape; [`Error::Output`] if the file cannot be written.
pub fn write_gaussians(set: &Gaussians, path: impl AsRef<Path>) -> Result<()> {
    set.validate().map_err(Error::Argument)?;
    check_places("PLY", set, single)?;
    disk::write_with(path.as_ref(), |out| {
        writeln!(out, "ply\nformat binary_little_endian 1.0\nelement vertex {}", set.len())?;
        let rest = (0..3 * (terms(set.degree) - 1)).map(|number| format!("f_rest_{number}"));
        let names = BEFORE.map(String::from).into_iter().chain(rest);
        for name in names.chain(BEHIND.map(String::from)) {
            writeln!(out, "property float {name}")?;
        }
        writeln!(out, "end_header")?;
        let mut row = Vec::new();
        for index in 0..set.len() {
            row.clear();
            fill(set, index, &mut row);
            out.write_all(&row)?;
        }
        Ok(())
    })
}

/// Adds the bytes of one Gaussian.
fn fill(set: &Gaussians, index: usize, row: &mut Vec<u8>) {
    let mut put = |values: &[f32]| values.iter().for_each(|value| row.extend(value.to_le_bytes()));
    let center = set.origin + set.centers[index].as_dvec3();
    put(&center.as_vec3().to_array());
    put(&[0.0; 3]);
    let colors = set.harmonics_of(index);
    put(&colors[0]);
    for channel in 0..3 {
        colors[1..].iter().for_each(|color| put(&[color[channel]]));
    }
    put(&[logit_of_opacity(set.opacities[index])]);
    put(&set.scales[index].to_array().map(log_of_scale));
    let [x, y, z, w] = set.rotations[index].to_array();
    put(&[w, x, y, z]);
}
