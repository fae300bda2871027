//! Creep of the readings over a capture, from the mean level of each turn: a drift.
//!
//! A drift is a straight line, or settles as rate·τ·(1 − e^{−t/τ}); the Bayesian information criterion decides which. It is
//! the same in every capture, or each capture has its own size. Levels also wander with asynchronous motion, which has all
//! periods: a creep is certain only where captures agree on it better than captures that wander would, or where next to
//! nothing else is in the levels.

mod partials;
mod shape;
#[cfg(test)]
mod tests;

use std::sync::Arc;

use partials::Partials;
use runout_numerics::{golden_section, least_squares::dot, statistics::f_tail};
use shape::{Shape, TriedShapes};

/// Fewest turns of a capture.
const FEWEST: usize = 8;
/// Levels depend on those of the turns around them: so many turns count as one observation.
const TURNS_ALIKE: f64 = 4.0;
/// Wander has periods up to the length of the capture: longer captures do not distinguish it from a drift any better.
const MOST_OBSERVATIONS: f64 = 15.0;
/// A creep that all captures share is certain above this many standard uncertainties of its size,
const CERTAIN: f64 = 6.0;
/// and where captures that only wander would agree so well with less than this chance.
const AGREEMENT: f64 = 0.01;
/// A creep that captures do not share is certain where independent levels would show it with less than this chance.
const ALONE: f64 = 1e-10;
/// How well the best time constant between those tried is sought, as a share of the distance of its neighbours.
const REFINED: f64 = 1e-7;
/// A time constant is determined where it is this many times its standard uncertainty.
const DETERMINED: f64 = 3.0;

/// A course is certain only where the levels at the ends of the captures differ by more than this share of what it says: what drift leaves
/// in an averaged turn is (last level − first level)/turns, and not the slope of a line through a wave.
const BORNE_OUT: f64 = 0.5;

/// Levels that are evaluated in a capture: of more turns, means over several are.
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
pub enum CreepLaw {
    /// By the same amount each turn.
    Straight,
    /// Ever slower: e^{−t/τ}, τ in turns.
    Settling(f64),
}

impl CreepLaw {
    /// Creep since the start after some turns, for a rate of 1 at the start.
    #[must_use]
    pub fn at(self, turns: f64) -> f64 {
        match self {
            Self::Straight => turns,
            Self::Settling(tau) => -tau * (-turns / tau).exp_m1(),
        }
    }
}

/// A sensor's creep, as the levels of its turns show it.
#[derive(Debug, Clone, PartialEq)]
#[non_exhaustive]
pub struct Creep {
    /// How it goes on.
    pub course: CreepLaw,
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
    let mut tried = Vec::new();
    let prepared: Vec<Option<Sensor>> = sensors.iter().map(|captures| Sensor::new(captures, &mut tried)).collect();
    let known: Vec<&Sensor> = prepared.iter().flatten().collect();
    prepared.iter().map(|sensor| Some(sensor.as_ref()?.creep(&known))).collect()
}

/// One sensor's levels, each capture about its own mean.
struct Sensor {
    captures: Vec<Levels>,
    /// Courses at the levels of each capture.
    tried: Vec<Arc<TriedShapes>>,
    /// Sum of squares of each capture's levels.
    squares: Vec<f64>,
    turns: f64,
    /// Levels that count as one observation.
    alike: f64,
    /// Observations that all levels together count as.
    observations: f64,
    /// Observations that the levels of one capture count as.
    of_capture: f64,
}

/// A course fitted to levels.
struct Fitted {
    course: CreepLaw,
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
    /// `known` are the courses of captures before, most of which have their levels at the same turns.
    fn new(captures: &[Levels], known: &mut Vec<Arc<TriedShapes>>) -> Option<Self> {
        let fewest = captures.iter().map(|capture| capture.means_um.len()).min()?;
        if fewest < FEWEST {
            return None;
        }
        let about = |capture: &Levels| Levels { means_um: about_mean(capture.means_um.clone()), ..capture.clone() };
        let turns = captures.iter().map(|capture| capture.span).fold(0.0, f64::max);
        let alike = captures.iter().map(Levels::alike).fold(1.0, f64::max);
        let of_capture = (fewest as f64 / alike).min(MOST_OBSERVATIONS);
        let observations = of_capture * captures.len() as f64;
        let captures: Vec<Levels> = captures.iter().map(about).collect();
        let tried = captures.iter().map(|capture| TriedShapes::of(&capture.middles, turns, known)).collect();
        let squares = captures.iter().map(|capture| dot(&capture.means_um, &capture.means_um)).collect();
        Some(Self { captures, tried, squares, turns, alike, observations, of_capture })
    }

    /// A course of any time constant.
    fn fit(&self, course: CreepLaw) -> Fitted {
        let mut shapes: Vec<Shape> = Vec::with_capacity(self.captures.len());
        for (capture, levels) in self.captures.iter().enumerate() {
            let alike = (0..capture).find(|before| Arc::ptr_eq(&self.tried[*before], &self.tried[capture]));
            shapes.push(alike.map_or_else(|| Shape::new(course, &levels.middles), |before| shapes[before].clone()));
        }
        self.fit_shapes(course, shapes.iter())
    }

    /// A course with its shape in each capture.
    fn fit_shapes<'a>(&self, course: CreepLaw, shapes: impl Iterator<Item = &'a Shape>) -> Fitted {
        let mut fitted =
            Fitted { course, shared: 0.0, rates: Vec::new(), squares: Vec::new(), left: 0.0, left_each: Vec::new() };
        let (mut products, mut total) = (0.0, 0.0);
        for (shape, (capture, all)) in shapes.zip(self.captures.iter().zip(&self.squares)) {
            let (square, product) = (shape.square, dot(&shape.values, &capture.means_um));
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

    /// The fits of all time constants that are tried, ascending.
    fn fits_tried(&self) -> Vec<Fitted> {
        let course = |step: usize| CreepLaw::Settling(shape::tau_tried(self.turns, step));
        let fit = |step: usize| self.fit_shapes(course(step), self.tried.iter().map(|shapes| &shapes.settling[step]));
        (0..shape::TRIED).map(fit).collect()
    }

    /// The time constant that leaves least.
    fn settling(&self, tried: &[Fitted], left: impl Fn(&Fitted) -> f64) -> Fitted {
        let best = tried.iter().enumerate().min_by(|a, b| left(a.1).total_cmp(&left(b.1)));
        let best = best.map_or(0, |(step, _)| step);
        // Between the neighbours of the best one.
        let tau = |step: usize| shape::tau_tried(self.turns, step);
        let (low, high) = (tau(best.saturating_sub(1)), tau((best + 1).min(shape::TRIED - 1)));
        let tau =
            golden_section::maximum(low, high, REFINED * (high - low), |tau| -left(&self.fit(CreepLaw::Settling(tau))));
        self.fit(CreepLaw::Settling(tau))
    }

    /// The course that has more evidence: a time constant is one parameter more.
    fn best(&self, tried: &[Fitted], left: impl Fn(&Fitted) -> f64) -> Fitted {
        let straight = self.fit_shapes(CreepLaw::Straight, self.tried.iter().map(|shapes| &shapes.straight));
        let settling = self.settling(tried, &left);
        let gain = self.observations * (left(&straight) / left(&settling).max(f64::MIN_POSITIVE)).ln();
        if gain > self.observations.ln().max(0.0) { settling } else { straight }
    }

    fn creep(&self, all: &[&Self]) -> Creep {
        let tried = self.fits_tried();
        let own = self.best(&tried, |fitted| fitted.left_each.iter().sum());
        if self.differ(&own) {
            return self.of_each(own);
        }
        self.of_all(&self.best(&tried, |fitted| fitted.left), all)
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
        let certain = self.is_borne_out(&fitted, &fitted.rates);
        Creep {
            course: fitted.course,
            rates: fitted.rates,
            rate_std,
            shared: false,
            over_capture_std,
            time_constant,
            turns: self.turns,
            certain,
        }
    }

    /// All captures alike; how all sensors wander from one to the other gives the uncertainty.
    fn of_all(&self, fitted: &Fitted, all: &[&Self]) -> Creep {
        let levels: f64 = self.captures.iter().map(|capture| capture.means_um.len() as f64).sum();
        let captures = self.captures.len();
        // Turns that wander together count as one; captures show how far they do, as far as there are enough of them.
        let noise = fitted.left * self.alike / (levels - captures as f64 - 1.0 - extra(fitted.course)).max(1.0);
        let partials = Partials::new(self, fitted);
        let [rate_std, time_constant_std, over_capture_std] = partials.stds(noise, all);
        let alike = partials.chance_of_agreement(fitted.shared, all) * (all.len() as f64) < AGREEMENT;
        let dof = self.observations - 1.0 - captures as f64 - extra(fitted.course);
        let white = partials.std(noise, 0);
        let rates = vec![fitted.shared; captures];
        let certain = captures > 1
            && alike
            && dof >= 1.0
            && fitted.shared.abs() > CERTAIN * white
            && self.is_borne_out(fitted, &rates);
        let time_constant = self.time_constant(fitted, noise, Some(time_constant_std));
        Creep {
            course: fitted.course,
            rates,
            rate_std,
            shared: true,
            over_capture_std,
            time_constant,
            turns: self.turns,
            certain,
        }
    }

    /// Whether the levels at the ends of the captures differ as a course says, in the captures together.
    fn is_borne_out(&self, fitted: &Fitted, rates: &[f64]) -> bool {
        let ends = |values: &mut dyn Iterator<Item = f64>| {
            let values: Vec<f64> = values.collect();
            let each = (self.alike.round() as usize).clamp(1, values.len().max(2) / 2);
            let mean = |part: &[f64]| part.iter().sum::<f64>() / part.len().max(1) as f64;
            mean(&values[values.len() - each..]) - mean(&values[..each])
        };
        // Weighed by what each capture should show: captures may creep up and down.
        let (mut shown, mut said) = (0.0, 0.0);
        for (capture, rate) in self.captures.iter().zip(rates) {
            let expected = rate * ends(&mut capture.middles.iter().map(|turns| fitted.course.at(*turns)));
            shown += expected * ends(&mut capture.means_um.iter().copied());
            said += expected * expected;
        }
        shown > BORNE_OUT * said
    }

    /// τ and its standard uncertainty, where it is determined.
    fn time_constant(&self, fitted: &Fitted, noise: f64, std: Option<f64>) -> Option<[f64; 2]> {
        let CreepLaw::Settling(tau) = fitted.course else { return None };
        let std = std.unwrap_or_else(|| Partials::new(self, fitted).std(noise, 1));
        (tau > DETERMINED * std).then_some([tau, std])
    }
}

/// Parameters of a course beside its size.
fn extra(course: CreepLaw) -> f64 {
    if course == CreepLaw::Straight { 0.0 } else { 1.0 }
}

/// Independent differences between captures: sensors see two directions between them.
fn freedom(captures: usize, all: &[&Sensor]) -> usize {
    (captures - 1) * all.len().min(2)
}

fn about_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len().max(1) as f64;
    for value in &mut values {
        *value -= mean;
    }
    values
}
