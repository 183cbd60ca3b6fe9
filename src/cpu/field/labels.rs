//! Label maps: the label of the nearest sample, and the gradient of that label's mask.

use super::{
    super::{
        vector::{Lanes, four, three},
        window::{Sample, Weights, Window, row_of},
    },
    BEYOND, Bell, Field, Rows,
};
use fearless_simd::{Simd, prelude::*};

impl<T: Sample> Field<'_, T> {
    /// Returns the labels at places relative to zero, and the changes per step along each axis of
    /// their masks. At a sample of the label, a mask is the share of the label around it; at
    /// another, it is what that sample's own label leaves.
    #[inline(always)]
    pub(super) fn label<S: Simd>(
        &self,
        simd: S,
        bell: &Bell,
        shares: &[u8],
        place: [Lanes<S>; 3],
    ) -> (Lanes<S>, [Lanes<S>; 3]) {
        let place: [Lanes<S>; 3] = three!(I => {
            let last = self.dims[I] as f32 - 1.0;
            place[I].max(Lanes::splat(simd, -BEYOND)).min(Lanes::splat(simd, last + BEYOND))
        });
        let first: [Lanes<S>; 3] = three!(I => place[I].floor());
        let is_within = self.hold(first, [-1.0, 2.0]);
        let label = self.nearest(simd, place);
        let slopes = if is_within {
            let weights: [Weights<S>; 3] = three!(I => bell.weights(simd, place[I] - first[I]));
            let starts = three!(I => first[I] - 1.0);
            let labels: Window<T, 4> = self.window(starts);
            let shares: Window<u8, 4> = self.window_of(shares, starts);
            self.mask_slopes(simd, (bell, &weights), label, &labels, &shares)
        } else {
            let (weights, labels) = self.held(self.samples, simd, (bell, place, first));
            let (_, shares) = self.held(shares, simd, (bell, place, first));
            self.mask_slopes(simd, (bell, &weights), label, &labels, &shares)
        };
        (label - self.zero, slopes)
    }

    /// Returns the changes per step along each axis of the masks of labels.
    #[inline(always)]
    fn mask_slopes<S: Simd>(
        &self,
        simd: S,
        (bell, weights): (&Bell, &[Weights<S>; 3]),
        label: Lanes<S>,
        labels: &impl Rows<S>,
        shares: &impl Rows<S>,
    ) -> [Lanes<S>; 3] {
        let (_, slopes) = self.sums(
            bell,
            weights,
            1.0 / 255.0,
            #[inline(always)]
            |j, k| {
                let (labels, shares) = (labels.four(simd, j, k), shares.four(simd, j, k));
                let mask = four!(I => {
                    labels[I].simd_eq(label).select(shares[I], 255.0 - shares[I])
                });
                row_of(&weights[0].weights, mask, 0.0)
            },
        );
        slopes
    }

    /// Returns the samples nearest to places.
    #[inline(always)]
    fn nearest<S: Simd>(&self, simd: S, place: [Lanes<S>; 3]) -> Lanes<S> {
        let [nx, ny, _] = self.dims;
        let [x, y, z]: [[f32; 8]; 3] = three!(I => {
            let last = Lanes::splat(simd, self.dims[I] as f32 - 1.0);
            (place[I] + 0.5).floor().max(Lanes::splat(simd, 0.0)).min(last).into()
        });
        let at = |lane: usize| {
            self.samples[(z[lane] as usize * ny + y[lane] as usize) * nx + x[lane] as usize].value()
        };
        let values: [f32; 8] = std::array::from_fn(at);
        values.simd_into(simd)
    }
}
