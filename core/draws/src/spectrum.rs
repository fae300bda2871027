//! How much of each order is form: power of waves beside it, with its limits.

use std::ops::Range;

use runout_numerics::Complex64;

/// Orders beside an order from which the power of waves is taken, to each side: a third of it, this at least.
const FEWEST_BESIDE: usize = 4;
/// A line is an order of more power than waves and noise have together, by a chance of e⁻⁹.
pub(crate) const LINE: f64 = 9.0;
/// Passes that decide which orders are lines: those found in the first are left out in the second.
const LOOKS: usize = 2;
/// Squares that a variance is taken to be known from at least where its chance is weighed: a mean of x⁻¹ of fewer hardly exists.
const FEWEST_SQUARES: f64 = 8.0;
/// No ratio of power to variance stands out less than by chance beyond this, however few squares the variance is known from.
const LARGEST_RATIO: f64 = 400.0;

/// Normal quantile at which the limits of the power of waves are taken.
const LIMIT: f64 = 2.0;

/// How sure a spectrum is to be read.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Power {
    /// The lower limit; none where noise alone may have as much, beyond this quantile.
    Least { seen: f64 },
    /// What was found.
    Middle,
    /// The upper limit.
    Most,
}

/// Ratio of an order's power to its variance that noise exceeds once in eˣ cases, the variance known from so many squares (0: exactly).
pub(crate) fn above(x: f64, squares: usize) -> f64 {
    if squares == 0 { x } else { (0.5 * squares as f64 * (2.0 * x / squares as f64).exp_m1()).min(LARGEST_RATIO) }
}

/// Quantile of a mean of so many squares of 1 in the mean (Wilson, Hilferty, Proc. Natl. Acad. Sci. 17 (1931) 684).
fn of_mean_square(squares: f64, normal: f64) -> f64 {
    let ninth = 1.0 / (9.0 * squares.max(1.0));
    (1.0 - ninth + normal * ninth.sqrt()).max(0.05).powi(3)
}

/// Sums over the orders up to each, of which a window's sum is a difference.
struct Sums(Vec<f64>);

impl Sums {
    fn of(values: impl Iterator<Item = f64>) -> Self {
        let mut sum = 0.0;
        let after = values.map(|value| {
            sum += value;
            sum
        });
        Self(std::iter::once(0.0).chain(after).collect())
    }

    fn over(&self, orders: &Range<usize>) -> f64 {
        self.0[orders.end] - self.0[orders.start]
    }
}

/// Orders that share one estimate of their variance, where it is that of orders beside each other.
const TOGETHER: usize = 5;

/// What the variances of orders were estimated from.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum VarianceFrom {
    /// Each from itself and a few orders beside it.
    #[default]
    OrdersBeside,
    /// All from one variance of readings: they are wrong together.
    Readings,
}

impl VarianceFrom {
    /// Orders that share an estimate, at most.
    pub(crate) fn together(self) -> usize {
        match self {
            Self::OrdersBeside => TOGETHER,
            Self::Readings => usize::MAX,
        }
    }
}

/// Share of the noise that the orders above a low-pass have together, at most.
const BEYOND: f64 = 1e-3;

/// What the noise of each order is known to be, by order from 0.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Noise<'a> {
    /// E|e|²; an order without a positive one is taken as exact.
    pub variance: &'a [f64],
    /// Squares that it is known from; 0: exactly.
    pub squares: &'a [usize],
    /// Which orders share these squares.
    pub variance_from: VarianceFrom,
    /// Orders below are exact.
    pub lowest: usize,
}

impl Noise<'_> {
    /// Variance of an order of which it is known.
    pub(crate) fn of(&self, order: usize) -> Option<f64> {
        self.variance
            .get(order)
            .copied()
            .filter(|variance| order >= self.lowest && *variance > 0.0 && variance.is_finite())
    }

    /// Orders from 0 on that hold all but [`BEYOND`] of the noise: above them a low-pass left next to nothing, neither of noise nor of marks.
    pub(crate) fn reach(&self) -> usize {
        let variance = |order: usize| self.of(order).unwrap_or(0.0);
        let mut beyond = BEYOND * (0..self.variance.len()).map(variance).sum::<f64>();
        let is_beyond = |order: &usize| {
            beyond -= variance(*order);
            beyond >= 0.0
        };
        self.variance.len() - (0..self.variance.len()).rev().take_while(is_beyond).count()
    }

    pub(crate) fn squares(&self, order: usize) -> usize {
        self.squares.get(order).copied().unwrap_or(0)
    }

    /// By how much the mean of 1/x of a mean of squares x exceeds 1: orders of which the variance was found too small weigh more than others.
    fn few(&self, order: usize) -> f64 {
        let squares = (self.squares(order) as f64).max(FEWEST_SQUARES);
        let is_one_for_all = self.squares(order) == 0 || self.variance_from == VarianceFrom::Readings;
        if is_one_for_all { 1.0 } else { squares / (squares - 4.0) }
    }

    /// Variance of a sum over orders from the sums of what each adds to its standard deviation, of its square, and of its square over the squares that
    /// it is known from: what shares a variance is off together.
    fn of_sum(&self, [linear, own, over_squares]: [f64; 3]) -> f64 {
        // So many equal terms have these sums.
        let terms = if own > 0.0 { linear * linear / own } else { 0.0 };
        let together = match self.variance_from {
            VarianceFrom::OrdersBeside => self.variance_from.together() as f64,
            VarianceFrom::Readings => terms,
        };
        own + 2.0 * together * over_squares
    }

    /// 1 over the squares that an order is known from; 0 where it is known exactly.
    fn over_squares(&self, order: usize) -> f64 {
        if self.squares(order) == 0 { 0.0 } else { (self.squares(order) as f64).recip() }
    }

    /// Whether a profile has less power in all orders together than its noise alone would have beyond this quantile: then its variance is stated
    /// too large.
    pub(crate) fn is_refuted_by(&self, harmonics: &[Complex64], quantile: f64) -> bool {
        let known = || (0..harmonics.len()).filter_map(|order| Some((order, self.of(order)?)));
        let [all, own, over_squares] = known().fold([0.0; 3], |[all, own, over], (order, variance)| {
            let square = variance * variance;
            [all + variance, own + square, over + square * self.over_squares(order)]
        });
        let spread = self.of_sum([all, own, over_squares]);
        let power: f64 = known().map(|(order, _)| harmonics[order].norm_sqr()).sum();
        power < all * of_mean_square(all * all / spread, -quantile)
    }
}

/// The spectrum of one profile.
pub(crate) struct Spectrum<'a> {
    pub power: Vec<f64>,
    noise: Noise<'a>,
    /// Mean power of an order and of its neighbours, of which lines are left out, and what noise has of it.
    total: Vec<f64>,
    of_noise: Vec<f64>,
    /// Squares that the total is worth, where there are no waves and where there are.
    without_waves: Vec<f64>,
    with_waves: Vec<f64>,
}

impl<'a> Spectrum<'a> {
    pub(crate) fn of(harmonics: &[Complex64], noise: Noise<'a>) -> Self {
        let count = harmonics.len();
        let power: Vec<f64> = harmonics.iter().map(Complex64::norm_sqr).collect();
        let window = |order: usize| {
            let beside = (order / 3).max(FEWEST_BESIDE);
            order.saturating_sub(beside).max(noise.lowest).min(count)..(order + beside + 1).min(count)
        };
        let variance = |order: usize| noise.of(order).unwrap_or(0.0);
        let (mut waves, mut lines) = (vec![0.0; count], vec![false; count]);
        let weights = |waves: &[f64], lines: &[bool]| -> Vec<f64> {
            let weight =
                |order: usize| noise.of(order).filter(|_| !lines[order]).map_or(0.0, |of| (waves[order] + of).powi(-2));
            (0..count).map(weight).collect()
        };
        let excess = |order: usize| power[order] - variance(order) * noise.few(order);
        for _ in 0..LOOKS {
            let weights = weights(&waves, &lines);
            let all = Sums::of(weights.iter().copied());
            let above_noise = Sums::of((0..count).map(|order| weights[order] * excess(order)));
            waves = (0..count)
                .map(|order| {
                    let (orders, own) = (window(order), weights[order]);
                    let others = all.over(&orders) - own;
                    let found = above_noise.over(&orders) - own * excess(order);
                    if others > 1e-12 * (others + own) { (found / others).max(0.0) } else { 0.0 }
                })
                .collect();
            for (order, line) in lines.iter_mut().enumerate() {
                let is_above = |of: f64| power[order] > above(LINE, noise.squares(order)) * (waves[order] + of);
                *line = noise.of(order).is_some_and(is_above);
            }
        }
        let weights = weights(&waves, &lines);
        let sums = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let sums = Sums::of((0..count).map(of));
            (0..count).map(|order| sums.over(&window(order)).max(0.0)).collect()
        };
        let all = sums(&|order| weights[order]);
        let mean = |order: usize, sum: f64| if all[order] > 0.0 { sum / all[order] } else { 0.0 };
        let means = |of: &dyn Fn(usize) -> f64| -> Vec<f64> {
            sums(of).into_iter().enumerate().map(|(order, sum)| mean(order, sum)).collect()
        };
        let total = means(&|order| weights[order] * power[order]);
        let of_noise = means(&|order| weights[order] * variance(order) * noise.few(order));
        let raw = |order: usize| (total[order] - of_noise[order]).max(0.0);
        // Squares that a weighted mean is worth: its square over half of its variance.
        let worth = |level: &dyn Fn(usize) -> f64, each: &dyn Fn(usize) -> f64| -> Vec<f64> {
            let term = |order: usize| weights[order] * each(order);
            let linear = sums(&term);
            let own = sums(&|order| term(order).powi(2));
            let over = sums(&|order| term(order).powi(2) * noise.over_squares(order));
            let spread = |order: usize| noise.of_sum([linear[order], own[order], over[order]]).max(f64::MIN_POSITIVE);
            (0..count).map(|order| (level(order) * all[order]).powi(2) / spread(order)).collect()
        };
        let without_waves = worth(&|order| of_noise[order], &variance);
        let with_waves = worth(&|order| raw(order) + of_noise[order], &|order| raw(order) + variance(order));
        Self { power, noise, total, of_noise, without_waves, with_waves }
    }

    /// Power of the waves at an order.
    pub(crate) fn waves(&self, order: usize, power: Power) -> f64 {
        let (found, of_noise) = (self.total[order], self.of_noise[order]);
        let (total, quantile, is_seen) = match power {
            Power::Least { seen } => (found, LIMIT, found > of_noise * of_mean_square(self.without_waves[order], seen)),
            Power::Middle => (found, 0.0, true),
            // Noise that is less than usual by chance has hidden as much as usual.
            Power::Most => (found.max(of_noise), -LIMIT, true),
        };
        let level = if power == Power::Middle { 1.0 } else { of_mean_square(self.with_waves[order], quantile) };
        if is_seen { (total / level - of_noise).max(0.0) } else { 0.0 }
    }

    /// Share of each order that is form: by the power of waves, or by its own where that is above noise by a chance of e^−`shown`. All of
    /// an order without noise.
    pub(crate) fn shares(&self, power: Power, shown: f64) -> Vec<f64> {
        let share = |order: usize| {
            let Some(variance) = self.noise.of(order) else { return 1.0 };
            let (waves, own) = (self.waves(order, power), self.power[order]);
            let is_shown = own > above(shown, self.noise.squares(order)) * variance;
            (waves / (waves + variance)).max(if is_shown { 1.0 - variance / own } else { 0.0 })
        };
        (0..self.power.len()).map(share).collect()
    }

    /// Variance of each order as what is no mark sees it: noise and waves, or all of a line.
    pub(crate) fn background(&self) -> Vec<Option<f64>> {
        let of = |order: usize| {
            let variance = self.noise.of(order)?;
            let both = self.waves(order, Power::Middle) + variance;
            let is_line = self.power[order] > above(LINE, self.noise.squares(order)) * both;
            Some(if is_line { both.max(self.power[order]) } else { both })
        };
        (0..self.power.len()).map(of).collect()
    }
}
