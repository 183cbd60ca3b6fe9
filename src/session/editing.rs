//! Inputs as scenes that are edited, measured and compared.

use super::{Data, Opened};
use crate::{
    Error, Result,
    edit::{Context, Editable, Pass, Statistics, Surface, statistics},
    formats::{Attribute, NumberType, Records, Stream},
    surface::Mesh,
};

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
                all.append(records);
                Ok(())
            })?;
            return Ok(Box::new(all));
        }
        let (count, names) = (mesh.positions.len(), mesh.about.attributes.clone());
        let mut surface = Surface::from(mesh);
        for name in names {
            if let Some(values) = self.values(&name)?.filter(|values| values.len() == count) {
                let values = values.into_iter().map(f64::from).collect();
                surface.columns.push((Attribute { name, kind: NumberType::F32 }, values));
            }
        }
        Ok(Box::new(surface))
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
