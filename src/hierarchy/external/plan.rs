//! Plans: what decides a hierarchy that is made in parts, by one program or by many.

use super::{
    BLOCKS, Converted, ExternalOptions, Shape, Stage, StageWatch, Work,
    field::{check, within},
    inputs::PlannedInput,
    join,
    part_file::{self, Label, PartFile},
    sound::check_write,
    survey::Surveyed,
    survey_all, tell,
};
use crate::{
    Deadline, Error, Result,
    container::Spill,
    disk,
    hierarchy::file::WriteOptions,
    input::{Limits, is_whole},
};
use serde::{Deserialize, Serialize};
use std::{
    io,
    ops::Range,
    path::{Path, PathBuf},
};

/// The layout of `plan.json` that is written and read.
const FORMAT: u32 = 1;
/// The name of a plan in its folder, and of the tables beside it.
const NAME: &str = "plan.json";
const TABLES: &str = "plan.tables";
/// The most bytes of a plan.
const MOST_BYTES: u64 = 1 << 30;

/// A conversion to one hierarchy, in parts that can be made in any order, at once, and on several
/// machines. A part needs the plan, the inputs that it meets, and nothing of the other parts.
///
/// ```no_run
/// use splatkit::{
///     hierarchy::{external::{ExternalOptions, Plan}, file::WriteOptions},
///     input::Limits,
/// };
///
/// # fn main() -> splatkit::Result<()> {
/// let limits = Limits::default();
/// let options = ExternalOptions { parts: Some(8), ..ExternalOptions::default() };
/// let plan = Plan::make(
///     &["scan.las".into()], "parts".as_ref(), &limits, &options, &WriteOptions::default(), None,
/// )?;
/// for index in 0..plan.parts() {
///     plan.part(index, &limits, None)?;
/// }
/// plan.join("scan.splk".as_ref(), None)?;
/// # Ok(())
/// # }
/// ```
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Plan {
    format: u32,
    /// The program that made it. Another version may make other bytes.
    program: String,
    /// A hash of all else.
    hash: String,
    options: ExternalOptions,
    write: WriteOptions,
    shape: Shape,
    parts: Vec<PlannedPart>,
    inputs: Vec<PlannedInput>,
    /// The path of the plan.
    #[serde(skip)]
    path: PathBuf,
}

/// A part of a plan.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
struct PlannedPart {
    /// The points that its regions own.
    points: u64,
    regions: Vec<InputRegions>,
}

/// Some regions of an input, by their numbers.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub(super) struct InputRegions {
    pub input: u32,
    pub regions: Range<u32>,
}

/// The result of making a part.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PartMade {
    /// Points that its regions own, of those in the source.
    pub points: u64,
    /// Splats at the finest level.
    pub splats: u64,
    /// The size of its file.
    pub bytes: u64,
    /// Whether it was there already, intact, so that nothing was to be done.
    pub was_finished: bool,
}

impl Plan {
    /// Surveys files, each read as a [`Stream`](crate::formats::Stream), and writes a plan of their
    /// conversion as `plan.json` to a folder, which is created if it is missing. The same files at
    /// the same paths, and the same options, give the same plan.
    ///
    /// # Errors
    /// Those of [`convert`](super::convert()) up to where regions are built.
    pub fn make(
        files: &[PathBuf],
        folder: &Path,
        limits: &Limits,
        options: &ExternalOptions,
        write: &WriteOptions,
        watch: StageWatch<'_>,
    ) -> Result<Self> {
        if let Some(file) = files.iter().find(|file| !is_whole(file)) {
            return Err(Error::Argument(format!(
                "{}: its query or its password would have to stand in the plan; use an address \
                 without, with credentials in the environment, or download the file",
                file.display()
            )));
        }
        std::fs::create_dir_all(folder).map_err(|e| Error::output(folder, e))?;
        let (surveyed, shape) = survey_all(files, limits, options, watch)?;
        let mut tables = Vec::new();
        let inputs: Result<Vec<PlannedInput>> = files
            .iter()
            .zip(&surveyed)
            .map(|(file, input)| PlannedInput::new(file, input, limits, &mut tables))
            .collect();
        let mut plan = Self {
            format: FORMAT,
            program: program(),
            hash: String::new(),
            options: options.clone(),
            write: write.clone(),
            parts: parts(&surveyed, options.parts),
            shape,
            inputs: inputs?,
            path: folder.join(NAME),
        };
        plan.hash = plan.content_hash()?;
        disk::write(&folder.join(TABLES), &tables)?;
        disk::write(&plan.path, (plan.text()? + "\n").as_bytes())?;
        // JSON has no infinities: a plan with one cannot be read back, so it is read here.
        Self::open(&plan.path)
    }

    /// Reads a plan.
    ///
    /// # Errors
    /// [`Error::File`] if it cannot be read; [`Error::Input`] if it is damaged, or was made by
    /// another version of the program.
    pub fn open(path: &Path) -> Result<Self> {
        let length = path.metadata().map_err(|e| Error::file(path, "open", e))?.len();
        let wrong = |message: String| {
            Error::input(path, "plan", message).hint("make the plan again, with --overwrite")
        };
        if length > MOST_BYTES {
            return Err(wrong(format!("has {length} bytes; at most {MOST_BYTES} are expected")));
        }
        let text = std::fs::read_to_string(path).map_err(|e| Error::file(path, "read", e))?;
        // The version comes first: other layouts may lack the rest.
        #[derive(Deserialize)]
        struct Version {
            format: u32,
            program: String,
        }
        let version: Version = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
        if (version.format, &version.program) != (FORMAT, &program()) {
            let (Version { format, program: by }, this) = (version, program());
            return Err(wrong(format!(
                "was made by {by}, in the format {format}, but this is {this}, which has the \
                 format {FORMAT}; all parts of a plan need one version"
            )));
        }
        let mut plan: Self = serde_json::from_str(&text).map_err(|e| wrong(e.to_string()))?;
        plan.path = path.to_owned();
        if plan.content_hash()? != plan.hash {
            return Err(wrong("does not match its hash: it was changed or is damaged".into()));
        }
        plan.check().map_err(wrong)?;
        Ok(plan)
    }

    /// Checks all numbers. An error names the field, its value and what is expected.
    fn check(&self) -> std::result::Result<(), String> {
        within("options", self.options.check())?;
        within("write", check_write(&self.write))?;
        within("shape", self.shape.check())?;
        let (mut points, mut is_closed) = (0, true);
        for (number, input) in self.inputs.iter().enumerate() {
            within(format!("inputs[{number}]"), input.check())?;
            let (owned, _, solid) = input.outline();
            points += owned;
            is_closed &= solid == Some(true);
        }
        let Shape { points: stated, closed, regions, .. } = self.shape;
        check(stated == points, "shape.points", stated, format!("the inputs have {points}"))?;
        check(closed == is_closed, "shape.closed", closed, "the inputs say otherwise")?;
        let planned = self.check_parts()?;
        check(regions == planned, "shape.regions", regions, format!("the parts have {planned}"))
    }

    /// Checks that the parts have each region of each input once, in order. Returns how many.
    fn check_parts(&self) -> std::result::Result<usize, String> {
        let count = self.parts.len();
        let wanted = self.options.parts.map_or(count, |parts| parts as usize);
        check(count > 0 && count == wanted, "the number of parts", count, "another is expected")?;
        let mut next = vec![0u32; self.inputs.len()];
        let mut last = 0;
        for (number, part) in self.parts.iter().enumerate() {
            let mut points = 0;
            for (at, InputRegions { input, regions }) in part.regions.iter().enumerate() {
                let place = format!("parts[{number}].regions[{at}]");
                let source = self.inputs.get(*input as usize).filter(|_| *input >= last);
                let Some(source) = source else {
                    return check(false, place + ".input", input, "there is none").map(|()| 0);
                };
                last = *input;
                let (_, most, solid) = source.outline();
                let end = &mut next[*input as usize];
                // Triangles to be subdivided have a region of their own.
                let most = most + usize::from(solid.is_some());
                let follows = regions.start == *end && regions.start < regions.end;
                let is_known = follows && regions.end as usize <= most;
                check(is_known, place, regions, format!("{end} is the next of up to {most}"))?;
                *end = regions.end;
                points += source.points_of(regions.clone());
            }
            let place = format!("parts[{number}].points");
            check(part.points == points, place, part.points, format!("{points} are expected"))?;
        }
        for (number, (input, end)) in self.inputs.iter().zip(&next).enumerate() {
            let most = input.outline().1;
            let place = format!("the number of regions of inputs[{number}]");
            check(*end as usize >= most, place, end, format!("there are at least {most}"))?;
        }
        Ok(next.iter().map(|end| *end as usize).sum())
    }

    /// Returns the path of the plan.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Returns the number of parts.
    pub fn parts(&self) -> u32 {
        self.parts.len() as u32
    }

    /// Returns the number of points in the source.
    pub fn points(&self) -> u64 {
        self.shape.points
    }

    /// Returns the number of regions that the inputs are split into.
    pub fn regions(&self) -> usize {
        self.shape.regions
    }

    /// Returns the bytes of memory that a part needs, about.
    pub fn memory(&self) -> u64 {
        self.options.memory.max(BLOCKS)
    }

    /// Returns the paths of the inputs.
    pub fn inputs(&self) -> impl Iterator<Item = &Path> {
        self.inputs.iter().map(|input| &*input.path)
    }

    /// Returns the path of a part, whether it is there or not.
    pub fn part_path(&self, index: u32) -> PathBuf {
        disk::folder(&self.path).join(format!("part-{index:05}.splkpart"))
    }

    /// Returns the command that makes a part.
    pub fn part_command(&self, index: u32) -> String {
        format!("splatkit convert --part {} --index {index}", self.path.display())
    }

    /// Makes a part, unless it is finished and intact. Only inputs that its regions meet are
    /// opened. The same part always has the same bytes.
    ///
    /// # Errors
    /// After an error, or when the process ends, the part is missing, or as it was.
    ///
    /// - [`Error::Argument`] if there is no part of this number.
    /// - [`Error::Input`] if an input has changed since the plan was made.
    /// - Those of [`convert`](super::convert()), but [`Error::NothingToDraw`].
    pub fn part(&self, index: u32, limits: &Limits, watch: StageWatch<'_>) -> Result<PartMade> {
        let _span = tracing::info_span!("part", index).entered();
        let Some(part) = self.parts.get(index as usize) else {
            let (path, count) = (self.path.display(), self.parts());
            return Err(Error::Argument(format!(
                "{path}: there is no part {index}; the {count} parts are numbered from 0"
            )));
        };
        let (path, label) = (self.part_path(index), self.label(index)?);
        if let Ok(finished) = PartFile::open(&path, label)?
            && finished.is_intact()?
        {
            let PartFile { bytes, made, .. } = finished;
            let (points, splats) = (part.points, made.splats);
            return Ok(PartMade { points, splats, bytes, was_finished: true });
        }
        let mut work = Work {
            part: part_file::begin(&path, label, self.write.lossless)?,
            shape: &self.shape,
            options: &self.options,
            points: part.points,
            built: 0,
            watch,
            seconds: limits.seconds,
            deadline: Deadline::NEVER,
        };
        for InputRegions { input, regions } in &part.regions {
            let number = *input as usize;
            let input = &self.inputs[number];
            let tables = disk::folder(&self.path).join(TABLES);
            let surveyed = input.open(&tables, &self.options, limits)?;
            let planned = self.parts.iter().flat_map(|part| &part.regions);
            let of_input = planned.filter(|entry| entry.input as usize == number);
            let end = of_input.map(|entry| entry.regions.end).max();
            if end != Some(surveyed.count()) {
                let message = "names other regions than there are";
                return Err(Error::input(&self.path, "plan", message));
            }
            let built = work.input(&surveyed, regions.clone(), &path);
            built.map_err(|error| error.stated_in(&input.path, "content"))?;
        }
        let splats = work.part.made.splats;
        let bytes = part_file::finish(work.part, label)?;
        Ok(PartMade { points: part.points, splats, bytes, was_finished: false })
    }

    /// Joins all parts to one file: writes the top of the tree and copies the pages of the parts.
    /// The file has the same bytes as that of [`convert`](super::convert()).
    ///
    /// # Errors
    /// After an error, nothing is left of the file.
    ///
    /// - [`Error::Input`] if parts are missing or damaged; its hint has the commands that make
    ///   them.
    /// - [`Error::NothingToDraw`] if no splats are left.
    /// - [`Error::Output`] if the file cannot be written.
    pub fn join(&self, path: &Path, watch: StageWatch<'_>) -> Result<Converted> {
        let _span = tracing::info_span!("join").entered();
        let parts = self.finished_parts()?;
        tell(watch, Stage::Writing, 0, 0);
        let lengths: Vec<(PathBuf, u64)> =
            parts.iter().map(|part| (part.path.clone(), part.bytes)).collect();
        let (pages, starts) = Spill::after(&lengths, path)?;
        let made = || parts.iter().zip(starts).map(|(part, start)| (&part.made, start));
        join::write(&self.shape, made(), pages, path, &self.options, &self.write).map_err(|error| {
            use io::ErrorKind::{InvalidData, NotFound, UnexpectedEof};
            // Blocks that cannot be joined are in parts that no conversion makes.
            let error = error.stated_in(&self.path, "parts");
            let is_of_part = matches!(&error, Error::Output { source, .. }
                if matches!(source.kind(), InvalidData | NotFound | UnexpectedEof));
            if !is_of_part {
                return error;
            }
            // Pages are checked while they are copied. Which part is damaged?
            match parts.iter().position(|part| !matches!(part.is_intact(), Ok(true))) {
                Some(index) => self.lacking(&[(index as u32, "is damaged".into())]),
                None => error,
            }
        })
    }

    fn finished_parts(&self) -> Result<Vec<PartFile>> {
        let (mut parts, mut lacking) = (Vec::new(), Vec::new());
        for index in 0..self.parts() {
            match PartFile::open(&self.part_path(index), self.label(index)?)? {
                Ok(part) => parts.push(part),
                Err(message) => lacking.push((index, message)),
            }
        }
        if lacking.is_empty() { Ok(parts) } else { Err(self.lacking(&lacking)) }
    }

    /// Returns the error for parts that are missing or damaged.
    fn lacking(&self, parts: &[(u32, String)]) -> Error {
        /// Parts whose commands are listed.
        const MOST: usize = 8;
        let (index, message) = &parts[0];
        let others = match parts.len() - 1 {
            0 => String::new(),
            more => format!(", and {more} more parts are missing or damaged"),
        };
        let place = format!("part {index} of {}", self.parts());
        let commands: Vec<String> =
            parts.iter().take(MOST).map(|(index, _)| self.part_command(*index)).collect();
        let mut commands = commands.join("; ");
        if parts.len() > MOST {
            let rest: Vec<String> =
                parts[MOST..].iter().map(|(index, _)| index.to_string()).collect();
            commands += &format!("; and so on, with the indices {}", rest.join(", "));
        }
        Error::input(&self.part_path(*index), place, message.clone() + &others)
            .hint(format!("make it: {commands}"))
    }

    fn label(&self, index: u32) -> Result<Label> {
        let plan = blake3::Hash::from_hex(&self.hash);
        let plan = plan.map_err(|e| Error::input(&self.path, "hash", e.to_string()))?;
        Ok(Label { plan: *plan.as_bytes(), index })
    }

    fn text(&self) -> Result<String> {
        serde_json::to_string_pretty(self)
            .map_err(|e| Error::Argument(format!("the plan cannot be written as JSON: {e}")))
    }

    fn content_hash(&self) -> Result<String> {
        let text = Self { hash: String::new(), ..self.clone() }.text()?;
        Ok(blake3::hash(text.as_bytes()).to_hex().to_string())
    }
}

fn program() -> String {
    format!("splatkit {}", env!("CARGO_PKG_VERSION"))
}

/// Splits the regions of all inputs, in order, into parts of about equally many points. Without a
/// number, every region is a part.
fn parts(inputs: &[Surveyed], wanted: Option<u32>) -> Vec<PlannedPart> {
    let regions = (0u32..).zip(inputs).flat_map(|(input, surveyed)| {
        let points = &surveyed.regions.ranges().points;
        (0..surveyed.count()).map(move |region| {
            // `points` does not count the region of triangles to be subdivided.
            (input, region, points.get(region as usize).copied().unwrap_or(0))
        })
    });
    let regions: Vec<(u32, u32, u64)> = regions.collect();
    let total: u64 = regions.iter().map(|(_, _, points)| points).sum();
    let count = wanted.map_or(regions.len(), |wanted| wanted as usize).max(1);
    let mut parts = vec![PlannedPart { points: 0, regions: Vec::new() }; count];
    let mut before = 0;
    for (number, &(input, region, points)) in regions.iter().enumerate() {
        let share = (u128::from(before + points / 2) * count as u128) / u128::from(total.max(1));
        let at = if wanted.is_some() { (share as usize).min(count - 1) } else { number };
        before += points;
        parts[at].points += points;
        match parts[at].regions.last_mut() {
            Some(last) if last.input == input => last.regions.end = region + 1,
            _ => parts[at].regions.push(InputRegions { input, regions: region..region + 1 }),
        }
    }
    parts
}

/// What tests do to the text of a plan.
#[cfg(test)]
pub struct PlanText;

#[cfg(test)]
impl PlanText {
    /// Gives a plan the hash of what it says, if it still has the form of a plan.
    pub fn sealed(text: &mut serde_json::Value) {
        if let Ok(plan) = serde_json::from_value::<Plan>(text.clone()) {
            text["hash"] = plan.content_hash().unwrap().into();
        }
    }
}
