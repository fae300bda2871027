//! Minimum zone and maximum inscribed circle: exchange among few points, then an evaluation of all.

use super::{Circle, Points, Undetermined, equal_heights::equal_heights, least_squares::guess};
use runout_numerics::{
    chebyshev::{Chebyshev, Contact},
    cloud::Cloud,
};

/// Blocks of neighbouring points, of which the highest and lowest are evaluated first.
const BLOCKS: usize = 64;
/// All of so few points are chosen.
const FEW: usize = 128;
/// Steps downhill among the chosen points, and evaluations of all points, before giving up.
const MOST_STEPS: usize = 200;
/// Deviations from this share of the radius on may have several local optima.
const WIDE: f64 = 0.02;
/// Places in each direction of the grid on which starts are sought, and starts at most.
const GRID: usize = 25;
const MOST_STARTS: usize = 24;
/// Triples of so few points are all evaluated.
const FEW_TRIPLES: usize = 24;
/// Inscribed circles that are compared where the profile has two nearly opposite contacts.
const MOST_NEIGHBOURS: usize = 16;

/// Some of the points: those that may touch.
#[derive(Debug, Default)]
pub(super) struct Chosen {
    pub(super) cloud: Cloud<2>,
    pub(super) points: Vec<usize>,
}

impl Chosen {
    /// Adds all of few points, of many of each block the highest point above `high` and the lowest below `low` over a place; whether any was new.
    pub(super) fn grow(&mut self, points: &Points, place: &[f64; 2], low: f64, high: f64) -> bool {
        let (all, before) = (&points.cloud, self.points.len());
        if before == 0 {
            self.cloud.reserve(2 * BLOCKS);
            self.points.reserve(2 * BLOCKS);
        }
        if all.len() <= FEW && before == 0 {
            for point in (0..all.len()).filter(|point| !all.levels()[*point].is_nan()) {
                self.cloud.push(all.features(point), all.levels()[point]);
                self.points.push(point);
            }
        }
        let length = all.len().div_ceil(BLOCKS).next_multiple_of(8);
        for start in (0..all.len()).step_by(length) {
            let block = start..all.len().min(start + length);
            let (lowest, highest) = all.extremes(block.clone(), place);
            for height in [(highest > high).then_some(highest), (lowest < low).then_some(lowest)].into_iter().flatten()
            {
                let point = all.find(block.clone(), place, height);
                if let Some(point) = point.filter(|point| !self.points.contains(point)) {
                    self.cloud.push(all.features(point), all.levels()[point]);
                    self.points.push(point);
                }
            }
        }
        self.points.len() > before
    }
}

/// What is sought.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Goal {
    Zone,
    Inscribed,
}

/// Where a search came to rest.
#[derive(Debug, Clone)]
struct Rest {
    place: [f64; 2],
    /// What was to become least: the zone's width, or −(ρ² − R²)/2R of the inscribed circle.
    merit: f64,
    low: f64,
    high: f64,
    /// Outer and inner contacts, ascending.
    contacts: [Vec<usize>; 2],
}

/// A search with its chosen points, which serve for several starts.
struct Search<'a, const N: usize> {
    points: &'a Points,
    goal: Goal,
    chosen: Chosen,
    chebyshev: Chebyshev<2, N>,
}

impl<'a, const N: usize> Search<'a, N> {
    fn new(points: &'a Points, goal: Goal) -> Self {
        Self { points, goal, chosen: Chosen::default(), chebyshev: Chebyshev::new(goal == Goal::Zone, true) }
    }

    fn merit(&self, place: &[f64; 2], low: f64, high: f64) -> f64 {
        let common = self.points.common(place);
        match self.goal {
            Goal::Zone => self.points.deviation(high + common) - self.points.deviation(low + common),
            Goal::Inscribed => -(low + common),
        }
    }

    fn slopes(&self, place: &[f64; 2], low: f64, high: f64) -> [f64; N] {
        slopes(self.points, self.goal, place, low, high)
    }

    /// Downhill from `start`.
    ///
    /// The bounds of the heights are linear in the centre: only their share in the merit bends. Each step minimises with
    /// the slopes at the present place, which for the inscribed circle can only improve (the merit lies below its
    /// tangent) and for a zone is shortened until it does; where the place stays, its contacts balance exactly.
    fn settle(&mut self, start: [f64; 2]) -> Result<Rest, Undetermined> {
        let (points, tolerance) = (self.points, self.points.tolerance());
        let reach = points.radius_um() + points.span_um;
        let limits = start.map(|start| (start - reach, start + reach));
        let zone = self.goal == Goal::Zone;
        let mut place = start;
        self.chosen.grow(points, &place, f64::INFINITY, if zone { f64::NEG_INFINITY } else { f64::INFINITY });
        for _ in 0..MOST_STEPS {
            let (mut low, mut high) = self.extremes(&place);
            let mut merit = self.merit(&place, low, high);
            let mut found = None;
            for _ in 0..MOST_STEPS {
                let slopes = self.slopes(&place, low, high);
                let optimum = self.chebyshev.solve(&self.chosen.cloud, &slopes, &limits, tolerance);
                let optimum = optimum.ok_or(Undetermined::NotFound)?;
                let mut next = optimum.place;
                found = Some(optimum);
                let better = loop {
                    let (low, high) = self.extremes(&next);
                    let better = self.merit(&next, low, high);
                    if !better.is_finite() {
                        return Err(Undetermined::NotFound);
                    }
                    if better <= merit + tolerance || distance(next, place) <= tolerance {
                        break (low, high, better);
                    }
                    next = [0, 1].map(|k| 0.5 * (next[k] + place[k]));
                };
                let moved = distance(next, place);
                (place, (low, high, merit)) = (next, better);
                if moved <= tolerance {
                    break;
                }
            }
            // Twice the tolerance: the exchange leaves heights within one.
            let high_bound = if zone { high + 2.0 * tolerance } else { f64::INFINITY };
            let grown = self.chosen.grow(points, &place, low - 2.0 * tolerance, high_bound);
            let contacts = self.contacts(&found.ok_or(Undetermined::NotFound)?.contacts);
            if !grown {
                let contacts = contacts.ok_or(Undetermined::NotBounded)?;
                // Downhill on the chosen points, which are not all: no end is worse than its start.
                let better = merit <= self.merit_of_all(&start) + tolerance;
                return if better {
                    Ok(Rest { place, merit, low, high, contacts })
                } else {
                    Err(Undetermined::NotFound)
                };
            }
            if contacts.is_none() {
                // Far out, for want of points that hold it.
                place = start;
            }
        }
        Err(Undetermined::NotFound)
    }

    fn merit_of_all(&self, place: &[f64; 2]) -> f64 {
        let (low, high) = self.points.cloud.extremes(0..self.points.len(), place);
        self.merit(place, low, high)
    }

    /// Places from which other optima of a profile far from a circle may be reached, the best first: those of a grid about
    /// `middle` that are better than their neighbours, and the best centres of circles through three of few points.
    fn starts(&self, middle: [f64; 2]) -> Vec<[f64; 2]> {
        let (points, half) = (self.points, (GRID / 2) as f64);
        let at = |i: usize, j: usize| {
            [(i, middle[0]), (j, middle[1])].map(|(step, middle)| middle + points.span_um * (step as f64 - half) / half)
        };
        let merits: Vec<f64> =
            (0..GRID * GRID).map(|place| self.merit_of_all(&at(place % GRID, place / GRID))).collect();
        let around = |i: usize| i.saturating_sub(1)..(i + 2).min(GRID);
        let is_best = |i: usize, j: usize| {
            around(j).all(|row| around(i).all(|column| merits[row * GRID + column] >= merits[j * GRID + i]))
        };
        let all = (0..GRID).flat_map(|j| (0..GRID).map(move |i| (i, j)));
        let mut starts: Vec<(f64, [f64; 2])> =
            all.filter(|(i, j)| is_best(*i, *j)).map(|(i, j)| (merits[j * GRID + i], at(i, j))).collect();
        if points.there() <= FEW_TRIPLES {
            let there: Vec<usize> = (0..points.len()).filter(|point| !points.cloud.levels()[*point].is_nan()).collect();
            for (a, b, c) in (0..there.len()).flat_map(|a| (0..a).flat_map(move |b| (0..b).map(move |c| (a, b, c)))) {
                let held = [there[a], there[b], there[c]];
                let far = |place: &[f64; 2]| place[0].hypot(place[1]) > points.radius_um() + points.span_um;
                if let Some(place) = equal_heights(&points.cloud, held).filter(|place| !far(place)) {
                    starts.push((self.merit_of_all(&place), place));
                }
            }
        }
        starts.sort_by(|a, b| a.0.total_cmp(&b.0));
        starts.truncate(MOST_STARTS);
        starts.into_iter().map(|(_, place)| place).collect()
    }

    /// The best of where the search comes to rest from the first guess, and of a profile far from a circle from others.
    fn best(&mut self) -> Result<Rest, Undetermined> {
        let start = guess(self.points);
        let first = self.settle(start);
        if !is_wide(self.points) {
            return first;
        }
        let mut best = first;
        for start in self.starts(start) {
            let better = |rest: &Rest| best.as_ref().map_or(true, |best| rest.merit < best.merit);
            if let Some(rest) = self.settle(start).ok().filter(better) {
                best = Ok(rest);
            }
        }
        best
    }

    fn extremes(&self, place: &[f64; 2]) -> (f64, f64) {
        self.chosen.cloud.extremes(0..self.chosen.cloud.len(), place)
    }

    /// Outer and inner contacts; `None` where only the limits of the search hold the place.
    fn contacts(&self, contacts: &[(Contact, f64); N]) -> Option<[Vec<usize>; 2]> {
        let mut found = [vec![], vec![]];
        for (contact, multiplier) in contacts {
            match contact {
                Contact::Outer(point) => found[0].push(self.chosen.points[*point]),
                Contact::Inner(point) => found[1].push(self.chosen.points[*point]),
                Contact::Least(_) | Contact::Most(_) if *multiplier > 1e-9 => return None,
                Contact::Least(_) | Contact::Most(_) => {}
            }
        }
        for points in &mut found {
            points.sort_unstable();
        }
        Some(found)
    }
}

/// Whether a profile is so far from a circle that several may be optimal.
pub(super) fn is_wide(points: &Points) -> bool {
    points.span_um >= WIDE * points.radius_um()
}

/// Derivatives of the merit by place, upper and lower bound of the heights.
fn slopes<const N: usize>(points: &Points, goal: Goal, place: &[f64; 2], low: f64, high: f64) -> [f64; N] {
    let (common, radius) = (points.common(place), points.radius_um());
    let [outer, inner] = match goal {
        Goal::Zone => [high, low].map(|level| points.stretch(level + common).max(f64::EPSILON).recip()),
        Goal::Inscribed => [0.0, 1.0],
    };
    let mut slopes = [0.0; N];
    slopes[..2].copy_from_slice(&place.map(|place| (outer - inner) * place / radius));
    slopes[2] = outer;
    slopes[N - 1] = -inner;
    slopes
}

/// Derivatives of the merit of a zone about a place: by the place, and by the upper and lower bound of the heights.
pub(super) fn zone_slopes(points: &Points, place: &[f64; 2]) -> [f64; 4] {
    let (low, high) = points.cloud.extremes(0..points.len(), place);
    slopes(points, Goal::Zone, place, low, high)
}

/// MZCI: the centre with the least difference between the largest and the smallest distance.
///
/// Two outer and two inner contacts take turns in angle (the alternation condition): with unit vectors e from the centre,
/// λe₁ + (1−λ)e₂ over the outer equals μe₃ + (1−μ)e₄ over the inner.
pub(super) fn minimum_zone(points: &Points) -> Result<Circle, Undetermined> {
    let rest = Search::<4>::new(points, Goal::Zone).best()?;
    let common = points.common(&rest.place);
    let [outer, inner] = [rest.high, rest.low].map(|level| points.deviation(level + common));
    Ok(points.about(rest.place, 0.5 * (outer + inner), rest.contacts))
}

/// MICI: the centre with the largest smallest distance; three contacts, the centre within their triangle.
///
/// Between two points that lie nearly opposite each other the centre may settle on either side of their chord, and the
/// radii differ by deviation²/2R: where the centre is that near to a chord, the other side is tried too.
pub(super) fn maximum_inscribed(points: &Points) -> Result<Circle, Undetermined> {
    let mut search = Search::<3>::new(points, Goal::Inscribed);
    let first = search.best()?;
    let (mut best, mut seen, mut open) = (first.clone(), vec![first.contacts.clone()], vec![first]);
    while let Some(rest) = open.pop() {
        for start in beyond(points, &rest) {
            let other = search.settle(start).ok().filter(|other| !seen.contains(&other.contacts));
            let Some(other) = other else { continue };
            if other.merit < best.merit {
                best = other.clone();
            }
            seen.push(other.contacts.clone());
            if seen.len() < MOST_NEIGHBOURS {
                open.push(other);
            }
        }
    }
    let deviation = points.deviation(best.low + points.common(&best.place));
    Ok(points.about(best.place, deviation, best.contacts))
}

/// Places on the far side of those edges of the contacts' triangle that are near.
fn beyond(points: &Points, rest: &Rest) -> Vec<[f64; 2]> {
    let corners = &rest.contacts[1];
    let at = |point: usize| points.cloud.features(point).map(|feature| feature * points.radius_um());
    let mut places = Vec::new();
    for (third, corner) in corners.iter().enumerate().filter(|_| corners.len() == 3) {
        let [a, b] = [corners[(third + 1) % 3], corners[(third + 2) % 3]].map(at);
        let (middle, edge) = ([0, 1].map(|k| 0.5 * (a[k] + b[k])), [b[0] - a[0], b[1] - a[1]]);
        let c = at(*corner);
        let side = edge[0] * (c[1] - a[1]) - edge[1] * (c[0] - a[0]);
        let scale = side.signum() / edge[0].hypot(edge[1]);
        let away = [edge[1] * scale, -edge[0] * scale];
        let near = distance(middle, rest.place);
        if near <= 2.0 * points.span_um {
            let step = near.max(points.span_um);
            places.push([middle[0] + away[0] * step, middle[1] + away[1] * step]);
        }
    }
    places
}

fn distance(a: [f64; 2], b: [f64; 2]) -> f64 {
    (a[0] - b[0]).hypot(a[1] - b[1])
}
