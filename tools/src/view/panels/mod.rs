//! The panels: each shows a model, and returns what the user asks for.

pub mod appearance;
pub mod clips;
pub mod flight;
pub mod frame;
pub mod inputs;
mod lists;
pub mod menu;
pub mod selection;
pub mod transfer;

use super::curve::plain;
