//! Text from mapped files.
//!
//! Other programs may write to a mapped file while it is read. A `&str` that borrows from the mapping can then stop being UTF-8
//! after it was checked, and code that relies on the check reads out of bounds. Mapped bytes are therefore used as bytes alone.
//! What is needed as text is copied first and checked afterwards, by the functions of this module. Clippy refuses the standard
//! library's borrowing conversions in all other modules of readers (`clippy.toml`).

#![expect(
    clippy::disallowed_methods,
    reason = "the one place that checks text, after it is copied"
)]

use std::{hint::black_box, str::FromStr};

/// Words of numbers that are not longer need no memory from the allocator.
const SHORT: usize = 48;

/// A copy of the bytes. The compiler may not read the original again instead of the copy.
fn copied(bytes: &[u8]) -> Vec<u8> {
    black_box(bytes.to_vec())
}

/// A copy of the bytes as text.
///
/// # Errors
/// The place of the first byte that is not UTF-8.
pub(crate) fn text(bytes: &[u8]) -> Result<String, usize> {
    String::from_utf8(copied(bytes)).map_err(|error| error.utf8_error().valid_up_to())
}

/// A copy of the bytes as text, with a replacement character for what is not UTF-8.
pub(crate) fn lossy(bytes: &[u8]) -> String {
    String::from_utf8(copied(bytes))
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned())
}

/// The beginning of a word, for an error message.
pub(crate) fn excerpt(word: &[u8]) -> String {
    const MOST: usize = 40;
    // A character takes four bytes at most.
    lossy(&word[..word.len().min(4 * MOST)]).chars().take(MOST).collect()
}

/// The number that a word is.
pub(crate) fn number<T: FromStr>(word: &[u8]) -> Option<T> {
    let mut short = [0; SHORT];
    match short.get_mut(..word.len()) {
        Some(copy) => {
            copy.copy_from_slice(word);
            std::str::from_utf8(black_box(copy)).ok()?.parse().ok()
        }
        None => text(word).ok()?.parse().ok(),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn text_is_a_checked_copy() {
        assert_eq!(text("a µ".as_bytes()), Ok("a µ".to_owned()));
        assert_eq!(text(b"ab\xffc"), Err(2));
        assert_eq!(lossy(b"ab\xffc"), "ab\u{fffd}c");
        assert_eq!(excerpt(&[b'x'; 1000]), "x".repeat(40));
        assert_eq!(excerpt("µ".repeat(100).as_bytes()), "µ".repeat(40));
    }

    #[test]
    fn numbers_of_any_length_are_read() {
        assert_eq!(number::<f64>(b"-1.5e3"), Some(-1500.0));
        assert_eq!(number::<u64>(b"7"), Some(7));
        for length in [SHORT - 1, SHORT, SHORT + 1, 500] {
            assert_eq!(
                number::<f64>(format!("{:0>length$}", "12.5").as_bytes()),
                Some(12.5),
                "{length}"
            );
        }
        assert_eq!(
            (number::<f64>(b""), number::<f64>(b"1\xff"), number::<u64>(b"-1")),
            (None, None, None)
        );
    }
}
