//! The flags of how splats become a picture.

use crate::failure::Failure;
use clap::{Args, ValueEnum};
use splatkit::scene::{self, Order, Settings};

/// How splats become a picture.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Method")]
pub struct MethodFlags {
    /// What is composited.
    #[arg(long, value_enum, default_value_t = Mode::Sheets)]
    mode: Mode,
    /// Composites single splats from the far end; the picture is the same. For --mode splats.
    #[arg(long)]
    back_to_front: bool,
    /// When a volume's values become colour and opacity; --mode axis-sheets and splats always do it before.
    #[arg(long, value_enum, default_value_t = Classify::PreIntegrated)]
    classify: Classify,
    /// What a ray makes of a volume.
    #[arg(long, value_enum, default_value_t = Optics::Light)]
    optics: Optics,
    /// Short for --optics maximum.
    #[arg(long, conflicts_with_all = ["optics", "x_ray"])]
    mip: bool,
    /// Short for --optics x-ray.
    #[arg(long, conflicts_with = "optics")]
    x_ray: bool,
}

/// [`scene::Mode`] as a flag.
#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Mode {
    /// Sheets parallel to the picture cut every kernel into sections.
    Sheets,
    /// Slices of the data, along its axis nearest to the view, take whole kernels.
    AxisSheets,
    /// Every splat on its own, in the order of distances.
    Splats,
}

/// [`scene::Classification`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Classify {
    /// Everywhere along the ray, between the two faces of a sheet.
    PreIntegrated,
    /// Once per sheet, after interpolation.
    Post,
    /// Once per sample, before interpolation.
    Pre,
}

/// [`scene::Optics`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Optics {
    /// Emission and absorption.
    Light,
    /// The largest value on the ray.
    Maximum,
    /// What the volume absorbs, in white.
    XRay,
}

impl MethodFlags {
    /// What is wrong whatever the scene.
    pub fn check(&self) -> Result<(), Failure> {
        if self.back_to_front && self.mode != Mode::Splats {
            return Err(Failure::Usage(
                "--back-to-front is an order of single splats: it needs --mode splats".into(),
            ));
        }
        Ok(())
    }

    pub fn apply(&self, settings: &mut Settings) {
        let order = if self.back_to_front { Order::BackToFront } else { Order::FrontToBack };
        settings.mode = match self.mode {
            Mode::Sheets => scene::Mode::Sheets,
            Mode::AxisSheets => scene::Mode::AxisSheets,
            Mode::Splats => scene::Mode::Splats(order),
        };
        settings.classification = match self.classify {
            Classify::PreIntegrated => scene::Classification::PreIntegrated,
            Classify::Post => scene::Classification::Post,
            Classify::Pre => scene::Classification::Pre,
        };
        settings.optics = match (self.mip, self.x_ray, self.optics) {
            (true, _, _) | (_, _, Optics::Maximum) => scene::Optics::Maximum,
            (_, true, _) | (_, _, Optics::XRay) => scene::Optics::XRay,
            (_, _, Optics::Light) => scene::Optics::EmissionAbsorption,
        };
    }
}
