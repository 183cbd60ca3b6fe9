//! Volumes: samples on a lattice, and the transfer functions that show them.

mod lattice;

pub use lattice::{Lattice, Samples, Volume};
