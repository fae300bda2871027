//! Component errors of the axes as curves at nodes, and what they leave of the error of the machine.
//!
//! The trend is placement and all 18 curves of the chain, smooth between nodes; the field beside it is what a chain of rigid bodies does
//! not describe, with its covariance estimated anew (restricted likelihood). The curves are those of the least-squares projection of the
//! predicted error, over the measured volume, on a chain whose curves are linear between nodes, as controls interpolate: the best that
//! the axes can do. Linear in the prediction, they have its
//! covariance. A value is observable where it does not change along any direction that displaces no reading.

mod values;
mod volumetric;

use nalgebra::{DMatrix, DVector, SymmetricEigen};
use runout_core::component_curves::{Carries, Location, Node, symbols};

use crate::{
    campaign::Campaign,
    config::{Curves, SpatialErrorConfig},
    likelihood::{Criterion, estimate},
    solve::{CovarianceFit, Solution, complete, independent, prior},
    terms::{Between, Term, Volume},
    whole::Whole,
};
pub(crate) use values::Volumetric;

/// Places of the projection.
const PLACES: usize = 400;
/// Parameters at most.
const MOST: usize = 1000;
/// Fewest places within the hull.
const FEWEST: usize = 60;
/// Eigenvalue of the readings' normal equations, as a share of the largest, of a direction that displaces no reading.
const UNSEEN: f64 = 1e-11;
/// Share of a value along such a direction that makes it not observable.
const DEPENDS: f64 = 1e-4;

/// Component curves of a machine.
pub(crate) struct ComponentFit {
    pub nodes: Vec<Node>,
    pub location: Vec<Location>,
    pub volumetric: Volumetric,
    /// What should be known of them.
    pub notes: Vec<String>,
}

/// Columns of the trend: placement, what varies in time or within a pitch, and all nodes.
struct Basis {
    terms: Vec<Term>,
    /// Place of the first node of X, Y, Z.
    first: [usize; 3],
    /// Nodes of X, Y, Z.
    counts: [usize; 3],
    volume: Volume,
}

impl Basis {
    fn new(volume: Volume, solution: &Solution, curves: Curves) -> Self {
        let mut terms: Vec<Term> = [0, 1, 2].map(Term::Shift).into();
        terms.extend([0, 1, 2].map(Term::Turn));
        let beside =
            |term: &&Term| term.moves_in_time() || matches!(term, Term::Pitch { .. } | Term::PitchSlope { .. });
        terms.extend(solution.terms.iter().filter(beside));
        let counts = [0, 1, 2].map(|axis| {
            let steps = (2.0 * volume.half_mm[axis] / curves.pitch_mm[axis]).round().max(1.0) as usize;
            if volume.half_mm[axis] > 0.0 { steps + 1 } else { 1 }
        });
        let mut first = [0; 3];
        for axis in 0..3 {
            first[axis] = terms.len();
            let nodes = counts[axis];
            for error in 0..6 {
                let (rotates, along) = (error >= 3, error % 3);
                let between = Between::Cubic;
                terms.extend((0..nodes).map(|node| Term::Node { rotates, along, axis, node, nodes, between }));
            }
        }
        Self { terms, first, counts, volume }
    }

    fn column(&self, axis: usize, error: usize, node: usize) -> usize {
        self.first[axis] + error * self.counts[axis] + node
    }

    /// Position of a node, in mm.
    fn position_mm(&self, axis: usize, node: usize) -> f64 {
        let share = 2.0 * node as f64 / (self.counts[axis] - 1).max(1) as f64 - 1.0;
        self.volume.middle_mm[axis] + share * self.volume.half_mm[axis]
    }
}

/// Fits the curves. The reason where there are none.
pub(crate) fn component_fit(
    campaign: &Campaign,
    solution: &Solution,
    config: &SpatialErrorConfig,
    factors: [f64; 3],
) -> Result<ComponentFit, String> {
    let Some(curves) = config.curves else { return Err(String::new()) };
    // The curves are of the measured point: an arm of the tool displaces it as functions of one axis do.
    let campaign = Campaign { volume: Volume { tool_mm: [0.0; 3], ..campaign.volume.clone() }, ..campaign.clone() };
    let basis = Basis::new(campaign.volume.clone(), solution, curves);
    if basis.terms.len() > MOST {
        let problem =
            format!("no component curves: `curves.pitch_mm` gives {} parameters, at most {MOST}", basis.terms.len());
        return Err(problem + " are fitted; take a wider pitch");
    }
    let (terms, lost) = independent(&campaign, &basis.terms);
    let readings = campaign.places_mm.len() * campaign.measured.len();
    if terms.len() + 10 > readings {
        return Err(format!(
            "no component curves: {readings} mean readings do not determine {} nodes; take a wider `curves.pitch_mm`, or measure more places",
            terms.len()
        ));
    }
    let fitted = refit(&campaign, solution, config, terms, lost).ok_or("no component curves: the fit has no result")?;
    let places = places(&campaign);
    let whole = Whole::new(&campaign, &fitted, &places, factors);
    let unseen = Unseen::new(&campaign, &basis.terms);
    values::evaluate(&basis, &campaign, &fitted, &places, &whole, &unseen)
        .ok_or_else(|| "no component curves: the projection has no result".to_owned())
}

/// The fit with these columns: families and first covariances are those of the solution.
fn refit(
    campaign: &Campaign,
    solution: &Solution,
    config: &SpatialErrorConfig,
    terms: Vec<Term>,
    lost: Vec<Term>,
) -> Option<Solution> {
    let estimated = solution.estimate.as_ref().and_then(|start| {
        let some = crate::solve::estimated_from(campaign);
        let data = campaign.data(&terms, some.as_deref());
        let families: Vec<_> = solution.covariances.iter().map(|covariance| covariance.family).collect();
        estimate(&data, &families, &prior(campaign, &data), &start.parameters, Criterion::Restricted)
    });
    let covariances = match &estimated {
        Some(estimate) => estimate.covariances.clone(),
        None => solution.covariances.clone(),
    };
    complete(campaign, config, CovarianceFit { estimate: estimated, guesses: Vec::new(), covariances, terms, lost })
        .ok()
}

/// Places over the measured volume (Halton's sequence), within the hull; the measured ones where that leaves few.
fn places(campaign: &Campaign) -> Vec<[f64; 3]> {
    let radical = |mut index: usize, base: usize| {
        let (mut value, mut step) = (0.0, 1.0);
        while index > 0 {
            step /= base as f64;
            value += step * (index % base) as f64;
            index /= base;
        }
        2.0 * value - 1.0
    };
    let volume = &campaign.volume;
    let place = |index: usize| {
        [0, 1, 2].map(|axis| volume.middle_mm[axis] + volume.half_mm[axis] * radical(index + 1, [2, 3, 5][axis]))
    };
    let inside = |place: &[f64; 3]| campaign.span.holds(*place) && !campaign.span.is_outside(*place);
    let all: Vec<[f64; 3]> = (0..PLACES).map(place).filter(inside).collect();
    if all.len() >= FEWEST {
        return all;
    }
    campaign.places_mm.iter().copied().take(PLACES).collect()
}

/// Directions of the columns that displace no reading.
struct Unseen {
    scale: DVector<f64>,
    directions: DMatrix<f64>,
}

impl Unseen {
    fn new(campaign: &Campaign, terms: &[Term]) -> Self {
        let rows: Vec<(usize, f64)> = campaign.place_of.iter().copied().zip(campaign.time.iter().copied()).collect();
        let mut gram = DMatrix::<f64>::zeros(terms.len(), terms.len());
        for rows in rows.chunks(256) {
            let mut part = DMatrix::zeros(rows.len() * campaign.measured.len(), terms.len());
            for (column, term) in terms.iter().enumerate() {
                for (row, (place, time)) in rows.iter().enumerate() {
                    let adds = term.at(&campaign.volume, campaign.places_mm[*place], *time);
                    for (field, axis) in campaign.measured.iter().enumerate() {
                        part[(row * campaign.measured.len() + field, column)] = adds[*axis];
                    }
                }
            }
            gram += part.tr_mul(&part);
        }
        let scale = gram.diagonal().map(|square| if square > 0.0 { square.sqrt() } else { 1.0 });
        let scaled = DMatrix::from_fn(terms.len(), terms.len(), |row, column| {
            gram[(row, column)] / (scale[row] * scale[column])
        });
        let eigen = SymmetricEigen::new(scaled);
        let least = UNSEEN * eigen.eigenvalues.max();
        let unseen: Vec<usize> = (0..terms.len()).filter(|index| eigen.eigenvalues[*index] <= least).collect();
        Self { scale, directions: eigen.eigenvectors.select_columns(&unseen) }
    }

    /// Whether a combination of the columns' parameters is observable.
    fn shows(&self, combination: &DVector<f64>) -> bool {
        let scaled = combination.component_div(&self.scale);
        self.directions.tr_mul(&scaled).norm() <= DEPENDS * scaled.norm()
    }
}

/// Nodes and location errors of the chain, with values and standard uncertainties in order: six errors a node, and three angles.
fn named(basis: &Basis, chain: [usize; 3], values: &[[f64; 2]]) -> (Vec<Node>, Vec<Location>) {
    let at_mm = basis.volume.middle_mm;
    let mut nodes = Vec::new();
    let mut from = 0;
    let mut of_axis: [Vec<Node>; 3] = Default::default();
    for (axis, list) in of_axis.iter_mut().enumerate() {
        let count = basis.counts[axis];
        for node in 0..count {
            let of = |part: usize| std::array::from_fn(|error| values[from + error * count + node][part]);
            let mut at_mm = at_mm;
            at_mm[axis] = basis.position_mm(axis, node);
            list.push(Node {
                axis: ["X", "Y", "Z"][axis].to_owned(),
                carries: Carries::Tool,
                position: at_mm[axis],
                at_mm,
                errors: of(0),
                std: of(1),
            });
        }
        from += 6 * count;
    }
    // An axis that was not moved has no curve.
    chain.iter().filter(|axis| basis.counts[**axis] > 1).for_each(|axis| nodes.append(&mut of_axis[*axis]));
    let location = values::ANGLES.iter().zip(&values[from..]);
    let location =
        location.map(|(symbol, [value, std])| Location { symbol: (*symbol).into(), value: *value, std: *std });
    (nodes, location.collect())
}

/// Curves that are not observable at a node or more.
fn lost(nodes: &[Node]) -> Vec<String> {
    let mut all: Vec<String> = Vec::new();
    for node in nodes {
        for (symbol, value) in symbols(&node.axis).into_iter().zip(node.errors) {
            if value.is_nan() && !all.contains(&symbol) {
                all.push(symbol);
            }
        }
    }
    all
}
