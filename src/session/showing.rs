//! How an input is shown.

use super::{Appearance, Coloring};
use crate::{
    Deadline, Result,
    facet::Size,
    math::Kernel,
    scattered::SampleOptions,
    surface::{PointStyle, SurfelOptions},
};

/// How one input is shown. What is not given follows from its data.
#[derive(Debug, Clone)]
pub struct Showing {
    /// How values are shown, and how surfaces are coloured.
    pub appearance: Appearance,
    /// The kernel of the samples of a volume.
    pub kernel: Kernel,
    /// Whether a volume is sharpened, so that its kernels interpolate its samples.
    pub is_sharp: bool,
    /// How scattered samples become splats.
    pub samples: SampleOptions,
    /// A factor on the radii of surfels.
    pub radius_scale: Option<f32>,
    /// The angle between triangles, in degrees, from which on a crease looks sharp.
    pub crease: Option<f32>,
    /// The share of the light that a surface absorbs, above 0 to 1.
    pub opacity: Option<f32>,
    /// How points are drawn.
    pub points: PointStyle,
    /// The diameter of points that are drawn as balls or discs.
    pub point_size: Option<Size>,
    /// The array that holds the radii of points
    /// ([`Reading::give_radii`](super::Reading::give_radii)).
    pub point_radius: Option<String>,
    /// The width of lines.
    pub line_width: Option<Size>,
    /// Whether the edges of triangles are drawn.
    pub draws_edges: bool,
    /// Whether the user named the values that were read.
    pub is_named: bool,
    /// An option that shows values, if one is given: of a volume that has colours, it shows the
    /// brightness.
    pub values_by: Option<String>,
    /// By when the splats must be made.
    pub deadline: Deadline,
}

impl Default for Showing {
    fn default() -> Self {
        Self {
            appearance: Appearance::default(),
            kernel: Kernel::default(),
            is_sharp: false,
            samples: SampleOptions::default(),
            radius_scale: None,
            crease: None,
            opacity: None,
            points: PointStyle::Auto,
            point_size: None,
            point_radius: None,
            line_width: None,
            draws_edges: false,
            is_named: false,
            values_by: None,
            deadline: Deadline::default(),
        }
    }
}

/// What meshes become.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Surfaces {
    /// Surfels, for methods that draw nothing else.
    Surfels,
    /// Facets where triangles can be larger than pixels, else surfels.
    Facets,
    /// Facets, too, and surfels once a picture needs them. The mesh is kept until then.
    #[default]
    Both,
}

impl Showing {
    /// Returns how values become colours, and by what surfaces are coloured.
    pub fn coloring(&self) -> &Coloring {
        &self.appearance.coloring
    }

    /// Checks what does not depend on an input.
    ///
    /// # Errors
    /// [`Error::Argument`](crate::Error::Argument) for values outside of their ranges.
    pub fn validate(&self) -> Result<()> {
        self.samples.validate()?;
        self.surfel_options(Surfaces::Both).validate()
    }

    /// Returns how a mesh or point cloud becomes surfels or facets.
    pub fn surfel_options(&self, surfaces: Surfaces) -> SurfelOptions {
        let mut options = SurfelOptions { deadline: self.deadline, ..SurfelOptions::default() };
        (options.points, options.point_size) = (self.points, self.point_size);
        options.line_width = self.line_width;
        options.radius_scale *= self.radius_scale.unwrap_or(1.0);
        options.color_by_normal = self.coloring().by_normal();
        // Triangles of one plane still join.
        let crease = self.crease.map(|crease| crease.max(0.01));
        options.crease_angle_degrees = crease.unwrap_or(options.crease_angle_degrees);
        let opacity = self.opacity.filter(|opacity| *opacity < 1.0);
        if let Some(opacity) = opacity {
            options.optical_depth = -(1.0 - opacity).ln();
        }
        // Radii are for surfels, and facets are opaque.
        if surfaces == Surfaces::Surfels || self.radius_scale.is_some() || opacity.is_some() {
            options.most_facets = 0;
        }
        options
    }
}
