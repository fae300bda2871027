//! The minimum circumscribed circle.

use super::{Circle, Points, equal_heights::equal_heights, least_squares::guess, search::Chosen};

const MOST_STEPS: usize = 1000;

/// MCCI: the smallest circle around all points; two contacts opposite each other, or three of an acute triangle.
///
/// Exchange (Welzl's problem, solved as Gärtner does, *ESA* 1999): the point farthest outside enters, and the smallest
/// circle around it and the at most three points that held the last one is the next; its radius can only grow.
pub(super) fn circle(points: &Points) -> Option<Circle> {
    let start = guess(points);
    let mut chosen = Chosen::default();
    chosen.grow(points, &start, f64::NEG_INFINITY, f64::NEG_INFINITY);
    let (_, high) = chosen.cloud.extremes(0..chosen.points.len(), &start);
    let mut ball = Ball { place: start, lifted: f64::NEG_INFINITY, held: vec![] };
    let mut enters = chosen.cloud.find(0..chosen.points.len(), &start, high)?;
    for _ in 0..MOST_STEPS {
        let Some(next) = ball.with(points, &chosen, enters) else { break };
        ball = next;
        let all = 0..chosen.points.len();
        let bound = ball.lifted - points.common(&ball.place) + points.tolerance();
        let (_, mut high) = chosen.cloud.extremes(all.clone(), &ball.place);
        if high <= bound && chosen.grow(points, &ball.place, f64::NEG_INFINITY, bound) {
            (_, high) = chosen.cloud.extremes(0..chosen.points.len(), &ball.place);
        }
        if high <= bound {
            break;
        }
        enters = chosen.cloud.find(0..chosen.points.len(), &ball.place, high)?;
    }
    let mut outer: Vec<usize> = ball.held.iter().map(|point| chosen.points[*point]).collect();
    outer.sort_unstable();
    (outer.len() > 1).then(|| points.about(ball.place, points.deviation(ball.lifted), [outer, vec![]]))
}

/// A circle, (ρ² − R²)/2R of its radius, and the chosen points that hold it.
struct Ball {
    place: [f64; 2],
    lifted: f64,
    held: Vec<usize>,
}

impl Ball {
    /// The smallest circle around one more point and those that held this one; `None` where it is not larger.
    fn with(&self, points: &Points, chosen: &Chosen, enters: usize) -> Option<Self> {
        let cloud = &chosen.cloud;
        let at = |point: usize| cloud.features(point).map(|feature| feature * points.radius_um());
        let all: Vec<usize> = self.held.iter().copied().chain([enters]).collect();
        let mut best: Option<Self> = None;
        let mut offer = |place: [f64; 2], held: &[usize]| {
            let high = all.iter().map(|point| cloud.height(*point, &place)).fold(f64::NEG_INFINITY, f64::max);
            let lifted = high + points.common(&place);
            // A circle counts if it holds all; where two do, the later has to be smaller by more than rounding.
            let holds = held.iter().all(|point| high - cloud.height(*point, &place) <= points.tolerance());
            if holds && best.as_ref().is_none_or(|best| lifted < best.lifted - points.tolerance()) {
                best = Some(Self { place, lifted, held: held.to_vec() });
            }
        };
        if let [only] = all[..] {
            offer(at(only), &[only]);
        }
        let pairs = || (0..all.len()).flat_map(|j| (0..j).map(move |i| [i, j]));
        for held in pairs().map(|pair| pair.map(|i| all[i])) {
            let [a, b] = held.map(at);
            offer([0, 1].map(|k| 0.5 * (a[k] + b[k])), &held);
        }
        for [i, j] in pairs() {
            for held in (0..i).map(|k| [k, i, j].map(|i| all[i])) {
                let place = equal_heights(cloud, held).filter(|_| acute(held.map(at)));
                if let Some(place) = place {
                    offer(place, &held);
                }
            }
        }
        // Between opposite contacts a centre moves far for a growth that rounding hides.
        best.filter(|best| best.lifted > self.lifted - points.tolerance())
    }
}

/// Whether no corner's angle is above a right one: the triangle holds the centre of its circle.
fn acute([a, b, c]: [[f64; 2]; 3]) -> bool {
    let corner = |at: [f64; 2], one: [f64; 2], two: [f64; 2]| {
        (one[0] - at[0]) * (two[0] - at[0]) + (one[1] - at[1]) * (two[1] - at[1])
    };
    [corner(a, b, c), corner(b, c, a), corner(c, a, b)].iter().all(|cosine| *cosine >= 0.0)
}
