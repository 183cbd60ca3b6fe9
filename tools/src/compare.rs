//! `splatkit compare`.

use crate::{failure::Failure, limits::LimitFlags, output, parse};
use clap::Args;
use splatkit::{Error, compare::compare_files};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct Compare {
    /// A PNG or JPEG picture.
    a: PathBuf,
    /// Another picture of the same size.
    b: PathBuf,
    /// Fail with exit code 5 if the PSNR is lower than this, in dB.
    #[arg(long, value_name = "DECIBELS", value_parser = parse::finite, allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    limits: LimitFlags,
}

impl Compare {
    pub fn run(self) -> Result<(), Failure> {
        let comparison = compare_files(&self.a, &self.b, &self.limits.limits()).map_err(
            |error| match error {
                // The only argument that can be wrong here is the sizes: the pictures differ.
                Error::Argument(message) => Failure::Comparison(message),
                other => other.into(),
            },
        )?;
        if self.json {
            output::json(&serde_json::json!({
                "psnr": comparison.psnr,
                "ssim": comparison.ssim,
                "max_difference": comparison.max_difference,
                "different_pixels": comparison.different_pixels,
            }))?;
        } else {
            let psnr =
                comparison.psnr.map_or("identical".to_owned(), |psnr| format!("{psnr:.2} dB"));
            output::line(format_args!("PSNR              {psnr}"))?;
            output::line(format_args!("SSIM              {:.6}", comparison.ssim))?;
            output::line(format_args!("largest difference {:.6}", comparison.max_difference))?;
            output::line(format_args!("different pixels  {}", comparison.different_pixels))?;
        }
        match (comparison.psnr, self.threshold) {
            (Some(psnr), Some(threshold)) if psnr < threshold => Err(Failure::Comparison(format!(
                "the pictures' PSNR is {psnr:.2} dB, below {threshold} dB"
            ))),
            _ => Ok(()),
        }
    }
}
