//! Checks for numbers that cannot be drawn: not finite, or too large for 32 bits. One of these in
//! one splat would spread, through sums and bounds, to unrelated pixels. So a scene that contains
//! one is refused, and the error names its place.

use super::{Item, Settings};
use crate::{
    Error, Result,
    facet::{Facet, FacetSet, TextureCoordinates},
    hierarchy::Detail,
    math::{Bounds, Kernel},
    parallel::prelude::*,
    splat::{Common, Payload, Splat, Splats},
    volume::TransferFunction,
};

/// Number of values that a transfer function can distinguish over the range of its data. In a sum
/// of 32 bits, a value much smaller than 1/`VALUES` of another is lost.
const VALUES: f64 = 1048576.0;

/// Returns a function that names item `number` in an error.
pub(super) fn of_item(number: usize) -> impl Fn(Error) -> Error {
    let placed = move |message: String| format!("item {number} of the scene: {message}");
    move |error| match error {
        Error::Argument(message) => Error::Argument(placed(message)),
        Error::Transfer(message) => Error::Transfer(placed(message)),
        other => other,
    }
}

/// Checks the transfer function of an item, if it has one.
pub(super) fn check_transfer(item: &Item) -> Result<()> {
    let checked = item.transfer().map_or(Ok(()), TransferFunction::validate_numbers);
    checked.map_err(|message| Error::Transfer(format!("the transfer function: {message}")))
}

/// Checks the transfer function of an item, if it has one, also against the range of the item's
/// values.
pub(super) fn check_field(item: &Item) -> Result<()> {
    check_transfer(item)?;
    let (Some(transfer), Some([low, high])) = (item.transfer(), item.value_range()) else {
        return Ok(());
    };
    // A single outlier, such as from a broken sensor, would give all other values one colour.
    let [first, last] = transfer.span();
    if last > first && last - first < (high - low) / VALUES {
        return Err(Error::Transfer(format!(
            "the transfer function changes from {first} to {last}, too close together for values \
             from {low} to {high}: remove values that are far off, or choose another function"
        )));
    }
    Ok(())
}

/// Checks the numbers of an item.
pub(super) fn check_item(item: &Item) -> Result<()> {
    item.kernel().map_or(Ok(()), Kernel::validate)?;
    if let Some(set) = item.splats() {
        check_set(&set).map_err(Error::Argument)?;
    }
    match item {
        Item::Facets(set) => check_facets(set).map_err(Error::Argument)?,
        Item::Solid(solid) => check_facets(solid.boundary()).map_err(Error::Argument)?,
        Item::Gaussians(set) => set.validate().map_err(Error::Argument)?,
        Item::Volume(volume, ..) => volume.validate().map_err(Error::Argument)?,
        // Tetrahedra are checked as they are made.
        Item::Radiance(_)
        | Item::Scalar(..)
        | Item::Hierarchy(_)
        | Item::Bricks(..)
        | Item::Cells(..) => {}
    }
    check_field(item)?;
    let Bounds { min, max } = item.bounds();
    let holds = |v: f64| v.abs() <= f64::from(f32::MAX);
    // The bounds of an empty set are not finite. That is no error.
    let is_none = match item {
        Item::Radiance(set) => set.splats.is_empty(),
        Item::Scalar(set, _) => set.splats.is_empty(),
        Item::Facets(set) => set.facets.is_empty(),
        Item::Gaussians(set) => set.is_empty(),
        _ => false,
    };
    if !is_none && ![min, max, max - min].iter().all(|v| v.to_array().into_iter().all(holds)) {
        return Err(Error::Argument(format!(
            "it reaches from {min} to {max}, beyond what 32-bit numbers hold"
        )));
    }
    if !is_none && item.bounds().is_beyond_cameras() {
        return Err(Error::Argument(format!(
            "it reaches from {min} to {max}, and no camera sees that far"
        )));
    }
    Ok(())
}

fn check_facets(set: &FacetSet) -> Result<(), String> {
    if !set.origin.is_finite() {
        return Err(format!("the origin {} is not finite", set.origin));
    }
    let is_finite =
        |facet: &Facet| facet.corners.iter().flatten().all(|v| v.is_finite() && v.abs() <= 1e18);
    if let Some(index) = set.facets.par_iter().position_first(|facet| !is_finite(facet)) {
        let corners = set.facets[index].corners;
        return Err(format!(
            "facet {index}: the corners {corners:?} are not finite, or beyond 1e18"
        ));
    }
    if !set.texture_coordinates.is_empty() && set.texture_coordinates.len() != set.facets.len() {
        let [facets, textured] = [set.facets.len(), set.texture_coordinates.len()];
        return Err(format!("{textured} facets show images, but there are {facets} facets"));
    }
    let exists =
        |image: u32| image == TextureCoordinates::PLAIN || (image as usize) < set.images.len();
    let is_sound = |part: &TextureCoordinates| {
        exists(part.image) && part.places.iter().all(|at| at.is_finite())
    };
    match set.texture_coordinates.par_iter().position_first(|part| !is_sound(part)) {
        Some(index) => Err(format!("facet {index} shows no part of an image that there is")),
        None => Ok(()),
    }
}

fn check_set(set: &Splats) -> Result<(), String> {
    let (Common { origin, payload, extent }, splats) = (set.common(), set.splats());
    let most = Splat::MAX_EXTENT;
    if !(extent > 0.0 && extent <= most) {
        return Err(format!("a splat set's extent must lie in 0 … {most}, is {extent}"));
    }
    if !origin.is_finite() {
        return Err(format!("the origin {origin} is not finite"));
    }
    // The inverse of a subnormal number is not finite.
    if let Payload::Scalar { overlap } = payload
        && !(overlap > 0.0 && overlap.is_normal())
    {
        return Err(format!("the overlap is {overlap}; a positive number is needed"));
    }
    let first = splats.par_iter().position_first(|splat| fault(splat, payload).is_some());
    match first.and_then(|index| Some((index, fault(&splats[index], payload)?))) {
        Some((index, fault)) => Err(format!("splat {index}: {fault}")),
        None => Ok(()),
    }
}

/// Returns what is wrong with the numbers of a splat, if anything.
fn fault(splat: &Splat, payload: Payload) -> Option<String> {
    let Splat { center, strength, factor, .. } = splat;
    let not_finite = |values: &[f32]| !values.iter().all(|v| v.is_finite());
    if not_finite(center) {
        return Some(format!("the centre {center:?} is not finite"));
    }
    if not_finite(factor) {
        return Some(format!("the factor {factor:?} is not finite"));
    }
    match payload {
        Payload::Radiance if !(0.0..=Splat::MOST_OPTICAL_DEPTH).contains(strength) => {
            Some(format!(
                "the optical depth is {strength}, but those from 0 to {:e} can be drawn",
                Splat::MOST_OPTICAL_DEPTH
            ))
        }
        // A kernel of a field needs a volume. Radiance may be flat, because the picture widens it.
        Payload::Scalar { .. } if [factor[0], factor[2], factor[5]].contains(&0.0) => {
            Some(format!("the factor {factor:?} is that of a flat kernel"))
        }
        Payload::Scalar { .. } if !strength.is_finite() => Some(format!("the value is {strength}")),
        Payload::Scalar { .. } => {
            let (weight, slope) = splat.weight_and_slope();
            let is_sound = weight >= 0.0 && weight.is_finite() && slope.is_finite();
            (!is_sound).then(|| format!("the weight is {weight} and the slope {slope}"))
        }
        // Gaussians are checked before they become splats.
        Payload::Radiance | Payload::Trained => None,
    }
}

/// Checks the numbers of the settings.
pub(super) fn check_settings(settings: &Settings) -> Result<()> {
    let positive = |v: f64| v > 0.0 && v.is_finite();
    let wrong = |message: String| Err(Error::Argument(message));
    if let Some(thickness) = settings.sheet_thickness.filter(|v| !positive(*v)) {
        return wrong(format!(
            "the thickness of sheets is {thickness}; a positive number is needed"
        ));
    }
    if !positive(settings.sheet_pixels) {
        return wrong(format!(
            "the thickness of sheets is {} pixels; a positive number is needed",
            settings.sheet_pixels
        ));
    }
    if let Some(near) = settings.near.filter(|v| !(*v >= 0.0 && v.is_finite())) {
        return wrong(format!(
            "the nearest distance is {near}; a finite number of at least 0 is needed"
        ));
    }
    match settings.detail {
        Detail::Pixels(value) | Detail::Milliseconds(value)
            if !(value >= 0.0 && value.is_finite()) =>
        {
            return wrong(format!(
                "the detail is {:?}; a finite number of at least 0 is needed",
                settings.detail
            ));
        }
        _ => {}
    }
    for shade in [settings.surface_shade, settings.volume_shade.flatten()].into_iter().flatten() {
        shade.check().map_err(Error::Argument)?;
    }
    settings.lighting.check(settings).map_err(Error::Argument)
}
