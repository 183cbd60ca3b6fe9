//! A file whose bytes come in parts, for programs that cannot wait for them, such as browsers.
//!
//! Nothing here reads. A reader that misses bytes gets [`Error::Absent`], and the file notes which
//! ones. The program asks [`Parts::requests`] for the ranges to fetch, hands them in
//! ([`Parts::arrive`]), and draws again. Pictures show the coarser nodes and levels meanwhile.
//!
//! Bytes are held in blocks. If they exceed the memory that they may take, the blocks that were
//! unused for longest leave.

use crate::{Error, Result};
use std::{
    collections::{HashMap, HashSet},
    ops::Range,
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

/// Bytes of a block.
const BLOCK: u64 = 64 << 10;

/// Most bytes of a request.
const MOST: u64 = 1 << 20;

/// Blocks between two wanted ones that are fetched too, instead of asking twice.
const GAP: u64 = 1;

/// Wanted blocks that are put in order before the next ones, which matter less: 4 MiB.
const WINDOW: usize = 64;

/// A file that comes in parts. Clones are the same file.
///
/// ```
/// use splatkit::input::Parts;
///
/// let parts = Parts::new(200_000, 1 << 28);
/// parts.arrive(0, &[0; 65_536])?;
/// assert_eq!((parts.len(), parts.held()), (200_000, 65_536));
/// assert!(parts.requests().is_empty(), "no reader has missed anything");
/// # Ok::<(), splatkit::Error>(())
/// ```
#[derive(Debug, Clone)]
pub struct Parts(Arc<Mutex<State>>);

#[derive(Debug)]
struct State {
    size: u64,
    /// Most bytes in memory.
    most: u64,
    blocks: HashMap<u64, Block>,
    held: u64,
    /// Counts the uses of blocks.
    time: u64,
    /// The blocks that were missed, in the order in which they were.
    missed: Vec<u64>,
    is_missed: HashSet<u64>,
    /// Bytes that came since the view changed.
    arrived: u64,
    /// Where ranges begin whose bytes were wrong once.
    suspects: HashSet<u64>,
}

#[derive(Debug)]
struct Block {
    bytes: Vec<u8>,
    used: u64,
}

impl Parts {
    /// Bytes that requests begin and end at multiples of, unless the file ends.
    pub const BLOCK: u64 = BLOCK;

    /// Creates a file of `size` bytes, of which none has come, and at most `most` are held in
    /// memory.
    pub fn new(size: u64, most: u64) -> Self {
        Self(Arc::new(Mutex::new(State {
            size,
            most: most.max(BLOCK),
            blocks: HashMap::new(),
            held: 0,
            time: 0,
            missed: Vec::new(),
            is_missed: HashSet::new(),
            arrived: 0,
            suspects: HashSet::new(),
        })))
    }

    fn state(&self) -> MutexGuard<'_, State> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Returns the number of bytes of the file.
    #[expect(clippy::len_without_is_empty, reason = "a file without bytes is of no use")]
    pub fn len(&self) -> u64 {
        self.state().size
    }

    /// Returns the number of bytes in memory.
    pub fn held(&self) -> u64 {
        self.state().held
    }

    /// Hands in bytes that begin at byte `start`.
    ///
    /// # Errors
    /// [`Error::Argument`] if they do not begin at a block, or end within one before the file does.
    pub fn arrive(&self, start: u64, bytes: &[u8]) -> Result<()> {
        self.state().arrive(start, bytes)
    }

    /// Forgets what was missed: a picture begins.
    pub fn begin(&self) {
        let state = &mut *self.state();
        state.missed.clear();
        state.is_missed.clear();
    }

    /// Says that the view has changed, so that another one may fetch as much as fits in memory.
    pub fn renew(&self) {
        self.state().arrived = 0;
    }

    /// Returns whether a reader has missed bytes since [`begin`](Self::begin). What was drawn is
    /// then coarser than it should be.
    pub fn lacks(&self) -> bool {
        !self.state().missed.is_empty()
    }

    /// Returns whether a view has fetched as many bytes as may be in memory, and misses others. No
    /// more is asked for then.
    pub fn is_full(&self) -> bool {
        let state = self.state();
        !state.missed.is_empty() && state.arrived >= state.most
    }

    /// Returns the ranges to fetch, the most important first: those that were missed and have not
    /// come. Near ones are joined; none is longer than 1 MiB.
    pub fn requests(&self) -> Vec<Range<u64>> {
        let state = self.state();
        let room = state.most.saturating_sub(state.arrived).div_ceil(BLOCK);
        let absent = state.missed.iter().copied().filter(|block| !state.blocks.contains_key(block));
        let wanted: Vec<u64> = absent.take(usize::try_from(room).unwrap_or(usize::MAX)).collect();
        let mut ranges = Vec::new();
        for window in wanted.chunks(WINDOW) {
            let mut window = window.to_vec();
            window.sort_unstable();
            ranges.extend(joined(&window).into_iter().map(|blocks| state.bytes_of(blocks)));
        }
        ranges
    }

    /// Returns whether all bytes of a range are in memory, which counts as their use.
    pub fn has(&self, range: &Range<u64>) -> bool {
        self.state().has(range)
    }

    /// Notes that a range is needed: as used if it is in memory, else as missed.
    pub fn want(&self, range: &Range<u64>) {
        let state = &mut *self.state();
        touched(range).for_each(|number| state.want(number));
    }

    /// Returns the bytes of a range.
    ///
    /// # Errors
    /// [`Error::Absent`] if they have not come. They are noted as missed.
    pub(super) fn read(&self, range: Range<u64>) -> Result<Vec<u8>> {
        let state = &mut *self.state();
        if range.is_empty() {
            return Ok(Vec::new());
        }
        touched(&range).for_each(|number| state.want(number));
        let mut bytes = Vec::with_capacity((range.end - range.start) as usize);
        for number in touched(&range) {
            let Some(block) = state.blocks.get(&number) else {
                return Err(Error::Absent { start: range.start, end: range.end });
            };
            let first = number * BLOCK;
            let from = range.start.saturating_sub(first) as usize;
            let to = ((range.end - first) as usize).min(block.bytes.len());
            bytes.extend_from_slice(block.bytes.get(from..to).unwrap_or_default());
        }
        Ok(bytes)
    }

    /// Says that the bytes of a range are wrong. The first time, they are dropped, so that they
    /// come again. Returns whether they may.
    pub(super) fn distrust(&self, range: &Range<u64>) -> bool {
        let state = &mut *self.state();
        let is_first = state.suspects.insert(range.start);
        if is_first {
            for number in touched(range) {
                state.remove(number);
                state.want(number);
            }
        }
        is_first
    }
}

impl State {
    fn arrive(&mut self, start: u64, bytes: &[u8]) -> Result<()> {
        let end = start.saturating_add(bytes.len() as u64);
        let is_whole = start.is_multiple_of(BLOCK)
            && (end.is_multiple_of(BLOCK) && end <= self.size || end == self.size);
        if !is_whole {
            return Err(Error::Argument(format!(
                "the bytes {start} to {end} of {} are not blocks of {BLOCK} bytes",
                self.size
            )));
        }
        self.arrived += bytes.len() as u64;
        for (number, part) in (start / BLOCK..).zip(bytes.chunks(BLOCK as usize)) {
            self.remove(number);
            self.held += part.len() as u64;
            self.time += 1;
            self.blocks.insert(number, Block { bytes: part.to_vec(), used: self.time });
        }
        self.trim();
        Ok(())
    }

    /// Drops the blocks that were unused for longest, until the others fit.
    fn trim(&mut self) {
        if self.held <= self.most {
            return;
        }
        let mut blocks: Vec<(u64, u64)> =
            self.blocks.iter().map(|(number, block)| (block.used, *number)).collect();
        blocks.sort_unstable();
        for (_, number) in blocks {
            if self.held <= self.most {
                return;
            }
            self.remove(number);
        }
    }

    fn remove(&mut self, number: u64) {
        if let Some(block) = self.blocks.remove(&number) {
            self.held -= block.bytes.len() as u64;
        }
    }

    fn has(&mut self, range: &Range<u64>) -> bool {
        self.time += 1;
        let time = self.time;
        touched(range).all(|number| {
            let block = self.blocks.get_mut(&number);
            block.map(|block| block.used = time).is_some()
        })
    }

    fn want(&mut self, number: u64) {
        self.time += 1;
        match self.blocks.get_mut(&number) {
            Some(block) => block.used = self.time,
            None if self.is_missed.insert(number) => self.missed.push(number),
            None => {}
        }
    }

    fn bytes_of(&self, blocks: Range<u64>) -> Range<u64> {
        blocks.start * BLOCK..(blocks.end * BLOCK).min(self.size)
    }
}

/// Returns the blocks that a range of bytes touches.
fn touched(range: &Range<u64>) -> Range<u64> {
    match range.is_empty() {
        true => 0..0,
        false => range.start / BLOCK..range.end.div_ceil(BLOCK),
    }
}

/// Returns ranges of blocks that contain these ascending ones.
fn joined(blocks: &[u64]) -> Vec<Range<u64>> {
    let mut ranges: Vec<Range<u64>> = Vec::new();
    for &block in blocks {
        match ranges.last_mut() {
            Some(last) if block <= last.end + GAP && block < last.start + MOST / BLOCK => {
                last.end = block + 1;
            }
            _ => ranges.push(block..block + 1),
        }
    }
    ranges
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A file of ten blocks and 5 bytes, whose bytes are the numbers of their blocks.
    fn file() -> Vec<u8> {
        (0..10 * BLOCK + 5).map(|at| (at / BLOCK) as u8).collect()
    }

    fn parts(most: u64) -> Parts {
        Parts::new(file().len() as u64, most)
    }

    fn give(parts: &Parts, range: Range<u64>) {
        let bytes = &file()[range.start as usize..range.end as usize];
        parts.arrive(range.start, bytes).expect("blocks");
    }

    #[test]
    fn what_is_missed_is_asked_for_in_order() {
        let parts = parts(1 << 30);
        assert!(!parts.lacks() && parts.requests().is_empty());
        let missed = 7 * BLOCK + 3..7 * BLOCK + 9;
        let error = parts.read(missed.clone()).expect_err("nothing has come");
        assert!(matches!(error, Error::Absent { .. }), "{error}");
        parts.want(&(0..BLOCK + 1));
        parts.want(&(3 * BLOCK..3 * BLOCK + 1));
        parts.want(&(10 * BLOCK..10 * BLOCK + 5));
        // One block lies between 1 and 3; the file ends within the last one.
        let (near, end) = (0..4 * BLOCK, 10 * BLOCK + 5);
        assert_eq!(parts.requests(), [near, 7 * BLOCK..8 * BLOCK, 10 * BLOCK..end]);
        give(&parts, 7 * BLOCK..8 * BLOCK);
        assert_eq!(parts.read(missed).expect("it came"), [7; 6]);
        assert!(parts.lacks() && parts.requests().len() == 2);
        parts.begin();
        assert!(!parts.lacks() && parts.requests().is_empty());
        give(&parts, 8 * BLOCK..10 * BLOCK + 5);
        let across = parts.read(9 * BLOCK - 1..10 * BLOCK + 5).expect("four blocks");
        assert_eq!((across.len() as u64, across[0], across[1]), (BLOCK + 6, 8, 9));
        assert!(parts.read(5..5).expect("nothing").is_empty());
    }

    #[test]
    fn blocks_unused_for_longest_leave() {
        let parts = parts(3 * BLOCK);
        give(&parts, 0..3 * BLOCK);
        assert!(parts.has(&(0..1)));
        give(&parts, 5 * BLOCK..6 * BLOCK);
        assert_eq!(parts.held(), 3 * BLOCK);
        let there: Vec<bool> = (0..6).map(|at| parts.has(&(at * BLOCK..at * BLOCK + 1))).collect();
        assert_eq!(there, [true, false, true, false, false, true]);
        // This view has fetched all that it may.
        parts.want(&(8 * BLOCK..9 * BLOCK));
        assert!(parts.is_full() && parts.requests().is_empty());
        parts.renew();
        assert!(!parts.is_full() && parts.requests().len() == 1);
    }

    #[test]
    fn wrong_bytes_come_again_once() {
        let parts = parts(1 << 30);
        give(&parts, 0..2 * BLOCK);
        let range = BLOCK + 1..BLOCK + 9;
        assert!(parts.distrust(&range));
        assert_eq!(parts.requests(), [Range { start: BLOCK, end: 2 * BLOCK }]);
        give(&parts, BLOCK..2 * BLOCK);
        assert!(!parts.distrust(&range) && parts.has(&range));
    }

    #[test]
    fn parts_of_blocks_are_refused() {
        let parts = parts(1 << 30);
        for (start, count) in [(1, BLOCK), (0, BLOCK - 1), (10 * BLOCK, 6), (11 * BLOCK, 0)] {
            let refused = parts.arrive(start, &vec![0; count as usize]);
            assert!(matches!(refused, Err(Error::Argument(_))), "{start}, {count}");
        }
        assert_eq!(parts.held(), 0);
    }

    #[test]
    fn requests_have_at_most_a_mebibyte() {
        let parts = Parts::new(1 << 30, 1 << 30);
        parts.want(&(0..(9 << 20)));
        let requests = parts.requests();
        assert_eq!(requests.len(), 9);
        assert!(requests.iter().all(|range| range.end - range.start == MOST));
    }
}
