//! The flags of a scene, and loading the scene that they describe.

use crate::{
    color::{self, ColorFlags, titled},
    failure::{Failure, in_file},
    given::{Given, Kinds, kinds_of},
    load::LoadFlags,
    overlay::Facts,
    parse,
    progress::Progress,
    show::{Show, ShowFlags},
};
use clap::Args;
use splatkit::{
    Deadline, Error,
    about::{Frame, Stance},
    bricks::Bricks,
    cells::{CellOptions, Cells},
    gaussians::Gaussians,
    hierarchy::Hierarchy,
    input::Limits,
    math::{Bounds, Camera},
    memory,
    picture::Edges,
    scattered::Points,
    scene::{Item, Scene, Settings},
    session::{Data, Framing, Subject},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, Volume},
};
use std::{
    path::{Path, PathBuf},
    sync::Arc,
    time::Instant,
};

/// The inputs, and how their values and surfaces are shown.
#[derive(Args, Debug, Clone)]
pub struct SceneFlags {
    /// Meshes, point clouds, hierarchies, and up to four volumes, sets of cells or sets of
    /// scattered samples; all are drawn in one picture. Addresses are inputs too: https://…,
    /// s3://…, gs://…, az://… (docs/remote.md).
    #[arg(value_name = "SCENE", required = true, value_parser = parse::input())]
    pub inputs: Vec<PathBuf>,
    /// Let a scene file name files outside its folder, and addresses. Give it only for scenes that
    /// you have made, or whose maker you trust.
    #[arg(long)]
    trust_scene: bool,
    #[command(flatten)]
    load: LoadFlags,
    #[command(flatten)]
    show: ShowFlags,
}

/// A loaded scene.
pub struct Loaded {
    pub scene: Scene,
    pub subject: Subject,
    /// Number of splats and samples.
    pub count: u64,
    pub load_ms: f64,
    /// What the inputs say for the texts over a picture.
    pub facts: Facts,
    /// The edges to be drawn over the picture.
    pub edges: Vec<Edges>,
    /// What each input is.
    pub kinds: Vec<Kinds>,
    /// The files that were read: the inputs, the files that they refer to, and the files that flags
    /// name.
    pub read: Vec<PathBuf>,
}

impl SceneFlags {
    /// Returns the limits of every file that is read.
    pub fn limits(&self) -> Limits {
        self.load.limits()
    }

    /// Checks that the inputs are files of known kinds. Addresses are not asked.
    #[cfg(feature = "window")]
    pub fn check_files(&self) -> Result<(), Failure> {
        let files = self.inputs.iter().filter(|path| !splatkit::input::is_remote(path));
        files.into_iter().try_for_each(|path| self.load.kind(path).map(drop))
    }

    /// Reads the inputs and makes a scene of them. Meshes become surfels; with `facets`, those
    /// whose triangles can be larger than pixels become facets.
    pub fn load(
        &self,
        facets: bool,
        given: &Given,
        progress: &Progress,
    ) -> Result<Loaded, Failure> {
        let start = Instant::now();
        self.show.check_inputs(&self.inputs)?;
        // One deadline covers reading all inputs and making their splats.
        let load = self.load.begun();
        let deadline = load.limits().deadline();
        let show = self.show.open(&load.limits())?;
        let loaded = Loaded {
            scene: Scene::new(),
            subject: Subject::default(),
            count: 0,
            load_ms: 0.0,
            facts: Facts::default(),
            edges: Vec::new(),
            kinds: Vec::new(),
            read: self.show.files(),
        };
        // Of values alone: colours have no largest one.
        let optics = ["mip", "x-ray", "optics"].into_iter().find(|flag| given.has(flag));
        let mut adding = Adding { flags: self, show, facets, optics, progress, loaded };
        let (mut is_scaled, mut unscaled) = (false, None);
        let reading = load.reading(memory::most());
        for path in &self.inputs {
            progress.stage(format!("Reading {}", path.display()));
            let coloring = adding.show.coloring_of(path);
            let read = &mut adding.loaded.read;
            let attribute = coloring.attribute();
            let opened = reading.open_colored(path, attribute)?;
            let input = opened.read()?;
            read.extend(opened.files());
            match &input {
                Data::Mesh(_) => is_scaled = true,
                Data::Hierarchy(_) => unscaled = Some(path),
                _ => {}
            }
            adding.loaded.kinds.push(kinds_of(&input, opened.is_raw()));
            adding.add(path, input, deadline)?;
        }
        let mut loaded = adding.loaded;
        self.name_fields(&mut loaded);
        self.show.color.check_effect(is_scaled, !loaded.facts.bars.is_empty())?;
        if let (Some(_), Some(path), false) = (self.show.radius_scale, unscaled, is_scaled) {
            return Err(Failure::Usage(format!(
                "--radius-scale does not apply to {}: a hierarchy keeps the radii that it was \
                 converted with; convert it with --radius-scale",
                path.display()
            )));
        }
        loaded.scene.validate().map_err(|error| self.at_fault(&loaded.scene, error))?;
        // Points that all lie at one place have no extent, but their splats have one.
        if loaded.subject.is_one_place() {
            loaded.subject.bounds = loaded.scene.bounds();
        }
        let paths = self.inputs.iter().map(PathBuf::as_path);
        let inputs: Vec<_> = paths.zip(loaded.kinds.iter().copied()).collect();
        given.warn(&inputs, progress);
        if self.show.has_range() && loaded.facts.bars.is_empty() {
            progress.warn("--range has no effect: nothing here is coloured or shown by values");
        }
        loaded.load_ms = start.elapsed().as_secs_f64() * 1e3;
        Ok(loaded)
    }

    /// Returns the error for a scene that cannot be drawn. If an item cannot be drawn by itself,
    /// its file is at fault, or the flags that say how it is shown.
    fn at_fault(&self, scene: &Scene, error: Error) -> Failure {
        let items = self.inputs.iter().zip(&scene.items);
        let found = items.into_iter().find_map(|(path, item)| Some((path, item.validate().err()?)));
        let flags = found.as_ref().and_then(|(path, _)| self.show.transfer_text(path));
        match (found, flags) {
            (None, _) => error.into(),
            (Some((path, Error::Transfer(what))), Some(flags)) => {
                if let Some(file) = self.show.own_transfer(path) {
                    let message = format!("{what}; the values are those of {}", path.display());
                    return Error::input(file, "content", message).into();
                }
                Failure::Usage(format!(
                    "{flags}: {what}; the values are those of {}",
                    path.display()
                ))
            }
            (Some((path, own)), _) => in_file(path, own).into(),
        }
    }

    /// Returns the failure of a picture that an engine did not draw. If the usual camera cannot see
    /// the scene either, the input that reaches farthest is at fault. If only this camera cannot,
    /// it is the file of a path, which is named with the place of the camera, or else a flag.
    pub fn undrawn(
        &self,
        error: Error,
        loaded: &Loaded,
        (camera, size): (&Camera, [u32; 2]),
        path: Option<(&Path, String)>,
    ) -> Failure {
        let bounds = loaded.scene.bounds();
        let is_seen = || camera.view(size)?.validate_for(&bounds);
        if !matches!(error, Error::Argument(_)) || is_seen().is_ok() {
            return error.into();
        }
        let Some(fault) = Framing::usual_fault(&loaded.subject, &bounds, size) else {
            return match path {
                Some((file, place)) => error.stated_in(file, place).into(),
                None => error.into(),
            };
        };
        let reach = |item: &Item| {
            let Bounds { min, max } = item.bounds();
            min.abs().max(max.abs()).max_element()
        };
        let inputs = self.inputs.iter().zip(&loaded.scene.items);
        let farthest = inputs.max_by(|(_, a), (_, b)| reach(a).total_cmp(&reach(b)));
        match farthest {
            Some((path, item)) => Framing::out_of_sight(path, item.bounds(), &fault).into(),
            None => error.into(),
        }
    }

    /// Returns what a loaded scene says for texts if other transfer functions show the fields of
    /// these items.
    #[cfg(feature = "window")]
    pub fn facts_with(&self, loaded: &Loaded, transfers: &[(usize, TransferFunction)]) -> Facts {
        let mut facts = loaded.facts.clone();
        let fields = loaded.scene.fields().into_iter().zip(facts.fields.clone());
        for (item, bar) in fields {
            let own = transfers.iter().find(|(own, _)| *own == item);
            let values = loaded.scene.items[item].value_range();
            let (Some((_, transfer)), Some(values), Some(bar)) =
                (own, values, facts.bars.get_mut(bar))
            else {
                continue;
            };
            // The colours are the function's own by now, also those of a map.
            let title = std::mem::take(&mut bar.title);
            *bar = self.show.color.bar(transfer, values, title);
            if let Item::Volume(volume, ..) = &loaded.scene.items[item]
                && let Some(labels) = &volume.about.labels
            {
                bar.labels = ColorFlags::legend(transfer, labels);
            }
        }
        facts
    }

    /// Gives the bars of several fields without a name the names of their files.
    fn name_fields(&self, loaded: &mut Loaded) {
        let items = loaded.scene.fields();
        if items.len() < 2 {
            return;
        }
        let unnamed = titled("", "");
        for (item, bar) in items.into_iter().zip(&loaded.facts.fields) {
            // Each input is an item.
            let name = self.inputs.get(item).and_then(|path| path.file_stem());
            let title = &mut loaded.facts.bars[*bar].title;
            let is_unnamed = *title == unnamed || title.starts_with(&format!("{unnamed} ("));
            if let Some(name) = name.filter(|_| is_unnamed) {
                *title = title.replacen(&unnamed, &name.to_string_lossy(), 1);
            }
        }
    }

    /// Returns the inputs as a line of text.
    pub fn name(&self) -> String {
        self.inputs.iter().map(|path| path.display().to_string()).collect::<Vec<_>>().join(", ")
    }
}

/// A scene to which inputs are added.
struct Adding<'a> {
    flags: &'a SceneFlags,
    show: Show<'a>,
    facets: bool,
    /// A flag of optics that is given.
    optics: Option<&'static str>,
    progress: &'a Progress,
    loaded: Loaded,
}

impl Adding<'_> {
    /// Adds an input to the scene. Its splats must be made by the deadline.
    fn add(&mut self, path: &Path, input: Data, deadline: Deadline) -> Result<(), Failure> {
        match input {
            Data::Mesh(mesh) => self.add_mesh(path, mesh, deadline),
            Data::Hierarchy(hierarchy) => {
                self.add_hierarchy(path, hierarchy);
                Ok(())
            }
            Data::Bricks(bricks) => self.add_bricks(path, bricks),
            Data::Volume(volume) => self.add_volume(path, volume),
            Data::Samples(points) => self.add_samples(path, &points, deadline),
            Data::Cells(cells) => self.add_cells(path, cells),
            Data::Gaussians(set) => {
                self.add_gaussians(path, set);
                Ok(())
            }
        }
    }

    fn add_mesh(&mut self, path: &Path, mut mesh: Mesh, deadline: Deadline) -> Result<(), Failure> {
        self.frame(path, mesh.about.frame);
        self.progress.stage(format!("Finding the way up of {}", path.display()));
        let warning = self.loaded.subject.stand_mesh(&named_as(path), &mut mesh);
        self.warn(warning);
        let coloring = self.show.coloring_of(path);
        let up = self.loaded.subject.stance.up;
        let named = self.flags.load.scalar().is_some();
        self.loaded.facts.bars.extend(color::paint(&coloring, path, &mut mesh, up, named)?);
        self.progress.stage(format!("Making splats of {}", path.display()));
        self.add_unit(&mesh.about.length);
        let mut options = SurfelOptions { deadline, ..SurfelOptions::default() };
        options.radius_scale *= self.flags.show.radius_scale.unwrap_or(1.0);
        options.color_by_normal = coloring.by_normal();
        if let Some(crease) = self.flags.show.crease {
            // Triangles of one plane still join.
            options.crease_angle_degrees = crease.max(0.01);
        }
        if self.flags.show.edges && !mesh.triangles.is_empty() {
            self.loaded.edges.push(Edges::of(&mesh));
        }
        let depth = self.show.optical_depth(path);
        options.optical_depth = depth.unwrap_or(options.optical_depth);
        // Radii are for surfels, and facets are opaque.
        if !self.facets || self.flags.show.radius_scale.is_some() || depth.is_some() {
            options.most_facets = 0;
        }
        let bounds = mesh.bounds().map(|[min, max]| Bounds { min, max });
        if let Some(facets) = mesh.facets(&options).map_err(|e| in_file(path, e))? {
            self.loaded.count_in(bounds.unwrap_or(facets.bounds()), facets.facets.len());
            self.change(|scene| scene.with_facets(facets));
        } else {
            let splats = mesh.surfels(&options).map_err(|e| in_file(path, e))?;
            self.loaded.count_in(bounds.unwrap_or(splats.bounds()), splats.splats.len());
            self.change(|scene| scene.with_splats(splats));
        }
        Ok(())
    }

    fn add_gaussians(&mut self, path: &Path, mut set: Gaussians) {
        self.frame(path, set.about.frame);
        let warning = self.loaded.subject.stand_gaussians(&named_as(path), &mut set);
        self.warn(warning);
        self.loaded.count_in(set.bounds(), set.len());
        self.add_unit(&set.about.length);
        self.change(|scene| scene.with_gaussians(set));
    }

    fn add_hierarchy(&mut self, path: &Path, hierarchy: Arc<Hierarchy>) {
        let header = hierarchy.header();
        self.loaded.count_in(header.bounds, header.leaves as usize);
        self.add_unit(&header.unit);
        let warnings = self.loaded.subject.stand_hierarchy(&named_as(path), &hierarchy);
        self.warn(warnings);
        self.loaded.facts.is_patient = self.loaded.subject.is_patient();
        self.change(|scene| scene.with_hierarchy(hierarchy));
    }

    fn add_bricks(&mut self, path: &Path, bricks: Arc<Bricks>) -> Result<(), Failure> {
        if self.show.sharp {
            let error = Error::input(path, "content", "a volume in bricks cannot be sharpened");
            return Err(error.hint("leave out --sharp, or draw the original volume").into());
        }
        let transfer = self.show.of_bricks(path, &bricks)?;
        let values = bricks.header().range;
        self.add_bar(&transfer, values, titled("", ""));
        self.add_unit(&bricks.header().unit);
        self.loaded.count_in(bricks.bounds(), bricks.level(0).dims.iter().product());
        self.frame(path, bricks.header().frame);
        self.stand_as_told(path, bricks.header().stance());
        let kernel = self.show.kernel.clone();
        self.change(|scene| scene.with_bricks(bricks, kernel, transfer));
        Ok(())
    }

    fn add_volume(&mut self, path: &Path, mut volume: Volume) -> Result<(), Failure> {
        if volume.colors.is_some() {
            match self.show.shows_values(path).or(self.optics) {
                None => return self.add_colors(path, &volume),
                Some(flag) => self.progress.warn(format_args!(
                    "{} has colours; --{flag} shows their brightness instead",
                    path.display()
                )),
            }
        }
        let transfer = self.show.of_volume(path, &volume)?;
        let title = titled(&volume.about.name, &volume.about.unit);
        self.add_bar(&transfer, volume.range, title);
        if let (Some(labels), Some(bar)) = (&volume.about.labels, self.loaded.facts.bars.last_mut())
        {
            bar.labels = ColorFlags::legend(&transfer, labels);
        }
        self.add_unit(&volume.about.length);
        self.frame(path, volume.about.frame);
        let [min, max] = volume.bounds();
        self.loaded.count_in(Bounds { min, max }, volume.len());
        self.stand_as_told(path, volume.about.stance);
        let kernel = self.show.kernel.clone();
        if self.show.sharp {
            self.progress.stage(format!("Sharpening {}", path.display()));
            volume = volume.sharpened(&kernel)?;
        }
        self.change(|scene| scene.with_volume(volume, kernel, transfer));
        Ok(())
    }

    /// Adds a volume in its own colours.
    fn add_colors(&mut self, path: &Path, volume: &Volume) -> Result<(), Failure> {
        self.progress.stage(format!("Making splats of {}", path.display()));
        let splats = volume.colored_splats().map_err(|e| in_file(path, e))?;
        self.add_unit(&volume.about.length);
        self.frame(path, volume.about.frame);
        let [min, max] = volume.bounds();
        self.loaded.count_in(Bounds { min, max }, volume.len());
        self.stand_as_told(path, volume.about.stance);
        self.change(|scene| scene.with_splats(splats.expect("the volume has colours")));
        Ok(())
    }

    fn add_samples(
        &mut self,
        path: &Path,
        points: &Points,
        deadline: Deadline,
    ) -> Result<(), Failure> {
        let transfer = self.show.of_samples(path, points)?;
        self.frame(path, points.about.frame);
        self.add_bar(&transfer, points.range(), titled(&points.about.name, &points.about.unit));
        self.progress.stage(format!("Making splats of {}", path.display()));
        let options = self.flags.load.sample_options(deadline);
        let splats = points.to_splats(&options).map_err(|e| in_file(path, e))?;
        let [min, max] = points.bounds();
        self.loaded.count_in(Bounds { min, max }.union(splats.bounds()), points.len());
        self.stand_as_told(path, points.about.stance);
        self.change(|scene| scene.with_samples(splats, transfer));
        Ok(())
    }

    fn add_cells(&mut self, path: &Path, mut cells: Cells) -> Result<(), Failure> {
        let transfer = self.show.of_cells(path, &cells)?;
        self.frame(path, cells.about.frame);
        let title = titled(&cells.about.name, &cells.about.unit);
        self.add_bar(&transfer, cells.range(), title);
        self.add_unit(&cells.about.length);
        self.progress.stage(format!("Dividing the cells of {}", path.display()));
        if !transfer.isosurfaces.is_empty() {
            cells = cells.with_values_of_points();
        }
        let options = CellOptions::default();
        let tetrahedra = cells.tetrahedra(&options).map_err(|e| in_file(path, e))?;
        self.loaded.count_in(tetrahedra.bounds(), cells.len());
        self.stand_as_told(path, cells.about.stance);
        self.change(|scene| scene.with_cells(tetrahedra, transfer));
        Ok(())
    }

    fn add_unit(&mut self, unit: &str) {
        if self.loaded.facts.length.is_empty() {
            self.loaded.facts.length = unit.to_owned();
        }
    }

    fn add_bar(&mut self, transfer: &TransferFunction, values: [f64; 2], title: String) {
        self.loaded.facts.fields.push(self.loaded.facts.bars.len());
        self.loaded.facts.bars.push(self.flags.show.color.bar(transfer, values, title));
    }

    /// Takes the stance of a volume or of samples, or the convention for them.
    fn stand_as_told(&mut self, path: &Path, told: Option<Stance>) {
        let name = named_as(path);
        let warning = self.loaded.subject.stand_as_told(&name, told, Stance::SURVEY);
        self.warn(warning);
    }

    /// Takes the frame of an input, and says if it cannot be compared with those before.
    fn frame(&mut self, path: &Path, frame: Frame) {
        let warning = self.loaded.subject.frame(&named_as(path), frame);
        self.warn(warning);
        self.loaded.facts.is_patient = self.loaded.subject.is_patient();
    }

    fn warn(&self, warnings: impl IntoIterator<Item = String>) {
        warnings.into_iter().for_each(|warning| self.progress.warn(warning));
    }

    fn change(&mut self, change: impl FnOnce(Scene) -> Scene) {
        self.loaded.scene = change(std::mem::take(&mut self.loaded.scene));
    }
}

impl Loaded {
    /// Finds the points that span what is seen, if the camera is fitted to them.
    pub fn find_seen(&mut self, camera: &Framing, settings: &Settings) -> splatkit::Result<()> {
        if !camera.is_placed() {
            self.subject.seen = self.scene.seen(&settings.clips)?;
        }
        Ok(())
    }

    /// Adds the bounds and the number of splats or samples of an input.
    fn count_in(&mut self, bounds: Bounds, count: usize) {
        self.subject.count_in(bounds);
        self.count += count as u64;
    }
}

/// Returns what an input is called in warnings.
fn named_as(path: &Path) -> String {
    path.display().to_string()
}
