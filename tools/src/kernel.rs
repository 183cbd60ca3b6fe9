//! The flags of the kernel that reconstructs the field from the samples of a lattice.

use crate::{
    failure::{Failure, in_file},
    parse,
};
use clap::Args;
use splatkit::{
    Error,
    input::{Limits, Source},
    math::Kernel,
};
use std::path::{Path, PathBuf};

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

/// Largest size of a kernel's table, in bytes.
const MOST_BYTES: usize = 4 << 20;

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

    pub fn kernel(&self, limits: &Limits) -> Result<Kernel, Failure> {
        let name = self.kernel.as_deref().unwrap_or("gaussian");
        let is_file = Path::new(name).extension().is_some() || Path::new(name).exists();
        if Kernel::NAMES.contains(&name) || !is_file {
            return Kernel::named(name, self.sigma, self.extent).map_err(|error| match error {
                Error::Argument(message) if !Kernel::NAMES.contains(&name) => {
                    Failure::Usage(format!("{message}, or a file"))
                }
                other => other.into(),
            });
        }
        if self.sigma.is_some() {
            let message = format!("sigma applies to the gaussian kernel only, not to {name}");
            return Err(Failure::Usage(message));
        }
        let extent = self.extent.ok_or_else(|| {
            Failure::Usage(format!(
                "{name}: a kernel from a file needs --extent, the distance of its last value"
            ))
        })?;
        // A wrong extent is not the file's fault.
        Kernel::table(vec![1.0, 0.0], extent)?;
        let file = Path::new(name);
        let kernel = Kernel::table(read_table(file, limits)?, extent);
        Ok(kernel.map_err(|error| {
            in_file(file, error).hint("the form is a JSON array, or one number per line")
        })?)
    }

    /// Returns the file of the user's own kernel.
    pub fn file(&self) -> Option<PathBuf> {
        self.kernel
            .as_ref()
            .filter(|name| !Kernel::NAMES.contains(&name.as_str()))
            .map(PathBuf::from)
    }

    /// Whether the reconstruction must pass through the samples.
    pub fn is_sharp(&self) -> bool {
        self.sharp
    }
}

/// Reads the numbers of a JSON array, or one number per line.
fn read_table(path: &Path, limits: &Limits) -> splatkit::Result<Vec<f64>> {
    let source = Source::open(path, limits)?;
    let text = source.small_text("the table of a kernel", MOST_BYTES)?;
    if text.trim_start().starts_with('[') {
        return serde_json::from_str(&text).map_err(|e| source.error("kernel", e.to_string()));
    }
    // Old editors end lines with a carriage return only.
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let number = |(at, line): (usize, &str)| {
        let error = || {
            source.error(format!("line {}", at + 1), format!("“{}” is not a number", line.trim()))
        };
        parse::finite(line.trim())
            .map_err(|_| error().hint("the form is a JSON array, or one number per line"))
    };
    lines.map(number).collect()
}
