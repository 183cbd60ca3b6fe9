//! `splatkit bench --suite`: the cases that docs/performance.md tells of, measured.

mod case;
mod culling;
mod growth;
mod machine;
mod measure;
mod memory;
mod seed;
mod series;
mod surfaces;
mod tables;

use crate::{engine::EngineFlags, failure::Failure, output, progress::Progress, report::Block};
use case::Plan;
use clap::{Args, ValueEnum};
use machine::Machine;
use measure::Counts;
use std::{fmt, path::PathBuf};
use tables::Chapter;

/// Frames that are measured of each case.
const FRAMES: u32 = 5;

/// What decides a scene, a view or a picture: the suite brings its own. Groups of flags stand by their name where clap makes one,
/// which it does not where a group holds another.
const OTHERS: &[&str] = &[
    "inputs",
    "LoadFlags",
    "LimitFlags",
    "transfer",
    "range",
    "opacity_unit",
    "iso",
    "gradient_opacity",
    "radius_scale",
    "KernelFlags",
    "CameraFlags",
    "size",
    "gradient",
    "evaluate",
    "shade",
    "no_shade",
    "sheet_thickness",
    "cut",
    "budget",
    "frame_time",
    "memory",
    "cull_backfaces",
    "no_occlusion",
    "pass_entries",
    "MethodFlags",
    "ClipFlags",
];

#[derive(Args, Debug)]
#[command(next_help_heading = "Suite")]
// Clap lets a requirement go where it conflicts with what is given; so the options conflict with scenes themselves.
pub struct SuiteFlags {
    /// Measures a suite of cases instead of a scene: docs/performance.md tells of each.
    #[arg(long, conflicts_with_all = OTHERS)]
    pub suite: bool,
    /// A folder of the classic volumes, by name: vortex, jet, turbulent, foot, lobster, aneurism, bonsai, head, engine,
    /// unc-head, each in any format that tells its size; generated ones stand for those that are not there.
    #[arg(long, value_name = "FOLDER", requires = "suite", conflicts_with = "inputs")]
    data: Option<PathBuf>,
    /// Leaves out all parts but these.
    #[arg(
        long,
        value_enum,
        value_delimiter = ',',
        value_name = "PART,…",
        requires = "suite",
        conflicts_with = "inputs"
    )]
    only: Vec<Part>,
    /// How much is measured.
    #[arg(long, value_enum, default_value_t = Effort::Usual, requires = "suite", conflicts_with = "inputs")]
    effort: Effort,
    /// Draws each case so many times anew and checks that the bytes are the same; 1 checks nothing.
    #[arg(long, value_name = "N", default_value_t = 1, value_parser = clap::value_parser!(u32).range(1..=1000), requires = "suite", conflicts_with = "inputs")]
    repeat: u32,
    /// Replaces this machine's tables in the marked block of this file.
    #[arg(long, value_name = "FILE.md", requires = "suite", conflicts_with = "inputs")]
    write: Option<PathBuf>,
}

/// What is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// The classic table of splatting on a GPU.
    Seed,
    /// Surfaces of ever more points.
    Surfaces,
    /// Volumes of ever more samples; a model that moves away.
    Growth,
    /// What cannot be seen, left out and drawn.
    Culling,
}

/// How much is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Effort {
    /// Everything at a quarter of its length: some seconds, to see that all works.
    Quick,
    /// A few minutes on a processor without a GPU.
    Usual,
    /// Also models of 10 million points and volumes of 512³ and 1024³ samples: 16 GiB of memory, and much time.
    Full,
}

impl Effort {
    /// What each length of a quick case is divided by.
    const QUICK: u64 = 4;

    fn divided(self, number: u64, dimensions: u32) -> u64 {
        match self {
            Self::Quick => (number / Self::QUICK.pow(dimensions)).max(1),
            Self::Usual | Self::Full => number,
        }
    }

    /// A picture's width, or a volume's side.
    fn side(self, side: usize) -> usize {
        self.divided(side as u64, 1) as usize
    }

    fn pixels(self, width: u32) -> u32 {
        self.divided(width.into(), 1) as u32
    }

    fn points(self, points: u32) -> u32 {
        self.divided(points.into(), 2) as u32
    }

    fn samples(self, samples: u64) -> u64 {
        self.divided(samples, 3)
    }
}

impl Part {
    fn plans(self, flags: &SuiteFlags) -> splatkit::Result<Vec<Plan>> {
        let effort = flags.effort;
        Ok(match self {
            Self::Seed => seed::plans(effort, flags.data.as_deref())?,
            Self::Surfaces => surfaces::plans(effort),
            Self::Growth => growth::plans(effort),
            Self::Culling => culling::plans(effort),
        })
    }

    /// Its name, its title and what it is.
    fn told(self) -> [&'static str; 3] {
        match self {
            Self::Seed => [
                "seed",
                "The classic table.",
                "Volumes of the sizes of 2005's table of splatting on a GPU, lit, whole in view; its numbers are at the right. \
                 Each is shown from the value on that leaves about as many splats.",
            ],
            Self::Surfaces => ["surfaces", "Surfaces.", "Hierarchies of surfels, with a cut of one pixel."],
            Self::Growth => [
                "growth",
                "Growth.",
                "One content in ever more samples, in bricks of levels; a model that fills ever less of the picture.",
            ],
            Self::Culling => ["culling", "Culling.", "The same pictures with what cannot be seen left out, and drawn."],
        }
    }
}

impl SuiteFlags {
    pub fn run(
        &self,
        engine: &EngineFlags,
        frames: Option<u32>,
        json: bool,
        progress: &Progress,
    ) -> Result<(), Failure> {
        let block = self.write.as_deref().map(|path| Block::open(path, "suite", "bench --suite")).transpose()?;
        let mut device = engine.device(&splatkit::scene::Scene::new())?;
        let machine = Machine::of(&device);
        if let Some(block) = &block {
            self.check_parts(&section_of(&block.inside()?, &machine))?;
        }
        let counts = Counts { frames: frames.unwrap_or(FRAMES), runs: self.repeat };
        let mut chapters = Vec::new();
        for part in Part::value_variants().iter().filter(|part| self.measures(**part)) {
            let [name, title, note] = part.told();
            let outcomes = measure::outcomes(part.plans(self)?, &mut device, counts, progress);
            chapters.push(Chapter { name, title, note, outcomes });
        }
        progress.clear();
        let text = self.markdown(&machine, &chapters, counts);
        if json {
            output::line(serde_json::json!({
                "machine": machine.json(),
                "frames": counts.frames,
                "runs": counts.runs,
                "parts": chapters.iter().map(Chapter::json).collect::<Vec<_>>(),
            }))?;
        } else {
            output::line(text.trim_end())?;
        }
        let failed = chapters.iter().flat_map(|chapter| &chapter.outcomes).filter(|outcome| outcome.result.is_err());
        match (failed.count(), block) {
            (0, None) => Ok(()),
            (0, Some(block)) => block.replace(|old| with_section(old, &text)),
            (failed, _) => Err(Failure::Incomplete { failed, kept: self.write.clone() }),
        }
    }

    fn measures(&self, part: Part) -> bool {
        self.only.is_empty() || self.only.contains(&part)
    }

    /// A machine's section is replaced as a whole: refuses one with parts that are not measured now.
    fn check_parts(&self, section: &str) -> Result<(), Failure> {
        let lost = Part::value_variants().iter().filter(|part| !self.measures(**part)).map(|part| part.told());
        match lost.into_iter().find(|[_, title, _]| section.contains(&format!("**{title}**"))) {
            Some([name, ..]) => Err(Failure::Usage(format!(
                "--write would remove this machine's tables of the part “{name}”, which --only leaves out; measure it too, \
                 or leave --write out"
            ))),
            None => Ok(()),
        }
    }

    fn markdown(&self, machine: &Machine, chapters: &[Chapter], counts: Counts) -> String {
        let chapters: Vec<_> = chapters.iter().map(Chapter::markdown).collect();
        let Counts { frames, runs } = counts;
        let repeated = if runs > 1 { format!(" *Same bytes*: in {runs} runs.") } else { String::new() };
        let timing = machine.timing();
        let note = format!("Medians of {frames} frames; passes timed {timing}.{repeated}");
        format!("{HEADING}{machine}\n\n{note}\n\n{}", chapters.join("\n"))
    }
}

/// How the part of a machine begins in a document.
const HEADING: &str = "### ";

/// The first line of a section.
fn heading(section: &str) -> &str {
    section.lines().next().unwrap_or_default()
}

/// The sections of a text, one for each machine.
fn sections(text: &str) -> Vec<&str> {
    let mut sections = Vec::new();
    let mut rest = text.trim();
    while !rest.is_empty() {
        let end = rest.find(&format!("\n{HEADING}")).unwrap_or(rest.len());
        let (first, others) = rest.split_at(end);
        sections.push(first.trim());
        rest = others.trim();
    }
    sections
}

/// The section of a machine, empty where there is none.
fn section_of(text: &str, machine: impl fmt::Display) -> String {
    let wanted = format!("{HEADING}{machine}");
    sections(text).into_iter().find(|section| heading(section) == wanted).unwrap_or_default().to_owned()
}

/// A text with sections of several machines, one of them put in or replaced.
fn with_section(text: &str, section: &str) -> String {
    let mut sections = sections(text);
    match sections.iter_mut().find(|old| heading(old) == heading(section)) {
        Some(old) => *old = section.trim(),
        None => sections.push(section.trim()),
    }
    sections.join("\n\n") + "\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_machine_has_its_section() {
        let one = with_section("", "### a\n\n1");
        let both = with_section(&one, "### b\n\n2\n");
        assert_eq!(both, "### a\n\n1\n\n### b\n\n2\n");
        assert_eq!(with_section(&both, "### a\n\n3"), "### a\n\n3\n\n### b\n\n2\n");
        assert_eq!((section_of(&both, "b").as_str(), section_of(&both, "c").as_str()), ("### b\n\n2", ""));
        assert_eq!(with_section("– Words.\n", &one), "– Words.\n\n### a\n\n1\n");
    }
}
