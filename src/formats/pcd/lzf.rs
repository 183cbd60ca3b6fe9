//! Unpacks LZF, the byte code of Lehmann's liblzf: literal bytes, and copies of earlier output.

/// Unpacks to exactly `size` bytes. Errors come with their offset in `packed`. Memory grows with
/// the unpacked bytes.
pub fn unpack(packed: &[u8], size: usize) -> Result<Vec<u8>, (usize, String)> {
    let mut out = Vec::new();
    let mut at = 0;
    while at < packed.len() {
        let start = at;
        let control = usize::from(packed[at]);
        let mut next = || {
            at += 1;
            packed
                .get(at)
                .map(|&byte| usize::from(byte))
                .ok_or((packed.len(), "end early".to_owned()))
        };
        if control < 32 {
            let length = control + 1;
            let run = packed.get(at + 1..at + 1 + length).ok_or((start, "end early".to_owned()))?;
            out.extend_from_slice(run);
            at += length;
        } else {
            // Three bits of length, where 7 means that one more byte of length follows, and 13 bits
            // of distance.
            let length = 2 + if control >> 5 == 7 { 7 + next()? } else { control >> 5 };
            let distance = ((control & 31) << 8) + next()? + 1;
            let from = out
                .len()
                .checked_sub(distance)
                .ok_or((start, "refer to bytes before their start".to_owned()))?;
            // A copy may overlap its own output.
            (from..from + length).for_each(|index| out.push(out[index]));
        }
        at += 1;
        if out.len() > size {
            return Err((start, format!("unpack to more than {size} bytes")));
        }
    }
    if out.len() < size {
        return Err((
            packed.len(),
            format!("unpack to {} bytes where {size} were expected", out.len()),
        ));
    }
    Ok(out)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn runs_and_copies() {
        assert_eq!(unpack(&[], 0).unwrap(), b"");
        assert_eq!(unpack(&[2, b'a', b'b', b'c'], 3).unwrap(), b"abc");
        // A copy of 3 bytes from 3 bytes back; one of 9 + 4 bytes from 1 byte back.
        assert_eq!(unpack(&[2, b'a', b'b', b'c', 1 << 5, 2], 6).unwrap(), b"abcabc");
        assert_eq!(unpack(&[0, b'a', 7 << 5, 4, 0], 14).unwrap(), [b'a'; 14]);
    }

    #[test]
    fn what_is_broken_is_an_error() {
        for (packed, size, word) in [
            (&[2, b'a', b'b'][..], 3, "end early"),
            (&[0, b'a', 1 << 5], 4, "end early"),
            (&[0, b'a', 7 << 5, 4], 14, "end early"),
            (&[0, b'a', 1 << 5, 1], 4, "before their start"),
            (&[2, b'a', b'b', b'c'], 2, "more than 2"),
            (&[2, b'a', b'b', b'c'], 4, "3 bytes where 4"),
        ] {
            let (place, message) = unpack(packed, size).unwrap_err();
            assert!(message.contains(word) && place <= packed.len(), "{message}");
        }
    }
}
