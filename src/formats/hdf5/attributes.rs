//! What the attributes of a data set say of its values and of the distances between samples.

use crate::{
    Result,
    input::Source,
    parallel::prelude::*,
    volume::{Lattice, Samples, Volume, each_type},
};
use glam::DVec3;
use hdf5_pure::AttrValue;
use std::collections::HashMap;

/// Names of attributes with the distances along the dimensions, slowest first, and their unit.
const SPACINGS: [(&str, &str); 7] = [
    ("element_size_um", "µm"),
    ("element_size_mm", "mm"),
    ("voxel_size_um", "µm"),
    ("voxel_size", ""),
    ("voxelsize", ""),
    ("spacing", ""),
    ("resolution", ""),
];

/// The attributes that are followed.
#[derive(Debug, Default, PartialEq)]
pub struct Attributes {
    /// The distances along x, y and z.
    pub spacing: Option<[f64; 3]>,
    pub length: &'static str,
    pub name: String,
    pub unit: String,
    /// Values are these times the stored ones, plus an offset.
    pub scale: [f64; 2],
    pub missing: Option<f64>,
}

impl Attributes {
    pub fn of(all: &HashMap<String, AttrValue>) -> Self {
        let number = |name: &str| all.get(name).and_then(|value| numbers(value).first().copied());
        let text = |names: &[&str]| {
            let value = names.iter().find_map(|&name| all.get(name)?.as_str());
            value.unwrap_or_default().trim().chars().take(64).collect::<String>()
        };
        let spacing = SPACINGS.iter().find_map(|&(name, unit)| {
            let is_length = |&v: &f64| v.is_finite() && v > 0.0;
            // A dimension of channels or times may have a distance of its own.
            let all = numbers(all.get(name)?);
            let [.., z, y, x] = all[..] else { return None };
            [x, y, z].iter().all(is_length).then_some(([x, y, z], unit))
        });
        Self {
            spacing: spacing.map(|(spacing, _)| spacing),
            length: spacing.map_or("", |(_, unit)| unit),
            name: text(&["long_name", "standard_name"]),
            unit: text(&["units", "unit"]),
            scale: [number("scale_factor").unwrap_or(1.0), number("add_offset").unwrap_or(0.0)],
            missing: number("_FillValue").or_else(|| number("missing_value")),
        }
    }

    /// Applies them to a volume whose samples are one unit apart.
    pub fn apply(&self, source: &Source, volume: &mut Volume) -> Result<()> {
        if let Some(spacing) = self.spacing {
            let lattice = Lattice::with_spacing(volume.lattice.dims, DVec3::from(spacing));
            lattice.check().map_err(|message| source.error("attributes", message))?;
            volume.lattice = lattice;
        }
        volume.about.length = self.length.into();
        volume.about.name.clone_from(&self.name);
        volume.about.unit.clone_from(&self.unit);
        let [scale, offset] = self.scale;
        if (scale, offset) == (1.0, 0.0) || !scale.is_finite() || !offset.is_finite() {
            return Ok(());
        }
        source.room::<f32>("the scaled samples", volume.len())?;
        let scaled = each_type!(volume.samples, values => values
            .par_iter()
            .map(|&value| (f64::from(value) * scale + offset) as f32)
            .collect());
        let holes = volume.about.holes;
        let about = std::mem::take(&mut volume.about);
        *volume = Volume::checked(volume.lattice.clone(), Samples::F32(scaled))
            .map_err(|message| source.error("samples", message))?;
        volume.about = about;
        volume.about.holes = holes;
        Ok(())
    }
}

/// Returns the numbers of an attribute; none if it is text.
pub fn numbers(value: &AttrValue) -> Vec<f64> {
    let wide = |all: Vec<i64>| all.into_iter().map(|v| v as f64).collect();
    value.to_f64s().or_else(|| value.to_i64s().map(wide)).unwrap_or_default()
}
