//! Trees of splats. Every tree keeps its promises, and pictures of its cuts match pictures of the
//! splats.

use crate::testing::{gpu::gpu, psnr::measured};
use glam::{DVec3, Vec3};
use splatkit::{
    Severity,
    bricks::Bricks,
    gpu::Renderer,
    hierarchy::{
        BuildOptions, Cut, CutSplats, Detail, Hierarchy, Preset, SHARE_UNIT, Tree,
        file::{WriteOptions, to_bytes},
        validate,
    },
    input::Limits,
    math::{Bounds, Camera, Kernel, Projection, View},
    picture::Picture,
    reference,
    scene::{Clip, ClipShape, Scene, Settings},
    splat::{Splat, Surfels},
    surface::{Mesh, SurfelOptions},
    volume::{TransferFunction, phantoms::Phantom},
};
use std::{path::Path, sync::Arc};

/// A knotted tube of about `count` vertices, coloured by position.
fn knot(count: u32) -> Surfels {
    let around = f64::from(count / 12).sqrt() as u32;
    let mut mesh = Mesh::knot(12 * around, around);
    mesh.origin = DVec3::new(1000.0, -2000.0, 300.0);
    mesh.colors = mesh
        .positions
        .iter()
        .map(|p| (p.normalize() * 100.0 + 150.0).extend(255.0).to_array().map(|v| v as u8))
        .collect();
    mesh.surfels(&SurfelOptions::default()).expect("surfels")
}

/// The splats of a cut of a tree of surfels.
fn cut(tree: &Tree, view: &View, detail: Detail, culls: Option<bool>) -> Surfels {
    match tree.cut(view, detail, culls) {
        Ok(CutSplats::Surfels(set)) => set,
        other => panic!("{other:?}"),
    }
}

fn build(set: &Surfels, block_splats: usize) -> Tree {
    Tree::build(set, &BuildOptions { block_splats, ..BuildOptions::default() }, None)
        .expect("a tree")
}

/// A camera for which the bounds fill `part` of the picture.
fn camera(bounds: &Bounds, part: f64) -> Camera {
    let mut camera = Camera::framing(bounds, DVec3::new(1.0, -2.0, 0.7), DVec3::Z, 1.0);
    camera.position = camera.focal_point + (camera.position - camera.focal_point) / part;
    camera
}

fn renderer() -> Renderer {
    Renderer::new(gpu())
}

fn with_memory(mut settings: Settings, page_memory: u64) -> Settings {
    settings.controls.page_memory = page_memory;
    settings
}

fn settings(pixels: f64) -> Settings {
    Settings { detail: Detail::Pixels(pixels), ..Settings::new([160, 160]) }
}

#[test]
fn trees_of_every_preset_keep_their_promises_and_all_splats() {
    let set = knot(20_000);
    let mut wanted: Vec<[u8; 48]> = set.splats.iter().map(bytes).collect();
    wanted.sort_unstable();
    for preset in [Preset::Fastest, Preset::Fast, Preset::Balanced, Preset::Slow, Preset::Best] {
        for block_splats in [1 << 20, 1000] {
            let options = BuildOptions { preset, block_splats, ..BuildOptions::default() };
            let tree = Tree::build(&set, &options, None).expect("a tree");
            assert_eq!(tree.is_joined(), block_splats == 1000);
            let errors: Vec<_> =
                validate(&tree).into_iter().filter(|f| f.severity == Severity::Error).collect();
            assert!(errors.is_empty(), "{preset:?}: {errors:?}");
            let mut leaves: Vec<[u8; 48]> =
                tree.nodes().filter(|node| node.is_leaf()).map(|node| bytes(&node.splat)).collect();
            leaves.sort_unstable();
            assert_eq!(leaves, wanted, "{preset:?}");
            let inner = tree.nodes().count() - leaves.len();
            assert!(inner * 4 < leaves.len(), "{inner} nodes above {} leaves", leaves.len());
        }
    }
}

/// Lengths may have any unit: coarse nodes keep their opacity.
#[test]
fn trees_of_any_size_are_alike() {
    let set = knot(5000);
    let whole = build(&set, 1 << 20);
    for scale in [2f32.powi(-50), 2f32.powi(-20), 2f32.powi(18)] {
        let mut scaled = set.clone();
        for splat in &mut scaled.splats {
            splat.center = splat.center.map(|v| v * scale);
            splat.factor = splat.factor.map(|v| v * scale);
        }
        scaled.origin = DVec3::ZERO;
        let tree = build(&scaled, 1 << 20);
        let nodes = |tree: &Tree| tree.nodes().copied().collect::<Vec<_>>();
        assert_eq!(nodes(&tree).len(), nodes(&whole).len(), "{scale:e}");
        for (node, other) in nodes(&tree).iter().zip(nodes(&whole)) {
            let near = |a: f32, b: f32| (a - b).abs() <= 1e-3 * b.abs();
            assert!(
                near(node.splat.strength, other.splat.strength),
                "{scale:e}: {node:?} {other:?}"
            );
            assert!(near(node.size, other.size * scale), "{scale:e}: {node:?} {other:?}");
        }
    }
}

/// Nodes and samples in one picture, from the first frame on. The nodes that are chosen move the
/// batches of the samples, and vice versa.
#[test]
fn a_hierarchy_in_a_volume() {
    let volume = Arc::new(Phantom::Ball.sample_bytes([32; 3]).expect("a ball"));
    let mut mesh = Mesh::knot(300, 24);
    mesh.positions.iter_mut().for_each(|place| *place *= 0.4);
    let set = mesh.surfels(&SurfelOptions::default()).expect("surfels");
    let file = to_bytes(
        &build(&set, 1 << 20),
        &WriteOptions { lossless: true, ..WriteOptions::default() },
    )
    .expect("a file");
    let hierarchy = || {
        Hierarchy::from_bytes(file.clone(), Path::new("knot.splk"), &Limits::default())
            .expect("opens")
    };
    let transfer = TransferFunction::automatic(&volume);
    let scene = || Scene::new().with_hierarchy(hierarchy());
    let scenes = [
        scene().with_volume(volume.clone(), Kernel::default(), transfer.clone()),
        scene().with_bricks(
            Bricks::from_volume(volume).expect("bricks"),
            Kernel::default(),
            transfer,
        ),
    ];
    for scene in scenes {
        let camera = camera(&scene.bounds(), 0.8);
        let mut renderer = renderer();
        let mut prepared = renderer.prepare(&scene).expect("fits");
        // From far and then nearer, so that other bricks and pages are read.
        for part in [0.3, 1.0] {
            let camera = Camera {
                position: camera.focal_point + (camera.position - camera.focal_point) / part,
                ..camera
            };
            let truth = reference::render(&scene, &camera, &settings(1.0)).expect("draws");
            let picture = renderer.render(&mut prepared, &camera, &settings(1.0)).expect("draws").0;
            let agreement = measured(&picture, &truth);
            println!("{part}: {agreement:.1} dB");
            assert!(agreement > 50.0, "{part}: {agreement:.1} dB");
        }
    }
}

/// Pages that were loaded before a page that cannot be read are drawn as usual afterwards.
#[test]
fn a_page_that_cannot_be_read_takes_nothing_with_it() {
    let mut file =
        to_bytes(&build(&knot(60_000), 1 << 20), &WriteOptions::default()).expect("a file");
    let last = file.len() - 100;
    file[last] ^= 0x55;
    let hierarchy =
        Hierarchy::from_bytes(file, Path::new("knot.splk"), &Limits::default()).expect("opens");
    assert!(hierarchy.page_count() > 8);
    let scene = Scene::new().with_hierarchy(hierarchy);
    let camera = camera(&scene.bounds(), 0.8);
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&scene).expect("fits");
    for _ in 0..2 {
        let error = renderer
            .render(&mut prepared, &camera, &settings(0.0))
            .expect_err("a broken page")
            .to_string();
        assert!(error.contains("knot.splk: page"), "{error}");
    }
    let coarse = settings(16.0);
    let picture = renderer.render(&mut prepared, &camera, &coarse).expect("draws").0;
    let mut fresh = renderer.prepare(&scene).expect("fits");
    let truth = renderer.render(&mut fresh, &camera, &coarse).expect("draws").0;
    assert!(truth.color.iter().any(|color| color[3] > 0.5));
    assert!(measured(&picture, &truth) > 90.0, "{:.1} dB", measured(&picture, &truth));
}

fn bytes(splat: &splatkit::splat::Splat) -> [u8; 48] {
    bytemuck::cast(*splat)
}

/// Approximate radius of the smallest sphere around the leaves' spheres, found by many small steps.
fn smallest_sphere(tree: &Tree) -> f64 {
    let leaves: Vec<(DVec3, f64)> = tree
        .nodes()
        .filter(|node| node.is_leaf())
        .map(|node| (Vec3::from(node.center).as_dvec3(), f64::from(node.radius)))
        .collect();
    let mut center = leaves.iter().map(|leaf| leaf.0).sum::<DVec3>() / leaves.len() as f64;
    let mut best = f64::INFINITY;
    for round in 0..2000 {
        let reach = |leaf: &&(DVec3, f64)| leaf.0.distance(center) + leaf.1;
        let Some(far) = leaves.iter().max_by(|a, b| reach(a).total_cmp(&reach(b))) else { break };
        best = best.min(reach(&far));
        center += (far.0 - center) / f64::from(round + 2);
    }
    best
}

#[test]
fn root_spheres_are_nearly_the_smallest() {
    for (name, set) in [
        ("knot", knot(20_000)),
        ("ball", Mesh::sphere(5).surfels(&SurfelOptions::default()).expect("surfels")),
    ] {
        for block_splats in [1 << 20, 1000] {
            let tree = build(&set, block_splats);
            let inflation = f64::from(tree.blocks[0].nodes[0].radius) / smallest_sphere(&tree);
            println!("{name} in blocks of {block_splats}: {inflation:.3}");
            assert!((0.999..1.05).contains(&inflation), "{name}: {inflation}");
        }
    }
}

/// On every path from the root to a leaf, the shares of a cut add up to the whole.
#[test]
fn shares_add_up_on_every_way_down() {
    let set = knot(5_000);
    for block_splats in [1 << 20, 500] {
        let tree = build(&set, block_splats);
        for (part, pixels) in [(1.0, 4.0), (0.5, 2.0), (0.1, 1.0), (3.0, 30.0)] {
            let view = camera(&set.bounds(), part).view([4000, 4000]).expect("a view");
            // The picture is so wide that nothing lies beside it.
            let view = View { center: view.center + 1e6, size: [2_000_000; 2], ..view };
            let cut = Cut::new(&view, tree.origin, pixels, false);
            let selected: std::collections::HashMap<*const _, u32> = tree
                .selected(&cut)
                .into_iter()
                .map(|(node, share)| (std::ptr::from_ref(node), share))
                .collect();
            let share = |node: &splatkit::hierarchy::Node| {
                selected.get(&std::ptr::from_ref(node)).copied().unwrap_or(0)
            };
            let mut ways = 0;
            let mut open = vec![(0usize, 0usize, 0u32)];
            while let Some((block, index, above)) = open.pop() {
                let node = &tree.blocks[block].nodes[index];
                let child_block =
                    tree.blocks.iter().position(|b| block == 0 && b.portal == Some(index as u32));
                if let Some(child) = child_block {
                    open.push((child, 0, above));
                    continue;
                }
                let sum = above + share(node);
                if node.is_leaf() {
                    assert_eq!(sum, SHARE_UNIT);
                    ways += 1;
                }
                open.extend(
                    (node.first_child..node.first_child + node.children)
                        .map(|child| (block, child as usize, sum)),
                );
            }
            assert_eq!(ways, set.splats.len());
        }
    }
}

/// The GPU engine selects the same nodes as the CPU: in one block and in many, in memory and from a
/// file.
#[test]
fn the_engine_draws_the_cut_that_the_oracle_finds() {
    let set = knot(8_000);
    let mut renderer = renderer();
    for block_splats in [1 << 20, 700] {
        let tree = build(&set, block_splats);
        let file = to_bytes(&tree, &WriteOptions { lossless: true, ..WriteOptions::default() })
            .expect("a file");
        let file = Hierarchy::from_bytes(file, Path::new("memory"), &Limits::default())
            .expect("a hierarchy");
        let memory = Hierarchy::from_tree(tree.clone()).expect("a hierarchy");
        for hierarchy in [memory, file] {
            let mut prepared =
                renderer.prepare(&Scene::new().with_hierarchy(hierarchy)).expect("prepared");
            for (part, pixels) in
                [(1.0, 0.0), (1.0, 3.0), (0.3, 1.0), (0.3, 4.0), (2.5, 5.0), (1.0, 1e10)]
            {
                for orthographic in [false, true] {
                    let mut camera = camera(&set.bounds(), part);
                    if orthographic {
                        camera.make_orthographic();
                    }
                    let settings = settings(pixels);
                    let (picture, stats) =
                        renderer.render(&mut prepared, &camera, &settings).expect("a picture");
                    let view = camera.view(settings.size).expect("a view");
                    let cut = cut(&tree, &view, settings.detail, None);
                    if part <= 1.0 {
                        assert_eq!(stats.splats, cut.splats.len() as u64, "{part} {pixels}");
                    }
                    let mut flat =
                        renderer.prepare(&Scene::new().with_splats(cut)).expect("prepared");
                    // Equal sheets need equal bounds, which the splats of a cut have only
                    // approximately.
                    let (expected, _) =
                        renderer.render(&mut flat, &camera, &settings).expect("a picture");
                    let agreement = measured(&picture, &expected);
                    assert!(agreement > 40.0, "{part} {pixels}: {agreement:.1} dB");
                }
            }
        }
    }
}

#[test]
fn the_engine_matches_the_reference() {
    let set = knot(1_500);
    let tree = build(&set, 300);
    let scene = Scene::new().with_hierarchy(Hierarchy::from_tree(tree).expect("a hierarchy"));
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&scene).expect("prepared");
    for pixels in [0.0, 2.0, 6.0] {
        let settings = Settings { detail: Detail::Pixels(pixels), ..Settings::new([64, 64]) };
        let camera = camera(&scene.bounds(), 0.9);
        let (picture, _) = renderer.render(&mut prepared, &camera, &settings).expect("a picture");
        let expected = reference::render(&scene, &camera, &settings).expect("a picture");
        let agreement = measured(&picture, &expected);
        println!("{pixels}: {agreement:.1} dB");
        assert!(agreement > 50.0, "{pixels}: {agreement:.1} dB");
    }
}

/// Counts the holes of a cut: pixels that it does not cover, although the leaves cover all 5 × 5
/// pixels around them.
fn holes(leaves: &Picture, cut: &Picture) -> usize {
    let [width, height] = [leaves.width as i32, leaves.height as i32];
    let covered = |x: i32, y: i32| {
        (0..width).contains(&x)
            && (0..height).contains(&y)
            && leaves.color[(y * width + x) as usize][3] > 0.99
    };
    let inside = |x: i32, y: i32| (-2..=2).all(|i| (-2..=2).all(|j| covered(x + i, y + j)));
    let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (x, y)));
    let opacity = |x: i32, y: i32| cut.color[(y * width + x) as usize][3];
    let holes = pixels.filter(|&(x, y)| inside(x, y) && opacity(x, y) < 0.9);
    holes.inspect(|&(x, y)| println!("hole at {x}, {y}: {}", opacity(x, y))).count()
}

#[test]
fn coarse_cuts_have_no_holes_and_look_like_the_leaves() {
    let set = knot(60_000);
    let hierarchy = Hierarchy::from_tree(build(&set, 1 << 16)).expect("a hierarchy");
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&Scene::new().with_hierarchy(hierarchy)).expect("prepared");
    for part in [0.9, 0.4, 0.25] {
        let camera = camera(&set.bounds(), part);
        let (leaves, all) =
            renderer.render(&mut prepared, &camera, &settings(0.0)).expect("a picture");
        let mut last = f64::INFINITY;
        for (pixels, least) in [(1.0, 40.0), (2.0, 30.0), (4.0, 24.0)] {
            let (cut, stats) =
                renderer.render(&mut prepared, &camera, &settings(pixels)).expect("a picture");
            let agreement = measured(&cut, &leaves);
            println!(
                "{part} {pixels}: {} of {} splats, {agreement:.1} dB",
                stats.splats, all.splats
            );
            assert_eq!(holes(&leaves, &cut), 0, "{part} {pixels}");
            assert!(agreement > least, "{part} {pixels}: {agreement:.1} dB");
            assert!(agreement <= last + 3.0, "a coarser cut agrees better");
            last = agreement;
        }
    }
}

#[test]
fn a_budget_of_splats_is_kept_and_used() {
    let set = knot(30_000);
    let hierarchy = Hierarchy::from_tree(build(&set, 4000)).expect("a hierarchy");
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&Scene::new().with_hierarchy(hierarchy)).expect("prepared");
    for most in [100, 1000, 10_000, 1_000_000] {
        let settings = Settings { detail: Detail::Splats(most), ..settings(0.0) };
        let camera = camera(&set.bounds(), 0.9);
        let (_, stats) = renderer.render(&mut prepared, &camera, &settings).expect("a picture");
        let all = set.splats.len() as u64;
        assert!(
            stats.splats <= most && stats.splats * 2 > most.min(all),
            "{} of {most}",
            stats.splats
        );
    }
}

/// If the cache holds few pages, coarse ones are drawn: the picture is less sharp, but whole. With
/// more capacity the picture comes closer to the one of all pages.
#[test]
fn a_page_cache_of_any_size_draws_a_whole_picture() {
    let set = knot(120_000);
    let tree = build(&set, 20_000);
    let mut renderer = renderer();
    let camera = camera(&set.bounds(), 0.9);
    let mut draw = |room: u64, detail: f64| {
        let hierarchy = Hierarchy::from_tree(tree.clone()).expect("a hierarchy");
        let mut prepared =
            renderer.prepare(&Scene::new().with_hierarchy(hierarchy)).expect("prepared");
        let settings = with_memory(settings(detail), room);
        renderer.render(&mut prepared, &camera, &settings).expect("a picture")
    };
    let (all, stats) = draw(1 << 30, 0.0);
    assert_eq!((stats.missing_pages, stats.splats), (0, set.splats.len() as u64));
    let mut last = 0.0;
    for pages in [4, 12, 24] {
        let (some, stats) = draw(pages * 4096 * 96, 0.0);
        assert!(stats.missing_pages > 0 && stats.splats < set.splats.len() as u64);
        assert_eq!(holes(&all, &some), 0, "{pages} pages");
        let agreement = measured(&some, &all);
        println!(
            "{pages} pages: {} missing, {} splats, {agreement:.1} dB",
            stats.missing_pages, stats.splats
        );
        assert!(agreement > last, "{agreement}");
        last = agreement;
    }
    // The memory limit of the device bounds the pages too, for all hierarchies together.
    let hierarchy = || Hierarchy::from_tree(tree.clone()).expect("a hierarchy");
    let scene = Scene::new().with_hierarchy(hierarchy()).with_hierarchy(hierarchy());
    let gpu = gpu().clone().with_memory(20 * 4096 * 96);
    let mut renderer = Renderer::new(&gpu);
    let mut prepared = renderer.prepare(&scene).expect("prepared");
    let (both, stats) = renderer.render(&mut prepared, &camera, &settings(0.0)).expect("a picture");
    assert!(stats.missing_pages > 0, "{stats:?}");
    assert_eq!(holes(&all, &both), 0);
}

/// Pages come and go while the view moves. The picture does not depend on which pages were loaded
/// before.
#[test]
fn a_view_looks_the_same_however_it_was_reached() {
    let set = knot(60_000);
    let tree = build(&set, 10_000);
    let mut renderer = renderer();
    let hierarchy = || Hierarchy::from_tree(tree.clone()).expect("a hierarchy");
    let mut wanderer =
        renderer.prepare(&Scene::new().with_hierarchy(hierarchy())).expect("prepared");
    for part in [0.1, 2.0, 0.9, 4.0, 0.3] {
        let camera = camera(&set.bounds(), part);
        let settings = with_memory(settings(2.0), 20 * 4096 * 96);
        let (picture, _) = renderer.render(&mut wanderer, &camera, &settings).expect("a picture");
        let mut fresh =
            renderer.prepare(&Scene::new().with_hierarchy(hierarchy())).expect("prepared");
        let (expected, _) = renderer.render(&mut fresh, &camera, &settings).expect("a picture");
        // The order of the splats differs, and with it the rounding of their sums.
        assert!(
            measured(&picture, &expected) > 60.0,
            "{part}: {:.1} dB",
            measured(&picture, &expected)
        );
    }
}

#[test]
fn a_closed_surface_looks_the_same_without_what_faces_away() {
    let set = knot(30_000);
    let hierarchy = Hierarchy::from_tree(build(&set, 1 << 16)).expect("a hierarchy");
    let mut renderer = renderer();
    let mut prepared = renderer.prepare(&Scene::new().with_hierarchy(hierarchy)).expect("prepared");
    for pixels in [0.0, 2.0] {
        let camera = camera(&set.bounds(), 0.9);
        let mut draw = |cull| {
            let settings = Settings { cull_backfaces: Some(cull), ..settings(pixels) };
            renderer.render(&mut prepared, &camera, &settings).expect("a picture")
        };
        let ((all, whole), (front, culled)) = (draw(false), draw(true));
        let agreement = measured(&front, &all);
        println!("{pixels}: {} of {} splats, {agreement:.1} dB", culled.splats, whole.splats);
        assert!(culled.splats * 10 < whole.splats * 8);
        assert!(agreement > 40.0, "{agreement:.1} dB");
    }
}

/// Back faces are left out only if the surface hides them: not if a clip opens it, and not from
/// within.
#[test]
fn an_opened_surface_shows_its_back() {
    let set = knot(30_000);
    let options = BuildOptions { closed: true, ..BuildOptions::default() };
    let tree = Tree::build(&set, &options, None).expect("a tree");
    let bounds = set.bounds();
    let scenes = [
        Scene::new().with_splats(set),
        Scene::new().with_hierarchy(Hierarchy::from_tree(tree).expect("one")),
    ];
    let mut renderer = renderer();
    let mut prepared = scenes.map(|scene| renderer.prepare(&scene).expect("prepared"));
    let outside = camera(&bounds, 0.9);
    let mut within = outside.clone();
    within.position = bounds.center()
        + 0.25 * (outside.position - bounds.center()).normalize() * bounds.diagonal();
    within.projection = Projection::Perspective { view_angle: 100.0 };
    let open = Clip {
        shape: ClipShape::HalfSpace { normal: DVec3::Z, offset: bounds.center().z },
        inside: true,
    };
    for (name, camera, clips, culls) in [
        ("whole", &outside, vec![], true),
        ("cut open", &outside, vec![open], false),
        ("within", &within, vec![], false),
    ] {
        let settings = Settings { clips, ..settings(0.0) };
        let [(expected, all), (picture, drawn)] = prepared
            .each_mut()
            .map(|prepared| renderer.render(prepared, camera, &settings).expect("a picture"));
        let agreement = measured(&picture, &expected);
        println!("{name}: {} of {} splats, {agreement:.1} dB", drawn.splats, all.splats);
        assert!(agreement > 40.0, "{name}: {agreement:.1} dB");
        assert_eq!(
            drawn.splats * 10 < all.splats * 8,
            culls,
            "{name}: {} of {}",
            drawn.splats,
            all.splats
        );
    }
}

/// Trees refuse optical depths so large that a picture would hold no numbers, as sets of splats do.
#[test]
fn optical_depths_beyond_what_can_be_drawn_are_refused() {
    let mut set = knot(500);
    let built = |set: &Surfels| Tree::build(set, &BuildOptions::default(), None);
    set.splats[7].strength = Splat::MOST_OPTICAL_DEPTH;
    let tree = built(&set).expect("a tree");
    let scene = Scene::new().with_hierarchy(Hierarchy::from_tree(tree).expect("a hierarchy"));
    let picture =
        reference::render(&scene, &camera(&scene.bounds(), 0.9), &settings(0.0)).expect("draws");
    assert!(picture.color.iter().flatten().all(|value| value.is_finite()));
    set.splats[7].strength *= 1.01;
    let error = built(&set).expect_err("too deep").to_string();
    assert!(
        error.contains("splat 7 at")
            && error.contains("optical depths from 0 to 1e10, can be merged"),
        "{error}"
    );
}

/// Normals that are smooth over edges are not the normals of the faces. Faces, not normals, decide
/// what faces away.
#[test]
fn smooth_normals_over_edges_lose_nothing() {
    let mut cube = Mesh::cube(2.0);
    cube.normals = cube.positions.iter().map(|place| place.normalize()).collect();
    let options = SurfelOptions { largest_spacing: 1.0 / 32.0, ..SurfelOptions::default() };
    let set = cube.surfels(&options).expect("surfels");
    assert!(cube.is_solid());
    let tree = Tree::build(&set, &BuildOptions { closed: true, ..BuildOptions::default() }, None)
        .expect("a tree");
    let file = to_bytes(&tree, &WriteOptions::default()).expect("a file");
    let file =
        Hierarchy::from_bytes(file, Path::new("memory"), &Limits::default()).expect("a hierarchy");
    assert!(file.check().is_sound(), "{:?}", file.check().findings);
    for tree in [file.read_tree().expect("a tree"), tree] {
        assert_eq!(validate(&tree), []);
        let (mut lost, mut counts) = (0, [0; 2]);
        for side in [-0.9, -0.5, 0.2, 0.7] {
            let camera = Camera::framing(&set.bounds(), DVec3::new(1.0, side, 0.3), DVec3::Z, 1.0);
            let [all, culled] = [false, true].map(|culls| {
                let view = camera.view([64, 64]).expect("a view");
                let cut = cut(&tree, &view, Detail::Pixels(2.0), Some(culls));
                counts[usize::from(culls)] += cut.splats.len();
                let scene = Scene::new().with_splats(cut);
                reference::render(&scene, &camera, &Settings::new([64, 64])).expect("draws").color
            });
            lost +=
                all.iter().zip(&culled).filter(|(all, culled)| culled[3] < all[3] - 0.1).count();
        }
        println!("{lost} pixels lost; {} of {} splats drawn", counts[1], counts[0]);
        assert!(lost == 0 && counts[1] < counts[0] * 95 / 100, "{lost} {counts:?}");
    }
}
