//! The items of a scene, made from inputs.

use super::{
    CellStyle, Coloring, Data, Framing, Legend, Name, Showing, Subject, Surfaces,
    appearance::overview_of,
    slices,
    solid::{ShownSolid, field_of},
};
use crate::{
    Deadline, Error, Result,
    about::{About, Frame, Labels, Orientation},
    bricks::Bricks,
    cells::{Cells, Solid},
    facet::FacetSet,
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    math::{Bounds, Camera},
    picture::{Edges, Picture},
    scattered::Points,
    scene::{Clip, Item, Scene},
    splat::Surfels,
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume},
    warning,
};
use std::{
    path::Path,
    sync::{Arc, OnceLock},
};

/// What a scene is made of, in the order in which it was added. An input becomes one item, or
/// several: the lines of a mesh, and points on no surface, have an item of their own.
///
/// A clone shares what the items were made of.
#[derive(Clone, Default)]
pub struct Items {
    /// Where the scene is, and how it stands.
    pub subject: Subject,
    /// What was added.
    pub contents: Vec<Content>,
    surfaces: Surfaces,
    entries: Vec<Entry>,
    legends: Vec<(usize, Legend)>,
    edges: Vec<Arc<Edges>>,
    /// The unit of lengths; empty if no input says it.
    length: String,
}

/// An input in short.
#[derive(Debug, Clone, PartialEq)]
pub struct Content {
    /// `mesh`, `points`, `lines`, `volume`, `samples`, `cells`, `gaussians`, `hierarchy` or
    /// `bricks`.
    pub kind: &'static str,
    /// What the input is called.
    pub name: Name,
    /// The number of splats, facets, samples or cells.
    pub count: u64,
}

/// What the inputs say for texts over a picture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Captions {
    /// The colours of values: the number of the item, and the legend.
    pub legends: Vec<(usize, Legend)>,
    /// The unit of lengths; empty if no input says it.
    pub length: String,
    /// Whether the world is that of a patient: x to the right, y to the front, z to the head.
    pub is_patient: bool,
}

/// How a scene was before inputs were added.
#[derive(Debug, Clone)]
pub struct Mark {
    items: usize,
    edges: usize,
    subject: Subject,
    length: String,
}

/// What an input has become. Some entries are one item in the usual pictures and another in others.
#[derive(Clone)]
enum Entry {
    Ready(Item),
    /// Facets, or surfels.
    Mesh(Arc<Faceted>),
    /// Cells as a solid, or as a field.
    Solid(Arc<ShownSolid>),
    /// Rods, which are splats in pictures that show no facets.
    Rods {
        facets: Arc<FacetSet>,
        splats: OnceLock<Arc<Surfels>>,
    },
}

struct Faceted {
    name: Name,
    facets: Arc<FacetSet>,
    mesh: Mesh,
    options: SurfelOptions,
    surfels: OnceLock<Arc<Surfels>>,
}

/// An input that becomes an item.
struct Adding<'a> {
    items: &'a mut Items,
    name: &'a Name,
    showing: &'a Showing,
    /// Hears what is done, for a display of progress.
    does: &'a dyn Fn(String),
}

impl Items {
    /// Returns a scene without items.
    pub fn new(surfaces: Surfaces) -> Self {
        Self { surfaces, ..Self::default() }
    }

    /// Adds an input. `does` hears what is done, for a display of progress. After an error, the
    /// scene is as before.
    ///
    /// # Errors
    /// Those of [`Appearance`](super::Appearance) and of making splats; [`Error::Input`] for a file
    /// that cannot be shown as asked, [`Error::Argument`] for the values of a caller.
    pub fn add(
        &mut self,
        name: &Name,
        data: Data,
        showing: &Showing,
        does: &dyn Fn(String),
    ) -> Result<()> {
        let before = self.mark();
        let mut adding = Adding { items: self, name, showing, does };
        let added = match data {
            Data::Mesh(mesh) => adding.add_mesh(mesh),
            Data::Volume(volume) => adding.add_volume(volume),
            Data::Samples(points) => adding.add_samples(&points),
            Data::Cells(cells) => adding.add_cells(cells),
            Data::Bricks(bricks) => adding.add_bricks(bricks),
            Data::Gaussians(set) => {
                adding.add_gaussians(set);
                Ok(())
            }
            Data::Hierarchy(hierarchy) => {
                adding.add_hierarchy(hierarchy);
                Ok(())
            }
        };
        if added.is_err() {
            self.restore(before);
        }
        added
    }

    /// Returns how the scene is, for [`restore`](Self::restore).
    pub fn mark(&self) -> Mark {
        Mark {
            items: self.entries.len(),
            edges: self.edges.len(),
            subject: self.subject.clone(),
            length: self.length.clone(),
        }
    }

    /// Removes what was added since a mark.
    pub fn restore(&mut self, mark: Mark) {
        self.entries.truncate(mark.items);
        self.contents.truncate(mark.items);
        self.legends.retain(|(item, _)| *item < mark.items);
        self.edges.truncate(mark.edges);
        (self.subject, self.length) = (mark.subject, mark.length);
    }

    /// Returns the number of splats, facets, samples and cells.
    pub fn count(&self) -> u64 {
        self.contents.iter().map(|content| content.count).sum()
    }

    /// Returns the number of items.
    pub(super) fn len(&self) -> usize {
        self.entries.len()
    }

    /// Returns the edges of meshes and cells that are drawn over a picture with these clips.
    pub(super) fn edges(&self, clips: &[Clip]) -> Vec<Arc<Edges>> {
        let of_solid = |entry: &Entry| match entry {
            Entry::Solid(solid) => solid.edges(clips),
            Entry::Ready(_) | Entry::Mesh(_) | Entry::Rods { .. } => None,
        };
        let of_solids = self.entries.iter().filter_map(of_solid);
        self.edges.iter().cloned().chain(of_solids).collect()
    }

    /// Draws the edges of meshes and cells over a finished picture with these clips, where they are
    /// asked for. `width` is that of the lines, in pixels.
    ///
    /// # Errors
    /// Those of [`Camera::view`].
    pub fn draw_edges(
        &self,
        picture: &mut Picture,
        camera: &Camera,
        (clips, width): (&[Clip], f64),
    ) -> Result<()> {
        let view = camera.view([picture.width, picture.height])?;
        self.edges(clips).iter().for_each(|edges| picture.draw_edges(edges, &view, width));
        Ok(())
    }

    /// Returns what the inputs say for texts. Several fields without names are called as their
    /// inputs are.
    pub fn captions(&self) -> Captions {
        let mut legends = self.legends.clone();
        let fields: Vec<usize> = self.fields().map(|(number, _)| number).collect();
        if fields.len() > 1 {
            for (item, legend) in legends.iter_mut().filter(|(item, _)| fields.contains(item)) {
                let name = Path::new(&self.contents[*item].name.text);
                if let Some(name) = name.file_stem() {
                    legend.name(&name.to_string_lossy());
                }
            }
        }
        Captions { legends, length: self.length.clone(), is_patient: self.subject.is_patient() }
    }

    /// Returns the items with a field, and their numbers.
    pub fn fields(&self) -> impl Iterator<Item = (usize, &Item)> {
        self.entries.iter().enumerate().filter_map(|(number, entry)| match entry {
            Entry::Ready(item) => item.transfer().map(|_| (number, item)),
            Entry::Mesh(_) | Entry::Solid(_) | Entry::Rods { .. } => None,
        })
    }

    /// Sets the transfer function of an item's field. A function that cannot show the field
    /// changes nothing.
    ///
    /// # Errors
    /// [`Error::Argument`] for a number without a field; those of [`Item::validate`].
    pub fn set_transfer(&mut self, number: usize, new: TransferFunction) -> Result<()> {
        let Some(Entry::Ready(item)) = self.entries.get_mut(number) else {
            return Err(Error::Argument(format!("the scene has no field {number}")));
        };
        let mut changed = item.clone();
        match &mut changed {
            Item::Scalar(_, transfer)
            | Item::Volume(_, _, transfer)
            | Item::Bricks(_, _, transfer)
            | Item::Cells(_, transfer) => *transfer = new,
            _ => return Err(Error::Argument(format!("item {number} of the scene has no field"))),
        }
        changed.validate()?;
        *item = changed;
        Ok(())
    }

    /// Returns the scene. `facets` says whether its pictures can show facets.
    ///
    /// # Errors
    /// Those of [`Mesh::surfels`] for a mesh whose surfels were not made yet.
    pub fn scene(&self, facets: bool) -> Result<Scene> {
        let mut scene = Scene::new();
        for entry in &self.entries {
            scene.items.push(match entry {
                Entry::Ready(item) => item.clone(),
                Entry::Mesh(mesh) if facets => Item::Facets(mesh.facets.clone()),
                Entry::Mesh(mesh) => Item::Radiance(mesh.surfels()?),
                Entry::Solid(solid) if facets => Item::Solid(solid.solid.clone()),
                Entry::Solid(solid) => solid.field()?,
                Entry::Rods { facets: rods, .. } if facets => Item::Facets(rods.clone()),
                Entry::Rods { facets, splats } => {
                    Item::Radiance(splats.get_or_init(|| facets.rod_splats().into()).clone())
                }
            });
        }
        Ok(scene)
    }

    /// Returns the scene, which can be drawn, and its subject. `facets` says whether its pictures
    /// can show facets; `fault` makes the error of a scene that cannot be drawn more exact.
    ///
    /// # Errors
    /// Those of [`scene`](Self::scene) and of [`Scene::validate`].
    pub fn assembled(
        &self,
        facets: bool,
        fault: impl Fn(&Scene, Error) -> Error,
    ) -> Result<(Scene, Subject)> {
        let scene = self.scene(facets)?;
        scene.validate().map_err(|error| fault(&scene, error))?;
        let mut subject = self.subject.clone();
        // Points that all lie at one place have no extent, but their splats have one.
        if subject.is_one_place() {
            subject.bounds = scene.bounds();
        }
        Ok((scene, subject))
    }

    /// Returns the first item of a scene that cannot be drawn by itself, and why.
    pub fn unfit(scene: &Scene) -> Option<(usize, Error)> {
        scene.items.iter().enumerate().find_map(|(at, item)| Some((at, item.validate().err()?)))
    }

    /// Returns the error for a scene that cannot be drawn: that of the file whose item cannot be
    /// drawn by itself, if there is one.
    pub fn at_fault(&self, scene: &Scene, error: Error) -> Error {
        match Self::unfit(scene).map(|(item, fault)| (&self.contents[item].name, fault)) {
            Some((name, fault)) if name.is_file => name.fault(fault),
            _ => error,
        }
    }

    /// Returns the error for a picture of `size` pixels that an engine did not draw: that of the
    /// input that reaches farthest, if the usual camera cannot see the scene either. Also returns
    /// whether only this camera cannot see it.
    pub fn undrawn(
        &self,
        (scene, subject): (&Scene, &Subject),
        error: Error,
        camera: &Camera,
        size: [u32; 2],
    ) -> (Error, bool) {
        let bounds = scene.bounds();
        let is_seen = || camera.view(size)?.validate_for(&bounds);
        if !matches!(error, Error::Argument(_)) || is_seen().is_ok() {
            return (error, false);
        }
        match Framing::usual_fault(subject, &bounds, size) {
            Some(fault) => (self.out_of_sight(scene, fault), false),
            None => (error, true),
        }
    }

    /// Returns the error for a scene that its own usual camera cannot see, for the reason `fault`:
    /// that of the file that reaches farthest.
    fn out_of_sight(&self, scene: &Scene, fault: Error) -> Error {
        let reach = |item: &Item| {
            let Bounds { min, max } = item.bounds();
            min.abs().max(max.abs()).max_element()
        };
        let named = self.contents.iter().map(|content| &content.name).zip(&scene.items);
        match named.max_by(|(_, a), (_, b)| reach(a).total_cmp(&reach(b))) {
            Some((name, item)) if name.is_file => {
                Framing::out_of_sight(name.text.as_ref(), item.bounds(), &fault)
            }
            _ => fault,
        }
    }
}

impl Captions {
    /// Takes the colours of transfer functions that show fields of a scene instead of those that it
    /// was made with. Each function comes with the number of its item. `coloring` says by what the
    /// functions are coloured.
    pub fn take_transfers<'a>(
        &mut self,
        scene: &Scene,
        transfers: impl IntoIterator<Item = (usize, &'a TransferFunction)>,
        coloring: &Coloring,
    ) {
        for (number, transfer) in transfers {
            let Some(item) = scene.items.get(number) else { continue };
            let Some(values) = item.value_range() else { continue };
            let labels = match item {
                Item::Volume(volume, ..) => volume.about.labels.as_ref(),
                _ => None,
            };
            for (_, legend) in self.legends.iter_mut().filter(|(item, _)| *item == number) {
                let named = (std::mem::take(&mut legend.title), labels);
                *legend = Legend::of_transfer(coloring, transfer, values, named);
            }
        }
    }
}

impl Adding<'_> {
    fn add_mesh(&mut self, mut mesh: Mesh) -> Result<()> {
        let Self { name, showing, .. } = *self;
        self.frame(mesh.about.frame);
        self.does("Finding the way up of");
        warn(self.items.subject.stand_mesh(&name.text, &mut mesh));
        let up = self.items.subject.orientation.up;
        let legend = showing.coloring().paint(name, &mut mesh, up, showing.is_named)?;
        self.items.legends.extend(legend.map(|legend| (self.items.entries.len(), legend)));
        self.unit(&mesh.about);
        self.does("Making splats of");
        if showing.draws_edges && !mesh.triangles.is_empty() {
            self.items.edges.push(Edges::of(&mesh).into());
        }
        let options = showing.surfel_options(self.items.surfaces);
        let bounds = mesh.bounds();
        let fault = |error| name.fault(error);
        if let Some(lines) = mesh.line_rods(&options).map_err(fault)? {
            self.push_rods("lines", lines, bounds);
        }
        if mesh.triangles.is_empty() {
            if mesh.lines.is_empty() {
                return self.add_points(&mesh, &options, bounds);
            }
            return Ok(());
        }
        let kind = "mesh";
        if let Some(facets) = mesh.facets(&options).map_err(fault)? {
            let (count, facet_bounds) = (facets.facets.len(), facets.bounds());
            let facets = Arc::new(facets);
            let entry = if self.items.surfaces == Surfaces::Both {
                let options = SurfelOptions { deadline: Deadline::NEVER, ..options };
                let (name, surfels) = (name.clone(), OnceLock::new());
                Entry::Mesh(Arc::new(Faceted { name, facets, mesh, options, surfels }))
            } else {
                Entry::Ready(Item::Facets(facets))
            };
            self.push(kind, count, bounds.unwrap_or(facet_bounds), entry);
        } else {
            let splats = mesh.surfels(&options).map_err(fault)?;
            let (count, splat_bounds) = (splats.splats.len(), splats.bounds());
            self.push(kind, count, bounds.unwrap_or(splat_bounds), Item::Radiance(splats.into()));
        }
        Ok(())
    }

    /// Adds a point cloud: surfels where points lie on a surface, and rods for the others.
    fn add_points(
        &mut self,
        mesh: &Mesh,
        options: &SurfelOptions,
        bounds: Option<Bounds>,
    ) -> Result<()> {
        let (surfels, dots) = mesh.points(options).map_err(|error| self.name.fault(error))?;
        if let Some(surfels) = surfels {
            let (count, splat_bounds) = (surfels.splats.len(), surfels.bounds());
            self.push(
                "points",
                count,
                bounds.unwrap_or(splat_bounds),
                Item::Radiance(surfels.into()),
            );
        }
        if let Some(dots) = dots {
            self.push_rods("points", dots, bounds);
        }
        Ok(())
    }

    fn push_rods(&mut self, kind: &'static str, rods: FacetSet, bounds: Option<Bounds>) {
        let (count, rod_bounds) = (rods.facets.len(), rods.bounds());
        let entry = match self.items.surfaces {
            Surfaces::Surfels => Entry::Ready(Item::Radiance(rods.rod_splats().into())),
            Surfaces::Facets => Entry::Ready(Item::Facets(rods.into())),
            Surfaces::Both => Entry::Rods { facets: rods.into(), splats: OnceLock::new() },
        };
        self.push(kind, count, bounds.unwrap_or(rod_bounds), entry);
    }

    fn add_gaussians(&mut self, mut set: Gaussians) {
        self.frame(set.about.frame);
        warn(self.items.subject.stand_gaussians(&self.name.text, &mut set));
        self.unit(&set.about);
        let (count, bounds) = (set.len(), set.bounds());
        self.push("gaussians", count, bounds, Item::Gaussians(set.into()));
    }

    fn add_hierarchy(&mut self, hierarchy: Arc<Hierarchy>) {
        let header = hierarchy.header();
        let (count, bounds) = (header.leaves as usize, header.bounds);
        self.length(&header.unit);
        warn(self.items.subject.stand_hierarchy(&self.name.text, &hierarchy));
        self.push("hierarchy", count, bounds, Item::Hierarchy(hierarchy));
    }

    fn add_bricks(&mut self, bricks: Arc<Bricks>) -> Result<()> {
        let Self { name, showing, .. } = *self;
        if showing.is_sharp {
            let message = "a volume in bricks cannot be sharpened";
            return Err(name.unfit("content", message, "leave that out, or draw the original"));
        }
        if !showing.is_named && showing.appearance.shows_channels(bricks.about()) {
            return self.add_channels_of_bricks(&bricks);
        }
        let transfer = showing.appearance.of_bricks(&name.text, &bricks)?;
        self.add_field_of_bricks(bricks, transfer);
        Ok(())
    }

    /// Adds a volume in bricks as a field.
    fn add_field_of_bricks(&mut self, bricks: Arc<Bricks>, transfer: TransferFunction) {
        let (header, about) = (bricks.header(), bricks.about());
        self.values(&transfer, header.range, Legend::title(&about.name, &about.unit), None);
        self.length(&header.unit);
        self.stand(header.frame, header.orientation());
        let (count, bounds) = (bricks.level(0).dims.iter().product(), bricks.bounds());
        let item = Item::Bricks(bricks, self.showing.kernel.clone(), transfer);
        self.push("bricks", count, bounds, item);
    }

    /// Adds the channels of a volume in bricks that were opened, each in a colour.
    fn add_channels_of_bricks(&mut self, bricks: &Arc<Bricks>) -> Result<()> {
        let Self { name, showing, .. } = *self;
        let channels: Vec<&Arc<Bricks>> =
            std::iter::once(bricks).chain(bricks.more_channels()).collect();
        let all: Vec<usize> = channels.iter().map(|bricks| bricks.about().channel).collect();
        let (mut dark, count) = (Vec::new(), self.items.len());
        for (number, bricks) in channels.into_iter().enumerate() {
            let style = showing.appearance.channels.get(number).cloned().unwrap_or_default();
            let overview = overview_of(bricks)?;
            match showing.appearance.of_channel(&name.text, &overview, (&style, &all)) {
                Ok(transfer) => self.add_field_of_bricks(bricks.clone(), transfer),
                Err(Error::NothingToDraw(message)) => dark.push(message),
                Err(error) => return Err(error),
            }
        }
        self.warn_of_dark(&dark, count)
    }

    /// Says which channels are left out. It is an error if none was added to `count` items.
    fn warn_of_dark(&self, dark: &[String], count: usize) -> Result<()> {
        if self.items.len() == count {
            return Err(Error::NothingToDraw(dark.join("; ")));
        }
        dark.iter().for_each(|message| warning::give!("left out: {message}"));
        Ok(())
    }

    fn add_volume(&mut self, volume: Volume) -> Result<()> {
        let Self { name, showing, .. } = *self;
        if volume.opacities.is_some() {
            return self.add_colors_of_two(volume);
        }
        if volume.colors.is_some() {
            match &showing.values_by {
                None => return self.add_colors(&volume),
                Some(option) => warning::give!(
                    "{} has colours; {option} shows their brightness instead",
                    name.text
                ),
            }
        }
        if !showing.is_named && showing.appearance.shows_channels(&volume.about) {
            return self.add_channels(volume);
        }
        let transfer = showing.appearance.of_volume(&name.text, &volume)?;
        self.add_field(volume, transfer)
    }

    /// Adds a volume in the colours of its values, as opaque as another array says.
    fn add_colors_of_two(&mut self, mut volume: Volume) -> Result<()> {
        let Self { name, showing, .. } = *self;
        let Some(opacities) = volume.opacities.take() else { return self.add_volume(volume) };
        let colored = showing.appearance.color_by_two(name, &mut volume, &opacities)?;
        if let Some(transfer) = colored {
            let title = Legend::title(&volume.about.name, &volume.about.unit);
            self.values(&transfer, volume.range, title, volume.about.labels.as_ref());
        }
        self.add_colors(&volume)
    }

    /// Adds the channels of a volume that were read, each in a colour.
    fn add_channels(&mut self, mut volume: Volume) -> Result<()> {
        let Self { name, showing, .. } = *self;
        let mut volumes = std::mem::take(&mut volume.more_channels);
        volumes.insert(0, volume);
        let all: Vec<usize> = volumes.iter().map(|volume| volume.about.channel).collect();
        if slices::facing(&volumes[0]).is_some() && showing.appearance.isosurfaces.is_empty() {
            let colors = showing.appearance.mixed_channels(&name.text, &volumes, &all)?;
            return self.add_sheet(&volumes[0], &colors);
        }
        let (lattice, about) = (volumes[0].lattice.clone(), volumes[0].about.clone());
        let (mut dark, count) = (Vec::new(), self.items.len());
        for (number, mut volume) in volumes.into_iter().enumerate() {
            // Where the input was moved to.
            volume.lattice = lattice.clone();
            (volume.about.frame, volume.about.orientation) = (about.frame, about.orientation);
            let style = showing.appearance.channels.get(number).cloned().unwrap_or_default();
            match showing.appearance.of_channel(&name.text, &volume, (&style, &all)) {
                Ok(transfer) => self.add_field(volume, transfer)?,
                Err(Error::NothingToDraw(message)) => dark.push(message),
                Err(error) => return Err(error),
            }
        }
        self.warn_of_dark(&dark, count)
    }

    /// Adds a volume as a field.
    fn add_field(&mut self, mut volume: Volume, transfer: TransferFunction) -> Result<()> {
        let Self { showing, .. } = *self;
        let About { name: title, unit, labels, frame, orientation, .. } = &volume.about;
        self.values(&transfer, volume.range, Legend::title(title, unit), labels.as_ref());
        self.unit(&volume.about);
        self.stand(*frame, *orientation);
        let bounds = volume.bounds();
        let kernel = showing.kernel.clone();
        if showing.is_sharp {
            self.does("Sharpening");
            volume = volume.sharpened(&kernel)?;
        }
        let count = volume.len();
        let facing = slices::facing(&volume);
        let item = Item::Volume(volume.into(), kernel, transfer);
        self.push_facing("volume", count, (bounds, facing), item);
        Ok(())
    }

    /// Adds a slice in these colours.
    fn add_sheet(&mut self, volume: &Volume, colors: &[[u8; 4]]) -> Result<()> {
        let options = SurfelOptions::default();
        let sheet = slices::sheet(volume, colors).expect("the volume is a slice");
        let fault = |error| self.name.fault(error);
        let item = match self.items.surfaces {
            Surfaces::Surfels => Item::Radiance(sheet.surfels(&options).map_err(fault)?.into()),
            Surfaces::Facets | Surfaces::Both => match sheet.facets(&options).map_err(fault)? {
                Some(facets) => Item::Facets(facets.into()),
                None => Item::Radiance(sheet.surfels(&options).map_err(fault)?.into()),
            },
        };
        self.unit(&volume.about);
        self.stand(volume.about.frame, volume.about.orientation);
        let facing = (volume.bounds(), slices::facing(volume));
        self.push_facing("volume", volume.len(), facing, item);
        Ok(())
    }

    /// Adds a volume in its own colours.
    fn add_colors(&mut self, volume: &Volume) -> Result<()> {
        if let (Some(colors), Some(_)) = (&volume.colors, slices::facing(volume)) {
            return self.add_sheet(volume, colors);
        }
        self.does("Making splats of");
        let splats = volume.colored_splats().map_err(|error| self.name.fault(error))?;
        let splats = splats.expect("the volume has colours");
        self.unit(&volume.about);
        self.stand(volume.about.frame, volume.about.orientation);
        let item = Item::Radiance(splats.into());
        self.push("volume", volume.len(), volume.bounds(), item);
        Ok(())
    }

    fn add_samples(&mut self, points: &Points) -> Result<()> {
        let Self { name, showing, .. } = *self;
        let transfer = showing.appearance.of_samples(&name.text, points)?;
        let About { name: title, unit, frame, orientation, .. } = &points.about;
        self.values(&transfer, points.range(), Legend::title(title, unit), None);
        self.unit(&points.about);
        self.does("Making splats of");
        let mut options = showing.samples.clone();
        options.deadline = showing.deadline;
        // Options are the caller's, whatever holds the samples.
        options.validate()?;
        let splats = points.to_splats(&options).map_err(|error| name.fault(error))?;
        self.stand(*frame, *orientation);
        let bounds = points.bounds().union(splats.bounds());
        self.push("samples", points.len(), bounds, Item::Scalar(splats.into(), transfer));
        Ok(())
    }

    fn add_cells(&mut self, cells: Cells) -> Result<()> {
        match self.showing.cell_style()? {
            CellStyle::Solid => self.add_solid(cells),
            CellStyle::Volume => self.add_cell_field(&cells),
        }
    }

    /// Adds cells as a field.
    fn add_cell_field(&mut self, cells: &Cells) -> Result<()> {
        let Self { name, showing, .. } = *self;
        if cells.values.is_empty() {
            let hint = "`--cells solid` draws their boundary";
            return Err(name.unfit("content", "the cells have no values", hint));
        }
        let transfer = showing.appearance.of_cells(&name.text, cells)?;
        let About { name: title, unit, frame, orientation, .. } = &cells.about;
        self.values(&transfer, cells.range(), Legend::title(title, unit), None);
        self.unit(&cells.about);
        self.stand(*frame, *orientation);
        self.does("Dividing the cells of");
        let item = field_of(cells, transfer).map_err(|error| name.fault(error))?;
        let bounds = item.bounds();
        self.push("cells", cells.len(), bounds, item);
        Ok(())
    }

    /// Adds cells as a solid, or as the surfels of their boundary for pictures that show no facets.
    fn add_solid(&mut self, cells: Cells) -> Result<()> {
        let Self { name, showing, .. } = *self;
        self.stand(cells.about.frame, cells.about.orientation);
        let up = self.items.subject.orientation.up;
        let (tint, legend) = showing.coloring().tint(name, &cells, up)?;
        self.items.legends.extend(legend.map(|legend| (self.items.entries.len(), legend)));
        self.unit(&cells.about);
        self.does("Finding the boundary of");
        let fault = |error| name.fault(error);
        let (count, bounds) = (cells.len() + cells.faces.len(), cells.bounds());
        let is_clear = showing.opacity.is_some_and(|opacity| opacity < 1.0);
        if is_clear || self.items.surfaces == Surfaces::Surfels {
            let surfels = showing.surfel_options(Surfaces::Surfels);
            let mesh = cells.surface(tint).map_err(fault)?;
            if showing.draws_edges {
                self.items.edges.push(Edges::of(&mesh).into());
            }
            let splats = mesh.surfels(&surfels).map_err(fault)?;
            self.push("cells", count, bounds, Item::Radiance(splats.into()));
            return Ok(());
        }
        let solid = Solid::new(cells, &showing.solid_options(tint)).map_err(fault)?;
        let solid = ShownSolid::new(name, solid, showing);
        self.push("cells", count, bounds, Entry::Solid(Arc::new(solid)));
        Ok(())
    }

    /// Adds the legend of a field.
    fn values(
        &mut self,
        transfer: &TransferFunction,
        range: [f64; 2],
        title: String,
        labels: Option<&Labels>,
    ) {
        let coloring = self.showing.coloring();
        self.legend(Legend::of_transfer(coloring, transfer, range, (title, labels)));
    }

    fn legend(&mut self, legend: Legend) {
        self.items.legends.push((self.items.entries.len(), legend));
    }

    fn unit(&mut self, about: &About) {
        self.length(&about.length);
    }

    fn length(&mut self, unit: &str) {
        if self.items.length.is_empty() {
            self.items.length = unit.to_owned();
        }
    }

    fn frame(&mut self, frame: Frame) {
        warn(self.items.subject.frame(&self.name.text, frame));
    }

    /// Takes the frame and the orientation of a field, or the convention for fields.
    fn stand(&mut self, frame: Frame, orientation: Option<Orientation>) {
        self.frame(frame);
        warn(self.items.subject.orient_as_stated(
            &self.name.text,
            orientation,
            Orientation::SURVEY,
        ));
    }

    fn does(&self, what: &str) {
        (self.does)(format!("{what} {}", self.name.text));
    }

    fn push(&mut self, kind: &'static str, count: usize, bounds: Bounds, entry: impl Into<Entry>) {
        self.push_facing(kind, count, (bounds, None), entry);
    }

    fn push_facing(
        &mut self,
        kind: &'static str,
        count: usize,
        (bounds, facing): (Bounds, Option<Orientation>),
        entry: impl Into<Entry>,
    ) {
        let Self { items, name, .. } = self;
        items.subject.count_in(bounds, facing);
        items.contents.push(Content { kind, name: name.clone(), count: count as u64 });
        items.entries.push(entry.into());
    }
}

impl Faceted {
    fn surfels(&self) -> Result<Arc<Surfels>> {
        if let Some(surfels) = self.surfels.get() {
            return Ok(surfels.clone());
        }
        let made = self.mesh.surfels(&self.options).map_err(|error| self.name.fault(error))?;
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
    warnings.into_iter().for_each(|warning| warning::give!("{warning}"));
}
