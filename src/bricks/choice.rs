//! Which bricks a picture needs.

use super::{Bricks, SIDE};
use crate::{
    math::{Bounds, View},
    parallel::prelude::*,
    volume::Lattice,
};
use glam::DVec3;

/// The levels and bricks of a picture.
#[derive(Debug, Clone, PartialEq)]
pub struct Choice {
    /// One level, or two consecutive ones, finer first, each with its weight in the picture. The
    /// weights sum to 1.
    pub levels: Vec<(usize, f64)>,
    /// Level and number of each brick. They are sorted by the distance of the brick's centre from
    /// the eye (orthographic: from its plane), nearest first. At equal distance, coarse levels come
    /// first.
    pub bricks: Vec<(usize, u32)>,
    /// The level of detail, a real number of levels. Higher is coarser.
    pub lambda: f64,
    /// Which ranges of values show something, as from
    /// [`first_visible`](crate::volume::reach::first_visible).
    pub first_visible: [u16; 256],
}

/// How fine a picture should be, and how much of it is drawn.
#[derive(Debug, Clone, Copy)]
pub struct Wish {
    /// How many pixels a step between samples covers where the volume is nearest to the eye.
    pub pixels: f64,
    /// The maximum number of bricks.
    pub most: usize,
    /// The finest level.
    pub least: f64,
    /// The part of the world that is drawn; `None` for the whole.
    pub region: Option<Bounds>,
}

/// How far the sheets that a region cuts reach beyond it, in samples of a level. Sheets are at most
/// 4/3 samples of the next level thick, and differences of pixels need one sample more.
const BEYOND: f64 = 4.0;

/// If the bricks exceed the budget, the level rises in steps of one over this number.
const STEPS: f64 = 16.0;

/// Chooses the levels whose step between samples covers [`Wish::pixels`] pixels where the volume is
/// nearest to the eye. Of these levels it chooses the bricks that are in the picture and hold
/// values that show according to `first_visible` ([`Choice::first_visible`]). `extent` is the
/// kernel's, in samples of the drawn level. Of a region, it chooses the bricks that the region
/// needs.
///
/// The level is a real number λ = log₂(`pixels` / p), at least [`Wish::least`] and at most the
/// coarsest level. Here p is the size in pixels of the longest step of level 0 at the point of the
/// volume's box nearest to the eye. Between two levels both are drawn, with weights that follow λ,
/// so that zooming causes no popping. If they have more than [`Wish::most`] bricks, λ rises to the
/// next sixteenth at which they do not. The coarsest level, of one brick, is always allowed.
///
/// Of a file in parts, the finest levels whose bricks have come are chosen, and those of the finer
/// ones are asked for, coarse ones first.
pub fn choice(
    bricks: &Bricks,
    view: &View,
    extent: f64,
    first_visible: &[u16; 256],
    wish: &Wish,
) -> Choice {
    let &Wish { pixels, most, least, region } = wish;
    let coarsest = (bricks.levels().len() - 1) as f64;
    // A level's bricks do not depend on λ, so each level is searched once, when it is first needed.
    let mut known: Vec<Option<Vec<(f64, u32)>>> = vec![None; bricks.levels().len()];
    let mut lambda = wanted(bricks, view, pixels).max(least).min(coarsest);
    let find = |level| visible(bricks, level, view, extent, first_visible, region);
    let mut levels = loop {
        let levels = shares(lambda);
        let mut count = 0;
        for &(level, _) in &levels {
            count += known[level].get_or_insert_with(|| find(level)).len();
        }
        if count <= most || lambda >= coarsest {
            break levels;
        }
        lambda = ((lambda * STEPS).floor() + 1.0).min(coarsest * STEPS) / STEPS;
    };
    if bricks.is_in_parts() {
        let mut absent = Vec::new();
        loop {
            let mut wanted = Vec::new();
            for &(level, _) in &levels {
                let of_level = known[level].get_or_insert_with(|| find(level));
                wanted.extend(of_level.iter().map(|&(_, brick)| (level, brick)));
            }
            if bricks.are_there(&wanted) {
                break;
            }
            absent.push(wanted);
            if lambda >= coarsest {
                break;
            }
            lambda = (lambda.floor() + 1.0).min(coarsest);
            levels = shares(lambda);
        }
        absent.iter().rev().for_each(|wanted| bricks.ask(wanted));
    }
    let mut drawn: Vec<(f64, usize, u32)> = Vec::new();
    for &(level, _) in &levels {
        drawn.extend(
            known[level].iter().flatten().map(|&(distance, brick)| (distance, level, brick)),
        );
    }
    drawn.sort_by(|a, b| a.0.total_cmp(&b.0).then(b.1.cmp(&a.1)).then(a.2.cmp(&b.2)));
    let bricks = drawn.into_iter().map(|(_, level, brick)| (level, brick)).collect();
    Choice { levels, bricks, lambda, first_visible: *first_visible }
}

/// λ before any budget.
fn wanted(bricks: &Bricks, view: &View, pixels: f64) -> f64 {
    let step = bricks.header().lattice.spacing().max_element();
    let nearest = if view.perspective { view.distances(&bricks.bounds())[0] } else { 1.0 };
    // From inside the volume, every step counts as too large, so λ is 0.
    (pixels * nearest / (step * view.scale)).log2().max(0.0)
}

/// Returns the levels around λ and their weights.
fn shares(lambda: f64) -> Vec<(usize, f64)> {
    let (level, part) = (lambda.floor() as usize, lambda.fract());
    if part > 0.0 { vec![(level, 1.0 - part), (level + 1, part)] } else { vec![(level, 1.0)] }
}

/// Returns the bricks of a level that are in the picture and show something, with their distances.
fn visible(
    bricks: &Bricks,
    number: usize,
    view: &View,
    extent: f64,
    first_visible: &[u16; 256],
    region: Option<Bounds>,
) -> Vec<(f64, u32)> {
    let level = bricks.level(number);
    let lattice = bricks.lattice(number);
    let sides = view.sides(1.0);
    let shows = |[low, high]: [u8; 2]| u16::from(high) >= first_visible[usize::from(low)];
    // The samples that bricks from the first to the last one along each axis reach, if they may be
    // in the picture.
    let in_picture = |[first, last]: [[usize; 3]; 2]| {
        let min = DVec3::from_array(first.map(|at| (at * SIDE) as f64)) - extent;
        let last: [usize; 3] =
            std::array::from_fn(|axis| ((last[axis] + 1) * SIDE).min(level.dims[axis]) - 1);
        let max = DVec3::from_array(last.map(|at| at as f64)) + extent;
        let samples = Bounds { min, max };
        if region
            .is_some_and(|region| !meets(&region, &lattice, &samples.widened(DVec3::splat(BEYOND))))
        {
            return None;
        }
        let corners = corners(&lattice, &samples).map(|corner| view.to_view(corner));
        let outside = |(normal, reach): &(DVec3, f64)| {
            corners.iter().all(|corner| normal.dot(*corner) + reach < 0.0)
        };
        if sides.iter().any(outside)
            || (view.perspective && corners.iter().all(|corner| corner.z <= 0.0))
        {
            return None;
        }
        Some(samples)
    };
    let visible_brick = |(brick, range): (u32, [u8; 2])| {
        let place = level.place(brick);
        let samples = shows(range).then(|| in_picture([place; 2])).flatten()?;
        let center = view.to_view(lattice.position(samples.center()));
        Some((if view.perspective { center.length() } else { center.z }, brick))
    };
    let candidates = bricks.ranges_within(number, |group| in_picture(group).is_some());
    candidates.into_par_iter().filter_map(visible_brick).collect()
}

/// Returns the corners of a box of samples in the world.
fn corners(lattice: &Lattice, samples: &Bounds) -> [DVec3; 8] {
    samples.corners().map(|corner| lattice.position(corner))
}

/// Whether a box of samples may meet a box of the world: the world's boxes around both overlap.
fn meets(bounds: &Bounds, lattice: &Lattice, samples: &Bounds) -> bool {
    let around = Bounds::around(corners(lattice, samples));
    (around.min.cmple(bounds.max) & around.max.cmpge(bounds.min)).all()
}

#[cfg(test)]
mod tests {
    use super::{choice as choice_for, *};
    use crate::{
        math::{Camera, Projection},
        volume::{
            Lattice, Samples, TransferFunction, Volume,
            reach::{EVERYTHING, first_visible},
        },
    };
    use std::sync::Arc;

    /// 100³ samples, two units apart, that grow from 0 to 198 along x.
    fn ramp() -> Bricks {
        let values = (0..1_000_000usize).map(|index| (2 * (index % 100)) as u8).collect();
        let volume =
            Volume::new(Lattice::with_spacing([100; 3], DVec3::splat(2.0)), Samples::U8(values))
                .unwrap();
        Bricks::from_volume(Arc::new(volume)).unwrap()
    }

    /// The visible ranges if only values over `from` show.
    fn over(from: f64) -> [u16; 256] {
        let transfer = TransferFunction {
            color: vec![(0.0, [1.0; 3])],
            opacity: vec![(from, 0.0), (from + 1.0, 1.0)],
            ..TransferFunction::default()
        };
        first_visible(&transfer, [0.0, 198.0])
    }

    fn flat(height: f64) -> View {
        let camera = Camera {
            position: DVec3::new(99.0, 99.0, -500.0),
            focal_point: DVec3::splat(99.0),
            view_up: DVec3::Y,
            projection: Projection::Orthographic { height },
        };
        camera.view([400, 400]).unwrap()
    }

    fn at(distance: f64) -> View {
        let camera = Camera {
            position: DVec3::new(99.0, 99.0, -distance),
            focal_point: DVec3::splat(99.0),
            view_up: DVec3::Y,
            projection: Projection::Perspective { view_angle: 60.0 },
        };
        camera.view([400, 400]).unwrap()
    }

    const MANY: usize = usize::MAX;

    /// The choice for the whole picture.
    fn choice(
        bricks: &Bricks,
        view: &View,
        extent: f64,
        pixels: f64,
        first_visible: &[u16; 256],
        most: usize,
    ) -> Choice {
        choice_for(
            bricks,
            view,
            extent,
            first_visible,
            &Wish { pixels, most, least: 0.0, region: None },
        )
    }

    #[test]
    fn levels_follow_the_size_of_steps() {
        let bricks = ramp();
        let shows = over(-5.0);
        // A step of 2 covers one pixel if 800 units fill 400 pixels.
        for (height, pixels, lambda) in [
            (800.0, 1.0, 0.0),
            (400.0, 1.0, 0.0),
            (800.0, 2.0, 1.0),
            (1600.0, 1.0, 1.0),
            (1e9, 1.0, 2.0),
        ] {
            let choice = choice(&bricks, &flat(height), 2.0, pixels, &shows, MANY);
            assert_eq!(
                (choice.lambda, &choice.levels[..]),
                (lambda, &[(lambda as usize, 1.0)][..]),
                "{height}"
            );
            let count: usize =
                choice.levels.iter().map(|&(level, _)| bricks.level(level).bricks()).sum();
            assert_eq!(choice.bricks.len(), count);
        }
        let between = choice(&bricks, &flat(800.0 * 2f64.sqrt()), 2.0, 1.0, &shows, MANY);
        assert!(
            (between.lambda - 0.5).abs() < 1e-12 && between.bricks.len() == 64 + 8,
            "{between:?}"
        );
        let [(0, fine), (1, coarse)] = between.levels[..] else { panic!("{between:?}") };
        assert!((fine - 0.5).abs() < 1e-12 && (fine + coarse - 1.0).abs() < 1e-12);
        // In perspective, the nearest point of the box counts: twice as far is one level more.
        let scale = at(1.0).scale;
        for (distance, lambda) in [
            (-98.0, 0.0),
            (0.0, 0.0),
            (2.0 * scale, 0.0),
            (4.0 * scale, 1.0),
            (6.0 * scale, 3f64.log2()),
        ] {
            let chosen = choice(&bricks, &at(distance), 2.0, 1.0, &shows, MANY).lambda;
            assert!((chosen - lambda).abs() < 1e-9, "{distance}: {chosen}");
        }
    }

    #[test]
    fn a_zoom_has_no_jumps() {
        let bricks = ramp();
        let share = |height: f64, level: usize| {
            let choice = choice(&bricks, &flat(height), 2.0, 1.0, &over(-5.0), MANY);
            choice.levels.iter().find(|(number, _)| *number == level).map_or(0.0, |level| level.1)
        };
        for step in 0..400 {
            let [before, after] = [step, step + 1].map(|step| 500.0 * 1.01f64.powi(step));
            for level in 0..3 {
                assert!((share(before, level) - share(after, level)).abs() < 0.02, "{before}");
            }
        }
    }

    #[test]
    fn bricks_are_those_in_the_picture_that_show() {
        let bricks = ramp();
        // Values over 150 are at x of 75 and more; kernels and ranges reach 3 further.
        let bright = choice(&bricks, &flat(400.0), 2.0, 1.0, &over(150.0), MANY);
        let columns: Vec<usize> =
            bright.bricks.iter().map(|&(_, brick)| bricks.level(0).place(brick)[0]).collect();
        assert!(columns.len() == 32 && columns.iter().all(|x| *x >= 2), "{columns:?}");
        assert_eq!(choice(&bricks, &flat(400.0), 2.0, 1.0, &EVERYTHING, MANY).bricks.len(), 64);
        assert!(choice(&bricks, &flat(400.0), 2.0, 1.0, &over(250.0), MANY).bricks.is_empty());
        // A picture of the middle only: the four bricks along z at position 1 along x and y.
        let middle = choice(&bricks, &flat(10.0), 2.0, 1.0, &over(-5.0), MANY);
        let places = || middle.bricks.iter().map(|&(_, brick)| bricks.level(0).place(brick));
        assert!(
            middle.bricks.len() == 4 && places().all(|[x, y, _]| x == 1 && y == 1),
            "{middle:?}"
        );
        // The picture spans steps 47 to 52 along x and y. Brick 2 begins at step 64, so its kernels
        // of extent 14 reach the picture.
        let wider = choice(&bricks, &flat(10.0), 14.0, 1.0, &over(-5.0), MANY);
        assert_eq!(wider.bricks.len(), 16);
        // Nothing is behind the eye.
        let mut behind = at(50.0);
        behind.rotation = glam::DMat3::from_diagonal(DVec3::new(-1.0, 1.0, -1.0)) * behind.rotation;
        assert!(choice(&bricks, &behind, 2.0, 1.0, &over(-5.0), MANY).bricks.is_empty());
    }

    #[test]
    fn near_bricks_come_first() {
        let bricks = ramp();
        let chosen = choice(&bricks, &at(3.0 * at(1.0).scale), 2.0, 1.0, &over(-5.0), MANY);
        assert_eq!((chosen.levels.len(), chosen.bricks.len()), (2, 72));
        let distance = |&(level, brick): &(usize, u32)| {
            let size = bricks.level(level);
            let place: [f64; 3] = size.place(brick).map(|at| (at * SIDE) as f64);
            let last: [f64; 3] =
                std::array::from_fn(|axis| (place[axis] + 31.0).min(size.dims[axis] as f64 - 1.0));
            let middle = 0.5 * (DVec3::from_array(place) + DVec3::from_array(last));
            bricks.lattice(level).position(middle).distance(DVec3::new(
                99.0,
                99.0,
                -3.0 * at(1.0).scale,
            ))
        };
        let distances: Vec<f64> = chosen.bricks.iter().map(distance).collect();
        assert!(distances.is_sorted_by(|a, b| *a <= b + 1e-9));
    }

    #[test]
    fn budgets_are_kept() {
        let bricks = ramp();
        let lambda = |most| {
            let chosen = choice(&bricks, &flat(400.0), 2.0, 1.0, &over(-5.0), most);
            assert!(chosen.bricks.len() <= most.max(1));
            chosen.lambda
        };
        assert_eq!(
            [72, 64, 63, 9, 8, 7, 1, 0].map(lambda),
            [0.0, 0.0, 1.0, 1.0, 1.0, 2.0, 2.0, 2.0]
        );
    }

    #[test]
    fn regions_need_their_bricks_and_those_beside_them() {
        let bricks = ramp();
        let at = |[from, to]: [f64; 2], level: f64| {
            let (min, max) = (DVec3::new(from, -1e3, -1e3), DVec3::new(to, 1e3, 1e3));
            let region = Some(Bounds { min, max });
            let wish = Wish { pixels: 1.0, most: MANY, least: level, region };
            choice_for(&bricks, &flat(400.0), 2.0, &EVERYTHING, &wish)
        };
        let columns = |from: f64, to: f64| {
            let chosen = at([from, to], 0.0);
            let places = chosen.bricks.iter().map(|&(_, brick)| bricks.level(0).place(brick)[0]);
            let mut places: Vec<usize> = places.collect();
            places.sort_unstable();
            places.dedup();
            places
        };
        // Brick 1 has the samples 32 to 63, at x of 64 to 126; it is needed 6 samples beyond.
        assert_eq!(columns(-1e3, 40.0), [0]);
        assert_eq!(columns(-1e3, 60.0), [0, 1]);
        assert_eq!(columns(80.0, 110.0), [1]);
        assert_eq!(columns(-1e3, 1e3), [0, 1, 2, 3]);
        assert_eq!((at([0.0, 9.0], 0.0).lambda, at([0.0, 9.0], 1.5).lambda), (0.0, 1.5));
    }
}
