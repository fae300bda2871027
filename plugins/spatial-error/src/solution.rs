//! What a solution predicts, and with which uncertainty.

use faer::Mat;

use crate::{
    campaign::Campaign,
    families::{Guess, likely},
    joint::{Covariance, Joint, LeftOut, Predicted, Predictor, Query, at_measured},
    likelihood::{PARAMETERS, covariances},
    neighbours::Neighbours,
    noise::Noise,
    projections::Projections,
    smooth::Spacing,
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

    /// Adds what is not known of the covariances: of their parameters to first order in the mean and to second order in the variance,
    /// along the directions in which the parameters of each field are independent (Harville, Jeske, J. Am. Stat. Assoc. 87 (1992) 724);
    /// of their families the mean over the likely ones of variance and squared distance (law of total variance).
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
        for (covariances, weight) in self.other_families() {
            let Some(other) = predicted(&covariances) else { continue };
            for (index, extra) in extra.iter_mut().enumerate() {
                let at = &all[some[index]];
                for axis in 0..3 {
                    let (other, at) = (other[index][axis], at[axis]);
                    extra[axis] +=
                        weight[axis] * ((other.mean_um - at.mean_um).powi(2) + (other.variance_um2 - at.variance_um2));
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

    /// Covariances of the next likely families of all fields together, with the probability of each component's.
    fn other_families(&self) -> Vec<(Vec<Covariance>, [f64; 3])> {
        let all: Vec<Vec<(&Guess, f64)>> = self.guesses.iter().map(|guesses| likely(guesses)).collect();
        let most = all.iter().map(Vec::len).max().unwrap_or(0);
        let of_rank = |rank: usize| {
            let fields = self.covariances.iter().zip(&all).map(|(best, guesses)| {
                let other = guesses.get(rank).and_then(|(guess, weight)| Some((guess.field()?, *weight)));
                other.unwrap_or((*best, 0.0))
            });
            let (covariances, weights): (Vec<_>, Vec<_>) = fields.unzip();
            (covariances, self.by_axis(weights, 0.0))
        };
        (1..most).map(of_rank).collect()
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
        let families: Vec<_> = self.covariances.iter().map(|covariance| covariance.family).collect();
        let moved = |direction: usize, sign: f64| {
            let mut parameters = estimate.parameters.clone();
            for (field, known) in directions.iter().enumerate() {
                let size = known.eigenvalues[direction].max(0.0).sqrt().min(LARGEST_MOVE);
                let mut part = parameters.rows_mut(field * PARAMETERS, PARAMETERS);
                part.axpy(sign * size, &known.eigenvectors.column(direction), 1.0);
            }
            covariances(&families, &parameters)
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
            let of_field = |(field, axis): (usize, &usize)| {
                let design = self.design(campaign, places, *axis);
                let query = Query { places, design: design.as_ref(), nugget_counts };
                match (&predictor, near) {
                    (Some(predictor), _) => predictor.predict(field, &query),
                    (None, Some(near)) => near.predict(&self.data, joint, field, &query),
                    (None, None) => Vec::new(),
                }
            };
            let fields: Vec<Vec<Predicted>> = self.measured.iter().enumerate().map(of_field).collect();
            let of_place = |row: usize| self.by_axis(fields.iter().map(|field| field[row]), Predicted::LOST);
            all.extend((0..places.len()).map(of_place));
        }
        all
    }

    /// What of the predictions at places is not smooth, in µm, where it is no noise: the nugget that was found at a measured place, and a
    /// field that neighbouring places do not share.
    #[must_use]
    pub(crate) fn rough_um(
        &self,
        campaign: &Campaign,
        places: &[[f64; 3]],
        predicted: &[[Predicted; 3]],
    ) -> Vec<[f64; 3]> {
        let mut all = vec![self.by_axis(self.measured.iter().map(|_| 0.0), f64::NAN); places.len()];
        if !Self::nugget_counts(campaign) {
            return all;
        }
        let spacing = Spacing::of(&self.data.places);
        let measured = at_measured(&self.data.places, places);
        for (field, axis) in self.measured.iter().copied().enumerate() {
            let design = self.design(campaign, places, axis);
            if spacing.is_smooth(&self.covariances[field]) {
                for (row, place) in &measured {
                    all[*row][axis] = match &self.neighbours {
                        None => self.covariances[field].nugget_um.powi(2) * self.joint.fields[field].alpha[*place],
                        Some(near) => {
                            let query = |nugget_counts: bool| Query {
                                places: &places[*row..=*row],
                                design: design.submatrix(*row, 0, 1, design.ncols()),
                                nugget_counts,
                            };
                            let mean = |nugget_counts: bool| {
                                let found = near.predict(&self.data, &self.joint, field, &query(nugget_counts));
                                found.first().map_or(0.0, |at| at.mean_um)
                            };
                            mean(true) - mean(false)
                        }
                    };
                }
            } else {
                for (row, at) in predicted.iter().enumerate() {
                    let trend: f64 = (0..design.ncols()).map(|at| design[(row, at)] * self.joint.trend[at]).sum();
                    all[row][axis] = at[axis].mean_um - trend;
                }
            }
        }
        all
    }

    /// Place of a column in the trend; `None` where the readings do not determine it.
    #[must_use]
    pub(crate) fn column(&self, wanted: Term) -> Option<usize> {
        self.terms.iter().position(|term| *term == wanted)
    }

    /// What each field has, by axis; `lost` of a component that was not measured.
    #[must_use]
    pub(crate) fn by_axis<T: Copy>(&self, fields: impl IntoIterator<Item = T>, lost: T) -> [T; 3] {
        let mut all = [lost; 3];
        self.measured.iter().zip(fields).for_each(|(axis, of_field)| all[*axis] = of_field);
        all
    }

    /// Standard deviation of each field and what varies from place to place, before any reading.
    #[must_use]
    pub(crate) fn prior_std_um(&self, campaign: &Campaign) -> [f64; 3] {
        let counts = Self::nugget_counts(campaign);
        let of_field =
            |covariance: &Covariance| covariance.sill_um.hypot(if counts { covariance.nugget_um } else { 0.0 });
        self.by_axis(self.covariances.iter().map(of_field), f64::NAN)
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
    pub(crate) fn noise_um2(&self, campaign: &Campaign, place: usize, field: usize) -> f64 {
        let observed = &self.data.observed[field];
        if Self::nugget_counts(campaign) {
            observed.variance_um2(place)
        } else {
            self.covariances[field].nugget_um.powi(2) * observed.share[place]
        }
    }

    /// Each place's mean reading less its prediction from all other places.
    #[must_use]
    pub(crate) fn left_out(&self) -> Vec<[LeftOut; 3]> {
        if let Some(near) = &self.neighbours {
            let all = near.left_out(&self.data, &self.joint);
            return all.into_iter().map(|fields| self.by_axis(fields, LeftOut::LOST)).collect();
        }
        let projections = Projections::of(&self.joint);
        let of_place = |place: usize| {
            // A place that alone determines a parameter of the trend is not predicted by the others.
            let covariance = projections.block(&[place]).try_inverse();
            let covariance = covariance.filter(|all| all.diagonal().iter().all(|entry| *entry > 0.0));
            let Some(covariance) = covariance else { return [LeftOut::LOST; 3] };
            let residual = &covariance * projections.pull(&[place]);
            let of_field = |field| LeftOut { residual_um: residual[field], std_um: covariance[(field, field)].sqrt() };
            self.by_axis((0..residual.len()).map(of_field), LeftOut::LOST)
        };
        (0..projections.places()).map(of_place).collect()
    }
}
