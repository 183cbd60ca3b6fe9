//! Pure functions shared by everything downstream: the camera, the sheets and the kernel.

mod camera;
mod kernel;
mod sheets;

pub use camera::{Bounds, Camera, Projection, View};
pub use kernel::{Kernel, Profile};
pub use sheets::Sheets;
