//! The engine's flags: the adapter, and the settings of a picture.

use crate::{
    clip::ClipFlags, failure::Failure, method::MethodFlags, parse, samples::Samples, scene::Loaded,
};
use clap::{Args, ValueEnum};
use splatkit::{
    Device, Error,
    engine::{AdapterChoice, Budget, Gpu},
    hierarchy::Detail,
    picture::Picture,
    scene::{self, Item, Scene, Settings},
};
use std::time::Duration;

/// Seconds that no one waits for, and that every clock can count.
const LONGEST: f64 = 1e9;

/// How pictures are drawn.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Engine")]
pub struct EngineFlags {
    /// Width and height in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "1280x720")]
    pub size: [u32; 2],
    /// What draws: the engine for GPUs, or the one for processors, which needs no driver. auto takes the first where
    /// there is a GPU or one of the --gpu options is set.
    #[arg(long, value_enum, default_value_t = Engine::Auto)]
    engine: Engine,
    /// The adapter: its number in `splatkit gpus`, a part of its name, or `software`. By default the fastest.
    #[arg(long, value_name = "N|NAME|software")]
    gpu: Option<String>,
    /// The most seconds that drawing a picture may take [default: 600]
    #[arg(long, value_name = "SECONDS", value_parser = parse::positive)]
    gpu_timeout: Option<f64>,
    /// Memory that a scene's splats, samples, pages, bricks and lists may take on the adapter; in bytes or with KiB, MiB or GiB
    /// [default: on the processor three quarters of the memory that there is]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    gpu_memory: Option<u64>,
    /// How a volume's gradient across the picture is found.
    #[arg(long, value_enum, default_value_t = Gradient::Analytic)]
    gradient: Gradient,
    /// How a volume's field is summed up; the picture is the same.
    #[arg(long, value_enum, default_value_t = Evaluate::Auto)]
    evaluate: Evaluate,
    /// Lights volumes, also where the transfer function has no light.
    #[arg(long, overrides_with = "no_shade")]
    shade: bool,
    /// Draws volumes and surfaces in their own colours, without light.
    #[arg(long, overrides_with = "shade")]
    no_shade: bool,
    /// Largest thickness of a sheet, in world units; by default 4/3 of a volume's sample spacing, half of that where it is
    /// sharp or its kernel catmull-rom, half a spacing where the kernel is linear.
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    sheet_thickness: Option<f64>,
    /// Hierarchies, volumes in bricks: the most pixels that a splat may be wide at half its height, but for those of the
    /// finest level; a sample counts as two steps wide. 0 draws the finest level
    /// [default: 2]
    #[arg(long, value_name = "PIXELS", value_parser = parse::not_negative)]
    cut: Option<f64>,
    /// Hierarchies, volumes in bricks: about the most splats of a picture, instead of --cut.
    #[arg(long, value_name = "SPLATS", conflicts_with = "cut", value_parser = clap::value_parser!(u64).range(1..))]
    budget: Option<u64>,
    /// Hierarchies, volumes in bricks: about the milliseconds that a frame may take, instead of --cut; frames after a view that rests are finer
    /// and finer.
    #[arg(long, value_name = "MS", conflicts_with_all = ["cut", "budget"], value_parser = parse::positive)]
    frame_time: Option<f64>,
    /// Hierarchies: GPU memory for each one's pages; volumes in bricks: for the bricks, of coarser levels where it is too
    /// little; in bytes or with KiB, MiB or GiB [default: 1GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    memory: Option<u64>,
    /// Hierarchies: whether splats that face away are left out [default: where the surface is solid, seen from outside
    /// its bounds, and nothing is cut away]
    #[arg(long, value_name = "BOOL")]
    cull_backfaces: Option<bool>,
    /// Draws what lies behind opaque parts too: the same picture, for comparing times.
    #[arg(long)]
    no_occlusion: bool,
    /// Room of a depth pass: pairs of a splat and a tile. Pictures that need more take more passes.
    #[arg(long, value_name = "ENTRIES", value_parser = clap::value_parser!(u32).range(1..))]
    pass_entries: Option<u32>,
    #[command(flatten)]
    method: MethodFlags,
    #[command(flatten)]
    clip: ClipFlags,
}

/// The engines, and the choice of one by what there is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Engine {
    Auto,
    Gpu,
    Cpu,
}

/// [`scene::Gradient`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Gradient {
    Analytic,
    Central,
}

/// [`scene::Evaluate`] as a flag.
#[derive(Debug, Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Evaluate {
    /// Gather what can be gathered, scatter the rest.
    Auto,
    /// Sum up, for each pixel, the samples around its ray: for a volume, also among surfaces (the engine for GPUs takes Cartesian lattices alone).
    Gather,
    /// Add each sample to the pixels that its splat covers.
    Scatter,
}

impl EngineFlags {
    /// Opens what draws.
    pub fn device(&self, scene: &Scene) -> splatkit::Result<Device> {
        match self.engine {
            Engine::Cpu => Ok(Device::Cpu),
            // The GPU engine draws no tensor products; where an adapter is named, it says so.
            Engine::Auto if !self.asks_gpu() && scene.tensor().is_some() => Ok(Device::Cpu),
            Engine::Auto if !self.asks_gpu() => Ok(match Device::automatic() {
                Device::Gpu(gpu, _) => Device::Gpu(gpu, self.passes()),
                Device::Cpu => Device::Cpu,
            }),
            Engine::Auto | Engine::Gpu => Ok(Device::Gpu(self.gpu()?, self.passes())),
        }
    }

    /// Opens the adapter.
    fn gpu(&self) -> splatkit::Result<Gpu> {
        // Any text is a choice: the conversion cannot fail.
        let choice = self
            .gpu
            .as_deref()
            .map_or(AdapterChoice::Automatic, |text| text.parse().unwrap_or_default());
        let mut gpu = Gpu::headless(&choice)?;
        if let Some(seconds) = self.gpu_timeout {
            gpu = gpu.with_patience(Duration::from_secs_f64(seconds.min(LONGEST)));
        }
        if let Some(memory) = self.gpu_memory {
            gpu = gpu.with_memory(memory);
        }
        Ok(gpu)
    }

    /// The room of depth passes.
    fn passes(&self) -> Budget {
        let mut budget = Budget::default();
        if let Some(entries) = self.pass_entries {
            budget.entries = entries;
        }
        budget
    }

    /// Whether an option of the GPU engine alone is set.
    fn asks_gpu(&self) -> bool {
        self.gpu.is_some()
            || self.gpu_timeout.is_some()
            || self.gpu_memory.is_some()
            || self.pass_entries.is_some()
    }

    /// What is wrong whatever the scene.
    pub fn check(&self) -> Result<(), Failure> {
        if self.engine == Engine::Cpu && self.asks_gpu() {
            let message =
                "--engine cpu takes none of --gpu, --gpu-timeout, --gpu-memory and --pass-entries";
            return Err(Failure::Usage(message.into()));
        }
        self.method.check()?;
        self.clip.check()
    }

    /// How a volume's field is summed up.
    pub fn evaluate(&self) -> scene::Evaluate {
        match self.evaluate {
            Evaluate::Auto => scene::Evaluate::Auto,
            Evaluate::Gather => scene::Evaluate::Gather,
            Evaluate::Scatter => scene::Evaluate::Scatter,
        }
    }

    /// The settings of a picture before it is averaged down; those that do not go with the scene are an error.
    pub fn settings(&self, loaded: &Loaded, samples: Samples) -> splatkit::Result<Settings> {
        let factor = samples.factor(self.size, loaded.scene.has_splats());
        let mut settings = Settings::new(self.size.map(|side| side.saturating_mul(factor)));
        settings.sheet_thickness = self.sheet_thickness;
        // Sheets and cuts stay as they are without the extra pixels: thinner sheets would part what overlaps on a surface. But a
        // small picture is drawn as a larger one is.
        let wider = if let Samples::Factor(factor) = samples { f64::from(factor) } else { 1.0 };
        settings.sheet_pixels *= wider;
        settings.occlusion = !self.no_occlusion;
        settings.gradient = match self.gradient {
            Gradient::Analytic => scene::Gradient::Analytic,
            Gradient::Central => scene::Gradient::Central,
        };
        settings.evaluate = self.evaluate();
        if self.no_shade {
            settings.volume_shade = Some(None);
            settings.surface_shade = None;
        }
        if self.shade {
            let own = loaded.scene.items.iter().find_map(|item| match item {
                Item::Scalar(_, transfer)
                | Item::Volume(_, _, transfer)
                | Item::Bricks(_, _, transfer) => transfer.shade,
                Item::Radiance(_) | Item::Hierarchy(_) => None,
            });
            settings.volume_shade = Some(Some(own.unwrap_or_default()));
        }
        settings.detail = match (self.budget, self.frame_time) {
            (Some(splats), _) => Detail::Splats(splats),
            (_, Some(milliseconds)) => Detail::Milliseconds(milliseconds),
            _ => Detail::Pixels(self.cut.unwrap_or(Detail::PIXELS) * wider),
        };
        settings.cull_backfaces = self.cull_backfaces;
        if let Some(memory) = self.memory {
            settings.page_memory = memory;
        }
        self.method.apply(&mut settings);
        settings.clips = self.clip.clips(&loaded.scene, &loaded.subject.bounds)?;
        loaded.scene.validate_settings(&settings)?;
        Ok(settings)
    }

    /// Turns a picture that shows nothing into an error.
    pub fn require_content(&self, picture: &Picture) -> Result<(), Failure> {
        // What would round to nothing in a file of 8 bits is nothing.
        if picture.color.iter().any(|pixel| pixel[3] >= 0.5 / 255.0) {
            return Ok(());
        }
        let left =
            self.clip.text().map_or(String::new(), |clips| format!(" in what {clips} leaves"));
        Err(Error::NothingToDraw(format!(
            "the picture is empty: the camera sees no splat that has opacity{left}"
        ))
        .into())
    }
}
