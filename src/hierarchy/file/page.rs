//! Encodes a block as pages, and chooses the code of each.

use super::{
    bounds,
    cones::{cosine_below, joint_angle},
    lossless, lossy,
    pages::{Run, levels, pages, reach, round_up},
    quantise::Shape,
};
use crate::{
    container::pack,
    gaussians::Colors,
    hierarchy::{
        Block, MOST_CHILDREN, Node,
        merge::{WIDTH, deviation},
        validate::fault,
    },
    parallel::prelude::*,
};
use glam::Vec3;
use std::io;

/// The first byte of a page.
const LOSSLESS: u8 = 0;
const LOSSY: u8 = 1;
/// A page of either code, and its colours.
const COLORED: u8 = 2;

/// The zstd level of colours.
const LEVEL: i32 = 9;

/// An encoded block, with its nodes as a reader will decode them.
pub struct Coded {
    pub nodes: Vec<Node>,
    pub runs: Vec<Run>,
    pub pages: Vec<Vec<u8>>,
}

/// Encodes a block whose nodes are in order. Fails only without the feature `files`.
pub fn encode(block: &Block, extent: f32, is_lossless: bool) -> io::Result<Coded> {
    let nodes = &block.nodes[..];
    let order = if is_lossless { (0..nodes.len() as u32).collect() } else { line_up(nodes) };
    let mut coded = encode_nodes(nodes, &order, extent, is_lossless)?;
    if let Some(colors) = &block.colors {
        let colors = colors.chosen(order.iter().map(|node| *node as usize));
        let both = |(page, run): (&mut Vec<u8>, &Run)| -> io::Result<()> {
            let packed = pack::compress(&colors.to_bytes(run.nodes.clone()), LEVEL)?;
            let length = (page.len() as u32).to_le_bytes();
            *page = [&[COLORED], &length[..], page, &packed].concat();
            Ok(())
        };
        coded.pages.par_iter_mut().zip(&coded.runs).try_for_each(both)?;
    }
    Ok(coded)
}

/// Encodes the nodes of a block, in this order unless every bit is kept.
fn encode_nodes(
    nodes: &[Node],
    order: &[u32],
    extent: f32,
    is_lossless: bool,
) -> io::Result<Coded> {
    if is_lossless {
        let runs = pages(nodes);
        let page = |run: &Run| lossless_page(&nodes[run.nodes.clone()]);
        let pages = runs.par_iter().map(page).collect::<io::Result<_>>()?;
        return Ok(Coded { nodes: nodes.to_vec(), runs, pages });
    }
    let mut nodes = lined_up(nodes, order);
    let runs = pages(&nodes);
    let levels = levels(&nodes);
    let fine = bounds::fine_from(&nodes[0]);
    let codes = quantise(&mut nodes, &runs, extent);
    let bounds = bound(&mut nodes, &levels, fine, &codes, extent);
    let firsts = codes.iter().scan(0, |next, codes| {
        let first = *next;
        *next += codes.inner;
        Some(first)
    });
    let firsts: Vec<usize> = firsts.collect();
    let page = |((run, page), first): ((&Run, &PageCodes), &usize)| {
        let page_bounds: Option<Vec<bounds::Code>> =
            bounds[*first..*first + page.inner].iter().copied().collect();
        match (&page.codes, page_bounds) {
            (Some(codes), Some(bounds)) => {
                let mut out = vec![LOSSY];
                lossy::encode(&nodes[run.nodes.clone()], codes, &bounds, fine, &mut out);
                Ok(out)
            }
            _ => lossless_page(&nodes[run.nodes.clone()]),
        }
    };
    let pages = runs.par_iter().zip(&codes).zip(&firsts).map(page).collect::<io::Result<_>>()?;
    Ok(Coded { nodes, runs, pages })
}

fn lossless_page(nodes: &[Node]) -> io::Result<Vec<u8>> {
    let mut out = vec![LOSSLESS];
    out.extend(lossless::encode(nodes)?);
    Ok(out)
}

/// The codes of a page before its inner nodes have bounds.
struct PageCodes {
    /// `None` if the page can only be stored losslessly.
    codes: Option<lossy::Codes>,
    /// The number of inner nodes.
    inner: usize,
}

/// Replaces all splats by their decoded values.
fn quantise(nodes: &mut [Node], runs: &[Run], extent: f32) -> Vec<PageCodes> {
    let mut rest = nodes;
    let mut parts = Vec::with_capacity(runs.len());
    for run in runs {
        let (part, behind) = rest.split_at_mut(run.nodes.len());
        parts.push(part);
        rest = behind;
    }
    let page = |part: &mut [Node]| {
        let given = part.to_vec();
        let codes = lossy::quantise(part, extent);
        if codes.is_none() {
            part.copy_from_slice(&given);
        }
        PageCodes { codes, inner: part.iter().filter(|node| !node.is_leaf()).count() }
    };
    parts.into_par_iter().map(page).collect()
}

/// Returns the numbers of the nodes with siblings in a different order, each near the one before,
/// also from one group to the next. Nothing depends on the order of siblings, and short steps need
/// fewer bits.
fn line_up(nodes: &[Node]) -> Vec<u32> {
    let mut order = Vec::with_capacity(nodes.len());
    order.push(0);
    let center = |node: u32| Vec3::from(nodes[node as usize].splat.center);
    let mut last = center(0);
    for place in 0..nodes.len() {
        let Node { first_child, children, .. } = nodes[order[place] as usize];
        let start = order.len();
        order.extend(first_child..first_child + children);
        let mut left = &mut order[start..];
        while !left.is_empty() {
            let distance = |at: usize| center(left[at]).distance_squared(last);
            let mut next = (0, distance(0));
            for at in 1..left.len() {
                let away = distance(at);
                if away < next.1 {
                    next = (at, away);
                }
            }
            left.swap(0, next.0);
            last = center(left[0]);
            left = &mut left[1..];
        }
    }
    order
}

/// Returns the nodes in an order of [`line_up`].
fn lined_up(nodes: &[Node], order: &[u32]) -> Vec<Node> {
    let mut next = 1;
    let node = |number: &u32| {
        let mut node = nodes[*number as usize];
        if node.children > 0 {
            node.first_child = next;
            next += node.children;
        }
        node
    };
    order.iter().map(node).collect()
}

/// Gives all inner nodes bounds around their decoded children, level by level from below. A result
/// is `None` if the bounds can only be stored losslessly.
fn bound(
    nodes: &mut [Node],
    levels: &[usize],
    fine: i32,
    codes: &[PageCodes],
    extent: f32,
) -> Vec<Option<bounds::Code>> {
    let inner: Vec<u32> =
        (0..nodes.len() as u32).filter(|&node| !nodes[node as usize].is_leaf()).collect();
    let shapes = codes.iter().flat_map(|page| match &page.codes {
        Some(codes) => codes.shapes().map(Some).collect(),
        None => vec![None; page.inner],
    });
    let shapes: Vec<Option<(i32, Shape)>> = shapes.collect();
    let mut out = vec![None; inner.len()];
    for level in levels.windows(2).rev() {
        let place = |node: usize| inner.partition_point(|&other| (other as usize) < node);
        let some = place(level[0])..place(level[1]);
        let bounded = some.clone().into_par_iter().with_min_len(256).map(|at| {
            let mut node = nodes[inner[at] as usize];
            let first = node.first_child as usize;
            let children = &nodes[first..first + node.children as usize];
            let code = shapes[at].and_then(|(sigma, shape)| {
                let mut coded = node;
                let code = bounds::Code::encode(
                    &mut coded,
                    children,
                    &shape,
                    extent,
                    bounds::fine_step(sigma, fine, extent),
                )?;
                node = coded;
                Some(code)
            });
            if code.is_none() {
                enclose_children(&mut node, children);
            }
            (node, code)
        });
        let bounded: Vec<(Node, Option<bounds::Code>)> = bounded.collect();
        for (at, (node, code)) in some.zip(bounded) {
            nodes[inner[at] as usize] = node;
            out[at] = code;
        }
    }
    out
}

/// What a page must be decoded with.
#[derive(Debug, Clone, Copy)]
pub struct Frame {
    /// The number of nodes.
    pub nodes: usize,
    /// Where their children begin, in the block.
    pub first_child: u32,
    pub extent: f32,
    /// The degree of their colours, if they have some.
    pub degree: Option<u32>,
    /// Whether its leaves state a page, the one that replaces them.
    pub has_links: bool,
}

/// Decodes a page as [`decode`], with its colours.
pub fn decode_colored(bytes: &[u8], frame: Frame) -> Result<(Vec<Node>, Option<Colors>), String> {
    let count = frame.nodes;
    let Some(degree) = frame.degree else {
        return Ok((decode(bytes, frame)?, None));
    };
    let (&code, rest) = bytes.split_first().ok_or("it is empty")?;
    if code != COLORED {
        return Err(format!("it has the code {code}, but pages with colours have {COLORED}"));
    }
    let parts = rest
        .split_first_chunk()
        .and_then(|(length, rest)| rest.split_at_checked(u32::from_le_bytes(*length) as usize));
    let (nodes, packed) = parts.ok_or("it ends before its colours")?;
    let nodes = decode(nodes, frame)?;
    let colors = pack::decompress(packed, Colors::most_bytes(degree, count))
        .map_err(|e| format!("its colours cannot be unpacked: {e}"))?;
    Ok((nodes, Some(Colors::from_bytes(&colors, degree, count)?)))
}

/// Decodes the nodes of a page. An error says what is wrong with the page.
pub fn decode(bytes: &[u8], frame: Frame) -> Result<Vec<Node>, String> {
    let Frame { nodes: count, first_child, extent, has_links, .. } = frame;
    let (&code, rest) = bytes.split_first().ok_or("it is empty")?;
    let nodes = match code {
        LOSSLESS => lossless::decode(rest, count)?,
        LOSSY => lossy::decode(rest, count, first_child, extent)?,
        other => return Err(format!("it has the unknown code {other}")),
    };
    let mut next = first_child;
    for (index, node) in nodes.iter().enumerate() {
        if let Some(fault) = fault(node) {
            return Err(format!("its node {index} has {fault}"));
        }
        if node.children as usize > MOST_CHILDREN {
            return Err(format!(
                "its node {index} has {} children; at most {MOST_CHILDREN} are allowed",
                node.children
            ));
        }
        let wanted = if node.is_leaf() { 0 } else { next };
        if node.first_child != wanted && !(node.is_leaf() && has_links) {
            return Err(format!(
                "the children of its node {index} begin at {}, not at {wanted}",
                node.first_child
            ));
        }
        next = next
            .checked_add(node.children)
            .ok_or("it has more children than 32 bits can number")?;
    }
    Ok(nodes)
}

/// Enlarges the nodes of a block, from below, until each bounds its children: sphere, size and
/// cone.
pub fn enclose(nodes: &mut [Node]) {
    for index in (0..nodes.len()).rev() {
        if nodes[index].is_leaf() {
            continue;
        }
        let first = nodes[index].first_child as usize;
        let (above, below) = nodes.split_at_mut(first);
        let node = &mut above[index];
        enclose_children(node, &below[..node.children as usize]);
    }
}

fn enclose_children(node: &mut Node, children: &[Node]) {
    let center = node.center().as_dvec3();
    node.radius =
        children.iter().map(|child| round_up(reach(center, child))).fold(node.radius, f32::max);
    let size = node.size.max(WIDTH * deviation(&node.splat));
    node.size = children.iter().map(|child| child.size).fold(size, f32::max);
    node.cone = children
        .iter()
        .map(|child| cosine_below(joint_angle(node, child)))
        .fold(node.cone, f32::min);
}
