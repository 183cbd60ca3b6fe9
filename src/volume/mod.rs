//! Volumes: samples on a lattice, and the transfer functions that give them colour and opacity.

mod automatic;
mod coarser;
mod colored;
#[cfg(test)]
mod contradictions;
mod grid;
mod head;
pub(crate) mod holes;
mod labels;
mod lattice;
mod moved;
pub(crate) mod overshoot;
pub mod phantoms;
mod prefilter;
mod presets;
pub mod reach;
mod reconstruct;
mod resample;
mod samples;
mod scalar;
mod shade;
mod shared;
mod sharp;
pub(crate) mod steps;
mod transfer;

pub(crate) use labels::{OWN_DEVIATION, OWN_REACH, label_shares};
pub use lattice::{Arrangement, Lattice};
pub use reconstruct::Reconstruction;
pub use resample::body_centred;
pub use samples::{Coefficients, Samples, Volume};
pub(crate) use samples::{SampleVecs, each_type};
pub use scalar::Scalar;
pub use shade::Shade;
pub use shared::{SampleSlice, SharedSamples};
pub use transfer::{Isosurface, TransferFunction};
