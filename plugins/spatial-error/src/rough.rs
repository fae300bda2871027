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
    solve::{Solution, estimated_from, prior},
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

/// Correlation of neighbouring places below which a field is not smooth: it is as well a nugget.
const SMOOTH: f64 = 0.2;

impl Rough {
    /// Of each component, where noise is known from elsewhere and the nugget is estimated: the likelihood against that of every smooth
    /// field with a nugget of the noise.
    pub(crate) fn of(campaign: &Campaign, solution: &Solution, families: &[Family]) -> Vec<Self> {
        if solution.estimate.is_none() || !Solution::nugget_counts(campaign) {
            return Vec::new();
        }
        let data = campaign.data(&solution.terms, estimated_from(campaign).as_deref());
        let prior = prior(campaign, &data);
        let near = neighbours(&data.places);
        // Noise from repeats may be larger than they say.
        let largest = match campaign.noise {
            Noise::Repeats { dof, .. } => 1.0 + 2.0 / (2.0 * dof as f64).sqrt(),
            _ => 1.0,
        };
        let smooth = |covariance: &Covariance| {
            let scaled = (0..3).map(|axis| (near[axis] / covariance.range_mm[axis]).powi(2)).sum::<f64>();
            covariance.family.correlation(scaled.sqrt()) > SMOOTH
        };
        let each = |(field, axis): (usize, &usize)| {
            let (nugget_um, noise_um) = (solution.covariances[field].nugget_um, campaign.noise_um(*axis));
            let p = if nugget_um > largest * noise_um {
                let gain = gain_of_nugget(&data, &prior, field, families, largest * noise_um, &smooth);
                0.5 * chi2_tail(gain, 1.0) * solution.measured.len() as f64
            } else {
                1.0
            };
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

/// Components of the distance to the nearest place, root mean square, in mm.
fn neighbours(places: &[[f64; 3]]) -> [f64; 3] {
    let nearest = |place: &[f64; 3]| {
        let apart = places.iter().map(|other| [0, 1, 2].map(|axis| (other[axis] - place[axis]).powi(2)));
        let others = apart.filter(|apart| apart.iter().sum::<f64>() > 0.0);
        others.min_by(|one, other| one.iter().sum::<f64>().total_cmp(&other.iter().sum())).unwrap_or_default()
    };
    let sum = places.iter().map(nearest).fold([0.0; 3], |sum, one| [0, 1, 2].map(|axis| sum[axis] + one[axis]));
    sum.map(|squares| (squares / places.len().max(1) as f64).sqrt())
}
