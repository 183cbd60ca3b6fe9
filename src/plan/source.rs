//! The placement of an item's candidates in a view: splats around an origin, or samples of a
//! lattice.

use crate::{
    hierarchy::file::Header,
    math::{Kernel, Profile, View},
    splat::{Common, FOOTPRINT_BLUR, Payload, TRAINED_BLUR, TRAINED_BLUR_ALONG},
    volume::Lattice,
};
use glam::{DMat3, DVec3, Mat3, Vec3};

/// Candidates in a view, in 32 bits.
#[derive(Debug, Clone, Copy, Default)]
pub struct Source {
    /// To view space from the item's own frame (explicit splats), or from lattice steps.
    pub to_view: Mat3,
    /// The origin in view space.
    pub origin: Vec3,
    /// Lattices: the kernel's covariance in view space.
    pub covariance: Mat3,
    /// Lattices: the kernel's unit, in steps.
    pub unit: f32,
    /// Radius of the footprint in standard deviations.
    pub extent: f32,
    /// Splats carry colours.
    pub has_radiance: bool,
    /// Splats are trained Gaussians.
    pub is_trained: bool,
    /// The kernel ends at its extent along the ray too.
    pub ends: bool,
}

impl Source {
    /// Returns the standard deviations, in pixels, by which splats are widened: across the view's
    /// axis and along it.
    pub fn blur(&self) -> [f32; 2] {
        let blur = match self.is_trained {
            false => [FOOTPRINT_BLUR; 2],
            true => [TRAINED_BLUR, TRAINED_BLUR * TRAINED_BLUR_ALONG],
        };
        blur.map(|blur| blur as f32)
    }

    /// Returns the source of explicit splats.
    pub fn of_splats(view: &View, set: &Common) -> Self {
        Self {
            has_radiance: !matches!(set.payload, Payload::Scalar { .. }),
            is_trained: set.payload == Payload::Trained,
            ..Self::of_radiance(view, set.origin, set.extent)
        }
    }

    /// Returns the source of nodes of a hierarchy.
    pub fn of_nodes(view: &View, header: &Header) -> Self {
        let is_trained = header.degree.is_some();
        Self { is_trained, ..Self::of_radiance(view, header.origin, header.extent) }
    }

    /// Returns the source of radiance splats around an origin in the world.
    pub fn of_radiance(view: &View, origin: DVec3, extent: f32) -> Self {
        Self {
            to_view: view.rotation.as_mat3(),
            origin: view.to_view(origin).as_vec3(),
            extent,
            has_radiance: true,
            ..Self::default()
        }
    }

    /// Returns the source of a lattice whose samples have this kernel. Rectilinear coordinates are
    /// relative to the first sample.
    pub fn of_lattice(view: &View, lattice: &Lattice, kernel: &Kernel) -> Self {
        let axes = view.rotation * lattice.axes;
        let kernel_axes = axes * DMat3::from_diagonal(lattice.unit([0; 3]) * kernel.unit());
        Self {
            to_view: axes.as_mat3(),
            origin: view.to_view(lattice.position(lattice.step_range().min)).as_vec3(),
            covariance: (kernel_axes * kernel_axes.transpose()).as_mat3(),
            unit: kernel.unit() as f32,
            extent: kernel.radius() as f32,
            ends: !matches!(kernel.profile, Profile::Gaussian(_)),
            ..Self::default()
        }
    }
}
