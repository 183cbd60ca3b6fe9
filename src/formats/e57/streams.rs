//! How the packets of a scan hold its values: one stream per record. A reader of points needs a
//! value from each stream. It buffers the values of the streams that are ahead of the others.

use super::Source;
use crate::Result;
use ::e57::{PointCloud, RecordDataType};

/// Maximum number of values that may wait for those of other streams. Writers fill all streams of a
/// packet for the same points, so this is about the number of values in a packet of 64 KiB.
pub const MOST_WAITING: u64 = 1 << 22;

const CHECKSUM: u64 = 4;
const DATA_PACKET: u8 = 1;

/// Returns an error for a scan of which more than `most` values would wait. Packets that cannot be
/// parsed are left to the reader of points, which also stops there.
pub fn check(source: &Source, scan: &PointCloud, number: usize, most: u64) -> Result<()> {
    let sizes: Vec<u64> = scan.prototype.iter().map(|record| bits(&record.data_type)).collect();
    let constants = sizes.iter().filter(|&&size| size == 0).count() as u64;
    let Some(mut packets) = Packets::begin(source.bytes(), scan.file_offset) else { return Ok(()) };
    let mut held = vec![0u64; sizes.len()];
    let mut complete = 0u64;
    while complete < scan.records {
        source.check_time()?;
        match packets.next(&mut held) {
            None => break,
            Some(false) => continue,
            Some(true) => {}
        }
        let items =
            || held.iter().zip(&sizes).filter_map(|(held, size)| (held * 8).checked_div(*size));
        let before = complete;
        complete = items().min().unwrap_or(0);
        let ahead: u64 = items().map(|items| items - before).sum();
        let waiting = ahead.saturating_add((complete - before).saturating_mul(constants));
        if waiting > most {
            let message = format!(
                "{waiting} values wait for other values of their points; at most {most} \
                         may wait"
            );
            return Err(source.error(format!("scan {number}"), message));
        }
    }
    Ok(())
}

/// Returns the number of bits of a record's value.
fn bits(kind: &RecordDataType) -> u64 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            let span = i128::from(*max) - i128::from(*min);
            u64::from(i128::BITS - span.max(0).leading_zeros())
        }
    }
}

/// Iterates over the packets of a section, by their headers only. Offsets count bytes without the
/// checksums that end each page of the file.
struct Packets<'a> {
    bytes: &'a [u8],
    page: u64,
    at: u64,
}

impl<'a> Packets<'a> {
    fn begin(bytes: &'a [u8], section: u64) -> Option<Self> {
        let page = u64::from_le_bytes(*bytes.get(40..)?.first_chunk()?);
        let logical = |place: u64| place.checked_sub(place.checked_div(page)? * CHECKSUM);
        let mut packets =
            Self { bytes, page: (page > CHECKSUM).then_some(page)?, at: logical(section)? };
        packets.skip(16)?;
        let data = u64::from_le_bytes(packets.take()?);
        packets.at = logical(data)?;
        Some(packets)
    }

    /// Adds the packet's bytes to those of each stream. Returns whether it was a data packet;
    /// `None` at the end of the file, or if the bytes are not a packet.
    fn next(&mut self, held: &mut [u64]) -> Option<bool> {
        let [kind, _, low, high] = self.take()?;
        let length = u64::from(u16::from_le_bytes([low, high])) + 1;
        // Continues where the reader would: after all streams of a data packet, and after the
        // length in the header for other packets.
        match kind {
            DATA_PACKET => {
                let count = u16::from_le_bytes(self.take()?);
                if usize::from(count) != held.len() {
                    return None;
                }
                let mut all = 0;
                for held in held {
                    let size = u64::from(u16::from_le_bytes(self.take()?));
                    *held += size;
                    all += size;
                }
                self.skip(all)?;
            }
            0 => self.skip(12 + length)?,
            2 => self.skip(length)?,
            _ => return None,
        }
        self.at = self.at.next_multiple_of(4);
        Some(kind == DATA_PACKET)
    }

    fn skip(&mut self, bytes: u64) -> Option<()> {
        self.at = self.at.checked_add(bytes)?;
        Some(())
    }

    fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let mut out = [0; N];
        for byte in &mut out {
            let content = self.page - CHECKSUM;
            let place =
                (self.at / content).checked_mul(self.page)?.checked_add(self.at % content)?;
            *byte = *self.bytes.get(usize::try_from(place).ok()?)?;
            self.at += 1;
        }
        Some(out)
    }
}
