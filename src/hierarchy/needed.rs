//! Which pages of a hierarchy a view may need.

use super::{
    Cut, CutSphere, Hierarchy,
    file::{Page, PageEntry},
};
use crate::parallel::prelude::*;
use glam::Vec3;

/// Margin for rounding in the bounds of several nodes.
const ROOM: f32 = 1.00001;

/// The order in which the pages of a hierarchy are loaded.
#[derive(Debug)]
pub struct Needed {
    /// All pages, coarse ones first.
    order: Vec<u32>,
}

impl Needed {
    pub fn new(hierarchy: &Hierarchy) -> Self {
        Self { order: hierarchy.coarse_first() }
    }

    /// Returns the pages that a cut may need and all pages above them, coarse ones first.
    pub fn of(&self, hierarchy: &Hierarchy, cut: &Cut) -> Vec<u32> {
        let pages = hierarchy.pages();
        let test = |(page, entry): (usize, &PageEntry)| {
            hierarchy.is_present(page as u32) && (page == 0 || cut.may_refine(&parents_of(entry)))
        };
        let mut needed: Vec<bool> =
            pages.par_iter().enumerate().with_min_len(1 << 10).map(test).collect();
        for index in (0..pages.len()).rev() {
            if needed[index] {
                for parent in pages[index].parent_pages.clone() {
                    needed[parent as usize] = true;
                }
            }
        }
        self.order.iter().copied().filter(|&page| needed[page as usize]).collect()
    }

    /// Returns the finest cut, as a width in pixels, whose pages contain at most `most` nodes.
    pub fn finest_within(&self, hierarchy: &Hierarchy, most: u64, cut: impl Fn(f64) -> Cut) -> f64 {
        let pages = hierarchy.pages();
        let nodes = |pixels: f64| {
            let needed = self.of(hierarchy, &cut(pixels));
            needed.iter().map(|&page| u64::from(pages[page as usize].nodes)).sum::<u64>()
        };
        if nodes(0.0) <= most {
            return 0.0;
        }
        let (mut fine, mut coarse) = (-10.0f64, 16.0f64);
        for _ in 0..12 {
            let middle = (fine + coarse) * 0.5;
            *(if nodes(middle.exp2()) <= most { &mut coarse } else { &mut fine }) = middle;
        }
        coarse.exp2()
    }
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
