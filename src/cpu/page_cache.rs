//! The cache of a hierarchy's pages, and the nodes of these pages that a view draws.

use super::{
    footprint::Record,
    nodes::{Drawn, Nodes},
    plan::Plan,
    project::Projector,
    spare::{Spare, spare_for},
    vector::lanes,
};
use crate::{
    Result,
    gaussians::Eye,
    hierarchy::{
        Cut, Hierarchy, SHARE_UNIT,
        file::Page,
        needed::{self, needed},
    },
    math::{Pose, View},
    parallel::prelude::*,
    plan::source::Source,
    scene::Settings,
    splat::Splat,
};
use fearless_simd::{Level, Simd};
use std::{collections::HashMap, sync::Arc};

/// Number of steps between cuts a factor of two apart, in the search for a cut with a given number
/// of splats.
const STEPS: f64 = 8.0;

/// Number of pages read together.
const BATCH: usize = 64;

/// The nodes of a page, and the last picture that needed them.
#[derive(Debug)]
struct Held {
    nodes: Nodes,
    last_needed: u64,
}

#[derive(Debug)]
pub struct PageCache {
    pub hierarchy: Arc<Hierarchy>,
    /// Where the hierarchy is moved to.
    pub pose: Pose,
    held: HashMap<u32, Held>,
    /// The pages that take part in the last view, in order.
    active: Vec<u32>,
    frame: u64,
    /// Number of pages that the last view needed but that did not fit.
    pub missing: usize,
}

impl PageCache {
    pub fn new(hierarchy: &Arc<Hierarchy>) -> Self {
        Self {
            hierarchy: hierarchy.clone(),
            pose: Pose::IDENTITY,
            held: HashMap::new(),
            active: Vec::new(),
            frame: 0,
            missing: 0,
        }
    }

    fn cut(&self, view: &View, settings: &Settings, pixels: f64) -> Cut {
        let header = self.hierarchy.header();
        let view = &self.pose.view(view);
        let culls = settings.culls(header.closed, &header.bounds, view);
        let region = settings.region.map(|region| self.pose.inverse().bounds(&region.bounds));
        Cut::new(view, header.origin, pixels, culls).within(header.origin, region)
    }

    pub fn bytes(&self) -> u64 {
        self.held.values().map(|held| held.nodes.bytes()).sum()
    }

    /// Reads the pages that a cut needs, coarse ones first, as many as fit into the settings'
    /// memory.
    pub fn update(&mut self, view: &View, settings: &Settings, pixels: f64) -> Result<()> {
        self.frame += 1;
        let cut = self.cut(view, settings, pixels);
        let mut wanted = needed(&self.hierarchy, &cut)?;
        let degree = self.hierarchy.header().degree;
        let mut room = settings.controls.page_memory;
        let (mut most, mut absent, mut more) = (0, Vec::new(), 0);
        for entry in &wanted {
            let bytes = Nodes::bytes_of(entry.nodes as usize, degree);
            if bytes > room && most > 0 {
                break;
            }
            room = room.saturating_sub(bytes);
            most += 1;
            if !self.held.contains_key(&entry.page) {
                absent.push(entry.page);
                more += bytes;
            }
        }
        self.missing = wanted.len() - most;
        wanted.truncate(most);
        let order: Vec<u32> = wanted.into_iter().map(|entry| entry.page).collect();
        let mut needed = order.clone();
        needed.sort_unstable();
        self.make_room(&needed, more, settings.controls.page_memory);
        for batch in absent.chunks(BATCH) {
            let pages = self.hierarchy.read_there(batch)?;
            let held = |page: &Option<Page>| {
                let nodes = Nodes::new(page.as_ref()?);
                Some(Held { nodes, last_needed: self.frame })
            };
            let held: Vec<Option<Held>> = pages.par_iter().map(held).collect();
            let held = batch.iter().zip(held).filter_map(|(page, held)| Some((*page, held?)));
            self.held.extend(held);
        }
        if self.hierarchy.is_in_parts() {
            needed = self.hierarchy.closed(order, |page| self.held.contains_key(&page))?;
            needed.sort_unstable();
        }
        for page in &needed {
            if let Some(held) = self.held.get_mut(page) {
                held.last_needed = self.frame;
            }
        }
        self.active = needed;
        Ok(())
    }

    /// Evicts the least recently needed pages, so that `more` bytes fit. `needed` are sorted.
    fn make_room(&mut self, needed: &[u32], more: u64, most: u64) {
        let mut held = self.bytes();
        if held + more <= most {
            return;
        }
        let mut others: Vec<(u64, u32)> = self
            .held
            .iter()
            .filter(|(page, _)| needed.binary_search(page).is_err())
            .map(|(page, held)| (held.last_needed, *page))
            .collect();
        others.sort_unstable();
        for (_, page) in others {
            if held + more <= most {
                return;
            }
            if let Some(dropped) = self.held.remove(&page) {
                held -= dropped.nodes.bytes();
            }
        }
    }

    /// Returns the records of the splats that a cut draws, page by page. Each splat has its share
    /// of its optical depth.
    pub fn records(
        &self,
        plan: &Plan,
        settings: &Settings,
        pixels: f64,
        spare: &mut Spare,
    ) -> Vec<Vec<Record>> {
        let (level, cut) = (Level::new(), self.cut(plan.view, settings, pixels));
        let (header, view) = (self.hierarchy.header(), self.pose.view(plan.view));
        let source = Source::of_nodes(&view, header);
        let (projector, eye) = (Projector::new(plan, source), Eye::of(&view));
        let mut records = spare_for(spare, self.active.len());
        records.par_iter_mut().zip(&self.active).for_each(|(records, page)| {
            let Some(Held { nodes, .. }) = self.held.get(page) else { return };
            let drawn: Vec<Drawn> = lanes!(level, simd => self.drawn_of(simd, &cut, nodes));
            if nodes.colors.is_some() {
                let seen = |node: &Drawn| nodes.seen(*node, eye, header.origin);
                let seen: Vec<Splat> = drawn.iter().map(seen).collect();
                let whole = seen.iter().map(|splat| (splat, 1.0));
                lanes!(level, simd => projector.add(simd, whole, records));
                return;
            }
            let splat = |(node, share): &Drawn| {
                (&nodes.splats[*node as usize], *share * (1.0 / SHARE_UNIT as f32))
            };
            lanes!(level, simd => projector.add(simd, drawn.iter().map(splat), records));
        });
        records
    }

    #[inline(always)]
    fn drawn_of<S: Simd>(&self, simd: S, cut: &Cut, nodes: &Nodes) -> Vec<Drawn> {
        nodes.drawn(simd, cut, |page| self.active.binary_search(&page).is_ok())
    }

    /// Returns the number of splats that a cut of the cached pages draws.
    pub fn count(&self, view: &View, settings: &Settings, pixels: f64) -> u64 {
        let (level, cut) = (Level::new(), self.cut(view, settings, pixels));
        let of = |page: &u32| {
            let Some(Held { nodes, .. }) = self.held.get(page) else { return 0 };
            lanes!(level, simd => self.drawn_of(simd, &cut, nodes).len() as u64)
        };
        self.active.par_iter().map(of).sum()
    }

    /// Returns the finest cut, in pixels, whose pages contain no more than `most` nodes.
    pub fn finest_pages(&self, view: &View, settings: &Settings, most: u64) -> Result<f64> {
        let cut = |pixels| self.cut(view, settings, pixels);
        needed::finest_within(&self.hierarchy, most, cut)
    }
}

/// Returns the finest cut of several hierarchies that draws no more than `most` splats in total.
/// The pages for the cut are then cached.
pub fn finest_within(
    caches: &mut [&mut PageCache],
    view: &View,
    settings: &Settings,
    most: u64,
) -> Result<f64> {
    // The pages of a cut contain several times the nodes that it draws.
    let nodes = most.saturating_mul(8).max(1 << 16);
    let mut pages = 0.0f64;
    for cache in caches.iter() {
        pages = pages.max(cache.finest_pages(view, settings, nodes)?);
    }
    for cache in caches.iter_mut() {
        cache.update(view, settings, pages)?;
    }
    let count =
        |pixels: f64| caches.iter().map(|cache| cache.count(view, settings, pixels)).sum::<u64>();
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
