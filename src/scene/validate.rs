//! Whether the engines can draw a scene, and with which settings.

use super::{ClipShape, Gradient, Item, Mode, Optics, Region, Scene, Settings, numbers};
use crate::{
    Error, Result,
    cells::{Place, Tetrahedra},
    math::{Bounds, Kernel, Profile, Tensor},
    volume::{Arrangement, Lattice, TransferFunction, Volume},
};

impl Scene {
    /// Checks that the scene can be drawn with these settings, in addition to
    /// [`validate`](Self::validate): finite numbers, non-empty clips, and options that can be
    /// combined.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason.
    pub fn validate_settings(&self, settings: &Settings) -> Result<()> {
        numbers::check_settings(settings)?;
        check_size(settings.size)?;
        check_clips(settings)?;
        check_region(settings)?;
        for (number, item) in self.items.iter().enumerate() {
            // The transfer function may have changed since the scene was validated.
            numbers::check_transfer(item).map_err(numbers::of_item(number))?;
            check_item(item, settings)?;
        }
        if self.fields().len() > 1 { check_several(settings) } else { Ok(()) }
    }

    /// As [`validate_settings`](Self::validate_settings), for what an engine draws at once.
    pub(crate) fn validate_drawn(&self, settings: &Settings) -> Result<()> {
        self.validate_settings(settings)?;
        if settings.optics == Optics::Maximum && self.fields().len() > 1 {
            return wrong(
                "an engine draws the maximum intensity picture of one volume or sample set; \
                 `Renderer::render` adds those of several",
            );
        }
        Ok(())
    }

    /// Checks that the engines can draw the scene: finite numbers (the error names the item and the
    /// splat), and at most [`MAX_FIELDS`](Self::MAX_FIELDS) fields.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason; [`Error::NothingToDraw`] for a scene without splats and
    /// samples.
    pub fn validate(&self) -> Result<()> {
        (0..self.items.len()).try_for_each(|number| self.validate_item(number))?;
        self.validate_fields()?;
        if self.bounds().is_empty() {
            return Err(Error::NothingToDraw("the scene contains no splats".into()));
        }
        Ok(())
    }

    /// Like [`validate`](Self::validate), but a scene without items is one to which they are added
    /// later.
    pub(crate) fn validate_unless_empty(&self) -> Result<()> {
        if self.items.is_empty() { Ok(()) } else { self.validate() }
    }

    /// Returns an error if there is nothing to draw.
    pub(crate) fn check_items(&self) -> Result<()> {
        match self.items.is_empty() {
            true => Err(Error::NothingToDraw("the scene contains no items".into())),
            false => Ok(()),
        }
    }

    /// Checks one item.
    pub(crate) fn validate_item(&self, number: usize) -> Result<()> {
        numbers::check_item(&self.items[number]).map_err(numbers::of_item(number))
    }

    /// Checks the number of fields.
    pub(crate) fn validate_fields(&self) -> Result<()> {
        let (fields, most) = (self.fields().len(), Self::MAX_FIELDS);
        if fields > most {
            return Err(Error::Argument(format!(
                "a picture can show {most} volumes, sample sets and sets of cells together; the \
                 scene has {fields}"
            )));
        }
        Ok(())
    }
}

fn check_size([width, height]: [u32; 2]) -> Result<()> {
    let most = Settings::MAX_PIXELS;
    if u64::from(width) * u64::from(height) > most {
        return wrong(format!("a picture of {width}x{height} pixels is larger than {most} pixels"));
    }
    Ok(())
}

/// Returns an error if there are too many clips, or if one of them has no shape.
fn check_clips(settings: &Settings) -> Result<()> {
    if settings.clips.len() > Settings::MAX_CLIPS {
        return wrong(format!(
            "there are {} clips; at most {} are allowed",
            settings.clips.len(),
            Settings::MAX_CLIPS
        ));
    }
    for clip in &settings.clips {
        match clip.shape {
            ClipShape::HalfSpace { normal, offset } => {
                if !((1e-150..=1e150).contains(&normal.length()) && offset.is_finite()) {
                    return wrong(format!(
                        "a clip plane needs a normal of a length from 1e-150 to 1e150 and a \
                         finite offset, found {normal} and {offset}"
                    ));
                }
            }
            ClipShape::Box(Bounds { min, max }) => {
                if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
                    return wrong(format!("a clip box from {min} to {max} holds nothing"));
                }
            }
        }
    }
    Ok(())
}

/// Returns an error if the region has no shape, or cannot be drawn.
fn check_region(settings: &Settings) -> Result<()> {
    let Some(Region { bounds: Bounds { min, max }, level }) = settings.region else {
        return Ok(());
    };
    if !(min.is_finite() && max.is_finite() && min.cmplt(max).all()) {
        return wrong(format!("a region from {min} to {max} holds nothing"));
    }
    if !(level >= 0.0 && level.is_finite()) {
        return wrong(format!("a region's level is {level}; a number of at least 0 is needed"));
    }
    if settings.mode != Mode::Sheets {
        return wrong("regions are drawn in image-aligned sheets only");
    }
    Ok(())
}

/// Returns an error if an item cannot be drawn with the settings.
fn check_item(item: &Item, settings: &Settings) -> Result<()> {
    match item {
        Item::Radiance(_) | Item::Gaussians(_) | Item::Hierarchy(_)
            if settings.optics == Optics::Maximum =>
        {
            wrong("a maximum intensity picture takes a volume or samples alone, without surfaces")
        }
        Item::Facets(_) | Item::Solid(_)
            if settings.mode != Mode::Sheets || settings.optics != Optics::EmissionAbsorption =>
        {
            wrong(
                "facets are drawn in image-aligned sheets that emit and absorb light; \
                 draw the surfels of the mesh instead",
            )
        }
        Item::Radiance(_)
        | Item::Facets(_)
        | Item::Solid(_)
        | Item::Gaussians(_)
        | Item::Hierarchy(_) => Ok(()),
        Item::Scalar(_, transfer) => check_classified(transfer, settings),
        Item::Cells(cells, transfer) => check_cells(cells, transfer, settings),
        Item::Volume(volume, kernel, transfer) => {
            check_volume(volume, kernel, settings)?;
            check_classified(transfer, settings)
        }
        Item::Bricks(_, kernel, _) => check_bricks(kernel, settings),
    }
}

/// Returns an error if a kernel cannot be that of a volume's samples.
fn check_volume(volume: &Volume, kernel: &Kernel, settings: &Settings) -> Result<()> {
    let before = settings.classifies_samples();
    let arrangement = &volume.lattice.arrangement;
    if volume.is_label_map() && (before || settings.mode != Mode::Sheets) {
        return wrong("a label map is classified after interpolation, in image-aligned sheets");
    }
    if volume.is_label_map() && settings.gradient == Gradient::Central {
        return wrong("the gradient of a label map is that of each label's mask");
    }
    if let Some(tensor) = kernel.as_tensor() {
        check_tensor(tensor, &volume.lattice, before).map_err(Error::Argument)?;
    }
    let is_gaussian = matches!(kernel.profile, Profile::Gaussian(_));
    if matches!(arrangement, Arrangement::Rectilinear(_)) && !is_gaussian && !before {
        return wrong(
            "a rectilinear volume takes a Gaussian kernel, unless it is classified before",
        );
    }
    let Some(coefficients) = &volume.coefficients else { return Ok(()) };
    if before {
        return wrong(
            "a sharp volume must be classified after interpolation, in image-aligned sheets",
        );
    }
    if coefficients.kernel != *kernel {
        return wrong("the volume was made sharp for another kernel");
    }
    Ok(())
}

fn check_bricks(kernel: &Kernel, settings: &Settings) -> Result<()> {
    if !matches!(kernel.profile, Profile::Gaussian(_)) {
        return wrong("a volume in bricks takes a Gaussian kernel");
    }
    if settings.classifies_samples() {
        return wrong(
            "a volume in bricks must be classified after interpolation, in image-aligned sheets",
        );
    }
    Ok(())
}

/// Returns an error if the method is none for several fields.
fn check_several(settings: &Settings) -> Result<()> {
    if settings.classifies_samples() {
        return wrong(
            "several volumes or sample sets are classified after interpolation, in image-aligned \
             sheets",
        );
    }
    Ok(())
}

/// Returns an error if the method is none for cells.
fn check_cells(cells: &Tetrahedra, transfer: &TransferFunction, settings: &Settings) -> Result<()> {
    if settings.classifies_samples() || settings.mode != Mode::Sheets {
        return wrong("cells are classified after interpolation, in image-aligned sheets");
    }
    if settings.gradient == Gradient::Central {
        return wrong("the gradient of cells is that of their nodes, not of neighbouring pixels");
    }
    if cells.place() == Place::Cells && !transfer.isosurfaces.is_empty() {
        return wrong(
            "isosurfaces need values at the points of cells, but there is one value for each cell",
        );
    }
    Ok(())
}

/// Returns an error if samples are classified before they are interpolated, but the picture needs
/// the field between them.
fn check_classified(transfer: &TransferFunction, settings: &Settings) -> Result<()> {
    if !settings.classifies_samples() {
        return Ok(());
    }
    if settings.optics == Optics::Maximum {
        return wrong(
            "the maximum of a field needs image-aligned sheets, classified after interpolation",
        );
    }
    if !(transfer.isosurfaces.is_empty() && transfer.gradient.is_empty()) {
        return wrong(
            "isosurfaces and gradient opacity need image-aligned sheets, classified after \
             interpolation",
        );
    }
    Ok(())
}

fn wrong(message: impl Into<String>) -> Result<()> {
    Err(Error::Argument(message.into()))
}

/// Returns an error if a tensor product cannot be the kernel of a lattice's samples. `before` says
/// whether samples are classified before they are interpolated.
fn check_tensor(tensor: Tensor, lattice: &Lattice, before: bool) -> Result<(), String> {
    let name = tensor.name();
    if lattice.arrangement != Arrangement::Cartesian {
        return Err(format!(
            "the kernel {name} takes a Cartesian lattice: it is a product along the lattice's axes"
        ));
    }
    if before {
        return Err(format!(
            "the kernel {name} is classified after interpolation, in image-aligned sheets"
        ));
    }
    Ok(())
}
