//! The flags that choose how splats are composited into a picture.

use clap::{Args, ValueEnum};
use splatkit::{
    scene,
    session::{Composite, PictureEntry},
};

/// How splats are composited into a picture.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Method")]
pub struct MethodFlags {
    /// Choose the elements that are composited [default: sheets]
    #[arg(long, value_enum)]
    mode: Option<Mode>,
    /// Composite single splats from back to front; the picture is the same. Needs --mode splats.
    #[arg(long)]
    back_to_front: bool,
    /// Choose when a volume's values become colour and opacity. --mode axis-sheets and splats
    /// always classify before interpolation [default: pre-integrated]
    #[arg(long, value_enum)]
    classify: Option<Classify>,
    /// Choose the quantity that a ray computes from a volume [default: light]
    #[arg(long, value_enum)]
    optics: Option<Optics>,
    /// Short for --optics maximum.
    #[arg(long, conflicts_with_all = ["optics", "x_ray"])]
    mip: bool,
    /// Short for --optics x-ray.
    #[arg(long, conflicts_with = "optics")]
    x_ray: bool,
}

/// [`scene::Mode`] as a flag.
#[derive(Debug, Clone, Copy, ValueEnum)]
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
    /// Changes how the picture of a scene is composited: by the flags that are given.
    pub fn apply(&self, picture: &mut PictureEntry) {
        let mode = self.mode.map(|mode| match mode {
            Mode::Sheets => Composite::Sheets,
            Mode::AxisSheets => Composite::AxisSheets,
            Mode::Splats => Composite::Splats,
        });
        let classify = self.classify.map(|classify| match classify {
            Classify::PreIntegrated => scene::Classification::PreIntegrated,
            Classify::Post => scene::Classification::Post,
            Classify::Pre => scene::Classification::Pre,
        });
        let optics = match (self.mip, self.x_ray, self.optics) {
            (true, _, _) | (_, _, Some(Optics::Maximum)) => Some(scene::Optics::Maximum),
            (_, true, _) | (_, _, Some(Optics::XRay)) => Some(scene::Optics::XRay),
            (_, _, Some(Optics::Light)) => Some(scene::Optics::EmissionAbsorption),
            (_, _, None) => None,
        };
        picture.mode = mode.or(picture.mode);
        picture.back_to_front |= self.back_to_front;
        picture.classify = classify.or(picture.classify);
        picture.optics = optics.or(picture.optics);
    }
}
