//! Which pages of a hierarchy a view may need.

use super::{
    Cut, CutSphere, Hierarchy,
    file::{Page, PageEntry, there},
};
use crate::{Result, parallel::prelude::*};
use glam::Vec3;
use std::ops::Range;

/// Margin for rounding in the bounds of several nodes.
const ROOM: f32 = 1.00001;

/// A page that a cut may need.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Needed {
    pub page: u32,
    /// The number of its nodes.
    pub nodes: u32,
}

/// Returns the pages that a cut may need and all pages above them, coarse ones first.
///
/// # Errors
/// Those of [`Hierarchy::entry`].
pub fn needed(hierarchy: &Hierarchy, cut: &Cut) -> Result<Vec<Needed>> {
    let around = |sphere: &CutSphere| cut.may_refine_below(sphere);
    Ok(search(hierarchy, around, |sphere| cut.may_refine(sphere), u64::MAX)?.in_order())
}

/// Returns the coarsest pages, `most` of them, coarse ones first.
///
/// # Errors
/// Those of [`Hierarchy::entry`].
pub fn coarsest(hierarchy: &Hierarchy, most: usize) -> Result<Vec<Needed>> {
    let mut size = (hierarchy.bounds().diagonal() as f32).min(f32::MAX);
    loop {
        let large = |sphere: &CutSphere| sphere.size >= size;
        let mut pages = search(hierarchy, large, large, u64::MAX)?.in_order();
        if pages.len() >= most || size == 0.0 {
            pages.truncate(most);
            return Ok(pages);
        }
        size = if size > f32::MIN_POSITIVE { size * 0.5 } else { 0.0 };
    }
}

/// Returns the finest cut, as a width in pixels, whose pages contain at most `most` nodes.
///
/// # Errors
/// Those of [`Hierarchy::entry`].
pub fn finest_within(hierarchy: &Hierarchy, most: u64, cut: impl Fn(f64) -> Cut) -> Result<f64> {
    let fits = |pixels: f64| {
        let cut = cut(pixels);
        let around = |sphere: &CutSphere| cut.may_refine_below(sphere);
        let pages = search(hierarchy, around, |sphere| cut.may_refine(sphere), most)?;
        Ok(pages.nodes <= most)
    };
    if fits(0.0)? {
        return Ok(0.0);
    }
    let (mut fine, mut coarse) = (-10.0f64, 16.0f64);
    for _ in 0..12 {
        let middle = (fine + coarse) * 0.5;
        *(if fits(middle.exp2())? { &mut coarse } else { &mut fine }) = middle;
    }
    Ok(coarse.exp2())
}

/// What is needed of the entry of a page.
#[derive(Debug, Clone)]
struct Summary {
    nodes: u32,
    size: f32,
    parents: Range<u32>,
}

impl Summary {
    fn of(entry: &PageEntry) -> Self {
        let parents = entry.parent_pages.clone();
        Self { nodes: entry.nodes, size: entry.largest_parent_size, parents }
    }
}

/// Pages with all pages above them.
#[derive(Debug)]
struct All {
    pages: Vec<(u32, Summary)>,
    /// Whether each page of the file is among them.
    holds: Vec<bool>,
    nodes: u64,
}

impl All {
    /// Returns none of a file's pages.
    fn none_of(hierarchy: &Hierarchy) -> Self {
        let holds = vec![false; hierarchy.page_count() as usize];
        Self { pages: Vec::new(), holds, nodes: 0 }
    }

    /// Adds a page and the pages above it, which may be on other pages of the directory.
    fn add(&mut self, hierarchy: &Hierarchy, page: u32, summary: Summary) -> Result<()> {
        let mut rest = vec![(page, summary)];
        while let Some((page, summary)) = rest.pop() {
            if std::mem::replace(&mut self.holds[page as usize], true) {
                continue;
            }
            for above in summary.parents.clone().filter(|above| !self.holds[*above as usize]) {
                // The pages of a directory in parts that have not come yet list no page.
                if let Some(entry) = there(hierarchy.entry(above))? {
                    rest.push((above, Summary::of(&entry)));
                }
            }
            self.nodes += u64::from(summary.nodes);
            self.pages.push((page, summary));
        }
        Ok(())
    }

    /// Returns the pages by descending size of the nodes that they refine, each after the pages of
    /// its parents.
    fn in_order(mut self) -> Vec<Needed> {
        // Parents are on earlier pages.
        self.pages.sort_unstable_by_key(|(page, _)| *page);
        let mut sizes = vec![f32::INFINITY; self.holds.len()];
        for (page, summary) in &self.pages {
            let above = summary.parents.clone().map(|above| sizes[above as usize]);
            sizes[*page as usize] = above.fold(summary.size, f32::min);
        }
        let size = |page: u32| sizes[page as usize];
        let order = |(a, _): &(u32, Summary), (b, _): &(u32, Summary)| {
            size(*b).total_cmp(&size(*a)).then(a.cmp(b))
        };
        self.pages.sort_unstable_by(order);
        let needed = |(page, summary): (u32, Summary)| Needed { page, nodes: summary.nodes };
        self.pages.into_iter().map(needed).collect()
    }
}

/// Returns the pages whose bounds pass, if those around them do, with all pages above them. Stops
/// when they have more than `most` nodes.
fn search(
    hierarchy: &Hierarchy,
    around: impl Fn(&CutSphere) -> bool + Sync,
    wanted: impl Fn(&CutSphere) -> bool + Sync,
    most: u64,
) -> Result<All> {
    let mut all = All::none_of(hierarchy);
    hierarchy.visit(around, |runs| {
        let of_run = |(first, entries): &(u32, std::sync::Arc<[PageEntry]>)| {
            let test = |(page, entry): &(u32, &PageEntry)| *page == 0 || wanted(&parents_of(entry));
            let passing = (*first..).zip(entries.iter()).filter(test);
            passing.map(|(page, entry)| (page, Summary::of(entry))).collect::<Vec<_>>()
        };
        let passing: Vec<Vec<(u32, Summary)>> = runs.par_iter().map(of_run).collect();
        for (page, summary) in passing.into_iter().flatten() {
            all.add(hierarchy, page, summary)?;
            if all.nodes > most {
                return Ok(false);
            }
        }
        Ok(true)
    })?;
    Ok(all)
}

/// Returns a sphere around the spheres of all parents of a page's nodes, with their largest size.
fn parents_of(entry: &PageEntry) -> CutSphere {
    CutSphere {
        center: entry.parents_center,
        radius: entry.parents_radius,
        size: entry.largest_parent_size,
    }
}

/// Returns bounds around the parents of `count` successive nodes of a page: if the bounds are not
/// refined, no parent is. `None` if one of the nodes is a root, which is always tested.
pub fn parents_around(page: &Page, first: usize, count: usize) -> Option<CutSphere> {
    let end = (first + count).min(page.nodes.len());
    let parents: Option<Vec<&CutSphere>> =
        page.parent[first..end].iter().map(|parent| page.parents.get(*parent as usize)).collect();
    let parents = parents?;
    let centers = || parents.iter().map(|parent| Vec3::from(parent.center));
    let low = centers().fold(Vec3::INFINITY, Vec3::min);
    let high = centers().fold(Vec3::NEG_INFINITY, Vec3::max);
    let center = low.midpoint(high);
    let reach = |parent: &&CutSphere| Vec3::from(parent.center).distance(center) + parent.radius;
    Some(CutSphere {
        center: center.to_array(),
        radius: parents.iter().map(reach).fold(0.0, f32::max) * ROOM,
        size: (parents.iter().map(|parent| parent.size).fold(0.0, f32::max) * ROOM).min(f32::MAX),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        hierarchy::testing::{Random, joined, surface},
        math::{Camera, Projection},
    };
    use glam::DVec3;

    /// The pages of a cut, found by a test of each.
    fn of_all(hierarchy: &Hierarchy, cut: &Cut) -> Vec<u32> {
        let entries: Vec<PageEntry> =
            (0..hierarchy.page_count()).map(|page| hierarchy.entry(page).unwrap()).collect();
        let mut sizes: Vec<f32> = Vec::new();
        for entry in &entries {
            let above = entry.parent_pages.clone().map(|above| sizes[above as usize]);
            sizes.push(above.fold(entry.largest_parent_size, f32::min));
        }
        let is_needed = |entry: &PageEntry| cut.may_refine(&parents_of(entry));
        let mut needed: Vec<bool> = entries.iter().map(is_needed).collect();
        needed[0] = true;
        for page in (0..entries.len()).rev() {
            if needed[page] {
                entries[page].parent_pages.clone().for_each(|above| needed[above as usize] = true);
            }
        }
        let mut order: Vec<u32> =
            (0..entries.len() as u32).filter(|p| needed[*p as usize]).collect();
        order.sort_by(|a, b| sizes[*b as usize].total_cmp(&sizes[*a as usize]).then(a.cmp(b)));
        order
    }

    #[test]
    fn the_pages_of_a_cut_are_those_of_a_test_of_each() {
        // Blocks are slices across x. Of a long surface they are small, and seen one by one.
        let mut splats = surface(6_000, 3);
        splats.iter_mut().for_each(|splat| splat.center[0] *= 40.0);
        let tree = joined(&splats, 1_200);
        let origin = tree.origin;
        let hierarchy = Hierarchy::from_tree(tree).unwrap();
        assert!(hierarchy.page_count() > 1_024);
        let (bounds, mut random) = (hierarchy.bounds(), Random(5));
        let (mut least, mut most) = (usize::MAX, 0);
        for number in 0..200 {
            let mut next = || random.next() * 2.0 - 1.0;
            let away = DVec3::new(next(), next(), next()) * bounds.diagonal();
            let mut camera = Camera::framing(&bounds, away, DVec3::new(0.1, 0.2, 1.0), 1.0);
            camera.position = bounds.center() + away * (0.1 + random.next());
            if number % 3 == 0 {
                let height = bounds.diagonal() * random.next();
                camera.projection = Projection::Orthographic { height };
            }
            let view = camera.view([100, 60]).unwrap();
            let cut = Cut::new(&view, origin, [0.0, 0.5, 2.0, 16.0][number % 4], false);
            let pages: Vec<u32> =
                needed(&hierarchy, &cut).unwrap().iter().map(|needed| needed.page).collect();
            assert_eq!(pages, of_all(&hierarchy, &cut), "{number}");
            (least, most) = (least.min(pages.len()), most.max(pages.len()));
        }
        assert!(least < 20 && most > 600, "{least} to {most}");
        let coarse = coarsest(&hierarchy, 50).unwrap();
        let all = of_all(
            &hierarchy,
            &Cut::new(
                &Camera::framing(&bounds, DVec3::X, DVec3::Z, 1.0).view([1000; 2]).unwrap(),
                origin,
                0.0,
                false,
            ),
        );
        assert_eq!(all.len(), hierarchy.page_count() as usize);
        assert!(coarse.iter().map(|needed| needed.page).eq(all[..50].iter().copied()));
    }
}
