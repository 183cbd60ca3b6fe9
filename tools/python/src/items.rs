//! The items of a scene, and the stance and the bounds that they give it.

use crate::{errors::wrong, load::Load, look::Look, notes};
use splatkit::{
    Deadline, Error,
    about::Stance,
    bricks::Bricks,
    cells::{CellOptions, Cells},
    facet::FacetSet,
    gaussians::Gaussians,
    math::Bounds,
    scattered::Points,
    scene::{Item, Scene},
    session::{Data, Framing, Subject},
    splat::SplatSet,
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume},
};
use std::sync::{Arc, OnceLock};

/// What a scene is made of, in the order in which it was added.
#[derive(Default)]
pub struct Items {
    entries: Vec<Entry>,
    pub subject: Subject,
    /// Grows with each input.
    pub version: usize,
    /// Grows with each change of a transfer function.
    pub look: usize,
    /// What was added: kind, name, and the number of splats or samples.
    pub contents: Vec<(&'static str, String, u64)>,
    /// Whether each input is a file.
    are_files: Vec<bool>,
}

/// An item, or a mesh, which is drawn as facets in the usual pictures and as surfels in others.
enum Entry {
    Ready(Item),
    Mesh(Box<Faceted>),
}

struct Faceted {
    name: Name,
    facets: Arc<FacetSet>,
    mesh: Mesh,
    options: SurfelOptions,
    surfels: OnceLock<Arc<SplatSet>>,
}

/// What an input is called in messages.
#[derive(Clone)]
pub struct Name {
    pub text: String,
    /// Whether it is the path of a file. Otherwise the values are the caller's.
    pub is_file: bool,
}

/// An input with its looks.
pub struct Added {
    pub name: Name,
    pub input: Data,
    pub load: Load,
    pub look: Look,
    /// By when its splats must be made.
    pub deadline: Deadline,
}

impl Name {
    /// Returns an error that its values cause: the fault of the file, or of the caller.
    fn fault(&self, error: Error) -> Error {
        match self.is_file {
            true => error.stated_in(self.text.as_ref(), "content"),
            false => error.in_file(self.text.as_ref()),
        }
    }
}

impl Items {
    /// Adds an input.
    pub fn add(&mut self, added: Added) -> Result<(), Error> {
        let Added { name, input, load, look, deadline } = added;
        match input {
            Data::Mesh(mesh) => self.add_mesh(name, mesh, &look, load.scalar().is_some(), deadline),
            Data::Volume(volume) => self.add_volume(name, volume, &look),
            Data::Samples(points) => self.add_samples(name, &points, &load, &look, deadline),
            Data::Cells(cells) => self.add_cells(name, cells, &look),
            Data::Bricks(bricks) => self.add_bricks(name, bricks, &look),
            Data::Gaussians(set) => {
                self.add_gaussians(name, set);
                Ok(())
            }
            Data::Hierarchy(hierarchy) => {
                let header = hierarchy.header();
                let count = header.leaves;
                let bounds = header.bounds;
                warn(self.subject.stand_hierarchy(&name.text, &hierarchy));
                self.push("hierarchy", name, count, bounds, Item::Hierarchy(hierarchy));
                Ok(())
            }
        }
    }

    /// Removes the inputs after the first `count`, with which the scene stood like this.
    pub fn restore(&mut self, count: usize, subject: Subject) {
        self.entries.truncate(count);
        self.contents.truncate(count);
        self.are_files.truncate(count);
        self.subject = subject;
    }

    fn push(
        &mut self,
        kind: &'static str,
        name: Name,
        count: u64,
        bounds: Bounds,
        item: impl Into<Entry>,
    ) {
        self.subject.count_in(bounds);
        self.contents.push((kind, name.text, count));
        self.are_files.push(name.is_file);
        self.entries.push(item.into());
    }

    fn add_mesh(
        &mut self,
        name: Name,
        mut mesh: Mesh,
        look: &Look,
        named: bool,
        deadline: Deadline,
    ) -> Result<(), Error> {
        let mut subject = self.subject.clone();
        warn(subject.frame(&name.text, mesh.about.frame));
        warn(subject.stand_mesh(&name.text, &mut mesh));
        look.paint(&name.text, &mut mesh, subject.stance.up, named)?;
        let options = SurfelOptions { deadline, ..look.surfel_options() };
        let kind = if mesh.triangles.is_empty() { "points" } else { "mesh" };
        let bounds = mesh.bounds().map(|[min, max]| Bounds { min, max });
        let wrong = |error: Error| name.fault(error);
        if let Some(facets) = mesh.facets(&options).map_err(wrong)? {
            let (count, own) = (facets.facets.len() as u64, facets.bounds());
            let options = SurfelOptions { deadline: Deadline::NEVER, ..options };
            let (facets, surfels) = (Arc::new(facets), OnceLock::new());
            let entry = Faceted { name: name.clone(), facets, mesh, options, surfels };
            self.subject = subject;
            self.push(kind, name, count, bounds.unwrap_or(own), Entry::Mesh(Box::new(entry)));
        } else {
            let splats = mesh.surfels(&options).map_err(wrong)?;
            let (count, own) = (splats.splats.len() as u64, splats.bounds());
            self.subject = subject;
            self.push(kind, name, count, bounds.unwrap_or(own), Item::Radiance(splats.into()));
        }
        Ok(())
    }

    fn add_gaussians(&mut self, name: Name, mut set: Gaussians) {
        warn(self.subject.frame(&name.text, set.about.frame));
        warn(self.subject.stand_gaussians(&name.text, &mut set));
        let (count, bounds) = (set.len() as u64, set.bounds());
        self.push("gaussians", name, count, bounds, Item::Gaussians(set.into()));
    }

    fn add_bricks(&mut self, name: Name, bricks: Arc<Bricks>, look: &Look) -> Result<(), Error> {
        if look.sharp {
            return Err(Error::Argument("a volume in bricks cannot be sharpened".into()));
        }
        let transfer = look.of_bricks(&name.text, &bricks)?;
        let count = bricks.level(0).dims.iter().product::<usize>() as u64;
        let (bounds, kernel) = (bricks.bounds(), look.kernel()?);
        warn(self.subject.frame(&name.text, bricks.header().frame));
        warn(self.subject.stand_as_told(&name.text, bricks.header().stance(), Stance::SURVEY));
        self.push("bricks", name, count, bounds, Item::Bricks(bricks, kernel, transfer));
        Ok(())
    }

    fn add_volume(&mut self, name: Name, mut volume: Volume, look: &Look) -> Result<(), Error> {
        if volume.colors.is_some() {
            match look.shows_values() {
                None => return self.add_colors(name, &volume),
                Some(option) => notes::add(format!(
                    "{} has colours; {option} shows their brightness instead",
                    name.text
                )),
            }
        }
        let transfer = look.of_volume(&name.text, &volume)?;
        let kernel = look.kernel()?;
        let [min, max] = volume.bounds();
        if look.sharp {
            volume = volume.sharpened(&kernel)?;
        }
        warn(self.subject.frame(&name.text, volume.about.frame));
        warn(self.subject.stand_as_told(&name.text, volume.about.stance, Stance::SURVEY));
        let (count, bounds) = (volume.len() as u64, Bounds { min, max });
        self.push("volume", name, count, bounds, Item::Volume(volume.into(), kernel, transfer));
        Ok(())
    }

    /// Adds a volume in its own colours.
    fn add_colors(&mut self, name: Name, volume: &Volume) -> Result<(), Error> {
        let splats = volume.colored_splats().map_err(|error| name.fault(error))?;
        let splats = splats.expect("the volume has colours");
        warn(self.subject.stand_as_told(&name.text, volume.about.stance, Stance::SURVEY));
        let [min, max] = volume.bounds();
        let (count, bounds) = (volume.len() as u64, Bounds { min, max });
        self.push("volume", name, count, bounds, Item::Radiance(splats.into()));
        Ok(())
    }

    fn add_samples(
        &mut self,
        name: Name,
        points: &Points,
        load: &Load,
        look: &Look,
        deadline: Deadline,
    ) -> Result<(), Error> {
        let transfer = look.of_samples(&name.text, points)?;
        // Options are the caller's, whatever holds the samples.
        let options = load.sample_options(deadline);
        options.validate()?;
        let splats = points.to_splats(&options);
        let splats = splats.map_err(|error| name.fault(error))?;
        let [min, max] = points.bounds();
        let bounds = Bounds { min, max }.union(splats.bounds());
        warn(self.subject.frame(&name.text, points.about.frame));
        warn(self.subject.stand_as_told(&name.text, points.about.stance, Stance::SURVEY));
        let item = Item::Scalar(splats.into(), transfer);
        self.push("samples", name, points.len() as u64, bounds, item);
        Ok(())
    }

    fn add_cells(&mut self, name: Name, mut cells: Cells, look: &Look) -> Result<(), Error> {
        let transfer = look.of_cells(&name.text, &cells)?;
        if !transfer.isosurfaces.is_empty() {
            cells = cells.with_values_of_points();
        }
        let tetrahedra = cells.tetrahedra(&CellOptions::default());
        let tetrahedra = tetrahedra.map_err(|error| name.fault(error))?;
        warn(self.subject.frame(&name.text, cells.about.frame));
        warn(self.subject.stand_as_told(&name.text, cells.about.stance, Stance::SURVEY));
        let (count, bounds) = (cells.len() as u64, tetrahedra.bounds());
        self.push("cells", name, count, bounds, Item::Cells(tetrahedra.into(), transfer));
        Ok(())
    }

    /// Returns the items with a field, and their numbers.
    pub fn fields(&self) -> impl Iterator<Item = (usize, &Item)> {
        self.entries.iter().enumerate().filter_map(|(number, entry)| match entry {
            Entry::Ready(item) => item.transfer().map(|_| (number, item)),
            Entry::Mesh(_) => None,
        })
    }

    /// Sets the transfer function of an item's field. A function that cannot show the field
    /// changes nothing.
    pub fn set_transfer(&mut self, number: usize, new: TransferFunction) -> Result<(), Error> {
        let item = match self.entries.get_mut(number) {
            Some(Entry::Ready(item)) => item,
            _ => return Err(wrong(format!("the scene has no field {number}"))),
        };
        let mut changed = item.clone();
        match &mut changed {
            Item::Scalar(_, own)
            | Item::Volume(_, _, own)
            | Item::Bricks(_, _, own)
            | Item::Cells(_, own) => *own = new,
            _ => return Err(wrong(format!("item {number} of the scene has no field"))),
        }
        changed.validate()?;
        *item = changed;
        self.look += 1;
        Ok(())
    }

    /// Returns the scene. `facets` says whether its pictures can show facets.
    pub fn scene(&self, facets: bool) -> Result<Scene, Error> {
        let mut scene = Scene::new();
        for entry in &self.entries {
            scene.items.push(match entry {
                Entry::Ready(item) => item.clone(),
                Entry::Mesh(own) if facets => Item::Facets(own.facets.clone()),
                Entry::Mesh(own) => Item::Radiance(own.surfels()?),
            });
        }
        scene.validate().map_err(|error| self.at_fault(&scene, error))?;
        Ok(scene)
    }

    /// Returns the error for a scene that cannot be drawn: that of the file whose item cannot be
    /// drawn by itself, if there is one.
    fn at_fault(&self, scene: &Scene, error: Error) -> Error {
        let names = self.contents.iter().zip(&self.are_files);
        let found = names.zip(&scene.items).find_map(|(name, item)| match item.validate() {
            Err(own @ Error::Argument(_)) => Some((name, own)),
            _ => None,
        });
        match found {
            Some(((content, true), own)) => own.stated_in(content.1.as_ref(), "content"),
            _ => error,
        }
    }

    /// Returns the error for a scene that its own usual camera cannot see: that of the file that
    /// reaches farthest.
    pub fn out_of_sight(&self, scene: &Scene, error: Error) -> Error {
        let reach = |item: &Item| {
            let Bounds { min, max } = item.bounds();
            min.abs().max(max.abs()).max_element()
        };
        let names = self.contents.iter().zip(&self.are_files).zip(&scene.items);
        match names.max_by(|(_, a), (_, b)| reach(a).total_cmp(&reach(b))) {
            Some(((content, true), item)) => {
                Framing::out_of_sight(content.1.as_ref(), item.bounds(), &error)
            }
            _ => error,
        }
    }
}

impl Faceted {
    fn surfels(&self) -> Result<Arc<SplatSet>, Error> {
        if let Some(surfels) = self.surfels.get() {
            return Ok(surfels.clone());
        }
        let made = self.mesh.surfels(&self.options);
        let made = made.map_err(|error| self.name.fault(error))?;
        Ok(self.surfels.get_or_init(|| made.into()).clone())
    }
}

impl From<Item> for Entry {
    fn from(item: Item) -> Self {
        Self::Ready(item)
    }
}

/// Passes warnings on.
fn warn(warnings: impl IntoIterator<Item = String>) {
    warnings.into_iter().for_each(notes::add);
}
