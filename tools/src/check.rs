//! `splatkit check`.

use crate::{
    failure::{Failure, in_file},
    load::LoadFlags,
    output, parse,
    progress::Progress,
    scene::out_of_sight,
    scene_file,
    terminal::safe,
};
use clap::Args;
use glam::DVec3;
use serde_json::json;
use splatkit::{
    Deadline, Error, bricks,
    container::{Finding, Severity},
    formats::Kind,
    hierarchy::file,
    math::Bounds,
    memory,
    session::{Data, Framing, Subject},
};
use std::path::{Path, PathBuf};

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
        let limits = self.load.limits();
        let deadline = limits.deadline();
        let reading = self.load.reading(memory::most());
        let opened = reading.open(&self.file)?;
        let findings = match opened.kind() {
            Kind::Hierarchy => file::check(&self.file, &limits).findings,
            Kind::Bricks => {
                let stages = progress.stages();
                let watch = |done, all| stages.set("Checking bricks", done, all);
                bricks::check(&self.file, &limits, Some(&watch)).findings
            }
            _ => self.of_input(&opened.read()?, deadline)?,
        };
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

impl Check {
    /// Returns the oddities of an input that has no checksums. Errors are reported as it is read.
    fn of_input(&self, input: &Data, deadline: Deadline) -> Result<Vec<Finding>, Failure> {
        let mut findings = input.oddities(deadline).map_err(|error| in_file(&self.file, error))?;
        let bounds = input.bounds();
        findings.extend(bounds.and_then(|bounds| of_bounds(&self.file, bounds)));
        Ok(findings)
    }
}

/// Returns the finding on a box that no usual camera sees. `render` refuses it too.
fn of_bounds(file: &Path, bounds: Bounds) -> Option<Finding> {
    // Footprints give a place an extent, and nothing to see is no matter of places.
    let subject = Subject::new(bounds, DVec3::Y);
    if bounds.is_empty() || subject.is_one_place() {
        return None;
    }
    let fault = Framing::usual_fault(&subject, &bounds, [1280, 720])?;
    let Error::Input { place, message, .. } = out_of_sight(file, bounds, &fault) else {
        return None;
    };
    Some(Finding { code: "out-of-sight", severity: Severity::Error, place, message })
}
