//! Volumes: samples on a lattice, and the transfer functions that show them.

mod head;
mod lattice;
pub mod phantoms;
mod presets;
pub mod reach;
mod samples;
mod transfer;

pub use lattice::{Arrangement, Lattice};
pub(crate) use samples::each_type;
pub use samples::{Coefficients, Samples, Volume};
pub use transfer::{Isosurface, Shade, TransferFunction};
