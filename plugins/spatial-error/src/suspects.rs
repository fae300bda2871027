//! What a result should not be silent about: places that err together, and a drift that is not in the model.

use nalgebra::{Cholesky, DMatrix, DVector};
use runout_core::numerics::statistics::f_tail;

use crate::{
    campaign::{COMPONENTS, Campaign},
    projections::Projections,
    solve::{Solution, independent},
    terms::Term,
};

/// Places that are left out together, of each place and so many of its nearest.
const TOGETHER: usize = 3;
const NEAREST: usize = 6;
/// Places up to which groups are evaluated.
const MOST_PLACES: usize = 1500;
/// Chance of a group, times the number of groups, below which it is named.
const CHANCE: f64 = 1e-6;
/// Degrees of freedom of the covariance that the chance of a group counts with.
const OF_COVARIANCE: f64 = 100.0;
/// χ² that a member adds to its group at least.
const OWN: f64 = 25.0;
/// Groups that are named at most.
const MOST_NAMED: usize = 3;
/// Standard deviations from which a drift is named.
const DRIFTS: f64 = 5.0;

/// Neighbouring places that err together.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Group {
    /// The places.
    pub places: Vec<usize>,
    /// Mean reading of each less what all other places predict, in µm.
    pub by_um: Vec<[f64; 3]>,
}

impl Group {
    /// The places with what they are off.
    pub(crate) fn named(&self, campaign: &Campaign) -> String {
        let each = self.places.iter().zip(&self.by_um).map(|(place, by_um)| {
            let [x, y, z] = campaign.places_mm[*place];
            format!("({x}, {y}, {z}) mm by {}", campaign.displacement(*by_um))
        });
        each.collect::<Vec<String>>().join(", ")
    }
}

/// Neighbouring places that all other places do not predict. They predict each other, so that no single one of them need be far.
pub(crate) fn groups(campaign: &Campaign, solution: &Solution) -> Vec<Group> {
    let count = campaign.places_mm.len();
    if solution.fitted.is_some() || !(3 * TOGETHER..=MOST_PLACES).contains(&count) {
        return Vec::new();
    }
    let projections = Projections::of(&solution.joint);
    let mut found: Vec<(f64, [usize; TOGETHER])> = Vec::new();
    for place in 0..count {
        let near = nearest(campaign, place);
        for (index, one) in near.iter().enumerate() {
            for other in &near[index + 1..] {
                let group = [place, *one, *other];
                let Some((chi2, _)) = left_out(&projections, &group) else { continue };
                let free = (campaign.measured.len() * TOGETHER) as f64;
                if f_tail(chi2 / free, free, OF_COVARIANCE) < CHANCE / (count * NEAREST * NEAREST / 2) as f64 {
                    found.push((chi2, group));
                }
            }
        }
    }
    found.sort_by(|one, other| other.0.total_cmp(&one.0));
    let mut named: Vec<usize> = Vec::new();
    let mut all: Vec<Group> = Vec::new();
    for (chi2, group) in found {
        if all.len() == MOST_NAMED || group.iter().any(|place| named.contains(place)) {
            continue;
        }
        // What is beside a displaced group is predicted from it.
        group.iter().for_each(|place| named.extend(nearest(campaign, *place)));
        named.extend(group);
        // Members that add nothing are only near.
        let adds = |place: &usize| {
            let rest: Vec<usize> = group.iter().copied().filter(|other| other != place).collect();
            left_out(&projections, &rest).is_none_or(|(without, _)| chi2 - without > OWN)
        };
        let places: Vec<usize> = group.iter().copied().filter(adds).collect();
        if places.len() < 2 {
            continue;
        }
        if let Some((_, residual)) = left_out(&projections, &places) {
            let by_um = (0..places.len())
                .map(|index| solution.by_axis(residual.iter().skip(index).step_by(places.len()).copied(), f64::NAN));
            all.push(Group { by_um: by_um.collect(), places });
        }
    }
    all
}

/// Places nearest to one, each axis in shares of its extent.
fn nearest(campaign: &Campaign, place: usize) -> Vec<usize> {
    let half = campaign.volume.half_mm.map(|half| if half > 0.0 { half } else { f64::INFINITY });
    let apart = |other: &usize| {
        let [one, other] = [place, *other].map(|place| campaign.places_mm[place]);
        (0..3).map(|axis| ((one[axis] - other[axis]) / half[axis]).powi(2)).sum::<f64>()
    };
    let mut others: Vec<usize> = (0..campaign.places_mm.len()).filter(|other| *other != place).collect();
    others.sort_by(|one, other| apart(one).total_cmp(&apart(other)));
    others.truncate(NEAREST);
    others
}

/// χ² of a group against all other places, and its residuals, component by component.
fn left_out(projections: &Projections, group: &[usize]) -> Option<(f64, DVector<f64>)> {
    let pull = projections.pull(group);
    let residual = Cholesky::new(projections.block(group))?.solve(&pull);
    Some((residual.dot(&pull), residual))
}

/// A drift in time that is not in the model, where places or their order separate it from errors of the axes.
pub(crate) fn drift(campaign: &Campaign, solution: &Solution) -> Option<String> {
    if solution.terms.iter().any(|term| matches!(term, Term::Drift(_))) || solution.fitted.is_some() {
        return None;
    }
    let axes = [0, 1, 2];
    let linear = axes.into_iter().flat_map(|axis| {
        [Term::Scale(axis), Term::Squareness(axis, (axis + 1) % 3), Term::Squareness(axis, (axis + 2) % 3)]
    });
    let wanted: Vec<Term> = solution.terms.iter().copied().chain(linear).chain(axes.map(Term::Drift)).collect();
    let (terms, _) = independent(campaign, &wanted);
    let (normal, right) = solution.joint.equations(&campaign.data(&terms, None));
    let scale = DMatrix::from_diagonal(&normal.diagonal().map(|entry| entry.max(f64::MIN_POSITIVE).sqrt().recip()));
    let covariance = &scale * Cholesky::new(&scale * normal * &scale)?.inverse() * &scale;
    let values = &covariance * right;
    let found: Vec<String> = terms
        .iter()
        .enumerate()
        .filter_map(|(place, term)| {
            let Term::Drift(axis) = term else { return None };
            let std = covariance[(place, place)].sqrt();
            (values[place].abs() > DRIFTS * std)
                .then(|| format!("{} by {:.2} ± {std:.2} µm", COMPONENTS[*axis], values[place]))
        })
        .collect();
    (!found.is_empty()).then(|| {
        format!(
            "readings drift from the first to the last: {}. The model has no drift: predictions are of its mean; `diagnose` adds it",
            found.join(", ")
        )
    })
}
