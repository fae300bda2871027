//! Errors of readings of the same places that depend on each other in time: an instrument that moves about its place, air that changes.

use runout_numerics::{least_squares::Basis, number::significant, statistics::median};

use crate::{
    check::{Check, Test},
    order::OrderModels,
    structure::Order,
};

/// Readings at most that are evaluated.
const FOLLOWED: usize = 200;
/// Share of the variance that stays independent, so that the weight of a reading has a limit.
const LEAST_INDEPENDENT: f64 = 1e-3;

/// An Ornstein-Uhlenbeck process beside independent noise: covariance σ²·e^(−|Δt|/ℓ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InTime {
    /// σ², in the square of the readings' unit.
    pub variance: f64,
    /// ℓ, in the unit of the times.
    pub length: f64,
    /// Variance of the independent noise beside it.
    pub independent: f64,
    /// Chance of such a gain in likelihood with independent errors.
    pub p: f64,
}

impl InTime {
    /// Of the readings of each place (those of a place that was read once say nothing), at times, with a residual beside columns that were
    /// fitted, as `[column][reading]`. `None` where it is no more than chance.
    ///
    /// ```
    /// use runout_consistency::in_time::InTime;
    ///
    /// // 40 places in two passes, and an error that changes sign every ten readings beside noise.
    /// let places: Vec<Vec<usize>> = (0..40).map(|place| vec![place, place + 40]).collect();
    /// let time: Vec<f64> = (0..80).map(f64::from).collect();
    /// let noise = |at: usize| 0.2 * ((at * 7919 % 101) as f64 / 50.0 - 1.0);
    /// let wandering: Vec<f64> = (0..80).map(|at| noise(at) + if at / 10 % 3 == 0 { 1.0 } else { -1.0 }).collect();
    /// let still: Vec<f64> = (0..80).map(noise).collect();
    /// assert!(InTime::of(&places, &time, &wandering, &[]).is_some_and(|found| found.variance > 0.3));
    /// assert!(InTime::of(&places, &time, &still, &[]).is_none());
    /// ```
    #[must_use]
    pub fn of(places: &[Vec<usize>], time: &[f64], residual: &[f64], columns: &[Vec<f64>]) -> Option<Self> {
        let repeated: Vec<&Vec<usize>> = places.iter().filter(|readings| readings.len() > 1).collect();
        let count: usize = repeated.iter().map(|readings| readings.len()).sum();
        let chosen = || repeated.iter().step_by(count.div_ceil(FOLLOWED).max(1));
        let readings: Vec<usize> = chosen().flat_map(|readings| readings.iter().copied()).collect();
        let pick = |column: &[f64]| readings.iter().map(|reading| column[*reading]).collect::<Vec<f64>>();
        let mut fitted: Vec<Vec<f64>> = columns.iter().map(|column| pick(column)).collect();
        let mut first = 0;
        for place in chosen() {
            let mut column = vec![0.0; readings.len()];
            column[first..first + place.len()].fill(1.0);
            fitted.push(column);
            first += place.len();
        }
        let times = pick(time);
        let order = Order { name: "time".into(), series: vec![0; times.len()], at: times.clone() };
        let basis = Basis::of(fitted);
        let mut left = pick(residual);
        basis.remove_from(&mut left);
        let models = OrderModels::of(&order, &left, basis.columns())?;
        if !models.is_correlated() {
            return None;
        }
        let mut sorted = times;
        sorted.sort_by(f64::total_cmp);
        let step = median(sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0));
        let errors = models.covariance();
        let mut one = vec![0.0; models.averaged().0.len()];
        *one.first_mut()? = 1.0;
        let variance = (errors.variance_of(&one) - errors.independent).max(0.0);
        let independent = errors.independent.max(LEAST_INDEPENDENT * variance);
        Some(Self { variance, length: errors.length * step, independent, p: models.p() })
    }

    /// Covariance of two readings.
    #[must_use]
    pub fn covariance(&self, one: f64, other: f64) -> f64 {
        self.variance * (-(one - other).abs() / self.length).exp()
    }

    /// Variance of independent errors with which what changes slowly would have the same uncertainty, of readings that are `spacing` apart.
    #[must_use]
    pub fn slowly(&self, spacing: f64) -> f64 {
        self.variance * (1.0 + 2.0 * self.length / spacing)
    }

    /// As a test of one of `among` components, in a unit; `duration` is that of all readings.
    #[must_use]
    pub fn check(&self, component: &str, among: usize, unit: &str, duration: f64) -> Check {
        let Self { variance, length, independent, p } = *self;
        let check = Check::new(Test::Order, "time", variance / independent.max(f64::MIN_POSITIVE), &[2.0], p);
        let words = || {
            format!(
                "errors of {} {unit} (standard deviation) depend on each other over {} % of the time and more",
                significant(variance.sqrt(), 2),
                significant(100.0 * length / duration, 2)
            )
        };
        check.among(among).finding(words).within(component)
    }
}
