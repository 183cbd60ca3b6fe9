//! The engine's flags: the device, and the settings of a picture.

use crate::{
    clip::ClipFlags, failure::Failure, method::MethodFlags, parse, samples::Samples, scene::Loaded,
};
use clap::{Args, ValueEnum};
use splatkit::{
    Device, Error,
    gpu::{AdapterChoice, Budget, Gpu},
    hierarchy::Detail,
    picture::Picture,
    scene::{self, Item, Scene, Settings},
};
use std::time::Duration;

/// Longest timeout in seconds: nobody waits that long, and every clock can count it.
const LONGEST: f64 = 1e9;

/// The device that draws.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Engine")]
pub struct DeviceFlags {
    /// Choose the engine: gpu for GPUs, or cpu for processors, which needs no driver. auto uses the
    /// GPU if there is one, or if --pass-entries or one of the --gpu options is set.
    #[arg(long, value_enum, default_value_t = Engine::Auto)]
    engine: Engine,
    /// Choose the adapter: its number in `splatkit gpus`, part of its name, or `software` [default:
    /// the fastest]
    #[arg(long, value_name = "N|NAME|software")]
    gpu: Option<String>,
    /// Limit the seconds for drawing one picture [default: 600]
    #[arg(long, value_name = "SECONDS", value_parser = parse::positive)]
    gpu_timeout: Option<f64>,
    /// Limit the adapter's memory for a scene's splats, samples, pages, bricks and lists, in bytes
    /// or with KiB, MiB or GiB [default: for adapters that run on the processor, three quarters of
    /// the machine's memory]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    gpu_memory: Option<u64>,
    /// Set the capacity of a depth pass, in pairs of a splat and a tile. Pictures that need more
    /// take more passes.
    #[arg(long, value_name = "ENTRIES", value_parser = clap::value_parser!(u32).range(1..))]
    pass_entries: Option<u32>,
}

/// How pictures are drawn.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Engine")]
pub struct EngineFlags {
    /// Set the width and height of the picture, in pixels.
    #[arg(long, value_name = "WxH", value_parser = parse::size, default_value = "1280x720")]
    pub size: [u32; 2],
    #[command(flatten)]
    device: DeviceFlags,
    /// Choose how the gradient of a volume across the picture is computed.
    #[arg(long, value_enum, default_value_t = Gradient::Analytic)]
    gradient: Gradient,
    /// Choose how the samples of a volume are summed; the picture is the same.
    #[arg(long, value_enum, default_value_t = Evaluate::Auto)]
    evaluate: Evaluate,
    /// Light volumes even if the transfer function has no light.
    #[arg(long, overrides_with = "no_shade")]
    shade: bool,
    /// Draw volumes and surfaces in their own colours, without light.
    #[arg(long, visible_alias = "flat", overrides_with = "shade")]
    no_shade: bool,
    /// Set the largest thickness of a sheet, in world units [default: 4/3 of a volume's sample
    /// spacing; half of that if the volume is sharp or its kernel is catmull-rom; half a spacing if
    /// the kernel is linear]
    #[arg(long, value_name = "LENGTH", value_parser = parse::positive)]
    sheet_thickness: Option<f64>,
    /// Hierarchies and volumes in bricks: limit the width of a splat at half its height, in pixels.
    /// Splats of the finest level may be wider. A sample counts as two sample spacings wide. 0
    /// draws the finest level [default: 2]
    #[arg(long, value_name = "PIXELS", value_parser = parse::not_negative)]
    cut: Option<f64>,
    /// Hierarchies and volumes in bricks: limit a picture to about this many splats, instead of
    /// --cut.
    #[arg(
        long,
        value_name = "SPLATS",
        conflicts_with = "cut",
        value_parser = clap::value_parser!(u64).range(1..)
    )]
    budget: Option<u64>,
    /// Hierarchies and volumes in bricks: limit a frame to about this many milliseconds, instead of
    /// --cut. While the view stays the same, each frame is finer than the one before.
    #[arg(
        long,
        value_name = "MS",
        conflicts_with_all = ["cut", "budget"],
        value_parser = parse::positive
    )]
    frame_time: Option<f64>,
    /// Limit the memory for the pages of each hierarchy, or for the bricks of a volume, in
    /// bytes or with KiB, MiB or GiB. If it is too small for the bricks, coarser levels are drawn
    /// [default: 1GiB]
    #[arg(long, value_name = "BYTES", value_parser = parse::bytes)]
    memory: Option<u64>,
    /// Hierarchies: choose whether splats that face away are left out [default: true if the surface
    /// is solid, seen from outside its bounds, and not clipped]
    #[arg(long, value_name = "BOOL")]
    cull_backfaces: Option<bool>,
    /// Also draw what opaque parts hide: the same picture, for comparing times.
    #[arg(long)]
    no_occlusion: bool,
    #[command(flatten)]
    method: MethodFlags,
    #[command(flatten)]
    clip: ClipFlags,
}

/// The engines; `Auto` chooses one of the available engines.
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
pub enum Evaluate {
    /// Gather where possible, scatter the rest.
    Auto,
    /// For each pixel, sum the samples around its ray. For volumes, also among surfaces; the engine
    /// for GPUs gathers from Cartesian lattices only.
    Gather,
    /// Add each sample to the pixels that its splat covers.
    Scatter,
}

impl From<Evaluate> for scene::Evaluate {
    fn from(evaluate: Evaluate) -> Self {
        match evaluate {
            Evaluate::Auto => Self::Auto,
            Evaluate::Gather => Self::Gather,
            Evaluate::Scatter => Self::Scatter,
        }
    }
}

impl DeviceFlags {
    /// Checks that the flags go together.
    pub fn check(&self) -> Result<(), Failure> {
        if self.engine == Engine::Cpu && self.asks_gpu() {
            let message = "--engine cpu cannot be used with --gpu, --gpu-timeout, --gpu-memory or \
                 --pass-entries";
            return Err(Failure::Usage(message.into()));
        }
        Ok(())
    }

    /// Opens the device that draws the scene.
    pub fn open(&self, scene: &Scene) -> splatkit::Result<Device> {
        match self.engine {
            Engine::Cpu => Ok(Device::Cpu),
            // If an adapter is named, the GPU engine reports what it does not draw.
            Engine::Auto if !self.asks_gpu() && scene.beyond_gpu().is_some() => Ok(Device::Cpu),
            Engine::Auto if !self.asks_gpu() => Ok(match Device::automatic() {
                Device::Gpu(gpu, _) if gpu.beyond(scene).is_none() => {
                    Device::Gpu(gpu, self.passes())
                }
                Device::Gpu(..) | Device::Cpu => Device::Cpu,
            }),
            Engine::Auto | Engine::Gpu => Ok(Device::Gpu(self.gpu()?, self.passes())),
        }
    }

    /// Opens the adapter that the flags choose.
    fn gpu(&self) -> splatkit::Result<Gpu> {
        // Every text is a valid choice, so the conversion cannot fail.
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

    /// Returns the capacity of depth passes.
    fn passes(&self) -> Budget {
        let mut budget = Budget::default();
        if let Some(entries) = self.pass_entries {
            budget.entries = entries;
        }
        budget
    }

    /// Whether an option that only the GPU engine has is set.
    fn asks_gpu(&self) -> bool {
        self.gpu.is_some()
            || self.gpu_timeout.is_some()
            || self.gpu_memory.is_some()
            || self.pass_entries.is_some()
    }
}

impl EngineFlags {
    /// Opens the device that draws the scene.
    pub fn device(&self, scene: &Scene) -> splatkit::Result<Device> {
        self.device.open(scene)
    }

    /// Whether meshes can be drawn as facets: in sheets that emit and absorb light.
    pub fn draws_facets(&self) -> bool {
        let mut settings = Settings::new([1, 1]);
        self.method.apply(&mut settings);
        settings.mode == scene::Mode::Sheets && settings.optics == scene::Optics::EmissionAbsorption
    }

    /// Checks what does not depend on the scene.
    pub fn check(&self) -> Result<(), Failure> {
        self.device.check()?;
        self.method.check()?;
        self.clip.check()
    }

    /// Returns the settings of a picture before it is averaged down. Settings that the scene cannot
    /// be drawn with are an error.
    pub fn settings(&self, loaded: &Loaded, samples: Samples) -> splatkit::Result<Settings> {
        let factor = samples.factor(self.size, loaded.scene.has_splats());
        let mut settings = Settings::new(self.size.map(|side| side.saturating_mul(factor)));
        settings.sheet_thickness = self.sheet_thickness;
        // Explicit extra pixels do not change sheets and cuts: thinner sheets would separate splats
        // that overlap on a surface. With `auto`, a small picture is drawn like a larger one.
        let wider = if let Samples::Factor(factor) = samples { f64::from(factor) } else { 1.0 };
        settings.sheet_pixels *= wider;
        settings.occlusion = !self.no_occlusion;
        settings.gradient = match self.gradient {
            Gradient::Analytic => scene::Gradient::Analytic,
            Gradient::Central => scene::Gradient::Central,
        };
        settings.evaluate = self.evaluate.into();
        if self.no_shade {
            settings.volume_shade = Some(None);
            settings.surface_shade = None;
        }
        if self.shade {
            let fields = loaded.scene.items.iter().filter_map(Item::transfer);
            let own = fields.clone().find_map(|transfer| transfer.shade);
            let mut shade = own.unwrap_or_default();
            if fields.count() > 1 {
                // Each field knows itself which of its gradients are certain.
                shade.certain = None;
            }
            settings.volume_shade = Some(Some(shade));
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
        settings.clips = self.clips(loaded)?;
        loaded.scene.validate_settings(&settings)?;
        Ok(settings)
    }

    /// Returns the clips of a scene.
    pub fn clips(&self, loaded: &Loaded) -> splatkit::Result<Vec<scene::Clip>> {
        self.clip.clips(&loaded.scene, &loaded.subject.bounds)
    }

    /// Returns a warning if the flags of light or of optics change nothing.
    pub fn idle(&self, scene: &Scene) -> Option<&'static str> {
        if self.method.is_maximum() && scene.items.iter().all(|item| item.transfer().is_none()) {
            return Some("--optics maximum (--mip) has no effect: it is for values");
        }
        let fields = || scene.items.iter().filter_map(Item::transfer);
        let is_lit = |item: &Item| item.transfer().is_none() && !item.is_trained();
        let has_surfaces = scene.items.iter().any(is_lit);
        if self.shade && fields().count() > 0 && fields().all(|field| field.shade.is_some()) {
            return Some("--shade has no effect: the transfer function has its own light");
        }
        let is_dark = !has_surfaces && fields().all(|field| field.shade.is_none());
        (self.no_shade && is_dark)
            .then_some("--no-shade (--flat) has no effect: nothing in the scene is lit")
    }

    /// Returns an error if a picture shows nothing.
    pub fn require_content(&self, picture: &Picture) -> Result<(), Failure> {
        // An opacity that rounds to 0 in a file of 8 bits counts as none.
        if picture.color.iter().any(|pixel| pixel[3] >= 0.5 / 255.0) {
            return Ok(());
        }
        let left =
            self.clip.text().map_or(String::new(), |clips| format!(" after clipping by {clips}"));
        Err(Error::NothingToDraw(format!(
            "the picture is empty: the camera sees no splat that has opacity{left}"
        ))
        .into())
    }
}
