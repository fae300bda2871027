//! Values of a filtered profile.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use std::{borrow::Cow, ops::Range};

use super::{Settings, Texture};
use crate::areal::derivative;
use runout_numerics::lanes::{NullaryFnOnce, load, vectorised};

/// Spacings that differ by less than this share are equal.
const EVEN: f64 = 1e-6;
/// Share of the mean distance of points by which one may be off a limit and counts as at it: the axis of a cylinder, by which places
/// along it are given, is fitted to noisy points.
pub(super) const AT_AN_END: f64 = 1e-3;

/// A profile about its mean line.
pub(super) struct Profile<'a> {
    pub(super) positions_mm: Cow<'a, [f64]>,
    /// Heights about the mean, NaN where missing.
    pub(super) heights_um: Vec<f64>,
    /// The circumference of a closed profile.
    pub(super) turn_mm: Option<f64>,
    /// Indices of the points of each stretch that was measured.
    stretches: Vec<Range<usize>>,
    /// Length that each point stands for.
    cells: Vec<f64>,
    even: bool,
}

/// A filtered stretch of an open profile.
pub(super) struct Stretch {
    pub(super) positions_mm: Vec<f64>,
    pub(super) heights_um: Vec<f64>,
}

impl<'a> Profile<'a> {
    /// A closed profile on equal angles.
    pub(super) fn closed(positions_mm: &'a [f64], heights_um: Vec<f64>, turn_mm: f64) -> Self {
        let (count, cells) = (heights_um.len(), vec![1.0; heights_um.len()]);
        let positions_mm = Cow::Borrowed(positions_mm);
        let (turn_mm, stretches, even) = (Some(turn_mm), std::iter::once(0..count).collect(), true);
        Self { positions_mm, heights_um, turn_mm, stretches, cells, even }.about_mean()
    }

    /// An open profile of some stretches, in the order of their positions. What is between them has neither length nor height.
    pub(super) fn open(parts: Vec<Stretch>) -> Self {
        let (mut positions_mm, mut heights_um, mut all_cells) = (Vec::new(), Vec::new(), Vec::new());
        let (mut stretches, mut even) = (Vec::new(), true);
        let step_of = |part: &Stretch| part.positions_mm.get(1).map(|second| second - part.positions_mm[0]);
        let step_mm = parts.first().and_then(step_of);
        for part in parts {
            if let Some(last) = positions_mm.last().copied() {
                // A missing point ends elements and slopes there.
                positions_mm.push(f64::midpoint(last, part.positions_mm.first().copied().unwrap_or(last)));
                heights_um.push(f64::NAN);
                all_cells.push(0.0);
            }
            let same = step_of(&part).zip(step_mm).is_none_or(|(step, first)| (step - first).abs() <= EVEN * first);
            let (cells, are_even) = cells(&part.positions_mm);
            even &= same && are_even;
            stretches.push(positions_mm.len()..positions_mm.len() + part.positions_mm.len());
            positions_mm.extend(part.positions_mm);
            heights_um.extend(part.heights_um);
            all_cells.extend(cells);
        }
        if even {
            all_cells.fill(1.0);
        }
        let positions_mm = Cow::Owned(positions_mm);
        Self { positions_mm, heights_um, turn_mm: None, stretches, cells: all_cells, even }.about_mean()
    }

    fn about_mean(mut self) -> Self {
        let ([mean], length) = sums(&self.heights_um, &self.cells, |height| [height]);
        let mean = mean / length;
        for height in &mut self.heights_um {
            *height -= mean;
        }
        self
    }

    /// First position and length of each stretch.
    fn extents(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        self.stretches.iter().map(|stretch| match (self.turn_mm, &self.positions_mm[stretch.clone()]) {
            (Some(turn), _) => (0.0, turn),
            (None, [first, .., last]) => (*first, last - first),
            _ => (0.0, 0.0),
        })
    }

    /// The values that need neither elements nor the material ratio curve; the others are NaN.
    pub(super) fn heights(&self, settings: &Settings) -> Texture {
        let measured_mm: f64 = self.extents().map(|(_, length)| length).sum();
        let wanted = settings.section_mm.or(settings.lambda_c_mm).unwrap_or(measured_mm / 5.0);
        let spacing_mm = measured_mm / self.heights_um.len().max(1) as f64;
        let off_mm = AT_AN_END * spacing_mm;
        let mut extremes = Vec::new();
        let mut sections = 0;
        for (stretch, (start, length)) in self.stretches.iter().zip(self.extents()) {
            // Each point stands for a spacing: a length that is whole sections but for one has them all.
            let of_stretch = (((length + spacing_mm + off_mm) / wanted) as usize).clamp(1, stretch.len().max(1));
            let section_mm = length / of_stretch as f64;
            // A point at the end of a section is the next one's, also where its place is off a little.
            let start = start - off_mm;
            let mut rest = (&self.positions_mm[stretch.clone()], &self.heights_um[stretch.clone()]);
            for section in 0..of_stretch {
                let last = section + 1 == of_stretch;
                let inside = |position: &f64| last || ((position - start) / section_mm) as usize <= section;
                let (positions, heights) = rest;
                let count = positions.partition_point(inside).min(heights.len());
                extremes.push(vectorised(Ends(&heights[..count])));
                rest = (&positions[count..], &heights[count..]);
            }
            sections += of_stretch;
        }
        let points = vectorised(There(&self.heights_um));
        // A section in which nothing was measured has no say.
        extremes.retain(|(low, _)| low.is_finite());
        let over_sections = |of: fn(&(f64, f64)) -> f64| extremes.iter().map(of).sum::<f64>() / extremes.len() as f64;
        let (rp, rv) = (over_sections(|(_, high)| *high), over_sections(|(low, _)| -low));
        let rz1max = extremes.iter().map(|(low, high)| high - low).fold(f64::NAN, f64::max);
        let (low, high) = extremes
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), section| (low.min(section.0), high.max(section.1)));
        let [ra, variance, third, fourth] = self.moments();
        Texture {
            ra,
            rq: variance.sqrt(),
            rp,
            rv,
            rz: rp + rv,
            rz1max,
            rt: if points == 0 { f64::NAN } else { high - low },
            rsk: third / (variance * variance.sqrt()),
            rku: fourth / (variance * variance),
            rdq: self.gradient(),
            points,
            missing: self.stretches.iter().map(Range::len).sum::<usize>() - points,
            sections,
            section_mm: measured_mm / sections.max(1) as f64,
            rsm_mm: f64::NAN,
            rc: f64::NAN,
            rk: f64::NAN,
            rpk: f64::NAN,
            rvk: f64::NAN,
            rmrk1_percent: f64::NAN,
            rmrk2_percent: f64::NAN,
            rdc: f64::NAN,
            cropped_mm: 0.0,
        }
    }

    /// Means of |z|, z², z³ and z⁴.
    fn moments(&self) -> [f64; 4] {
        let (sums, length) = sums(&self.heights_um, &self.cells, |height| {
            let square = height * height;
            [height.abs(), square, square * height, square * square]
        });
        sums.map(|sum| sum / length)
    }

    /// Root mean square of the slope, over the points with three measured neighbours on each side.
    fn gradient(&self) -> f64 {
        let count = self.heights_um.len();
        if !self.even || count < 7 {
            return f64::NAN;
        }
        let spacing_um = 1e3 * (self.positions_mm[1] - self.positions_mm[0]);
        let (mut sum, mut number) = vectorised(Slopes(&self.heights_um));
        if self.turn_mm.is_some() {
            for point in (0..3).chain(count - 3..count) {
                let beside = |step: isize| (point.cast_signed() + step).rem_euclid(count.cast_signed()) as usize;
                let square = derivative(|step| self.heights_um[beside(step)]).powi(2);
                if square.is_finite() {
                    (sum, number) = (sum + square, number + 1.0);
                }
            }
        }
        (sum / number).sqrt() / spacing_um
    }
}

/// Length that each point of an open profile stands for, and whether all stand for the same.
fn cells(positions_mm: &[f64]) -> (Vec<f64>, bool) {
    let gaps: Vec<f64> = positions_mm.windows(2).map(|pair| pair[1] - pair[0]).collect();
    if gaps.iter().all(|gap| (gap - gaps[0]).abs() <= EVEN * gaps[0]) {
        return (vec![1.0; positions_mm.len()], true);
    }
    let left = gaps.first().into_iter().chain(&gaps);
    (left.zip(gaps.iter().chain(gaps.last())).map(|(left, right)| 0.5 * (left + right)).collect(), false)
}

/// Sums of terms of the heights that there are, each times its cell, and of the cells: over lanes that do not wait for each
/// other, because Monte Carlo asks for this many thousand times.
fn sums<const N: usize>(heights: &[f64], cells: &[f64], terms: impl Fn(f64) -> [f64; N]) -> ([f64; N], f64) {
    vectorised(Sums { heights, cells, terms })
}

struct Sums<'a, F> {
    heights: &'a [f64],
    cells: &'a [f64],
    terms: F,
}

impl<const N: usize, F: Fn(f64) -> [f64; N]> NullaryFnOnce for Sums<'_, F> {
    type Output = ([f64; N], f64);

    #[inline(always)]
    fn call(self) -> ([f64; N], f64) {
        let (mut sums, mut length) = ([[0.0; LANES]; N], [0.0; LANES]);
        let mut add = |heights: [f64; LANES], cells: [f64; LANES]| {
            for lane in 0..LANES {
                let there = is_there(heights[lane]);
                let height = if there { heights[lane] } else { 0.0 };
                let cell = if there { cells[lane] } else { 0.0 };
                let terms = (self.terms)(height);
                for term in 0..N {
                    sums[term][lane] += cell * terms[term];
                }
                length[lane] += cell;
            }
        };
        let count = self.heights.len().min(self.cells.len());
        let (heights, rest) = self.heights[..count].as_chunks::<LANES>();
        let (cells, rest_of_cells) = self.cells[..count].as_chunks::<LANES>();
        heights.iter().zip(cells).for_each(|(heights, cells)| add(*heights, *cells));
        add(filled(rest, f64::NAN), filled(rest_of_cells, 0.0));
        (sums.map(|lanes| lanes.iter().sum()), length.iter().sum())
    }
}

const LANES: usize = 8;

#[inline(always)]
fn is_there(height: f64) -> bool {
    height.abs() < f64::INFINITY
}

/// The last values, fewer than there are lanes, and others behind them.
#[inline(always)]
fn filled(rest: &[f64], other: f64) -> [f64; LANES] {
    let mut lanes = [other; LANES];
    lanes[..rest.len()].copy_from_slice(rest);
    lanes
}

/// Lowest and highest of the heights that are there.
struct Ends<'a>(&'a [f64]);

impl NullaryFnOnce for Ends<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let (mut low, mut high) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES]);
        let mut look = |heights: [f64; LANES]| {
            for lane in 0..LANES {
                let (height, there) = (heights[lane], is_there(heights[lane]));
                low[lane] = if there && height < low[lane] { height } else { low[lane] };
                high[lane] = if there && height > high[lane] { height } else { high[lane] };
            }
        };
        let (whole, rest) = self.0.as_chunks::<LANES>();
        for heights in whole {
            look(*heights);
        }
        look(filled(rest, f64::NAN));
        (low.into_iter().fold(f64::INFINITY, f64::min), high.into_iter().fold(f64::NEG_INFINITY, f64::max))
    }
}

/// Number of heights that are there.
struct There<'a>(&'a [f64]);

impl NullaryFnOnce for There<'_> {
    type Output = usize;

    #[inline(always)]
    fn call(self) -> usize {
        self.0.iter().map(|height| usize::from(is_there(*height))).sum()
    }
}

/// Sum of the squared derivatives at points with three neighbours on both sides, and how many there are.
struct Slopes<'a>(&'a [f64]);

impl NullaryFnOnce for Slopes<'_> {
    type Output = (f64, f64);

    #[inline(always)]
    fn call(self) -> (f64, f64) {
        let inner = self.0.len().saturating_sub(6);
        let whole = inner - inner % LANES;
        let (mut sums, mut counts) = ([0.0; LANES], [0.0; LANES]);
        for offset in (0..whole).step_by(LANES) {
            let beside: [[f64; LANES]; 7] = std::array::from_fn(|index| load(self.0, offset + index));
            for lane in 0..LANES {
                let square = derivative(|step| beside[(step + 3) as usize][lane]).powi(2);
                let there = is_there(square);
                sums[lane] += if there { square } else { 0.0 };
                counts[lane] += if there { 1.0 } else { 0.0 };
            }
        }
        let (mut sum, mut count): (f64, f64) = (sums.iter().sum(), counts.iter().sum());
        for window in self.0[whole..].windows(7) {
            let square = derivative(|step| window[(step + 3) as usize]).powi(2);
            if is_there(square) {
                (sum, count) = (sum + square, count + 1.0);
            }
        }
        (sum, count)
    }
}
