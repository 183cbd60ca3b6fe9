//! `splatkit transfer`: the transfer function that a picture would have, as a file to start from.

use crate::{
    failure::Failure, flag_names, load::LoadFlags, output, parse, progress::Progress,
    show::ShowFlags,
};
use clap::Args;
use splatkit::{
    Error, disk,
    session::{Appearance, Data, Description},
    volume::TransferFunction,
};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct Transfer {
    /// Make it for this volume, volume in bricks, set of cells, or set of scattered samples.
    #[arg(value_name = "FILE", value_parser = parse::input())]
    input: PathBuf,
    /// Write to this .json file, or to stdout if it is `-`. `render --transfer` reads it.
    #[arg(short, long, value_name = "FILE.json", allow_hyphen_values = true)]
    output: PathBuf,
    /// Replace an existing file.
    #[arg(long)]
    overwrite: bool,
    #[command(flatten)]
    load: LoadFlags,
    #[command(flatten)]
    show: ShowFlags,
}

impl Transfer {
    pub fn run(mut self, progress: &Progress) -> Result<(), Failure> {
        self.load = self.load.begun();
        if let Some(flag) = self.show.unused_by_values() {
            return Err(Failure::Usage(format!("{flag} has no effect on a transfer function")));
        }
        let mut scene = Description::new([self.input.clone()]);
        self.show.apply(&mut scene)?;
        self.load.apply(&mut scene);
        self.show.color.check_effect(false, true)?;
        scene.check().map_err(|(place, message)| {
            Failure::Usage(format!("--{}: {message}", flag_names::flag_of(&place)))
        })?;
        let is_stdout = self.output.as_os_str() == "-";
        if !is_stdout {
            self.check_output()?;
        }
        let appearance = scene.showing(&scene.inputs[0])?.appearance;
        progress.stage(format!("Reading {}", self.input.display()));
        let mut read = scene.files();
        let reading = self.load.reading(splatkit::memory::most());
        let opened = reading.open(&self.input)?;
        let input = opened.read()?;
        read.extend(opened.files());
        progress.stage("Looking at its values");
        let text = text(&self.of(&appearance, &input)?);
        progress.clear();
        if is_stdout {
            return output::stdout(text.as_bytes());
        }
        output::check_unneeded(&self.output, &read)?;
        Ok(disk::write(&self.output, text.as_bytes())?)
    }

    /// Refuses, before the work is done, what cannot be written.
    fn check_output(&self) -> Result<(), Failure> {
        if self.output.extension().is_none_or(|extension| extension != "json") {
            return Err(Failure::Usage(format!(
                "{}: transfer functions are written as .json",
                self.output.display()
            )));
        }
        output::check(&self.output, self.overwrite)?;
        output::try_writing(&self.output, std::slice::from_ref(&self.input))
    }

    /// Returns the transfer function that shows an input.
    fn of(&self, appearance: &Appearance, input: &Data) -> Result<TransferFunction, Failure> {
        let path = &self.input;
        let name = path.display().to_string();
        Ok(match input {
            Data::Volume(volume) => appearance.of_volume(&name, volume)?,
            Data::Samples(points) => appearance.of_samples(&name, points)?,
            Data::Cells(cells) => appearance.of_cells(&name, cells)?,
            Data::Bricks(bricks) => appearance.of_bricks(&name, bricks)?,
            Data::Mesh(_) | Data::Gaussians(_) | Data::Hierarchy(_) => {
                let message = "has colours of its own, and no values for a transfer function";
                let error = Error::input(path, "content", message);
                return Err(error.hint("give a volume, or name a value with --scalar").into());
            }
        })
    }
}

/// Returns the JSON with one line for each point.
pub fn text(transfer: &TransferFunction) -> String {
    let json = transfer.to_json();
    let Ok(serde_json::Value::Object(parts)) = serde_json::from_str(&json) else { return json };
    let lines = parts.iter().map(|(name, value)| {
        let value = match value {
            serde_json::Value::Array(points) => {
                let points: Vec<String> =
                    points.iter().map(|point| format!("    {point}")).collect();
                format!("[\n{}\n  ]", points.join(",\n"))
            }
            other => other.to_string(),
        };
        format!("  \"{name}\": {value}")
    });
    format!("{{\n{}\n}}\n", lines.collect::<Vec<_>>().join(",\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_text_is_read_back_as_it_was() {
        let named = TransferFunction::named("ct-angiography", [0.0, 0.1 + 0.2]).unwrap();
        let transfer = TransferFunction { unit: 1.0 / 3.0, ..named };
        let text = text(&transfer);
        assert_eq!(TransferFunction::from_json(&text).unwrap(), transfer, "{text}");
        assert_eq!(text.lines().count(), 2 + 2 * (2 + transfer.color.len()) + 2, "{text}");
    }
}
