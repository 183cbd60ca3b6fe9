//! `splatkit-measure sweep`: the cost of a frame while one parameter after another changes in
//! steps. It shows whether a step costs far more than its neighbour without reason.

mod asked;
mod measure;
mod plan;
mod ratio;
mod surfaces;
mod tables;
mod views;
mod volumes;

use crate::{
    report::Block,
    suite::{
        effort::{Effort, EffortFlags},
        machine::Machine,
        sections::{HEADING, check_kept, with_section},
    },
};
use clap::{Args, ValueEnum};
use measure::{Frames, Measure, Outcome};
use plan::Plan;
use splatkit_tools::{
    engine::{DeviceFlags, Evaluate},
    failure::Failure,
    output,
    progress::Progress,
};
use tables::Chapter;

/// The side lengths of pictures, in pixels.
const SIZES: [u32; 7] = [64, 128, 256, 512, 1024, 2048, 4096];

#[derive(Args, Debug)]
pub struct Sweep {
    /// Measure these axes only.
    #[arg(long, value_enum, value_delimiter = ',', value_name = "AXIS,…")]
    axes: Vec<Axis>,
    /// Choose how the samples of a volume are summed.
    #[arg(long, value_enum, default_value_t = Evaluate::Auto)]
    evaluate: Evaluate,
    #[command(flatten)]
    effort: EffortFlags,
    #[command(flatten)]
    device: DeviceFlags,
}

/// The parameter that changes from step to step.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Axis {
    /// The camera approaches and enters the volume.
    Distance,
    /// The camera orbits the volume, along axes and diagonals.
    Angle,
    /// The camera orbits slices that are five times as far apart as their samples.
    SliceAngle,
    /// The middle of the picture is enlarged.
    Zoom,
    /// From no perspective to a wide lens.
    Lens,
    /// The picture's size.
    Size,
    /// A volume's size.
    Samples,
    /// Cartesian, body-centred and rectilinear lattices, and bricks.
    Lattice,
    /// Lattices whose steps differ by up to 30 times; flat stacks.
    Anisotropy,
    /// The kernels.
    Kernel,
    /// The reach of a Gaussian.
    Extent,
    /// Kernels that pass through the samples.
    Sharp,
    /// The thickness of sheets.
    Thickness,
    /// From faint to opaque.
    Opacity,
    /// The camera approaches a surface and passes through it.
    SurfaceDistance,
    /// The size of a surface's picture.
    SurfaceSize,
    /// How fine a hierarchy is drawn.
    Cut,
}

impl Axis {
    fn plans(self, effort: Effort) -> Vec<Plan> {
        match self {
            Self::Distance => volumes::distances(effort),
            Self::Angle => volumes::angles(effort),
            Self::SliceAngle => volumes::slice_angles(effort),
            Self::Zoom => volumes::zooms(effort),
            Self::Lens => volumes::lenses(effort),
            Self::Size => volumes::sizes(effort),
            Self::Samples => volumes::samples(effort),
            Self::Lattice => volumes::lattices(effort),
            Self::Anisotropy => volumes::steps(effort),
            Self::Kernel => volumes::kernels(effort),
            Self::Extent => volumes::extents(effort),
            Self::Sharp => volumes::sharp(effort),
            Self::Thickness => volumes::thicknesses(effort),
            Self::Opacity => volumes::opacities(effort),
            Self::SurfaceDistance => surfaces::distances(effort),
            Self::SurfaceSize => surfaces::sizes(effort),
            Self::Cut => surfaces::cuts(effort),
        }
    }

    /// Returns the axis's name, as the flag has it.
    fn name(self) -> String {
        self.to_possible_value().map_or_else(String::new, |value| value.get_name().to_owned())
    }

    /// Returns the title and a description.
    fn labels(self) -> [&'static str; 2] {
        match self {
            Self::Distance => [
                "Distance.",
                "From far away into the volume. At 1 its bounding sphere fills the picture, at \
                 0.26 the camera is on that sphere, at 0 in the centre.",
            ],
            Self::Angle => ["Angle.", "Azimuth and elevation; 0° and 90° look along axes."],
            Self::SliceAngle => [
                "Angle to slices.",
                "The same, with slices five times as far apart as the samples in them.",
            ],
            Self::Zoom => ["Zoom.", "The middle of the picture is enlarged; the camera stays."],
            Self::Lens => [
                "Lens.",
                "The vertical view angle. The volume's bounding sphere fills the picture.",
            ],
            Self::Size => ["Picture.", "The size of the picture."],
            Self::Samples => ["Samples.", "The same content in more samples."],
            Self::Lattice => ["Lattice.", "About as many samples, beside the Cartesian lattice."],
            Self::Anisotropy => [
                "Anisotropy.",
                "The distance of slices whose samples are 1 apart, in a cube of about as many \
                 samples; then one stack whose slices come closer and closer.",
            ],
            Self::Kernel => ["Kernel.", "Beside the Gaussian."],
            Self::Extent => ["Extent.", "Of the Gaussian, in samples."],
            Self::Sharp => ["Sharp.", "Beside the same kernel without sharpening."],
            Self::Thickness => ["Thickness of sheets.", "In samples."],
            Self::Opacity => ["Opacity.", "Over a length of one sample."],
            Self::SurfaceDistance => {
                ["Distance of a surface.", "A knot of 650 thousand points; distances as above."]
            }
            Self::SurfaceSize => ["Picture of a surface.", "The size of the picture."],
            Self::Cut => ["Cut of a hierarchy.", "In pixels; 0 is the finest level."],
        }
    }
}

/// Returns how many frames of each step are drawn.
fn frames(effort: Effort) -> Frames {
    match effort {
        Effort::Quick => Frames { least: 1, most: 3, enough: 20.0 },
        Effort::Usual => Frames { least: 1, most: 15, enough: 500.0 },
        Effort::Full => Frames { least: 5, most: 50, enough: 3000.0 },
    }
}

impl Sweep {
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        let EffortFlags { effort, frames, write, json } = &self.effort;
        self.device.check()?;
        let block = write.as_deref().map(|path| Block::open(path, "sweep")).transpose()?;
        let mut device = self.device.open(&splatkit::scene::Scene::new())?;
        let machine = Machine::of(&device);
        if let Some(block) = &block {
            let left_out = Axis::value_variants().iter().filter(|axis| !self.measures(**axis));
            let parts = left_out.map(|axis| (axis.name(), axis.labels()[0]));
            check_kept(&block.inside()?, &machine, parts, "--axes")?;
        }
        let frames = frames.map_or(self::frames(*effort), |frames| {
            let count = frames as usize;
            Frames { least: count, most: count, enough: 0.0 }
        });
        let mut measure =
            Measure { device: &mut device, evaluate: self.evaluate.into(), frames, progress };
        let mut chapters = Vec::new();
        for axis in Axis::value_variants().iter().filter(|axis| self.measures(**axis)) {
            let ([title, note], name) = (axis.labels(), axis.name());
            let outcomes = measure.outcomes(&name, axis.plans(*effort));
            chapters.push(Chapter { name, title, note, outcomes });
        }
        progress.clear();
        let text = markdown(&machine, &chapters, frames);
        if *json {
            output::line(serde_json::json!({
                "machine": machine.json(),
                "frames": { "least": frames.least, "most": frames.most },
                "axes": chapters.iter().map(Chapter::json).collect::<Vec<_>>(),
                "cliffs": chapters.iter().map(|chapter| chapter.cliffs().count()).sum::<usize>(),
            }))?;
        } else {
            output::line(text.trim_end())?;
        }
        let steps = chapters.iter().flat_map(|chapter| &chapter.outcomes);
        match (steps.filter(|step| Outcome::has_failed(step)).count(), block) {
            (0, None) => Ok(()),
            (0, Some(block)) => block.replace(|old| with_section(old, &text)),
            (failed, _) => Err(Failure::Incomplete { failed, kept: write.clone() }),
        }
    }

    fn measures(&self, axis: Axis) -> bool {
        self.axes.is_empty() || self.axes.contains(&axis)
    }
}

fn markdown(machine: &Machine, chapters: &[Chapter], frames: Frames) -> String {
    let tables: Vec<_> = chapters.iter().map(Chapter::markdown).collect();
    let Frames { least, most, .. } = frames;
    let count = if least == most { least.to_string() } else { format!("{least} to {most}") };
    let note = format!("{count} frames of each step.");
    format!("{HEADING}{machine}\n\n{note}\n\n{}\n{}", tables.join("\n"), tables::cliffs(chapters))
}
