//! `splatkit compare`.

use crate::{failure::Failure, limits::LimitFlags, output, parse};
use clap::Args;
use serde_json::{Value, json};
use splatkit::{
    Error,
    compare::{Distances, SceneComparison, compare_files, compare_scenes},
    edit::Editable,
    formats::{Kind, ReadOptions},
    memory,
    session::Reading,
};
use std::path::{Path, PathBuf};

#[derive(Args, Debug)]
pub struct Compare {
    /// A PNG or JPEG picture; or a point cloud, mesh, hierarchy or trained Gaussians.
    #[arg(value_parser = parse::input())]
    a: PathBuf,
    /// Another picture of the same size, or another scene. Of scenes, the distances of the points
    /// from each other are measured both ways, and the values of nearest points are compared.
    #[arg(value_parser = parse::input())]
    b: PathBuf,
    /// Fail with exit code 5 if the PSNR of pictures is lower than this, in dB.
    #[arg(long, value_name = "DECIBELS", value_parser = parse::finite, allow_hyphen_values = true)]
    threshold: Option<f64>,
    /// Fail with exit code 5 if a point of one scene is farther than this from all of the other, in
    /// world units.
    #[arg(long, value_name = "DISTANCE", value_parser = parse::finite)]
    tolerance: Option<f64>,
    /// Print the result as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    limits: LimitFlags,
}

impl Compare {
    pub fn run(self) -> Result<(), Failure> {
        let reading = self.reading();
        let is_scene = |path: &PathBuf| {
            let kind = reading.kind(path);
            matches!(kind, Ok(Kind::Mesh | Kind::Samples | Kind::Gaussians | Kind::Hierarchy))
        };
        match [&self.a, &self.b].map(is_scene) {
            [true, true] => self.scenes(),
            [false, false] => self.pictures(),
            [is_first, _] => {
                let (scene, other) = if is_first { (&self.a, &self.b) } else { (&self.b, &self.a) };
                Err(Failure::Usage(format!(
                    "{} is a scene and {} is none: two pictures are compared, or two scenes",
                    scene.display(),
                    other.display()
                )))
            }
        }
    }

    fn reading(&self) -> Reading {
        Reading::new(ReadOptions::default(), self.limits.limits()).within_memory(memory::most())
    }

    fn scene(&self, path: &Path) -> Result<Box<dyn Editable>, Failure> {
        let reading = self.reading();
        let opened = reading.open(path)?;
        let data = opened.read()?;
        Ok(opened.scene(data)?)
    }

    fn scenes(&self) -> Result<(), Failure> {
        if self.threshold.is_some() {
            let message = "--threshold is for pictures; --tolerance limits the distances of scenes";
            return Err(Failure::Usage(message.into()));
        }
        let compared = compare_scenes(&*self.scene(&self.a)?, &*self.scene(&self.b)?)?;
        if self.json {
            output::json(&of_scenes(&compared))?;
        } else {
            print_scenes(&compared)?;
        }
        let largest = compared.there.largest.max(compared.back.largest);
        match self.tolerance.filter(|most| largest > *most) {
            Some(most) => Err(Failure::Comparison(format!(
                "a point is {largest} from the other scene, farther than {most}"
            ))),
            None => Ok(()),
        }
    }

    fn pictures(&self) -> Result<(), Failure> {
        if self.tolerance.is_some() {
            let message = "--tolerance is for scenes; --threshold limits the PSNR of pictures";
            return Err(Failure::Usage(message.into()));
        }
        let comparison = compare_files(&self.a, &self.b, &self.limits.limits()).map_err(
            |error| match error {
                // The only argument that can be wrong here is the sizes: the pictures differ.
                Error::Argument(message) => Failure::Comparison(message),
                other => other.into(),
            },
        )?;
        if self.json {
            output::json(&json!({
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

fn of_scenes(compared: &SceneComparison) -> Value {
    let distances = |of: &Distances| {
        json!({
            "mean": of.mean,
            "rms": of.rms,
            "median": of.median,
            "95%": of.most,
            "largest": of.largest,
        })
    };
    let values = compared.values.iter().map(|value| {
        json!({
            "name": value.name,
            "count": value.count,
            "mean": value.mean,
            "largest": value.largest,
        })
    });
    json!({
        "counts": compared.counts,
        "distances": [distances(&compared.there), distances(&compared.back)],
        "values": values.collect::<Vec<_>>(),
        "unmatched": compared.unmatched,
    })
}

fn print_scenes(compared: &SceneComparison) -> Result<(), Failure> {
    let [a, b] = compared.counts;
    output::line(format_args!("points          {a} and {b}"))?;
    let heads = ["mean", "rms", "median", "95 %", "largest"];
    let row = |name: &str, cells: [String; 5]| {
        let cells = cells.map(|cell| format!("{cell:>12}")).concat();
        output::line(format_args!("{name:<16}{cells}"))
    };
    row("distances", heads.map(str::to_owned))?;
    for (name, of) in [("first to second", &compared.there), ("second to first", &compared.back)] {
        row(name, [of.mean, of.rms, of.median, of.most, of.largest].map(|d| format!("{d:.6}")))?;
    }
    for value in &compared.values {
        output::line(format_args!(
            "{:<20}differs by {:.6} on average, by {:.6} at most",
            value.name, value.mean, value.largest
        ))?;
    }
    for (names, which) in compared.unmatched.iter().zip(["first", "second"]) {
        if !names.is_empty() {
            output::line(format_args!("only in {which:<8}{}", names.join(", ")))?;
        }
    }
    Ok(())
}
