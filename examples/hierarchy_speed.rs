//! Times the conversion of a mesh to surfels and a hierarchy, by preset and block size:
//! `cargo run --release --example hierarchy_speed -- mesh.ply`

use splatkit::{
    formats,
    hierarchy::{BuildOptions, Preset, Tree},
    input::Limits,
    surface::SurfelOptions,
};
use std::{error::Error, path::PathBuf, time::Instant};

fn main() -> Result<(), Box<dyn Error>> {
    let path = PathBuf::from(std::env::args().nth(1).ok_or("name a mesh file")?);
    let mesh = formats::load_mesh(&path, &Limits::default())?;
    let vertices = mesh.positions.len() as f64;
    let start = Instant::now();
    let set = mesh.surfels(&SurfelOptions::default())?;
    let surfels = start.elapsed().as_secs_f64();
    println!("{vertices} vertices, {} surfels: {:.0} ms", set.splats.len(), surfels * 1e3);
    for preset in [Preset::Fastest, Preset::Fast, Preset::Balanced, Preset::Slow, Preset::Best] {
        for block_splats in [1 << 13, 1 << 14, 1 << 15, 1 << 16] {
            let start = Instant::now();
            let options = BuildOptions { preset, block_splats, ..BuildOptions::default() };
            let tree = Tree::build(&set, &options, &|_, _| ())?;
            let built = start.elapsed().as_secs_f64();
            let rate = vertices / (surfels + built) / 1e6;
            let nodes = tree.nodes().count() as f64 / set.splats.len() as f64;
            println!(
                "{preset:?} {block_splats}: {:.0} ms, {nodes:.3} nodes per leaf; {rate:.2} M \
                 vertices/s in total",
                built * 1e3
            );
        }
    }
    Ok(())
}
