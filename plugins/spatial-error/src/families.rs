//! Family of each component's covariance.
//!
//! Each component is first estimated by itself in every family, beside the columns of the trend that act on it: how smooth one component
//! is says nothing of another. All are then estimated together with the trend that they share, each in its most likely family.

use faer::Mat;
use nalgebra::{DMatrix, DVector, SymmetricEigen};

use crate::{
    correlation::Family,
    joint::{Covariance, Data, Within},
    likelihood::{Criterion, Estimate, PARAMETERS, Prior, covariances, estimate},
};

/// Share of a column outside the span of those before it, below which it is none of its own.
pub(crate) const INDEPENDENT: f64 = 1e-6;

/// Parameters of a family's most likely covariance of one component.
#[derive(Debug, Clone)]
pub(crate) struct Guess {
    /// The family.
    pub family: Family,
    /// As in an [`Estimate`], of this component.
    pub parameters: DVector<f64>,
    /// ln of likelihood and prior of this component by itself.
    pub ln_likelihood: f64,
    /// Covariance of the parameters.
    pub covariance: DMatrix<f64>,
}

/// Families with less ln of the evidence than the best one by this are left out.
const UNLIKELY: f64 = 4.0;

impl Guess {
    /// The covariance.
    pub(crate) fn field(&self) -> Option<Covariance> {
        covariances(&[self.family], &self.parameters).first().copied()
    }

    /// ln of likelihood and prior times the volume of parameters that are as likely.
    fn ln_evidence(&self) -> f64 {
        let sizes = SymmetricEigen::new(self.covariance.clone()).eigenvalues;
        self.ln_likelihood + 0.5 * sizes.iter().filter(|size| **size > 0.0).map(|size| size.ln()).sum::<f64>()
    }
}

/// The likely guesses of one component, the most likely one first, with the probability of each.
#[must_use]
pub(crate) fn likely(guesses: &[Guess]) -> Vec<(&Guess, f64)> {
    let mut all: Vec<(&Guess, f64)> = guesses.iter().map(|guess| (guess, guess.ln_evidence())).collect();
    let best = all.iter().map(|(_, ln)| *ln).fold(f64::NEG_INFINITY, f64::max);
    all.retain(|(_, ln)| *ln > best - UNLIKELY);
    all.sort_by(|one, other| other.0.ln_likelihood.total_cmp(&one.0.ln_likelihood));
    let whole: f64 = all.iter().map(|(_, ln)| (ln - best).exp()).sum();
    all.into_iter().map(|(guess, ln)| (guess, (ln - best).exp() / whole)).collect()
}

/// The most likely covariances.
#[derive(Debug, Clone)]
pub(crate) struct Likely {
    /// Family of each component.
    pub families: Vec<Family>,
    /// The estimate of all components together.
    pub estimate: Estimate,
    /// Every family that was tried, of each component; the best one with the parameters of the estimate.
    pub guesses: Vec<Vec<Guess>>,
}

/// The most likely family of each component, and the most likely covariances in these.
#[must_use]
pub(crate) fn most_likely(
    data: &Data,
    prior: &Prior,
    families: &[Family],
    criterion: Criterion,
    start: Option<(&[Family], &DVector<f64>)>,
) -> Option<Likely> {
    let mut guesses: Vec<Vec<Guess>> = Vec::new();
    let mut best = Vec::new();
    for field in 0..data.observed.len() {
        let start = start.map(|(families, parameters)| (families[field], part(parameters, field)));
        let all = each_family(&alone(data, field), &prior.of(field), families, criterion, start.as_ref());
        let likelihood = |index: &usize| all[*index].ln_likelihood;
        best.push((0..all.len()).max_by(|one, other| likelihood(one).total_cmp(&likelihood(other)))?);
        guesses.push(all);
    }
    let chosen = || guesses.iter().zip(&best).map(|(all, best)| &all[*best]);
    let families: Vec<Family> = chosen().map(|guess| guess.family).collect();
    let from: Vec<f64> = chosen().flat_map(|guess| guess.parameters.iter().copied()).collect();
    let estimate = estimate(data, &families, prior, &DVector::from_vec(from), criterion)?;
    for (field, (all, best)) in guesses.iter_mut().zip(best).enumerate() {
        let first = field * PARAMETERS;
        all[best].parameters = part(&estimate.parameters, field);
        all[best].covariance = estimate.covariance.view((first, first), (PARAMETERS, PARAMETERS)).into_owned();
    }
    Some(Likely { families, estimate, guesses })
}

/// 2ΔlnL of a field's most likely covariance in any family against the most likely one with a nugget of `nugget_um` that is smooth.
#[must_use]
pub(crate) fn gain_of_nugget(
    data: &Data,
    prior: &Prior,
    field: usize,
    families: &[Family],
    nugget_um: f64,
    smooth: &dyn Fn(&Covariance) -> bool,
) -> f64 {
    let (data, free) = (alone(data, field), prior.of(field));
    let mut fixed = free.clone();
    (fixed.centre[PARAMETERS - 1], fixed.precision[PARAMETERS - 1]) = (nugget_um.ln(), f64::INFINITY);
    let best = |prior: &Prior, wanted: &dyn Fn(&Covariance) -> bool| {
        let all = each_family(&data, prior, families, Criterion::Restricted, None);
        let wanted = all.into_iter().filter(|guess| guess.field().is_some_and(|covariance| wanted(&covariance)));
        wanted.map(|guess| guess.ln_likelihood).fold(f64::NEG_INFINITY, f64::max)
    };
    2.0 * (best(&free, &|_| true) - best(&fixed, smooth))
}

fn part(parameters: &DVector<f64>, field: usize) -> DVector<f64> {
    parameters.rows(field * PARAMETERS, PARAMETERS).into_owned()
}

/// One field, with the columns of the trend that act on it.
fn alone(data: &Data, field: usize) -> Data {
    let design = &data.design[field];
    let (kept, _) = basis(design);
    let within = data.within.as_ref().map(|within| Within {
        design: within.design.select_rows(&kept).select_columns(&kept),
        readings: within.readings.select_rows(&kept),
        squares: within.squares,
        dof: within.dof,
    });
    Data {
        places: data.places.clone(),
        observed: vec![data.observed[field].clone()],
        design: vec![faer::Mat::from_fn(design.nrows(), kept.len(), |row, column| design[(row, kept[column])])],
        within,
    }
}

/// The most likely covariance of one field in each family. A family begins at the best one before it.
fn each_family(
    data: &Data,
    prior: &Prior,
    families: &[Family],
    criterion: Criterion,
    start: Option<&(Family, DVector<f64>)>,
) -> Vec<Guess> {
    let mut all: Vec<Guess> = Vec::new();
    let moved = |from: &DVector<f64>, by: f64| {
        let shift = |index: usize, value: f64| {
            let is_range = (1..4).contains(&index) && prior.precision[index].is_finite();
            if is_range { value + by } else { value }
        };
        DVector::from_fn(from.len(), |index, _| shift(index, from[index]))
    };
    let first = start.map(|(family, _)| *family);
    for family in first.iter().chain(families.iter().filter(|family| first != Some(**family))) {
        let best = all.iter().max_by(|one, other| one.ln_likelihood.total_cmp(&other.ln_likelihood));
        let starts = match (best, start) {
            (Some(best), _) => vec![moved(&best.parameters, (reach(best.family) / reach(*family)).ln())],
            (None, Some((known, from))) => vec![moved(from, (reach(*known) / reach(*family)).ln())],
            (None, None) => vec![prior.centre.clone(), moved(&prior.centre, 0.9)],
        };
        let found = starts.iter().filter_map(|start| estimate(data, &[*family], prior, start, criterion));
        let found = found.reduce(|best, next| if next.ln_likelihood > best.ln_likelihood { next } else { best });
        all.extend(found.map(|found| Guess {
            family: *family,
            parameters: found.parameters,
            ln_likelihood: found.ln_likelihood,
            covariance: found.covariance,
        }));
    }
    all
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

/// Columns that are not in the span of those before them, and an orthonormal basis of all.
#[must_use]
pub(crate) fn basis(design: &Mat<f64>) -> (Vec<usize>, Vec<DVector<f64>>) {
    let (mut kept, mut basis): (Vec<usize>, Vec<DVector<f64>>) = (Vec::new(), Vec::new());
    for column in 0..design.ncols() {
        let mut own = DVector::from_fn(design.nrows(), |row, _| design[(row, column)]);
        let whole = own.norm();
        for known in basis.iter().chain(&basis) {
            let share = known.dot(&own);
            own.axpy(-share, known, 1.0);
        }
        let size = own.norm();
        if size > INDEPENDENT * whole && size > 0.0 {
            basis.push(own / size);
            kept.push(column);
        }
    }
    (kept, basis)
}
