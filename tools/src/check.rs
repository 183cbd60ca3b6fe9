//! `splatkit check`.

use crate::{
    failure::{Failure, in_file},
    load::{Input, LoadFlags},
    output, parse,
    progress::Progress,
    terminal::safe,
};
use clap::Args;
use serde_json::json;
use splatkit::{
    Deadline, Error, bricks,
    container::{Finding, Severity},
    formats::Kind,
    gaussians::Gaussians,
    hierarchy::file,
    surface::{Mesh, SurfelOptions},
};
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
    pub fn run(self, progress: &Progress) -> Result<(), Failure> {
        progress.stage(format!("Checking {}", self.file.display()));
        let limits = self.load.limits();
        let deadline = limits.deadline();
        let findings = match self.load.kind(&self.file)? {
            Kind::Hierarchy => file::check(&self.file, &limits).findings,
            Kind::Bricks => {
                let stages = progress.stages();
                let watch = |done, all| stages.set("Checking bricks", done, all);
                bricks::check(&self.file, &limits, Some(&watch)).findings
            }
            _ => match self.load.open(&self.file)? {
                Input::Mesh(mesh) => {
                    of_mesh(&mesh, deadline).map_err(|error| in_file(&self.file, error))?
                }
                Input::Gaussians(set) => of_gaussians(&set),
                // Errors in other inputs are reported when they are read.
                _ => Vec::new(),
            },
        };
        progress.clear();
        let ok = findings.iter().all(|finding| finding.severity != Severity::Error);
        if self.json {
            let findings: Vec<_> = findings.iter().map(as_json).collect();
            output::json(&json!({ "ok": ok, "findings": findings }))?;
        } else {
            for finding in &findings {
                let severity = name_of(finding.severity);
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

fn name_of(severity: Severity) -> &'static str {
    match severity {
        Severity::Warning => "warning",
        Severity::Error => "error",
    }
}

fn as_json(finding: &Finding) -> serde_json::Value {
    json!({
        "code": finding.code,
        "severity": name_of(finding.severity),
        "where": finding.place,
        "message": finding.message,
    })
}

/// Returns the oddities of trained Gaussians.
fn of_gaussians(set: &Gaussians) -> Vec<Finding> {
    let (survey, all) = (set.survey(), set.len() as u64 + set.broken.all());
    let of = |count: u64, what: &str| (count > 0).then(|| format!("{count} of {all} {what}"));
    let found = [
        ("not-finite", of(set.broken.not_finite, "have numbers that are not finite; left out")),
        ("no-rotation", of(set.broken.without_rotation, "have a zero quaternion; left out")),
        ("invisible", of(survey.invisible, "cover less than 1/255 of any pixel")),
        ("needles", of(survey.needles, "are at least 25 times as long as they are wide")),
    ];
    let finding = |(code, message): (_, Option<String>)| {
        let (severity, place) = (Severity::Warning, "Gaussians".into());
        Some(Finding { code, severity, place, message: message? })
    };
    found.into_iter().filter_map(finding).collect()
}

/// Returns findings on a mesh or point cloud: parts that draw nothing, or that are drawn
/// differently than meant.
fn of_mesh(mesh: &Mesh, deadline: Deadline) -> splatkit::Result<Vec<Finding>> {
    let mut findings = Vec::new();
    let mut warn = |code, place: &str, message: String| {
        findings.push(Finding { code, severity: Severity::Warning, place: place.into(), message });
    };
    let survey = mesh.survey();
    let of = |count: usize, all: usize| format!("{count} of {all}");
    let (points, triangles) = (mesh.positions.len(), mesh.triangles.len());
    if survey.not_finite > 0 {
        warn(
            "not-finite",
            "positions",
            format!("{} are not finite", of(survey.not_finite, points)),
        );
    }
    if survey.duplicates > 0 {
        warn(
            "duplicates",
            "positions",
            format!("{} lie at the position of another", of(survey.duplicates, points)),
        );
    }
    if survey.without_area > 0 {
        warn(
            "no-area",
            "triangles",
            format!("{} have no area", of(survey.without_area, triangles)),
        );
    }
    if survey.unused > 0 {
        warn("unused", "positions", format!("{} belong to no triangle", of(survey.unused, points)));
    }
    if triangles > 0 && !mesh.is_closed() {
        warn(
            "open",
            "triangles",
            "the surface has borders; its back is visible through them".into(),
        );
    }
    match mesh.surfels(&SurfelOptions { deadline, ..SurfelOptions::default() }) {
        // These errors say nothing about the file.
        Err(error @ (Error::Timeout { .. } | Error::Memory { .. })) => return Err(error),
        Err(error) => {
            let message = error.to_string();
            findings.push(Finding {
                code: "nothing",
                severity: Severity::Error,
                place: "content".into(),
                message,
            });
        }
        Ok(_) => {}
    }
    Ok(findings)
}
