//! Errors of readings that depend on each other in time: an instrument that moves about its place, air that changes.

use runout_core::{
    consistency::{Check, Order, Test, order::OrderModels},
    numerics::{least_squares::Basis, statistics::median},
};

/// Share of the variance that stays independent, so that the weight of a reading has a limit.
const LEAST_INDEPENDENT: f64 = 1e-3;

/// An Ornstein-Uhlenbeck process beside independent noise: covariance σ²·e^(−|Δt|/ℓ).
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Correlated {
    /// σ², in µm².
    pub variance_um2: f64,
    /// ℓ, as a share of the campaign.
    pub length: f64,
    /// Variance of the independent noise beside it, in µm².
    pub independent_um2: f64,
    /// Chance of such a gain in likelihood with independent errors.
    pub p: f64,
}

impl Correlated {
    /// Of the residual of readings at times, and the columns that were fitted. `None` where it is no more than chance.
    #[must_use]
    pub(crate) fn of(time: &[f64], residual: &[f64], columns: Vec<Vec<f64>>) -> Option<Self> {
        let order = Order { name: "time".into(), series: vec![0; time.len()], at: time.to_vec() };
        let models = OrderModels::of(&order, residual, Basis::of(columns).columns())?;
        if !models.is_correlated() {
            return None;
        }
        let mut sorted = time.to_vec();
        sorted.sort_by(f64::total_cmp);
        let step = median(sorted.windows(2).map(|pair| pair[1] - pair[0]).filter(|step| *step > 0.0));
        let errors = models.covariance();
        let mut first = vec![0.0; models.averaged().0.len()];
        *first.first_mut()? = 1.0;
        let variance_um2 = (errors.variance_of(&first) - errors.independent).max(0.0);
        let independent_um2 = errors.independent.max(LEAST_INDEPENDENT * variance_um2);
        Some(Self { variance_um2, length: errors.length * step, independent_um2, p: models.p() })
    }

    /// Covariance of two readings, in µm².
    #[must_use]
    pub fn covariance_um2(&self, one: f64, other: f64) -> f64 {
        self.variance_um2 * (-(one - other).abs() / self.length).exp()
    }

    /// Variance of independent errors with which what changes slowly has the same uncertainty: readings are `spacing` apart.
    #[must_use]
    pub(crate) fn slowly_um2(&self, spacing: f64) -> f64 {
        self.variance_um2 * (1.0 + 2.0 * self.length / spacing)
    }

    /// As a test of a component.
    #[must_use]
    pub(crate) fn check(&self, component: &str, among: usize) -> Check {
        let Self { variance_um2, length, independent_um2, p } = *self;
        let check = Check::new(Test::Order, "time", variance_um2 / independent_um2.max(f64::MIN_POSITIVE), &[2.0], p);
        let words = || {
            format!(
                "errors of {:.2} µm (standard deviation) depend on each other over {:.1} % of the campaign's time and more: \
                 uncertainties contain it",
                variance_um2.sqrt(),
                100.0 * length
            )
        };
        check.among(among).finding(words).named().within(component)
    }
}

/// Readings of each place that share errors in time.
#[derive(Debug, Clone)]
pub struct SharedErrors {
    /// How they depend on each other.
    pub of: Correlated,
    /// Times of each place's readings, each with its share in the mean.
    pub readings: Vec<Vec<(f64, f64)>>,
}

impl SharedErrors {
    /// Covariance of the means at two places, in µm².
    #[must_use]
    pub(crate) fn covariance_um2(&self, one: usize, other: usize) -> f64 {
        let pairs =
            self.readings[one].iter().flat_map(|one| self.readings[other].iter().map(move |other| (one, other)));
        pairs.map(|(one, other)| one.1 * other.1 * self.of.covariance_um2(one.0, other.0)).sum()
    }

    /// Of some places.
    #[must_use]
    pub(crate) fn some(&self, places: &[usize]) -> Self {
        Self { of: self.of, readings: places.iter().map(|place| self.readings[*place].clone()).collect() }
    }
}
