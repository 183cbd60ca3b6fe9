//! What parallel loops run over: ranges, slices, chunks and windows of slices, and vectors.

use super::{Parallel, Part};
use std::{
    cmp::Ordering,
    ops::Range,
    sync::{Mutex, PoisonError},
};

/// What can be turned into a parallel loop over its items.
pub trait IntoParallelIterator {
    type Into: Parallel;

    fn into_par_iter(self) -> Self::Into;
}

impl<P: Parallel> IntoParallelIterator for P {
    type Into = P;

    fn into_par_iter(self) -> P {
        self
    }
}

/// The numbers of a range.
pub struct Numbers<N>(Range<N>);

macro_rules! numbers {
    ($($number:ty)*) => { $(
        impl IntoParallelIterator for Range<$number> {
            type Into = Numbers<$number>;

            fn into_par_iter(self) -> Numbers<$number> {
                Numbers(self)
            }
        }

        impl Parallel for Numbers<$number> {
            type Item = $number;
            type Divided = $number;

            const EXACT: bool = true;

            fn len(&self) -> usize {
                self.0.end.saturating_sub(self.0.start) as usize
            }

            fn divide(self, _: &[usize]) -> $number {
                self.0.start
            }

            fn items(first: &$number, part: Part) -> impl Iterator<Item = $number> {
                first + part.start as $number..first + part.end as $number
            }
        }
    )* };
}

numbers!(u32 u64 usize);

/// The items of a slice.
pub struct Items<'a, T>(&'a [T]);

impl<'a, T: Sync> Parallel for Items<'a, T> {
    type Item = &'a T;
    type Divided = &'a [T];

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn divide(self, _: &[usize]) -> &'a [T] {
        self.0
    }

    fn items(all: &&'a [T], part: Part) -> impl Iterator<Item = &'a T> {
        of_part(all, part, 1).iter()
    }
}

/// The items of a slice, to be changed.
pub struct ItemsMut<'a, T>(&'a mut [T]);

impl<'a, T: Send> Parallel for ItemsMut<'a, T> {
    type Item = &'a mut T;
    type Divided = Once<&'a mut [T]>;

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn divide(self, cuts: &[usize]) -> Once<&'a mut [T]> {
        Once::of_slice(self.0, cuts, 1)
    }

    fn items(parts: &Once<&'a mut [T]>, part: Part) -> impl Iterator<Item = &'a mut T> {
        parts.take(part).iter_mut()
    }
}

/// Chunks of a slice. The last one may be shorter.
pub struct Chunks<'a, T>(&'a [T], usize);

impl<'a, T: Sync> Parallel for Chunks<'a, T> {
    type Item = &'a [T];
    type Divided = (&'a [T], usize);

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len().div_ceil(self.1)
    }

    fn divide(self, _: &[usize]) -> (&'a [T], usize) {
        (self.0, self.1)
    }

    fn items(&(all, size): &(&'a [T], usize), part: Part) -> impl Iterator<Item = &'a [T]> {
        of_part(all, part, size).chunks(size)
    }
}

/// Chunks of a slice, all of one size.
pub struct ChunksExact<'a, T>(&'a [T], usize);

impl<'a, T: Sync> Parallel for ChunksExact<'a, T> {
    type Item = &'a [T];
    type Divided = (&'a [T], usize);

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len() / self.1
    }

    fn divide(self, _: &[usize]) -> (&'a [T], usize) {
        (self.0, self.1)
    }

    fn items(&(all, size): &(&'a [T], usize), part: Part) -> impl Iterator<Item = &'a [T]> {
        of_part(all, part, size).chunks_exact(size)
    }
}

/// Chunks of a slice, to be changed.
pub struct ChunksMut<'a, T>(&'a mut [T], usize);

impl<'a, T: Send> Parallel for ChunksMut<'a, T> {
    type Item = &'a mut [T];
    type Divided = (Once<&'a mut [T]>, usize);

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len().div_ceil(self.1)
    }

    fn divide(self, cuts: &[usize]) -> Self::Divided {
        (Once::of_slice(self.0, cuts, self.1), self.1)
    }

    fn items(&(ref parts, size): &Self::Divided, part: Part) -> impl Iterator<Item = &'a mut [T]> {
        parts.take(part).chunks_mut(size)
    }
}

/// Windows of a slice, which overlap.
pub struct Windows<'a, T>(&'a [T], usize);

impl<'a, T: Sync> Parallel for Windows<'a, T> {
    type Item = &'a [T];
    type Divided = (&'a [T], usize);

    const EXACT: bool = true;

    fn len(&self) -> usize {
        (self.0.len() + 1).saturating_sub(self.1)
    }

    fn divide(self, _: &[usize]) -> (&'a [T], usize) {
        (self.0, self.1)
    }

    fn items(&(all, size): &(&'a [T], usize), part: Part) -> impl Iterator<Item = &'a [T]> {
        all[part.start..(part.end + size - 1).min(all.len())].windows(size)
    }
}

/// The items of a vector.
pub struct Owned<T>(Vec<T>);

impl<T: Send> Parallel for Owned<T> {
    type Item = T;
    type Divided = Once<Vec<T>>;

    const EXACT: bool = true;

    fn len(&self) -> usize {
        self.0.len()
    }

    fn divide(mut self, cuts: &[usize]) -> Once<Vec<T>> {
        let mut parts = Vec::with_capacity(cuts.len());
        self.0.truncate(cuts[cuts.len() - 1]);
        for &start in cuts[..cuts.len() - 1].iter().rev() {
            parts.push(Mutex::new(self.0.split_off(start)));
        }
        parts.reverse();
        Once(parts)
    }

    fn items(parts: &Once<Vec<T>>, part: Part) -> impl Iterator<Item = T> {
        parts.take(part).into_iter()
    }
}

/// Parts that only one thread may have. Each is taken once.
pub struct Once<P>(Vec<Mutex<P>>);

impl<P: Default> Once<P> {
    pub fn take(&self, part: Part) -> P {
        let mut place = self.0[part.number].lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut *place)
    }
}

impl<'a, T> Once<&'a mut [T]> {
    /// Divides a slice at the cuts, which count `size` items each.
    pub fn of_slice(mut rest: &'a mut [T], cuts: &[usize], size: usize) -> Self {
        let mut parts = Vec::with_capacity(cuts.len());
        for number in 1..cuts.len() {
            let length = ((cuts[number] - cuts[number - 1]) * size).min(rest.len());
            parts.push(Mutex::new(rest.split_off_mut(..length).unwrap_or_default()));
        }
        Self(parts)
    }
}

/// Returns the items of a part whose places have `size` items each.
fn of_part<T>(all: &[T], part: Part, size: usize) -> &[T] {
    &all[(part.start * size).min(all.len())..(part.end * size).min(all.len())]
}

impl<T: Send> IntoParallelIterator for Vec<T> {
    type Into = Owned<T>;

    fn into_par_iter(self) -> Owned<T> {
        Owned(self)
    }
}

impl<T: Send, const N: usize> IntoParallelIterator for [T; N] {
    type Into = Owned<T>;

    fn into_par_iter(self) -> Owned<T> {
        Owned(self.into())
    }
}

impl<'a, T: Sync> IntoParallelIterator for &'a [T] {
    type Into = Items<'a, T>;

    fn into_par_iter(self) -> Items<'a, T> {
        Items(self)
    }
}

impl<'a, T: Sync> IntoParallelIterator for &'a Vec<T> {
    type Into = Items<'a, T>;

    fn into_par_iter(self) -> Items<'a, T> {
        Items(self)
    }
}

impl<'a, T: Send> IntoParallelIterator for &'a mut [T] {
    type Into = ItemsMut<'a, T>;

    fn into_par_iter(self) -> ItemsMut<'a, T> {
        ItemsMut(self)
    }
}

impl<'a, T: Send> IntoParallelIterator for &'a mut Vec<T> {
    type Into = ItemsMut<'a, T>;

    fn into_par_iter(self) -> ItemsMut<'a, T> {
        ItemsMut(self)
    }
}

/// Parallel loops over slices, and their sorting.
pub trait ParallelSlice<T> {
    fn par_iter(&self) -> Items<'_, T>;
    fn par_iter_mut(&mut self) -> ItemsMut<'_, T>;
    /// # Panics
    ///
    /// If the size is zero, as the next three.
    fn par_chunks(&self, size: usize) -> Chunks<'_, T>;
    fn par_chunks_exact(&self, size: usize) -> ChunksExact<'_, T>;
    fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T>;
    fn par_windows(&self, size: usize) -> Windows<'_, T>;
    fn par_sort_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync)
    where
        T: Send;
    fn par_sort_unstable_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync)
    where
        T: Send;
    fn par_sort_unstable_by(&mut self, compare: impl Fn(&T, &T) -> Ordering + Sync)
    where
        T: Send;
    fn par_sort_unstable(&mut self)
    where
        T: Ord + Send;
}

impl<T> ParallelSlice<T> for [T] {
    fn par_iter(&self) -> Items<'_, T> {
        Items(self)
    }

    fn par_iter_mut(&mut self) -> ItemsMut<'_, T> {
        ItemsMut(self)
    }

    fn par_chunks(&self, size: usize) -> Chunks<'_, T> {
        assert!(size > 0, "chunks without items");
        Chunks(self, size)
    }

    fn par_chunks_exact(&self, size: usize) -> ChunksExact<'_, T> {
        assert!(size > 0, "chunks without items");
        ChunksExact(self, size)
    }

    fn par_chunks_mut(&mut self, size: usize) -> ChunksMut<'_, T> {
        assert!(size > 0, "chunks without items");
        ChunksMut(self, size)
    }

    fn par_windows(&self, size: usize) -> Windows<'_, T> {
        assert!(size > 0, "windows without items");
        Windows(self, size)
    }

    fn par_sort_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync)
    where
        T: Send,
    {
        rayon::slice::ParallelSliceMut::par_sort_by_key(self, key);
    }

    fn par_sort_unstable_by_key<K: Ord>(&mut self, key: impl Fn(&T) -> K + Sync)
    where
        T: Send,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable_by_key(self, key);
    }

    fn par_sort_unstable_by(&mut self, compare: impl Fn(&T, &T) -> Ordering + Sync)
    where
        T: Send,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable_by(self, compare);
    }

    fn par_sort_unstable(&mut self)
    where
        T: Ord + Send,
    {
        rayon::slice::ParallelSliceMut::par_sort_unstable(self);
    }
}
