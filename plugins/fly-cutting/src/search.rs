//! Where a line, another feed or shifted rows may be: correlations of the residual with every frequency.
//!
//! A line of q periods a turn adds Re a·e^{2πi q τ} at the turns τ = n + θ/2π. n is whole, so that e^{2πi q n} has the fraction of q
//! only; the rows, whose angles θ differ, show the whole part. The sum over passes is a Fourier transform a row, the sum over rows is
//! taken at the few whole parts that they resolve, and at all of them where the fraction is known.

use std::f64::consts::TAU;

use runout_core::{Complex64, numerics::fourier::complex_forward};

use crate::{
    heights::{Heights, Row},
    passes::{Cut, Line, PassTurns, Surface},
    phase::without_mean,
};

/// Frequencies for each that the passes resolve.
const OVERSAMPLED: usize = 4;
/// Longest transform.
const LONGEST: usize = 1 << 18;
/// Angle over the rows between whole parts that are summed apart, in radians.
const RESOLVED: f64 = 1.5;
/// A line has at least so many periods, counted from the next whole ratio, over the map: with fewer it is a bend.
pub(crate) const FEWEST_PERIODS: f64 = 0.8;
/// Peaks of the spectrum that are tried, and the least of them beside the strongest.
const PEAKS: usize = 4;
const LEAST_PEAK: f64 = 0.1;
/// Periods over the map by which peaks are apart.
const BESIDE: f64 = 3.0;
/// Feeds within ± this share are evaluated.
const FEEDS: f64 = 0.03;
/// Part of a period at the end of the map between feeds that are evaluated.
const FEED_STEP: f64 = 0.4;
/// Shifts of rows that are evaluated, to each side.
const MOST_SHIFTS: f64 = 2000.0;
/// What has to explain more than the declared cut by this factor, so that a search begins elsewhere.
const MORE: f64 = 1.1;

/// Other feeds that are evaluated, of a map of so many passes.
pub(crate) fn feeds(passes: usize) -> usize {
    (2.0 * FEEDS * passes as f64 / FEED_STEP).ceil() as usize
}

/// A parameter that shifts rows along the feed, as it is looked for.
#[derive(Debug, Clone)]
pub(crate) struct Shift {
    /// By row, in mm per unit.
    per_unit_mm: Vec<f64>,
    /// Values are multiples of it.
    step: f64,
    /// To each side.
    count: i32,
}

impl Shift {
    /// Up to `farthest`, in steps that the farthest rows show, and not so far that neighbours are shifted by half a feed. `None` where all rows are
    /// shifted alike.
    pub(crate) fn new(rows: &[Row], shift_mm: impl Fn(&Row) -> f64, farthest: f64, feed_mm: f64) -> Option<Self> {
        let per_unit_mm: Vec<f64> = rows.iter().map(shift_mm).collect();
        let (low, high) = per_unit_mm
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), shift| (low.min(*shift), high.max(*shift)));
        let widest = per_unit_mm.windows(2).map(|pair| (pair[1] - pair[0]).abs()).fold(0.0, f64::max);
        let step = FEED_STEP * feed_mm / (high - low);
        let farthest = farthest.min(0.5 * feed_mm / widest);
        let count = (farthest / step).floor().min(MOST_SHIFTS);
        (step.is_finite() && count >= 1.0).then_some(Self { per_unit_mm, step, count: count as i32 })
    }

    /// Values that are evaluated.
    pub(crate) fn tried(&self) -> usize {
        2 * self.count as usize + 1
    }
}

/// The residual of a map, pass by pass.
pub(crate) struct Left<'a> {
    pub heights: &'a Heights,
    pub surface: &'a Surface,
    pub residual_nm: &'a [f64],
}

impl Left<'_> {
    /// The lines that explain most, of ratios up to `highest`, one for each of some fractions; the largest first.
    pub(crate) fn lines(&self, tilts: bool, highest: usize) -> Vec<Line> {
        let Some(length) = self.transform_length() else { return Vec::new() };
        let of = |fraction: f64| {
            let near = [-1.0, -0.5, 0.0, 0.5, 1.0].map(|part| fraction + part / length as f64);
            let best =
                near.into_iter().flat_map(|fraction| self.aliases(fraction, tilts, highest, 0.0)).max_by(by_size)?;
            Some(Line { ratio: best.0, amplitude: best.1.norm(), phase: best.1.arg(), tilts })
        };
        self.fractions(tilts, highest, length).into_iter().filter_map(of).collect()
    }

    /// Lines at all other ratios that look alike at y = 0.
    pub(crate) fn others(&self, line: Line, highest: usize) -> Vec<Line> {
        let all = self.aliases(line.ratio, line.tilts, highest, 1e-3).into_iter();
        let other = all.filter(|(ratio, _)| (ratio - line.ratio).abs() > 1e-3);
        other
            .map(|(ratio, size)| Line { ratio, amplitude: size.norm(), phase: size.arg(), tilts: line.tilts })
            .collect()
    }

    /// Amplitudes at all ratios with this fraction, below and above whole numbers; `lines` that were taken out count again.
    pub(crate) fn aliases(&self, fraction: f64, tilts: bool, highest: usize, lowest: f64) -> Vec<(f64, Complex64)> {
        let fraction = fraction.rem_euclid(1.0);
        let mut weight = 0.0;
        let turns = PassTurns::of(fraction, &self.surface.pass);
        let sums: Vec<(f64, Complex64)> = self
            .heights
            .rows
            .iter()
            .map(|row| {
                let lever = lever(row, tilts);
                weight += lever * lever * row.points.len() as f64;
                let turned = |point: usize| self.residual_nm[point] * turns.at(self.surface.pass[point]).conj();
                (row.angle, lever * row.points.clone().map(turned).sum::<Complex64>())
            })
            .collect();
        let at = |ratio: f64, conjugate: bool| -> (f64, Complex64) {
            let turned = sums.iter().map(|(angle, sum)| {
                let sum = if conjugate { sum.conj() } else { *sum };
                sum * Complex64::from_polar(1.0, -ratio * angle)
            });
            (ratio, 2.0 * turned.sum::<Complex64>() / weight.max(f64::MIN_POSITIVE))
        };
        let above = (0..highest).map(|whole| at(whole as f64 + fraction, false));
        let below = (1..=highest).map(|whole| at(whole as f64 - fraction, true));
        above.chain(below).filter(|(ratio, _)| *ratio > lowest).collect()
    }

    fn passes(&self) -> Option<[i32; 2]> {
        let low = self.surface.pass.iter().min()?;
        let high = self.surface.pass.iter().max()?;
        Some([*low, *high])
    }

    fn transform_length(&self) -> Option<usize> {
        let [low, high] = self.passes()?;
        Some((OVERSAMPLED * (high - low + 1) as usize).next_power_of_two().min(LONGEST))
    }

    /// The fractions of the ratio that explain most: peaks of the spectrum, each apart from those before it.
    fn fractions(&self, tilts: bool, highest: usize, length: usize) -> Vec<f64> {
        let Some([low, high]) = self.passes() else { return Vec::new() };
        let passes = f64::from(high - low);
        let angles = || self.heights.rows.iter().map(|row| row.angle);
        let spread = angles().fold(f64::NEG_INFINITY, f64::max) - angles().fold(f64::INFINITY, f64::min);
        let apart = if spread > 0.0 { (RESOLVED / spread).floor().max(1.0) } else { f64::INFINITY };
        let first = (0.5 * apart).min(0.5 * highest as f64);
        let wholes: Vec<f64> = (0..)
            .map(|index| first + apart * f64::from(index))
            .take_while(|whole| *whole <= first.max(highest as f64))
            .collect();
        let wholes: &[f64] = if apart.is_finite() { &wholes } else { &[0.0] };
        let transform = complex_forward(length);
        let mut sums = vec![Complex64::ZERO; wholes.len() * length];
        let mut row_sums = vec![Complex64::ZERO; length];
        for row in &self.heights.rows {
            row_sums.fill(Complex64::ZERO);
            let lever = lever(row, tilts);
            for point in row.points.clone() {
                let place = (self.surface.pass[point] - low) as usize % length;
                row_sums[place] += lever * self.residual_nm[point];
            }
            transform.process(&mut row_sums);
            let step = Complex64::from_polar(1.0, -row.angle / length as f64);
            for (whole, sums) in wholes.iter().zip(sums.chunks_exact_mut(length)) {
                let mut turn = Complex64::from_polar(1.0, -whole * row.angle);
                for (sum, entry) in sums.iter_mut().zip(&row_sums) {
                    *sum += entry * turn;
                    turn *= step;
                }
            }
        }
        let fraction = |index: usize| (index % length) as f64 / length as f64;
        let is_line = |index: &usize| {
            let part = fraction(*index);
            part.min(1.0 - part) * passes >= FEWEST_PERIODS
        };
        let mut power: Vec<f64> =
            (0..sums.len()).map(|index| if is_line(&index) { sums[index].norm_sqr() } else { 0.0 }).collect();
        let mut found: Vec<f64> = Vec::new();
        let mut strongest = 0.0;
        while found.len() < PEAKS {
            let best = (0..power.len()).max_by(|one, other| power[*one].total_cmp(&power[*other]));
            let Some(best) = best.filter(|best| power[*best] > LEAST_PEAK * strongest) else { break };
            strongest = power[best].max(strongest);
            found.push(fraction(best));
            // Lines and their aliases on the other side of a whole ratio are one peak with its side lobes.
            for (index, power) in power.iter_mut().enumerate() {
                let apart = |other: f64| (fraction(index) - other - (fraction(index) - other).round()).abs() * passes;
                if apart(fraction(best)) < BESIDE || apart(1.0 - fraction(best)) < BESIDE {
                    *power = 0.0;
                }
            }
        }
        found
    }

    /// The relative error of the feed at which scallops explain most, the residual with those of the model put back; `None` where the
    /// declared feed explains as much.
    pub(crate) fn feed_scale(&self, cut: &Cut) -> Option<f64> {
        let heights = self.with_scallops(cut);
        let [low, high] = self.passes()?;
        let farthest = f64::from(low.abs().max(high.abs())).max(1.0);
        let length = f64::from(high - low).max(1.0);
        let step = FEED_STEP / length;
        let count = (FEEDS / step).ceil().min(400.0) as i32;
        // Feeds evenly by their inverse: from one to the next, the phase of a point turns by a constant.
        let per_mm = (cut.declared_mm * (1.0 + cut.applied.feed_scale)).recip();
        let mut sums = vec![Complex64::ZERO; 2 * count as usize + 1];
        let (mut turned, mut steps): (Vec<Complex64>, Vec<Complex64>) = (Vec::new(), Vec::new());
        for row in &self.heights.rows {
            turned.clear();
            steps.clear();
            let (stretch, start_mm) = (cut.stretch(row), cut.first_mm(row) - cut.feed_mm * row.angle / TAU);
            for point in row.points.clone() {
                let turns = (self.heights.x_mm[point] * stretch - start_mm) * per_mm;
                let first = (1.0 + step * f64::from(count)) * turns - row.angle / TAU;
                turned.push(Complex64::from_polar(heights[point], -TAU * first));
                steps.push(Complex64::from_polar(1.0, TAU * step * turns));
            }
            for sum in &mut sums {
                for (turned, step) in turned.iter_mut().zip(&steps) {
                    *sum += *turned;
                    *turned *= step;
                }
            }
        }
        let scale = |index: usize| {
            let share = 1.0 + step * (f64::from(count) - index as f64);
            (cut.declared_mm * per_mm * share).recip() - 1.0
        };
        let explained = |index: usize| sums[index].norm_sqr();
        let best = (0..sums.len()).max_by(|one, other| explained(*one).total_cmp(&explained(*other)))?;
        let declared = explained(count as usize);
        let best = (scale(best), explained(best));
        let moved = (best.0 - cut.applied.feed_scale).abs() * farthest;
        (moved > 0.5 * FEED_STEP && best.1 > MORE * declared).then_some(best.0)
    }

    /// The value at which scallops of shifted rows explain most; `None` where they explain as much as they are.
    pub(crate) fn shifted(&self, cut: &Cut, shift: &Shift) -> Option<f64> {
        let heights = self.with_scallops(cut);
        let per_mm = cut.feed_mm.recip();
        let waves = self.heights.rows.iter().map(|row| {
            let (stretch, start_mm) = (cut.stretch(row), cut.first_mm(row));
            let turned = |point: usize| {
                let turns = (self.heights.x_mm[point] * stretch - start_mm) * per_mm;
                Complex64::from_polar(heights[point], -TAU * turns)
            };
            row.points.clone().map(turned).sum::<Complex64>()
        });
        let waves: Vec<Complex64> = waves.collect();
        let explained = |index: i32| {
            let value = f64::from(index) * shift.step;
            let turned = waves
                .iter()
                .zip(&shift.per_unit_mm)
                .map(|(wave, shift_mm)| wave * Complex64::cis(TAU * value * shift_mm * per_mm));
            turned.sum::<Complex64>().norm_sqr()
        };
        let all = (-shift.count..=shift.count).map(|index| (index, explained(index)));
        let (best, most) = all.max_by(|one, other| one.1.total_cmp(&other.1))?;
        (best != 0 && most > MORE * explained(0)).then_some(f64::from(best) * shift.step)
    }

    /// The residual without its mean, with the scallops of the model put back.
    fn with_scallops(&self, cut: &Cut) -> Vec<f64> {
        let mut heights = self.residual_nm.to_vec();
        let square = cut.nose_mm * cut.nose_mm;
        for (height, beside_mm) in heights.iter_mut().zip(&self.surface.beside_mm) {
            *height += 1e6 * beside_mm * beside_mm / (cut.nose_mm + (square - beside_mm * beside_mm).sqrt());
        }
        without_mean(&mut heights);
        heights
    }
}

fn lever(row: &Row, tilts: bool) -> f64 {
    if tilts { row.y_mm } else { 1.0 }
}

fn by_size(one: &(f64, Complex64), other: &(f64, Complex64)) -> std::cmp::Ordering {
    one.1.norm_sqr().total_cmp(&other.1.norm_sqr())
}
