//! Parallel loops: `items.par_iter().map(…).collect()` and the like, on all threads of the pool.
//!
//! A loop is a [`Parallel`]: a source that can be divided ([`sources`]), with steps on each of its
//! items ([`steps`]). What ends it ([`ends`]) divides the source into parts, some for each thread,
//! and runs the steps over each part as an ordinary iterator.
//!
//! The calls have the names and meanings of rayon's, which shares out the parts. Rayon's own
//! iterators are compiled anew for each loop, with all that splits and joins them: a third of the
//! library's code, before. Here that work is done once, in [`run`], by numbers of parts.
//!
//! Results are joined in the order of the items. Where there are no threads, as in a browser, rayon
//! has one worker, the calling thread. There is one part then.

mod ends;
mod sources;
mod steps;

use crate::warning::Gathering;
use std::sync::{Mutex, PoisonError};

/// What a module with parallel loops imports.
pub mod prelude {
    pub use super::{
        ends::ParallelIterator,
        sources::{IntoParallelIterator, ParallelSlice},
    };
}

/// Parts for each thread, so that threads with slow parts are helped by the others.
const PARTS: usize = 32;

/// A sequence that can be divided into parts, each with an iterator over its items.
pub trait Parallel: Sized {
    type Item;
    /// The divided sequence, which all threads share.
    type Divided: Sync;

    /// Whether each place of the sequence has just one item.
    const EXACT: bool;

    /// Returns the number of places, at which the sequence can be divided.
    fn len(&self) -> usize;

    /// Returns the minimum number of places in a part.
    fn least(&self) -> usize {
        1
    }

    /// Divides the sequence into the parts between successive cuts. The first cut is 0, the last
    /// is at most the length.
    fn divide(self, cuts: &[usize]) -> Self::Divided;

    /// Returns the items of a part. Each part is asked for once.
    fn items(divided: &Self::Divided, part: Part) -> impl Iterator<Item = Self::Item>;
}

/// A part of a sequence.
#[derive(Debug, Clone, Copy)]
pub struct Part {
    number: usize,
    start: usize,
    end: usize,
}

pub use rayon::current_num_threads;

/// Calls `of` with each number below `count`, on all threads.
fn run(count: usize, of: &(dyn Fn(usize) + Sync)) {
    fn halves(first: usize, end: usize, of: &(dyn Fn(usize) + Sync)) {
        match end - first {
            0 => {}
            1 => of(first),
            more => {
                let middle = first + more / 2;
                rayon::join(|| halves(first, middle, of), || halves(middle, end, of));
            }
        }
    }
    halves(0, count, of);
}

/// Returns where to divide a sequence of this length, into parts of at least `least` places.
fn cuts(length: usize, least: usize) -> Vec<usize> {
    let most = if current_num_threads() == 1 { 1 } else { PARTS * current_num_threads() };
    let parts = (length / least.max(1)).clamp(1, most).min(length);
    // 128 bits, because the product may exceed 64.
    let cut = |part: usize| (part as u128 * length as u128 / parts.max(1) as u128) as usize;
    (0..=parts).map(cut).collect()
}

/// Calls `of` with the divided sequence and each of its parts, on all threads.
fn each_part<P: Parallel>(sequence: P, of: impl Fn(&P::Divided, Part) + Sync) {
    let cuts = cuts(sequence.len(), sequence.least());
    let divided = sequence.divide(&cuts);
    run_parts(&cuts, &|part| of(&divided, part));
}

fn run_parts(cuts: &[usize], of: &(dyn Fn(Part) + Sync)) {
    let part = |number: usize| Part { number, start: cuts[number], end: cuts[number + 1] };
    match Gathering::current() {
        None => run(cuts.len() - 1, &|number| of(part(number))),
        // The warnings of all threads belong to the work of this one.
        Some(gathering) => run(cuts.len() - 1, &|number| gathering.within(|| of(part(number)))),
    }
}

/// Returns the results for all parts, in order. A part without one has `R::default()`.
fn by_part<P: Parallel, R: Default + Send>(
    sequence: P,
    of: impl Fn(&P::Divided, Part) -> R + Sync,
) -> Vec<R> {
    let results = Results::new();
    each_part(sequence, |divided, part| results.put(part, of(divided, part)));
    results.into_vec()
}

/// The results of the parts that are done.
struct Results<R>(Mutex<Vec<R>>);

impl<R: Default> Results<R> {
    fn new() -> Self {
        Self(Mutex::new(Vec::new()))
    }

    fn put(&self, part: Part, result: R) {
        let mut all = self.0.lock().unwrap_or_else(PoisonError::into_inner);
        while all.len() <= part.number {
            all.push(R::default());
        }
        all[part.number] = result;
    }

    fn into_vec(self) -> Vec<R> {
        self.0.into_inner().unwrap_or_else(PoisonError::into_inner)
    }
}

#[cfg(test)]
mod tests;
