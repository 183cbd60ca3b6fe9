//! Volumes: samples on a lattice, and the transfer functions that show them.

mod lattice;
mod presets;
mod samples;
mod transfer;

pub use lattice::Lattice;
pub(crate) use samples::each_type;
pub use samples::{Samples, Volume};
pub use transfer::{Shade, TransferFunction};
