//! Inputs as scenes that are edited, measured and compared.

use super::{Data, Opened};
use crate::{
    Error, Result,
    about::Orientation,
    edit::{
        self, Change, Context, Edit, Editable, Expression, Pass, Statistics, Surface, statistics,
    },
    formats::{Attribute, NumberType, Records, Stream},
    gaussians::Gaussians,
    surface::Mesh,
};
use glam::DVec3;

/// An input that edits change before it is drawn.
pub struct EditedInput {
    content: Content,
    context: Context,
}

enum Content {
    Surface(Box<Surface>),
    Gaussians(Box<Gaussians>),
}

impl EditedInput {
    /// Takes what was read of an input, with its values of these names. `up` is the direction of
    /// heights if the input does not count.
    ///
    /// # Errors
    /// [`Error::Input`] for data that edits do not change before they are drawn; those of reading
    /// values.
    pub(super) fn new(
        opened: &Opened,
        data: Data,
        names: &[&str],
        up: Option<DVec3>,
    ) -> Result<Self> {
        let crs = match &data {
            Data::Mesh(mesh) => mesh.about.crs.clone(),
            _ => String::new(),
        };
        let (content, stated) = match data {
            Data::Mesh(mesh) => {
                let orientation = mesh.about.orientation.or_else(|| mesh.guess_orientation());
                let surface = opened.surface(mesh, |name| {
                    let plain = name.strip_prefix("scalar_").unwrap_or(name);
                    let is_it = |wanted: &&str| {
                        [name, plain].iter().any(|name| wanted.eq_ignore_ascii_case(name))
                    };
                    names.iter().any(is_it)
                })?;
                (Content::Surface(Box::new(surface)), orientation)
            }
            Data::Gaussians(set) => {
                // Trainers do not say what is up: it is −y.
                let orientation = set.about.orientation.unwrap_or(Orientation::Y_DOWN);
                (Content::Gaussians(Box::new(set)), Some(orientation))
            }
            Data::Hierarchy(hierarchy) => match hierarchy.gaussians()? {
                Some(set) => (Content::Gaussians(Box::new(set)), hierarchy.header().orientation),
                None => return Err(refused(opened, "a hierarchy of surfaces")),
            },
            Data::Volume(_) | Data::Bricks(_) => return Err(refused(opened, "a volume")),
            Data::Samples(_) => return Err(refused(opened, "scattered samples")),
            Data::Cells(_) => return Err(refused(opened, "cells")),
        };
        let up = up.unwrap_or_else(|| stated.map_or(DVec3::Y, |orientation| orientation.up));
        let context = Context { file: opened.path().to_owned(), up, crs, ..Context::default() };
        Ok(Self { content, context })
    }

    /// Makes edits in their order, and says what each did.
    ///
    /// # Errors
    /// Those of [`edit::apply`].
    pub fn apply(&mut self, edits: &[Edit]) -> Result<Vec<Change>> {
        match &mut self.content {
            Content::Surface(surface) => edit::apply(&mut **surface, edits, &self.context),
            Content::Gaussians(set) => edit::apply(&mut **set, edits, &self.context),
        }
    }

    /// Returns which vertices, points or Gaussians meet a condition.
    ///
    /// # Errors
    /// Those of [`edit::select`].
    pub fn select(&self, condition: &Expression) -> Result<Vec<bool>> {
        match &self.content {
            Content::Surface(surface) => edit::select(&**surface, condition, &self.context),
            Content::Gaussians(set) => edit::select(&**set, condition, &self.context),
        }
    }

    /// Returns the vertices, points or Gaussians.
    pub fn scene(&self) -> &dyn Editable {
        match &self.content {
            Content::Surface(surface) => &**surface,
            Content::Gaussians(set) => &**set,
        }
    }

    /// Returns the corners of the triangles; none of points and Gaussians.
    pub fn triangles(&self) -> &[[u32; 3]] {
        match &self.content {
            Content::Surface(surface) => &surface.mesh.triangles,
            Content::Gaussians(_) => &[],
        }
    }

    /// Returns what is left.
    pub(super) fn into_data(self) -> Data {
        match self.content {
            Content::Surface(surface) => Data::Mesh(surface.mesh),
            Content::Gaussians(set) => Data::Gaussians(*set),
        }
    }
}

/// Returns the error for an input of a kind that is not edited.
fn refused(opened: &Opened, kind: &str) -> Error {
    let message = format!("{kind} cannot be edited before it is drawn");
    let hint = match kind {
        "a hierarchy of surfaces" => {
            "splatkit convert edits it into another file; or edit the file that it was made from"
        }
        _ => "edits are for meshes, point clouds and trained Gaussians; --clip cuts every picture",
    };
    Error::input(opened.path(), "edits", message).hint(hint)
}

impl Opened<'_> {
    /// Returns data that was read from this input as a scene with all its values.
    ///
    /// # Errors
    /// Those of reading attributes; [`Error::Argument`] for volumes, cells and samples.
    pub fn scene(&self, data: Data) -> Result<Box<dyn Editable>> {
        Ok(match data {
            Data::Mesh(mesh) => self.points(mesh)?,
            Data::Gaussians(set) => Box::new(set),
            Data::Hierarchy(hierarchy) => match hierarchy.gaussians()? {
                Some(set) => Box::new(set),
                None => Box::new(hierarchy.leaves()?),
            },
            Data::Volume(_) | Data::Samples(_) | Data::Cells(_) | Data::Bricks(_) => {
                return Err(Error::Argument(format!(
                    "{} holds a volume, cells or samples, and not points, a mesh, a hierarchy or \
                     trained Gaussians",
                    self.path().display()
                )));
            }
        })
    }

    /// Returns the vertices of a mesh or cloud with all attributes: in 64 bits, if the file is read
    /// in pieces.
    fn points(&self, mesh: Mesh) -> Result<Box<dyn Editable>> {
        if mesh.triangles.is_empty()
            && self.held().is_none()
            && let Some(stream) = Stream::open(self.path(), self.limits())?
        {
            drop(mesh);
            let pass = Pass::new(vec![stream], &[], Context::default(), None, None)?;
            let mut all = Records::default();
            pass.run(|records| {
                all.join(records);
                Ok(())
            })?;
            return Ok(Box::new(all));
        }
        Ok(Box::new(self.surface(mesh, |_| true)?))
    }

    /// Returns a mesh or cloud with its attributes of some names.
    fn surface(&self, mesh: Mesh, is_wanted: impl Fn(&str) -> bool) -> Result<Surface> {
        let (count, names) = (mesh.positions.len(), mesh.about.attributes.clone());
        let mut surface = Surface::from(mesh);
        for name in names.into_iter().filter(|name| is_wanted(name)) {
            if let Some(values) = self.values(&name)?.filter(|values| values.len() == count) {
                let values = values.into_iter().map(f64::from).collect();
                surface.columns.push((Attribute { name, kind: NumberType::F32 }, values));
            }
        }
        Ok(surface)
    }

    /// Returns the statistics of everything that data from this input has values of.
    ///
    /// # Errors
    /// Those of reading attributes.
    pub fn statistics(&self, data: Data) -> Result<Vec<Statistics>> {
        let values = match &data {
            Data::Volume(volume) => (0..volume.len()).map(|index| volume.value(index)).collect(),
            Data::Samples(points) => points.values.iter().copied().map(f64::from).collect(),
            Data::Cells(cells) => cells.values.iter().copied().map(f64::from).collect(),
            Data::Bricks(_) => {
                return Err(Error::Argument(format!(
                    "{}: statistics are made of what is read whole; of a volume in bricks, ask for \
                     those of the volume that it was made from",
                    self.path().display()
                )));
            }
            Data::Mesh(_) | Data::Gaussians(_) | Data::Hierarchy(_) => {
                return Ok(statistics(&*self.scene(data)?));
            }
        };
        let values: Vec<f64> = values;
        Ok(vec![Statistics::new("value", &values)])
    }
}
