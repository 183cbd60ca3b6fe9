//! The description of ImageJ: lines `name=value`, and a block of binary data in tags of its own.

use super::meaning::{Meaning, is_length, unit};
use crate::about::Channel;

/// The colours of channels in ImageJ, if the file does not say: red, green, blue, grey, cyan,
/// magenta, yellow.
const COLORS: [[f64; 3]; 7] = [
    [1.0, 0.0, 0.0],
    [0.0, 1.0, 0.0],
    [0.0, 0.0, 1.0],
    [1.0, 1.0, 1.0],
    [0.0, 1.0, 1.0],
    [1.0, 0.0, 1.0],
    [1.0, 1.0, 0.0],
];

/// The block of a file: the lengths of its parts, and their bytes one after the other.
#[derive(Debug, Clone, Default)]
pub struct Block {
    pub lengths: Vec<u64>,
    pub bytes: Vec<u8>,
    pub is_big: bool,
}

/// Bytes of a table of colours: 256 of red, of green and of blue.
const TABLE: usize = 3 * 256;

/// Reads the lines of a description. The tags of the page give pixels per unit.
pub fn meaning(
    text: &str,
    resolution: Option<[f64; 2]>,
    block: &Block,
    plain: &Meaning,
) -> Meaning {
    let mut meaning = plain.clone();
    let field = |name: &str| {
        let value = |line: &str| {
            line.strip_prefix(name).and_then(|rest| rest.strip_prefix('=')).map(str::to_owned)
        };
        text.lines().find_map(|line| value(line.trim()))
    };
    let count = |name: &str| field(name).and_then(|text| text.trim().parse::<usize>().ok());
    meaning.channels = count("channels").unwrap_or(1).max(1);
    meaning.order = ['c', 'z', 't'];
    meaning.in_one = count("images").filter(|&images| images > 1);
    let frames = count("frames").unwrap_or(1).max(1);
    let of_images = meaning.in_one.map(|images| images / meaning.channels / frames);
    meaning.slices = count("slices").or(of_images);
    if let Some([x, y]) = resolution.filter(|all| all.iter().all(|&v| is_length(v))) {
        meaning.spacing = [1.0 / x, 1.0 / y, 1.0 / x];
    }
    let spacing = field("spacing").and_then(|text| text.trim().parse::<f64>().ok());
    if let Some(spacing) = spacing.map(f64::abs).filter(|&spacing| is_length(spacing)) {
        meaning.spacing[2] = spacing;
    }
    meaning.unit = unit(field("unit").unwrap_or_default().trim());
    if meaning.channels > 1 {
        let is_grey = field("mode").is_some_and(|mode| mode.trim().starts_with("gr"));
        meaning.shown = block.channels(meaning.channels, is_grey);
        meaning.is_microscopy = true;
    }
    meaning
}

impl Block {
    /// Returns how each channel is shown. Without a table of colours, channels have those that
    /// ImageJ gives them by number, unless they are shown in grey.
    fn channels(&self, count: usize, is_grey: bool) -> Vec<Channel> {
        let ranges = self.part(b"rang", 0).unwrap_or_default();
        let number = |index: usize| {
            let bytes: [u8; 8] = *ranges.get(8 * index..)?.first_chunk()?;
            Some(if self.is_big { f64::from_be_bytes(bytes) } else { f64::from_le_bytes(bytes) })
        };
        let one = |index: usize| {
            let window = number(2 * index).zip(number(2 * index + 1));
            let window = window.filter(|(low, high)| low < high && (high - low).is_finite());
            let table = self.part(b"luts", index).filter(|bytes| bytes.len() == TABLE);
            let color = match table {
                Some(table) => Some([255, 511, 767].map(|last| f64::from(table[last]) / 255.0)),
                None if is_grey => None,
                None => COLORS.get(index).copied(),
            };
            let is_seen = |color: &[f64; 3]| color.iter().any(|part| *part > 0.0);
            Channel {
                name: String::new(),
                color: color.filter(is_seen),
                window: window.map(|(low, high)| [low, high]),
            }
        };
        (0..count.min(Channel::MOST)).map(one).collect()
    }

    /// Returns the bytes of the part of this kind and number among its kind.
    ///
    /// The first part is a header: a mark, then a name of four letters and a count for each kind,
    /// in the order in which the parts follow. Small machines write names backwards.
    fn part(&self, kind: &[u8; 4], number: usize) -> Option<&[u8]> {
        let word = |bytes: &[u8]| -> Option<[u8; 4]> {
            let mut word = *bytes.first_chunk::<4>()?;
            if !self.is_big {
                word.reverse();
            }
            Some(word)
        };
        let length = |index: usize| usize::try_from(*self.lengths.get(index)?).ok();
        let header = self.bytes.get(..length(0)?)?;
        if word(header)? != *b"IJIJ" {
            return None;
        }
        let mut index = 1;
        for entry in header[4..].chunks_exact(8) {
            let count = u32::from_be_bytes(word(&entry[4..])?) as usize;
            if word(entry)? != *kind {
                index += count;
                continue;
            }
            if number >= count {
                return None;
            }
            let at = index + number;
            let start = (0..at).try_fold(0usize, |sum, i| sum.checked_add(length(i)?))?;
            return self.bytes.get(start..)?.get(..length(at)?);
        }
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A block of two ranges and two tables of colours, in the order of bytes of small machines.
    fn block() -> Block {
        let mut bytes = b"JIJI".to_vec();
        for (kind, count) in [(b"gnar", 1u32), (b"stul", 2)] {
            bytes.extend(kind);
            bytes.extend(count.to_le_bytes());
        }
        let header = bytes.len() as u64;
        for value in [10.0f64, 200.0, 5.0, 5.0] {
            bytes.extend(value.to_le_bytes());
        }
        for scale in [[0u8, 1, 0], [1, 0, 1]] {
            scale.iter().for_each(|&on| bytes.extend((0..=255u8).map(|v| on * v)));
        }
        Block { lengths: vec![header, 32, 768, 768], bytes, is_big: false }
    }

    #[test]
    fn blocks_give_colours_and_windows() {
        let channels = block().channels(2, false);
        assert_eq!(channels[0].color, Some([0.0, 1.0, 0.0]));
        assert_eq!(channels[1].color, Some([1.0, 0.0, 1.0]));
        // A range of no width is none.
        assert_eq!([channels[0].window, channels[1].window], [Some([10.0, 200.0]), None]);
    }

    #[test]
    fn channels_without_a_block_have_the_usual_colours() {
        let plain = Block::default().channels(9, false);
        assert_eq!((plain.len(), plain[1].color), (8, Some([0.0, 1.0, 0.0])));
        assert_eq!(plain[7].color, None);
        assert_eq!(Block::default().channels(2, true)[0].color, None);
        let mut cut = block();
        cut.bytes.truncate(60);
        assert_eq!(cut.channels(2, true)[0].color, None);
        cut.lengths = vec![u64::MAX; 3];
        assert_eq!(cut.channels(2, true)[1].window, None);
    }
}
