//! The channels of a file in one picture, each in a colour.

use super::{Appearance, slices};
use crate::{
    Error, Result,
    about::{About, Channel},
    memory,
    parallel::prelude::*,
    scene::{Optics, Scene},
    volume::{TransferFunction, Volume},
};

/// How a channel is shown. What is not given follows from the file and from the values.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ChannelStyle {
    /// Red, green and blue in 0 … 1.
    pub color: Option<[f64; 3]>,
    /// The values from which on the channel is seen, and at which it is brightest.
    pub range: Option<[f64; 2]>,
    /// A factor of 0 … 1 on its opacities.
    pub opacity: Option<f64>,
    /// Its transfer function, which counts more than all else here.
    pub transfer: Option<TransferFunction>,
}

/// The colours of channels that have none: of two, and of more. Neighbours differ also for people
/// who do not tell red from green.
const OF_TWO: [[f64; 3]; 2] = [[0.2, 1.0, 0.25], [1.0, 0.25, 1.0]];
const OF_MANY: [[f64; 3]; Channel::MOST] = [
    [0.1, 0.8, 1.0],
    [1.0, 0.3, 0.9],
    [1.0, 0.85, 0.1],
    [0.2, 1.0, 0.3],
    [1.0, 0.25, 0.15],
    [0.35, 0.45, 1.0],
    [1.0, 1.0, 1.0],
    [1.0, 0.6, 0.2],
];

/// A picture has room for the channels of a file.
const _: () = assert!(Channel::MOST <= Scene::MAX_FIELDS);

impl Appearance {
    /// Returns whether the channels of a volume are shown in their colours: unless something else
    /// colours its values.
    pub(super) fn shows_channels(&self, about: &About) -> bool {
        !about.channels.is_empty() && self.transfer.is_none() && self.coloring.map.is_none()
    }

    /// Returns the transfer function of a channel: that of its values, in its colour, which is
    /// darker at the low end and lighter at the high one. `all` are the channels in the picture.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume).
    pub(super) fn of_channel(
        &self,
        name: &str,
        volume: &Volume,
        (style, all): (&ChannelStyle, &[usize]),
    ) -> Result<TransferFunction> {
        let name = format!("{name}, {}", volume.about.name);
        if let Some(transfer) = &style.transfer {
            transfer.validate()?;
            return Ok(transfer.clone());
        }
        let mut appearance = self.clone();
        appearance.coloring.range = style.range.or(self.coloring.range);
        let color = style.color.unwrap_or_else(|| color(&volume.about, all));
        appearance.isosurfaces.iter_mut().for_each(|surface| {
            surface.color.get_or_insert(color);
        });
        let mut transfer = appearance.of_volume(&name, volume)?;
        let [low, high] = match transfer.visible_range() {
            Some([low, high]) => [low.max(volume.range[0]), high.min(volume.range[1])],
            None => volume.range,
        };
        transfer.color = points(color, [low, high.max(low)]);
        if self.optics == Optics::Maximum && low < high {
            let [low, high] = style.range.or(volume.about.window).unwrap_or_else(|| {
                match slices::facing(volume) {
                    Some(_) => without_outliers(volume),
                    None => [low, high],
                }
            });
            (transfer.color, transfer.opacity) =
                (vec![(low, color)], vec![(low, 0.0), (high, 1.0)]);
        }
        let factor = style.opacity.unwrap_or(1.0);
        transfer.opacity.iter_mut().for_each(|point| point.1 *= factor);
        match transfer.visible(volume.range) {
            true => Ok(transfer),
            false => Err(Error::NothingToDraw(format!("nothing of {name} has opacity"))),
        }
    }
}

impl Appearance {
    /// Returns the colours of a slice of several channels: the sum of all, each the brighter the
    /// higher its values are. Channels that show nothing are left out.
    ///
    /// # Errors
    /// Those of [`of_volume`](Self::of_volume); [`Error::Memory`] if there is too little.
    pub(super) fn mixed_channels(
        &self,
        name: &str,
        volumes: &[Volume],
        all: &[usize],
    ) -> Result<Vec<[u8; 4]>> {
        let even = Self { optics: Optics::Maximum, ..self.clone() };
        let count = volumes.iter().map(Volume::len).min().unwrap_or(0);
        memory::room("the colours of a slice", 16 * count as u64)?;
        let mut sums = vec![[0.0f32; 3]; count];
        for (number, volume) in volumes.iter().enumerate() {
            let style = self.channels.get(number).cloned().unwrap_or_default();
            let transfer = match even.of_channel(name, volume, (&style, all)) {
                Err(Error::NothingToDraw(_)) => continue,
                transfer => transfer?,
            };
            let add = |(at, sum): (usize, &mut [f32; 3])| {
                let value = volume.value(at);
                let (color, share) = (transfer.color(value), transfer.opacity(value));
                sum.iter_mut().zip(color).for_each(|(sum, part)| *sum += (part * share) as f32);
            };
            sums.par_iter_mut().enumerate().for_each(add);
        }
        let byte = |part: f32| (255.0 * part.min(1.0)).round() as u8;
        let color = |[red, green, blue]: [f32; 3]| [byte(red), byte(green), byte(blue), 255];
        Ok(sums.into_par_iter().map(color).collect())
    }
}

/// Shares of the values of a slice that lie below and above those that it is shown by.
const BELOW: f64 = 0.01;
const ABOVE: f64 = 0.002;

/// Returns the range of a volume's values without the lowest and the highest ones.
fn without_outliers(volume: &Volume) -> [f64; 2] {
    const BINS: usize = 1 << 12;
    let counts = volume.histogram(BINS).unwrap_or_default();
    let all = volume.len() as f64;
    let beyond = |counts: &mut dyn Iterator<Item = &u64>, share: f64| {
        let mut sum = 0.0;
        let is_few = |count: &&u64| {
            sum += **count as f64;
            sum <= share * all
        };
        counts.take_while(is_few).count()
    };
    let (below, above) =
        (beyond(&mut counts.iter(), BELOW), beyond(&mut counts.iter().rev(), ABOVE));
    let [low, high] = volume.range;
    let step = (high - low) / BINS as f64;
    let range = [low + below as f64 * step, high - above as f64 * step];
    if range[0] < range[1] { range } else { volume.range }
}

/// Returns the colour of a channel: the file's, or else one that no other channel has.
fn color(about: &About, all: &[usize]) -> [f64; 3] {
    let of_file = |number: &usize| about.channels.get(*number).and_then(|channel| channel.color);
    if let Some(color) = of_file(&about.channel) {
        return color;
    }
    let colors: &[[f64; 3]] = if about.channels.len() == 2 { &OF_TWO } else { &OF_MANY };
    let taken: Vec<[f64; 3]> = all.iter().filter_map(of_file).collect();
    let is_taken = |color: &&[f64; 3]| taken.iter().any(|other| distance(color, other) < 0.5);
    let free: Vec<[f64; 3]> = colors.iter().filter(|color| !is_taken(color)).copied().collect();
    let unnamed = (0..about.channel).filter(|number| of_file(number).is_none()).count();
    let colors = if free.is_empty() { colors } else { &free };
    colors[unnamed % colors.len()]
}

fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    a.iter().zip(b).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max)
}

/// Returns the colours of values: darker at the low end, lighter at the high one.
fn points(color: [f64; 3], [low, high]: [f64; 2]) -> Vec<(f64, [f64; 3])> {
    let darker = color.map(|part| 0.6 * part);
    let lighter = color.map(|part| part + 0.35 * (1.0 - part));
    let at = |share: f64| low + share * (high - low);
    vec![(low, darker), (at(0.4), color), (high, lighter)]
}

#[cfg(test)]
mod tests {
    use super::*;

    fn about(colors: &[Option<[f64; 3]>], channel: usize) -> About {
        let channels =
            colors.iter().map(|color| Channel { color: *color, ..Channel::default() }).collect();
        About { channels, channel, ..About::default() }
    }

    #[test]
    fn channels_have_colours_of_their_own() {
        let of = |colors: &[Option<[f64; 3]>]| -> Vec<[f64; 3]> {
            let all: Vec<usize> = (0..colors.len()).collect();
            all.iter().map(|&channel| color(&about(colors, channel), &all)).collect()
        };
        assert_eq!(of(&[None, None]), OF_TWO);
        let eight = of(&[None; 8]);
        for (number, color) in eight.iter().enumerate() {
            assert!(eight[..number].iter().all(|other| distance(other, color) > 0.1));
        }
        // The file's colours count, and the others differ from them.
        let mixed = of(&[None, Some([0.0, 0.9, 1.0]), None]);
        assert_eq!(mixed[1], [0.0, 0.9, 1.0]);
        assert!(distance(&mixed[0], &mixed[1]) > 0.5 && distance(&mixed[0], &mixed[2]) > 0.1);
    }

    #[test]
    fn a_single_channel_is_shown_in_its_colour() {
        let red = Some([1.0, 0.0, 0.0]);
        for (colors, has) in [
            (&[][..], false),
            (&[None], false),
            (&[Some([1.0; 3])], false),
            (&[red], true),
            (&[None, None], true),
        ] {
            assert_eq!(Channel::have_colors(&about(colors, 0).channels), has, "{colors:?}");
        }
        assert!(Appearance::default().shows_channels(&about(&[red], 0)));
        assert!(!Appearance::default().shows_channels(&About::default()));
    }
}
