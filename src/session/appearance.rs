//! How the values of an input are shown: its transfer function.

use super::{ChannelStyle, Coloring};
use crate::{
    Error, Result,
    bricks::{Bricks, Level},
    cells::Cells,
    math::Bounds,
    scattered::Points,
    scene::Optics,
    volume::{Isosurface, Shade, TransferFunction, Volume},
};

/// How the values of an input are shown. What is not given follows from the values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Appearance {
    /// The transfer function; by default one is made for the values.
    pub transfer: Option<Transfer>,
    /// The world length that opacities hold for; by default the transfer function's.
    pub opacity_unit: Option<f64>,
    /// Surfaces of one value. Without a transfer function, nothing else is shown.
    pub isosurfaces: Vec<Surface>,
    /// Magnitudes of the gradient, and factors of the opacity; by default those of the transfer
    /// function.
    pub gradient: Vec<(f64, f64)>,
    /// The map of values, and the range that it and the transfer function are spread over.
    pub coloring: Coloring,
    /// How the channels that were read are shown, in the order in which they were
    /// ([`ReadOptions::channels`](crate::formats::ReadOptions::channels)).
    pub channels: Vec<ChannelStyle>,
    /// What becomes of a ray: functions that are made for the values suit it.
    pub optics: Optics,
}

/// A transfer function that a user chose.
#[derive(Debug, Clone, PartialEq)]
pub enum Transfer {
    /// A preset, spread over the values ([`TransferFunction::NAMES`]).
    Named(String),
    /// The user's own.
    Whole(TransferFunction),
}

/// An isosurface. Without a colour, it has the transfer function's.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Surface {
    /// Where it lies.
    pub value: SurfaceValue,
    /// Red, green and blue in 0 … 1.
    pub color: Option<[f64; 3]>,
    /// Its opacity, above 0 to 1.
    pub opacity: f64,
}

/// The value of an isosurface.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum SurfaceValue {
    /// The value itself.
    Own(f64),
    /// A share of the range of values, 0 … 1.
    Share(f64),
}

/// Values to be shown.
struct Values<'a> {
    /// What they are called in errors.
    name: &'a str,
    /// The smallest and the largest one.
    range: [f64; 2],
    /// The diagonal of the box around them, in world units.
    diagonal: f64,
    /// Whether they are labels, which are no quantities.
    are_labels: bool,
}

impl Appearance {
    /// Returns the transfer function of a volume. `name` is the input's, for errors.
    ///
    /// # Errors
    /// [`Error::NothingToDraw`] for a function that shows none of the values, and for values that
    /// are all the same if no function is given; [`Error::Transfer`] and [`Error::Argument`] for
    /// functions and maps that cannot be.
    pub fn of_volume(&self, name: &str, volume: &Volume) -> Result<TransferFunction> {
        let mut values = Values::new(name, volume.range, volume.bounds());
        values.are_labels = volume.is_label_map();
        let automatic = || TransferFunction::automatic(volume);
        self.transfer(&values, automatic, || volume.foreground())
    }

    /// Returns the transfer function of scattered samples.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume).
    pub fn of_samples(&self, name: &str, points: &Points) -> Result<TransferFunction> {
        let values = Values::new(name, points.range(), points.bounds());
        self.transfer(&values, || points.automatic_transfer(), || values.range)
    }

    /// Returns the transfer function of cells.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume).
    pub fn of_cells(&self, name: &str, cells: &Cells) -> Result<TransferFunction> {
        let values = Values::new(name, cells.range(), cells.bounds());
        // A surface without light has no shape; a haze with light has no colours.
        let shade = (!self.isosurfaces.is_empty()).then(Shade::default);
        let automatic = || TransferFunction { shade, ..cells.automatic_transfer() };
        self.transfer(&values, automatic, || values.range)
    }

    /// Returns the transfer function of a volume in bricks. The automatic one is that of a level
    /// which can be read quickly.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume) and of reading bricks.
    pub fn of_bricks(&self, name: &str, bricks: &Bricks) -> Result<TransferFunction> {
        let overview = overview_of(bricks)?;
        let header = bricks.header();
        let values = Values::new(name, header.range, header.lattice.bounds());
        let automatic = || TransferFunction::automatic(&overview);
        self.transfer(&values, automatic, || overview.foreground())
    }

    fn transfer(
        &self,
        &Values { name, range: values, diagonal, are_labels }: &Values<'_>,
        automatic: impl Fn() -> TransferFunction,
        foreground: impl Fn() -> [f64; 2],
    ) -> Result<TransferFunction> {
        let transfer = match &self.transfer {
            None if values[0] >= values[1] && self.isosurfaces.is_empty() => {
                return Err(Error::NothingToDraw(format!(
                    "all values of {name} are {}, so that nothing can be told apart; a transfer \
                     function gives them a colour and an opacity",
                    values[0]
                )));
            }
            None if are_labels => automatic(),
            None => for_optics(automatic(), self.optics, (values, diagonal)),
            Some(Transfer::Named(preset)) => {
                let is_of_foreground = TransferFunction::is_of_foreground(preset);
                let spread = if is_of_foreground { foreground() } else { values };
                let mut named = TransferFunction::named(preset, spread)?.for_size(diagonal);
                // Light fades where the gradient is noise, whatever the colours are.
                let certain = automatic().shade.and_then(|shade| shade.certain);
                named.shade = named.shade.map(|shade| Shade { certain, ..shade });
                named
            }
            Some(Transfer::Whole(transfer)) => transfer.clone(),
        };
        let mut transfer = match self.coloring.range {
            Some(range) => transfer.spread_over(range),
            None => transfer,
        };
        self.coloring.color_transfer(&mut transfer, values)?;
        transfer.unit = self.opacity_unit.unwrap_or(transfer.unit);
        if !self.gradient.is_empty() {
            transfer.gradient.clone_from(&self.gradient);
        }
        self.add_surfaces(&mut transfer, values);
        if transfer.visible(values) {
            return Ok(transfer);
        }
        Err(self.invisible(&transfer, name, values))
    }

    /// Returns the error for a transfer function that shows none of the values.
    fn invisible(&self, transfer: &TransferFunction, name: &str, [low, high]: [f64; 2]) -> Error {
        let text = match transfer.visible_range() {
            Some([from, to]) if from == to => format!("shows only the value {from}"),
            Some([from, to]) => format!("shows values between {from} and {to}"),
            None => "shows no value".to_owned(),
        };
        let spread = self.coloring.range.map_or(String::new(), |[low, high]| {
            format!("spread over the range {}, {}, ", plain(low), plain(high))
        });
        Error::NothingToDraw(format!(
            "{spread}the transfer function {text}, but the values of {name} lie between {low} \
             and {high}"
        ))
    }

    fn add_surfaces(&self, transfer: &mut TransferFunction, [low, high]: [f64; 2]) {
        for &Surface { value, color, opacity } in &self.isosurfaces {
            let value = match value {
                SurfaceValue::Own(value) => value,
                SurfaceValue::Share(share) => low + share * (high - low),
            };
            let color = color.unwrap_or_else(|| transfer.color(value));
            transfer.isosurfaces.push(Isosurface { value, color, opacity });
        }
        if self.transfer.is_none() && !self.isosurfaces.is_empty() {
            transfer.opacity = vec![(0.0, 0.0)];
        }
    }
}

/// The optical depth that a ray through a whole scene has at most, if all of it had the largest
/// value of an X-ray picture.
const MOST_DEPTH: f64 = 8.0;

/// Returns a function that was made for light as pictures of the largest value and X-rays need it.
/// Brightness or density rises evenly, from the first value that is seen to the last of interest.
fn for_optics(
    transfer: TransferFunction,
    optics: Optics,
    ([least, most], diagonal): ([f64; 2], f64),
) -> TransferFunction {
    let low = transfer.visible_range().map_or(least, |[low, _]| low.max(least));
    let high = transfer.span()[1].min(most);
    if optics == Optics::EmissionAbsorption || low >= high {
        return transfer;
    }
    let bare = TransferFunction { color: vec![(low, [0.0; 3]), (high, [1.0; 3])], ..transfer };
    if optics == Optics::Maximum {
        // What is dark shows what is behind the picture.
        let first = low + 0.1 * (high - low);
        return TransferFunction { opacity: vec![(low, 0.0), (first, 1.0)], ..bare };
    }
    let unit = diagonal / 100.0;
    let opacity = 1.0 - (-MOST_DEPTH / 100.0).exp();
    TransferFunction { opacity: vec![(low, 0.0), (high, opacity)], unit, ..bare }
}

impl<'a> Values<'a> {
    fn new(name: &'a str, range: [f64; 2], bounds: Bounds) -> Self {
        Self { name, range, diagonal: bounds.diagonal(), are_labels: false }
    }
}

/// Returns the samples of the finest level that can be read quickly as a whole.
///
/// # Errors
/// Those of reading bricks.
pub(super) fn overview_of(bricks: &Bricks) -> Result<Volume> {
    bricks.volume_there(overview(bricks))
}

/// Returns the finest level of a volume that can be read quickly as a whole, or the coarsest level.
fn overview(bricks: &Bricks) -> usize {
    const QUICK: usize = 1 << 24;
    let is_quick = |level: &Level| level.dims.iter().product::<usize>() <= QUICK;
    bricks.levels().iter().position(is_quick).unwrap_or(bricks.levels().len() - 1)
}

/// Formats a number as people type it.
fn plain(value: f64) -> String {
    if value == 0.0 || (1e-4..1e16).contains(&value.abs()) {
        format!("{value}")
    } else {
        format!("{value:e}")
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn largest_values_and_x_rays_rise_evenly() {
        let made = TransferFunction {
            opacity: vec![(10.0, 0.0), (12.0, 0.9), (110.0, 1.0)],
            color: vec![(10.0, [0.9, 0.1, 0.1]), (110.0, [1.0; 3])],
            ..TransferFunction::default()
        };
        let of = |optics| for_optics(made.clone(), optics, ([0.0, 500.0], 200.0));
        assert_eq!(of(Optics::EmissionAbsorption), made);
        let maximum = of(Optics::Maximum);
        assert_eq!((maximum.color(60.0), maximum.opacity(60.0)), ([0.5; 3], 1.0));
        assert_eq!((maximum.color(400.0), maximum.opacity(9.0)), ([1.0; 3], 0.0));
        let xray = of(Optics::XRay);
        assert!((xray.opacity(60.0) / xray.opacity(110.0) - 0.5).abs() < 1e-9);
        assert!((xray.extinction(110.0) * 200.0 - MOST_DEPTH).abs() < 1e-9);
    }
}
