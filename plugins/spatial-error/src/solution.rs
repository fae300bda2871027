//! What a solution predicts, and with which uncertainty.

use faer::Mat;
use nalgebra::{DVector, Matrix3, Vector3};

use crate::{
    campaign::Campaign,
    joint::{Covariance, Joint, LeftOut, Predicted, Predictor, Query, inverse},
    likelihood::{PARAMETERS, covariances},
    neighbours::Neighbours,
    noise::Noise,
    solve::Solution,
    terms::Term,
};

/// Products of places and predictions up to which each prediction is widened by itself; predictions from nearest places that are.
const WIDENED: usize = 20_000_000;
const WIDENED_NEAR: usize = 64;
/// Largest move of the logarithm of a parameter: beyond, it is not known at all.
const LARGEST_MOVE: f64 = 1.0;
/// Places predicted in one go.
const CHUNK: usize = 8192;

impl Solution {
    /// Whether the nugget is real variation, beyond noise that is known.
    #[must_use]
    pub(crate) fn nugget_counts(campaign: &Campaign) -> bool {
        campaign.noise != Noise::Unknown
    }

    /// Columns of the trend along an axis at places, at the time of the first reading.
    #[must_use]
    pub(crate) fn design(&self, campaign: &Campaign, places: &[[f64; 3]], axis: usize) -> Mat<f64> {
        Mat::from_fn(places.len(), self.terms.len(), |row, column| {
            self.terms[column].at(&campaign.volume, places[row], 0.0)[axis]
        })
    }

    /// What would be read at places, without noise. The variance contains what is not known of estimated covariances.
    #[must_use]
    pub(crate) fn predict(&self, campaign: &Campaign, places: &[[f64; 3]], variance: bool) -> Vec<[Predicted; 3]> {
        let mut all = self.plain(campaign, &self.joint, self.neighbours.as_ref(), places, variance);
        if variance && self.estimate.is_some() {
            self.widen(campaign, places, &mut all);
        }
        all
    }

    /// Adds what is not known of the covariances, to first order in the mean and to second order in the variance, along the
    /// directions in which the parameters of each field are independent (Harville, Jeske, J. Am. Stat. Assoc. 87 (1992) 724).
    /// Where predictions are many, every so many are computed, and the others are widened by their mean ratio. Predictions from nearest
    /// places keep the trend, of which next to nothing is left beside so many places.
    fn widen(&self, campaign: &Campaign, places: &[[f64; 3]], all: &mut [[Predicted; 3]]) {
        let every = match self.neighbours {
            Some(_) => places.len().div_ceil(WIDENED_NEAR),
            None => (places.len() * self.data.places.len()).div_ceil(WIDENED),
        }
        .max(1);
        let some: Vec<usize> = (0..places.len()).step_by(every).collect();
        let asked: Vec<[f64; 3]> = some.iter().map(|index| places[*index]).collect();
        let mut extra = vec![[0.0; 3]; asked.len()];
        let predicted = |covariances: &[Covariance]| {
            if self.neighbours.is_some() {
                let near = Neighbours::new(&self.data, covariances);
                return Some(self.plain(campaign, &self.joint, Some(&near), &asked, true));
            }
            let joint = Joint::new(&self.data, covariances)?;
            Some(self.plain(campaign, &joint, None, &asked, true))
        };
        for [above, below] in self.alternatives() {
            let (Some(above), Some(below)) = (predicted(&above), predicted(&below)) else { continue };
            for (index, extra) in extra.iter_mut().enumerate() {
                let at = &all[some[index]];
                for axis in 0..3 {
                    let (a, b) = (above[index][axis], below[index][axis]);
                    extra[axis] += (0.5 * (a.mean_um - b.mean_um)).powi(2)
                        + (0.5 * (a.variance_um2 + b.variance_um2) - at[axis].variance_um2);
                }
            }
        }
        for axis in 0..3 {
            let plain: f64 = some.iter().map(|index| all[*index][axis].variance_um2).sum();
            let ratio =
                1.0 + extra.iter().map(|extra| extra[axis].max(0.0)).sum::<f64>() / plain.max(f64::MIN_POSITIVE);
            for (index, at) in all.iter_mut().enumerate() {
                let variance = &mut at[axis].variance_um2;
                *variance = if index % every == 0 {
                    *variance + extra[index / every][axis].max(0.0)
                } else {
                    *variance * ratio
                };
            }
        }
    }

    /// Covariances with the parameters of all fields moved by their standard uncertainty, to both sides of each independent direction.
    fn alternatives(&self) -> Vec<[Vec<Covariance>; 2]> {
        let Some(estimate) = &self.estimate else { return Vec::new() };
        let fields = self.covariances.len();
        let directions: Vec<_> = (0..fields)
            .map(|field| {
                let first = field * PARAMETERS;
                let block = estimate.covariance.view((first, first), (PARAMETERS, PARAMETERS)).into_owned();
                nalgebra::SymmetricEigen::new(block)
            })
            .collect();
        let moved = |direction: usize, sign: f64| {
            let mut parameters = estimate.parameters.clone();
            for (field, known) in directions.iter().enumerate() {
                let size = known.eigenvalues[direction].max(0.0).sqrt().min(LARGEST_MOVE);
                let mut part = parameters.rows_mut(field * PARAMETERS, PARAMETERS);
                part.axpy(sign * size, &known.eigenvectors.column(direction), 1.0);
            }
            covariances(self.family, &parameters)
        };
        (0..PARAMETERS).map(|direction| [moved(direction, 1.0), moved(direction, -1.0)]).collect()
    }

    fn plain(
        &self,
        campaign: &Campaign,
        joint: &Joint,
        near: Option<&Neighbours>,
        places: &[[f64; 3]],
        variance: bool,
    ) -> Vec<[Predicted; 3]> {
        let nugget_counts = Self::nugget_counts(campaign);
        let predictor = near.is_none().then(|| Predictor::new(joint, &self.data.places, variance));
        let mut all = Vec::with_capacity(places.len());
        for places in places.chunks(CHUNK) {
            let axes = [0, 1, 2].map(|axis| {
                let design = self.design(campaign, places, axis);
                let query = Query { places, design: design.as_ref(), nugget_counts };
                match (&predictor, near) {
                    (Some(predictor), _) => predictor.predict(axis, &query),
                    (None, Some(near)) => near.predict(&self.data, joint, axis, &query),
                    (None, None) => Vec::new(),
                }
            });
            all.extend((0..places.len()).map(|row| [axes[0][row], axes[1][row], axes[2][row]]));
        }
        all
    }

    /// Standard deviation of the field and what varies from place to place, before any reading.
    #[must_use]
    pub(crate) fn prior_std_um(&self, campaign: &Campaign, axis: usize) -> f64 {
        let covariance = &self.covariances[axis];
        covariance.sill_um.hypot(if Self::nugget_counts(campaign) { covariance.nugget_um } else { 0.0 })
    }

    /// What of a prediction is the declared placement, at a place.
    #[must_use]
    pub(crate) fn placement_um(&self, campaign: &Campaign, place: [f64; 3]) -> [f64; 3] {
        let mut sum = [0.0; 3];
        for (term, value) in self.terms.iter().zip(self.joint.trend.iter()) {
            if matches!(term, Term::Shift(_) | Term::Turn(_)) {
                let adds = term.at(&campaign.volume, place, 0.0);
                sum.iter_mut().zip(adds).for_each(|(sum, adds)| *sum += value * adds);
            }
        }
        sum
    }

    /// Noise variance that averaging over the repeats leaves of the mean at a place: where the noise is not known, the nugget's.
    #[must_use]
    pub(crate) fn noise_um2(&self, campaign: &Campaign, place: usize, axis: usize) -> f64 {
        let observed = &self.data.observed[axis];
        if Self::nugget_counts(campaign) {
            observed.noise_um2[place]
        } else {
            self.covariances[axis].nugget_um.powi(2) * observed.share[place]
        }
    }

    /// Each place's mean reading less its prediction from all other places.
    #[must_use]
    pub(crate) fn left_out(&self) -> Vec<[LeftOut; 3]> {
        if let Some(near) = &self.neighbours {
            return near.left_out(&self.data, &self.joint);
        }
        let projections = self.projections();
        let of = |(place, projection): (usize, &Matrix3<f64>)| {
            let pull = Vector3::from_fn(|axis, _| self.joint.fields[axis].alpha[place]);
            // A place that alone determines a parameter of the trend is not predicted by the others.
            let covariance = projection.try_inverse().filter(|all| all.diagonal().iter().all(|entry| *entry > 0.0));
            let covariance = covariance.unwrap_or_else(|| Matrix3::from_element(f64::NAN));
            let residual = covariance * pull;
            [0, 1, 2].map(|axis| LeftOut { residual_um: residual[axis], std_um: covariance[(axis, axis)].sqrt() })
        };
        projections.iter().enumerate().map(of).collect()
    }

    /// Blocks of P = K⁻¹ − K⁻¹X(XᵀK⁻¹X)⁻¹XᵀK⁻¹, one a place of the fit.
    #[must_use]
    pub(crate) fn projections(&self) -> Vec<Matrix3<f64>> {
        let count = self.joint.fields[0].alpha.len();
        let columns = self.terms.len();
        let mut blocks = vec![Matrix3::zeros(); count];
        let mut back = Vec::new();
        for (axis, field) in self.joint.fields.iter().enumerate() {
            let lower = inverse(&field.factor);
            for (place, block) in blocks.iter_mut().enumerate() {
                block[(axis, axis)] = lower.col(place).squared_norm_l2();
            }
            let mut design = field.white.clone();
            field.factor.transpose().solve_upper_triangular_in_place(design.as_mut());
            back.push(design);
        }
        for (place, block) in blocks.iter_mut().enumerate() {
            let rows: Vec<DVector<f64>> =
                back.iter().map(|design| DVector::from_fn(columns, |column, _| design[(place, column)])).collect();
            for one in 0..3 {
                let weighted = &self.joint.trend_covariance * &rows[one];
                for other in 0..3 {
                    block[(one, other)] -= weighted.dot(&rows[other]);
                }
            }
        }
        blocks
    }
}
