//! The samples around eight places, four or two along each axis, loaded as vectors.

use super::vector::{Lanes, each, four, words};
use fearless_simd::{Simd, f32x4, i16x16, i32x8, prelude::*, u32x8, u64x4};

/// The memory layout of `N` samples in each of `R` rows of `R` slices around eight places.
pub struct Window<'a, T, const N: usize, const R: usize = N> {
    samples: &'a [T],
    /// The first sample of each lane.
    places: [usize; 8],
    /// Samples from one row to the next, and from one slice to the next.
    row: usize,
    slice: usize,
}

impl<'a, T: Copy, const N: usize, const R: usize> Window<'a, T, N, R> {
    /// # Panics
    /// If a window leaves the samples.
    #[inline(always)]
    pub fn new(samples: &'a [T], places: [usize; 8], row: usize, slice: usize) -> Self {
        let room = samples.len().checked_sub((R - 1) * (row + slice) + N);
        let is_inside = room.is_some_and(|room| {
            let ends = each!([0, 1, 2, 3, 4, 5, 6, 7], I => places[I] > room);
            ends == [false; 8]
        });
        assert!(is_inside, "a window leaves the samples");
        Self { samples, places, row, slice }
    }

    /// Returns samples of a row of a slice of a lane, starting at `first`.
    #[inline(always)]
    #[expect(
        unsafe_code,
        reason = "eight checks for a window, instead of two for each of its 128 rows: twice as fast"
    )]
    fn row<const W: usize>(&self, lane: usize, [first, row, slice]: [usize; 3]) -> [T; W] {
        assert!(first + W <= N && row < R && slice < R, "a row outside the window");
        let place = self.places[lane] + first + row * self.row + slice * self.slice;
        // SAFETY: `new` checked that the last row of the last slice ends inside the samples; the
        // others end before it.
        unsafe { self.samples.as_ptr().add(place).cast::<[T; W]>().read_unaligned() }
    }
}

/// Four weights of an axis, which add up to 1, and their first moment.
pub struct Weights<S: Simd> {
    pub weights: [Lanes<S>; 4],
    pub moment: Lanes<S>,
}

impl<S: Simd> Weights<S> {
    /// The first moment uses the sample indices −1, 0, 1 and 2.
    #[inline(always)]
    pub fn new(weights: [Lanes<S>; 4]) -> Self {
        Self { weights, moment: weights[2] - weights[0] + weights[3] * 2.0 }
    }
}

/// Four weights of an axis, which add up to 1, and their slopes, which add up to 0.
pub struct Taps<S: Simd> {
    pub weights: [Lanes<S>; 4],
    pub slopes: [Lanes<S>; 4],
}

/// A sample type, and how to load vectors of it.
pub trait Sample: Copy + Send + Sync {
    /// The weights of four samples in a row, and those of the first moment, as [`Sample::row`]
    /// takes them.
    type Row<S: Simd>: Copy;
    /// The weights of four samples in a row and their slopes, as [`Sample::tapped`] takes them.
    type Tapped<S: Simd>: Copy;
    /// The factor that the sums of rows must be multiplied by.
    const UNIT: f32;
    /// The zero of small integers. Their sums are exact, so that any other zero can be subtracted
    /// afterwards. For other types (`None`), the zero is subtracted from each sample.
    const ZERO: Option<f32>;

    /// Prepares weights for rows. Rounds them if rows take rounded weights.
    fn weigh<S: Simd>(simd: S, weights: &mut Weights<S>) -> Self::Row<S>;

    /// Returns the weighted sum of a row of a slice and its first moment, to be multiplied by
    /// [`Sample::UNIT`]. Values are relative to [`Sample::ZERO`], or else to `zero`.
    fn row<S: Simd>(
        simd: S,
        window: &Window<Self, 4>,
        row: usize,
        slice: usize,
        weights: &Self::Row<S>,
        zero: f32,
    ) -> [Lanes<S>; 2];

    /// Prepares weights and slopes for rows.
    fn tap<S: Simd>(simd: S, taps: &Taps<S>) -> Self::Tapped<S>;

    /// Returns the weighted sum of a row of a slice and its slope, as [`Sample::row`] does.
    fn tapped<S: Simd>(
        simd: S,
        window: &Window<Self, 4>,
        row: [usize; 2],
        taps: &Self::Tapped<S>,
        zero: f32,
    ) -> [Lanes<S>; 2];

    /// Returns four samples of a window, in a row of a slice from `first` on.
    fn four<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 4];

    /// Returns two samples of a window.
    fn two<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 2];

    fn value(self) -> f32;
}

/// Returns the weighted sum of four samples and its first moment.
#[inline(always)]
pub fn row_of<S: Simd>(
    weights: &[Lanes<S>; 4],
    mut four: [Lanes<S>; 4],
    zero: f32,
) -> [Lanes<S>; 2] {
    if zero != 0.0 {
        four = four!(I => four[I] - zero);
    }
    let before = weights[0] * four[0];
    let after = weights[2] * four[2];
    let second = weights[3] * four[3];
    [weights[1].mul_add(four[1], before) + (after + second), after - before + second * 2.0]
}

/// Returns the weighted sum of four samples.
#[inline(always)]
pub fn of_four<S: Simd>(weights: &[Lanes<S>; 4], samples: &[Lanes<S>; 4]) -> Lanes<S> {
    let pairs = [weights[0] * samples[0], weights[1] * samples[1]];
    weights[2].mul_add(samples[2], pairs[0]) + weights[3].mul_add(samples[3], pairs[1])
}

/// Weights of small integers are multiples of 1/16384: the sum of two products of 16-bit numbers
/// fits 32 bits.
const PARTS: f32 = 16384.0;

/// Weights of two pairs of samples for each lane, and those of the first moment or the slopes.
#[derive(Clone, Copy)]
pub struct Pairs<S: Simd> {
    value: [i16x16<S>; 2],
    second: [i16x16<S>; 2],
}

impl<S: Simd> Pairs<S> {
    /// Rounds weights so that they still add up to 1. `order` says which samples form the pairs.
    #[inline(always)]
    fn new(simd: S, weights: &mut Weights<S>, order: [usize; 4]) -> Self {
        let [before, _, after, second] =
            four!(I => i32x8::<S>::truncate_from(weights.weights[I] * PARTS + 0.5));
        // Twice this weight must fit 16 bits: beside the lattice, the last sample may have all the
        // weight.
        let second = second.min(PARTS as i32 - 1);
        let none = i32x8::splat(simd, 0);
        let values = [before, none + PARTS as i32 - before - after - second, after, second];
        let moments = [none - before, none, after, second + second];
        weights.moment = Lanes::float_from(moments[0] + moments[2] + moments[3]) * (1.0 / PARTS);
        Self::packed([values, moments], order)
    }

    /// Rounds weights and slopes so that the weights still add up to 1 and the slopes to 0.
    #[inline(always)]
    fn of_taps(taps: &Taps<S>, order: [usize; 4]) -> Self {
        let parts = each!([0, 1], I => {
            let [before, _, after, second] = four!(K => {
                let parts = [taps.weights[K], taps.slopes[K]][I] * PARTS;
                i32x8::<S>::truncate_from((parts + 0.5).floor())
            });
            let here = before * -1 + PARTS as i32 * (1 - I as i32) - after - second;
            [before, here, after, second]
        });
        Self::packed(parts, order)
    }

    #[inline(always)]
    fn packed(parts: [[i32x8<S>; 4]; 2], order: [usize; 4]) -> Self {
        let [value, second] = each!([0, 1], I => {
            each!([0, 2], K => ((parts[I][order[K]] & 0xffff) | (parts[I][order[K + 1]] << 16))
                .bitcast::<i16x16<S>>())
        });
        Self { value, second }
    }

    /// Returns the sums of two pairs of samples for each lane.
    #[inline(always)]
    fn sums(&self, pairs: [u32x8<S>; 2]) -> [Lanes<S>; 2] {
        let [a, b] = each!([0, 1], I => pairs[I].bitcast::<i16x16<S>>());
        let value = a.pairwise_dot_product(self.value[0]) + b.pairwise_dot_product(self.value[1]);
        let second =
            a.pairwise_dot_product(self.second[0]) + b.pairwise_dot_product(self.second[1]);
        [Lanes::float_from(value), Lanes::float_from(second)]
    }
}

impl Sample for u8 {
    type Row<S: Simd> = Pairs<S>;
    type Tapped<S: Simd> = Pairs<S>;
    const UNIT: f32 = 1.0 / PARTS;
    const ZERO: Option<f32> = Some(0.0);

    #[inline(always)]
    fn tap<S: Simd>(_: S, taps: &Taps<S>) -> Pairs<S> {
        Pairs::of_taps(taps, [0, 2, 1, 3])
    }

    #[inline(always)]
    fn tapped<S: Simd>(
        simd: S,
        window: &Window<Self, 4>,
        [row, slice]: [usize; 2],
        taps: &Pairs<S>,
        zero: f32,
    ) -> [Lanes<S>; 2] {
        Self::row(simd, window, row, slice, taps, zero)
    }

    #[inline(always)]
    fn weigh<S: Simd>(simd: S, weights: &mut Weights<S>) -> Pairs<S> {
        Pairs::new(simd, weights, [0, 2, 1, 3])
    }

    #[inline(always)]
    fn row<S: Simd>(
        simd: S,
        window: &Window<Self, 4>,
        row: usize,
        slice: usize,
        weights: &Pairs<S>,
        _: f32,
    ) -> [Lanes<S>; 2] {
        let words = words!(simd, L => u32::from_le_bytes(window.row(L, [0, row, slice])));
        weights.sums([words & 0x00ff_00ff, (words >> 8) & 0x00ff_00ff])
    }

    #[inline(always)]
    fn four<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 4] {
        let words = words!(simd, L => u32::from_le_bytes(window.row(L, first)));
        four!(I => Lanes::float_from(((words >> (8 * I as u32)) & 0xff).bitcast::<i32x8<S>>()))
    }

    #[inline(always)]
    fn two<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 2] {
        let words = words!(simd, L => u32::from(u16::from_le_bytes(window.row(L, first))));
        [
            Lanes::float_from((words & 0xff).bitcast::<i32x8<S>>()),
            Lanes::float_from((words >> 8).bitcast::<i32x8<S>>()),
        ]
    }

    #[inline(always)]
    fn value(self) -> f32 {
        f32::from(self)
    }
}

/// Implements [`Sample`] for a type of two bytes, with two samples in a word. XOR with `$turned`
/// turns samples into signed numbers relative to `$zero`. `$first` and `$second` extract the first
/// and the second sample of a word as 32-bit integers.
macro_rules! two_bytes {
    ($sample:ty, $turned:expr, $zero:expr, $word:ident => $first:expr, $second:expr) => {
        impl Sample for $sample {
            type Row<S: Simd> = Pairs<S>;
            type Tapped<S: Simd> = Pairs<S>;
            const UNIT: f32 = 1.0 / PARTS;
            const ZERO: Option<f32> = Some($zero);

            #[inline(always)]
            fn tap<S: Simd>(_: S, taps: &Taps<S>) -> Pairs<S> {
                Pairs::of_taps(taps, [0, 1, 2, 3])
            }

            #[inline(always)]
            fn tapped<S: Simd>(
                simd: S,
                window: &Window<Self, 4>,
                [row, slice]: [usize; 2],
                taps: &Pairs<S>,
                zero: f32,
            ) -> [Lanes<S>; 2] {
                Self::row(simd, window, row, slice, taps, zero)
            }

            #[inline(always)]
            fn weigh<S: Simd>(simd: S, weights: &mut Weights<S>) -> Pairs<S> {
                Pairs::new(simd, weights, [0, 1, 2, 3])
            }

            #[inline(always)]
            fn row<S: Simd>(
                simd: S,
                window: &Window<Self, 4>,
                row: usize,
                slice: usize,
                weights: &Pairs<S>,
                _: f32,
            ) -> [Lanes<S>; 2] {
                let turned: u32 = $turned;
                let pairs = pairs_of_words(simd, window, [0, row, slice]);
                weights.sums(each!([0, 1], I => pairs[I] ^ turned))
            }

            #[inline(always)]
            fn four<S: Simd, const N: usize, const R: usize>(
                simd: S,
                window: &Window<Self, N, R>,
                first: [usize; 3],
            ) -> [Lanes<S>; 4] {
                let pairs = pairs_of_words(simd, window, first);
                let [a, b] = each!([0, 1], I => {
                    let $word = pairs[I];
                    [Lanes::float_from($first), Lanes::float_from($second)]
                });
                [a[0], a[1], b[0], b[1]]
            }

            #[inline(always)]
            fn two<S: Simd, const N: usize, const R: usize>(
                simd: S,
                window: &Window<Self, N, R>,
                first: [usize; 3],
            ) -> [Lanes<S>; 2] {
                let $word = words!(simd, L => in_word(window.row(L, first)));
                [Lanes::float_from($first), Lanes::float_from($second)]
            }

            #[inline(always)]
            fn value(self) -> f32 {
                f32::from(self)
            }
        }
    };
}
two_bytes!(u16, 0x8000_8000, 32768.0, word => (word & 0xffff).bitcast::<i32x8<S>>(),
    (word >> 16).bitcast::<i32x8<S>>());
two_bytes!(i16, 0, 0.0, word => (word << 16).bitcast::<i32x8<S>>() >> 16,
    word.bitcast::<i32x8<S>>() >> 16);

/// Returns four successive samples of each lane, two in a word. Each lane is loaded at once.
#[inline(always)]
fn pairs_of_words<S: Simd, T: Into<i32> + Copy, const N: usize, const R: usize>(
    simd: S,
    window: &Window<T, N, R>,
    first: [usize; 3],
) -> [u32x8<S>; 2] {
    let [low, high] = each!([0, 4], HALF => {
        let lanes: u64x4<S> = four!(L => {
            let [a, b, c, d] = window.row(HALF + L, first);
            u64::from(in_word([a, b])) | u64::from(in_word([c, d])) << 32
        })
        .simd_into(simd);
        lanes.bitcast::<u32x8<S>>()
    });
    [low.unzip_low(high), low.unzip_high(high)]
}

/// Packs two successive samples into a word.
#[inline(always)]
fn in_word<T: Into<i32> + Copy>(samples: [T; 2]) -> u32 {
    let (low, high): (i32, i32) = (samples[0].into(), samples[1].into());
    low as u32 & 0xffff | (high as u32) << 16
}

/// Rows of samples that are converted to 32-bit floats one by one.
macro_rules! rows_of_floats {
    () => {
        type Row<S: Simd> = [Lanes<S>; 4];
        type Tapped<S: Simd> = [[Lanes<S>; 4]; 2];
        const UNIT: f32 = 1.0;
        const ZERO: Option<f32> = None;

        #[inline(always)]
        fn tap<S: Simd>(_: S, taps: &Taps<S>) -> [[Lanes<S>; 4]; 2] {
            [taps.weights, taps.slopes]
        }

        #[inline(always)]
        fn tapped<S: Simd>(
            simd: S,
            window: &Window<Self, 4>,
            [row, slice]: [usize; 2],
            taps: &[[Lanes<S>; 4]; 2],
            zero: f32,
        ) -> [Lanes<S>; 2] {
            let mut samples = Self::four(simd, window, [0, row, slice]);
            if zero != 0.0 {
                samples = four!(I => samples[I] - zero);
            }
            each!([0, 1], I => of_four(&taps[I], &samples))
        }

        #[inline(always)]
        fn weigh<S: Simd>(_: S, weights: &mut Weights<S>) -> [Lanes<S>; 4] {
            weights.weights
        }

        #[inline(always)]
        fn row<S: Simd>(
            simd: S,
            window: &Window<Self, 4>,
            row: usize,
            slice: usize,
            weights: &[Lanes<S>; 4],
            zero: f32,
        ) -> [Lanes<S>; 2] {
            row_of(weights, Self::four(simd, window, [0, row, slice]), zero)
        }
    };
}

impl Sample for i32 {
    rows_of_floats!();

    #[inline(always)]
    fn four<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 4] {
        columns(
            simd,
            each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                let row: [i32; 4] = window.row(L, first);
                four!(I => row[I] as f32)
            }),
        )
    }

    #[inline(always)]
    fn two<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 2] {
        pairs(
            simd,
            each!([0, 1, 2, 3, 4, 5, 6, 7], L => {
                let row: [i32; 2] = window.row(L, first);
                [row[0] as f32, row[1] as f32]
            }),
        )
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self as f32
    }
}

impl Sample for f32 {
    rows_of_floats!();

    #[inline(always)]
    fn four<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 4] {
        columns(simd, each!([0, 1, 2, 3, 4, 5, 6, 7], L => window.row(L, first)))
    }

    #[inline(always)]
    fn two<S: Simd, const N: usize, const R: usize>(
        simd: S,
        window: &Window<Self, N, R>,
        first: [usize; 3],
    ) -> [Lanes<S>; 2] {
        pairs(simd, each!([0, 1, 2, 3, 4, 5, 6, 7], L => window.row(L, first)))
    }

    #[inline(always)]
    fn value(self) -> f32 {
        self
    }
}

/// Transposes rows of four numbers, one for each lane, into columns.
#[inline(always)]
pub fn columns<S: Simd>(simd: S, rows: [[f32; 4]; 8]) -> [Lanes<S>; 4] {
    let [low, high] = each!([0, 4], I => {
        let rows: [f32x4<S>; 4] = four!(L => rows[I + L].simd_into(simd));
        let (ac, bd) = (rows[0].zip_low(rows[2]), rows[1].zip_low(rows[3]));
        let (ac_high, bd_high) = (rows[0].zip_high(rows[2]), rows[1].zip_high(rows[3]));
        [ac.zip_low(bd), ac.zip_high(bd), ac_high.zip_low(bd_high), ac_high.zip_high(bd_high)]
    });
    four!(I => simd.combine_f32x4(low[I], high[I]))
}

/// The same for two numbers of each lane.
#[inline(always)]
pub fn pairs<S: Simd>(simd: S, pairs: [[f32; 2]; 8]) -> [Lanes<S>; 2] {
    each!([0, 1], I => {
        let lanes: [f32; 8] = each!([0, 1, 2, 3, 4, 5, 6, 7], L => pairs[L][I]);
        lanes.simd_into(simd)
    })
}
