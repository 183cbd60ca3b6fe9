//! The formats whose points are read in pieces.

use super::{las, ply};

/// What the pieces of a file are, by format.
pub(super) enum Form {
    Ply(ply::Pieces),
    Las(las::Pieces),
}
