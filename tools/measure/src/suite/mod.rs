//! `splatkit-measure suite`: measures the cases that docs/performance.md describes.

mod case;
mod culling;
pub mod effort;
mod growth;
pub mod machine;
pub mod measure;
mod memory;
pub mod sections;
mod seed;
mod series;
pub mod surfaces;
mod tables;

use crate::report::Block;
use case::Plan;
use clap::{Args, ValueEnum};
use effort::{Effort, EffortFlags};
use machine::Machine;
use measure::Counts;
use sections::{HEADING, check_kept, with_section};
use splatkit_tools::{engine::DeviceFlags, failure::Failure, output, progress::Progress};
use std::path::{Path, PathBuf};
use tables::Chapter;

/// Number of frames measured for each case.
const FRAMES: u32 = 5;

#[derive(Args, Debug)]
pub struct Suite {
    /// Read the classic volumes from this folder, by name: vortex, jet, turbulent, foot, lobster,
    /// aneurism, bonsai, head, engine, unc-head, each in any format that states its size. Generated
    /// volumes replace missing ones.
    #[arg(long, value_name = "FOLDER")]
    data: Option<PathBuf>,
    /// Measure these parts only.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "PART,…")]
    only: Vec<Part>,
    /// Draw each case this many times anew and check that the bytes are the same; 1 checks nothing.
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        value_parser = clap::value_parser!(u32).range(1..=1000)
    )]
    repeat: u32,
    #[command(flatten)]
    effort: EffortFlags,
    #[command(flatten)]
    device: DeviceFlags,
}

/// The parts of the suite.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Part {
    /// The classic table of splatting on a GPU.
    Seed,
    /// Surfaces of more and more points.
    Surfaces,
    /// Volumes of more and more samples; a model that moves away.
    Growth,
    /// Invisible parts, left out and drawn.
    Culling,
}

impl Part {
    fn plans(self, effort: Effort, data: Option<&Path>) -> splatkit::Result<Vec<Plan>> {
        Ok(match self {
            Self::Seed => seed::plans(effort, data)?,
            Self::Surfaces => surfaces::plans(effort),
            Self::Growth => growth::plans(effort),
            Self::Culling => culling::plans(effort),
        })
    }

    /// Returns the name, the title and a description.
    fn labels(self) -> [&'static str; 3] {
        match self {
            Self::Seed => [
                "seed",
                "The classic table.",
                "Volumes of the sizes in the 2005 table of splatting on a GPU, lit, whole in view; \
                 the table's numbers are on the right. Each volume is shown from the value on that \
                 leaves about as many splats.",
            ],
            Self::Surfaces => {
                ["surfaces", "Surfaces.", "Hierarchies of surfels, with a cut of one pixel."]
            }
            Self::Growth => [
                "growth",
                "Growth.",
                "The same content in more and more samples, in levels of bricks; a model that \
                 fills less and less of the picture.",
            ],
            Self::Culling => [
                "culling",
                "Culling.",
                "The same pictures with invisible parts left out, and drawn.",
            ],
        }
    }
}

impl Suite {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        let EffortFlags { effort, frames, write, json } = &self.effort;
        self.device.check()?;
        let block = write.as_deref().map(|path| Block::open(path, "suite")).transpose()?;
        let mut device = self.device.open(&splatkit::scene::Scene::new())?;
        let machine = Machine::of(&device);
        if let Some(block) = &block {
            let left_out = Part::value_variants()
                .iter()
                .filter(|part| !self.measures(**part))
                .map(|part| part.labels());
            let parts = left_out.map(|[name, title, _]| (name.to_owned(), title));
            check_kept(&block.inside()?, &machine, parts, "--only")?;
        }
        let counts = Counts { frames: frames.unwrap_or(FRAMES), runs: self.repeat };
        let mut chapters = Vec::new();
        for part in Part::value_variants().iter().filter(|part| self.measures(**part)) {
            let [name, title, note] = part.labels();
            let outcomes = measure::outcomes(
                part.plans(*effort, self.data.as_deref())?,
                &mut device,
                counts,
                progress,
            );
            chapters.push(Chapter { name, title, note, outcomes });
        }
        progress.clear();
        let text = self.markdown(&machine, &chapters, counts);
        if *json {
            output::line(serde_json::json!({
                "machine": machine.json(),
                "frames": counts.frames,
                "runs": counts.runs,
                "parts": chapters.iter().map(Chapter::json).collect::<Vec<_>>(),
            }))?;
        } else {
            output::line(text.trim_end())?;
        }
        let failed = chapters
            .iter()
            .flat_map(|chapter| &chapter.outcomes)
            .filter(|outcome| outcome.result.is_err());
        match (failed.count(), block) {
            (0, None) => Ok(()),
            (0, Some(block)) => block.replace(|old| with_section(old, &text)),
            (failed, _) => Err(Failure::Incomplete { failed, kept: write.clone() }),
        }
    }

    fn measures(&self, part: Part) -> bool {
        self.only.is_empty() || self.only.contains(&part)
    }

    fn markdown(&self, machine: &Machine, chapters: &[Chapter], counts: Counts) -> String {
        let chapters: Vec<_> = chapters.iter().map(Chapter::markdown).collect();
        let Counts { frames, runs } = counts;
        let repeated =
            if runs > 1 { format!(" *Same bytes*: in {runs} runs.") } else { String::new() };
        let timing = machine.timing();
        let note = format!("Medians of {frames} frames; passes timed {timing}.{repeated}");
        format!("{HEADING}{machine}\n\n{note}\n\n{}", chapters.join("\n"))
    }
}
