use splatkit::{hierarchy::*, io, surface::SurfelOptions};
use std::time::Instant;
fn main() {
    let path = std::env::args().nth(1).unwrap();
    let mesh = io::load_mesh(path.as_ref(), &io::Limits::default()).unwrap();
    let t = Instant::now();
    let set = mesh.surfels(&SurfelOptions::default()).unwrap();
    println!("surfels {} in {:?} ({} vertices)", set.splats.len(), t.elapsed(), mesh.positions.len());
    for preset in [Preset::Fastest, Preset::Fast, Preset::Balanced, Preset::Slow, Preset::Best] {
        let t = Instant::now();
        let tree = Tree::build(&set, &BuildOptions { preset, ..Default::default() }, &|_, _| ()).unwrap();
        let time = t.elapsed().as_secs_f64();
        let nodes = tree.nodes().count();
        let inner: f64 = tree.nodes().filter(|n| !n.is_leaf()).map(|n| f64::from(n.radius)).sum();
        let root = tree.blocks[0].nodes[0];
        println!(
            "{preset:?}: {:.0} ms, {:.2} M/s, {} nodes ({:.3} a leaf), sum of radii {inner:.4}, root {} size {}",
            time * 1e3,
            set.splats.len() as f64 / time / 1e6,
            nodes,
            nodes as f64 / set.splats.len() as f64,
            root.radius,
            root.size
        );
    }
}
