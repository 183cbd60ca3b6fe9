//! Files of whole hierarchies: what is read is what was written, and damage is told.

use super::*;
use crate::{
    hierarchy::{
        Block, Tree,
        testing::{cloud, joined, surface, tree},
        validate,
    },
    io::{Limits, testing::Folder},
};
use std::path::Path;

fn options(lossless: bool) -> WriteOptions {
    WriteOptions { lossless, up: Some(UpAxis::Z), unit: "m".into(), source: "scan.ply".into() }
}

fn open(bytes: Vec<u8>) -> Hierarchy {
    Hierarchy::from_bytes(bytes, Path::new("memory"), &Limits::default()).unwrap()
}

fn same(a: &Tree, b: &Tree) {
    let blocks = |tree: &Tree| -> Vec<(Vec<Vec<u32>>, Option<u32>)> {
        let words = |block: &Block| block.nodes.iter().map(lossless::words).map(|words| words.to_vec()).collect();
        tree.blocks.iter().map(|block| (words(block), block.portal)).collect()
    };
    assert!(blocks(a) == blocks(b));
    let rest = |tree: &Tree| (tree.origin, tree.extent, tree.closed, tree.bounds, tree.source_points);
    assert_eq!(rest(a), rest(b));
}

fn trees() -> Vec<Tree> {
    let small = [1, 2, 9, 500].map(|count| tree(&surface(count, 1)));
    let large =
        [tree(&surface(20_000, 2)), joined(&surface(12_000, 3), 5), joined(&cloud(40, 4), 40), tree(&cloud(5_000, 5))];
    small.into_iter().chain(large).collect()
}

#[test]
fn trees_of_the_tests_are_sound() {
    for tree in trees() {
        assert_eq!(validate(&tree), []);
    }
}

#[test]
fn lossless_keeps_every_bit() {
    for tree in trees() {
        let hierarchy = open(to_bytes(&tree, &options(true)).unwrap());
        same(&hierarchy.read_tree().unwrap(), &tree);
        let header = hierarchy.header();
        assert_eq!((header.leaves, header.up, header.unit.as_str()), (tree.leaf_count(), Some(UpAxis::Z), "m"));
        assert_eq!((header.lossless, header.source.as_str()), (true, "scan.ply"));
    }
}

/// Every page against the tree that it came from.
fn pages_tell_their_parents(hierarchy: &Hierarchy) {
    let tree = hierarchy.read_tree().unwrap();
    let parents: Vec<Vec<Option<u32>>> = tree.blocks.iter().map(|block| write::parents(&block.nodes)).collect();
    for (number, entry) in hierarchy.pages().iter().enumerate() {
        let page = hierarchy.read_page(number as u32).unwrap();
        assert_eq!(page.nodes.len(), entry.nodes as usize);
        for (index, node) in page.nodes.iter().enumerate() {
            let block = &tree.blocks[entry.block as usize];
            let own = entry.first_node as usize + index;
            assert_eq!(*node, block.nodes[own]);
            let parent = match (own, block.portal) {
                (0, None) => None,
                (0, Some(portal)) => parents[0][portal as usize].map(|parent| tree.blocks[0].nodes[parent as usize]),
                _ => parents[entry.block as usize][own].map(|parent| block.nodes[parent as usize]),
            };
            match (parent, page.parent[index]) {
                (None, u32::MAX) => assert_eq!(entry.parents_radius, f32::INFINITY),
                (Some(parent), told) => {
                    assert_eq!(page.parents[told as usize], CutSphere::of(&parent));
                    let away = (parent.center() - glam::Vec3::from(entry.parents_center)).length() + parent.radius;
                    assert!(away <= entry.parents_radius * 1.000_001 && parent.size <= entry.largest_parent_size);
                }
                other => panic!("{other:?}"),
            }
            let below = page.child_pages[index];
            if page.is_portal(index) {
                let block = &hierarchy.pages()[below as usize];
                assert_eq!((tree.blocks[block.block as usize].portal, block.first_node), (Some(own as u32), 0));
            } else if node.is_leaf() {
                assert_eq!(below, NO_PAGE);
            } else {
                let entry = &hierarchy.pages()[below as usize];
                assert!((entry.first_node..entry.first_node + entry.nodes).contains(&node.first_child));
                assert!(below == number as u32 || entry.parent_pages.contains(&(number as u32)));
            }
        }
    }
}

#[test]
fn pages_know_what_is_above_and_below() {
    for tree in trees() {
        pages_tell_their_parents(&open(to_bytes(&tree, &options(true)).unwrap()));
        pages_tell_their_parents(&open(to_bytes(&tree, &options(false)).unwrap()));
        pages_tell_their_parents(&Hierarchy::from_tree(tree).unwrap());
    }
}

#[test]
fn a_file_is_written_whole_and_is_sound() {
    let folder = Folder::new();
    for tree in trees() {
        for lossless in [true, false] {
            let path = folder.path().join("tree.splk");
            write(&tree, &path, &options(lossless)).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), to_bytes(&tree, &options(lossless)).unwrap());
            assert_eq!(check(&path, &Limits::default()).findings, []);
            assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing else is left");
        }
    }
    drop(Writer::new(&folder.path().join("other.splk"), 3.0, &options(false)).unwrap());
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1, "nothing is left of what was not finished");
}
