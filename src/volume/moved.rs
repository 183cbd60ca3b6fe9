//! Volumes that are moved: another lattice for the same samples.

use super::{Coefficients, Lattice, Samples, SharedSamples, Volume};
use crate::{about::Orientation, math::Pose};
use bytes::Bytes;
use glam::DMat3;
use std::sync::Arc;

/// A volume that owns samples which others share.
struct Owner(Arc<Volume>);

impl AsRef<[u8]> for Owner {
    fn as_ref(&self) -> &[u8] {
        self.0.samples.bytes()
    }
}

impl Volume {
    /// Returns the volume moved. Its samples are shared; the coefficients of a sharp volume are
    /// copied.
    pub(crate) fn moved(self: Arc<Self>, pose: &Pose) -> Self {
        let turn = DMat3::from_quat(pose.rotation);
        let lattice = |lattice: &Lattice| Lattice {
            origin: pose.apply(lattice.origin),
            axes: turn * lattice.axes,
            ..lattice.clone()
        };
        let samples = match &self.samples {
            Samples::Shared(samples) => Samples::Shared(samples.clone()),
            // Lists of samples are aligned for their type.
            samples => SharedSamples::new(samples.scalar(), Bytes::from_owner(Owner(self.clone())))
                .map_or_else(|_| samples.clone(), Samples::Shared),
        };
        let mut about = self.about.clone();
        about.orientation = about
            .orientation
            .map(|Orientation { up, front }| Orientation { up: turn * up, front: turn * front });
        let coefficients = self.coefficients.as_deref().map(|coefficients| {
            let lattice = lattice(&coefficients.lattice);
            Arc::new(Coefficients { lattice, ..coefficients.clone() })
        });
        Self {
            lattice: lattice(&self.lattice),
            samples,
            range: self.range,
            coefficients,
            colors: self.colors.clone(),
            more_channels: Vec::new(),
            opacities: self.opacities.clone(),
            about,
        }
    }
}
