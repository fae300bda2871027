//! Minimum zone, inscribed and circumscribed cylinder: exchange among few points, then a look at all.

use super::{Cylinder, Points, Reference, Touch, points::Axis};
use crate::numerics::{
    chebyshev::{Chebyshev, Contact, Optimum},
    cloud::Cloud,
};

/// Blocks of neighbouring points, of which the highest and lowest are looked at first.
const BLOCKS: usize = 512;
/// Multipliers of the region's limits above this: the axis was still running away.
const ADRIFT: f64 = 1e-3;
/// Linear problems of one set of chosen points, and looks at all points, before giving up.
const MOST_STEPS: usize = 500;

/// Downhill from `start`: the deviations of some points are made linear in the axis, the linear problem is solved exactly
/// by exchange within a region that shrinks where the true merit does not follow, and all points are looked at for those
/// that the chosen ones missed. (Sequential linear programming: Fletcher, *Practical Methods of Optimization*, 1987,
/// 14.4.) `N` is 6 with both bounds, 5 with one.
pub(super) fn search<const N: usize>(points: &Points, start: Axis, reference: Reference) -> Option<Cylinder> {
    let outer = reference != Reference::MaximumInscribed;
    let inner = reference != Reference::MinimumCircumscribed;
    let mut search = Search { points, outer, inner, chosen: vec![], chebyshev: Chebyshev::<4, N>::new(outer, inner) };
    let mut axis = start;
    let tolerance = points.tolerance();
    search.grow(&axis, f64::INFINITY, f64::NEG_INFINITY);
    for _ in 0..MOST_STEPS {
        let optimum = search.descend(&mut axis)?;
        let (low, high) = search.extremes(&axis);
        if search.grow(&axis, low - tolerance, high + tolerance) {
            continue;
        }
        let limits =
            optimum.contacts.iter().filter(|(contact, _)| matches!(contact, Contact::Least(_) | Contact::Most(_)));
        if limits.map(|(_, multiplier)| *multiplier).any(|multiplier| multiplier > ADRIFT) {
            return None;
        }
        let deviation = match (outer, inner) {
            (true, true) => 0.5 * (low + high),
            (true, false) => high,
            _ => low,
        };
        let touches = optimum.contacts.iter().filter_map(|(contact, multiplier)| {
            let (point, outer) = match contact {
                Contact::Outer(point) => (*point, true),
                Contact::Inner(point) => (*point, false),
                Contact::Least(_) | Contact::Most(_) => return None,
            };
            (*multiplier > 0.0).then_some(Touch { point: search.chosen[point], outer, multiplier: *multiplier })
        });
        return Some(points.about(axis, deviation, touches.collect()));
    }
    None
}

struct Search<'a, const N: usize> {
    points: &'a Points,
    outer: bool,
    inner: bool,
    /// Points that may touch.
    chosen: Vec<usize>,
    chebyshev: Chebyshev<4, N>,
}

impl<const N: usize> Search<'_, N> {
    /// Adds of each block the point highest above `high` and the one lowest below `low`; whether any was new.
    fn grow(&mut self, axis: &Axis, low: f64, high: f64) -> bool {
        let deviations: Vec<f64> = (0..self.points.len()).map(|point| self.points.deviation(point, axis)).collect();
        let before = self.chosen.len();
        let length = deviations.len().div_ceil(BLOCKS).max(4);
        for (block, start) in deviations.chunks(length).zip((0..).step_by(length)) {
            let there = || block.iter().enumerate().filter(|(_, deviation)| !deviation.is_nan());
            let highest = there().max_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, d)| self.outer && **d > high);
            let lowest = there().min_by(|a, b| a.1.total_cmp(b.1)).filter(|(_, d)| self.inner && **d < low);
            for point in [highest, lowest].into_iter().flatten().map(|(index, _)| start + index) {
                if !self.chosen.contains(&point) {
                    self.chosen.push(point);
                }
            }
        }
        self.chosen.len() > before
    }

    /// Lowest and highest deviation of the chosen points.
    fn extremes(&self, axis: &Axis) -> (f64, f64) {
        let deviations = self.chosen.iter().map(|point| self.points.deviation(*point, axis));
        deviations.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), d| (low.min(d), high.max(d)))
    }

    fn merit(&self, axis: &Axis) -> f64 {
        let (low, high) = self.extremes(axis);
        f64::from(u8::from(self.outer)) * high - f64::from(u8::from(self.inner)) * low
    }

    /// Moves the axis to the best place for the chosen points; the linear problem there.
    fn descend(&mut self, axis: &mut Axis) -> Option<Optimum<4, N>> {
        let tolerance = self.points.tolerance();
        let mut cost = [0.0; N];
        if self.outer {
            cost[4] = 1.0;
        }
        if self.inner {
            cost[N - 1] = -1.0;
        }
        let mut merit = self.merit(axis);
        // Deviations of this size bring the axis no farther, and the linear problem is good to size²/R.
        let mut reach = 4.0 * self.points.span_um + tolerance;
        let mut cloud = Cloud::default();
        let mut best = None;
        for _ in 0..MOST_STEPS {
            cloud.clear();
            for point in &self.chosen {
                let (deviation, slopes) = self.points.with_slopes(*point, axis);
                cloud.push(slopes.map(|slope| -slope), deviation);
            }
            let optimum = self.chebyshev.solve(&cloud, &cost, &[(-reach, reach); 4], tolerance)?;
            let next: Axis = std::array::from_fn(|k| axis[k] + optimum.place[k]);
            let (better, promised) = (self.merit(&next), merit - optimum.cost);
            let gained = merit - better;
            best = Some(optimum);
            if gained > 0.0 {
                (*axis, merit) = (next, better);
            }
            if promised <= tolerance {
                break;
            }
            if gained < 0.25 * promised {
                reach *= 0.25;
            } else if gained > 0.75 * promised {
                reach *= 2.0;
            }
        }
        best
    }
}
