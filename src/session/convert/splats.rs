//! The splats of meshes, point clouds and hierarchies, and the hierarchy of them.

use super::{Built, Converted, Expected, Watch, Work, memory, milliseconds, wrong};
use crate::{
    Error, Result,
    about::Orientation,
    hierarchy::{
        self,
        external::{memory_of_mesh, memory_of_splats},
    },
    session::{Data, Name},
    splat::Surfels,
    surface::Mesh,
};
use glam::DVec3;
use std::path::Path;
use web_time::Instant;

/// Number of splats that a trial builds.
const SAMPLE: usize = 1 << 17;

/// The splats of inputs, and facts about their source.
pub struct Gathered {
    pub set: Surfels,
    pub closed: bool,
    /// The frame of the first input.
    pub frame: Frame,
    pub points: u64,
    pub read_ms: f64,
    pub splats_ms: f64,
}

/// Facts about an input's coordinates, for viewers.
#[derive(Default)]
pub struct Frame {
    pub orientation: Option<Orientation>,
    /// Whether the orientation was guessed from the shape.
    pub is_guessed: bool,
    pub unit: String,
}

impl Frame {
    /// Takes what a file says of its orientation, or a guess.
    pub fn of(
        stated: Option<Orientation>,
        guess: impl FnOnce() -> Result<Option<Orientation>>,
    ) -> Result<Self> {
        let orientation = match stated {
            Some(orientation) => Some(orientation),
            None => guess()?,
        };
        Ok(Self {
            orientation,
            is_guessed: stated.is_none() && orientation.is_some(),
            unit: String::new(),
        })
    }

    /// Returns the direction in which heights are measured: that to be recorded, or the input's.
    pub fn up(&self, recorded: Option<DVec3>) -> DVec3 {
        recorded.unwrap_or(self.orientation.map_or(DVec3::Y, |orientation| orientation.up))
    }
}

impl<W: Watch> Work<'_, W> {
    pub fn hierarchy(&self) -> Result<Converted, W::Error> {
        if self.are_gaussians()? {
            return self.gaussian_hierarchy();
        }
        let need = self.need();
        if need.bytes > self.conversion.most_memory() || self.conversion.in_regions {
            return match self.conversion.edits.is_empty() {
                true => self.in_regions(need),
                false => self.edited_in_regions(),
            };
        }
        let gathered = self.gather()?;
        let start = Instant::now();
        let splats = gathered.set.splats.len();
        let watch =
            |done: u64, _: u64| self.watch.progress("Building the hierarchy", done, splats as u64);
        watch(0, 0);
        let build = self.conversion.build_options(gathered.closed, gathered.points);
        let write = self.conversion.write_options(self.files, &gathered.frame);
        let built = hierarchy::build_file(&gathered.set, self.output, &build, &write, Some(&watch));
        built.map_err(|error| self.at_fault(error))?;
        Ok(Converted::Hierarchy(gathered.built(milliseconds(start))))
    }

    pub fn expect_hierarchy(&self) -> Result<Expected, W::Error> {
        if self.are_gaussians()? {
            return self.expect_gaussian_hierarchy();
        }
        let need = self.need();
        if need.bytes > self.conversion.most_memory() || self.conversion.in_regions {
            if !self.conversion.edits.is_empty() {
                let message = "--dry-run finds nothing of edits of more than fits in memory";
                return Err(wrong(message).into());
            }
            return self.expect_regions(need);
        }
        self.extrapolated(&self.gather()?, need.bytes)
    }

    /// Extrapolates what a conversion would take from a contiguous part of the splats.
    fn extrapolated(&self, gathered: &Gathered, need: u64) -> Result<Expected, W::Error> {
        self.watch.stage("Trying a part");
        let splats = &gathered.set.splats;
        // Subdivided triangles give many more splats; the data that splats are made from takes
        // about as much again.
        let memory = need.max(2 * memory_of_splats(splats.len()));
        let count = splats.len().min(SAMPLE);
        let first = (splats.len() - count) / 2;
        let Surfels { origin, extent, .. } = gathered.set;
        let splats_of_part = splats[first..first + count].to_vec();
        let part = Surfels { origin, splats: splats_of_part, extent };
        let build = self.conversion.build_options(gathered.closed, gathered.points);
        let write = self.conversion.write_options(self.files, &gathered.frame);
        let start = Instant::now();
        let tree = hierarchy::Tree::build(&part, &build, None);
        let tree = tree.map_err(|error| self.at_fault(error))?;
        let bytes = hierarchy::file::to_bytes(&tree, &write)?.len() as f64;
        let share = splats.len() as f64 / count as f64;
        let built = gathered.built(milliseconds(start) * share);
        Ok(Expected::Hierarchy { built, bytes: (bytes * share) as u64, memory })
    }

    /// Returns the memory for converting all inputs as a whole.
    pub fn need(&self) -> memory::Need {
        let limits = self.conversion.reading.limits();
        let options = self.conversion.surfel_options(limits.deadline());
        memory::need(self.files, limits, &options, self.conversion.most_memory())
    }

    /// Reads all inputs and makes splats of them, relative to the first input's origin.
    fn gather(&self) -> Result<Gathered, W::Error> {
        if let Some(gathered) = self.edited_points()? {
            return Ok(gathered);
        }
        let mut gathered: Option<Gathered> = None;
        for path in self.files {
            let taken = gathered.as_ref().map_or(0, |all| memory_of_splats(all.set.splats.len()));
            let one = self.splats_of(path, taken)?;
            match &mut gathered {
                None => gathered = Some(one),
                Some(all) => all.join(one, path)?,
            }
        }
        Ok(gathered.ok_or_else(|| wrong("there is nothing to convert"))?)
    }

    /// Returns the splats of an input that is no trained scene. The splats of earlier inputs have
    /// `taken` this many bytes.
    pub fn splats_of(&self, path: &Path, taken: u64) -> Result<Gathered, W::Error> {
        self.watch.stage(&format!("Reading {}", path.display()));
        let start = Instant::now();
        let most = self.conversion.most_memory();
        // One deadline covers reading the input and making its splats.
        let deadline = self.conversion.reading.limits().deadline();
        let reading = self.conversion.reading(Some(most));
        let opened = reading.open_colored(path, self.conversion.attribute())?;
        let data = opened.read()?.with_surface_of_bare_cells()?;
        self.watch.has_read(&opened.files())?;
        let read_ms = milliseconds(start);
        let start = Instant::now();
        let mut gathered = match data {
            Data::Mesh(mesh) => {
                let options = self.conversion.surfel_options(deadline);
                let mesh = self.edited_mesh(path, mesh)?;
                let (mesh, frame) = self.painted(path, mesh)?;
                self.watch.stage(&format!("Making splats of {} points", mesh.positions.len()));
                let need = memory_of_mesh(&mesh, &options, most.saturating_sub(taken));
                memory::check(path, need.map_err(|e| in_file(path, e))?, taken, most)?;
                let closed = mesh.is_solid();
                let set = mesh.surfels(&options).map_err(|e| in_file(path, e))?;
                let points = mesh.positions.len() as u64;
                Gathered { set, closed, frame, points, read_ms, splats_ms: 0.0 }
            }
            Data::Hierarchy(hierarchy) => {
                self.watch.has_colored(false, false)?;
                self.watch.stage("Reading the splats of the finest level");
                let header = hierarchy.header();
                memory::check(path, memory_of_splats(header.leaves as usize), taken, most)?;
                let mut set = hierarchy.leaves()?;
                let stand = Frame { orientation: header.orientation, ..Frame::default() };
                self.edit(&mut set, path, stand.up(self.conversion.up))?;
                let scale = self.conversion.radius_scale;
                let larger = |factor: [f32; 6]| factor.map(|entry| entry * scale);
                set.splats.iter_mut().for_each(|splat| splat.factor = larger(splat.factor));
                let unit = header.unit.clone();
                let frame =
                    Frame { orientation: header.orientation, is_guessed: header.is_guessed, unit };
                let closed = header.closed && self.conversion.edits.is_empty();
                let points = header.source_points;
                Gathered { set, closed, frame, points, read_ms, splats_ms: 0.0 }
            }
            Data::Gaussians(_) => {
                let message = "holds trained Gaussians, and another input does not; a hierarchy \
                               is built of either";
                return Err(wrong(format!("{} {message}", path.display())).into());
            }
            Data::Volume(_) | Data::Samples(_) | Data::Bricks(_) | Data::Cells(_) => {
                let message = "holds a volume, cells or samples; hierarchies are built from \
                               meshes and point clouds";
                return Err(wrong(format!("{} {message}", path.display())).into());
            }
        };
        gathered.splats_ms = milliseconds(start);
        hierarchy::check_splats(&gathered.set).map_err(|error| in_file(path, error))?;
        Ok(gathered)
    }

    /// Returns a mesh or point cloud in its colours, and how it stands.
    pub fn painted(&self, path: &Path, mut mesh: Mesh) -> Result<(Mesh, Frame), W::Error> {
        let frame = Frame::of(mesh.about.orientation, || Ok(mesh.guess_orientation()))?;
        let named = self.conversion.reading.options.scalar.is_some();
        let up = frame.up(self.conversion.up);
        let legend = self.conversion.coloring.paint(&Name::of_file(path), &mut mesh, up, named)?;
        self.watch.has_colored(true, legend.is_some())?;
        Ok((mesh, frame))
    }
}

impl Gathered {
    /// Adds the splats of another input.
    fn join(&mut self, other: Self, path: &Path) -> Result<()> {
        if other.set.extent != self.set.extent {
            let message = "their footprints have another extent than those of the first input";
            return Err(Error::input(path, "splats", message));
        }
        let mut set = other.set;
        set.move_origin(self.set.origin).map_err(|error| in_file(path, error))?;
        self.set.splats.append(&mut set.splats);
        // A statement counts more than a guess before it.
        let frame = other.frame;
        let states = frame.orientation.is_some() && !frame.is_guessed;
        if self.frame.orientation.is_none() || (self.frame.is_guessed && states) {
            (self.frame.orientation, self.frame.is_guessed) = (frame.orientation, frame.is_guessed);
        }
        self.closed &= other.closed;
        self.points += other.points;
        self.read_ms += other.read_ms;
        self.splats_ms += other.splats_ms;
        Ok(())
    }

    fn built(&self, build_ms: f64) -> Built {
        Built {
            points: self.points,
            splats: self.set.splats.len(),
            closed: self.closed,
            read_ms: self.read_ms,
            splats_ms: self.splats_ms,
            build_ms,
        }
    }
}

/// Makes wrong values in an input the input's fault.
pub fn in_file(path: &Path, error: Error) -> Error {
    error.stated_in(path, "content")
}
