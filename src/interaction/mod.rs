//! What every window shares, without a window: cameras that a hand moves, the effort of each frame,
//! and what a window asks about a scene.
//!
//! A front end (desktop, browser, notebook) holds an [`Orbit`] and a [`Pace`]. It draws frames with
//! the [`Effort`] that the pace chooses, tells the pace what they took, and goes on until the pace
//! says that the exact picture is shown. A [`Description`](crate::session::Description) keeps what
//! is shown.
//!
//! All ask the same questions. How often is each value ([`Histogram`])? What lies under the cursor
//! ([`Probe`])? What does a cut across a volume look like ([`Slice`])? The answers are plain
//! numbers and bytes.

mod field;
mod histogram;
mod orbit;
mod pace;
mod probe;
mod slice;

pub use histogram::{Histogram, Joint};
pub use orbit::{Orbit, point_at};
pub use pace::{Effort, Pace};
pub use probe::Probe;
pub use slice::{Shading, Slice};
