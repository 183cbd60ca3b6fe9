//! Text from mapped files.
//!
//! Other programs may write to a mapped file while it is read. A `&str` that borrows from the
//! mapping can then stop being UTF-8 after it was checked, and code that relies on the check reads
//! out of bounds. So mapped bytes are only ever used as bytes. The functions of this module copy
//! what is needed as text first and check the copy. Clippy refuses the standard library's borrowing
//! conversions in all other modules of readers (`clippy.toml`).

#![expect(
    clippy::disallowed_methods,
    reason = "this module alone checks text, and only after copying it"
)]

use std::{hint::black_box, str::FromStr};

/// Words up to this length, in bytes, are parsed without allocating.
const SHORT: usize = 48;

/// Returns a copy of the bytes. `black_box` keeps the compiler from reading the original again
/// instead of the copy.
fn copied(bytes: &[u8]) -> Vec<u8> {
    black_box(bytes.to_vec())
}

/// Returns a copy of the bytes as text.
///
/// # Errors
/// The offset of the first byte that is not UTF-8.
pub(crate) fn text(bytes: &[u8]) -> Result<String, usize> {
    String::from_utf8(copied(bytes)).map_err(|error| error.utf8_error().valid_up_to())
}

/// Returns a copy of the bytes as text, with replacement characters for bytes that are not UTF-8.
pub(crate) fn lossy(bytes: &[u8]) -> String {
    String::from_utf8(copied(bytes))
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned())
}

/// Returns the first 40 characters of a word, for an error message.
pub(crate) fn excerpt(word: &[u8]) -> String {
    const MOST: usize = 40;
    // A UTF-8 character has at most four bytes.
    lossy(&word[..word.len().min(4 * MOST)]).chars().take(MOST).collect()
}

/// Parses a word as a number.
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

/// Parses a word as a number, which may be written as C libraries write those that are not finite:
/// `nan(ind)`, `-1.#QNAN`, `1.#INF`.
pub(crate) fn float(word: &[u8]) -> Option<f64> {
    number(word).or_else(|| {
        /// How such words go on after their sign, in lower case, and what they mean.
        const WORDS: [(&[u8], f64); 6] = [
            (b"nan(", f64::NAN),
            (b"nanq", f64::NAN),
            (b"nans", f64::NAN),
            (b"1.#qnan", f64::NAN),
            (b"1.#ind", f64::NAN),
            (b"1.#inf", f64::INFINITY),
        ];
        let rest = word.strip_prefix(b"-").or(word.strip_prefix(b"+")).unwrap_or(word);
        let entry = WORDS.iter().find(|(start, _)| {
            rest.get(..start.len()).is_some_and(|head| head.eq_ignore_ascii_case(start))
        });
        entry.map(|(_, value)| *value)
    })
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
    fn numbers_that_are_not_finite_are_read_as_c_libraries_write_them() {
        for word in ["nan", "NaN", "-nan(ind)", "nan(0x7fffff)", "1.#QNAN", "-1.#IND", "1.#QNAN00"]
        {
            assert!(float(word.as_bytes()).is_some_and(f64::is_nan), "{word}");
        }
        for word in ["inf", "-Infinity", "1.#INF", "-1.#INF000"] {
            assert!(float(word.as_bytes()).is_some_and(f64::is_infinite), "{word}");
        }
        assert_eq!((float(b"-1.5"), float(b"1.5#"), float(b"nano"), float(b"")), {
            (Some(-1.5), None, None, None)
        });
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
