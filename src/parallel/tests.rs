use super::prelude::*;
use std::sync::atomic::{AtomicUsize, Ordering::Relaxed};

/// Lengths around the numbers of parts.
const LENGTHS: [usize; 7] = [0, 1, 2, 63, 64, 65, 10_007];

#[test]
fn all_sources_have_their_items_in_order() {
    for length in LENGTHS {
        let all: Vec<u32> = (0..length as u32).collect();
        let of_range: Vec<u32> = (0..length as u32).into_par_iter().map(|n| n).collect();
        assert_eq!(of_range, all);
        assert_eq!(all.par_iter().copied().collect::<Vec<_>>(), all);
        assert_eq!(all.clone().into_par_iter().collect::<Vec<_>>(), all);
        for size in [1, 3, 64, 20_000] {
            let chunks: Vec<&[u32]> = all.par_chunks(size).collect();
            assert!(chunks.iter().copied().eq(all.chunks(size)));
            let chunks: Vec<&[u32]> = all.par_chunks_exact(size).collect();
            assert!(chunks.iter().copied().eq(all.chunks_exact(size)));
            let windows: Vec<&[u32]> = all.par_windows(size).collect();
            assert!(windows.iter().copied().eq(all.windows(size)));
            let mut changed = all.clone();
            let each = |(chunk, values): (usize, &mut [u32])| {
                values.iter_mut().for_each(|value| *value += chunk as u32);
            };
            changed.par_chunks_mut(size).enumerate().for_each(each);
            assert!(changed.iter().zip(&all).all(|(now, &n)| *now == n + n / size as u32));
        }
    }
}

#[test]
fn steps_are_those_of_iterators() {
    for length in LENGTHS {
        let all: Vec<u32> = (0..length as u32).rev().collect();
        let few: Vec<u32> = all.par_iter().copied().filter(|n| n % 3 == 0).collect();
        assert!(few.iter().eq(all.iter().filter(|n| *n % 3 == 0)));
        let more: Vec<u32> = all.par_iter().flat_map_iter(|&n| [n, n]).collect();
        assert!(more.iter().eq(all.iter().flat_map(|n| [n, n])));
        let stepped: Vec<u32> = all.par_iter().step_by(7).copied().collect();
        assert!(stepped.iter().eq(all.iter().step_by(7)));
        // The shorter one decides, whichever it is.
        let other = &all[length / 2..];
        let pairs: Vec<(&u32, &u32)> = all.par_iter().zip(other).collect();
        assert!(pairs.into_iter().eq(all.iter().zip(other)));
        let pairs: Vec<(u32, u32)> =
            other.par_iter().zip(all.clone()).map(|(&a, b)| (a, b)).collect();
        assert!(pairs.into_iter().eq(other.iter().copied().zip(all.iter().copied())));
        let (halves, doubles): (Vec<u32>, Vec<u32>) =
            all.par_iter().map(|n| (n / 2, n * 2)).unzip();
        assert!(
            halves.iter().zip(&doubles).zip(&all).all(|((h, d), n)| *h == n / 2 && *d == n * 2)
        );
        let mapped = all.par_iter().map_init(Vec::new, |scratch: &mut Vec<u32>, &n| {
            scratch.push(n);
            n
        });
        assert_eq!(mapped.collect::<Vec<_>>(), all);
    }
}

#[test]
fn ends_are_those_of_iterators() {
    for length in LENGTHS {
        let all: Vec<u64> = (0..length as u64).collect();
        let sum: u64 = all.iter().sum();
        assert_eq!(all.par_iter().copied().sum::<u64>(), sum);
        assert_eq!(all.par_iter().copied().max_by(Ord::cmp), all.iter().copied().max());
        assert_eq!(all.par_iter().filter(|n| **n % 2 == 0).count(), length.div_ceil(2));
        assert_eq!(all.par_iter().copied().reduce(|| 0, |a, b| a + b), sum);
        let folded = all.par_iter().fold(|| 0, |sum, n| sum + n).reduce(|| 0, |a, b| a + b);
        assert_eq!(folded, sum);
        assert_eq!(all.par_iter().position_first(|&n| n >= 40), (length > 40).then_some(40));
        assert_eq!(all.par_iter().find_first(|n| **n >= 40).copied(), (length > 40).then_some(40));
        assert_eq!(all.par_iter().any(|&n| n == 64), length > 64);
        assert_eq!(all.par_iter().all(|&n| n < 64), length <= 64);
    }
}

/// The first error, whatever the threads do; and no further part begins.
#[test]
fn errors_end_a_loop() {
    let seen = AtomicUsize::new(0);
    let each = |n: usize| {
        seen.fetch_add(1, Relaxed);
        if n == 5 { Err(n) } else { Ok(n) }
    };
    let length: usize = 1_000_000;
    let whole = (0..length).into_par_iter().map(each).collect::<Result<Vec<usize>, usize>>();
    assert_eq!(whole, Err(5));
    assert_eq!((0..length).into_par_iter().try_for_each(|n| each(n).map(drop)), Err(5));
    assert!(seen.load(Relaxed) < length, "{} items were visited", seen.load(Relaxed));
    let none: Option<Vec<usize>> =
        (0..length).into_par_iter().map(|n| (n != 7).then_some(n)).collect();
    assert_eq!(none, None);
}

/// A loop within a loop does not wait for itself, and a panic reaches the caller.
#[test]
fn loops_nest_and_panics_pass() {
    let inner = |n: usize| (0..n).into_par_iter().map(|m| m).sum::<usize>();
    let sums: Vec<usize> = (0..200_usize).into_par_iter().map(inner).collect();
    assert!(sums.iter().enumerate().all(|(n, &sum)| sum == n * n.saturating_sub(1) / 2));
    let broken = || (0..1000_usize).into_par_iter().for_each(|n| assert!(n != 500, "at {n}"));
    assert!(std::panic::catch_unwind(broken).is_err());
}
