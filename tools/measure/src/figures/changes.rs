//! How long it takes to change one of ten items of a scene that is prepared.

use crate::report::{Cell, Table};
use splatkit::{
    Device, ItemId, Renderer,
    glam::{DQuat, DVec3},
    gpu::{Budget, Gpu},
    math::{Camera, Pose},
    scene::{Item, Scene, Settings},
    surface::{Mesh, SurfelOptions},
};
use splatkit_tools::{failure::Failure, progress::Progress};
use std::{sync::Arc, time::Instant};

const ITEMS: usize = 10;
/// Turns around the knot and around its tube.
const KNOT: [u32; 2] = [2000, 50];
const SIZE: [u32; 2] = [320, 240];
/// Each change is measured this often.
const TIMES: usize = 5;

pub fn table(gpu: &Gpu, progress: &Progress) -> Result<Table, Failure> {
    let mut knot = Mesh::knot(KNOT[0], KNOT[1]);
    knot.positions.iter_mut().for_each(|place| *place *= 0.2);
    let surfels = Arc::new(knot.surfels(&SurfelOptions::default())?);
    let count = surfels.splats.len();
    let mut table = Table::new(
        "Changes.",
        format!(
            "{ITEMS} items of {count} surfels, {}×{} pixels: medians of {TIMES} in ms, each with \
             the picture after it, and the megabytes that the device gets.",
            SIZE[0], SIZE[1]
        ),
        &["change", "GPU engine", "its MB", "CPU engine"],
    );
    let mut rows: Vec<(&str, Vec<Cell>)> = Vec::new();
    for device in [Device::Gpu(gpu.clone(), Budget::default()), Device::Cpu] {
        progress.stage(format!("Changes, {}", device.name()));
        let measured = measure(&device, &surfels_of(&surfels))?;
        for (number, (name, milliseconds, megabytes)) in measured.into_iter().enumerate() {
            if rows.len() <= number {
                rows.push((name, Vec::new()));
            }
            rows[number].1.push(Cell::Number(milliseconds, 2));
            if let Device::Gpu(..) = device {
                rows[number].1.push(Cell::Number(megabytes, 1));
            }
        }
    }
    rows.into_iter().for_each(|(name, cells)| table.row(name, cells));
    Ok(table)
}

/// Returns an item of its own splats, so that nothing is shared.
fn surfels_of(set: &Arc<splatkit::splat::Surfels>) -> impl Fn(usize) -> Item {
    let set = set.clone();
    move |_| Item::Radiance(Arc::new((*set).clone()))
}

fn place(number: usize) -> Pose {
    let translation = DVec3::new((number % 5) as f64, (number / 5) as f64, 0.0);
    Pose { rotation: DQuat::IDENTITY, translation }
}

/// Returns what was done, the milliseconds that it took, and the megabytes that the device got.
fn measure(
    device: &Device,
    item: &dyn Fn(usize) -> Item,
) -> Result<Vec<(&'static str, f64, f64)>, Failure> {
    let mut scene = Scene::new();
    for number in 0..ITEMS {
        scene.items.push(item(number));
        scene.set_pose(number, place(number))?;
    }
    let camera = Camera::fit(&scene, SIZE)?;
    let settings = Settings::new(SIZE);
    let mut renderer = Renderer::new(device, &scene)?;
    let mut last = ItemId::from(ITEMS - 1);
    let mut bytes = renderer.draw(&camera, &settings)?.gpu_bytes;
    let mut all: Vec<(&'static str, Vec<f64>, f64)> = Vec::new();
    let mut step = |name, renderer: &mut Renderer, change: &mut dyn FnMut(&mut Renderer)| {
        let start = Instant::now();
        change(renderer);
        let stats = renderer.draw(&camera, &settings);
        let milliseconds = start.elapsed().as_secs_f64() * 1e3;
        let now = stats.map_or(bytes, |stats| stats.gpu_bytes);
        let megabytes = now.saturating_sub(bytes) as f64 / 1e6;
        bytes = now;
        match all.iter_mut().find(|entry| entry.0 == name) {
            Some(entry) => entry.1.push(milliseconds),
            None => all.push((name, vec![milliseconds], megabytes)),
        }
    };
    for _ in 0..TIMES {
        step("none", &mut renderer, &mut |_| ());
        step("hidden", &mut renderer, &mut |renderer| {
            let _ = renderer.set_visible(last, false);
        });
        step("shown", &mut renderer, &mut |renderer| {
            let _ = renderer.set_visible(last, true);
        });
        step("moved", &mut renderer, &mut |renderer| {
            let _ = renderer.set_pose(last, place(ITEMS));
        });
        step("removed", &mut renderer, &mut |renderer| {
            let _ = renderer.remove(last);
        });
        step("added", &mut renderer, &mut |renderer| {
            if let Ok(id) = renderer.add(item(ITEMS)) {
                last = id;
            }
            let _ = renderer.set_pose(last, place(ITEMS - 1));
        });
        step("all prepared anew", &mut renderer, &mut |renderer| {
            if let Ok(fresh) = Renderer::new(device, &renderer.scene().clone()) {
                *renderer = fresh;
            }
            last = ItemId::from(ITEMS - 1);
        });
    }
    Ok(all
        .into_iter()
        .map(|(name, mut times, megabytes)| {
            times.sort_by(f64::total_cmp);
            (name, times[times.len() / 2], megabytes)
        })
        .collect())
}
