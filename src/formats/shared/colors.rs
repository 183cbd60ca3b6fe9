//! The colours of a volume's samples.

use super::luminance::luminance;
use crate::{
    Result,
    input::Source,
    parallel::prelude::*,
    volume::{Samples, Volume},
};
use std::sync::Arc;

/// Channels that differ by no more than this are grey: compression tints greys.
const GREY: u8 = 12;

/// At most this share of a volume in greys may be of another colour, as of marks and letters.
const MARKS: f64 = 0.005;

/// Gives a volume its colours. Opaque greys are left out: their brightness is a value as that of
/// any scan, and a transfer function shows it.
pub(crate) fn attach(volume: &mut Volume, colors: Arc<[[u8; 4]]>) {
    let is_colored = |color: &&[u8; 4]| {
        let [red, green, blue, alpha] = **color;
        let most = red.abs_diff(green).max(green.abs_diff(blue)).max(blue.abs_diff(red));
        most > GREY || alpha < 255
    };
    let colored = colors.par_iter().filter(is_colored).count();
    if colored as f64 > MARKS * colors.len() as f64 {
        volume.colors = Some(colors);
    }
}

/// Returns the colours of samples whose channels are red, green, blue and perhaps alpha.
///
/// Bytes are as they are. Of other types, the largest number decides the scale, as in clouds:
/// fractions if none is above 1, bytes if none is above 255, and 16 bits otherwise.
pub(crate) fn of_channels(source: &Source, channels: &[Samples]) -> Result<Arc<[[u8; 4]]>> {
    let count = channels.iter().map(Samples::len).min().unwrap_or(0);
    source.spend("the size of the colours in bytes", 4 * count as u64)?;
    let are_bytes = channels.iter().all(|samples| matches!(samples, Samples::U8(_)));
    let largest = channels
        .iter()
        .map(|samples| {
            (0..count).into_par_iter().map(|at| samples.value(at)).reduce(|| 0.0, f64::max)
        })
        .fold(0.0, f64::max);
    let scale = match largest {
        _ if are_bytes => 1.0,
        _ if largest > 255.0 => 255.0 / 65535.0,
        _ if largest > 1.0 => 1.0,
        _ => 255.0,
    };
    let byte = |samples: &Samples, at: usize| (samples.value(at) * scale).round() as u8;
    let color = |at: usize| {
        std::array::from_fn(|channel| {
            channels.get(channel).map_or(255, |samples| byte(samples, at))
        })
    };
    Ok((0..count).into_par_iter().map(color).collect::<Vec<_>>().into())
}

/// Returns pixels of three or four bytes as colours.
pub(crate) fn of_pixels(bytes: &[u8], channels: usize) -> Vec<[u8; 4]> {
    let color = |pixel: &[u8]| [pixel[0], pixel[1], pixel[2], *pixel.get(3).unwrap_or(&255)];
    bytes.chunks_exact(channels).map(color).collect()
}

/// Returns the brightness of colours.
pub(crate) fn brightness(colors: &[[u8; 4]]) -> Samples {
    Samples::U8(luminance(bytemuck::cast_slice(colors), 4))
}
