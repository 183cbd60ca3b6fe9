//! The flags of the kernel that reconstructs the field from the samples of a lattice.

use crate::{input_values::Shared, parse};
use clap::Args;
use splatkit::session::{Description, KernelEntry};

/// The kernel of a volume's samples. Lengths are in samples.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Kernel")]
pub struct KernelFlags {
    /// Choose the kernel: gaussian, b-spline or hann; linear, catmull-rom or cubic-b-spline
    /// (products along the axes of a Cartesian lattice); or a file of values at even distances from
    /// 0 to --extent, as a JSON array or with one number per line [default: gaussian]
    #[arg(long, value_name = "NAME|FILE")]
    kernel: Option<String>,
    /// Set the standard deviation of the Gaussian [default: 0.6]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    sigma: Option<f64>,
    /// Set the radius of a footprint [default: 2 for gaussian and b-spline, 3 for hann; a gaussian
    /// grows with a --sigma above 0.6]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    extent: Option<f64>,
    /// Make the reconstruction pass through the samples instead of smoothing them. This is fast
    /// with --kernel cubic-b-spline. linear and catmull-rom pass through the samples without it.
    #[arg(long)]
    sharp: bool,
}

impl KernelFlags {
    /// Returns the first of these flags that was given.
    pub fn first(&self) -> Option<&'static str> {
        let given = [
            ("--kernel", self.kernel.is_some()),
            ("--sigma", self.sigma.is_some()),
            ("--extent", self.extent.is_some()),
            ("--sharp", self.sharp),
        ];
        given.into_iter().find(|(_, is_given)| *is_given).map(|(flag, _)| flag)
    }

    /// Changes how the inputs of a scene are shown: by the flags that are given.
    pub fn apply(&self, scene: &mut Description) {
        let kernel = self.kernel.clone().map(KernelEntry::Name);
        Shared::set(scene, |appearance| &mut appearance.kernel, kernel);
        Shared::set(scene, |appearance| &mut appearance.sigma, self.sigma);
        Shared::set(scene, |appearance| &mut appearance.extent, self.extent);
        scene.appearance.sharp |= self.sharp;
    }
}
