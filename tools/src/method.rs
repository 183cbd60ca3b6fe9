//! The flags that choose how splats are composited into a picture.

use crate::failure::Failure;
use clap::{Args, ValueEnum};
use splatkit::scene::{self, Order, Settings};

/// How splats are composited into a picture.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Method")]
pub struct MethodFlags {
    /// Choose the elements that are composited.
    #[arg(long, value_enum, default_value_t = Mode::Sheets)]
    mode: Mode,
    /// Composite single splats from back to front; the picture is the same. Needs --mode splats.
    #[arg(long)]
    back_to_front: bool,
    /// Choose when a volume's values become colour and opacity. --mode axis-sheets and splats
    /// always classify before interpolation.
    #[arg(long, value_enum, default_value_t = Classify::PreIntegrated)]
    classify: Classify,
    /// Choose the quantity that a ray computes from a volume.
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
    /// Sheets parallel to the picture; each takes one section of every kernel.
    Sheets,
    /// Slices of the data along the axis nearest to the view direction; each takes whole kernels.
    AxisSheets,
    /// Single splats, in the order of their distances.
    Splats,
}

/// [`scene::Classification`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
enum Classify {
    /// Continuously along the ray, between the two faces of a sheet.
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
    /// The absorption by the volume, shown in white.
    XRay,
}

impl MethodFlags {
    /// Checks what does not depend on the scene.
    pub fn check(&self) -> Result<(), Failure> {
        if self.back_to_front && self.mode != Mode::Splats {
            return Err(Failure::Usage(
                "--back-to-front needs --mode splats: it sets the order of single splats".into(),
            ));
        }
        Ok(())
    }

    /// Returns whether rays take the largest value.
    pub fn is_maximum(&self) -> bool {
        self.mip || matches!(self.optics, Optics::Maximum)
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
