//! Edits of points that are read in pieces.
//!
//! Edits whose result for a point depends on no other point are made piece by piece. For others,
//! the file is read once more: the places of the points that arrive at the edit are collected, 12
//! bytes each, and it is decided which of them stay. Thinning by a distance needs only those that
//! it keeps.

use super::{
    Change, Context, Crs, Edit, Editable, check_left, clusters,
    clusters::Clusters,
    one,
    thin::{Discs, Thin},
};
use crate::{
    Error, Result,
    about::Orientation,
    formats::{Attribute, Records, Stream},
    progress::{Watch, tell},
    surface::{Mesh, SurfelOptions},
};
use glam::{DVec3, Vec3};
use std::path::Path;

/// Points of files, and the edits that are made of them while they are read.
pub struct Pass<'a> {
    streams: Vec<Stream<'a>>,
    edits: &'a [Edit],
    context: Context,
    /// The attributes to read.
    names: Vec<String>,
    watch: Watch<'a>,
}

/// What is done to points as they arrive.
enum Step<'a> {
    Local(&'a Edit),
    Discs {
        distance: f64,
        discs: Discs,
        origin: DVec3,
    },
    /// Which of the points that arrive stay.
    Mask {
        kept: Vec<bool>,
        at: usize,
    },
    Normals {
        normals: Vec<Vec3>,
        at: usize,
    },
}

/// Bytes of memory for the place of a point.
const OF_PLACE: u64 = size_of::<Vec3>() as u64;

impl<'a> Pass<'a> {
    /// Takes files of points without triangles, and makes the first pass over them. All attributes
    /// are read, or those of these names and those that the edits need. `watch` is called with the
    /// number of points that were read in a pass, and that of all.
    ///
    /// # Errors
    /// Those of reading the files.
    pub fn new(
        mut streams: Vec<Stream<'a>>,
        edits: &'a [Edit],
        context: Context,
        names: Option<&[String]>,
        watch: Watch<'a>,
    ) -> Result<Self> {
        let expected = streams.iter().map(|stream| stream.counts().points).sum();
        let mut before = 0;
        for stream in &mut streams {
            stream.settle(&|seen| tell(watch, before + seen, expected))?;
            before += stream.point_count();
        }
        let mut all: Vec<Attribute> = Vec::new();
        for stream in &streams {
            for attribute in stream.attributes()? {
                if !all.iter().any(|known| known.name == attribute.name) {
                    all.push(attribute);
                }
            }
        }
        let known = || all.iter().map(|attribute| attribute.name.as_str());
        let of_edits = edits.iter().filter_map(|edit| match edit {
            Edit::Where(expression) => Some(expression.names()),
            _ => None,
        });
        let wanted: Vec<&str> = match names {
            None => known().collect(),
            Some(names) => names.iter().map(String::as_str).chain(of_edits.flatten()).collect(),
        };
        let chosen = wanted.into_iter().filter_map(|name| super::find(known(), name));
        let mut chosen: Vec<usize> = chosen.collect();
        chosen.sort_unstable();
        chosen.dedup();
        let names = chosen.into_iter().map(|at| all[at].name.clone()).collect();
        Ok(Self { streams, edits, context, names, watch })
    }

    /// Returns the attributes that the points have.
    ///
    /// # Errors
    /// Those of reading headers.
    pub(crate) fn attributes(&self) -> Result<Vec<Attribute>> {
        let mut all: Vec<Attribute> = Vec::new();
        for stream in &self.streams {
            for attribute in stream.attributes()? {
                let is_known = all.iter().any(|known| known.name == attribute.name);
                if self.names.contains(&attribute.name) && !is_known {
                    all.push(attribute);
                }
            }
        }
        Ok(all)
    }

    /// Returns whether points have normals, and colours of their own.
    pub(crate) fn has(&self) -> [bool; 2] {
        let estimates = self.edits.contains(&Edit::Normals);
        let has_normals = self.streams.iter().all(Stream::has_normals);
        let has_colors =
            self.streams.iter().all(|stream| stream.has_colors() && !stream.are_greys());
        [estimates || has_normals, has_colors]
    }

    /// Returns whether colours are greys that stand for an attribute.
    pub(crate) fn has_greys(&self) -> bool {
        self.streams.iter().any(Stream::are_greys)
    }

    /// Returns the corners of a box around all points, after the edits.
    pub(crate) fn bounds(&self) -> [DVec3; 2] {
        let mut corners: Vec<DVec3> = Vec::new();
        for stream in &self.streams {
            let ends = stream.bounds().map(|corner| stream.origin() + corner.as_dvec3());
            let context = self.context_of(stream);
            corners.extend(self.moved(sampled(ends, 1), &context));
        }
        around(&corners)
    }

    /// Returns some points of a box where the edits move them.
    fn moved(&self, mut places: Vec<DVec3>, context: &Context) -> Vec<DVec3> {
        for (at, edit) in self.edits.iter().enumerate() {
            match edit {
                Edit::Move(motion) => {
                    places.iter_mut().for_each(|place| *place = motion.place(*place));
                }
                Edit::Reproject(reprojection) => {
                    // What fails here fails again where points are edited, with an error.
                    let context = context.after(&self.edits[..at]);
                    let Ok(mapping) = reprojection.mapping(&context) else { continue };
                    // A map bends the sides of a box.
                    let places_there = sampled(around(&places), SAMPLED).into_iter();
                    places = places_there.filter_map(|place| mapping.place(place).ok()).collect();
                    let [low, high] = around(&places);
                    places = sampled([low, high], 1);
                }
                _ => {}
            }
        }
        places
    }

    /// Returns what edits need to know of a file.
    fn context_of(&self, stream: &Stream) -> Context {
        let file = stream.path().to_owned();
        Context { file, crs: stream.crs(), ..self.context.clone() }
    }

    /// Returns the system that the last reprojection leads to, if there is one.
    pub(crate) fn crs(&self) -> Option<&Crs> {
        self.edits.iter().rev().find_map(|edit| match edit {
            Edit::Reproject(reprojection) => Some(&reprojection.to),
            _ => None,
        })
    }

    /// Returns the middle of all points, in whole numbers.
    pub(crate) fn middle(&self) -> DVec3 {
        let [low, high] = self.bounds();
        (0.5 * (low + high)).round()
    }

    /// Returns the steps and the offset of whole numbers that positions are stored as, if the first
    /// file has such and nothing is moved.
    pub(crate) fn grid(&self) -> Option<[DVec3; 2]> {
        if self.crs().is_some_and(Crs::is_geographic) {
            return Some(grid_of_degrees(self.bounds()));
        }
        let is_moved =
            self.edits.iter().any(|edit| matches!(edit, Edit::Move(_) | Edit::Reproject(_)));
        self.streams.first().and_then(Stream::grid).filter(|_| !is_moved)
    }

    /// Returns whether 32-bit floats do not hold the positions of a file.
    pub(crate) fn is_wide(&self) -> bool {
        self.streams.iter().any(Stream::is_wide)
    }

    /// Returns the file that is read first.
    pub(crate) fn first(&self) -> Option<&Path> {
        self.streams.first().map(Stream::path)
    }

    /// Returns how the points stand, if the first file says so.
    pub(crate) fn orientation(&self) -> Option<Orientation> {
        self.streams.first().and_then(Stream::orientation)
    }

    /// Returns the number of points of all files.
    pub fn points(&self) -> u64 {
        self.streams.iter().map(Stream::point_count).sum()
    }

    /// Makes the edits, and gives the points that are left to `take`, in their order. Says what
    /// each edit did.
    ///
    /// # Errors
    /// Those of [`apply`](super::apply), of reading the files, and of `take`.
    pub fn run(&self, mut take: impl FnMut(Records) -> Result<()>) -> Result<Vec<Change>> {
        self.check_moves()?;
        let mut steps: Vec<Step> = Vec::new();
        for edit in self.edits {
            let step = match edit {
                edit if edit.is_local() => Step::Local(edit),
                Edit::Thin(Thin::Distance(distance)) => {
                    let discs = Discs::new(*distance)?;
                    Step::Discs { distance: *distance, discs, origin: self.middle() }
                }
                edit => self.decided(edit, &mut steps)?,
            };
            steps.push(step);
        }
        let changes = self.pass(&mut steps, &mut take)?;
        let changes: Vec<Change> = self
            .edits
            .iter()
            .zip(changes.windows(2))
            .map(|(edit, counts)| Change { edit: edit.name(), before: counts[0], after: counts[1] })
            .collect();
        check_left(&changes, &self.context)?;
        Ok(changes)
    }

    /// Checks that the moves before a map keep the shape of each file's points.
    fn check_moves(&self) -> Result<()> {
        for stream in &self.streams {
            let mut ends = stream.bounds().map(|corner| stream.origin() + corner.as_dvec3());
            for edit in self.edits {
                match edit {
                    Edit::Move(motion) => ends = motion.check(ends)?,
                    Edit::Reproject(_) => break,
                    _ => {}
                }
            }
        }
        Ok(())
    }

    /// Decides an edit for which all points that arrive at it must be known.
    fn decided(&self, edit: &'a Edit, steps: &mut [Step<'a>]) -> Result<Step<'a>> {
        let places = self.places(edit, steps)?;
        let at = 0;
        Ok(match edit {
            Edit::Thin(thin) => Step::Mask { kept: thin.kept(&places)?, at },
            Edit::Normals => {
                let mut mesh = Mesh { positions: places, ..Mesh::default() };
                mesh.estimate_normals(&SurfelOptions::default())?;
                Step::Normals { normals: mesh.normals, at }
            }
            edit => {
                clusters::check_memory(edit.name(), places.len(), &self.context)?;
                let clusters = Clusters::new(&places, &vec![0.0; places.len()], &[]);
                let kept = match edit {
                    Edit::KeepCluster(count) => clusters.largest(*count),
                    _ => clusters.without_floaters(),
                };
                Step::Mask { kept, at }
            }
        })
    }

    /// Returns the places of the points that arrive after these steps, around an origin.
    fn places(&self, edit: &Edit, steps: &mut [Step<'a>]) -> Result<Vec<Vec3>> {
        let most = self.context.memory / OF_PLACE;
        // Room that is not used takes no memory.
        let mut places = Vec::with_capacity(self.points().min(most) as usize);
        let origin = self.middle();
        let name = edit.name();
        self.pass(steps, &mut |records| {
            if (places.len() + records.count()) as u64 > most {
                return Err(Error::Argument(format!(
                    "--{name} compares all points, and the places of more than {most} do not fit \
                     in {} MiB; --memory allows more, and --thin with a distance before it needs \
                     only the points that it keeps",
                    self.context.memory >> 20
                )));
            }
            places.extend(records.positions.iter().map(|place| (*place - origin).as_vec3()));
            Ok(())
        })?;
        if places.is_empty() {
            let change = Change { edit: name, before: 0, after: 0 };
            check_left(&[change], &self.context)?;
        }
        Ok(places)
    }

    /// Reads all points, makes the steps, and gives what is left to `take`. Returns the number of
    /// points before the first step, and after each.
    fn pass(
        &self,
        steps: &mut [Step<'a>],
        take: &mut dyn FnMut(Records) -> Result<()>,
    ) -> Result<Vec<u64>> {
        let is_local = |step: &Step| matches!(step, Step::Local(_));
        let head = steps.iter().take_while(|step| is_local(step)).count();
        for step in steps.iter_mut() {
            step.restart()?;
        }
        let mut counts = vec![0; steps.len() + 1];
        let all = self.points();
        let edits: Vec<Edit> = self.edits[..head].to_vec();
        let mut seen = 0;
        for stream in &self.streams {
            let context = &self.context_of(stream);
            // What is known of a scene changes with its system.
            let contexts: Vec<Context> =
                (0..self.edits.len()).map(|at| context.after(&self.edits[..at])).collect();
            let begun = |mut records: Records| {
                let before = records.count() as u64;
                let mut counts = vec![before];
                for (edit, context) in edits.iter().zip(&contexts) {
                    one(&mut records, edit, context)?;
                    counts.push(records.count() as u64);
                }
                Ok((records, counts))
            };
            stream.records(&self.names, begun, |begun: Result<(Records, Vec<u64>)>| {
                let (mut records, of_piece) = begun?;
                counts.iter_mut().zip(&of_piece).for_each(|(count, more)| *count += more);
                seen += of_piece[0];
                for (at, step) in steps.iter_mut().enumerate().skip(head) {
                    step.make(&mut records, &contexts[at])?;
                    counts[at + 1] += records.count() as u64;
                }
                tell(self.watch, seen, all);
                if records.count() > 0 { take(records) } else { Ok(()) }
            })?;
        }
        Ok(counts)
    }
}

/// Points along a side of a box that is mapped to another system.
const SAMPLED: usize = 16;

/// The steps of longitudes and latitudes: 0.1 mm.
const DEGREES: f64 = 1e-9;

/// Returns points of a box, its corners among them: this many steps along x and y.
fn sampled([low, high]: [DVec3; 2], steps: usize) -> Vec<DVec3> {
    let at = |index: usize| {
        let side = steps + 1;
        let share = |step: usize| step as f64 / steps as f64;
        let z = if index / (side * side) == 0 { 0.0 } else { 1.0 };
        let share = DVec3::new(share(index % side), share(index / side % side), z);
        low + share * (high - low)
    };
    (0..2 * (steps + 1) * (steps + 1)).map(at).collect()
}

/// Returns the corners of the box around points.
fn around(places: &[DVec3]) -> [DVec3; 2] {
    let none = [DVec3::INFINITY, DVec3::NEG_INFINITY];
    places.iter().fold(none, |[low, high], at| [low.min(*at), high.max(*at)])
}

/// Returns the steps and the offset of positions in degrees with heights in another unit.
pub(crate) fn grid_of_degrees([low, high]: [DVec3; 2]) -> [DVec3; 2] {
    let size = high - low;
    let step = |size: f64, least: f64| 10f64.powf((size * 1e-9).log10().ceil()).max(least);
    let flat = step(size.x.max(size.y), DEGREES);
    [DVec3::new(flat, flat, step(size.z, 1e-4)), low.floor()]
}

impl Step<'_> {
    /// Begins another pass over the same points.
    fn restart(&mut self) -> Result<()> {
        match self {
            Self::Local(_) => {}
            Self::Discs { distance, discs, .. } => *discs = Discs::new(*distance)?,
            Self::Mask { at, .. } | Self::Normals { at, .. } => *at = 0,
        }
        Ok(())
    }

    fn make(&mut self, records: &mut Records, context: &Context) -> Result<()> {
        let count = records.count();
        match self {
            Self::Local(edit) => one(records, edit, context)?,
            Self::Discs { discs, origin, .. } => {
                let kept = |place: &DVec3| discs.keep((*place - *origin).as_vec3());
                let kept: Vec<bool> = records.positions.iter().map(kept).collect();
                records.keep(&kept);
            }
            Self::Mask { kept, at } => {
                records.keep(&kept[*at..*at + count]);
                *at += count;
            }
            Self::Normals { normals, at } => {
                records.normals = normals[*at..*at + count].to_vec();
                *at += count;
            }
        }
        Ok(())
    }
}
