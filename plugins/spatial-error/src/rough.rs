//! What varies from place to place, against the noise of a reading: no axis follows it, and it is no noise.

use runout_core::{model::diagnosis::Unexplained, numerics::statistics::f_tail};

use crate::{
    campaign::{COMPONENTS, Campaign},
    likelihood::PARAMETERS,
    noise::Noise,
    solve::Solution,
};

/// Degrees of freedom that are as good as infinite.
const MANY: f64 = 1e9;
/// Chance below which a nugget is more than the noise.
const CHANCE: f64 = 0.005;

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
            let above = 0.5 * f_tail(far * far / (estimate.covariance[(index, index)] + of_noise), 1.0, MANY);
            let p = if far > 0.0 { above * solution.measured.len() as f64 } else { 1.0 };
            Self { axis: *axis, nugget_um, noise_um, p }
        };
        solution.measured.iter().enumerate().map(each).collect()
    }

    /// Whether it is more than the noise.
    pub(crate) fn is_more(&self) -> bool {
        self.p < CHANCE
    }

    /// In words.
    pub(crate) fn words(&self) -> String {
        let Self { axis, nugget_um, noise_um, .. } = self;
        format!(
            "{} varies from place to place by {nugget_um:.1} µm (standard deviation), {:.1} times the noise of {noise_um:.1} µm",
            COMPONENTS[*axis],
            nugget_um / noise_um
        )
    }

    /// As something that no effect explains.
    pub(crate) fn unexplained(&self, components: usize) -> Unexplained {
        Unexplained {
            sensor: None,
            setup: None,
            orders: [0, 0],
            rms_um: self.nugget_um / (components as f64).sqrt(),
            place: format!("{}: no axis follows it", self.words()),
        }
    }
}
