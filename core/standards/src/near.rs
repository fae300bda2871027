//! Profiles and walls whose errors are drawn again and again: only points that may come to touch are evaluated.
//!
//! Between points and the same points with errors of at most e, about references whose centres are c apart, no deviation
//! changes by more than e + |c|. A reference through the points that were near the ends before is therefore that of all points
//! where the others were further away than that; where they were not, all have to be evaluated.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use runout_numerics::lanes::{NullaryFnOnce, load, vectorised};

/// Points within this many times the usual largest error of the ends are evaluated.
const MARGIN: f64 = 4.0;
/// Points that are evaluated together: as many as fill two wide registers, which do not wait for each other.
const LANES: usize = 16;

/// The points that may come to touch.
#[derive(Debug, Clone)]
pub(super) struct NearContacts {
    /// Their places, ascending.
    pub points: Vec<usize>,
    /// Lowest and highest deviation from the nominal radius.
    ends_um: [f64; 2],
    margin_um: f64,
}

impl NearContacts {
    /// From deviations about a reference whose radius exceeds the nominal one by `level_um`; missing points are NaN.
    /// `usual_um` is about the largest error of a draw.
    pub(crate) fn new(deviations_um: &[f64], level_um: f64, usual_um: f64) -> Self {
        let DeviationSpread { low, high, .. } = DeviationSpread::of(deviations_um.iter().copied());
        let margin_um = MARGIN * usual_um;
        let is_near = |point: &usize| {
            let deviation = deviations_um[*point];
            deviation < low + margin_um || deviation > high - margin_um
        };
        let points = (0..deviations_um.len()).filter(is_near).collect();
        Self { points, ends_um: [low + level_um, high + level_um], margin_um }
    }

    /// Whether no other point can touch: the ends are now there, the centre has moved by so much, no error is larger.
    pub(crate) fn suffice(&self, ends_um: [f64; 2], moved_um: f64, largest_um: f64) -> bool {
        let nearer = (ends_um[0] - self.ends_um[0]).max(self.ends_um[1] - ends_um[1]).max(0.0);
        nearer + moved_um + largest_um <= self.margin_um
    }
}

/// What deviations come to.
#[derive(Debug, Clone, Copy)]
pub(super) struct DeviationSpread {
    pub low: f64,
    pub high: f64,
    /// Sum of squares.
    pub squares: f64,
    /// How many there are.
    pub points: usize,
}

impl DeviationSpread {
    /// Missing values are NaN, and so are the ends where nothing is there.
    pub(crate) fn of(deviations: impl Iterator<Item = f64>) -> Self {
        let (mut low, mut high, mut squares, mut points) = (f64::INFINITY, f64::NEG_INFINITY, 0.0, 0);
        for deviation in deviations.filter(|deviation| !deviation.is_nan()) {
            (low, high) = (low.min(deviation), high.max(deviation));
            squares += deviation * deviation;
            points += 1;
        }
        if points == 0 {
            (low, high) = (f64::NAN, f64::NAN);
        }
        Self { low, high, squares, points }
    }

    /// Of two parts together.
    pub(crate) fn and(self, other: Self) -> Self {
        Self {
            low: self.low.min(other.low),
            high: self.high.max(other.high),
            squares: self.squares + other.squares,
            points: self.points + other.points,
        }
    }

    /// Root mean square.
    pub(crate) fn rms(&self) -> f64 {
        (self.squares / self.points as f64).sqrt()
    }

    /// Of drawn values less what they are above their deviations; none is missing.
    pub(crate) fn less(drawn: &[f64], offset: &[f64]) -> Self {
        vectorised(Differences { drawn, offset })
    }
}

/// A profile less another one. Draws ask for its course many thousand times.
struct Differences<'a> {
    drawn: &'a [f64],
    offset: &'a [f64],
}

impl NullaryFnOnce for Differences<'_> {
    type Output = DeviationSpread;

    #[inline(always)]
    fn call(self) -> DeviationSpread {
        let Self { drawn, offset } = self;
        let (mut low, mut high, mut squares) = ([f64::INFINITY; LANES], [f64::NEG_INFINITY; LANES], [0.0; LANES]);
        let (mut rest_low, mut rest_high, mut rest_squares) = (f64::INFINITY, f64::NEG_INFINITY, 0.0);
        let points = drawn.len().min(offset.len());
        let whole = points - points % LANES;
        for place in (0..whole).step_by(LANES) {
            let [drawn, offset]: [[f64; LANES]; 2] = [load(drawn, place), load(offset, place)];
            for lane in 0..LANES {
                let deviation = drawn[lane] - offset[lane];
                low[lane] = if deviation < low[lane] { deviation } else { low[lane] };
                high[lane] = if deviation > high[lane] { deviation } else { high[lane] };
                squares[lane] += deviation * deviation;
            }
        }
        for (drawn, offset) in drawn[whole..points].iter().zip(&offset[whole..points]) {
            let deviation = drawn - offset;
            (rest_low, rest_high) = (rest_low.min(deviation), rest_high.max(deviation));
            rest_squares += deviation * deviation;
        }
        DeviationSpread {
            low: rest_low.min(folded(low, f64::min)),
            high: rest_high.max(folded(high, f64::max)),
            squares: rest_squares + folded(squares, |one, other| one + other),
            points,
        }
    }
}

/// All lanes in one, each half with the other.
#[inline(always)]
fn folded(mut lanes: [f64; LANES], with: impl Fn(f64, f64) -> f64) -> f64 {
    let mut half = LANES;
    while half > 1 {
        half /= 2;
        for lane in 0..half {
            lanes[lane] = with(lanes[lane], lanes[lane + half]);
        }
    }
    lanes[0]
}
