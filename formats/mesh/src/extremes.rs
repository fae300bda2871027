//! Smallest and largest of many numbers, lane by lane.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::numerics::lanes::NullaryFnOnce;

use crate::vertices::LANES;

/// Smallest and largest of numbers; NaN where one of them is not finite.
pub(crate) struct Extremes<'a>(pub &'a [f64]);

impl NullaryFnOnce for Extremes<'_> {
    type Output = [f64; 2];

    #[inline(always)]
    fn call(self) -> [f64; 2] {
        let mut range = [[f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]];
        let (eights, rest) = self.0.as_chunks::<LANES>();
        // Becomes NaN with what is not finite.
        let mut nothing = [0.0; LANES];
        for values in eights {
            for lane in 0..LANES {
                nothing[lane] += 0.0 * values[lane];
            }
            widen(&mut range, *values);
        }
        let nothing = nothing.into_iter().chain(rest.iter().map(|value| 0.0 * value)).sum::<f64>();
        let [low, high] = ends(range);
        [rest.iter().copied().fold(low, lower) + nothing, rest.iter().copied().fold(high, higher) + nothing]
    }
}

/// Takes values between the lowest and the highest in each lane.
#[inline(always)]
pub(crate) fn widen([low, high]: &mut [[f64; LANES]; 2], values: [f64; LANES]) {
    for lane in 0..LANES {
        low[lane] = lower(values[lane], low[lane]);
    }
    for lane in 0..LANES {
        high[lane] = higher(values[lane], high[lane]);
    }
}

/// Of all lanes together.
pub(crate) fn ends([low, high]: [[f64; LANES]; 2]) -> [f64; 2] {
    [low.into_iter().fold(f64::INFINITY, lower), high.into_iter().fold(f64::NEG_INFINITY, higher)]
}

/// Comparisons compile to single instructions; `f64::min` has to look after NaN.
#[inline(always)]
pub(crate) fn lower(a: f64, b: f64) -> f64 {
    if a < b { a } else { b }
}

#[inline(always)]
pub(crate) fn higher(a: f64, b: f64) -> f64 {
    if a > b { a } else { b }
}
