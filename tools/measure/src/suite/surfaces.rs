//! Surfaces of more and more points, as hierarchies. A picture draws no more of them than its
//! pixels can show.

use super::{
    Effort,
    case::{Case, Plan, Series},
};
use glam::DVec3;
use splatkit::session::Subject;
use splatkit::{
    Error, Result,
    hierarchy::{BuildOptions, Detail, Hierarchy, Tree},
    math::Bounds,
    scene::{Scene, Settings},
    surface::{Mesh, SurfelOptions},
};

/// Points of the models.
const POINTS: [u32; 4] = [35_000, 150_000, 650_000, 2_600_000];
/// Points of the models that take minutes and gigabytes to build.
const MANY_POINTS: [u32; 1] = [10_500_000];
const SIZE: u32 = 1024;
/// Pixels of the cut.
const CUT: f64 = 1.0;

pub fn plans(effort: Effort) -> Vec<Plan> {
    let many = if effort == Effort::Full { &MANY_POINTS[..] } else { &[] };
    let plan = |&points: &u32| {
        let points = effort.points(points);
        Plan::new(format!("knot, {points} points"), move || {
            let mut case = model(points, effort.pixels(SIZE))?;
            let series =
                Series { name: "frame time of a surface", of: "points", value: f64::from(points) };
            case.series = Some(series);
            Ok(case)
        })
    };
    POINTS.iter().chain(many).map(plan).collect()
}

/// Makes a knot of about this many points, as a hierarchy of surfels.
pub fn model(points: u32, size: u32) -> Result<Case> {
    let (hierarchy, bounds) = hierarchy(&knot(points))?;
    let settings = Settings { detail: Detail::Pixels(CUT), ..Settings::new([size; 2]) };
    let leaves = hierarchy.header().leaves;
    let scene = Scene::new().with_hierarchy(hierarchy);
    Ok(Case::new("generated: knot", scene, Subject::new(bounds, DVec3::Y), settings, leaves))
}

/// Makes a knot whose triangles are about as long as they are wide: the knot is twelve times as
/// long as around.
pub fn knot(points: u32) -> Mesh {
    let around = f64::from(points / 12).sqrt().round() as u32;
    Mesh::knot(12 * around, around)
}

/// Builds the hierarchy of a closed mesh; also returns the box around the mesh.
pub fn hierarchy(mesh: &Mesh) -> Result<(Hierarchy, Bounds)> {
    let bounds = mesh.bounds().ok_or_else(|| Error::NothingToDraw("there are no points".into()))?;
    let options = BuildOptions { closed: true, ..BuildOptions::default() };
    let tree = Tree::build(&mesh.surfels(&SurfelOptions::default())?, &options, None)?;
    Ok((Hierarchy::from_tree(tree)?, bounds))
}
