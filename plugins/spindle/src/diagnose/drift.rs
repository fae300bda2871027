//! Drift from the levels of the turns: what a sensor creeps over a capture, in all setups alike.

use runout_core::{
    Complex64,
    model::diagnosis::{Diagnosis, Estimated},
    stage::Station,
};

use super::data::Shared;
use crate::{selection::Selection, separators::Readings};

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
}

/// Levels wander with asynchronous motion: neighbours depend on each other, over some turns.
const TURNS_ALIKE: f64 = 4.0;
/// Share of a variance that stays whatever is taken out of it.
const LEAST_LEFT: f64 = 0.05;
/// Correlations stay below this where a variance was made smaller.
const MOST_ALIKE: f64 = 0.9;

/// Limits a sensor's correlations with the others, so that the covariance stays one.
fn keep_definite(matrix: &mut [Complex64], sensors: usize, sensor: usize) {
    for other in (0..sensors).filter(|other| *other != sensor) {
        let limit = MOST_ALIKE
            * (matrix[sensor * sensors + sensor].re * matrix[other * sensors + other].re).max(0.0).sqrt()
            / (sensors - 1) as f64;
        for at in [sensor * sensors + other, other * sensors + sensor] {
            let size = matrix[at].norm();
            if size > limit {
                matrix[at] *= limit / size;
            }
        }
    }
}

/// A drift is certain above this many standard uncertainties of its rate.
const CERTAIN: f64 = 6.0;

impl Creeping {
    /// Mean creep a turn over a range of turns, in µm.
    fn over(&self, from: usize, to: usize) -> f64 {
        let at = |turn: usize| -(-(turn as f64) / self.time_constant_turns).exp_m1();
        self.rate_um_per_rev * self.time_constant_turns * (at(to) - at(from)) / (to.max(from + 1) - from) as f64
    }

    /// Mean creep a turn over the turns fitted (or all), and its standard uncertainty, in µm.
    pub fn observed(&self, whole: bool) -> (f64, f64) {
        let creep = self.over(0, if whole { self.turns } else { self.fitted });
        (creep, (creep * self.rate_std / self.rate_um_per_rev).abs())
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
        let spread =
            (0..turns).map(|turn| (self.over(turn, turn + 1) - mean).powi(2)).sum::<f64>() / (turns * turns) as f64;
        let sensors = readings.count / readings.turns.len().max(1);
        for (matrices, square) in [(&mut readings.covariance, mean * mean), (&mut readings.scatter, spread)] {
            for matrices in matrices.iter_mut().flatten() {
                for order in 2..matrices.len() / (sensors * sensors) {
                    let matrix = &mut matrices[order * sensors * sensors..(order + 1) * sensors * sensors];
                    let leak = square / (std::f64::consts::PI * order as f64).powi(2);
                    let entry = &mut matrix[sensor * sensors + sensor];
                    entry.re = (entry.re - leak).max(LEAST_LEFT * entry.re);
                    keep_definite(matrix, sensors, sensor);
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
pub fn creeping(selection: &Selection, station: &Station) -> Vec<Option<Creeping>> {
    selection.sensors.iter().map(|sensor| of_sensor(*sensor, station)).collect()
}

fn of_sensor(sensor: usize, station: &Station) -> Option<Creeping> {
    let mut captures: Vec<Vec<f64>> = Vec::new();
    let mut fitted = 0;
    for profile in &station.profiles {
        let split = profile.split.as_ref()?;
        let channel = profile.sensors.iter().position(|known| *known == sensor)?;
        captures.push(split.levels.iter().skip(channel).step_by(profile.channels()).copied().collect());
        fitted = split.fit.turns.len();
    }
    let turns = captures.iter().map(Vec::len).min().filter(|turns| *turns >= 8)?;
    // Each capture has a level of its own.
    let mean_curve: Vec<f64> = (0..turns)
        .map(|turn| {
            let off = |capture: &Vec<f64>| capture[turn] - capture[..turns].iter().sum::<f64>() / turns as f64;
            captures.iter().map(off).sum::<f64>() / captures.len() as f64
        })
        .collect();
    let shape = |tau: f64| -> Vec<f64> {
        // The mean level of a turn is that at its middle.
        let raw: Vec<f64> = (0..turns).map(|turn| -tau * (-(turn as f64 + 0.5) / tau).exp_m1()).collect();
        let mean = raw.iter().sum::<f64>() / turns as f64;
        raw.into_iter().map(|value| value - mean).collect()
    };
    let fit = |tau: f64| {
        let shape = shape(tau);
        let square: f64 = shape.iter().map(|value| value * value).sum();
        let rate = shape.iter().zip(&mean_curve).map(|(a, b)| a * b).sum::<f64>() / square;
        let left: f64 = shape.iter().zip(&mean_curve).map(|(a, b)| (b - rate * a).powi(2)).sum();
        (left, rate, square)
    };
    let tau_of = |step: usize| 10.0_f64.powf(3.0 * step as f64 / (TRIED - 1) as f64);
    let best = (0..TRIED).map(|step| (fit(tau_of(step)).0, step)).min_by(|a, b| a.0.total_cmp(&b.0))?.1;
    // Golden section between the neighbours of the best one.
    let (mut low, mut high) = (tau_of(best.saturating_sub(1)), tau_of((best + 1).min(TRIED - 1)));
    for _ in 0..40 {
        let third = (high - low) / 3.0;
        if fit(low + third).0 < fit(high - third).0 { high -= third } else { low += third }
    }
    let tau = 0.5 * (low + high);
    let (left, rate, _) = fit(tau);
    let noise = left * TURNS_ALIKE / (turns as f64 - 3.0);
    let step = 1e-3 * tau;
    let (above, below) = (shape(tau + step), shape(tau - step));
    let by_rate = shape(tau);
    let by_tau: Vec<f64> = above.iter().zip(&below).map(|(a, b)| rate * (a - b) / (2.0 * step)).collect();
    let dot = |a: &[f64], b: &[f64]| a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>();
    let (a, b, c) = (dot(&by_rate, &by_rate), dot(&by_rate, &by_tau), dot(&by_tau, &by_tau));
    let determinant = (a * c - b * b).max(f64::MIN_POSITIVE);
    // A drift comes with every capture; what wanders does not.
    let of_capture = |capture: &Vec<f64>| dot(&by_rate, &capture[..turns]) / a;
    let rates: Vec<f64> = captures.iter().map(of_capture).collect();
    let alike = rates.iter().all(|found| (found / rate - 1.0).abs() < 0.5);
    let rate_std = (noise * c / determinant).sqrt();
    Some(Creeping {
        certain: alike && rate.abs() > CERTAIN * rate_std,
        rate_um_per_rev: rate,
        time_constant_turns: tau,
        rate_std,
        time_constant_std: (noise * a / determinant).sqrt(),
        fitted,
        turns,
    })
}

/// Says a drift that was found by its rate and time constant, where the levels tell them.
pub fn say_rates(diagnosis: &mut Diagnosis, shared: &Shared) {
    for added in diagnosis.added.iter_mut().filter(|added| added.effect == "thermal-drift") {
        let sensors = &shared.selection.rig.sensors;
        let sensor = added.targets.first().and_then(|id| sensors.iter().position(|sensor| sensor.id == *id));
        let Some(creeping) = sensor.and_then(|sensor| *shared.data.first()?.creeping.get(sensor)?) else { continue };
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
