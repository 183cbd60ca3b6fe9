//! The steps of a parallel loop: what is done with each item before the loop ends.

use super::{Parallel, Part};
use std::iter;

/// Items by a function.
pub struct Map<P, F>(pub P, pub F);

impl<P: Parallel, T, F: Fn(P::Item) -> T + Sync> Parallel for Map<P, F> {
    type Item = T;
    type Divided = (P::Divided, F);

    const EXACT: bool = P::EXACT;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1)
    }

    fn items((divided, of): &Self::Divided, part: Part) -> impl Iterator<Item = T> {
        P::items(divided, part).map(of)
    }
}

/// Items by a function that has a state, which begins anew in each part.
pub struct MapInit<P, I, F>(pub P, pub I, pub F);

impl<P: Parallel, S, T, I: Fn() -> S + Sync, F: Fn(&mut S, P::Item) -> T + Sync> Parallel
    for MapInit<P, I, F>
{
    type Item = T;
    type Divided = (P::Divided, I, F);

    const EXACT: bool = P::EXACT;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1, self.2)
    }

    fn items((divided, start, of): &Self::Divided, part: Part) -> impl Iterator<Item = T> {
        let mut state = start();
        P::items(divided, part).map(move |item| of(&mut state, item))
    }
}

/// Items for which a function has a result.
pub struct FilterMap<P, F>(pub P, pub F);

impl<P: Parallel, T, F: Fn(P::Item) -> Option<T> + Sync> Parallel for FilterMap<P, F> {
    type Item = T;
    type Divided = (P::Divided, F);

    const EXACT: bool = false;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1)
    }

    fn items((divided, of): &Self::Divided, part: Part) -> impl Iterator<Item = T> {
        P::items(divided, part).filter_map(of)
    }
}

/// All items of the sequences that a function returns.
pub struct FlatMap<P, F>(pub P, pub F);

impl<P: Parallel, T: IntoIterator, F: Fn(P::Item) -> T + Sync> Parallel for FlatMap<P, F> {
    type Item = T::Item;
    type Divided = (P::Divided, F);

    const EXACT: bool = false;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1)
    }

    fn items((divided, of): &Self::Divided, part: Part) -> impl Iterator<Item = T::Item> {
        P::items(divided, part).flat_map(of)
    }
}

/// One result for each part.
pub struct Fold<P, I, F>(pub P, pub I, pub F);

impl<P: Parallel, T, I: Fn() -> T + Sync, F: Fn(T, P::Item) -> T + Sync> Parallel
    for Fold<P, I, F>
{
    type Item = T;
    type Divided = (P::Divided, I, F);

    const EXACT: bool = false;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1, self.2)
    }

    fn items((divided, start, with): &Self::Divided, part: Part) -> impl Iterator<Item = T> {
        iter::once(P::items(divided, part).fold(start(), with))
    }
}

/// Pairs of the items of two sequences, as long as both have one.
pub struct Zip<P, Q>(pub P, pub Q);

impl<P: Parallel, Q: Parallel> Parallel for Zip<P, Q> {
    type Item = (P::Item, Q::Item);
    type Divided = (P::Divided, Q::Divided);

    const EXACT: bool = P::EXACT && Q::EXACT;

    fn len(&self) -> usize {
        self.0.len().min(self.1.len())
    }

    fn least(&self) -> usize {
        self.0.least().max(self.1.least())
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (self.0.divide(cuts), self.1.divide(cuts))
    }

    fn items((one, other): &Self::Divided, part: Part) -> impl Iterator<Item = Self::Item> {
        P::items(one, part).zip(Q::items(other, part))
    }
}

/// Items with their numbers.
pub struct Enumerate<P>(pub P);

impl<P: Parallel> Parallel for Enumerate<P> {
    type Item = (usize, P::Item);
    type Divided = P::Divided;

    const EXACT: bool = P::EXACT;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> P::Divided {
        self.0.divide(cuts)
    }

    fn items(divided: &P::Divided, part: Part) -> impl Iterator<Item = Self::Item> {
        (part.start..).zip(P::items(divided, part))
    }
}

/// Every so manyth item, from the first on.
pub struct StepBy<P>(pub P, pub usize);

impl<P: Parallel> Parallel for StepBy<P> {
    type Item = P::Item;
    type Divided = (P::Divided, usize);

    const EXACT: bool = P::EXACT;

    fn len(&self) -> usize {
        self.0.len().div_ceil(self.1)
    }

    fn least(&self) -> usize {
        self.0.least()
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        let all = self.0.len();
        let cuts: Vec<usize> = cuts.iter().map(|cut| (cut * self.1).min(all)).collect();
        (self.0.divide(&cuts), self.1)
    }

    fn items(&(ref divided, step): &Self::Divided, part: Part) -> impl Iterator<Item = P::Item> {
        let part = Part { start: part.start * step, end: part.end * step, ..part };
        P::items(divided, part).step_by(step)
    }
}

/// The same items, in parts of a minimum length.
pub struct MinLen<P>(pub P, pub usize);

impl<P: Parallel> Parallel for MinLen<P> {
    type Item = P::Item;
    type Divided = P::Divided;

    const EXACT: bool = P::EXACT;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn least(&self) -> usize {
        self.0.least().max(self.1)
    }

    fn divide(self, cuts: &[usize]) -> P::Divided {
        self.0.divide(cuts)
    }

    fn items(divided: &P::Divided, part: Part) -> impl Iterator<Item = P::Item> {
        P::items(divided, part)
    }
}
