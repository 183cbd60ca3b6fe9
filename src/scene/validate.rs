//! Whether the engines can draw a scene, and with which settings.

use super::{ClipShape, Item, Optics, Scene, Settings, numbers};
use crate::{
    Error, Result,
    math::{Bounds, Profile, Tensor},
    splat::{Payload, SplatSet},
    volume::{Arrangement, Lattice},
};

impl Scene {
    /// Checks that the scene can be drawn with these settings, in addition to
    /// [`validate`](Self::validate): finite numbers, non-empty clips, and options that can be
    /// combined.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason.
    pub fn validate_settings(&self, settings: &Settings) -> Result<()> {
        let wrong = |message: String| Err(Error::Argument(message));
        numbers::check_settings(settings)?;
        let [width, height] = settings.size;
        if u64::from(width) * u64::from(height) > Settings::MAX_PIXELS {
            let most = Settings::MAX_PIXELS;
            return wrong(format!(
                "a picture of {width}x{height} pixels is larger than {most} pixels"
            ));
        }
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
                ClipShape::Box(bounds) => {
                    if !(bounds.min.is_finite()
                        && bounds.max.is_finite()
                        && bounds.min.cmplt(bounds.max).all())
                    {
                        let Bounds { min, max } = bounds;
                        return wrong(format!("a clip box from {min} to {max} holds nothing"));
                    }
                }
            }
        }
        let before = settings.classifies_samples();
        for (number, item) in self.items.iter().enumerate() {
            // The transfer function may have changed since the scene was validated.
            numbers::check_transfer(item).map_err(numbers::of_item(number))?;
            match item {
                Item::Radiance(_) | Item::Hierarchy(_) if settings.optics == Optics::Maximum => {
                    return wrong(
                        "a maximum intensity picture takes a volume or samples alone, without \
                         surfaces"
                            .into(),
                    );
                }
                Item::Radiance(_) | Item::Hierarchy(_) => {}
                Item::Volume(volume, kernel, _) => {
                    let is_gaussian = matches!(kernel.profile, Profile::Gaussian(_));
                    if let Some(tensor) = kernel.as_tensor() {
                        check_tensor(tensor, &volume.lattice, before).map_err(Error::Argument)?;
                    }
                    if matches!(volume.lattice.arrangement, Arrangement::Rectilinear(_))
                        && !is_gaussian
                        && !before
                    {
                        return wrong(
                            "a rectilinear volume takes a Gaussian kernel, unless it is classified \
                             before"
                                .into(),
                        );
                    }
                    if let Some(coefficients) = &volume.coefficients {
                        if before {
                            return wrong(
                                "a sharp volume must be classified after interpolation, in \
                                 image-aligned sheets"
                                    .into(),
                            );
                        }
                        if coefficients.kernel != *kernel {
                            return wrong("the volume was made sharp for another kernel".into());
                        }
                    }
                }
                Item::Bricks(_, kernel, _) => {
                    if !matches!(kernel.profile, Profile::Gaussian(_)) {
                        return wrong("a volume in bricks takes a Gaussian kernel".into());
                    }
                    if before {
                        return wrong(
                            "a volume in bricks must be classified after interpolation, in \
                             image-aligned sheets"
                                .into(),
                        );
                    }
                }
                Item::Scalar(..) => {}
            }
            if let Item::Scalar(_, transfer) | Item::Volume(_, _, transfer) = item
                && before
            {
                if settings.optics == Optics::Maximum {
                    return wrong(
                        "the maximum of a field needs image-aligned sheets, classified after \
                         interpolation"
                            .into(),
                    );
                }
                if !(transfer.isosurfaces.is_empty() && transfer.gradient.is_empty()) {
                    return wrong(
                        "isosurfaces and gradient opacity need image-aligned sheets, classified \
                         after interpolation"
                            .into(),
                    );
                }
            }
        }
        Ok(())
    }

    /// Checks that the engines can draw the scene: payloads that match their items, finite numbers
    /// (the error names the item and the splat), and at most one scalar field. The densities of two
    /// fields under two transfer functions cannot be added in one sheet.
    ///
    /// # Errors
    /// [`Error::Argument`] with the reason; [`Error::NothingToDraw`] for a scene without splats and
    /// samples.
    pub fn validate(&self) -> Result<()> {
        let mut fields = 0;
        for item in &self.items {
            let (set, payload) = match item {
                Item::Radiance(set) => (set, Payload::Radiance),
                Item::Scalar(set, _) => (set, Payload::Scalar),
                Item::Hierarchy(_) => continue,
                Item::Volume(..) | Item::Bricks(..) => {
                    fields += 1;
                    continue;
                }
            };
            fields += usize::from(payload == Payload::Scalar);
            if set.payload != payload {
                return Err(Error::Argument(format!(
                    "a set of {:?} splats was added as {payload:?}",
                    set.payload
                )));
            }
            if !(set.extent > 0.0 && set.extent <= SplatSet::MAX_EXTENT) {
                let most = SplatSet::MAX_EXTENT;
                return Err(Error::Argument(format!(
                    "a splat set's extent must lie in 0 … {most}, is {}",
                    set.extent
                )));
            }
        }
        for (number, item) in self.items.iter().enumerate() {
            numbers::check_item(item).map_err(numbers::of_item(number))?;
        }
        if fields > 1 {
            return Err(Error::Argument(format!(
                "a picture can show one volume or sample set; the scene has {fields}"
            )));
        }
        if self.bounds().is_empty() {
            return Err(Error::NothingToDraw("the scene contains no splats".into()));
        }
        Ok(())
    }
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
