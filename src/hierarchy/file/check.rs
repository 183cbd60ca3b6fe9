//! Checks a file for damage.

use super::{
    directory::{NO_PORTAL, PageEntry},
    pages::{Around, in_order, pages, parents},
    read::{Hierarchy, hash_start},
    write::arounds,
};
use crate::{
    Error,
    container::Report,
    container::{Finding, Findings},
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

fn contents(hierarchy: &Hierarchy, findings: &mut Findings) {
    let bytes = hierarchy.bytes();
    if let Some(start) = hash_start(bytes) {
        let found = blake3::hash(&bytes[..start]);
        if bytes[start..] != *found.as_bytes() {
            let message = "the hash of the whole file does not match";
            findings.push(Finding::error("hash", format!("byte {start}"), message));
        }
    }
    let directory = hierarchy.directory();
    let mut roots: Vec<(Option<u32>, Option<Node>)> = Vec::new();
    let mut top = Vec::new();
    let mut leaves = 0;
    let mut has_normals = false;
    let mut footprints = Footprints::new(hierarchy.header().extent);
    for (number, entry) in directory.blocks.iter().enumerate() {
        let block = match hierarchy.read_block(number as u32) {
            Ok(block) => block,
            Err(error) => {
                findings.push(finding("page", &error));
                if number > 0 {
                    roots.push((Some(entry.portal), None));
                }
                continue;
            }
        };
        let has_portals = number == 0 && hierarchy.is_joined();
        check_block(number, &block.nodes, (!has_portals).then_some(&mut footprints), findings);
        let first = entry.first_page as usize;
        let stated = &directory.pages[first..first + entry.pages as usize];
        check_entries(first, stated, &block.nodes, &top, entry.portal, findings);
        if has_portals {
            top = block.nodes;
            continue;
        }
        let drawn = block.nodes.iter().filter(|node| node.is_leaf());
        leaves += drawn.clone().count() as u64;
        has_normals |= drawn.clone().any(|node| node.splat.normal != NO_NORMAL);
        if number > 0 {
            roots.push((Some(entry.portal), block.nodes.first().copied()));
        }
    }
    if !top.is_empty() {
        let roots: Vec<_> = roots.iter().map(|(portal, root)| (*portal, root.as_ref())).collect();
        check_portals(&top, None, &roots, findings);
    }
    let header = hierarchy.header();
    let is_whole = roots.iter().all(|(_, root)| root.is_some());
    if is_whole && leaves != header.leaves {
        let message = format!("it states {} leaves, but there are {leaves}", header.leaves);
        findings.push(Finding::error("counts", "header", message));
    }
    if is_whole {
        footprints.check_box(header.origin, &header.bounds, "header", findings);
    }
    if is_whole && has_normals != header.has_normals {
        findings.push(Finding::error("attributes", "header", "its flag for normals is wrong"));
    }
}

/// Checks the directory's entries for the pages of a block.
fn check_entries(
    first: usize,
    stated: &[PageEntry],
    nodes: &[Node],
    top: &[Node],
    portal: u32,
    findings: &mut Findings,
) {
    if in_order(nodes).is_err() {
        return;
    }
    let runs = pages(nodes);
    let around = arounds(nodes, &runs);
    if runs.len() != stated.len() {
        let message = format!("its nodes fill {} pages, but it has {}", runs.len(), stated.len());
        findings.push(Finding::error("directory", format!("page {first}"), message));
        return;
    }
    let above = match portal {
        NO_PORTAL => None,
        portal => parents(top).get(portal as usize).copied().flatten(),
    };
    for (index, (entry, mut wanted)) in stated.iter().zip(around).enumerate() {
        if let (0, Some(parent)) = (index, above) {
            wanted = Around::parents(&top[parent as usize..=parent as usize]);
        }
        let found = Around {
            center: entry.parents_center,
            radius: entry.parents_radius,
            largest_size: entry.largest_parent_size,
        };
        if entry.nodes as usize != runs[index].nodes.len() || found != wanted {
            let message = format!(
                "the parents of its nodes have the bounds {wanted:?}, but it states {found:?}"
            );
            findings.push(Finding::error("directory", format!("page {}", first + index), message));
        }
    }
}

fn finding(code: &'static str, error: &Error) -> Finding {
    match error {
        Error::Input { place, message, .. } => Finding::error(code, place.clone(), message.clone()),
        other => Finding::error(code, "file", other.to_string()),
    }
}
