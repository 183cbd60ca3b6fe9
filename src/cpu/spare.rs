//! Memory for batches of records, kept from one picture to the next.

use super::footprint::Record;

/// Records of the last picture, whose memory is reused: allocating it anew takes as long as filling
/// it.
pub type Spare = Vec<Vec<Record>>;

/// Takes memory for a number of batches of records.
pub fn spare_for(spare: &mut Spare, batches: usize) -> Vec<Vec<Record>> {
    let mut taken = spare.split_off(spare.len().saturating_sub(batches));
    for records in &mut taken {
        if records.capacity() / 4 > records.len() {
            records.shrink_to(2 * records.len());
        }
        records.clear();
    }
    taken.resize_with(batches, Vec::new);
    taken
}
