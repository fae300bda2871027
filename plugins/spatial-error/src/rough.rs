//! What varies from place to place, against the noise of a reading: no axis follows it, and it is no noise.

use runout_core::{
    consistency::{Check, Test},
    numerics::statistics::chi2_tail,
};

use crate::{
    campaign::{COMPONENTS, Campaign},
    likelihood::PARAMETERS,
    noise::Noise,
    solve::Solution,
};

/// A component's estimated nugget, and the noise of its readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rough {
    /// The component.
    pub axis: usize,
    /// Standard deviation from place to place beyond noise, in µm.
    pub nugget_um: f64,
    /// Of one reading, in µm.
    pub noise_um: f64,
    /// Chance of so large a nugget where it is the noise at most, times the number of components.
    pub p: f64,
}

impl Rough {
    /// Of each component, where noise is known from elsewhere and the nugget is estimated: ln nugget is normal, with the variance of the
    /// average information.
    pub(crate) fn of(campaign: &Campaign, solution: &Solution) -> Vec<Self> {
        let Some(estimate) = solution.estimate.as_ref().filter(|_| Solution::nugget_counts(campaign)) else {
            return Vec::new();
        };
        let of_noise = match campaign.noise {
            Noise::Repeats { dof, .. } => 1.0 / (2.0 * dof as f64),
            _ => 0.0,
        };
        let each = |(field, axis): (usize, &usize)| {
            let index = field * PARAMETERS + PARAMETERS - 1;
            let (nugget_um, noise_um) = (solution.covariances[field].nugget_um, campaign.noise_um(*axis));
            let far = (nugget_um / noise_um).ln();
            let above = 0.5 * chi2_tail(far * far / (estimate.covariance[(index, index)] + of_noise), 1.0);
            let p = if far > 0.0 { above * solution.measured.len() as f64 } else { 1.0 };
            Self { axis: *axis, nugget_um, noise_um, p }
        };
        solution.measured.iter().enumerate().map(each).collect()
    }

    /// As a test: nothing where it is the noise at most.
    pub(crate) fn check(&self) -> Check {
        let Self { axis, nugget_um, noise_um, p } = *self;
        let (component, ratio) = (COMPONENTS[axis], nugget_um / noise_um);
        Check::new(Test::Residual, component, ratio * ratio, &[], p).finding(|| {
            format!(
                "{component} varies from place to place by {nugget_um:.1} µm (standard deviation), {ratio:.1} times the noise of \
                 {noise_um:.1} µm: no axis takes it away, and `remains_rms` contains it"
            )
        })
    }
}
