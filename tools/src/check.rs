//! `splatkit check`.

use crate::{
    failure::Failure, load::LoadFlags, output, parse, progress::Progress, scene_file,
    terminal::safe,
};
use clap::Args;
use serde_json::json;
use splatkit::{Finding, Severity, memory};
use std::path::PathBuf;

#[derive(Args, Debug)]
pub struct Check {
    /// A hierarchy or a volume in bricks, of which every checksum and guarantee is checked, or
    /// another input, which is read and searched for oddities. Or an address (docs/remote.md).
    #[arg(value_parser = parse::input())]
    file: PathBuf,
    /// Print the findings as JSON.
    #[arg(long)]
    json: bool,
    #[command(flatten)]
    load: LoadFlags,
}

impl Check {
    pub fn run(mut self, progress: &Progress) -> Result<(), Failure> {
        scene_file::refuse(&self.file)?;
        self.load = self.load.begun();
        progress.stage(format!("Checking {}", self.file.display()));
        let reading = self.load.reading(memory::most());
        let opened = reading.open(&self.file)?;
        let stages = progress.stages();
        let watch = |done, all| stages.set("Checking bricks", done, all);
        let findings = opened.findings(Some(&watch))?;
        progress.clear();
        let ok = findings.iter().all(|finding| finding.severity != Severity::Error);
        if self.json {
            let findings: Vec<_> = findings.iter().map(Finding::to_json).collect();
            output::json(&json!({ "ok": ok, "findings": findings }))?;
        } else {
            for finding in &findings {
                let severity = finding.severity.name();
                let (place, message) = (safe(&finding.place), safe(&finding.message));
                output::line(format_args!("{severity} ({}) {place}: {message}", finding.code))?;
            }
            output::line(if ok { "sound" } else { "damaged" })?;
        }
        if ok {
            Ok(())
        } else {
            Err(Failure::Damaged { file: self.file, findings: findings.len() })
        }
    }
}
