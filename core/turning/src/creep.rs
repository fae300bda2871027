//! Creep of the readings over a capture, from the mean level of each turn: a drift.
//!
//! A drift is a straight line, or settles as rate·τ·(1 − e^{−t/τ}); the Bayesian information criterion decides which. It is
//! the same in every capture, or each capture has its own size. Levels also wander with asynchronous motion, which has all
//! periods: a creep is certain only where captures agree on it better than captures that wander would, or where next to
//! nothing else is in the levels.

use runout_numerics::{
    least_squares::dot,
    statistics::{f_tail, student_95},
};

/// Fewest turns of a capture.
const FEWEST: usize = 8;
/// Levels depend on those of the turns around them: so many turns count as one observation.
const TURNS_ALIKE: f64 = 4.0;
/// Wander has periods up to the length of the capture, so that longer captures do not tell it from a drift any better.
const MOST_OBSERVATIONS: f64 = 15.0;
/// A creep that all captures share is certain above this many standard uncertainties of its size,
const CERTAIN: f64 = 6.0;
/// and where captures that only wander would agree so well with less than this chance.
const AGREEMENT: f64 = 0.01;
/// A creep that captures do not share is certain where independent levels would show it with less than this chance.
const ALONE: f64 = 1e-10;
/// Time constants that are tried, from one turn to this many captures, by equal ratios.
const TRIED: usize = 61;
const LONGEST: f64 = 10.0;
/// A time constant is determined where it is this many times its standard uncertainty.
const DETERMINED: f64 = 3.0;

/// Levels that are looked at in a capture: of more turns, means over several are.
const MOST_LEVELS: usize = 128;

/// Mean levels of one sensor's turns in one capture.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Levels {
    /// Turns since the first one at the middle of each level.
    middles: Vec<f64>,
    means_um: Vec<f64>,
    /// Turns that each level is the mean of.
    each: f64,
    /// Turns from the first to the last one.
    span: f64,
}

impl Levels {
    /// From the number of each turn used, and its mean level in µm.
    pub fn new(turns: impl Iterator<Item = (usize, f64)>) -> Self {
        let turns: Vec<(usize, f64)> = turns.collect();
        let (Some((first, _)), Some((last, _))) = (turns.first(), turns.last()) else { return Self::default() };
        let each = turns.len().div_ceil(MOST_LEVELS).max(1);
        let blocks = || turns.chunks_exact(each);
        let mean =
            |block: &[(usize, f64)], of: fn(&(usize, f64)) -> f64| block.iter().map(of).sum::<f64>() / each as f64;
        Self {
            middles: blocks().map(|block| mean(block, |turn| turn.0 as f64) - *first as f64 + 0.5).collect(),
            means_um: blocks().map(|block| mean(block, |turn| turn.1)).collect(),
            each: each as f64,
            span: (last + 1 - first) as f64,
        }
    }

    /// Turns that count as one observation, in levels.
    fn alike(&self) -> f64 {
        (TURNS_ALIKE / self.each).max(1.0)
    }
}

/// How a creep goes on.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub enum Course {
    /// By the same amount each turn.
    Straight,
    /// Ever slower: e^{−t/τ}, τ in turns.
    Settling(f64),
}

impl Course {
    /// Creep since the start after some turns, for a rate of 1 at the start.
    #[must_use]
    pub fn at(self, turns: f64) -> f64 {
        match self {
            Self::Straight => turns,
            Self::Settling(tau) => -tau * (-turns / tau).exp_m1(),
        }
    }
}

/// What the levels of a sensor's turns tell of its creep.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Creep {
    /// How it goes on.
    pub course: Course,
    /// Rate at the start of each capture, in µm per turn.
    pub rates: Vec<f64>,
    /// Standard uncertainty of each rate; where the captures share the creep, of that.
    pub rate_std: f64,
    /// Whether all captures have the same.
    pub shared: bool,
    /// Standard uncertainty of the creep over the capture, where the captures share it, in µm; else of each.
    pub over_capture_std: f64,
    /// τ and its standard uncertainty, where the levels determine it.
    pub time_constant: Option<[f64; 2]>,
    /// Turns of a capture.
    pub turns: f64,
    /// Whether it is no wander.
    pub certain: bool,
}

impl Creep {
    /// Mean creep a turn over a range of turns of a capture, in µm.
    #[must_use]
    pub fn over(&self, capture: usize, from: f64, to: f64) -> f64 {
        let rate = self.rates.get(capture).copied().unwrap_or(0.0);
        rate * (self.course.at(to) - self.course.at(from)) / (to - from).max(1.0)
    }

    /// Creep over a capture, in µm.
    #[must_use]
    pub fn over_capture(&self, capture: usize) -> f64 {
        self.over(capture, 0.0, self.turns) * self.turns
    }

    /// The capture that creeps most.
    #[must_use]
    pub fn largest(&self) -> usize {
        let each = self.rates.iter().enumerate();
        each.max_by(|a, b| a.1.abs().total_cmp(&b.1.abs())).map_or(0, |(capture, _)| capture)
    }
}

/// What the levels say of each sensor's creep, `[sensor][capture]`; nothing where a capture has too few turns.
#[must_use]
pub fn creeps(sensors: &[Vec<Levels>]) -> Vec<Option<Creep>> {
    let prepared: Vec<Option<Sensor>> = sensors.iter().map(|captures| Sensor::new(captures)).collect();
    let known: Vec<&Sensor> = prepared.iter().flatten().collect();
    prepared.iter().map(|sensor| Some(sensor.as_ref()?.creep(&known))).collect()
}

/// One sensor's levels, each capture about its own mean.
struct Sensor {
    captures: Vec<Levels>,
    turns: f64,
    /// Levels that count as one observation.
    alike: f64,
    /// Observations that all levels together count as.
    observations: f64,
    /// The same of one capture.
    of_capture: f64,
}

/// A course fitted to levels.
struct Fitted {
    course: Course,
    /// Common rate, and that of each capture.
    shared: f64,
    rates: Vec<f64>,
    /// Sum of squares of the course, in each capture.
    squares: Vec<f64>,
    /// What the common rate leaves, and what the captures' own rates leave of each.
    left: f64,
    left_each: Vec<f64>,
}

impl Sensor {
    fn new(captures: &[Levels]) -> Option<Self> {
        let fewest = captures.iter().map(|capture| capture.means_um.len()).min()?;
        if fewest < FEWEST {
            return None;
        }
        let about = |capture: &Levels| Levels { means_um: about_mean(capture.means_um.clone()), ..capture.clone() };
        let turns = captures.iter().map(|capture| capture.span).fold(0.0, f64::max);
        let alike = captures.iter().map(Levels::alike).fold(1.0, f64::max);
        let of_capture = (fewest as f64 / alike).min(MOST_OBSERVATIONS);
        let observations = of_capture * captures.len() as f64;
        Some(Self { captures: captures.iter().map(about).collect(), turns, alike, observations, of_capture })
    }

    fn fit(&self, course: Course) -> Fitted {
        let mut fitted =
            Fitted { course, shared: 0.0, rates: Vec::new(), squares: Vec::new(), left: 0.0, left_each: Vec::new() };
        let (mut products, mut total) = (0.0, 0.0);
        for capture in &self.captures {
            let shape = shape(course, &capture.middles);
            let (square, product) = (dot(&shape, &shape), dot(&shape, &capture.means_um));
            let all = dot(&capture.means_um, &capture.means_um);
            let rate = product / square.max(f64::MIN_POSITIVE);
            fitted.left_each.push((all - rate * product).max(0.0));
            fitted.squares.push(square);
            fitted.rates.push(rate);
            products += product;
            total += all;
        }
        let square: f64 = fitted.squares.iter().sum();
        fitted.shared = products / square.max(f64::MIN_POSITIVE);
        fitted.left = (total - fitted.shared * products).max(0.0);
        fitted
    }

    /// The time constant that leaves least.
    fn settling(&self, left: impl Fn(&Fitted) -> f64) -> Fitted {
        let of = |tau: f64| left(&self.fit(Course::Settling(tau)));
        let tau_of = |step: usize| (LONGEST * self.turns).powf(step as f64 / (TRIED - 1) as f64);
        let best = (0..TRIED).map(|step| (of(tau_of(step)), step)).min_by(|a, b| a.0.total_cmp(&b.0));
        let best = best.map_or(0, |(_, step)| step);
        // Between the neighbours of the best one.
        let (mut low, mut high) = (tau_of(best.saturating_sub(1)), tau_of((best + 1).min(TRIED - 1)));
        for _ in 0..40 {
            let third = (high - low) / 3.0;
            if of(low + third) < of(high - third) { high -= third } else { low += third }
        }
        self.fit(Course::Settling(0.5 * (low + high)))
    }

    /// The course that has more evidence: a time constant is one parameter more.
    fn best(&self, left: impl Fn(&Fitted) -> f64) -> Fitted {
        let (straight, settling) = (self.fit(Course::Straight), self.settling(&left));
        let gain = self.observations * (left(&straight) / left(&settling).max(f64::MIN_POSITIVE)).ln();
        if gain > self.observations.ln().max(0.0) { settling } else { straight }
    }

    fn creep(&self, all: &[&Self]) -> Creep {
        let own = self.best(|fitted| fitted.left_each.iter().sum());
        let shared = self.best(|fitted| fitted.left);
        if self.differ(&own) {
            return self.of_each(own);
        }
        self.of_all(&shared, all)
    }

    /// Whether captures creep by different amounts, far beyond what their levels leave open.
    fn differ(&self, fitted: &Fitted) -> bool {
        let dof = self.of_capture - 2.0 - extra(fitted.course);
        if dof < 1.0 {
            return false;
        }
        let chance = |capture: usize| {
            // Of a single capture there is nothing but its own creep.
            let mean = if fitted.rates.len() > 1 { fitted.shared } else { 0.0 };
            let explained = (fitted.rates[capture] - mean).powi(2) * fitted.squares[capture];
            f_tail(explained * dof / fitted.left_each[capture].max(f64::MIN_POSITIVE), 1.0, dof)
        };
        (0..fitted.rates.len()).any(|capture| chance(capture) < ALONE)
    }

    /// Each capture by itself.
    fn of_each(&self, fitted: Fitted) -> Creep {
        let levels: f64 = self.captures.iter().map(|capture| capture.means_um.len() as f64).sum();
        let left: f64 = fitted.left_each.iter().sum();
        let count = fitted.rates.len() as f64;
        let noise = left * self.alike / (levels - 2.0 * count - extra(fitted.course)).max(1.0);
        let square = fitted.squares.iter().copied().fold(f64::INFINITY, f64::min);
        let rate_std = (noise / square.max(f64::MIN_POSITIVE)).sqrt();
        let over_capture_std = rate_std * fitted.course.at(self.turns);
        let time_constant = self.time_constant(&fitted, noise, None);
        Creep {
            course: fitted.course,
            rates: fitted.rates,
            rate_std,
            shared: false,
            over_capture_std,
            time_constant,
            turns: self.turns,
            certain: true,
        }
    }

    /// All captures alike; how all sensors wander from one to the other gives the uncertainty.
    fn of_all(&self, fitted: &Fitted, all: &[&Self]) -> Creep {
        let levels: f64 = self.captures.iter().map(|capture| capture.means_um.len() as f64).sum();
        let captures = self.captures.len();
        // Turns that wander together count as one; captures tell how far they do, as far as there are enough of them.
        let noise = fitted.left * self.alike / (levels - captures as f64 - 1.0 - extra(fitted.course)).max(1.0);
        let partials = Partials::new(self, fitted);
        let [rate_std, time_constant_std, over_capture_std] = partials.stds(noise, all);
        let alike = partials.chance_of_agreement(fitted.shared, all) * (all.len() as f64) < AGREEMENT;
        let dof = self.observations - 1.0 - captures as f64 - extra(fitted.course);
        let white = partials.std(noise, 0);
        let certain = captures > 1 && alike && dof >= 1.0 && fitted.shared.abs() > CERTAIN * white;
        let time_constant = self.time_constant(fitted, noise, Some(time_constant_std));
        Creep {
            course: fitted.course,
            rates: vec![fitted.shared; captures],
            rate_std,
            shared: true,
            over_capture_std,
            time_constant,
            turns: self.turns,
            certain,
        }
    }

    /// τ and its standard uncertainty, where it is determined.
    fn time_constant(&self, fitted: &Fitted, noise: f64, std: Option<f64>) -> Option<[f64; 2]> {
        let Course::Settling(tau) = fitted.course else { return None };
        let std = std.unwrap_or_else(|| Partials::new(self, fitted).std(noise, 1));
        (tau > DETERMINED * std).then_some([tau, std])
    }
}

/// Parameters of a course beside its size.
fn extra(course: Course) -> f64 {
    if course == Course::Straight { 0.0 } else { 1.0 }
}

/// How levels change with rate and time constant, in each capture.
struct Partials {
    /// `[capture][turn]`.
    by_rate: Vec<Vec<f64>>,
    by_tau: Vec<Vec<f64>>,
    /// Their products over all captures: rate with rate, rate with τ, τ with τ; the latter two 0 for a straight line.
    normal: [f64; 3],
    /// Change of the creep over the capture with rate and τ.
    over_capture: [f64; 2],
}

impl Partials {
    fn new(sensor: &Sensor, fitted: &Fitted) -> Self {
        let captures = &sensor.captures;
        let by_rate: Vec<Vec<f64>> = captures.iter().map(|capture| shape(fitted.course, &capture.middles)).collect();
        let mut over_capture = [fitted.course.at(sensor.turns), 0.0];
        let mut by_tau: Vec<Vec<f64>> = by_rate.iter().map(|shape| vec![0.0; shape.len()]).collect();
        if let Course::Settling(tau) = fitted.course {
            let step = 1e-3 * tau;
            let [above, below] = [tau + step, tau - step].map(Course::Settling);
            let rate = |capture: usize| {
                if fitted.rates.len() > 1 { fitted.shared } else { fitted.rates.get(capture).copied().unwrap_or(0.0) }
            };
            for (index, (capture, by_tau)) in captures.iter().zip(&mut by_tau).enumerate() {
                let (high, low) = (shape(above, &capture.middles), shape(below, &capture.middles));
                let each = by_tau.iter_mut().zip(high.iter().zip(&low));
                each.for_each(|(partial, (high, low))| *partial = rate(index) * (high - low) / (2.0 * step));
            }
            over_capture[1] = fitted.shared * (above.at(sensor.turns) - below.at(sensor.turns)) / (2.0 * step);
        }
        let sum = |a: &[Vec<f64>], b: &[Vec<f64>]| a.iter().zip(b).map(|(a, b)| dot(a, b)).sum();
        let normal = [sum(&by_rate, &by_rate), sum(&by_rate, &by_tau), sum(&by_tau, &by_tau)];
        Self { by_rate, by_tau, normal, over_capture }
    }

    /// Inverse of the normal matrix: rate with rate, rate with τ, τ with τ.
    fn inverse(&self) -> [f64; 3] {
        let [aa, ab, bb] = self.normal;
        let determinant = aa * bb - ab * ab;
        if bb <= 0.0 || determinant <= 0.0 {
            return [aa.max(f64::MIN_POSITIVE).recip(), 0.0, 0.0];
        }
        [bb / determinant, -ab / determinant, aa / determinant]
    }

    /// Of rate (0) or τ (1), from the variance of independent turns.
    fn std(&self, noise: f64, which: usize) -> f64 {
        (noise * self.inverse()[2 * which]).sqrt()
    }

    /// Standard uncertainties of rate, τ and the creep over the capture.
    fn stds(&self, noise: f64, all: &[&Sensor]) -> [f64; 3] {
        let [aa, ab, bb] = self.inverse();
        let [by_rate, by_tau] = self.over_capture;
        let over = by_rate * by_rate * aa + 2.0 * by_rate * by_tau * ab + by_tau * by_tau * bb;
        let white = [aa, bb, over.max(0.0)].map(|square| (noise * square).sqrt());
        match self.between(all) {
            Some(between) => [0, 1, 2].map(|which| white[which].max(between[which])),
            None => white,
        }
    }

    /// Rate, τ and creep over the capture that explain a capture's levels beside those found.
    fn solve(&self, capture: usize, curve: &[f64]) -> [f64; 3] {
        let captures = self.by_rate.len() as f64;
        let (a, b) = (dot(&self.by_rate[capture], curve), dot(&self.by_tau[capture], curve));
        let [aa, ab, bb] = self.inverse().map(|entry| entry * captures);
        let (rate, tau) = (aa * a + ab * b, ab * a + bb * b);
        [rate, tau, self.over_capture[0] * rate + self.over_capture[1] * tau]
    }

    /// Chance of captures that only wander agreeing so well on a rate, with τ as it is: Student's distribution, with how far
    /// the rates of all sensors differ from one capture to the other.
    fn chance_of_agreement(&self, rate: f64, all: &[&Sensor]) -> f64 {
        let captures = self.by_rate.len();
        if captures < 2 {
            return 1.0;
        }
        let squares: f64 = all
            .iter()
            .map(|sensor| {
                let of = |capture: usize| {
                    let shape = &self.by_rate[capture];
                    dot(shape, &sensor.captures[capture].means_um) / dot(shape, shape).max(f64::MIN_POSITIVE)
                };
                let rates: Vec<f64> = (0..captures).map(of).collect();
                let mean = rates.iter().sum::<f64>() / captures as f64;
                rates.iter().map(|rate| (rate - mean).powi(2)).sum::<f64>()
            })
            .sum();
        let variance = squares / (captures * (captures - 1) * all.len()) as f64;
        f_tail(rate * rate / variance.max(f64::MIN_POSITIVE), 1.0, freedom(captures, all) as f64)
    }

    /// Standard uncertainties of the means of rate, τ and the creep over the capture, from how captures differ in all sensors:
    /// for few degrees of freedom as much larger as Student's distribution is wider, so that twice it holds 95 %.
    fn between(&self, all: &[&Sensor]) -> Option<[f64; 3]> {
        let captures = self.by_rate.len();
        if captures < 2 {
            return None;
        }
        let mut squares = [0.0; 3];
        for sensor in all {
            let each: Vec<[f64; 3]> =
                (0..captures).map(|capture| self.solve(capture, &sensor.captures[capture].means_um)).collect();
            for (which, sum) in squares.iter_mut().enumerate() {
                let mean = each.iter().map(|one| one[which]).sum::<f64>() / captures as f64;
                *sum += each.iter().map(|one| (one[which] - mean).powi(2)).sum::<f64>();
            }
        }
        let wider = (0.5 * student_95(freedom(captures, all) as f64)).max(1.0);
        let count = (captures * (captures - 1) * all.len()) as f64;
        Some(squares.map(|sum| wider * (sum / count).sqrt()))
    }
}

/// Independent differences between captures: sensors see two directions between them.
fn freedom(captures: usize, all: &[&Sensor]) -> usize {
    (captures - 1) * all.len().min(2)
}

/// A course of rate 1 at the middles of some turns, about its mean.
fn shape(course: Course, middles: &[f64]) -> Vec<f64> {
    about_mean(middles.iter().map(|turns| course.at(*turns)).collect())
}

fn about_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for value in &mut values {
        *value -= mean;
    }
    values
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A course and a seeded wander of levels.
    fn levels(capture: usize, size_um: f64, course: Course) -> Levels {
        let mut state = 0x9E37_79B9_7F4A_7C15_u64.wrapping_mul(capture as u64 + 1);
        let mut noise = || {
            state ^= state << 13;
            state ^= state >> 7;
            state ^= state << 17;
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        Levels::new(
            (0..60).map(|turn| (turn, size_um * course.at(turn as f64 + 0.5) / course.at(60.0) + 0.1 * noise())),
        )
    }

    fn creep(sizes: &[f64], course: Course) -> Creep {
        let steady: Vec<Levels> = (0..sizes.len()).map(|index| levels(index + 90, 0.0, Course::Straight)).collect();
        let moved = sizes.iter().enumerate().map(|(index, size)| levels(index, *size, course)).collect();
        creeps(&[moved, steady])[0].clone().unwrap()
    }

    #[test]
    fn straight_and_settling_creeps_are_told_apart_by_evidence() {
        for size in [1.0, -24.0, 100.0] {
            let found = creep(&[size; 3], Course::Straight);
            assert!(found.certain && found.shared && found.time_constant.is_none(), "{found:?}");
            assert!((found.over_capture(0) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
            let found = creep(&[size; 3], Course::Settling(12.0));
            assert!(found.certain && found.shared, "{found:?}");
            let [tau, std] = found.time_constant.unwrap();
            assert!((tau - 12.0).abs() < 3.0 * std, "{found:?}");
            assert!((found.over_capture(0) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
        }
    }

    #[test]
    fn a_creep_of_one_capture_is_that_of_no_other() {
        let found = creep(&[0.0, -20.0, 3.0], Course::Straight);
        assert!(found.certain && !found.shared, "{found:?}");
        for (capture, size) in [0.0, -20.0, 3.0].into_iter().enumerate() {
            assert!((found.over_capture(capture) - size).abs() < 3.0 * found.over_capture_std, "{found:?}");
        }
    }

    #[test]
    fn steady_levels_have_no_creep() {
        assert!(!creep(&[0.0; 3], Course::Straight).certain);
        assert!(creeps(&[vec![Levels::new((0..3).map(|turn| (turn, 0.0)))]])[0].is_none());
    }
}
