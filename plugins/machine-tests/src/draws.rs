//! Standard uncertainties and intervals of values that are functions of what was measured.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use runout_core::{
    draws::{NORMAL_95, student_95},
    summary::Value,
};

/// Draws of each machine measured again.
const DRAWS: usize = 200;

/// Normal numbers of one draw.
pub(crate) struct Draw(ChaCha8Rng);

impl Draw {
    pub(crate) fn new(seed: u64) -> Self {
        Self(ChaCha8Rng::seed_from_u64(seed))
    }

    pub(crate) fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.0)
    }

    /// A true standard deviation over the one found from so many degrees of freedom: √(ν/χ²), as wide as 95 % of all at most.
    pub(crate) fn true_std_ratio(&mut self, freedom: usize) -> f64 {
        let squares: f64 = (0..freedom).map(|_| self.normal().powi(2)).sum();
        let widest = student_95(freedom as f64) / NORMAL_95;
        (freedom as f64 / squares).sqrt().min(widest)
    }
}

/// A value: its symbol, the number and what it is.
pub(crate) struct Computed {
    pub symbol: String,
    pub value: f64,
    pub about: &'static str,
    pub is_key: bool,
    /// The least that it can be.
    pub least: f64,
}

/// Which machine is measured again.
#[derive(Clone, Copy, PartialEq, Eq)]
pub(crate) enum Machine {
    /// What was found, less what noise alone may have made: what is left is raised most by noise.
    Least,
    /// What was found, with its noise: what is there is raised least.
    Most,
}

/// How far means are drawn together that have this variance, where noise has this share of it: what is left has the power without noise.
pub(crate) fn without_noise(variance: f64, of_noise: f64) -> f64 {
    if variance > 0.0 { (1.0 - of_noise / variance).max(0.0).sqrt() } else { 0.0 }
}

/// Values with their uncertainties. `error` measures a machine again, and gives what the values are then off by.
///
/// What an error is on average, noise has raised the value by: the interval takes it back (basic bootstrap, Davison and Hinkley, Bootstrap Methods, 1997,
/// section 2.4). It holds those of both machines.
pub(crate) fn with_uncertainty(
    computed: &[Computed],
    unit: &str,
    seed: u64,
    error: impl Fn(Machine, &mut Draw) -> Vec<f64>,
) -> Vec<Value> {
    let mut draw = Draw::new(seed);
    let errors = [Machine::Least, Machine::Most]
        .map(|machine| (0..DRAWS).map(|_| error(machine, &mut draw)).collect::<Vec<Vec<f64>>>());
    let with = |(index, computed): (usize, &Computed)| {
        let (mut std, mut interval) = (0.0_f64, [f64::INFINITY, f64::NEG_INFINITY]);
        for errors in &errors {
            let mut of: Vec<f64> = errors.iter().map(|error| error[index]).collect();
            of.sort_by(f64::total_cmp);
            let mean = of.iter().sum::<f64>() / DRAWS as f64;
            std = std.max((of.iter().map(|one| (one - mean).powi(2)).sum::<f64>() / (DRAWS - 1) as f64).sqrt());
            let at = |share: f64| computed.value - of[(share * (DRAWS - 1) as f64).round() as usize];
            interval = [interval[0].min(at(0.975)), interval[1].max(at(0.025))];
        }
        let mut value = Value::new(&computed.symbol, computed.value, std, unit, computed.about);
        if let Some(known) = &mut value.uncertainty {
            known.interval_95 = interval.map(|end| end.max(computed.least));
        }
        if computed.is_key { value.key() } else { value }
    };
    computed.iter().enumerate().map(with).collect()
}
