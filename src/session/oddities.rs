//! The oddities of an input without checksums: parts that draw nothing, or that are drawn
//! differently than meant.

use super::{Data, Framing, Opened, Subject};
use crate::{
    Deadline, Error, Result, bricks,
    container::{Finding, Severity},
    formats::Kind,
    gaussians::Gaussians,
    hierarchy,
    math::Bounds,
    progress::Watch,
    surface::{Mesh, SurfelOptions},
};
use glam::DVec3;
use std::path::Path;

impl Data {
    /// Returns the oddities of a mesh, of a point cloud and of trained Gaussians, and of any data
    /// whether it is out of sight of the usual camera. Other readers report what is wrong.
    /// Hierarchies and bricks have checks of their own:
    /// [`hierarchy::file::check`](crate::hierarchy::file::check) and
    /// [`bricks::check`](crate::bricks::check).
    ///
    /// # Errors
    /// [`Error::Timeout`] after the deadline, [`Error::Memory`] for splats that do not fit.
    pub fn oddities(&self, deadline: Deadline) -> Result<Vec<Finding>> {
        let mut findings = match self {
            Self::Mesh(mesh) => in_mesh(mesh, deadline)?,
            Self::Gaussians(set) => in_gaussians(set),
            _ => Vec::new(),
        };
        findings.extend(self.bounds().and_then(of_bounds));
        Ok(findings)
    }
}

impl Opened<'_> {
    /// Checks an input: every checksum and guarantee of a hierarchy or of bricks; of other inputs,
    /// which are read, their oddities ([`Data::oddities`]). `watch` hears how many bricks are
    /// checked, and of how many.
    ///
    /// # Errors
    /// Those of [`read`](Self::read) and of [`Data::oddities`].
    pub fn findings(&self, watch: Watch<'_>) -> Result<Vec<Finding>> {
        let (path, limits) = (self.path(), self.limits());
        // Reading counts, too.
        let deadline = limits.deadline();
        Ok(match self.kind() {
            Kind::Hierarchy if self.held().is_some() => self.hierarchy()?.check().findings,
            // Reading its metadata finds what is wrong with it.
            Kind::Bricks if self.image_in_levels().is_some() => {
                self.bricks()?;
                Vec::new()
            }
            Kind::Bricks if self.held().is_some() => self.bricks()?.check(watch).findings,
            Kind::Hierarchy => hierarchy::file::check(path, limits).findings,
            Kind::Bricks => bricks::check(path, limits, watch).findings,
            _ => {
                self.read()?.oddities(deadline).map_err(|error| error.stated_in(path, "content"))?
            }
        })
    }
}

/// Returns the finding on a box that no usual camera sees. Nothing draws it.
fn of_bounds(bounds: Bounds) -> Option<Finding> {
    // Footprints give a place an extent, and nothing to see is no matter of places.
    let subject = Subject::new(bounds, DVec3::Y);
    if bounds.is_empty() || subject.is_one_place() {
        return None;
    }
    let fault = Framing::usual_fault(&subject, &bounds, [1280, 720])?;
    let Error::Input { place, message, .. } = Framing::out_of_sight(Path::new(""), bounds, &fault)
    else {
        return None;
    };
    Some(Finding::error("out-of-sight", place, message))
}

/// Returns a warning if something was found.
fn warning(code: &'static str, place: &str, message: Option<String>) -> Option<Finding> {
    let (severity, place) = (Severity::Warning, place.to_owned());
    message.map(|message| Finding { code, severity, place, message })
}

/// Returns the oddities of trained Gaussians.
fn in_gaussians(set: &Gaussians) -> Vec<Finding> {
    let (survey, all) = (set.survey(), set.len() as u64 + set.broken.all());
    let of = |count: u64, what: &str| (count > 0).then(|| format!("{count} of {all} {what}"));
    let oddities = [
        ("not-finite", of(set.broken.not_finite, "have numbers that are not finite; left out")),
        ("no-rotation", of(set.broken.without_rotation, "have a zero quaternion; left out")),
        ("invisible", of(survey.invisible, "cover less than 1/255 of any pixel")),
        ("needles", of(survey.needles, "are at least 25 times as long as they are wide")),
    ];
    oddities.into_iter().filter_map(|(code, message)| warning(code, "Gaussians", message)).collect()
}

/// Returns findings on a mesh or point cloud: parts that draw nothing, or that are drawn
/// differently than meant.
fn in_mesh(mesh: &Mesh, deadline: Deadline) -> Result<Vec<Finding>> {
    let survey = mesh.survey();
    let (points, triangles) = (mesh.positions.len(), mesh.triangles.len());
    let of = |count: usize, all: usize, what: &str| {
        (count > 0).then(|| format!("{count} of {all} {what}"))
    };
    let open = "the surface has borders; its back is visible through them";
    let open = (triangles > 0 && !mesh.is_closed()).then(|| open.to_owned());
    let oddities = [
        ("not-finite", "positions", of(survey.not_finite, points, "are not finite")),
        (
            "duplicates",
            "positions",
            of(survey.duplicates, points, "lie at the position of another"),
        ),
        ("no-area", "triangles", of(survey.without_area, triangles, "have no area")),
        ("unused", "positions", of(survey.unused, points, "belong to no triangle")),
        ("open", "triangles", open),
    ];
    let warnings =
        oddities.into_iter().filter_map(|(code, place, message)| warning(code, place, message));
    let mut findings: Vec<Finding> = warnings.collect();
    match mesh.surfels(&SurfelOptions { deadline, ..SurfelOptions::default() }) {
        // These errors say nothing about the file.
        Err(error @ (Error::Timeout { .. } | Error::Memory { .. })) => return Err(error),
        Err(error) => findings.push(Finding::error("nothing", "content", error.to_string())),
        Ok(_) => {}
    }
    Ok(findings)
}
