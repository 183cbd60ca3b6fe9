//! Inputs of several formats as one cloud, for edits that compare all points.
//!
//! What is read in pieces is merged on the way (`points`). This is for the rest: every input is
//! read whole.

use super::{Watch, Work, points::narrowest, splats::Frame, wrong};
use crate::{
    Error, Result,
    about::Orientation,
    edit::{self, Edit},
    formats::Records,
    session::Data,
    surface::Mesh,
};
use std::path::Path;

/// The points of all inputs, edited.
pub struct Merged {
    pub records: Records,
    /// How the first input stands.
    pub orientation: Option<Orientation>,
    /// Points that were read.
    pub points: u64,
}

impl<W: Watch> Work<'_, W> {
    /// Returns the edit that compares the points of several inputs, if there is one.
    pub fn comparing(&self) -> Option<&Edit> {
        let mut edits = self.conversion.edits.iter();
        edits.find(|edit| !edit.is_local()).filter(|_| self.files.len() > 1)
    }

    /// Reads all inputs and edits them as one cloud. They keep all attributes, or those that edits
    /// need and those of these names. With `are_points`, triangles are an error.
    pub fn merged(&self, names: Option<&[String]>, are_points: bool) -> Result<Merged, W::Error> {
        let (mut all, mut first) = (Records::default(), None);
        let mut systems: Vec<String> = Vec::new();
        for path in self.files {
            let mesh = self.mesh_of(path)?;
            if are_points && !mesh.triangles.is_empty() {
                return Err(self.not_points(path).into());
            }
            let wanted = |name: &&String| {
                names.is_none_or(|names| names.contains(name)) || self.is_asked(name)
            };
            let columns: Vec<String> =
                mesh.about.attributes.iter().filter(wanted).cloned().collect();
            systems.push(mesh.about.crs.clone());
            if first.is_none() {
                first = Some(Frame::of(mesh.about.orientation, || Ok(mesh.guess_orientation()))?);
            }
            all.join(self.surface(path, mesh, &columns)?.into_records());
        }
        for (attribute, values) in all.attributes.iter_mut().zip(&all.columns) {
            attribute.kind = narrowest(values);
        }
        let is_mapped = self.conversion.edits.iter().any(|edit| matches!(edit, Edit::Reproject(_)));
        if is_mapped && systems.windows(2).any(|pair| pair[0] != pair[1]) {
            return Err(wrong(
                "the inputs have different coordinate reference systems; convert each with \
                 --reproject to .laz first, and edit these together",
            )
            .into());
        }
        let (frame, path) = (first.unwrap_or_default(), &self.files[0]);
        let crs = systems.into_iter().next().unwrap_or_default();
        let context = self.context(path, frame.up(self.conversion.up), crs);
        let points = all.positions.len() as u64;
        self.watch.stage("Editing the points of all inputs");
        self.watch.has_edited(&edit::apply(&mut all, &self.conversion.edits, &context)?);
        Ok(Merged { records: all, orientation: frame.orientation, points })
    }

    /// Reads an input whole, as a mesh or cloud.
    pub fn mesh_of(&self, path: &Path) -> Result<Mesh, W::Error> {
        self.watch.stage(&format!("Reading {}", path.display()));
        let reading = self.conversion.reading(Some(self.conversion.most_memory()));
        let opened = reading.open_colored(path, self.conversion.attribute())?;
        let data = opened.read()?.with_surface_of_bare_cells()?;
        self.watch.has_read(&opened.files())?;
        let Data::Mesh(mesh) = data else {
            if self.comparing().is_some() {
                return Err(self.not_points(path).into());
            }
            let message = "holds no mesh or point cloud, of which points are written; trained \
                           Gaussians and hierarchies are written as .splk, .ply, .splat, .spz, \
                           .sog or .glb";
            return Err(wrong(format!("{} {message}", path.display())).into());
        };
        Ok(mesh)
    }

    /// Whether a condition asks for an attribute.
    pub fn is_asked(&self, name: &str) -> bool {
        self.conversion.edits.iter().any(|edit| match edit {
            Edit::Where(expression) => {
                expression.names().any(|wanted| wanted.eq_ignore_ascii_case(name))
            }
            _ => false,
        })
    }

    /// The error for an input without points among those that an edit compares.
    fn not_points(&self, path: &Path) -> Error {
        let edit = self.comparing().map_or("thin", Edit::name);
        wrong(format!(
            "{} holds no point cloud, and --{edit} compares the points of all inputs, which are \
             merged first only if all are point clouds, or all trained Gaussians; convert the \
             others one by one",
            path.display()
        ))
    }
}
