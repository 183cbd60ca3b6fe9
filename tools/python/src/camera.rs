//! Cameras, and how they are fitted to scenes, as Python says it.

use crate::errors::{options, wrong};
use splatkit::{
    Error,
    math::Camera,
    session::{CameraEntry, Framing},
};

/// Reads how a camera looks at a scene.
pub fn framing(text: &str) -> Result<Framing, Error> {
    let framing: Framing = options(text)?;
    framing.validate().map_err(wrong)?;
    Ok(framing)
}

/// Reads a camera that Python has written.
pub fn camera(text: &str) -> Result<Camera, Error> {
    options::<CameraEntry>(text)?.camera().map_err(wrong)
}

/// Returns a camera as JSON, which [`camera`] reads.
pub fn to_json(camera: &Camera) -> String {
    serde_json::json!(CameraEntry::from(camera)).to_string()
}
