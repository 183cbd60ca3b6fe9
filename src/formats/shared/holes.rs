//! Volumes of files whose samples may lack a value.

pub(crate) use crate::volume::holes::{all_missing, fill_with, is_hole, measure};
use crate::{
    Result,
    formats::ReadOptions,
    input::Source,
    volume::{Lattice, Samples, Volume},
};

/// Puts samples on a lattice, as [`Volume::with_missing`] does.
///
/// # Errors
/// [`Error::Input`](crate::Error::Input) for samples that do not fill the lattice, for an invalid
/// lattice, and if no sample has a value.
pub(crate) fn volume(
    source: &Source,
    lattice: Lattice,
    samples: Samples,
    options: &ReadOptions,
) -> Result<Volume> {
    Volume::filled(lattice, samples, options.missing)
        .map_err(|message| source.error("samples", message))
}
