//! What every window shares, without a window: cameras that a hand moves, the effort of each frame,
//! and scene files.
//!
//! A front end (desktop, browser, notebook) holds an [`Orbit`] and a [`Pace`]. It draws frames with
//! the [`Effort`] that the pace chooses, tells the pace what they took, and goes on until the pace
//! says that the exact picture is shown. A [`SceneFile`] keeps what is shown.

mod orbit;
mod pace;
mod scene_file;

pub use orbit::{Orbit, point_at};
pub use pace::{Effort, Pace};
pub use scene_file::{CameraEntry, ClipEntry, InputEntry, SceneFile};
