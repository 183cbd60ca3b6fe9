//! Colours as one scalar.

/// Returns the luminance of pixels of `channels` bytes each, of which the first three are red,
/// green and blue (the weights of ITU-R BT.601).
pub fn luminance(bytes: &[u8], channels: usize) -> Vec<u8> {
    let of = |pixel: &[u8]| {
        let [red, green, blue] = [0, 1, 2].map(|at| u32::from(pixel[at]));
        ((299 * red + 587 * green + 114 * blue + 500) / 1000) as u8
    };
    bytes.chunks_exact(channels).map(of).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn grey_stays_as_it_is() {
        for value in 0..=255 {
            assert_eq!(luminance(&[value; 4], 4), [value]);
        }
        assert_eq!(luminance(&[255, 0, 0, 0, 255, 0, 0, 0, 255], 3), [76, 150, 29]);
    }
}
