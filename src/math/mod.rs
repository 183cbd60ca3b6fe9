//! Pure functions that the rest builds on: the camera and its path, the sheets, the kernel, and
//! points in space.

mod camera;
mod clip;
pub(crate) mod cosine;
mod eigen;
mod factor;
mod fit;
pub(crate) mod hull;
pub(crate) mod keep;
mod kernel;
mod matrices;
pub(crate) mod neighbours;
mod path;
mod pose;
pub(crate) mod sets;
mod sheets;
pub(crate) mod weld;

pub use camera::{Bounds, Camera, Projection, View, Viewpoint};
pub use clip::{Clip, ClipShape};
pub(crate) use eigen::eigen;
pub(crate) use factor::lower;
pub use kernel::{Kernel, Profile, Tensor};
pub use path::{CameraPath, Keyframe};
pub use pose::Pose;
pub use sheets::Sheets;
