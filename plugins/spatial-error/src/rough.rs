//! What varies from place to place, against the noise of a reading: no axis follows it, and it is no noise.

use runout_core::{
    consistency::{Check, Test},
    numerics::statistics::chi2_tail,
};

use crate::{
    campaign::{COMPONENTS, Campaign},
    correlation::Family,
    families::gain_of_nugget,
    joint::Covariance,
    noise::Noise,
    smooth::Spacing,
    solve::{Solution, estimated_from, prior},
};

/// What of a component is not smooth, and the noise of its readings.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Rough {
    /// The component.
    pub axis: usize,
    /// Standard deviation from place to place beyond noise, in µm.
    pub size_um: f64,
    /// Of one reading, in µm.
    pub noise_um: f64,
    /// Chance of so large a nugget where it is the noise at most, times the number of components.
    pub p: f64,
}

impl Rough {
    /// Of each component, where noise is known from elsewhere and covariances are estimated: the likelihood against that of every smooth
    /// field with a nugget of the noise.
    pub(crate) fn of(campaign: &Campaign, solution: &Solution, families: &[Family]) -> Vec<Self> {
        if solution.estimate.is_none() || !Solution::nugget_counts(campaign) {
            return Vec::new();
        }
        let data = campaign.data(&solution.terms, estimated_from(campaign).as_deref());
        let prior = prior(campaign, &data);
        let spacing = Spacing::of(&data.places);
        // Noise from repeats may be larger than they say.
        let largest = match campaign.noise {
            Noise::Repeats { dof, .. } => 1.0 + 2.0 / (2.0 * dof as f64).sqrt(),
            _ => 1.0,
        };
        let each = |(field, axis): (usize, &usize)| {
            let (size_um, noise_um) = (spacing.rough_um(&solution.covariances[field]), campaign.noise_um(*axis));
            let p = if size_um > largest * noise_um {
                let smooth = |covariance: &Covariance| spacing.is_smooth(covariance);
                let gain = gain_of_nugget(&data, &prior, field, families, largest * noise_um, &smooth);
                0.5 * chi2_tail(gain, 1.0) * solution.measured.len() as f64
            } else {
                1.0
            };
            Self { axis: *axis, size_um, noise_um, p }
        };
        solution.measured.iter().enumerate().map(each).collect()
    }

    /// As a test: nothing where it is the noise at most.
    pub(crate) fn check(&self) -> Check {
        let Self { axis, size_um, noise_um, p } = *self;
        let (component, ratio) = (COMPONENTS[axis], size_um / noise_um);
        Check::new(Test::Residual, component, ratio * ratio, &[], p).finding(|| {
            format!(
                "{component} varies from place to place by {size_um:.1} µm (standard deviation), {ratio:.1} times the noise of \
                 {noise_um:.1} µm: no axis takes it away, and `remains_rms` contains it"
            )
        })
    }
}
