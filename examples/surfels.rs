//! Times the conversion of a mesh to surfels: `cargo run --release --example surfels -- mesh.ply`.

use splatkit::{formats::load_mesh, input::Limits, surface::SurfelOptions};
use std::{path::Path, time::Instant};

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = std::env::args().nth(1).ok_or("name a mesh file")?;
    let mesh = load_mesh(Path::new(&path), &Limits::default())?;
    for _ in 0..5 {
        let start = Instant::now();
        let surfels = mesh.surfels(&SurfelOptions::default())?.splats.len();
        let seconds = start.elapsed().as_secs_f64();
        let millions = mesh.positions.len() as f64 / 1e6;
        println!(
            "{millions:.2} M vertices, {surfels} surfels: {seconds:.3} s, {:.2} M vertices/s",
            millions / seconds
        );
    }
    Ok(())
}
