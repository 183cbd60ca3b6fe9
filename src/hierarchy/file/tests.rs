//! Whole files: what is read is what was written, and damage is reported.

use super::{entry::Listing, page::Frame, *};
use crate::{
    about::Orientation,
    container::directory::Shape,
    hierarchy::{
        Block, Detail, Node, Tree,
        testing::{cloud, joined, surface, tree},
        validate,
    },
    input::{Limits, testing::Folder},
    math::Camera,
    splat::Splat,
};
use glam::DVec3;
use std::path::Path;

fn options(lossless: bool) -> WriteOptions {
    WriteOptions {
        lossless,
        orientation: Some(Orientation::RAS),
        is_guessed: true,
        unit: "m".into(),
        source: "scan.ply".into(),
    }
}

fn open(bytes: Vec<u8>) -> Hierarchy {
    Hierarchy::from_bytes(bytes, Path::new("memory"), &Limits::default()).unwrap()
}

fn same(a: &Tree, b: &Tree) {
    let blocks = |tree: &Tree| -> Vec<(Vec<Vec<u32>>, Option<u32>)> {
        let words = |block: &Block| {
            block.nodes.iter().map(lossless::words).map(|words| words.to_vec()).collect()
        };
        tree.blocks.iter().map(|block| (words(block), block.portal)).collect()
    };
    assert!(blocks(a) == blocks(b));
    let rest =
        |tree: &Tree| (tree.origin, tree.extent, tree.closed, tree.bounds, tree.source_points);
    assert_eq!(rest(a), rest(b));
}

fn trees() -> Vec<Tree> {
    let small = [1, 2, 9, 500].map(|count| tree(&surface(count, 1)));
    let large = [
        tree(&surface(20_000, 2)),
        joined(&surface(12_000, 3), 5),
        joined(&cloud(40, 4), 40),
        tree(&cloud(5_000, 5)),
    ];
    small.into_iter().chain(large).collect()
}

/// Returns the first page of a block.
fn encoded(nodes: &[Node], extent: f32, lossless: bool) -> Vec<u8> {
    page::encode(&block_of(nodes), extent, lossless).unwrap().pages.swap_remove(0)
}

/// The frame of the first page of a block.
fn frame(nodes: usize, extent: f32) -> Frame {
    Frame { nodes, first_child: 1, extent, degree: None, has_links: false }
}

fn block_of(nodes: &[Node]) -> Block {
    Block { nodes: nodes.to_vec(), ..Block::default() }
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
        assert_eq!(
            (header.leaves, header.orientation, header.unit.as_str()),
            (tree.leaf_count(), Some(Orientation::RAS), "m")
        );
        assert_eq!((header.lossless, header.source.as_str()), (true, "scan.ply"));
    }
}

fn entries(hierarchy: &Hierarchy) -> Vec<PageEntry> {
    (0..hierarchy.page_count()).map(|page| hierarchy.entry(page).unwrap()).collect()
}

/// Compares every page with the tree that it came from.
fn pages_tell_their_parents(hierarchy: &Hierarchy) {
    let tree = hierarchy.read_tree().unwrap();
    let parents: Vec<Vec<Option<u32>>> =
        tree.blocks.iter().map(|block| pages::parents(&block.nodes)).collect();
    for (number, entry) in entries(hierarchy).iter().enumerate() {
        let page = hierarchy.read_page(number as u32).unwrap();
        assert_eq!(page.nodes.len(), entry.nodes as usize);
        for (index, node) in page.nodes.iter().enumerate() {
            let block = &tree.blocks[entry.block as usize];
            let node_index = entry.first_node as usize + index;
            assert_eq!(*node, block.nodes[node_index]);
            let parent = match (node_index, block.portal) {
                (0, None) => None,
                (0, Some(portal)) => {
                    parents[0][portal as usize].map(|parent| tree.blocks[0].nodes[parent as usize])
                }
                _ => parents[entry.block as usize][node_index]
                    .map(|parent| block.nodes[parent as usize]),
            };
            match (parent, page.parent[index]) {
                (None, u32::MAX) => assert_eq!(entry.parents_radius, f32::INFINITY),
                (Some(parent), position) => {
                    assert_eq!(page.parents[position as usize], CutSphere::of(&parent));
                    let away = (parent.center() - glam::Vec3::from(entry.parents_center)).length()
                        + parent.radius;
                    assert!(
                        away <= entry.parents_radius * 1.000_001
                            && parent.size <= entry.largest_parent_size
                    );
                }
                other => panic!("{other:?}"),
            }
            let below = page.child_pages[index];
            if page.is_portal(index) {
                let block = hierarchy.entry(below).unwrap();
                assert_eq!(
                    (tree.blocks[block.block as usize].portal, block.first_node),
                    (Some(node_index as u32), 0)
                );
            } else if node.is_leaf() {
                assert_eq!(below, NO_PAGE);
            } else {
                let entry = hierarchy.entry(below).unwrap();
                assert!(
                    (entry.first_node..entry.first_node + entry.nodes).contains(&node.first_child)
                );
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
            let path = folder.path("tree.splk");
            write(&tree, &path, &options(lossless)).unwrap();
            assert_eq!(std::fs::read(&path).unwrap(), to_bytes(&tree, &options(lossless)).unwrap());
            assert_eq!(check(&path, &Limits::default()).findings, []);
            assert_eq!(folder.names().len(), 1, "nothing else is left");
        }
    }
    drop(Writer::new(folder.path("other.splk"), 3.0, &options(false)).unwrap());
    assert_eq!(folder.names().len(), 1, "an unfinished file leaves nothing");
}

/// Opens a file and reads every page: returns the tree, or the first error.
fn try_all(bytes: Vec<u8>) -> crate::Result<Tree> {
    let hierarchy = Hierarchy::from_bytes(bytes, Path::new("memory"), &Limits::default())?;
    for page in 0..hierarchy.page_count() {
        hierarchy.read_page(page)?;
    }
    hierarchy.read_tree()
}

fn input_error(result: crate::Result<impl Sized>, what: &str) {
    match result {
        Err(crate::Error::Input { place, message, hint, .. }) => {
            assert!(
                !place.is_empty() && !message.is_empty() && hint.is_some(),
                "{what}: {place}: {message}"
            );
        }
        Err(other) => panic!("{what}: {other}"),
        Ok(_) => panic!("{what} was not reported"),
    }
}

fn small_files() -> Vec<Vec<u8>> {
    let trees = [joined(&surface(120, 8), 3), tree(&cloud(40, 9))];
    trees
        .iter()
        .flat_map(|tree| [true, false].map(|lossless| to_bytes(tree, &options(lossless)).unwrap()))
        .collect()
}

#[test]
fn every_flipped_byte_is_reported() {
    let folder = Folder::new();
    for bytes in small_files() {
        let hash = bytes.len() - HASH;
        for at in 0..bytes.len() {
            let mut broken = bytes.clone();
            broken[at] ^= 1 << (at % 8);
            if at < hash {
                input_error(try_all(broken.clone()), &format!("byte {at}"));
            }
            // Writing files is slow, so only some of these are written.
            if at >= hash || at % 61 == 0 {
                let path = folder.write("broken.splk", &broken);
                assert!(!check(&path, &Limits::default()).is_sound(), "byte {at}");
            }
        }
    }
}

#[test]
fn every_prefix_is_incomplete() {
    let folder = Folder::new();
    for bytes in small_files() {
        for end in 0..bytes.len() {
            input_error(try_all(bytes[..end].to_vec()), &format!("cut at {end}"));
        }
        let path = folder.write("long.splk", [&bytes[..], b"more"].concat());
        input_error(Hierarchy::open(&path, &Limits::default()), "a longer file");
        let path = folder.write("cut.splk", &bytes[..bytes.len() / 2]);
        let report = check(&path, &Limits::default());
        assert!(report.findings[0].message.contains("incomplete"), "{:?}", report.findings);
    }
}

/// Changes a file, and corrects the checksums of its header and its root, and the hash.
fn forged(bytes: &[u8], change: impl Fn(&mut [u8])) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    let stored = header::Stored::decode(&bytes).unwrap();
    let start = stored.length();
    let end = start + Shape::of(stored.pages).root_length::<Listing>();
    change(&mut bytes);
    for range in [0..start, start..end] {
        let crc = crc32fast::hash(&bytes[range.start..range.end - 4]);
        bytes[range.end - 4..range.end].copy_from_slice(&crc.to_le_bytes());
    }
    let hash = bytes.len() - HASH;
    let digest = blake3::hash(&bytes[..hash]);
    bytes[hash..].copy_from_slice(digest.as_bytes());
    bytes
}

#[test]
fn lies_are_reported_though_checksums_fit() {
    let bytes = to_bytes(&joined(&surface(9_000, 8), 2), &options(false)).unwrap();
    let pages = open(bytes.clone()).page_count();
    let start = header::Stored::decode(&bytes).unwrap().length();
    let end = start + 68 * pages as usize;
    assert!(try_all(forged(&bytes, |_| ())).is_ok());
    // The version, the counts of leaves, nodes, blocks and pages; then every word of the
    // directory.
    for at in [8, 16, 104, 112, 124, 128].into_iter().chain((start..end).step_by(4)) {
        for change in [1u32, 0x0100_0000, u32::MAX] {
            let broken = forged(&bytes, |bytes| {
                let word = u32::from_le_bytes(bytes[at..at + 4].try_into().unwrap()) ^ change;
                bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
            });
            let folder = Folder::new();
            let path = folder.write("forged.splk", &broken);
            assert!(!check(&path, &Limits::default()).is_sound(), "word {at} ^ {change:x}");
            try_all(broken).ok();
        }
    }
    let future = forged(&bytes, |bytes| bytes[8] = 9);
    match try_all(future) {
        Err(crate::Error::Input { message, .. }) => {
            assert!(message.contains("version 9"), "{message}");
        }
        other => panic!("{other:?}"),
    }
}

/// Pages with correct checksums but random bytes give an error or some nodes, never a panic.
#[test]
fn pages_of_noise_are_survived() {
    let mut random = crate::hierarchy::testing::Random(11);
    for splats in [surface(600, 1), cloud(600, 2)] {
        let tree = tree(&splats);
        let nodes = &tree.blocks[0].nodes;
        let runs = pages::pages(nodes);
        for lossless in [true, false] {
            let page = encoded(nodes, tree.extent, lossless);
            for _ in 0..3000 {
                let mut broken = page.clone();
                for _ in 0..1 + random.below(3) {
                    let at = if random.next() < 0.5 {
                        random.below(broken.len().min(200))
                    } else {
                        random.below(broken.len())
                    };
                    broken[at] = random.below(256) as u8;
                }
                broken.truncate(if random.next() < 0.3 {
                    random.below(broken.len())
                } else {
                    broken.len()
                });
                if let Ok(nodes) = page::decode(&broken, frame(runs[0].nodes.len(), tree.extent)) {
                    assert_eq!(nodes.len(), runs[0].nodes.len());
                }
            }
        }
    }
}

#[test]
fn bounds_hold_exactly_for_what_is_read() {
    for tree in trees() {
        let read = open(to_bytes(&tree, &options(false)).unwrap()).read_tree().unwrap();
        assert_eq!(validate(&read), []);
        for block in &read.blocks {
            for node in &block.nodes {
                let first = node.first_child as usize;
                for child in &block.nodes[first..first + node.children as usize] {
                    assert!(
                        pages::reach(node.center().as_dvec3(), child) <= f64::from(node.radius)
                    );
                    assert!(child.size <= node.size);
                    let cone = libm::cos(cones::joint_angle(node, child));
                    assert!(node.cone == -1.0 || f64::from(node.cone) <= cone);
                }
            }
        }
    }
}

/// Returns the leaves sorted by colour, because the order of siblings may change.
fn sorted_leaves(tree: &Tree) -> Vec<crate::hierarchy::Node> {
    let mut leaves: Vec<_> =
        tree.blocks[0].nodes.iter().copied().filter(|node| node.is_leaf()).collect();
    leaves.sort_by_key(|leaf| leaf.splat.color);
    leaves
}

#[test]
fn losses_keep_to_the_promises() {
    use crate::hierarchy::testing::ellipsoid;
    let mut splats = surface(30_000, 6);
    // A unique colour identifies each leaf.
    splats
        .iter_mut()
        .enumerate()
        .for_each(|(index, splat)| splat.color = index as u32 | 0xff00_0000);
    let tree = tree(&splats);
    let bytes = to_bytes(&tree, &options(false)).unwrap();
    let read = open(bytes).read_tree().unwrap();
    let (before, after) = (sorted_leaves(&tree), sorted_leaves(&read));
    let (mut sum, mut most) = (0.0, 0.0f64);
    for (a, b) in before.iter().zip(&after) {
        assert_eq!((a.splat.color, a.splat.strength), (b.splat.color, b.splat.strength));
        let away = glam::Vec3::from(a.splat.center).distance(glam::Vec3::from(b.splat.center));
        assert!(away <= b.size / 100.0, "{away} of {}", b.size);
        let inflation = b.radius / a.radius;
        assert!((0.95..1.05).contains(&inflation), "{inflation}");
        let normals = [a, b].map(|node| direction::unpacked(node.splat.normal).unwrap());
        let angle = libm::acos(normals[0].dot(normals[1]).min(1.0)).to_degrees();
        (sum, most) = (sum + angle, most.max(angle));
        let ([one, two], [three, four]) =
            ([0, 1].map(|i| ellipsoid(&a.splat).0[i]), [0, 1].map(|i| ellipsoid(&b.splat).0[i]));
        assert!((three / one - 1.0).abs() < 0.05 && (four / two - 1.0).abs() < 0.11);
        // The ellipse as a whole: its widening or narrowing in each direction.
        let [original, coded] =
            [a, b].map(|node| crate::hierarchy::testing::covariance(&node.splat));
        let along = ellipsoid(&a.splat).1;
        for axis in &along[..2] {
            let ratio = (axis.dot(coded * *axis) / axis.dot(original * *axis)).sqrt();
            // The extremes of 60,000 axes; which these are depends on the order of the nodes.
            assert!((0.82..1.22).contains(&ratio), "{ratio}");
        }
    }
    let [root, wanted] = [&read, &tree].map(|tree| tree.blocks[0].nodes[0].radius);
    assert!(root <= 1.05 * wanted, "the root's sphere grows by {}", root / wanted);
    assert!(
        sum / before.len() as f64 <= 0.67 && most <= 1.9,
        "normals: {} {most}",
        sum / before.len() as f64
    );
}

#[test]
fn what_was_read_loses_little_more() {
    for mut splats in [surface(9, 2), surface(4_000, 3)] {
        // A unique colour identifies each leaf.
        splats
            .iter_mut()
            .enumerate()
            .for_each(|(index, splat)| splat.color = index as u32 | 0xff00_0000);
        let first = open(to_bytes(&tree(&splats), &options(false)).unwrap()).read_tree().unwrap();
        let again = open(to_bytes(&first, &options(false)).unwrap()).read_tree().unwrap();
        let (before, after) = (sorted_leaves(&first), sorted_leaves(&again));
        for (a, b) in before.iter().zip(&after) {
            // Siblings may change places, and with them the values relative to which positions and
            // normals are stored.
            let away = glam::Vec3::from(a.splat.center).distance(glam::Vec3::from(b.splat.center));
            assert!(away <= a.size / 100.0);
            let normals = [a, b].map(|node| direction::unpacked(node.splat.normal).unwrap());
            assert!(normals[0].dot(normals[1]) > libm::cos(1.9f64.to_radians()));
            assert_eq!((a.size, a.splat.color), (b.size, b.splat.color));
        }
    }
}

#[test]
fn a_smooth_surface_takes_few_bytes() {
    let mut splats = surface(30_000, 6);
    splats.iter_mut().for_each(|splat| splat.color = 0xffff_ffff);
    let bytes = to_bytes(&tree(&splats), &options(false)).unwrap();
    // Of these, 0.3 are for pages of at most 1,024 nodes, in place of 4,096.
    assert!(bytes.len() < 30_000 * 55 / 10, "{}", bytes.len());
}

#[test]
fn splats_beyond_the_codes_are_kept_whole() {
    let mut splats = surface(300, 1);
    splats[0].strength = Splat::MOST_OPTICAL_DEPTH;
    splats[150].center = [1e18, 0.0, 0.0];
    let tree = tree(&splats);
    let read = open(to_bytes(&tree, &options(false)).unwrap()).read_tree().unwrap();
    assert_eq!(validate(&read), []);
    assert!(read.nodes().any(|node| node.splat.strength == Splat::MOST_OPTICAL_DEPTH));
}

#[test]
fn disorder_is_refused() {
    let sound = tree(&surface(50, 1));
    let refused = |change: fn(&mut Tree)| {
        let mut tree = sound.clone();
        change(&mut tree);
        assert!(!validate(&tree).is_empty());
        assert!(matches!(to_bytes(&tree, &options(false)), Err(crate::Error::Argument(_))));
    };
    refused(|tree| tree.blocks.clear());
    refused(|tree| tree.blocks[0].nodes.clear());
    refused(|tree| tree.blocks[0].nodes[0].first_child = 2);
    refused(|tree| tree.blocks[0].nodes[0].children = 9);
    refused(|tree| tree.blocks[0].nodes.truncate(20));
    refused(|tree| tree.blocks[0].nodes[3].radius = f32::NAN);
    refused(|tree| tree.extent = 0.0);
    refused(|tree| tree.blocks.push(tree.blocks[0].clone()));
    // It is not drawn either.
    let view =
        Camera::framing(&sound.bounds, DVec3::X, DVec3::Z, 1.0).view([9, 9]).expect("a view");
    assert!(!sound.cut(&view, Detail::Pixels(1.0), None).expect("a cut").splats().is_empty());
    let mut torn = sound.clone();
    torn.blocks[0].nodes[0].first_child = u32::MAX;
    assert!(matches!(torn.cut(&view, Detail::Pixels(1.0), None), Err(crate::Error::Argument(_))));
}

#[test]
fn validation_finds_what_is_loose() {
    let sound = tree(&surface(500, 1));
    let expect_finding = |change: fn(&mut [crate::hierarchy::Node]), code: &str| {
        let mut tree = sound.clone();
        change(&mut tree.blocks[0].nodes);
        let codes: Vec<&str> = validate(&tree).iter().map(|finding| finding.code).collect();
        assert!(codes.contains(&code), "{code}: {codes:?}");
    };
    expect_finding(|nodes| nodes[0].radius *= 0.99, "sphere");
    expect_finding(|nodes| nodes[1].center[0] += 0.5, "sphere");
    expect_finding(|nodes| nodes[0].size = nodes[1].size * 0.5, "size");
    // The nodes above a leaf do not have this fault.
    let expect_at_leaf = |change: fn(&mut crate::hierarchy::Node), code: &str| {
        let mut tree = sound.clone();
        if let Some(leaf) = tree.blocks[0].nodes.iter_mut().find(|node| node.is_leaf()) {
            change(leaf);
        }
        let codes: Vec<&str> = validate(&tree).iter().map(|finding| finding.code).collect();
        assert_eq!(codes, [code]);
    };
    expect_at_leaf(|leaf| leaf.radius *= 0.95, "sphere");
    expect_at_leaf(|leaf| leaf.splat.center[2] += 0.1 * leaf.radius, "sphere");
    expect_at_leaf(|leaf| leaf.size *= 0.95, "size");
    expect_at_leaf(|leaf| leaf.splat.strength = -1.0, "values");
    let mut boxed = sound.clone();
    boxed.bounds.max.x += 0.1 * boxed.bounds.diagonal();
    assert_eq!(validate(&boxed).iter().map(|finding| finding.code).collect::<Vec<_>>(), ["bounds"]);
    boxed.extent = 9.0;
    assert_eq!(validate(&boxed)[0].code, "extent");
    expect_finding(|nodes| nodes[1].cone = 1.0, "cone");
    expect_finding(|nodes| nodes[2].splat.center[1] = f32::INFINITY, "values");
}

/// Values that cannot be drawn are rejected in trees, on writing and on reading.
#[test]
fn numbers_that_cannot_be_drawn_are_refused() {
    // All of it is on one page.
    let sound = tree(&surface(40, 1));
    let refused = |change: &dyn Fn(&mut Tree), message: &str| {
        let mut tree = sound.clone();
        change(&mut tree);
        assert!(
            validate(&tree).iter().any(|finding| finding.message.contains(message)),
            "{:?}",
            validate(&tree)
        );
        for lossless in [true, false] {
            let error = to_bytes(&tree, &options(lossless)).unwrap_err().to_string();
            assert!(error.contains(message), "{error}");
        }
        let error = Hierarchy::from_tree(tree).unwrap_err().to_string();
        assert!(error.contains(message), "{error}");
    };
    type Change = fn(&mut crate::hierarchy::Node);
    let nodes: [(Change, &str); 7] = [
        (|node| node.splat.strength = 1.1e10, "an optical depth of 11000000000, but"),
        (|node| node.splat.strength = -1.0, "an optical depth of -1, but"),
        (
            |node| node.splat.factor[3] = 1e19,
            "a coordinate or an element of its factor beyond 1e18",
        ),
        (|node| node.center[1] = -1e19, "a coordinate or an element of its factor beyond 1e18"),
        (|node| node.splat.center[2] = f32::NAN, "a value that is not finite"),
        (|node| node.radius = -1.0, "a radius of -1 and"),
        (|node| node.cone = 1.5, "a cone of cosine 1.5"),
    ];
    for (change, message) in nodes {
        refused(&|tree| change(&mut tree.blocks[0].nodes[7]), &format!("has {message}"));
        let mut nodes = sound.blocks[0].nodes.clone();
        change(&mut nodes[7]);
        let page = encoded(&nodes, sound.extent, true);
        let error = page::decode(&page, frame(nodes.len(), sound.extent)).unwrap_err();
        assert!(error.contains(&format!("its node 7 has {message}")), "{error}");
    }
    refused(&|tree| tree.extent = 8.1, "its extent is 8.1; it must lie in 0 … 8");
    refused(&|tree| tree.extent = f32::NAN, "its extent is NaN; it must lie in 0 … 8");
    refused(&|tree| tree.origin.y = f64::INFINITY, "its origin or its bounds are not valid");
    refused(&|tree| tree.bounds.max.x = f64::NAN, "its origin or its bounds are not valid");
}

/// If a splat can be drawn, so can its quantised value.
#[test]
fn rounding_stays_within_what_can_be_drawn() {
    let mut kept = [0; 2];
    // Steps are relative to the root's strength, here the mean of `count` splats.
    for count in 50..62 {
        let mut splats = surface(count, 1);
        splats[7].strength = Splat::MOST_OPTICAL_DEPTH;
        let read = open(to_bytes(&tree(&splats), &options(false)).unwrap()).read_tree().unwrap();
        assert_eq!(validate(&read), []);
        let most = read.nodes().map(|node| node.splat.strength).fold(0.0, f32::max);
        kept[usize::from(most == Splat::MOST_OPTICAL_DEPTH)] += 1;
    }
    // Some are rounded down. If one would be rounded up, the page is stored losslessly.
    assert!(kept[0] > 0 && kept[1] > 0, "{kept:?}");
}
