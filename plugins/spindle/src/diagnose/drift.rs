//! Drift from the levels of the turns: what a sensor creeps over a capture, in all captures alike.

use runout_core::{
    model::{
        diagnosis::{Diagnosis, Estimated},
        evidence::f_tail,
    },
    profile::{Profile, Split},
    stage::Station,
};

use super::data::Shared;
use crate::{selection::Selection, separators::Readings};

/// Fewest turns of a capture.
const FEWEST: usize = 8;
/// Two-sided 95 % quantiles of Student's distribution for 1, 2, 3, … degrees of freedom.
const STUDENT_95: [f64; 8] = [12.71, 4.30, 3.18, 2.78, 2.57, 2.45, 2.36, 2.31];
/// Time constants that are tried, in turns: from 1 to 1000 by equal ratios.
const TRIED: usize = 61;

/// rate·τ·(1 − e^{−t/τ}) of one sensor, in each capture.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Creeping {
    /// At the start, in µm per turn.
    pub rate_um_per_rev: f64,
    /// τ, in turns.
    pub time_constant_turns: f64,
    /// Standard uncertainty of the rate.
    pub rate_std: f64,
    /// And of τ.
    pub time_constant_std: f64,
    /// Whether it is the same in every capture, and far above what the levels wander.
    pub certain: bool,
    /// Turns of the first part that is fitted, and of a capture.
    fitted: usize,
    turns: usize,
    /// Stations that it is taken from.
    stations: usize,
}

/// Levels wander with asynchronous motion: neighbours depend on each other, over some turns.
const TURNS_ALIKE: f64 = 4.0;
/// Share of a variance that stays whatever is taken out of it.
const LEAST_LEFT: f64 = 0.05;
/// A drift is certain above this many standard uncertainties of its rate,
const CERTAIN: f64 = 6.0;
/// and where captures that only wander would agree on it so well with less than this chance.
const AGREEMENT: f64 = 0.01;

impl Creeping {
    /// Mean creep a turn over a range of turns, in µm.
    fn over(&self, from: usize, to: usize) -> f64 {
        let at = |turn: usize| -(-(turn as f64) / self.time_constant_turns).exp_m1();
        self.rate_um_per_rev * self.time_constant_turns * (at(to) - at(from)) / (to.max(from + 1) - from) as f64
    }

    /// Creep over one turn, in µm.
    pub fn in_turn(&self, turn: usize) -> f64 {
        self.over(turn, turn + 1)
    }

    /// Mean creep a turn over the turns fitted (or all), and its standard uncertainty as one of the stations tells it, in µm.
    pub fn observed(&self, whole: bool) -> (f64, f64) {
        let creep = self.over(0, if whole { self.turns } else { self.fitted });
        (creep, (creep * self.rate_std / self.rate_um_per_rev).abs() * (self.stations as f64).sqrt())
    }

    /// Takes out of covariances what a drift that is certain puts into them: over the record it is no noise.
    ///
    /// A creep by s a turn leaks s/(πn) into the mean at order n, and as much into the neighbours that its covariance is
    /// taken from; single turns differ by what their creep does.
    pub fn take_out(&self, readings: &mut Readings, sensor: usize, whole: bool) {
        if !self.certain {
            return;
        }
        let turns = if whole { self.turns } else { self.fitted };
        let mean = self.over(0, turns);
        let spread = (0..turns).map(|turn| (self.in_turn(turn) - mean).powi(2)).sum::<f64>() / (turns * turns) as f64;
        let sensors = readings.count / readings.turns.len().max(1);
        for (matrices, square) in [(&mut readings.covariance, mean * mean), (&mut readings.scatter, spread)] {
            for matrices in matrices.iter_mut().flatten() {
                for order in 2..matrices.len() / (sensors * sensors) {
                    let matrix = &mut matrices[order * sensors * sensors..(order + 1) * sensors * sensors];
                    let leak = square / (std::f64::consts::PI * order as f64).powi(2);
                    let variance = matrix[sensor * sensors + sensor].re;
                    let left = (variance - leak).max(LEAST_LEFT * variance);
                    // Row and column alike, so that it stays a covariance.
                    let share = if variance > 0.0 { (left / variance).sqrt() } else { 1.0 };
                    for other in 0..sensors {
                        matrix[sensor * sensors + other] *= share;
                        matrix[other * sensors + sensor] *= share;
                    }
                }
            }
        }
    }

    /// Creep of the held-out turns over that of the fitted ones.
    pub fn held_out_share(&self) -> f64 {
        let fitted = self.over(0, self.fitted);
        if fitted.abs() > 0.0 { self.over(self.fitted, self.turns) / fitted } else { 1.0 }
    }
}

/// What the levels of the turns say of each sensor.
pub fn creeping(selection: &Selection, stations: &[Station]) -> Vec<Option<Creeping>> {
    let levels: Vec<Option<Levels>> =
        selection.sensors.iter().map(|sensor| Levels::of_sensor(*sensor, stations)).collect();
    let known: Vec<&Levels> = levels.iter().flatten().collect();
    levels.iter().map(|levels| levels.as_ref()?.fit(&known)).collect()
}

/// Levels of one sensor's turns.
struct Levels {
    /// About the mean of each capture, which has a level of its own, `[capture][turn]`.
    captures: Vec<Vec<f64>>,
    /// Their mean, `[turn]`.
    mean: Vec<f64>,
    fitted: usize,
    stations: usize,
}

impl Levels {
    fn of_sensor(sensor: usize, stations: &[Station]) -> Option<Self> {
        let profiles = || stations.iter().flat_map(|station| &station.profiles);
        let splits: Option<Vec<_>> = profiles().map(|profile| profile.split.as_ref()).collect();
        let splits = splits?;
        let turns = splits.iter().map(|split| split.turns.count()).min().filter(|turns| *turns >= FEWEST)?;
        let capture = |(profile, split): (&Profile, &&Split)| {
            let channel = profile.sensors.iter().position(|known| *known == sensor)?;
            Some(about_mean(split.turns.levels(channel).take(turns).collect()))
        };
        let captures: Vec<Vec<f64>> = profiles().zip(&splits).map(capture).collect::<Option<_>>()?;
        let share = 1.0 / captures.len() as f64;
        let mean = (0..turns).map(|turn| captures.iter().map(|capture| capture[turn]).sum::<f64>() * share).collect();
        Some(Self { captures, mean, fitted: splits.last()?.fit.turns.len(), stations: stations.len() })
    }

    /// Rate and time constant of the mean over the captures; what all sensors wander from one to the other gives their
    /// uncertainty.
    fn fit(&self, all: &[&Self]) -> Option<Creeping> {
        let turns = self.mean.len();
        let fit = |tau: f64| {
            let shape = shape(tau, turns);
            let rate = dot(&shape, &self.mean) / dot(&shape, &shape);
            (shape.iter().zip(&self.mean).map(|(a, b)| (b - rate * a).powi(2)).sum::<f64>(), rate)
        };
        let tau_of = |step: usize| 10.0_f64.powf(3.0 * step as f64 / (TRIED - 1) as f64);
        let best = (0..TRIED).map(|step| (fit(tau_of(step)).0, step)).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
        // Between the neighbours of the best one.
        let (mut low, mut high) = (tau_of(best.saturating_sub(1)), tau_of((best + 1).min(TRIED - 1)));
        for _ in 0..40 {
            let third = (high - low) / 3.0;
            if fit(low + third).0 < fit(high - third).0 { high -= third } else { low += third }
        }
        let tau = 0.5 * (low + high);
        let (left, rate) = fit(tau);
        let partials = Partials::new(rate, tau, turns);
        // Turns that wander together count as one; captures tell how far they do, as far as there are enough of them.
        let noise = left * TURNS_ALIKE / (turns as f64 - 3.0);
        let [rate_std, time_constant_std] = match partials.between(all) {
            Some(between) => [0, 1].map(|which| partials.std(noise, which).max(between[which])),
            None => [0, 1].map(|which| partials.std(noise, which)),
        };
        // A drift comes with every capture; what wanders does not.
        let alike = partials.chance_of_agreement(rate, all) * (all.len() as f64) < AGREEMENT;
        Some(Creeping {
            certain: alike && rate.abs() > CERTAIN * partials.std(noise, 0),
            rate_um_per_rev: rate,
            time_constant_turns: tau,
            rate_std,
            time_constant_std,
            fitted: self.fitted,
            turns,
            stations: self.stations,
        })
    }
}

/// How levels change with rate and time constant.
struct Partials {
    by_rate: Vec<f64>,
    by_tau: Vec<f64>,
    /// Their products: rate with rate, rate with τ, τ with τ.
    normal: [f64; 3],
    determinant: f64,
}

impl Partials {
    fn new(rate: f64, tau: f64, turns: usize) -> Self {
        let step = 1e-3 * tau;
        let by_rate = shape(tau, turns);
        let (above, below) = (shape(tau + step, turns), shape(tau - step, turns));
        let by_tau: Vec<f64> = above.iter().zip(&below).map(|(a, b)| rate * (a - b) / (2.0 * step)).collect();
        let normal = [dot(&by_rate, &by_rate), dot(&by_rate, &by_tau), dot(&by_tau, &by_tau)];
        let determinant = (normal[0] * normal[2] - normal[1] * normal[1]).max(f64::MIN_POSITIVE);
        Self { by_rate, by_tau, normal, determinant }
    }

    /// Of rate (0) or τ (1), from the variance of independent turns.
    fn std(&self, noise: f64, which: usize) -> f64 {
        (noise * self.normal[2 * (1 - which)] / self.determinant).sqrt()
    }

    /// Rate and τ that explain a curve beside those found.
    fn solve(&self, curve: &[f64]) -> [f64; 2] {
        let (a, b) = (dot(&self.by_rate, curve), dot(&self.by_tau, curve));
        let [aa, ab, bb] = self.normal;
        [(a * bb - b * ab) / self.determinant, (b * aa - a * ab) / self.determinant]
    }

    /// Chance of captures that only wander agreeing so well on a rate, with τ as it is: Student's distribution, with how far
    /// the rates of all sensors differ from one capture to the other. 0 for a single one, which has none to agree with.
    fn chance_of_agreement(&self, rate: f64, all: &[&Levels]) -> f64 {
        let captures = all.iter().map(|levels| levels.captures.len()).min().unwrap_or(0);
        if captures < 2 {
            return 0.0;
        }
        let of = |curve: &[f64]| dot(&self.by_rate, curve) / self.normal[0];
        let off = |levels: &Levels| {
            let mean = of(&levels.mean);
            levels.captures.iter().map(|capture| (of(capture) - mean).powi(2)).sum::<f64>()
        };
        let squares: f64 = all.iter().map(|levels| off(levels)).sum();
        let variance = squares / (captures * (captures - 1) * all.len()) as f64;
        f_tail(rate * rate / variance.max(f64::MIN_POSITIVE), 1.0, freedom(captures, all) as f64)
    }

    /// Standard uncertainty of the mean of rate and τ, from how captures differ in all sensors: for few degrees of freedom
    /// as much larger as Student's distribution is wider, so that twice it holds 95 %.
    fn between(&self, all: &[&Levels]) -> Option<[f64; 2]> {
        let captures = all.iter().map(|levels| levels.captures.len()).min().filter(|captures| *captures >= 2)?;
        let mut squares = [0.0; 2];
        for levels in all {
            for capture in &levels.captures {
                let off: Vec<f64> = capture.iter().zip(&levels.mean).map(|(one, mean)| one - mean).collect();
                squares.iter_mut().zip(self.solve(&off)).for_each(|(sum, value)| *sum += value * value);
            }
        }
        let wider = STUDENT_95.get(freedom(captures, all) - 1).map_or(1.0, |quantile| 0.5 * quantile);
        let count = (captures * (captures - 1) * all.len()) as f64;
        Some(squares.map(|sum| wider * (sum / count).sqrt()))
    }
}

/// Independent differences between captures: sensors see two directions between them.
fn freedom(captures: usize, all: &[&Levels]) -> usize {
    (captures - 1) * all.len().min(2)
}

/// τ(1 − e^{−t/τ}) at the turns' middles, about its mean.
fn shape(tau: f64, turns: usize) -> Vec<f64> {
    about_mean((0..turns).map(|turn| -tau * (-(turn as f64 + 0.5) / tau).exp_m1()).collect())
}

fn about_mean(mut values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / values.len() as f64;
    for value in &mut values {
        *value -= mean;
    }
    values
}

fn dot(a: &[f64], b: &[f64]) -> f64 {
    a.iter().zip(b).map(|(a, b)| a * b).sum()
}

/// Says a drift that was found by its rate and time constant, where the levels tell them.
pub fn say_rates(diagnosis: &mut Diagnosis, shared: &Shared) {
    for added in diagnosis.added.iter_mut().filter(|added| added.effect == "thermal-drift") {
        let sensors = &shared.selection.rig.sensors;
        let sensor = added.targets.first().and_then(|id| sensors.iter().position(|sensor| sensor.id == *id));
        let Some(creeping) = sensor.and_then(|sensor| *shared.data.first()?.seen.creeping.get(sensor)?) else {
            continue;
        };
        let said = |name: &str, value: f64, std: f64, unit: &str| Estimated {
            name: name.into(),
            value,
            std,
            unit: unit.into(),
        };
        let creep = std::mem::take(&mut added.parameters);
        added.parameters = vec![
            said("rate", creeping.rate_um_per_rev, creeping.rate_std, "um/rev"),
            said("time-constant", creeping.time_constant_turns, creeping.time_constant_std, "rev"),
        ];
        added.parameters.extend(creep);
    }
}
