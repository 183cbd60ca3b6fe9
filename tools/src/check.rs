//! `splatkit check`.

use crate::{
    camera::{CameraFlags, Subject},
    failure::{Failure, in_file},
    load::{Input, LoadFlags},
    output, parse,
    progress::Progress,
    scene::{is_one_place, out_of_sight},
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
    gaussians::Gaussians,
    hierarchy::file,
    math::Bounds,
    surface::{Mesh, SurfelOptions},
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
        let findings = match self.load.kind(&self.file)? {
            Kind::Hierarchy => file::check(&self.file, &limits).findings,
            Kind::Bricks => {
                let stages = progress.stages();
                let watch = |done, all| stages.set("Checking bricks", done, all);
                bricks::check(&self.file, &limits, Some(&watch)).findings
            }
            _ => self.of_input(&self.load.open(&self.file)?, deadline)?,
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

impl Check {
    /// Returns the oddities of an input that has no checksums. Errors are reported as it is read.
    fn of_input(&self, input: &Input, deadline: Deadline) -> Result<Vec<Finding>, Failure> {
        let (mut findings, bounds) = match input {
            Input::Mesh(mesh) => {
                let found = of_mesh(mesh, deadline).map_err(|error| in_file(&self.file, error))?;
                (found, mesh.bounds())
            }
            Input::Gaussians(set) => {
                let Bounds { min, max } = set.bounds();
                (of_gaussians(set), Some([min, max]))
            }
            Input::Volume(volume) => (Vec::new(), Some(volume.bounds())),
            Input::Samples(points) => (Vec::new(), Some(points.bounds())),
            Input::Cells(cells) => (Vec::new(), Some(cells.bounds())),
            Input::Hierarchy(_) | Input::Bricks(_) => (Vec::new(), None),
        };
        let bounds = bounds.map(|[min, max]| Bounds { min, max });
        findings.extend(bounds.and_then(|bounds| of_bounds(&self.file, bounds)));
        Ok(findings)
    }
}

/// Returns the finding on a box that no usual camera sees. `render` refuses it too.
fn of_bounds(file: &Path, bounds: Bounds) -> Option<Finding> {
    // Footprints give a place an extent, and nothing to see is no matter of places.
    if bounds.is_empty() || is_one_place(&bounds) {
        return None;
    }
    let fault = CameraFlags::usual_fault(&Subject::new(bounds, DVec3::Y), &bounds, [1280, 720])?;
    let Error::Input { place, message, .. } = out_of_sight(file, bounds, &fault) else {
        return None;
    };
    Some(Finding { code: "out-of-sight", severity: Severity::Error, place, message })
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
