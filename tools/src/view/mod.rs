//! The window of `splatkit view`.

pub mod curve;
pub mod slices;
