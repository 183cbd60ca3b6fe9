use super::{Block, CutSphere, Node, Tree, sphere::Sphere};
use crate::{Result, math::Bounds};
use std::ops::Range;
pub const PAGE_NODES: usize = 4096;
#[derive(Debug, Clone)]
pub struct Header { pub origin: glam::DVec3, pub extent: f32, pub closed: bool }
#[derive(Debug, Clone)]
pub struct PageEntry { pub nodes: u32, pub parent_pages: Range<u32>, pub parents_center: [f32; 3], pub parents_radius: f32, pub largest_parent_size: f32 }
#[derive(Debug, Clone)]
pub struct Page { pub nodes: Vec<Node>, pub parents: Vec<Option<CutSphere>>, pub child_pages: Vec<u32>, pub portal: Vec<bool> }
impl Page {
    pub fn parent(&self, i: usize) -> Option<CutSphere> { self.parents[i] }
    pub fn is_portal(&self, i: usize) -> bool { self.portal[i] }
}
#[derive(Debug)]
pub struct Hierarchy { tree: Tree, header: Header, entries: Vec<PageEntry>, pages: Vec<Page> }
impl Hierarchy {
    pub fn from_tree(tree: &Tree) -> Self {
        let mut page_of: Vec<Vec<u32>> = Vec::new();
        let mut runs: Vec<(usize, Range<usize>)> = Vec::new();
        for (b, block) in tree.blocks.iter().enumerate() {
            let mut of = vec![0u32; block.nodes.len()];
            let mut start = 0usize;
            let mut at = 0usize;
            let mut groups: Vec<Range<usize>> = vec![0..1];
            groups.extend(block.nodes.iter().filter(|n| n.children > 0).map(|n| n.first_child as usize..(n.first_child + n.children) as usize));
            for g in groups {
                if g.end - start > PAGE_NODES { runs.push((b, start..at)); start = at; }
                for i in g.clone() { of[i] = runs.len() as u32; }
                at = g.end;
            }
            runs.push((b, start..at));
            page_of.push(of);
        }
        let joined = tree.is_joined();
        let mut parent: Vec<Vec<Option<(usize, usize)>>> = tree.blocks.iter().map(|b: &Block| vec![None; b.nodes.len()]).collect();
        for (b, block) in tree.blocks.iter().enumerate() {
            for (i, n) in block.nodes.iter().enumerate() { for c in n.first_child..n.first_child + n.children { parent[b][c as usize] = Some((b, i)); } }
        }
        for (b, block) in tree.blocks.iter().enumerate() { if let Some(p) = block.portal { parent[b][0] = parent[0][p as usize]; } }
        let mut pages = Vec::new();
        let mut entries = Vec::new();
        for (b, run) in runs {
            let block = &tree.blocks[b];
            let nodes = block.nodes[run.clone()].to_vec();
            let parents: Vec<_> = run.clone().map(|i| parent[b][i].map(|(pb, pi)| CutSphere::of(&tree.blocks[pb].nodes[pi]))).collect();
            let portal: Vec<bool> = nodes.iter().map(|n| joined && b == 0 && n.is_leaf()).collect();
            let child_pages = run.clone().map(|i| { let n = &block.nodes[i]; if n.children > 0 { page_of[b][n.first_child as usize] } else if joined && b == 0 {
                let k = tree.blocks.iter().position(|x| x.portal == Some(i as u32)).unwrap(); page_of[k][0] } else { u32::MAX } }).collect();
            let around: Vec<Sphere> = parents.iter().flatten().map(|p: &CutSphere| Sphere { center: glam::Vec3::from(p.center).as_dvec3(), radius: p.radius as f64 }).collect();
            let pp: Vec<u32> = run.clone().filter_map(|i| parent[b][i].map(|(pb, pi)| page_of[pb][pi])).collect();
            let s = if around.is_empty() { Sphere { center: glam::DVec3::ZERO, radius: 0.0 } } else { Sphere::around(&around, 20) };
            let parent_pages = if pp.is_empty() { 0..0 } else { *pp.iter().min().unwrap()..pp.iter().max().unwrap() + 1 };
            entries.push(PageEntry { nodes: nodes.len() as u32, parent_pages, parents_center: s.center.as_vec3().to_array(), parents_radius: s.radius as f32 * 1.00001, largest_parent_size: parents.iter().flatten().map(|p| p.size).fold(0.0, f32::max) });
            pages.push(Page { nodes, parents, child_pages, portal });
        }
        Self { header: Header { origin: tree.origin, extent: tree.extent, closed: tree.closed }, tree: tree.clone(), entries, pages }
    }
    pub fn header(&self) -> &Header { &self.header }
    pub fn bounds(&self) -> Bounds { self.tree.bounds }
    pub fn pages(&self) -> &[PageEntry] { &self.entries }
    pub fn read_page(&self, i: usize) -> Result<Page> { Ok(self.pages[i].clone()) }
    pub fn read_tree(&self) -> Result<Tree> { Ok(self.tree.clone()) }
}
