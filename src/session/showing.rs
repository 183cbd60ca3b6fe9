//! How an input is shown.

use super::{Appearance, Coloring, Glyphs};
use crate::{
    Deadline, Error, Result,
    cells::{SolidOptions, Tint},
    facet::Size,
    math::Kernel,
    scattered::SampleOptions,
    surface::{PointStyle, SurfelOptions},
};
use serde::{Deserialize, Serialize};

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
    /// ([`Opened::give_radii`](super::Opened::give_radii)).
    pub point_radius: Option<String>,
    /// The width of lines.
    pub line_width: Option<Size>,
    /// The glyphs of an array, which are drawn instead of the input
    /// ([`Opened::glyphs`](super::Opened::glyphs)).
    pub glyphs: Option<Glyphs>,
    /// A factor on their size.
    pub glyph_scale: Option<f64>,
    /// Whether the edges of triangles are drawn.
    pub draws_edges: bool,
    /// How cells are drawn; by default as a solid, unless another option shows the field inside.
    pub cells: Option<CellStyle>,
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
            glyphs: None,
            glyph_scale: None,
            draws_edges: false,
            cells: None,
            is_named: false,
            values_by: None,
            deadline: Deadline::default(),
        }
    }
}

/// How cells are drawn.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize)]
#[serde(rename_all = "lowercase")]
#[cfg_attr(test, derive(schemars::JsonSchema))]
pub enum CellStyle {
    /// As an opaque body: their boundary, and the field inside where clips cut it.
    Solid,
    /// As a field, by a transfer function.
    Volume,
}

impl CellStyle {
    /// The names that [`named`](Self::named) accepts.
    pub const NAMES: [&str; 2] = ["solid", "volume"];

    /// Returns the style of a name.
    ///
    /// # Errors
    /// [`Error::Argument`] for another name.
    pub fn named(name: &str) -> Result<Self> {
        match name {
            "solid" => Ok(Self::Solid),
            "volume" => Ok(Self::Volume),
            _ => {
                let names = Self::NAMES.join(" or ");
                Err(Error::Argument(format!("cells are drawn as {names}, not as “{name}”")))
            }
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

    /// Returns how cells are drawn.
    ///
    /// # Errors
    /// [`Error::Argument`] for a solid with options that only a field has.
    pub fn cell_style(&self) -> Result<CellStyle> {
        let Appearance { transfer, opacity_unit, isosurfaces, gradient, .. } = &self.appearance;
        let of_field = [
            ("a transfer function", transfer.is_some()),
            ("a unit of opacities", opacity_unit.is_some()),
            ("isosurfaces", !isosurfaces.is_empty()),
            ("an opacity by gradients", !gradient.is_empty()),
        ];
        let asked = of_field.into_iter().find(|(_, is_given)| *is_given);
        match (self.cells, asked) {
            (Some(CellStyle::Solid), Some((what, _))) => Err(Error::Argument(format!(
                "cells that are drawn as a solid have no use for {what}: leave it out, or draw \
                 them as a volume"
            ))),
            (Some(style), _) => Ok(style),
            (None, Some(_)) => Ok(CellStyle::Volume),
            (None, None) => Ok(CellStyle::Solid),
        }
    }

    /// Returns how cells become a solid that `tint` colours.
    pub(super) fn solid_options(&self, tint: Tint) -> SolidOptions {
        let mut options = SolidOptions::new(tint);
        options.has_edges = self.draws_edges;
        let surface = &mut options.surface;
        surface.deadline = self.deadline;
        if let Some(crease) = self.crease {
            surface.crease_angle_degrees = crease.max(0.01);
        }
        options
    }

    /// Checks what does not depend on an input.
    ///
    /// # Errors
    /// [`Error::Argument`] for values outside of their ranges, and for options that contradict each
    /// other.
    pub fn validate(&self) -> Result<()> {
        self.samples.validate()?;
        self.cell_style()?;
        self.surfel_options(Surfaces::Both).validate()
    }

    /// Returns how a mesh or point cloud becomes surfels or facets.
    pub fn surfel_options(&self, surfaces: Surfaces) -> SurfelOptions {
        let mut options = SurfelOptions { deadline: self.deadline, ..SurfelOptions::default() };
        (options.points, options.point_size) = (self.points, self.point_size);
        options.line_width = self.line_width;
        options.radius_scale *= self.radius_scale.unwrap_or(1.0);
        options.color_by_normal = self.coloring().by_normal();
        // Triangles of one plane still join. Larger angles than 60 leave the choice to the mesh.
        let crease = self.crease.map(|crease| crease.clamp(0.01, 60.0));
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
