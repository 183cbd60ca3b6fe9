//! Pictures: those of both engines against the reference, and against what a picture must show.

mod bricks;
mod cases;
mod cells;
mod cpu_engine;
mod edges;
mod faults;
mod gathered_lattices;
mod gaussians;
mod gpu_engine;
mod hierarchies;
mod hosts;
mod images;
mod items;
mod labels;
mod layers;
mod lights;
mod near;
mod occlusion;
mod opacity;
mod outliers;
mod poison;
#[path = "../scenes/mod.rs"]
mod scenes;
mod several_fields;
mod sharp_volumes;
mod small_pictures;
mod stripes;
mod tensor_kernels;
#[path = "../testing/mod.rs"]
mod testing;
mod units;
mod what_engines_draw;
