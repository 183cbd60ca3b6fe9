//! Whether the field of a scene can be gathered, and in how many parts of a sheet.

use super::weighting::{LEAST_DEVIATION, Weighting, weighting};
use crate::{
    Error, Result,
    bricks::Choice,
    math::{Kernel, Sheets},
    scene::{Evaluate, Gradient, Item, MOST_GATHERED, Mode, Settings},
    volume::{Arrangement, Volume},
};

/// Maximum thickness of a part of a thick sheet, in sample spacings.
const PART: f64 = 1.5;

/// Returns why the field of a scene can't be gathered, or `None` if it can. `items` are those of
/// the scene. `parts` is the result of [`parts`]. `unsuited` returns why a volume and its kernel
/// can't be gathered, if so.
pub fn obstacle(
    items: &[Item],
    settings: &Settings,
    parts: usize,
    unsuited: impl Fn(&Volume, &Kernel) -> Option<&'static str>,
) -> Option<&'static str> {
    let fields = items.iter().filter(|item| item.transfer().is_some());
    if parts > 1 && items.iter().any(Item::is_label_map) {
        return Some("sheets thicker than two samples");
    }
    let unsuited = match fields.collect::<Vec<_>>()[..] {
        [Item::Volume(volume, kernel, _)] => unsuited(volume, kernel),
        [Item::Bricks(_, kernel, _)] => unsuited_kernel(kernel),
        [_, _, ..] => return Some("several fields"),
        _ => return Some("a scene without a volume on a lattice"),
    };
    if unsuited.is_some() {
        return unsuited;
    }
    let is_rectilinear = |item: &Item| {
        let arrangement = item.lattice().map(|lattice| &lattice.arrangement);
        matches!(arrangement, Some(Arrangement::Rectilinear(_)))
    };
    if parts > 1 && items.iter().any(is_rectilinear) {
        return Some("sheets thicker than two samples of a rectilinear lattice");
    }
    if settings.mode != Mode::Sheets || settings.classifies_samples() {
        return Some("samples that are classified before interpolation");
    }
    (settings.gradient == Gradient::Central).then_some("gradients from neighbouring pixels")
}

/// Returns the first trait of items that only gathering can draw (“the kernel linear”, “a label
/// map”).
fn only_gathered(items: &[Item]) -> Option<String> {
    let tensor = items.iter().find_map(|item| item.kernel()?.as_tensor());
    let labels = || items.iter().any(Item::is_label_map).then(|| "a label map".to_owned());
    tensor.map(|tensor| format!("the kernel {}", tensor.name())).or_else(labels)
}

/// Whether the field of a scene with these items is gathered. `obstacle` is why it can't be, if so.
///
/// # Errors
/// [`Error::Argument`] if the settings ask for a method that can't draw the items, or if no method
/// can.
pub fn is_chosen(
    items: &[Item],
    settings: &Settings,
    obstacle: impl FnOnce() -> Option<&'static str>,
) -> Result<bool> {
    let only = only_gathered(items);
    if settings.evaluate == Evaluate::Scatter {
        // The sections of tensor products have no known form, and labels no sums.
        return only.map_or(Ok(false), |what| {
            Err(Error::Argument(format!(
                "{what} can't be scattered; gather instead, or leave it to the engine"
            )))
        });
    }
    match (obstacle(), only) {
        (Some(what), _) if settings.evaluate == Evaluate::Gather => Err(not_gathered(what)),
        (Some(what), Some(only)) => {
            Err(Error::Argument(format!("{only} is always gathered, and {what} can't be")))
        }
        (obstacle, _) => Ok(obstacle.is_none()),
    }
}

/// Returns the error for settings that ask for gathering where it is impossible.
pub fn not_gathered(what: &str) -> Error {
    let message = format!("{what} can't be gathered; scatter instead, or leave it to the engine");
    Error::Argument(message)
}

/// Returns the number of parts of the thickest sheet. It is one if the field at the sheet's ends
/// and middle determines its mean. Otherwise each part is so thin that two places in it do.
pub fn parts(items: &[Item], sheets: &Sheets, choice: Option<&Choice>) -> usize {
    let spacing = items.iter().find_map(|item| match item {
        Item::Volume(volume, ..) => Some(volume.lattice.least_kernel_spacing()),
        Item::Bricks(bricks, ..) => {
            let coarser = choice.map_or(0.0, |choice| choice.lambda).exp2();
            Some(coarser * bricks.header().lattice.least_kernel_spacing())
        }
        _ => None,
    });
    let Some(spacing) = spacing else { return 1 };
    // A tolerance for rounding: default sheets may be exactly that thick.
    if sheets.step <= MOST_GATHERED * spacing * (1.0 + 1e-9) {
        return 1;
    }
    (sheets.step / (PART * spacing)).ceil() as usize
}

/// Returns why a kernel can't be gathered with four weights an axis.
pub fn unsuited_kernel(kernel: &Kernel) -> Option<&'static str> {
    match weighting(kernel) {
        None => Some("kernels other than tensor products and Gaussians that reach two samples"),
        Some(Weighting::Gaussian(sigma)) if sigma < LEAST_DEVIATION => {
            Some("kernels much narrower than a sample")
        }
        Some(_) => None,
    }
}
