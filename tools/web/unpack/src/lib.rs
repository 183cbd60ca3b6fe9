//! Unpacks lzip in pages: browsers have gzip alone, which leaves half as much again.
//!
//! A page (tools/media/src/page/boot.js) asks for room, writes the packed bytes there, and reads
//! those that [`unpack`] leaves. One thing is unpacked at a time.

use lzma_rust2::LzipReader;
use std::{
    io::Read,
    sync::{Mutex, MutexGuard, PoisonError},
};

/// What is packed, and what it was before.
static BYTES: Mutex<[Vec<u8>; 2]> = Mutex::new([Vec::new(), Vec::new()]);

/// Nothing else runs that could leave it half changed.
fn bytes() -> MutexGuard<'static, [Vec<u8>; 2]> {
    BYTES.lock().unwrap_or_else(PoisonError::into_inner)
}

/// Makes room for this many packed bytes, and returns where.
#[expect(unsafe_code, reason = "browsers find it by its name")]
#[unsafe(no_mangle)]
pub extern "C" fn room(count: usize) -> *mut u8 {
    let [packed, plain] = &mut *bytes();
    (*packed, *plain) = (vec![0; count], Vec::new());
    packed.as_mut_ptr()
}

/// Unpacks them to this many bytes, and returns where. Null if they are damaged.
#[expect(unsafe_code, reason = "browsers find it by its name")]
#[unsafe(no_mangle)]
pub extern "C" fn unpack(count: usize) -> *const u8 {
    let [packed, plain] = &mut *bytes();
    let Some(unpacked) = unpacked(packed, count) else { return std::ptr::null() };
    *plain = unpacked;
    plain.as_ptr()
}

/// Unpacks bytes. `None` if they are damaged, or if it is another number of them.
pub fn unpacked(packed: &[u8], count: usize) -> Option<Vec<u8>> {
    let mut plain = Vec::with_capacity(count);
    // One byte more shows that there are too many. The end is read, which has the checksum.
    let limit = count as u64 + 1;
    LzipReader::new(packed).take(limit).read_to_end(&mut plain).ok()?;
    (plain.len() == count).then_some(plain)
}

#[cfg(test)]
mod tests {
    use super::unpacked;

    /// The word “engine”.
    const PACKED: [u8; 42] = [
        0x4c, 0x5a, 0x49, 0x50, 0x01, 0x1a, 0x00, 0x32, 0x9b, 0x89, 0x19, 0xdf, 0xb8, 0x67, 0xcd,
        0xf9, 0x7f, 0xff, 0xfc, 0xd5, 0xc0, 0x00, 0x8d, 0x1a, 0xa8, 0xe8, 0x06, 0x00, 0x00, 0x00,
        0x00, 0x00, 0x00, 0x00, 0x2a, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00,
    ];

    #[test]
    fn bytes_come_back_or_are_said_to_be_damaged() {
        assert_eq!(unpacked(&PACKED, 6).as_deref(), Some(&b"engine"[..]));
        assert!(unpacked(&PACKED, 5).is_none() && unpacked(&PACKED, 7).is_none());
        assert!(unpacked(&PACKED[..40], 6).is_none() && unpacked(&[], 6).is_none());
        let mut damaged = PACKED;
        damaged[22] ^= 1;
        assert!(unpacked(&damaged, 6).is_none());
    }
}
