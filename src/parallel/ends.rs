//! The calls of a parallel loop: its steps, and what ends it.

use super::{
    Parallel, Part, by_part, cuts, each_part, run_parts,
    sources::{IntoParallelIterator, Once},
    steps::{Enumerate, FilterMap, FlatMap, Fold, Map, MapInit, MinLen, StepBy, Zip},
};
use std::{
    cmp::Ordering,
    iter::Sum,
    sync::{
        Mutex, MutexGuard, PoisonError,
        atomic::{AtomicBool, AtomicUsize, Ordering::Relaxed},
    },
};

/// The calls of a parallel loop. Their names are rayon's.
pub trait ParallelIterator: Parallel {
    fn map<T, F: Fn(Self::Item) -> T + Sync>(self, of: F) -> Map<Self, F> {
        Map(self, of)
    }

    /// Like [`Self::map`], with a state that begins anew in each part.
    fn map_init<S, T, I: Fn() -> S + Sync, F: Fn(&mut S, Self::Item) -> T + Sync>(
        self,
        start: I,
        of: F,
    ) -> MapInit<Self, I, F> {
        MapInit(self, start, of)
    }

    fn copied<'a, T: Copy + 'a>(self) -> impl Parallel<Item = T>
    where
        Self: Parallel<Item = &'a T>,
    {
        self.map(|item: &T| *item)
    }

    fn filter(self, keep: impl Fn(&Self::Item) -> bool + Sync) -> impl Parallel<Item = Self::Item> {
        self.filter_map(move |item| keep(&item).then_some(item))
    }

    fn filter_map<T, F: Fn(Self::Item) -> Option<T> + Sync>(self, of: F) -> FilterMap<Self, F> {
        FilterMap(self, of)
    }

    fn flat_map_iter<T: IntoIterator, F: Fn(Self::Item) -> T + Sync>(
        self,
        of: F,
    ) -> FlatMap<Self, F> {
        FlatMap(self, of)
    }

    fn flatten(self) -> impl Parallel<Item = <Self::Item as IntoIterator>::Item>
    where
        Self::Item: IntoIterator,
    {
        self.flat_map_iter(|items| items)
    }

    fn zip<Z: IntoParallelIterator>(self, other: Z) -> Zip<Self, Z::Into> {
        const { assert!(Self::EXACT && Z::Into::EXACT, "items without places") };
        Zip(self, other.into_par_iter())
    }

    fn enumerate(self) -> Enumerate<Self> {
        const { assert!(Self::EXACT, "items without places") };
        Enumerate(self)
    }

    fn step_by(self, step: usize) -> StepBy<Self> {
        const { assert!(Self::EXACT, "items without places") };
        assert!(step > 0, "steps of no length");
        StepBy(self, step)
    }

    fn with_min_len(self, least: usize) -> MinLen<Self> {
        MinLen(self, least)
    }

    /// Folds each part into one result.
    fn fold<T, I: Fn() -> T + Sync, F: Fn(T, Self::Item) -> T + Sync>(
        self,
        start: I,
        with: F,
    ) -> Fold<Self, I, F> {
        Fold(self, start, with)
    }

    fn for_each(self, each: impl Fn(Self::Item) + Sync) {
        each_part(self, |divided, part| Self::items(divided, part).for_each(&each));
    }

    /// Like [`Self::for_each`], with a state that begins anew in each part.
    fn for_each_init<S>(
        self,
        start: impl Fn() -> S + Sync,
        each: impl Fn(&mut S, Self::Item) + Sync,
    ) {
        each_part(self, |divided, part| {
            let mut state = start();
            Self::items(divided, part).for_each(|item| each(&mut state, item));
        });
    }

    /// Returns the first error of the parts that ran. After an error, no part begins.
    fn try_for_each<E: Send>(
        self,
        each: impl Fn(Self::Item) -> Result<(), E> + Sync,
    ) -> Result<(), E> {
        let first = First::default();
        each_part(self, |divided, part| {
            if first.is_none()
                && let Err(error) = Self::items(divided, part).try_for_each(&each)
            {
                first.put(part, error);
            }
        });
        first.into_inner().map_or(Ok(()), Err)
    }

    fn reduce(
        self,
        start: impl Fn() -> Self::Item + Sync,
        both: impl Fn(Self::Item, Self::Item) -> Self::Item + Sync,
    ) -> Self::Item
    where
        Self::Item: Send,
    {
        let parts = by_part(self, |divided, part| {
            let mut all = start();
            for item in Self::items(divided, part) {
                all = both(all, item);
            }
            Some(all)
        });
        let mut all = start();
        for part in parts.into_iter().flatten() {
            all = both(all, part);
        }
        all
    }

    fn collect<C: Collect<Self::Item>>(self) -> C {
        C::collect(self)
    }

    fn unzip<A: Send, B: Send>(self) -> (Vec<A>, Vec<B>)
    where
        Self: Parallel<Item = (A, B)>,
    {
        let parts = by_part(self, |divided, part| {
            Self::items(divided, part).unzip::<A, B, Vec<A>, Vec<B>>()
        });
        let (first, second): (Vec<_>, Vec<_>) = parts.into_iter().unzip();
        (joined(first), joined(second))
    }

    fn sum<S: Sum<Self::Item> + Sum<S> + Send>(self) -> S {
        let parts = by_part(self, |divided, part| Some(Self::items(divided, part).sum::<S>()));
        parts.into_iter().flatten().sum()
    }

    fn count(self) -> usize {
        by_part(self, |divided, part| Self::items(divided, part).count()).into_iter().sum()
    }

    fn max_by(
        self,
        order: impl Fn(&Self::Item, &Self::Item) -> Ordering + Sync,
    ) -> Option<Self::Item>
    where
        Self::Item: Send,
    {
        let parts = by_part(self, |divided, part| Self::items(divided, part).max_by(&order));
        parts.into_iter().flatten().max_by(&order)
    }

    fn any(self, is: impl Fn(Self::Item) -> bool + Sync) -> bool {
        let matched = AtomicBool::new(false);
        each_part(self, |divided, part| {
            if !matched.load(Relaxed) && Self::items(divided, part).any(&is) {
                matched.store(true, Relaxed);
            }
        });
        matched.into_inner()
    }

    fn all(self, is: impl Fn(Self::Item) -> bool + Sync) -> bool {
        !self.any(|item| !is(item))
    }

    fn find_first(self, is: impl Fn(&Self::Item) -> bool + Sync) -> Option<Self::Item>
    where
        Self::Item: Send,
    {
        self.find_map_first(|item| is(&item).then_some(item))
    }

    /// Returns the first result in the order of the items. Parts behind one with a result are left
    /// out.
    fn find_map_first<T: Send>(self, of: impl Fn(Self::Item) -> Option<T> + Sync) -> Option<T> {
        let first = First::default();
        each_part(self, |divided, part| {
            if !first.is_before(part)
                && let Some(result) = Self::items(divided, part).find_map(&of)
            {
                first.put(part, result);
            }
        });
        first.into_inner()
    }

    fn position_first(self, is: impl Fn(Self::Item) -> bool + Sync) -> Option<usize> {
        self.enumerate().find_map_first(|(index, item)| is(item).then_some(index))
    }
}

/// The result of the first part that has one.
struct First<T>(Mutex<Option<(usize, T)>>);

impl<T> Default for First<T> {
    fn default() -> Self {
        Self(Mutex::new(None))
    }
}

impl<T> First<T> {
    fn lock(&self) -> MutexGuard<'_, Option<(usize, T)>> {
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }

    fn is_none(&self) -> bool {
        self.lock().is_none()
    }

    /// Whether a part before this one has a result.
    fn is_before(&self, part: Part) -> bool {
        self.lock().as_ref().is_some_and(|(number, _)| *number < part.number)
    }

    fn put(&self, part: Part, result: T) {
        let mut first = self.lock();
        if first.as_ref().is_none_or(|(number, _)| part.number < *number) {
            *first = Some((part.number, result));
        }
    }

    fn into_inner(self) -> Option<T> {
        let first = self.0.into_inner().unwrap_or_else(PoisonError::into_inner);
        first.map(|(_, result)| result)
    }
}

impl<P: Parallel> ParallelIterator for P {}

/// What a parallel loop can be collected into.
pub trait Collect<T>: Sized {
    fn collect<P: Parallel<Item = T>>(sequence: P) -> Self;
}

impl<T: Send> Collect<T> for Vec<T> {
    fn collect<P: Parallel<Item = T>>(sequence: P) -> Self {
        if P::EXACT {
            in_place(sequence)
        } else {
            joined(by_part(sequence, |divided, part| P::items(divided, part).collect::<Self>()))
        }
    }
}

/// Like [`ParallelIterator::try_for_each`], stops at an error.
impl<T: Send, E: Send> Collect<Result<T, E>> for Result<Vec<T>, E> {
    fn collect<P: Parallel<Item = Result<T, E>>>(sequence: P) -> Self {
        let first = First::default();
        let parts = by_part(sequence, |divided, part| {
            let mut all = Vec::new();
            if first.is_none() {
                for item in P::items(divided, part) {
                    match item {
                        Ok(item) => all.push(item),
                        Err(error) => {
                            first.put(part, error);
                            break;
                        }
                    }
                }
            }
            all
        });
        first.into_inner().map_or_else(|| Ok(joined(parts)), Err)
    }
}

/// Like [`ParallelIterator::try_for_each`], stops where there is nothing.
impl<T: Send> Collect<Option<T>> for Option<Vec<T>> {
    fn collect<P: Parallel<Item = Option<T>>>(sequence: P) -> Self {
        sequence.map(|item| item.ok_or(())).collect::<Result<_, ()>>().ok()
    }
}

/// Collects one item for each place, without a copy of the parts.
fn in_place<P: Parallel<Item: Send>>(sequence: P) -> Vec<P::Item> {
    let length = sequence.len();
    let cuts = cuts(length, sequence.least());
    let mut all = Vec::with_capacity(length);
    let places = Once::of_slice(&mut all.spare_capacity_mut()[..length], &cuts, 1);
    let divided = sequence.divide(&cuts);
    let written = AtomicUsize::new(0);
    run_parts(&cuts, &|part| {
        let places = places.take(part).iter_mut();
        let pairs = P::items(&divided, part).zip(places);
        written.fetch_add(pairs.map(|(item, place)| place.write(item)).count(), Relaxed);
    });
    drop(places);
    assert_eq!(written.into_inner(), length, "an item for each place");
    #[expect(unsafe_code, reason = "the items are written on all threads")]
    // SAFETY: the places are the first `length` of the vector's capacity. Each was written, because
    // each part wrote as many of its own as were counted, and the counts add up to all.
    unsafe {
        all.set_len(length);
    }
    all
}

/// Joins the parts of a vector.
fn joined<T>(parts: Vec<Vec<T>>) -> Vec<T> {
    let mut all = Vec::new();
    let mut length = 0;
    for part in &parts {
        length += part.len();
    }
    for mut part in parts {
        if all.is_empty() {
            part.reserve_exact(length - part.len());
            all = part;
        } else {
            all.append(&mut part);
        }
    }
    all
}
