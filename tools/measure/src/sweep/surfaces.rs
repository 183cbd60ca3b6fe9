//! The axes of surfaces: a knot as a hierarchy of surfels.

use super::{
    Effort,
    asked::{Content, Surface},
    plan::{Plan, Shared, Step, in_order, shared},
    views,
};
use crate::suite::surfaces::{hierarchy, knot};
use glam::DVec3;
use splatkit::{
    Result,
    hierarchy::{Detail, Hierarchy},
    math::{Bounds, Camera},
    scene::{Scene, Settings},
};
use std::sync::Arc;

/// Points of the model, side of the picture in pixels, and pixels of the cut.
const POINTS: u32 = 650_000;
const SIZE: u32 = 1024;
const CUT: f64 = 1.0;
/// One in this many points is used to estimate how many points are in view.
const EVERY: usize = 50;

#[derive(Clone)]
struct Model {
    hierarchy: Arc<Hierarchy>,
    bounds: Bounds,
    points: Arc<[DVec3]>,
}

fn model(effort: Effort) -> Shared<Model> {
    shared(move || {
        let mesh = knot(effort.points(POINTS));
        let points = mesh.positions.iter().step_by(EVERY).map(|point| point.as_dvec3()).collect();
        let (hierarchy, bounds) = hierarchy(&mesh)?;
        Ok(Model { hierarchy: Arc::new(hierarchy), bounds, points })
    })
}

impl Model {
    fn seen(self, camera: Camera, size: u32, cut: f64) -> Step {
        let Self { hierarchy, points, .. } = self;
        let count = hierarchy.header().leaves;
        Step {
            scene: Scene::new().with_hierarchy(hierarchy),
            content: Content::Surface(Surface { points, count, cut }),
            camera,
            settings: Settings { detail: Detail::Pixels(cut), ..Settings::new([size; 2]) },
        }
    }
}

/// Plans one step for each value, with the model seen as `view` returns it.
fn each<T: Copy + 'static>(
    effort: Effort,
    values: &[T],
    name: impl Fn(T) -> String,
    view: impl Fn(Model, T) -> Step + Copy + 'static,
) -> Vec<Plan> {
    let model = model(effort);
    let plan = |&value: &T| {
        let model = model.clone();
        Plan::new(name(value), move || -> Result<Step> { Ok(view(model()?, value)) })
    };
    in_order(values.iter().map(plan).collect())
}

pub fn distances(effort: Effort) -> Vec<Plan> {
    // From its centre, nothing of the knot is visible.
    let [distances @ .., _] = &views::DISTANCES;
    each(
        effort,
        distances,
        |times| times.to_string(),
        move |model, times| {
            let camera = views::at_distance(times, &model.bounds, DVec3::Y);
            model.seen(camera, effort.pixels(SIZE), CUT)
        },
    )
}

pub fn sizes(effort: Effort) -> Vec<Plan> {
    each(
        effort,
        &super::SIZES.map(|size| effort.pixels(size)),
        |size| format!("{size}²"),
        |model, size| {
            let camera = views::usual(&model.bounds, DVec3::Y);
            model.seen(camera, size, CUT)
        },
    )
}

pub fn cuts(effort: Effort) -> Vec<Plan> {
    let cuts = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
    each(
        effort,
        &cuts,
        |cut| cut.to_string(),
        move |model, cut| {
            let camera = views::usual(&model.bounds, DVec3::Y);
            model.seen(camera, effort.pixels(SIZE), cut)
        },
    )
}
