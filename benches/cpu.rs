//! Benchmarks of the parts that run on the CPU: `cargo bench`. Inputs are generated, and small
//! enough that each benchmark takes milliseconds.

use criterion::{BatchSize, Criterion, criterion_group, criterion_main};
use glam::DVec3;
use splatkit::{
    formats::{self, Endian, RawLayout, ReadOptions, SampleType},
    hierarchy::{
        BuildOptions, Hierarchy, Tree,
        file::{WriteOptions, to_bytes},
    },
    input::Limits,
    math::Kernel,
    splat::Surfels,
    surface::{Mesh, SurfelOptions},
    volume::{Volume, phantoms::Phantom, reach::neighbourhood_ranges},
};
use std::{hint::black_box, path::Path};

/// Samples along each side of the volume.
const SIDE: usize = 96;

fn mesh() -> Mesh {
    Mesh::knot(480, 40)
}

fn surfels() -> Surfels {
    mesh().surfels(&SurfelOptions::default()).expect("surfels of a knot")
}

fn volume() -> Volume {
    Phantom::Specimen.sample_bytes([SIDE; 3]).expect("a volume")
}

fn reading(criterion: &mut Criterion) {
    let limits = Limits::default();
    let folder = tempfile::tempdir().expect("a folder");
    let ply = folder.path().join("knot.ply");
    formats::ply::write(&mesh(), &ply).expect("a mesh is written");
    criterion.bench_function("read a binary PLY file", |bench| {
        bench.iter(|| {
            formats::load_mesh(black_box(&ply), &limits, &ReadOptions::default()).expect("a mesh")
        });
    });
    let raw = folder.path().join("specimen.raw");
    let values = volume();
    let bytes: Vec<u8> = (0..values.len()).map(|index| values.value(index) as u8).collect();
    std::fs::write(&raw, bytes).expect("samples are written");
    let layout = RawLayout {
        dims: [SIDE; 3],
        sample_type: SampleType::U8,
        spacing: DVec3::ONE,
        endian: Endian::default(),
        header: 0,
    };
    criterion.bench_function("read a raw volume", |bench| {
        bench.iter(|| {
            formats::load_volume(black_box(&raw), &limits, &ReadOptions::raw(Some(&layout)))
                .expect("a volume")
        });
    });
}

fn surfaces(criterion: &mut Criterion) {
    let (mesh, set) = (mesh(), surfels());
    criterion.bench_function("surfels of a mesh", |bench| {
        bench.iter(|| black_box(&mesh).surfels(&SurfelOptions::default()).expect("surfels"));
    });
    let build = || Tree::build(black_box(&set), &BuildOptions::default(), None).expect("a tree");
    criterion.bench_function("build a tree", |bench| bench.iter(build));
    let tree = build();
    let encode = || to_bytes(black_box(&tree), &WriteOptions::default()).expect("a file");
    criterion.bench_function("encode a hierarchy", |bench| bench.iter(encode));
    let bytes = encode();
    let decode = |bytes| {
        let hierarchy = Hierarchy::from_bytes(bytes, Path::new("memory"), &Limits::default())
            .expect("a hierarchy");
        hierarchy.read_tree().expect("a tree")
    };
    criterion.bench_function("decode a hierarchy", |bench| {
        bench.iter_batched(|| bytes.clone(), decode, BatchSize::LargeInput);
    });
}

fn volumes(criterion: &mut Criterion) {
    let (volume, kernel) = (volume(), Kernel::default());
    let reach = volume.lattice.reach(kernel.extent);
    criterion.bench_function("ranges of neighbourhoods", |bench| {
        bench.iter(|| neighbourhood_ranges(black_box(&volume), reach));
    });
    let sharpen = |volume: Volume| volume.sharpened(&kernel).expect("a sharp volume");
    criterion.bench_function("sharpen a volume", |bench| {
        bench.iter_batched(|| volume.clone(), sharpen, BatchSize::LargeInput);
    });
}

criterion_group! {
    name = benches;
    config = Criterion::default().sample_size(10);
    targets = reading, surfaces, volumes
}
criterion_main!(benches);
