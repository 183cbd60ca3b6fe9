//! Meshes and point clouds in memory.

use super::{
    Editable, Mapping, Motion,
    coarser::coarsen,
    find,
    records::{plain_column, plain_names},
    retain,
    thin::Thin,
};
use crate::{
    Error, Result,
    formats::{Attribute, Records},
    parallel::prelude::*,
    surface::{Mesh, SurfelOptions},
};
use glam::{DVec3, Vec3};

/// A mesh or point cloud with attributes.
#[derive(Debug, Clone, Default)]
pub struct Surface {
    /// The mesh.
    pub mesh: Mesh,
    /// Attributes of its vertices, each with a value for each.
    pub columns: Vec<(Attribute, Vec<f64>)>,
}

impl From<Mesh> for Surface {
    fn from(mesh: Mesh) -> Self {
        Self { mesh, columns: Vec::new() }
    }
}

impl Surface {
    /// Returns the vertices as points.
    pub fn into_records(self) -> Records {
        let Self { mesh, columns } = self;
        let (attributes, columns) = columns.into_iter().unzip();
        let place = |place: &Vec3| mesh.origin + place.as_dvec3();
        Records {
            positions: mesh.positions.par_iter().map(place).collect(),
            normals: mesh.normals,
            colors: mesh.colors,
            attributes,
            columns,
        }
    }
}

impl Editable for Surface {
    fn count(&self) -> usize {
        self.mesh.positions.len()
    }

    fn place(&self, index: usize) -> DVec3 {
        self.mesh.origin + self.mesh.positions[index].as_dvec3()
    }

    fn names(&self) -> Vec<String> {
        let attributes = self.columns.iter().map(|(attribute, _)| attribute.name.clone());
        attributes.chain(plain_names(&self.mesh.normals, &self.mesh.colors)).collect()
    }

    fn column(&self, name: &str) -> Option<Vec<f64>> {
        let names = self.columns.iter().map(|(attribute, _)| attribute.name.as_str());
        match find(names, name) {
            Some(at) => Some(self.columns[at].1.clone()),
            None => plain_column(&self.mesh.normals, &self.mesh.colors, name),
        }
    }

    fn keep(&mut self, kept: &[bool]) {
        self.mesh.keep(kept);
        self.columns.iter_mut().for_each(|(_, column)| retain(column, kept, 1));
    }

    fn move_by(&mut self, motion: &Motion) {
        let mesh = &mut self.mesh;
        let (origin, linear) = (motion.place(mesh.origin), motion.linear());
        let moved = |place: &mut Vec3| *place = (linear * place.as_dvec3()).as_vec3();
        mesh.origin = origin;
        mesh.positions.par_iter_mut().for_each(moved);
        let turned = |normal: &mut Vec3| *normal = motion.normal(normal.as_dvec3()).as_vec3();
        mesh.normals.par_iter_mut().for_each(turned);
        mesh.sensors.iter_mut().for_each(|sensor| moved(&mut sensor.position));
        let scale = motion.mean_scale() as f32;
        mesh.radii.par_iter_mut().for_each(|radius| *radius *= scale);
        if linear.determinant() < 0.0 {
            mesh.triangles.par_iter_mut().for_each(|[_, b, c]| std::mem::swap(b, c));
        }
    }

    fn reproject(&mut self, mapping: &Mapping) -> Result<()> {
        let mesh = &mut self.mesh;
        let place = |place: &Vec3| mesh.origin + place.as_dvec3();
        let places: Vec<DVec3> = mesh.positions.iter().map(place).collect();
        let Some(middle) = places.get(places.len() / 2) else { return Ok(()) };
        for (normal, place) in mesh.normals.iter_mut().zip(&places) {
            let turned = mapping.linear(*place).inverse().transpose() * normal.as_dvec3();
            *normal = turned.normalize_or_zero().as_vec3();
        }
        let scale = mapping.linear(*middle).determinant().abs().sqrt() as f32;
        mesh.radii.par_iter_mut().for_each(|radius| *radius *= scale);
        let origin = mapping.place(*middle)?;
        for (position, place) in mesh.positions.iter_mut().zip(&places) {
            *position = (mapping.place(*place)? - origin).as_vec3();
        }
        for sensor in &mut mesh.sensors {
            let place = mapping.place(mesh.origin + sensor.position.as_dvec3())?;
            sensor.position = (place - origin).as_vec3();
        }
        mesh.origin = origin;
        Ok(())
    }

    fn thin(&mut self, thin: &Thin) -> Result<()> {
        if !self.mesh.lines.is_empty() {
            return Err(Error::Argument("lines are not thinned: their points are joined".into()));
        }
        let mut kept = thin.kept(&self.mesh.positions)?;
        if !self.mesh.triangles.is_empty() {
            coarsen(&mut self.mesh, &mut kept);
        }
        self.keep(&kept);
        Ok(())
    }

    fn estimate_normals(&mut self) -> Result<()> {
        self.mesh.estimate_normals(&SurfelOptions::default())
    }

    fn pairs(&self) -> Vec<[u32; 2]> {
        let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c]];
        let lines = self.mesh.lines.iter().copied();
        self.mesh.triangles.iter().flat_map(sides).chain(lines).collect()
    }
}
