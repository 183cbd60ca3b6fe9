//! Points with attributes, read in pieces.

use super::{Editable, Mapping, Motion, find, retain, thin::Thin};
use crate::{
    Deadline, Result,
    formats::Records,
    surface::{Mesh, SurfelOptions},
};
use glam::{DVec3, Vec3};

/// The names of normals and colours.
pub(super) const NORMAL: [&str; 3] = ["nx", "ny", "nz"];
pub(super) const COLOR: [&str; 4] = ["red", "green", "blue", "alpha"];

impl Records {
    /// Adds points. Where some have no value of an attribute, it is not a number; where some have
    /// no normals or colours, they are 0 and white.
    pub(crate) fn join(&mut self, other: Self) {
        let (before, after) = (self.positions.len(), self.positions.len() + other.positions.len());
        self.positions.extend(other.positions);
        if !self.normals.is_empty() || !other.normals.is_empty() {
            self.normals.resize(before, Vec3::ZERO);
            self.normals.extend(other.normals);
            self.normals.resize(after, Vec3::ZERO);
        }
        if !self.colors.is_empty() || !other.colors.is_empty() {
            self.colors.resize(before, [255; 4]);
            self.colors.extend(other.colors);
            self.colors.resize(after, [255; 4]);
        }
        for (attribute, more) in other.attributes.into_iter().zip(other.columns) {
            let known = self.attributes.iter().position(|known| known.name == attribute.name);
            let at = known.unwrap_or_else(|| {
                self.attributes.push(attribute);
                self.columns.push(vec![f64::NAN; before]);
                self.columns.len() - 1
            });
            self.columns[at].extend(more);
        }
        self.columns.iter_mut().for_each(|column| column.resize(after, f64::NAN));
    }
}

impl Editable for Records {
    fn count(&self) -> usize {
        self.positions.len()
    }

    fn place(&self, index: usize) -> DVec3 {
        self.positions[index]
    }

    fn names(&self) -> Vec<String> {
        let attributes = self.attributes.iter().map(|attribute| attribute.name.clone());
        let plain = plain_names(&self.normals, &self.colors);
        // Attributes hold colours in 16 bits.
        let is_other = |name: &String| !self.attributes.iter().any(|known| known.name == *name);
        attributes.chain(plain.filter(is_other)).collect()
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let names = self.attributes.iter().map(|attribute| attribute.name.as_str());
        match find(names, name) {
            Some(at) => Some(self.columns[at].clone()),
            None => plain_column(&self.normals, &self.colors, name),
        }
    }

    fn keep(&mut self, kept: &[bool]) {
        retain(&mut self.positions, kept, 1);
        retain(&mut self.normals, kept, 1);
        retain(&mut self.colors, kept, 1);
        self.columns.iter_mut().for_each(|column| retain(column, kept, 1));
    }

    fn move_by(&mut self, motion: &Motion) {
        self.positions.iter_mut().for_each(|place| *place = motion.place(*place));
        for normal in &mut self.normals {
            *normal = motion.normal(normal.as_dvec3()).as_vec3();
        }
    }

    fn reproject(&mut self, mapping: &Mapping) -> Result<()> {
        for (normal, place) in self.normals.iter_mut().zip(&self.positions) {
            let turned = mapping.linear(*place).inverse().transpose() * normal.as_dvec3();
            *normal = turned.normalize_or_zero().as_vec3();
        }
        for place in &mut self.positions {
            *place = mapping.place(*place)?;
        }
        Ok(())
    }

    fn thin(&mut self, thin: &Thin) -> Result<()> {
        let (_, places) = super::local_places(self);
        let kept = thin.kept(&places)?;
        self.keep(&kept);
        Ok(())
    }

    fn estimate_normals(&mut self) -> Result<()> {
        let (_, positions) = super::local_places(self);
        let mut mesh = Mesh { positions, ..Mesh::default() };
        let options = SurfelOptions { deadline: Deadline::NEVER, ..SurfelOptions::default() };
        mesh.estimate_normals(&options)?;
        self.normals = mesh.normals;
        Ok(())
    }
}

/// Returns the names of normals and colours, if there are any.
pub(super) fn plain_names(
    normals: &[glam::Vec3],
    colors: &[[u8; 4]],
) -> impl Iterator<Item = String> + use<> {
    let normals = NORMAL.into_iter().filter(|_| !normals.is_empty()).collect::<Vec<_>>();
    let colors = COLOR.into_iter().filter(|_| !colors.is_empty()).collect::<Vec<_>>();
    normals.into_iter().chain(colors).map(str::to_owned)
}

/// Returns the values of a normal's part, or of a colour's from 0 to 255.
pub(super) fn plain_column(
    normals: &[glam::Vec3],
    colors: &[[u8; 4]],
    name: &str,
) -> Option<Vec<f64>> {
    if let Some(axis) = find(NORMAL.into_iter(), name).filter(|_| !normals.is_empty()) {
        return Some(normals.iter().map(|normal| f64::from(normal[axis])).collect());
    }
    let channel = find(COLOR.into_iter(), name).filter(|_| !colors.is_empty())?;
    Some(colors.iter().map(|color| f64::from(color[channel])).collect())
}
