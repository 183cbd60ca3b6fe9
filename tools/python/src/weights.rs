//! Where the work of a picture lies: what several machines share a scene by.

use splatkit::{
    Result,
    bricks::{Bricks, SIDE},
    glam::{DVec3, Vec3},
    hierarchy::Hierarchy,
    scene::{Item, Scene},
    splat::Splat,
    volume::{TransferFunction, Volume, reach::first_visible},
};

/// The most places that an item in memory is represented by.
const MOST: usize = 1 << 15;

/// Returns places (x, y, z) with weights: about how many splats or samples are drawn there.
///
/// # Errors
/// Those of reading the directory of a hierarchy.
pub fn of_scene(scene: &Scene) -> Result<Vec<[f64; 4]>> {
    let items = scene.items.iter().map(of_item).collect::<Result<Vec<_>>>()?;
    Ok(items.concat())
}

fn of_splats(origin: DVec3, splats: &[Splat]) -> Vec<[f64; 4]> {
    sampled(splats.len(), |at| Vec3::from(splats[at].center).as_dvec3() + origin)
}

fn of_item(item: &Item) -> Result<Vec<[f64; 4]>> {
    Ok(match item {
        Item::Bricks(bricks, _, transfer) => of_bricks(bricks, transfer),
        Item::Hierarchy(hierarchy) => of_hierarchy(hierarchy)?,
        Item::Volume(volume, _, transfer) => of_volume(volume, transfer),
        Item::Radiance(set) => of_splats(set.origin, &set.splats),
        Item::Scalar(set, _) => of_splats(set.origin, &set.splats),
        Item::Facets(set) => {
            let place = |at: usize| Vec3::from(set.facets[at].corners[0]).as_dvec3() + set.origin;
            sampled(set.facets.len(), place)
        }
        Item::Solid(solid) => {
            let set = solid.boundary();
            let place = |at: usize| Vec3::from(set.facets[at].corners[0]).as_dvec3() + set.origin;
            sampled(set.facets.len(), place)
        }
        Item::Gaussians(set) => {
            sampled(set.centers.len(), |at| set.centers[at].as_dvec3() + set.origin)
        }
        Item::Cells(cells, _) => vec![weighted(cells.bounds().center(), 1.0)],
    })
}

/// The bricks of the finest level that show something.
fn of_bricks(bricks: &Bricks, transfer: &TransferFunction) -> Vec<[f64; 4]> {
    let (level, lattice) = (bricks.level(0), bricks.lattice(0));
    let visible = first_visible(transfer, bricks.header().range);
    let ranges = bricks.ranges(0).into_iter().zip(0u32..);
    let shows = |[low, high]: [u8; 2]| u16::from(high) >= visible[usize::from(low)];
    let weights = ranges.filter(|(range, _)| shows(*range)).map(|(_, brick)| {
        let first = level.place(brick).map(|at| at * SIDE);
        let last = [0, 1, 2].map(|axis| (first[axis] + SIDE).min(level.dims[axis]));
        let middle = [0, 1, 2].map(|axis| 0.5 * (first[axis] + last[axis]) as f64 - 0.5);
        let count: usize = [0, 1, 2].map(|axis| last[axis] - first[axis]).iter().product();
        weighted(lattice.position(DVec3::from_array(middle)), count as f64)
    });
    weights.collect()
}

/// The pages of a hierarchy below the root's.
fn of_hierarchy(hierarchy: &Hierarchy) -> Result<Vec<[f64; 4]>> {
    let origin = hierarchy.header().origin;
    let place = |center: [f32; 3]| Vec3::from_array(center).as_dvec3() + origin;
    let mut weights = Vec::new();
    for page in 0..hierarchy.page_count() {
        let entry = hierarchy.entry(page)?;
        if entry.parents_radius.is_finite() {
            weights.push(weighted(place(entry.parents_center), f64::from(entry.nodes)));
        }
    }
    Ok(weights)
}

/// The samples that show something.
fn of_volume(volume: &Volume, transfer: &TransferFunction) -> Vec<[f64; 4]> {
    let lattice = &volume.lattice;
    let shows = |at: &usize| transfer.visible([volume.value(*at); 2]);
    let step = step(volume.len());
    let place = |at: usize| lattice.position(lattice.steps(lattice.index(at)));
    let samples = (0..volume.len()).step_by(step).filter(shows);
    samples.map(|at| weighted(place(at), step as f64)).collect()
}

fn sampled(count: usize, place: impl Fn(usize) -> DVec3) -> Vec<[f64; 4]> {
    let step = step(count);
    (0..count).step_by(step).map(|at| weighted(place(at), step as f64)).collect()
}

/// Every how many of `count` are taken. An odd number does not keep to one column of a volume.
fn step(count: usize) -> usize {
    count.div_ceil(MOST).max(1) | 1
}

fn weighted(place: DVec3, weight: f64) -> [f64; 4] {
    let [x, y, z] = place.to_array();
    [x, y, z, weight]
}
