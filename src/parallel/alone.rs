//! The calls of rayon that this library makes, on the calling thread and in order.
//!
//! Only what differs from [`Iterator`] is more than a call of it: rayon's `fold` and `reduce` begin
//! with a value for each thread.

use std::{cmp::Ordering, iter, slice};

pub fn current_num_threads() -> usize {
    1
}

pub mod prelude {
    pub use super::{IntoParallelIterator, ParallelRef, ParallelRefMut, ParallelSlice};
}

/// An iterator with the methods of rayon's.
#[derive(Clone)]
pub struct Alone<I>(I);

pub trait IntoParallelIterator: IntoIterator + Sized {
    fn into_par_iter(self) -> Alone<Self::IntoIter> {
        Alone(self.into_iter())
    }
}

impl<T: IntoIterator> IntoParallelIterator for T {}

pub trait ParallelRef<'a> {
    type Iter;

    fn par_iter(&'a self) -> Alone<Self::Iter>;
}

impl<'a, T: ?Sized + 'a> ParallelRef<'a> for T
where
    &'a T: IntoIterator,
{
    type Iter = <&'a T as IntoIterator>::IntoIter;

    fn par_iter(&'a self) -> Alone<Self::Iter> {
        Alone(self.into_iter())
    }
}

pub trait ParallelRefMut<'a> {
    type Iter;

    fn par_iter_mut(&'a mut self) -> Alone<Self::Iter>;
}

impl<'a, T: ?Sized + 'a> ParallelRefMut<'a> for T
where
    &'a mut T: IntoIterator,
{
    type Iter = <&'a mut T as IntoIterator>::IntoIter;

    fn par_iter_mut(&'a mut self) -> Alone<Self::Iter> {
        Alone(self.into_iter())
    }
}

pub trait ParallelSlice<T> {
    fn par_chunks(&self, size: usize) -> Alone<slice::Chunks<'_, T>>;
    fn par_chunks_exact(&self, size: usize) -> Alone<slice::ChunksExact<'_, T>>;
    fn par_chunks_mut(&mut self, size: usize) -> Alone<slice::ChunksMut<'_, T>>;
    fn par_windows(&self, size: usize) -> Alone<slice::Windows<'_, T>>;
    fn par_sort_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K);
    fn par_sort_unstable_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K);
    fn par_sort_unstable_by(&mut self, compare: impl FnMut(&T, &T) -> Ordering);
    fn par_sort_unstable(&mut self)
    where
        T: Ord;
}

impl<T> ParallelSlice<T> for [T] {
    fn par_chunks(&self, size: usize) -> Alone<slice::Chunks<'_, T>> {
        Alone(self.chunks(size))
    }

    fn par_chunks_exact(&self, size: usize) -> Alone<slice::ChunksExact<'_, T>> {
        Alone(self.chunks_exact(size))
    }

    fn par_chunks_mut(&mut self, size: usize) -> Alone<slice::ChunksMut<'_, T>> {
        Alone(self.chunks_mut(size))
    }

    fn par_windows(&self, size: usize) -> Alone<slice::Windows<'_, T>> {
        Alone(self.windows(size))
    }

    fn par_sort_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K) {
        self.sort_by_key(key);
    }

    fn par_sort_unstable_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K) {
        self.sort_unstable_by_key(key);
    }

    fn par_sort_unstable_by(&mut self, compare: impl FnMut(&T, &T) -> Ordering) {
        self.sort_unstable_by(compare);
    }

    fn par_sort_unstable(&mut self)
    where
        T: Ord,
    {
        self.sort_unstable();
    }
}

impl<I: Iterator> IntoIterator for Alone<I> {
    type Item = I::Item;
    type IntoIter = I;

    fn into_iter(self) -> I {
        self.0
    }
}

/// The iterators that follow from this one.
impl<I: Iterator> Alone<I> {
    pub fn map<T, F: FnMut(I::Item) -> T>(self, of: F) -> Alone<iter::Map<I, F>> {
        Alone(self.0.map(of))
    }

    pub fn map_init<S, T>(
        self,
        init: impl FnOnce() -> S,
        mut of: impl FnMut(&mut S, I::Item) -> T,
    ) -> Alone<impl Iterator<Item = T>> {
        let mut state = init();
        self.map(move |item| of(&mut state, item))
    }

    pub fn filter<F: FnMut(&I::Item) -> bool>(self, keep: F) -> Alone<iter::Filter<I, F>> {
        Alone(self.0.filter(keep))
    }

    pub fn filter_map<T, F: FnMut(I::Item) -> Option<T>>(
        self,
        of: F,
    ) -> Alone<iter::FilterMap<I, F>> {
        Alone(self.0.filter_map(of))
    }

    pub fn flat_map_iter<T: IntoIterator, F: FnMut(I::Item) -> T>(
        self,
        of: F,
    ) -> Alone<iter::FlatMap<I, T, F>> {
        Alone(self.0.flat_map(of))
    }

    pub fn flatten(self) -> Alone<iter::Flatten<I>>
    where
        I::Item: IntoIterator,
    {
        Alone(self.0.flatten())
    }

    pub fn zip<Z: IntoIterator>(self, other: Z) -> Alone<iter::Zip<I, Z::IntoIter>> {
        Alone(self.0.zip(other))
    }

    pub fn enumerate(self) -> Alone<iter::Enumerate<I>> {
        Alone(self.0.enumerate())
    }

    #[cfg(test)]
    pub fn rev(self) -> Alone<iter::Rev<I>>
    where
        I: DoubleEndedIterator,
    {
        Alone(self.0.rev())
    }

    pub fn step_by(self, step: usize) -> Alone<iter::StepBy<I>> {
        Alone(self.0.step_by(step))
    }

    pub fn with_min_len(self, _: usize) -> Self {
        self
    }

    pub fn fold<T>(
        self,
        start: impl FnOnce() -> T,
        with: impl FnMut(T, I::Item) -> T,
    ) -> Alone<iter::Once<T>> {
        Alone(iter::once(self.0.fold(start(), with)))
    }
}

impl<'a, T: 'a, I: Iterator<Item = &'a T>> Alone<I> {
    pub fn copied(self) -> Alone<iter::Copied<I>>
    where
        T: Copy,
    {
        Alone(self.0.copied())
    }
}

/// What ends an iteration.
impl<I: Iterator> Alone<I> {
    pub fn for_each(self, each: impl FnMut(I::Item)) {
        self.0.for_each(each);
    }

    pub fn for_each_init<S>(self, init: impl FnOnce() -> S, mut each: impl FnMut(&mut S, I::Item)) {
        let mut state = init();
        self.0.for_each(|item| each(&mut state, item));
    }

    pub fn try_for_each<E>(mut self, each: impl FnMut(I::Item) -> Result<(), E>) -> Result<(), E> {
        self.0.try_for_each(each)
    }

    pub fn reduce(
        self,
        start: impl FnOnce() -> I::Item,
        both: impl FnMut(I::Item, I::Item) -> I::Item,
    ) -> I::Item {
        self.0.fold(start(), both)
    }

    pub fn collect<C: FromIterator<I::Item>>(self) -> C {
        self.0.collect()
    }

    pub fn unzip<A, B, FromA, FromB>(self) -> (FromA, FromB)
    where
        I: Iterator<Item = (A, B)>,
        FromA: Default + Extend<A>,
        FromB: Default + Extend<B>,
    {
        self.0.unzip()
    }

    pub fn sum<S: iter::Sum<I::Item>>(self) -> S {
        self.0.sum()
    }

    pub fn max(self) -> Option<I::Item>
    where
        I::Item: Ord,
    {
        self.0.max()
    }

    pub fn max_by(self, order: impl FnMut(&I::Item, &I::Item) -> Ordering) -> Option<I::Item> {
        self.0.max_by(order)
    }

    pub fn len(&self) -> usize
    where
        I: ExactSizeIterator,
    {
        self.0.len()
    }

    pub fn count(self) -> usize {
        self.0.count()
    }

    pub fn all(mut self, is: impl FnMut(I::Item) -> bool) -> bool {
        self.0.all(is)
    }

    pub fn any(mut self, is: impl FnMut(I::Item) -> bool) -> bool {
        self.0.any(is)
    }

    pub fn find_first(mut self, is: impl FnMut(&I::Item) -> bool) -> Option<I::Item> {
        self.0.find(is)
    }

    pub fn find_map_first<T>(mut self, of: impl FnMut(I::Item) -> Option<T>) -> Option<T> {
        self.0.find_map(of)
    }

    pub fn position_first(mut self, is: impl FnMut(I::Item) -> bool) -> Option<usize> {
        self.0.position(is)
    }
}
