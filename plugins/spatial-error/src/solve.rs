//! From a campaign to covariances, trend and predictions.

use faer::Mat;
use nalgebra::{DVector, Vector3};
use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use runout_core::{Error, Result};

use crate::{
    campaign::Campaign,
    config::{Kriging, SpatialErrorConfig},
    correlation::Family,
    families::{Guess, INDEPENDENT, Likely, basis, most_likely},
    joint::{Covariance, Data, Joint},
    likelihood::{Criterion, Estimate, PARAMETERS, Prior},
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

/// Covariances and trend.
#[derive(Debug, Clone)]
pub(crate) struct Solution {
    /// Components that were measured: 0 dx, 1 dy, 2 dz. Each is a field.
    pub measured: Vec<usize>,
    /// Estimation of the covariances; `None` where they are given.
    pub estimate: Option<Estimate>,
    /// The best estimate of each family that was tried, of each field.
    pub guesses: Vec<Vec<Guess>>,
    /// Covariance of each field.
    pub covariances: Vec<Covariance>,
    /// Columns of the trend.
    pub terms: Vec<Term>,
    /// Declared columns that the readings do not determine.
    pub lost: Vec<Term>,
    /// Means at all places.
    pub data: Data,
    /// The fit: of all places, or of some that determine the trend where predictions come from neighbours.
    pub joint: Joint,
    /// Places of the fit.
    pub fitted: Option<Vec<usize>>,
    pub(crate) neighbours: Option<Neighbours>,
}

/// The columns that are not in the span of those before them, and the others.
#[must_use]
pub(crate) fn independent(campaign: &Campaign, terms: &[Term]) -> (Vec<Term>, Vec<Term>) {
    let (mut kept, mut lost) = (Vec::new(), Vec::new());
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for term in terms {
        let rows = campaign.place_of.iter().zip(&campaign.time);
        let column: Vec<f64> = rows
            .flat_map(|(place, time)| {
                let adds = term.at(&campaign.volume, campaign.places_mm[*place], *time);
                campaign.measured.iter().map(move |axis| adds[*axis])
            })
            .collect();
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
pub(crate) fn prior(campaign: &Campaign, data: &Data) -> Prior {
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
    for known in basis(design).1 {
        let share = known.dot(&left);
        left.axpy(-share, &known, 1.0);
    }
    left.norm_squared()
}

/// Families that may be taken.
#[must_use]
pub(crate) fn families(kriging: &Kriging) -> Vec<Family> {
    // A smooth and a rough one first: the others begin at the better of them.
    const ORDER: [Family; 5] =
        [Family::Matern52, Family::Matern32, Family::Gaussian, Family::Exponential, Family::Spherical];
    kriging.variogram.family().map_or_else(|| ORDER.to_vec(), |family| vec![family])
}

/// Places that covariances are estimated from: all, or some at random, which show ranges, and dense clusters around some of these. Only
/// the clusters show how smooth the field is between the places that a prediction is made from.
#[must_use]
pub(crate) fn estimated_from(campaign: &Campaign) -> Option<Vec<usize>> {
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
pub(crate) fn solve(campaign: &Campaign, config: &SpatialErrorConfig, added: &[Term]) -> Result<Solution> {
    let wanted: Vec<Term> = config.declared_terms().into_iter().chain(added.iter().copied()).collect();
    let (terms, lost) = independent(campaign, &wanted);
    has_enough(campaign, config, &terms)?;
    if let Some(covariance) = config.kriging.fixed() {
        no_contradiction(campaign, &covariance)?;
        let (guesses, covariances) = (Vec::new(), vec![covariance; campaign.measured.len()]);
        return complete(campaign, config, CovarianceFit { estimate: None, guesses, covariances, terms, lost });
    }
    let some = estimated_from(campaign);
    let data = campaign.data(&terms, some.as_deref());
    let prior = prior(campaign, &data);
    let likely = most_likely(&data, &prior, &families(&config.kriging), Criterion::Restricted, None);
    let Likely { estimate, guesses, .. } = likely.ok_or_else(|| {
        let problem = "no covariance with a positive definite matrix was found".to_owned();
        Error::new("estimate the covariance of", &campaign.file, problem)
            .help("are places or readings far out of their usual size? `kriging` takes a covariance of your own")
    })?;
    let covariances = estimate.covariances.clone();
    let estimate = Some(estimate);
    complete(campaign, config, CovarianceFit { estimate, guesses, covariances, terms, lost })
}

/// Covariances and columns, without the fit of all places.
pub(crate) struct CovarianceFit {
    /// Estimation of the covariances.
    pub estimate: Option<Estimate>,
    /// The best estimate of each family that was tried, of each field.
    pub guesses: Vec<Vec<Guess>>,
    /// Covariance of each field.
    pub covariances: Vec<Covariance>,
    /// Columns of the trend.
    pub terms: Vec<Term>,
    /// Declared columns that the readings do not determine.
    pub lost: Vec<Term>,
}

/// Fits the trend with known covariances.
///
/// # Errors
/// When a covariance has no positive definite matrix.
pub(crate) fn complete(campaign: &Campaign, config: &SpatialErrorConfig, found: CovarianceFit) -> Result<Solution> {
    let CovarianceFit { estimate, guesses, covariances, terms, lost } = found;
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
    let measured = campaign.measured.clone();
    Ok(Solution { measured, estimate, guesses, covariances, terms, lost, data, joint, fitted, neighbours })
}

fn has_enough(campaign: &Campaign, config: &SpatialErrorConfig, terms: &[Term]) -> Result<()> {
    let count = campaign.places_mm.len();
    let fixed = config.kriging.fixed().is_some();
    let of_trend = terms.len().div_ceil(campaign.measured.len());
    let needed = if fixed { of_trend } else { FEWEST.max(of_trend + 4) };
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
