//! Checks a file for damage.

use super::{
    entry::{self, Listing, PageEntry},
    pages::{Run, in_order, parents},
    read::{Hierarchy, hash_start},
    write::arounds,
};
use crate::{
    Error,
    container::{Finding, Findings, Report, directory::Place},
    hierarchy::{
        Node,
        validate::{Footprints, check_block, check_portals},
    },
    input::Limits,
    splat::NO_NORMAL,
};
use std::path::Path;

/// Checks a file: header, directory, every checksum and the hash, then every invariant of the tree
/// ([`validate`](crate::hierarchy::validate())) block by block. One block is in memory at a time.
///
/// This never fails: a file that cannot be opened is a finding.
pub fn check(path: impl AsRef<Path>, limits: &Limits) -> Report {
    let mut findings = Findings::default();
    match Hierarchy::open(path, limits) {
        Ok(hierarchy) => return hierarchy.check(),
        Err(error) => findings.push(finding("open", &error)),
    }
    Report { findings: findings.finish() }
}

impl Hierarchy {
    /// The same as [`check`](check()), for a file or bytes already opened. For a tree in memory see
    /// [`validate`](crate::hierarchy::validate()).
    pub fn check(&self) -> Report {
        let mut findings = Findings::default();
        contents(self, &mut findings);
        Report { findings: findings.finish() }
    }
}

/// Checks the hash of a whole file.
fn hash(hierarchy: &Hierarchy, findings: &mut Findings) {
    let Some(bytes) = hierarchy.bytes() else { return };
    let Some(start) = hash_start(bytes.len()) else { return };
    match bytes.is_hashed(start) {
        Ok(true) => {}
        Ok(false) => {
            let message = "the hash of the whole file does not match";
            findings.push(Finding::error("hash", format!("byte {start}"), message));
        }
        Err(error) => findings.push(finding("hash", &error)),
    }
}

fn contents(hierarchy: &Hierarchy, findings: &mut Findings) {
    hash(hierarchy, findings);
    let mut all = Contents {
        roots: Vec::new(),
        top: Top::default(),
        footprints: Footprints::new(hierarchy.header().extent),
        counts: Counts::default(),
        is_whole: directory(hierarchy, findings),
    };
    let mut page = 0;
    while page < hierarchy.page_count() {
        let entries = match hierarchy.block_from(page) {
            Ok(entries) => entries,
            Err(error) => {
                findings.push(finding("directory", &error));
                return;
            }
        };
        if let Err(error) = block(hierarchy, page, &entries, &mut all, findings) {
            all.is_whole = false;
            findings.push(finding("page", &error));
            if page > 0 {
                all.roots.push((Some(entries[0].portal), None));
            }
        }
        page += entries.len() as u32;
    }
    whole(hierarchy, &all, findings);
}

/// What is known of a file after its blocks.
struct Contents {
    roots: Vec<(Option<u32>, Option<Node>)>,
    top: Top,
    footprints: Footprints,
    counts: Counts,
    /// Whether everything could be read.
    is_whole: bool,
}

/// The block that joins the others.
#[derive(Default)]
struct Top {
    nodes: Vec<Node>,
    entries: Vec<PageEntry>,
    parents: Vec<Option<u32>>,
    /// The page that each portal states, if portals state it.
    links: Vec<u32>,
}

#[derive(Default)]
struct Counts {
    blocks: u32,
    nodes: u64,
    leaves: u64,
    has_normals: bool,
}

/// Checks the directory pages. Returns whether all can be read.
fn directory(hierarchy: &Hierarchy, findings: &mut Findings) -> bool {
    let mut is_whole = true;
    let wrong = &mut |fault| {
        is_whole = false;
        findings.push(finding("directory", &hierarchy.fault(fault)));
    };
    hierarchy.directory().check(hierarchy.bytes(), wrong);
    is_whole
}

/// Checks a block, whose first page is `first`, and adds it to what is known of the file.
fn block(
    hierarchy: &Hierarchy,
    first: u32,
    entries: &[PageEntry],
    all: &mut Contents,
    findings: &mut Findings,
) -> Result<(), Error> {
    let number = all.counts.blocks;
    all.counts.blocks += 1;
    let nodes = hierarchy.read_block(first, entries)?.nodes;
    all.counts.nodes += nodes.len() as u64;
    let has_portals = number == 0 && hierarchy.is_joined();
    let footprints = (!has_portals).then_some(&mut all.footprints);
    check_block(number as usize, &nodes, footprints, findings);
    check_entries(number, first, entries, &nodes, &all.top, findings);
    if has_portals {
        for (page, entry) in (first..).zip(entries) {
            all.top.links.extend(hierarchy.links(page, entry)?.into_iter().flatten());
        }
        all.top.parents = parents(&nodes);
        (all.top.entries, all.top.nodes) = (entries.to_vec(), nodes);
        return Ok(());
    }
    let drawn = nodes.iter().filter(|node| node.is_leaf());
    all.counts.leaves += drawn.clone().count() as u64;
    all.counts.has_normals |= drawn.clone().any(|node| node.splat.normal != NO_NORMAL);
    if number > 0 {
        let portal = entries[0].portal;
        all.roots.push((Some(portal), nodes.first().copied()));
        let link = all.top.links.get(portal as usize);
        if link.is_some_and(|link| *link != first) {
            let message = format!("the portal at node {portal} of block 0 states another page");
            findings.push(Finding::error("portal", format!("page {first}"), message));
        }
    }
    Ok(())
}

/// Checks what blocks are together.
fn whole(hierarchy: &Hierarchy, all: &Contents, findings: &mut Findings) {
    let Contents { roots, top, footprints, counts, is_whole } = all;
    if !top.nodes.is_empty() {
        let roots: Vec<_> = roots.iter().map(|(portal, root)| (*portal, root.as_ref())).collect();
        check_portals(&top.nodes, None, &roots, findings);
    }
    if !is_whole {
        return;
    }
    let header = hierarchy.header();
    for (what, stated, counted) in [
        ("leaves", header.leaves, counts.leaves),
        ("nodes", header.nodes, counts.nodes),
        ("blocks", u64::from(hierarchy.block_count()), u64::from(counts.blocks)),
    ] {
        if stated != counted {
            let message = format!("it states {stated} {what}, but there are {counted}");
            findings.push(Finding::error("counts", "header", message));
        }
    }
    footprints.check_box(header.origin, &header.bounds, "header", findings);
    if counts.has_normals != header.has_normals {
        findings.push(Finding::error("attributes", "header", "its flag for normals is wrong"));
    }
    let Listing { start, end, .. } = *hierarchy.directory().kind();
    if let Some(file) = hierarchy.bytes()
        && !hierarchy.directory().fills(file, start..end)
    {
        let message = "pages overlap, or leave gaps between them";
        findings.push(Finding::error("directory", "file", message));
    }
}

/// Checks the directory's entries for the pages of a block, of which `first` is the first.
fn check_entries(
    number: u32,
    first: u32,
    stated: &[PageEntry],
    nodes: &[Node],
    top: &Top,
    findings: &mut Findings,
) {
    let portal = stated[0].portal;
    let is_below = number > 0 && (portal as usize) < top.parents.len();
    if in_order(nodes).is_err() || number > 0 && !is_below {
        return;
    }
    let runs = runs(stated, nodes);
    let places: Vec<Place> = stated.iter().map(|entry| entry.place).collect();
    let mut wanted = entry::of_block(number, first, &runs, &arounds(nodes, &runs), &places);
    if is_below {
        wanted.iter_mut().for_each(|entry| entry.portal = portal);
        entry::hang(&mut wanted[0], &top.entries, &top.nodes, &top.parents);
    }
    let offset = |page: u32| match page.checked_sub(first) {
        Some(index) => stated.get(index as usize).map(|entry| entry.place.offset),
        None => top.entries.get(page as usize).map(|entry| entry.place.offset),
    };
    for ((page, entry), wanted) in (first..).zip(stated).zip(wanted) {
        let place = || format!("page {page}");
        if *entry != wanted {
            let message = format!("its nodes have the entry {wanted:?}, but it states {entry:?}");
            findings.push(Finding::error("directory", place(), message));
        }
        let above = entry.parent_pages.clone().filter_map(offset);
        if above.max().is_some_and(|above| above > entry.place.offset) {
            let message = "it comes before a page of its nodes' parents";
            findings.push(Finding::error("order", place(), message));
        }
    }
}

/// Returns the pages of a block whose nodes are in order, as its entries divide it.
fn runs(stated: &[PageEntry], nodes: &[Node]) -> Vec<Run> {
    let parents = parents(nodes);
    let parent = |node: usize| parents.get(node).copied().flatten().unwrap_or(0) as usize;
    let (mut start, mut child) = (0, 1);
    let run = |entry: &PageEntry| {
        let range = start..(start + entry.nodes as usize).min(nodes.len());
        let children: usize = nodes[range.clone()].iter().map(|node| node.children as usize).sum();
        let run = Run {
            parents: parent(range.start)..parent(range.end.saturating_sub(1)) + 1,
            children: child..child + children,
            nodes: range,
        };
        (start, child) = (run.nodes.end, run.children.end);
        run
    };
    stated.iter().map(run).collect()
}

fn finding(code: &'static str, error: &Error) -> Finding {
    match error {
        Error::Input { place, message, .. } => Finding::error(code, place.clone(), message.clone()),
        other => Finding::error(code, "file", other.to_string()),
    }
}
