//! The pages of a hierarchy that are at hand, and the nodes of them that a view draws.

use crate::{
    Result,
    hierarchy::{
        Cut, CutSphere, Hierarchy,
        file::{NO_PAGE, Page},
        needed::{Needed, parents_around},
    },
    math::View,
    scene::Settings,
    splat::Splat,
};
use rayon::prelude::*;
use std::{collections::HashMap, sync::Arc};

/// Nodes whose parents are looked at together.
const RUN: usize = 64;
/// Cuts a factor of two apart are tried in so many steps where a number of splats is asked for.
const STEPS: f64 = 8.0;

/// A page, and for each run of its nodes what bounds their parents: where that is not refined, none of them is drawn.
#[derive(Debug)]
struct Held {
    page: Page,
    parents: Vec<Option<CutSphere>>,
    last_needed: u64,
}

#[derive(Debug)]
pub struct PageCache {
    pub hierarchy: Arc<Hierarchy>,
    needed: Needed,
    held: HashMap<u32, Held>,
    /// The pages that take part in the last view, in order.
    active: Vec<u32>,
    frame: u64,
    /// Pages that the last view needed and that found no room.
    pub missing: usize,
}

impl PageCache {
    pub fn new(hierarchy: &Arc<Hierarchy>) -> Self {
        Self {
            needed: Needed::new(hierarchy),
            hierarchy: hierarchy.clone(),
            held: HashMap::new(),
            active: Vec::new(),
            frame: 0,
            missing: 0,
        }
    }

    fn cut(&self, view: &View, settings: &Settings, pixels: f64) -> Cut {
        let header = self.hierarchy.header();
        Cut::new(view, header.origin, pixels, settings.culls(header.closed, &header.bounds, view))
    }

    /// Bytes of a page's nodes at most.
    fn page_bytes(page: &Page) -> u64 {
        let nodes = page.nodes.len() as u64;
        nodes * (size_of::<crate::hierarchy::Node>() as u64 + 8) + (page.parents.len() * size_of::<CutSphere>()) as u64
    }

    pub fn bytes(&self) -> u64 {
        self.held.values().map(|held| Self::page_bytes(&held.page)).sum()
    }

    /// Reads the pages that a cut needs, as many as the settings' memory holds; the coarse ones first.
    pub fn update(&mut self, view: &View, settings: &Settings, pixels: f64) -> Result<()> {
        self.frame += 1;
        let cut = self.cut(view, settings, pixels);
        let mut needed = self.needed.of(&self.hierarchy, &cut);
        let entries = self.hierarchy.pages();
        let bytes_of = |page: u32| u64::from(entries[page as usize].nodes) * size_of::<crate::hierarchy::Node>() as u64;
        let mut room = settings.page_memory;
        let mut most = 0;
        for &page in &needed {
            let bytes = bytes_of(page);
            if bytes > room && most > 0 {
                break;
            }
            room = room.saturating_sub(bytes);
            most += 1;
        }
        self.missing = needed.len() - most;
        needed.truncate(most);
        let absent: Vec<u32> = needed.iter().copied().filter(|page| !self.held.contains_key(page)).collect();
        self.make_room(&needed, absent.iter().map(|&page| bytes_of(page)).sum(), settings.page_memory);
        let read = |&page: &u32| {
            let page_read = self.hierarchy.read_page(page)?;
            let runs = 0..page_read.nodes.len().div_ceil(RUN);
            let parents = runs.map(|run| parents_around(&page_read, run * RUN, RUN)).collect();
            Ok((page, Held { page: page_read, parents, last_needed: self.frame }))
        };
        let read: Vec<(u32, Held)> = absent.par_iter().map(read).collect::<Result<_>>()?;
        self.held.extend(read);
        for page in &needed {
            if let Some(held) = self.held.get_mut(page) {
                held.last_needed = self.frame;
            }
        }
        needed.sort_unstable();
        self.active = needed;
        Ok(())
    }

    /// Drops the pages that no view needed for longest, so that more fit.
    fn make_room(&mut self, needed: &[u32], more: u64, most: u64) {
        let mut held = self.bytes();
        if held + more <= most {
            return;
        }
        let mut others: Vec<(u64, u32)> = self
            .held
            .iter()
            .filter(|(page, _)| !needed.contains(page))
            .map(|(page, held)| (held.last_needed, *page))
            .collect();
        others.sort_unstable();
        for (_, page) in others {
            if held + more <= most {
                return;
            }
            if let Some(dropped) = self.held.remove(&page) {
                held -= Self::page_bytes(&dropped.page);
            }
        }
    }

    /// The splats that a cut draws, each with its share of its optical depth, in the order of the pages.
    pub fn drawn(&self, view: &View, settings: &Settings, pixels: f64) -> Vec<Splat> {
        let cut = self.cut(view, settings, pixels);
        let own: Vec<Vec<Splat>> = self.active.par_iter().map(|page| self.drawn_of(&cut, *page)).collect();
        own.concat()
    }

    fn drawn_of(&self, cut: &Cut, page: u32) -> Vec<Splat> {
        let mut drawn = Vec::new();
        self.shares_of(cut, page, |splat, share| {
            let strength = splat.strength * (share as f32 / crate::hierarchy::SHARE_UNIT as f32);
            drawn.push(Splat { strength, ..*splat });
        });
        drawn
    }

    /// Hands on the splats of a page that a cut draws, with their shares.
    fn shares_of(&self, cut: &Cut, page: u32, mut draw: impl FnMut(&Splat, u32)) {
        let Some(Held { page, parents, .. }) = self.held.get(&page) else { return };
        let is_active = |child: u32| child != NO_PAGE && self.active.binary_search(&child).is_ok();
        let mut last_child = (NO_PAGE, false);
        for (run, around) in parents.iter().enumerate() {
            if around.as_ref().is_some_and(|around| cut.refinement(around) == 0) {
                continue;
            }
            let nodes = run * RUN..((run + 1) * RUN).min(page.nodes.len());
            for index in nodes {
                let child = page.child_pages[index];
                if child != last_child.0 {
                    last_child = (child, is_active(child));
                }
                let parent = page.parents.get(page.parent[index] as usize);
                let mut node = page.nodes[index];
                if page.is_portal(index) {
                    // It gives way to its block wherever that is at hand.
                    node.size = f32::MAX;
                }
                let share = cut.share(&node, parent, last_child.1);
                if share > 0 {
                    draw(&page.nodes[index].splat, share);
                }
            }
        }
    }

    /// How many splats a cut of what is at hand draws.
    pub fn count(&self, view: &View, settings: &Settings, pixels: f64) -> u64 {
        let cut = self.cut(view, settings, pixels);
        let of = |page: &u32| {
            let mut count = 0;
            self.shares_of(&cut, *page, |_, _| count += 1);
            count
        };
        self.active.par_iter().map(of).sum()
    }

    /// The finest cut, in pixels, whose pages hold no more than `most` nodes.
    pub fn finest_pages(&self, view: &View, settings: &Settings, most: u64) -> f64 {
        self.needed.finest_within(&self.hierarchy, most, |pixels| self.cut(view, settings, pixels))
    }
}

/// The finest cut of some hierarchies that draws no more than `most` splats of them together; pages are at hand for it.
pub fn finest_within(caches: &mut [&mut PageCache], view: &View, settings: &Settings, most: u64) -> Result<f64> {
    // The pages of a cut hold several times what it draws.
    let nodes = most.saturating_mul(8).max(1 << 16);
    let pages = caches.iter().map(|cache| cache.finest_pages(view, settings, nodes)).fold(0.0, f64::max);
    for cache in caches.iter_mut() {
        cache.update(view, settings, pages)?;
    }
    let count = |pixels: f64| caches.iter().map(|cache| cache.count(view, settings, pixels)).sum::<u64>();
    if count(pages) <= most {
        return Ok(pages);
    }
    let (mut fine, mut coarse) = (-8.0 * STEPS, 24.0 * STEPS);
    while coarse - fine > 1.0 {
        let middle = ((fine + coarse) * 0.5f64).floor();
        *(if count((middle / STEPS).exp2()) <= most { &mut coarse } else { &mut fine }) = middle;
    }
    Ok(pages.max((coarse / STEPS).exp2()))
}
