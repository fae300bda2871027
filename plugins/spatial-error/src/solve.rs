//! From a campaign to covariances, trend and predictions.

use faer::Mat;
use nalgebra::{DVector, Matrix3, Vector3};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use runout_core::{Error, Result};

use crate::{
    campaign::Campaign,
    config::{Kriging, SpatialErrorConfig},
    correlation::Family,
    joint::{Covariance, Data, Joint, LeftOut, Predicted, Predictor, Query, inverse},
    likelihood::{Criterion, Estimate, PARAMETERS, Prior, covariances, estimate},
    neighbours::Neighbours,
    noise::Noise,
    terms::Term,
};

/// Distinct places that covariances are estimated from at most, and how many of them are at random over the volume.
const ESTIMATED_FROM: [usize; 2] = [600, 300];
/// Places of a cluster: it is as wide as the nearest places that a prediction takes.
const CLUSTER: usize = 50;
/// Distinct places that decide the trend where predictions come from nearest neighbours.
const TREND_FROM: usize = 1500;
/// Distinct places that an estimated covariance needs at least.
const FEWEST: usize = 10;
/// Share of a column outside the span of those before it, below which it is none of its own.
const INDEPENDENT: f64 = 1e-6;
/// Products of places and predictions up to which each prediction is widened by itself; predictions from nearest places that are.
const WIDENED: usize = 20_000_000;
const WIDENED_NEAR: usize = 64;
/// Places up to which the uncertainty of the trend is widened: of more, covariances are known well.
const WIDENED_TREND: usize = 1000;
/// Largest move of the logarithm of a parameter: beyond, it is not known at all.
const LARGEST_MOVE: f64 = 1.0;
/// Places predicted in one go.
const CHUNK: usize = 8192;

/// Covariances and trend.
#[derive(Debug, Clone)]
pub struct Solution {
    /// The family of all three covariances.
    pub family: Family,
    /// Their estimation; `None` where they are given.
    pub estimate: Option<Estimate>,
    /// Covariance of dx, dy, dz.
    pub covariances: Vec<Covariance>,
    /// Columns of the trend.
    pub terms: Vec<Term>,
    /// Declared columns that the places do not determine.
    pub lost: Vec<Term>,
    /// Means at all places.
    pub data: Data,
    /// The fit: of all places, or of some that determine the trend where predictions come from neighbours.
    pub joint: Joint,
    /// Places of the fit.
    pub fitted: Option<Vec<usize>>,
    neighbours: Option<Neighbours>,
}

/// The columns that are not in the span of those before them, and the others.
#[must_use]
pub fn independent(campaign: &Campaign, terms: &[Term]) -> (Vec<Term>, Vec<Term>) {
    let (mut kept, mut lost) = (Vec::new(), Vec::new());
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for term in terms {
        let rows = campaign.place_of.iter().zip(&campaign.time);
        let column: Vec<f64> =
            rows.flat_map(|(place, time)| term.at(&campaign.volume, campaign.places_mm[*place], *time)).collect();
        let column = DVector::from_vec(column);
        let whole = column.norm();
        let mut left = column;
        for _ in 0..2 {
            for known in &basis {
                let share = known.dot(&left);
                left.axpy(-share, known, 1.0);
            }
        }
        if left.norm() > INDEPENDENT * whole && whole > 0.0 {
            let size = left.norm();
            basis.push(left / size);
            kept.push(*term);
        } else {
            lost.push(*term);
        }
    }
    (kept, lost)
}

/// What is usual of the covariances of data: sills as large as what the trend leaves, ranges of half the extent.
#[must_use]
pub fn prior(campaign: &Campaign, data: &Data) -> Prior {
    let total = PARAMETERS * data.observed.len();
    let (mut centre, mut precision) = (DVector::zeros(total), DVector::zeros(total));
    let extents = campaign.volume.half_mm.map(|half| 2.0 * half);
    let largest = extents.iter().copied().fold(0.0, f64::max).max(1e-3);
    for (index, (observed, design)) in data.observed.iter().zip(&data.design).enumerate() {
        let first = index * PARAMETERS;
        let count = observed.mean_um.len();
        let left = left_of_trend(&observed.mean_um, design);
        let noise = observed.noise_um2.iter().sum::<f64>() / count as f64;
        let std_um = (left / count as f64).sqrt().max(0.1 * noise.sqrt()).max(1e-6);
        centre[first] = std_um.ln();
        precision[first] = 0.25;
        for (axis, extent) in extents.iter().enumerate() {
            centre[first + 1 + axis] = (0.5 * extent.max(0.2 * largest)).ln();
            precision[first + 1 + axis] = if *extent > 1e-4 * largest { 1.0 } else { f64::INFINITY };
        }
        centre[first + 4] = (0.1 * std_um).ln();
        precision[first + 4] = 1.0 / 9.0;
    }
    Prior { centre, precision }
}

/// Sum of squares that ordinary least squares leaves.
fn left_of_trend(values: &[f64], design: &Mat<f64>) -> f64 {
    let mut left = DVector::from_column_slice(values);
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in 0..design.ncols() {
        let mut own = DVector::from_fn(values.len(), |row, _| design[(row, column)]);
        let whole = own.norm();
        for known in &basis {
            let share = known.dot(&own);
            own.axpy(-share, known, 1.0);
        }
        let size = own.norm();
        if size > INDEPENDENT * whole && size > 0.0 {
            own /= size;
            let share = own.dot(&left);
            left.axpy(-share, &own, 1.0);
            basis.push(own);
        }
    }
    left.norm_squared()
}

/// The most likely family and covariances.
#[must_use]
pub fn most_likely(
    data: &Data,
    prior: &Prior,
    families: &[Family],
    criterion: Criterion,
    start: Option<(Family, &DVector<f64>)>,
) -> Option<(Family, Estimate)> {
    let mut best: Option<(Family, Estimate)> = None;
    let moved = |from: &DVector<f64>, by: f64| {
        let shift = |index: usize, value: f64| {
            let is_range = (1..4).contains(&(index % PARAMETERS)) && prior.precision[index].is_finite();
            if is_range { value + by } else { value }
        };
        DVector::from_fn(from.len(), |index, _| shift(index, from[index]))
    };
    for family in families {
        let starts = match (&best, start) {
            (Some((known, found)), _) => vec![moved(&found.parameters, (reach(*known) / reach(*family)).ln())],
            (None, Some((known, from))) => vec![moved(from, (reach(known) / reach(*family)).ln())],
            (None, None) => vec![prior.centre.clone(), moved(&prior.centre, 0.9)],
        };
        for start in starts {
            let Some(found) = estimate(data, *family, prior, &start, criterion) else { continue };
            if best.as_ref().is_none_or(|(_, best)| found.ln_likelihood > best.ln_likelihood) {
                best = Some((*family, found));
            }
        }
    }
    best
}

/// Distance, in ranges, at which a family's correlation is 0.5.
fn reach(family: Family) -> f64 {
    match family {
        Family::Exponential => 0.69,
        Family::Gaussian => 1.18,
        Family::Spherical => 0.35,
        Family::Matern32 => 0.97,
        Family::Matern52 => 1.05,
    }
}

/// Families that may be taken.
#[must_use]
pub fn families(kriging: &Kriging) -> Vec<Family> {
    // A smooth and a rough one first: the others begin at the better of them.
    const ORDER: [Family; 5] =
        [Family::Matern52, Family::Matern32, Family::Gaussian, Family::Exponential, Family::Spherical];
    kriging.variogram.family().map_or_else(|| ORDER.to_vec(), |family| vec![family])
}

/// Places that covariances are estimated from: all, or some at random, which show ranges, and dense clusters around some of these. Only
/// the clusters show how smooth the field is between the places that a prediction is made from.
#[must_use]
pub fn estimated_from(campaign: &Campaign) -> Option<Vec<usize>> {
    let count = campaign.places_mm.len();
    if count <= ESTIMATED_FROM[0] {
        return None;
    }
    let [all, scattered] = ESTIMATED_FROM;
    let mut order: Vec<usize> = (0..count).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(count as u64));
    let mut chosen = order[..scattered].to_vec();
    let mut used = vec![false; count];
    for place in &chosen {
        used[*place] = true;
    }
    let apart = |a: usize, b: usize| {
        let [a, b] = [a, b].map(|place| Vector3::from(campaign.places_mm[place]));
        (a - b).norm_squared()
    };
    for index in 0..(all - scattered) / CLUSTER {
        let from = chosen[index];
        let mut free: Vec<usize> = (0..count).filter(|place| !used[*place]).collect();
        free.sort_by(|a, b| apart(from, *a).total_cmp(&apart(from, *b)));
        free.truncate(CLUSTER);
        free.iter().for_each(|place| used[*place] = true);
        chosen.extend(free);
    }
    chosen.sort_unstable();
    Some(chosen)
}

/// Fits covariances and trend.
///
/// # Errors
/// When the places are too few, or a given covariance has no positive definite matrix.
pub fn solve(campaign: &Campaign, config: &SpatialErrorConfig, added: &[Term]) -> Result<Solution> {
    let wanted: Vec<Term> = config.declared_terms().into_iter().chain(added.iter().copied()).collect();
    let (terms, lost) = independent(campaign, &wanted);
    has_enough(campaign, config, &terms)?;
    if let Some(covariance) = config.kriging.fixed() {
        no_contradiction(campaign, &covariance)?;
        let (family, covariances) = (covariance.family, vec![covariance; 3]);
        return complete(campaign, config, Found { family, estimate: None, covariances, terms, lost });
    }
    let some = estimated_from(campaign);
    let data = campaign.data(&terms, some.as_deref());
    let prior = prior(campaign, &data);
    let found = most_likely(&data, &prior, &families(&config.kriging), Criterion::Restricted, None);
    let (family, estimate) = found.ok_or_else(|| {
        let problem = "no covariance with a positive definite matrix was found".to_owned();
        Error::new("estimate the covariance of", &campaign.file, problem)
            .help("are places or readings far out of their usual size? `kriging` takes a covariance of your own")
    })?;
    let covariances = estimate.covariances.clone();
    let estimate = Some(estimate);
    complete(campaign, config, Found { family, estimate, covariances, terms, lost })
}

/// Covariances and columns, without the fit of all places.
pub struct Found {
    /// The family.
    pub family: Family,
    /// Its estimation.
    pub estimate: Option<Estimate>,
    /// Covariance of dx, dy, dz.
    pub covariances: Vec<Covariance>,
    /// Columns of the trend.
    pub terms: Vec<Term>,
    /// Declared columns that the places do not determine.
    pub lost: Vec<Term>,
}

/// Fits the trend with known covariances.
///
/// # Errors
/// When a covariance has no positive definite matrix.
pub fn complete(campaign: &Campaign, config: &SpatialErrorConfig, found: Found) -> Result<Solution> {
    let Found { family, estimate, covariances, terms, lost } = found;
    let count = campaign.places_mm.len();
    let by_neighbours = count > config.kriging.full_places;
    let data = campaign.data(&terms, None);
    let fitted = by_neighbours.then(|| {
        let mut order: Vec<usize> = (0..count).collect();
        order.shuffle(&mut ChaCha8Rng::seed_from_u64(1));
        order.truncate(TREND_FROM.min(config.kriging.full_places));
        order.sort_unstable();
        order
    });
    let joint = match &fitted {
        Some(some) => Joint::new(&campaign.data(&terms, Some(some)), &covariances),
        None => Joint::new(&data, &covariances),
    };
    let joint = joint.ok_or_else(|| {
        let problem = format!(
            "the covariance matrix of {} places is not positive definite",
            fitted.as_ref().map_or(count, Vec::len)
        );
        Error::new("fit the covariance to", &campaign.file, problem)
            .help("a nugget above 0, a shorter range or another variogram makes it so: smooth ones need a nugget")
    })?;
    let neighbours = by_neighbours.then(|| Neighbours::new(&data, &covariances));
    Ok(Solution { family, estimate, covariances, terms, lost, data, joint, fitted, neighbours })
}

fn has_enough(campaign: &Campaign, config: &SpatialErrorConfig, terms: &[Term]) -> Result<()> {
    let count = campaign.places_mm.len();
    let fixed = config.kriging.fixed().is_some();
    let needed = if fixed { terms.len().div_ceil(3) } else { FEWEST.max(terms.len().div_ceil(3) + 4) };
    if count >= needed {
        return Ok(());
    }
    let what = if fixed { "the declared trend" } else { "a covariance and the declared trend" };
    let problem = format!("{count} distinct places do not determine {what}: at least {needed} are needed");
    Err(Error::new("fit", &campaign.file, problem).help("`kriging` with `sill_um` and `range_mm` needs fewer places"))
}

fn differ(one: [f64; 3], other: [f64; 3]) -> bool {
    one.iter().zip(other).any(|(one, other)| (one - other).abs() > 0.0)
}

/// Readings of one place that differ, with a covariance that says that they cannot.
fn no_contradiction(campaign: &Campaign, covariance: &Covariance) -> Result<()> {
    if covariance.nugget_um > 0.0 || campaign.noise != Noise::Unknown {
        return Ok(());
    }
    let mut first = vec![None; campaign.places_mm.len()];
    for (row, place) in campaign.place_of.iter().enumerate() {
        match first[*place] {
            None => first[*place] = Some(row),
            Some(other) if differ(campaign.readings_um[other], campaign.readings_um[row]) => {
                let [x, y, z] = campaign.places_mm[*place];
                let problem = format!(
                    "rows {} and {} are at one place ({x}, {y}, {z} mm) and read differently, and the covariance has no nugget",
                    other + 1,
                    row + 1
                );
                return Err(Error::new("fit the covariance to", &campaign.file, problem)
                    .help("give `nugget_um` in `kriging`, or `std_um`: readings of one place are then averaged"));
            }
            Some(_) => {}
        }
    }
    Ok(())
}

impl Solution {
    /// Whether the nugget is real variation, beyond noise that is known.
    #[must_use]
    pub fn nugget_counts(campaign: &Campaign) -> bool {
        campaign.noise != Noise::Unknown
    }

    /// Columns of the trend along an axis at places, at the time of the first reading.
    #[must_use]
    pub fn design(&self, campaign: &Campaign, places: &[[f64; 3]], axis: usize) -> Mat<f64> {
        Mat::from_fn(places.len(), self.terms.len(), |row, column| {
            self.terms[column].at(&campaign.volume, places[row], 0.0)[axis]
        })
    }

    /// What would be read at places, without noise. The variance contains what is not known of estimated covariances.
    #[must_use]
    pub fn predict(&self, campaign: &Campaign, places: &[[f64; 3]], variance: bool) -> Vec<[Predicted; 3]> {
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

    /// Standard uncertainty of each column of the trend, with what is not known of estimated covariances.
    #[must_use]
    pub fn trend_std(&self) -> Vec<f64> {
        let plain = self.joint.trend_covariance.diagonal();
        let mut variance = plain.clone();
        if self.neighbours.is_none() && self.data.places.len() <= WIDENED_TREND {
            for pair in self.alternatives() {
                let [Some(above), Some(below)] = pair.map(|moved| Joint::new(&self.data, &moved)) else { continue };
                let (a, b) = (above.trend_covariance.diagonal(), below.trend_covariance.diagonal());
                let moved = (above.trend - below.trend) * 0.5;
                variance += moved.component_mul(&moved) + (0.5 * (a + b) - &plain).map(|more| more.max(0.0));
            }
        }
        variance.iter().map(|variance| variance.sqrt()).collect()
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
    pub fn prior_std_um(&self, campaign: &Campaign, axis: usize) -> f64 {
        let covariance = &self.covariances[axis];
        covariance.sill_um.hypot(if Self::nugget_counts(campaign) { covariance.nugget_um } else { 0.0 })
    }

    /// What of a prediction is the declared placement, at a place.
    #[must_use]
    pub fn placement_um(&self, campaign: &Campaign, place: [f64; 3]) -> [f64; 3] {
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
    pub fn noise_um2(&self, campaign: &Campaign, place: usize, axis: usize) -> f64 {
        let observed = &self.data.observed[axis];
        if Self::nugget_counts(campaign) {
            observed.noise_um2[place]
        } else {
            self.covariances[axis].nugget_um.powi(2) * observed.share[place]
        }
    }

    /// Each place's mean reading less its prediction from all other places.
    #[must_use]
    pub fn left_out(&self) -> Vec<[LeftOut; 3]> {
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
    pub fn projections(&self) -> Vec<Matrix3<f64>> {
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
