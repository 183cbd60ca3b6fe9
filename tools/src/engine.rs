//! The engine's flags: the device, and the settings of a picture.

use crate::{clip::ClipFlags, failure::Failure, method::MethodFlags, parse};
use clap::{Args, ValueEnum};
use splatkit::{
    Device,
    gpu::{AdapterChoice, Budget, Gpu},
    scene::{self, Item, Scene},
    session::{self, ColorEntry, Description, LightName, PictureEntry},
};
use std::time::Duration;

/// Longest timeout in seconds: nobody waits that long, and every clock can count it.
const LONGEST: f64 = 1e9;

/// The device that draws.
#[derive(Args, Debug, Clone, Default)]
#[command(next_help_heading = "Engine")]
pub struct DeviceFlags {
    /// Choose the engine: gpu for GPUs, or cpu for processors, which needs no driver. auto uses the
    /// GPU if there is one, or if --pass-entries or one of the --gpu options is set [default: auto]
    #[arg(long, value_enum)]
    engine: Option<Engine>,
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
    /// Set the width and height of the picture, in pixels [default: 1280x720]
    #[arg(long, value_name = "WxH", value_parser = parse::size)]
    size: Option<[u32; 2]>,
    #[command(flatten)]
    device: DeviceFlags,
    /// Choose how the gradient of a volume across the picture is computed [default: analytic]
    #[arg(long, value_enum)]
    gradient: Option<Gradient>,
    /// Choose how the samples of a volume are summed; the picture is the same [default: auto]
    #[arg(long, value_enum)]
    evaluate: Option<Evaluate>,
    /// Light volumes even if the transfer function has no light.
    #[arg(long, overrides_with = "no_shade")]
    shade: bool,
    /// Draw volumes and surfaces in their own colours, without light.
    #[arg(long, visible_alias = "flat", overrides_with = "shade")]
    no_shade: bool,
    /// Choose where light comes from: the eye, and for surfaces also beside it; the eye alone; a
    /// lamp at the upper left that casts shadows; that lamp and all sides; or all sides, more from
    /// above [default: soft]
    #[arg(long, value_enum)]
    light: Option<Light>,
    /// Choose whether the lamp of the light key or studio casts shadows [default: true]
    #[arg(long, value_name = "BOOL", num_args = 0..=1, default_missing_value = "true")]
    shadows: Option<bool>,
    /// Dim light where things around a place keep it away, by a strength from 0 to 1 [default: 1
    /// for the light studio or sky, else 0]
    #[arg(
        long,
        value_name = "STRENGTH",
        num_args = 0..=1,
        default_missing_value = "1",
        value_parser = parse::not_negative
    )]
    ambient_occlusion: Option<f64>,
    /// Dim pixels where others beside them are nearer, by a strength of about 1: eye-dome lighting,
    /// for clouds without normals [default: 1 for a scene of dots without normals alone, else 0]
    #[arg(
        long,
        value_name = "STRENGTH",
        num_args = 0..=1,
        default_missing_value = "1",
        value_parser = parse::not_negative
    )]
    eye_dome: Option<f64>,
    /// Draw lines around what stands in front of something farther away, of this width in pixels.
    #[arg(
        long,
        value_name = "WIDTH",
        num_args = 0..=1,
        default_missing_value = "1.5",
        value_parser = parse::not_negative
    )]
    outline: Option<f64>,
    /// Set the colour of these lines; that of the background makes halos [default: black, or white
    /// on a dark background]
    #[arg(long, value_name = "COLOR")]
    outline_color: Option<ColorEntry>,
    /// Set the largest thickness of a sheet, in world units [default: 4/3 of a volume's sample
    /// spacing; half of that if the volume is sharp; two spacings if its kernel is linear]
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

/// [`LightName`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Light {
    Soft,
    Head,
    Key,
    Studio,
    Sky,
}

impl From<Light> for LightName {
    fn from(light: Light) -> Self {
        match light {
            Light::Soft => Self::Soft,
            Light::Head => Self::Head,
            Light::Key => Self::Key,
            Light::Studio => Self::Studio,
            Light::Sky => Self::Sky,
        }
    }
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

impl From<Engine> for session::Engine {
    fn from(engine: Engine) -> Self {
        match engine {
            Engine::Auto => Self::Auto,
            Engine::Gpu => Self::Gpu,
            Engine::Cpu => Self::Cpu,
        }
    }
}

impl DeviceFlags {
    /// Returns the flags with the engine of a scene.
    pub fn of_scene(&self, scene: &Description) -> Self {
        let engine = match scene.engine {
            session::Engine::Gpu => Engine::Gpu,
            session::Engine::Cpu => Engine::Cpu,
            _ => Engine::Auto,
        };
        Self { engine: Some(engine), ..self.clone() }
    }

    /// Checks that the flags go together.
    pub fn check(&self) -> Result<(), Failure> {
        if self.engine() == Engine::Cpu && self.asks_gpu() {
            let message = "--engine cpu cannot be used with --gpu, --gpu-timeout, --gpu-memory or \
                 --pass-entries";
            return Err(Failure::Usage(message.into()));
        }
        Ok(())
    }

    /// Opens the device that draws the scene.
    pub fn open(&self, scene: &Scene) -> splatkit::Result<Device> {
        match self.engine() {
            Engine::Cpu => Ok(Device::Cpu),
            // If an adapter is named, the GPU engine reports what it does not draw.
            Engine::Auto if !self.asks_gpu() && scene.beyond_gpu().is_some() => Ok(Device::Cpu),
            Engine::Auto if !self.asks_gpu() => Ok(match Device::automatic() {
                Device::Gpu(gpu, _) if gpu.beyond(scene).is_none() => {
                    Device::Gpu(gpu, self.passes())
                }
                _ => Device::Cpu,
            }),
            Engine::Auto | Engine::Gpu => Ok(Device::Gpu(self.gpu()?, self.passes())),
        }
    }

    fn engine(&self) -> Engine {
        self.engine.unwrap_or(Engine::Auto)
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
    /// Whether the size of the picture is given, in pixels.
    pub fn has_size(&self) -> bool {
        self.size.is_some()
    }

    /// Changes how the picture of a scene is drawn: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) {
        let picture = &mut scene.picture;
        picture.size = self.size.or(picture.size);
        let gradient = self.gradient.map(|gradient| match gradient {
            Gradient::Analytic => scene::Gradient::Analytic,
            Gradient::Central => scene::Gradient::Central,
        });
        picture.gradient = gradient.or(picture.gradient);
        picture.evaluate = self.evaluate.map(Into::into).or(picture.evaluate);
        let shade = self.shade.then_some(true).or(self.no_shade.then_some(false));
        picture.shade = shade.or(picture.shade);
        picture.light = self.light.map(Into::into).or(picture.light);
        picture.shadows = self.shadows.or(picture.shadows);
        picture.eye_dome = self.eye_dome.or(picture.eye_dome);
        picture.outline = self.outline.or(picture.outline);
        picture.outline_color = self.outline_color.or(picture.outline_color);
        picture.ambient_occlusion = self.ambient_occlusion.or(picture.ambient_occlusion);
        picture.sheet_thickness = self.sheet_thickness.or(picture.sheet_thickness);
        if self.cut.is_some() || self.budget.is_some() || self.frame_time.is_some() {
            picture.cut = self.cut;
            picture.budget = self.budget;
            picture.frame_time = self.frame_time;
        }
        picture.memory = self.memory.or(picture.memory);
        picture.cull_backfaces = self.cull_backfaces.or(picture.cull_backfaces);
        picture.occlusion = self.no_occlusion.then_some(false).or(picture.occlusion);
        self.method.apply(picture);
        self.clip.apply(scene);
        if let Some(engine) = self.device.engine {
            scene.engine = engine.into();
        }
    }

    /// Returns the device that draws a scene.
    pub fn device(&self, scene: &Description) -> DeviceFlags {
        self.device.of_scene(scene)
    }
}

/// Returns a warning if light or optics that a picture asks for change nothing in a scene.
pub fn idle(picture: &PictureEntry, scene: &Scene) -> Option<&'static str> {
    let fields = || scene.items.iter().filter_map(Item::transfer);
    if picture.optics == Some(scene::Optics::Maximum) && fields().count() == 0 {
        return Some("--optics maximum (--mip) has no effect: it is for values");
    }
    let is_lit = |item: &Item| item.transfer().is_none() && !item.is_trained();
    let has_surfaces = scene.items.iter().any(is_lit);
    let all_lit = fields().count() > 0 && fields().all(|field| field.shade.is_some());
    if picture.shade == Some(true) && all_lit {
        return Some("--shade has no effect: the transfer function has its own light");
    }
    let is_dark = !has_surfaces && fields().all(|field| field.shade.is_none());
    let has_lamps = picture.light.is_some_and(|light| light != LightName::Head)
        || picture.ambient_occlusion.is_some_and(|strength| strength > 0.0);
    if has_lamps && (picture.shade == Some(false) || (is_dark && picture.shade != Some(true))) {
        return Some(
            "--light and --ambient-occlusion have no effect: nothing in the scene is lit; trained \
             Gaussians carry their light in their colours",
        );
    }
    (picture.shade == Some(false) && is_dark)
        .then_some("--no-shade (--flat) has no effect: nothing in the scene is lit")
}
