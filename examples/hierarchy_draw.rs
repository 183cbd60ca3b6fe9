use glam::DVec3;
use splatkit::{compare, engine::*, hierarchy::*, io, math::*, scene::*, surface::SurfelOptions};
use std::{sync::Arc, time::Instant};
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let size: u32 = std::env::args().nth(2).map_or(1024, |s| s.parse().unwrap());
    let mesh = io::load_mesh(path.as_ref(), &io::Limits::default()).unwrap();
    let set = mesh.surfels(&SurfelOptions::default()).unwrap();
    let tree = Tree::build(&set, &BuildOptions::default(), &|_, _| ()).unwrap();
    println!("{} blocks, {} leaves", tree.blocks.len(), tree.leaf_count());
    let hierarchy = Arc::new(Hierarchy::from_tree(tree.clone()).unwrap());
    let gpu = Gpu::headless(&AdapterChoice::Automatic).unwrap();
    let mut renderer = Renderer::new(&gpu);
    let plain = Scene::new().with_splats(set);
    let mut settings = Settings::new([size, size]);
    let scene = Scene::new().with_hierarchy(hierarchy.clone());
    let mut prepared = renderer.prepare(&scene).unwrap();
    let mut flat = renderer.prepare(&plain).unwrap();
    for zoom in [1.0, 0.25, 0.0625] {
        let mut camera = Camera::framing(&plain.bounds(), DVec3::Z, DVec3::Y, 1.0);
        camera.position = camera.focal_point + (camera.position - camera.focal_point) / zoom;
        let (truth, stats) = renderer.render(&mut flat, &camera, &settings).unwrap();
        println!("zoom {zoom}: plain splats {} entries {}", stats.splats, stats.entries);
        let t = Instant::now();
        renderer.draw(&mut flat, &camera, &settings).unwrap();
        println!("  {:?}", t.elapsed());
        for pixels in [0.0, 0.5, 1.0, 2.0, 4.0] {
            settings.detail = Detail::Pixels(pixels);
            let (picture, stats) = renderer.render(&mut prepared, &camera, &settings).unwrap();
            let t = Instant::now();
            renderer.draw(&mut prepared, &camera, &settings).unwrap();
            let time = t.elapsed();
            let view = camera.view(settings.size).unwrap();
            let oracle = tree.selected(&Cut::new(&view, tree.origin, pixels, false));
            let c = compare::compare(&bytes(&truth), &bytes(&picture), [size; 2]).unwrap();
            println!(
                "  cut {pixels}: {} splats (CPU {}), {:?} dB, {time:?}, {:?}",
                stats.splats,
                oracle.len(),
                c.psnr,
                stats.missing_pages
            );
            std::fs::write(
                format!("/tmp/h_{zoom}_{pixels}.png"),
                picture.encode(splatkit::picture::PictureFormat::Png, None).unwrap(),
            )
            .unwrap();
        }
        let t = Instant::now();
        let p = renderer.profile(&mut prepared, &camera, &settings).unwrap();
        println!("  {:?} {:?}", t.elapsed(), p.steps);
        settings.detail = Detail::Splats(20000);
        let (_, stats) = renderer.render(&mut prepared, &camera, &settings).unwrap();
        println!("  budget 20000: cut {} splats {}", stats.cut_pixels, stats.splats);
    }
}
fn bytes(p: &splatkit::picture::Picture) -> Vec<u8> {
    p.color.iter().flat_map(|c| [c[0], c[1], c[2], 1.0].map(|v| (v.clamp(0.0, 1.0) * 255.0).round() as u8)).collect()
}
