//! The flags of the kernel that stands for a sample of a lattice.

use crate::{failure::Failure, parse, scene::in_file};
use clap::Args;
use splatkit::{
    input::{Limits, Source},
    math::{Kernel, Tensor},
};
use std::path::{Path, PathBuf};

/// The kernel of a volume's samples. Lengths are counted in samples.
#[derive(Args, Debug, Clone)]
#[command(next_help_heading = "Kernel")]
pub struct KernelFlags {
    /// gaussian, b-spline, hann; linear, catmull-rom, cubic-b-spline (products along the axes of a Cartesian lattice); or a file of
    /// values at even distances from 0 to --extent: a JSON array, or one number in a line [default: gaussian]
    #[arg(long, value_name = "NAME|FILE")]
    kernel: Option<String>,
    /// Standard deviation of the Gaussian [default: 0.6]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    sigma: Option<f64>,
    /// Radius of a footprint [default: 2 for gaussian and b-spline, 3 for hann]
    #[arg(long, value_name = "SAMPLES", value_parser = parse::positive)]
    extent: Option<f64>,
    /// Makes kernels pass through the samples, which they smooth otherwise. Fast with --kernel cubic-b-spline; linear and
    /// catmull-rom do so by themselves.
    #[arg(long)]
    sharp: bool,
}

const NAMES: [&str; 6] =
    ["gaussian", "b-spline", "hann", "linear", "catmull-rom", "cubic-b-spline"];

/// A table of this many bytes is no kernel.
const MOST_BYTES: usize = 4 << 20;

impl KernelFlags {
    pub fn kernel(&self, limits: &Limits) -> Result<Kernel, Failure> {
        let name = self.kernel.as_deref().unwrap_or("gaussian");
        if self.sigma.is_some() && name != "gaussian" {
            return Err(Failure::Usage(format!(
                "--sigma is the Gaussian's; the kernel {name} has none"
            )));
        }
        if let Some(tensor) = Tensor::ALL.into_iter().find(|tensor| tensor.name() == name) {
            return match self.extent {
                Some(_) => Err(Failure::Usage(format!(
                    "the kernel {name} has an extent of its own; leave out --extent"
                ))),
                None => Ok(Kernel::tensor(tensor)),
            };
        }
        Ok(match name {
            "gaussian" => self.gaussian()?,
            "b-spline" => Kernel::b_spline(self.extent.unwrap_or(2.0))?,
            "hann" => Kernel::hann(self.extent.unwrap_or(3.0))?,
            file if Path::new(file).extension().is_some() || Path::new(file).exists() => {
                let extent = self.extent.ok_or_else(|| {
                    Failure::Usage(format!(
                        "{file}: a kernel of one's own needs --extent, where its last value lies"
                    ))
                })?;
                // An extent that is wrong is not the file's fault.
                Kernel::table(vec![1.0, 0.0], extent)?;
                let file = Path::new(file);
                Kernel::table(read_table(file, limits)?, extent).map_err(|error| {
                    in_file(file, error).hint("the form is a JSON array, or one number in a line")
                })?
            }
            _ => {
                let names = NAMES.join(", ");
                return Err(Failure::Usage(format!(
                    "there is no kernel “{name}”; there are {names}, and files"
                )));
            }
        })
    }

    fn gaussian(&self) -> splatkit::Result<Kernel> {
        let default = Kernel::default();
        let sigma = self.sigma.unwrap_or(default.unit());
        // A wider kernel keeps its shape unless the user cuts it.
        let extent = self.extent.unwrap_or(default.extent.max(default.radius() * sigma));
        Kernel::gaussian(sigma, extent)
    }

    /// The file of a kernel of one's own.
    pub fn file(&self) -> Option<PathBuf> {
        self.kernel.as_ref().filter(|name| !NAMES.contains(&name.as_str())).map(PathBuf::from)
    }

    /// Whether kernels are to pass through the samples.
    pub fn is_sharp(&self) -> bool {
        self.sharp
    }
}

/// The numbers of a JSON array, or of lines.
fn read_table(path: &Path, limits: &Limits) -> splatkit::Result<Vec<f64>> {
    let source = Source::open(path, limits)?;
    let text = source.small_text("the table of a kernel", MOST_BYTES)?;
    if text.trim_start().starts_with('[') {
        return serde_json::from_str(&text).map_err(|e| source.error("kernel", e.to_string()));
    }
    // Old editors end lines with a carriage return alone.
    let text = text.replace("\r\n", "\n").replace('\r', "\n");
    let lines = text.lines().enumerate().filter(|(_, line)| !line.trim().is_empty());
    let number = |(at, line): (usize, &str)| {
        let error =
            || source.error(format!("line {}", at + 1), format!("“{}” is no number", line.trim()));
        parse::finite(line.trim())
            .map_err(|_| error().hint("the form is a JSON array, or one number in a line"))
    };
    lines.map(number).collect()
}
