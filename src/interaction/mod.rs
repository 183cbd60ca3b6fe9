//! What every window shares: no window here.
//!
//! A window, a browser page and a notebook ask the same questions of a scene. How often is each
//! value ([`Histogram`])? What lies under the cursor ([`Probe`])? What does a cut across a volume
//! look like ([`Slice`])? The answers are plain numbers and bytes.

mod field;
mod histogram;
mod probe;
mod slice;

pub use histogram::{Histogram, Joint};
pub use probe::Probe;
pub use slice::{Shading, Slice};
