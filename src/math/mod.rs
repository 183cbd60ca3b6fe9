//! Pure functions shared by everything downstream: the camera, the sheets and the kernel.

mod camera;
pub(crate) mod cosine;
mod kernel;
mod sheets;

pub use camera::{Bounds, Camera, Projection, View};
pub use kernel::{Kernel, Profile};
pub use sheets::Sheets;
