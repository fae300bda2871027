//! Minimum zone, inscribed and circumscribed cylinder: exchange among few points, then an evaluation of all.

use nalgebra::{DMatrix, DVector};

use super::{
    Cylinder, Points, Reference, Touch, Undetermined,
    columns::{Axis, Columns},
};
use runout_numerics::{
    chebyshev::{Chebyshev, Contact, Optimum},
    cloud::Cloud,
};

/// Blocks of neighbouring points, of which the highest and lowest are evaluated first.
const BLOCKS: usize = 512;
/// All of so few points are chosen.
const FEW: usize = 256;
/// Share of the zone's width in what MICY and MCCY minimise: it chooses one of the axes that have the extreme radius.
const SHARE: f64 = 1e-3;
/// Multipliers of the region's limits above this: the axis is not stationary.
const ADRIFT: f64 = 1e-3;
/// Linear problems of one set of chosen points, evaluations of all points, and steps of Newton's method, before giving up.
const MOST_STEPS: usize = 200;
const MOST_LOOKS: usize = 100;
const MOST_NEWTON: usize = 12;

/// Downhill from `start`: the deviations of some points are made linear in the axis, the linear problem is solved exactly
/// by exchange within a region that shrinks where the true merit does not follow, and all points are evaluated for those
/// that the chosen ones missed. (Sequential linear programming: Fletcher, *Practical Methods of Optimization*, 1987, 14.4,
/// with his second-order correction.) Where fewer contacts than unknowns hold the axis and curvature does the rest, Newton's
/// method solves the contacts' balance (Hald, Madsen, *Math. Program.* 20 (1981) 49).
pub(super) fn search(points: &Points, start: Axis, reference: Reference) -> Result<Cylinder, Undetermined> {
    let weights = match reference {
        Reference::MaximumInscribed => [SHARE, 1.0 + SHARE],
        Reference::MinimumCircumscribed => [1.0 + SHARE, SHARE],
        Reference::MinimumZone | Reference::LeastSquares => [1.0, 1.0],
    };
    let (held, chebyshev) = (Columns::default(), Chebyshev::new(true, true));
    let mut search = Search { points, weights, chosen: vec![], held, deviations: vec![], chebyshev };
    let tolerance = points.tolerance();
    let (_, at_start) = search.grow(&start, f64::INFINITY, f64::NEG_INFINITY);
    let mut axis = start;
    for _ in 0..MOST_LOOKS {
        let held = search.descend(&mut axis, &start);
        let (low, high) = search.extremes(&axis);
        let (grown, merit) = search.grow(&axis, low - tolerance, high + tolerance);
        if grown {
            // The chosen points did not hold it.
            if merit > at_start {
                axis = start;
            }
            continue;
        }
        if search.is_far(&axis, &start) {
            return Err(Undetermined::NotBounded);
        }
        let held = held.ok_or(Undetermined::NotFound)?;
        if adrift(&held) > ADRIFT || merit > at_start + tolerance {
            return Err(Undetermined::NotFound);
        }
        let deviation = match reference {
            Reference::MaximumInscribed => low,
            Reference::MinimumCircumscribed => high,
            Reference::MinimumZone | Reference::LeastSquares => 0.5 * (low + high),
        };
        let touches = held.iter().filter_map(|(contact, multiplier)| {
            let (point, outer) = match contact {
                Contact::Outer(point) => (*point, true),
                Contact::Inner(point) => (*point, false),
                Contact::Least(_) | Contact::Most(_) => return None,
            };
            (*multiplier > 0.0).then(|| Touch { point: search.chosen[point], outer, multiplier: *multiplier })
        });
        return Ok(points.about(axis, deviation, touches.collect()));
    }
    Err(Undetermined::NotFound)
}

/// What holds an axis, each with its multiplier.
type Contacts = [(Contact, f64); 6];

/// The largest multiplier of a limit: how steep the merit still is.
fn adrift(held: &Contacts) -> f64 {
    let limits = held.iter().filter(|(contact, _)| matches!(contact, Contact::Least(_) | Contact::Most(_)));
    limits.map(|(_, multiplier)| *multiplier).fold(0.0, f64::max)
}

struct Search<'a> {
    points: &'a Points,
    /// Of the highest and of the lowest deviation in the merit, weights[0] · high − weights[1] · low.
    weights: [f64; 2],
    /// Points that may touch, and these points themselves.
    chosen: Vec<usize>,
    held: Columns,
    /// Of all points, about the axis last evaluated; its memory is used again.
    deviations: Vec<f64>,
    chebyshev: Chebyshev<4, 6>,
}

impl Search<'_> {
    /// Adds all of few points, of many of each block the point highest above `high` and the one lowest below `low`; whether
    /// any was new, and the merit of all points.
    fn grow(&mut self, axis: &Axis, low: f64, high: f64) -> (bool, f64) {
        let before = self.chosen.len();
        let mut deviations = std::mem::take(&mut self.deviations);
        self.points.held.fill(&self.points.frame(axis), &mut deviations);
        if before == 0 && deviations.len() <= FEW {
            self.points.there().for_each(|point| self.choose(point));
        }
        let length = if deviations.len() <= FEW { deviations.len() } else { deviations.len().div_ceil(BLOCKS).max(4) };
        let (mut lowest_of_all, mut highest_of_all) = (f64::INFINITY, f64::NEG_INFINITY);
        for (block, start) in deviations.chunks(length.max(1)).zip((0..).step_by(length.max(1))) {
            let (mut lowest, mut highest) = ((f64::INFINITY, None), (f64::NEG_INFINITY, None));
            // Comparisons with NaN are false: what is not there changes nothing.
            for (point, deviation) in (start..).zip(block) {
                if *deviation < lowest.0 {
                    lowest = (*deviation, Some(point));
                }
                if *deviation > highest.0 {
                    highest = (*deviation, Some(point));
                }
            }
            (lowest_of_all, highest_of_all) = (lowest_of_all.min(lowest.0), highest_of_all.max(highest.0));
            let lowest = lowest.1.filter(|_| lowest.0 < low || before == 0);
            let highest = highest.1.filter(|_| highest.0 > high || before == 0);
            for point in [highest, lowest].into_iter().flatten() {
                if !self.chosen.contains(&point) {
                    self.choose(point);
                }
            }
        }
        self.deviations = deviations;
        (self.chosen.len() > before, self.weights[0] * highest_of_all - self.weights[1] * lowest_of_all)
    }

    fn choose(&mut self, point: usize) {
        self.chosen.push(point);
        self.held.push(self.points.held.at(point));
    }

    /// Lowest and highest deviation of the chosen points.
    fn extremes(&self, axis: &Axis) -> (f64, f64) {
        let deviations = self.held.deviations(&self.points.frame(axis)).into_iter();
        deviations.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| (low.min(d), high.max(d)))
    }

    fn merit(&self, axis: &Axis) -> f64 {
        let (low, high) = self.extremes(axis);
        self.weights[0] * high - self.weights[1] * low
    }

    /// Whether the axis has left the wall.
    fn is_far(&self, axis: &Axis, start: &Axis) -> bool {
        !(0..4).all(|k| (axis[k] - start[k]).abs() < self.points.radius_um)
    }

    fn cost(&self) -> [f64; 6] {
        [0.0, 0.0, 0.0, 0.0, self.weights[0], -self.weights[1]]
    }

    /// The linear problem about an axis, within `reach` of it.
    fn linear(&mut self, cloud: &Cloud<4>, reach: f64) -> Option<Optimum<4, 6>> {
        self.chebyshev.solve(cloud, &self.cost(), &[(-reach, reach); 4], self.points.tolerance())
    }

    fn linearise(&self, axis: &Axis, cloud: &mut Cloud<4>) {
        cloud.clear();
        let frame = self.points.frame(axis);
        for point in 0..self.held.len() {
            let (deviation, slopes) = frame.with_slopes(self.held.at(point));
            cloud.push(slopes.map(|slope| -slope), deviation);
        }
    }

    /// Moves the axis to the best place for the chosen points; what holds it there.
    fn descend(&mut self, axis: &mut Axis, start: &Axis) -> Option<Contacts> {
        let tolerance = self.points.tolerance();
        let mut merit = self.merit(axis);
        // Deviations of this size bring the axis no farther, and the linear problem is good to size²/R.
        let mut reach = 4.0 * self.points.span_um + tolerance;
        let (mut cloud, mut corrected) = (Cloud::default(), Cloud::default());
        let (mut held, mut at_balance) = (None, f64::INFINITY);
        for _ in 0..MOST_STEPS {
            self.linearise(axis, &mut cloud);
            let Some(optimum) = self.linear(&cloud, reach) else {
                reach *= 0.25;
                if reach < tolerance {
                    break;
                }
                continue;
            };
            held = Some(optimum.contacts);
            let promised = merit - optimum.cost;
            if promised <= tolerance {
                break;
            }
            let mut next: Axis = std::array::from_fn(|k| axis[k] + optimum.place[k]);
            let mut better = self.merit(&next);
            if merit - better < 0.75 * promised {
                // The same slopes with the levels that the step turned out to have.
                corrected.clear();
                for (index, deviation) in self.held.deviations(&self.points.frame(&next)).into_iter().enumerate() {
                    let level = deviation + cloud.level_under(index, &optimum.place);
                    corrected.push(cloud.features(index), level);
                }
                if let Some(second) = self.linear(&corrected, reach) {
                    let corrected: Axis = std::array::from_fn(|k| axis[k] + second.place[k]);
                    let merit = self.merit(&corrected);
                    if merit < better {
                        (next, better) = (corrected, merit);
                    }
                }
            }
            let gained = merit - better;
            if gained > 0.0 {
                (*axis, merit) = (next, better);
            }
            if self.is_far(axis, start) {
                return held;
            }
            if gained < 0.25 * promised {
                if merit < at_balance - tolerance
                    && let Some((balanced, contacts)) = self.balance(axis, &optimum.contacts)
                {
                    at_balance = self.merit(&balanced);
                    if at_balance <= merit + tolerance {
                        (*axis, merit, held) = (balanced, at_balance, Some(contacts));
                    }
                }
                reach *= 0.25;
                if reach < tolerance {
                    break;
                }
            } else if gained > 0.75 * promised {
                reach *= 2.0;
            }
        }
        held
    }

    /// Newton's method on the balance of these contacts: Σ ±λg = 0, λ of each side add up to its weight, and all deviations
    /// of a side are equal. `None` where it does not converge near the axis with λ ≥ 0.
    fn balance(&self, axis: &Axis, contacts: &Contacts) -> Option<(Axis, Contacts)> {
        let points = self.points;
        let mut held: Vec<(usize, bool, f64)> = Vec::new();
        for (contact, multiplier) in contacts {
            let (point, outer) = match contact {
                Contact::Outer(point) => (*point, true),
                Contact::Inner(point) => (*point, false),
                Contact::Least(_) | Contact::Most(_) => continue,
            };
            if *multiplier > 1e-9 * self.weights[usize::from(!outer)] {
                held.push((point, outer, *multiplier));
            }
        }
        let unknowns = 6 + held.len();
        let (mut place, step) = (*axis, 1e-4 * points.radius_um);
        let (mut low, mut high) = self.extremes(axis);
        let mut last = f64::INFINITY;
        for _ in 0..MOST_NEWTON {
            let mut jacobian = DMatrix::<f64>::zeros(unknowns, unknowns);
            let mut right = DVector::<f64>::zeros(unknowns);
            (right[4], right[5]) = (-self.weights[0], -self.weights[1]);
            for (index, (point, outer, multiplier)) in held.iter().enumerate() {
                let (row, side) = (6 + index, if *outer { 4 } else { 5 });
                let sign = if *outer { 1.0 } else { -1.0 };
                let (deviation, slopes) = points.with_slopes(self.chosen[*point], &place);
                for k in 0..4 {
                    right[k] += sign * multiplier * slopes[k];
                    jacobian[(k, row)] = sign * slopes[k];
                    jacobian[(row, k)] = slopes[k];
                    let slopes_at = |by: f64| {
                        let mut moved = place;
                        moved[k] += by;
                        points.with_slopes(self.chosen[*point], &moved).1
                    };
                    let (ahead, behind) = (slopes_at(step), slopes_at(-step));
                    for l in 0..4 {
                        jacobian[(l, k)] += sign * multiplier * (ahead[l] - behind[l]) / (2.0 * step);
                    }
                }
                right[side] += multiplier;
                jacobian[(side, row)] = 1.0;
                jacobian[(row, side)] = -1.0;
                right[row] = deviation - if *outer { high } else { low };
            }
            let solution = jacobian.full_piv_lu().solve(&right)?;
            (0..4).for_each(|k| place[k] -= solution[k]);
            high -= solution[4];
            low -= solution[5];
            held.iter_mut().enumerate().for_each(|(index, held)| held.2 -= solution[6 + index]);
            let moved = (0..4).map(|k| solution[k].abs()).fold(0.0, f64::max);
            if !moved.is_finite() || moved > 8.0 * points.span_um + points.tolerance() {
                return None;
            }
            // Below this, rounding of the slopes moves it.
            if moved <= points.tolerance() || (moved >= 0.5 * last && moved < 1e-6 * points.span_um) {
                break;
            }
            last = moved;
        }
        if held.iter().any(|(_, _, multiplier)| *multiplier < 0.0) {
            return None;
        }
        let contact = |(point, outer, multiplier): &(usize, bool, f64)| {
            (if *outer { Contact::Outer(*point) } else { Contact::Inner(*point) }, *multiplier)
        };
        let mut found = [(Contact::Least(0), 0.0); 6];
        found.iter_mut().zip(&held).for_each(|(found, held)| *found = contact(held));
        Some((place, found))
    }
}
