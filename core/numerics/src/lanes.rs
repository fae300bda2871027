//! Work on neighbouring channels side by side, so that the compiler can use vector registers.
//!
//! The program is compiled for any processor of its kind. What is done here is compiled again for vectors of four numbers
//! (AVX2), and some of it for eight (AVX-512), and the processor that it runs on decides. Only the width differs, and the
//! results are the same to the last bit; but in what asks for it ([`fused`]), a product and a sum become one rounding where
//! the processor can do so.

#![allow(clippy::inline_always, reason = "what is not inlined is compiled for narrow registers")]

use std::marker::PhantomData;

use pulp::Arch;
pub use pulp::NullaryFnOnce;

/// Channels that are worked on at once, at most.
const WIDEST: usize = 8;

/// Work that is written once for any number of lanes.
pub trait LaneWork {
    /// Works on the channels `offset..offset + C`. Mark it `#[inline(always)]`, and what it calls in its loops: what is
    /// not inlined stays in narrow registers.
    fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize);
}

/// Does the work for all channels, in groups of at most 8.
pub fn in_lanes(channels: usize, work: &mut impl LaneWork) {
    vectorised(Calling(Groups { channels, work }, PhantomData::<Separate>));
}

/// Does the work for all channels, in groups of at most 8, with products and sums as [`fused`] takes them.
pub fn in_lanes_fused(channels: usize, work: &mut impl LaneWork) {
    fused(Groups { channels, work });
}

/// Calls what is `#[inline(always)]` in a function compiled for the widest vectors that the processor has.
pub fn vectorised<W: NullaryFnOnce>(work: W) -> W::Output {
    Arch::new().dispatch(work)
}

/// How a product and a sum are taken.
pub trait Arithmetic {
    /// a·b + c.
    fn mul_add(a: f64, b: f64, c: f64) -> f64;
}

/// Rounded once: for processors that have this.
pub enum Fused {}

/// Rounded twice.
pub enum Separate {}

impl Arithmetic for Fused {
    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a.mul_add(b, c)
    }
}

impl Arithmetic for Separate {
    #[inline(always)]
    fn mul_add(a: f64, b: f64, c: f64) -> f64 {
        a * b + c
    }
}

/// Work that is nearly all products and sums. Results differ between processors by rounding.
pub trait FusedWork {
    /// Does the work. Mark it `#[inline(always)]`, and what it calls in its loops.
    fn call<A: Arithmetic>(self);
}

/// Does the work in a function compiled for the widest vectors that the processor has, with fused products and sums where
/// it has them.
pub fn fused(work: impl FusedWork) {
    #[cfg(target_arch = "x86_64")]
    if let Some(v4) = pulp::x86::V4::try_new() {
        return v4.vectorize(Calling(work, PhantomData::<Fused>));
    }
    #[cfg(target_arch = "x86_64")]
    if let Some(v3) = pulp::x86::V3::try_new() {
        return v3.vectorize(Calling(work, PhantomData::<Fused>));
    }
    if cfg!(target_arch = "aarch64") {
        return vectorised(Calling(work, PhantomData::<Fused>));
    }
    vectorised(Calling(work, PhantomData::<Separate>));
}

struct Calling<W, A>(W, PhantomData<A>);

impl<W: FusedWork, A: Arithmetic> NullaryFnOnce for Calling<W, A> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        self.0.call::<A>();
    }
}

struct Groups<'a, W> {
    channels: usize,
    work: &'a mut W,
}

impl<W: LaneWork> FusedWork for Groups<'_, W> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let Self { channels, work } = self;
        for offset in (0..channels).step_by(WIDEST) {
            match (channels - offset).min(WIDEST) {
                1 => work.lanes::<A, 1>(offset),
                2 => work.lanes::<A, 2>(offset),
                3 => work.lanes::<A, 3>(offset),
                4 => work.lanes::<A, 4>(offset),
                5 => work.lanes::<A, 5>(offset),
                6 => work.lanes::<A, 6>(offset),
                7 => work.lanes::<A, 7>(offset),
                _ => work.lanes::<A, 8>(offset),
            }
        }
    }
}

/// Rows and columns of four by four numbers change places: in whole registers, where the processor has them, as compilers
/// take one number after the other.
#[derive(Debug, Clone, Copy)]
pub struct Transposition {
    #[cfg(target_arch = "x86_64")]
    wide: Option<pulp::x86::V3>,
}

impl Transposition {
    /// As this processor can do it.
    #[must_use]
    pub fn here() -> Self {
        Self {
            #[cfg(target_arch = "x86_64")]
            wide: pulp::x86::V3::try_new(),
        }
    }

    /// Columns as rows; fast only in work that is compiled for wide registers.
    #[inline(always)]
    #[must_use]
    pub fn of(self, rows: [[f64; 4]; 4]) -> [[f64; 4]; 4] {
        #[cfg(target_arch = "x86_64")]
        if let Some(pulp::x86::V3 { avx, .. }) = self.wide {
            let [a, b, c, d] = rows.map(pulp::cast);
            let (ab_even, ab_odd) = (avx._mm256_unpacklo_pd(a, b), avx._mm256_unpackhi_pd(a, b));
            let (cd_even, cd_odd) = (avx._mm256_unpacklo_pd(c, d), avx._mm256_unpackhi_pd(c, d));
            return [
                pulp::cast(avx._mm256_permute2f128_pd::<0x20>(ab_even, cd_even)),
                pulp::cast(avx._mm256_permute2f128_pd::<0x20>(ab_odd, cd_odd)),
                pulp::cast(avx._mm256_permute2f128_pd::<0x31>(ab_even, cd_even)),
                pulp::cast(avx._mm256_permute2f128_pd::<0x31>(ab_odd, cd_odd)),
            ];
        }
        std::array::from_fn(|row| rows.map(|column| column[row]))
    }
}

/// The lanes of one frame, all channels of one instant.
#[inline(always)]
#[must_use]
pub fn load<const C: usize>(frame: &[f64], offset: usize) -> [f64; C] {
    let mut lanes = [0.0; C];
    lanes.copy_from_slice(&frame[offset..offset + C]);
    lanes
}

/// Σ a·b of two sequences, as far as both go.
#[must_use]
pub fn product(a: &[f64], b: &[f64]) -> f64 {
    let count = a.len().min(b.len());
    vectorised(Product(&a[..count], &b[..count]))
}

struct Product<'a>(&'a [f64], &'a [f64]);

impl NullaryFnOnce for Product<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        const LANES: usize = 16;
        // Lanes that do not wait for each other.
        let mut sums = [0.0; LANES];
        let ((whole_a, rest_a), (whole_b, rest_b)) = (self.0.as_chunks::<LANES>(), self.1.as_chunks::<LANES>());
        for (a, b) in whole_a.iter().zip(whole_b) {
            for lane in 0..LANES {
                sums[lane] += a[lane] * b[lane];
            }
        }
        sums.iter().sum::<f64>() + rest_a.iter().zip(rest_b).map(|(a, b)| a * b).sum::<f64>()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    struct Widths(Vec<(usize, usize)>);

    impl LaneWork for Widths {
        fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
            self.0.push((offset, C));
        }
    }

    /// Products and sums that differ from fused ones by rounding.
    struct Recursion<'a>(&'a mut [f64], usize);

    impl LaneWork for Recursion<'_> {
        #[inline(always)]
        fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
            let mut state = [0.3; C];
            for frame in self.0.chunks_exact_mut(self.1) {
                let value: [f64; C] = load(frame, offset);
                for lane in 0..C {
                    state[lane] = value[lane] * 1.7 - state[lane] * 0.9 + value[lane] * state[lane];
                    frame[offset + lane] = state[lane];
                }
            }
        }
    }

    #[test]
    fn wide_registers_change_no_bit() {
        for channels in 1..=11 {
            let frames: Vec<f64> = (0..500 * channels).map(|index| (index as f64).sin()).collect();
            let (mut plain, mut wide) = (frames.clone(), frames);
            Groups { channels, work: &mut Recursion(&mut plain, channels) }.call::<Separate>();
            in_lanes(channels, &mut Recursion(&mut wide, channels));
            assert!(plain.iter().zip(&wide).all(|(plain, wide)| plain.to_bits() == wide.to_bits()));
        }
    }

    #[test]
    fn rows_become_columns() {
        let rows: [[f64; 4]; 4] = std::array::from_fn(|row| std::array::from_fn(|column| (10 * row + column) as f64));
        let columns = Transposition::here().of(rows);
        let expected = (0..16).map(|place| f64::from(10 * (place % 4) + place / 4));
        assert!(columns.as_flattened().iter().copied().eq(expected));
    }

    #[test]
    fn every_channel_is_worked_on_once() {
        for channels in 0..=19 {
            let mut widths = Widths(Vec::new());
            in_lanes(channels, &mut widths);
            let worked: Vec<usize> = widths.0.iter().flat_map(|(offset, width)| *offset..offset + width).collect();
            assert_eq!(worked, (0..channels).collect::<Vec<_>>());
        }
    }
}
