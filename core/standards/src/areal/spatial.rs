//! Spatial parameters (ISO 25178-2:2021, 4.3).

use super::{
    HeightMap,
    correlation::{Correlation, Line, correlate},
    direction::Directions,
};

/// Lengths and direction of the texture.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Spatial {
    /// Autocorrelation length: shortest lag at which the autocorrelation has fallen to s. NaN where it does not.
    pub sal_mm: f64,
    /// Texture aspect ratio: shortest over longest lag of that. NaN where the autocorrelation does not fall to s within
    /// the map in some direction.
    pub str: f64,
    /// Texture direction: where the angular power spectrum ∫ r·|F|² dr is largest, in steps of 0.5° from +x (the columns)
    /// towards +y (the rows), 0 to below 180°. It is the direction across a lay.
    pub std_deg: f64,
    /// Dominant wavelength: of the largest amplitude in the spectrum.
    pub ssw_mm: f64,
}

impl Spatial {
    /// Nothing known.
    pub const NONE: Self = Self { sal_mm: f64::NAN, str: f64::NAN, std_deg: f64::NAN, ssw_mm: f64::NAN };

    /// Of a map with mean 0. The autocorrelation is over the pairs of measured points at each lag (unbiased); around a
    /// closed map it is circular. For the spectrum, missing points lie on the mean.
    pub(super) fn of(centred: &HeightMap, decay: f64) -> Self {
        let heights = centred.heights_um();
        let lengths = [centred.columns() as f64 * centred.dx_mm(), centred.rows() as f64 * centred.dy_mm()];
        let (mut strongest, mut ssw_mm) = (0.0, f64::NAN);
        let mut look = |Line { across, along, amplitude }: Line| {
            let (fx, fy) = (across as f64 / lengths[0], along as f64 / lengths[1]);
            if across == 0 && along == 0 {
                return;
            }
            if amplitude > strongest {
                (strongest, ssw_mm) = (amplitude, fx.hypot(fy).recip());
            }
        };
        let zeroed: Vec<f64>;
        let missing = centred.missing() > 0;
        let filled = if missing {
            zeroed = heights.iter().map(|height| if height.is_finite() { *height } else { 0.0 }).collect();
            &zeroed
        } else {
            heights
        };
        let mut sums = correlate(centred, filled, &mut look);
        let std_deg = Directions::new(centred).direction_deg(filled);
        if missing {
            let mask: Vec<f64> = heights.iter().map(|height| f64::from(u8::from(height.is_finite()))).collect();
            let mut pairs = correlate(centred, &mask, |_| ());
            for lag in 0..centred.rows() {
                for (sum, pairs) in sums.row(lag).iter_mut().zip(pairs.row(lag)) {
                    // Numbers of pairs are whole, but for rounding.
                    *sum = if *pairs > 0.5 { *sum / pairs.round() } else { 0.0 };
                }
            }
        }
        let [sal_mm, longest_mm] = Decay::new(centred, &mut sums, !missing, decay).lengths();
        Self { sal_mm, str: sal_mm / longest_mm, std_deg, ssw_mm }
    }
}

/// Rows of an autocorrelation.
pub(super) trait Rows {
    /// Column lags in a row.
    fn width(&self) -> usize;

    /// All lags of columns at a lag of rows: the sums of products.
    fn row(&mut self, lag: usize) -> Option<&[f64]>;
}

impl Rows for Correlation {
    fn width(&self) -> usize {
        self.width
    }

    fn row(&mut self, lag: usize) -> Option<&[f64]> {
        let row: &[f64] = Self::row(self, lag);
        Some(row)
    }
}

/// The region around lag 0 in which the autocorrelation stays above a level.
pub(super) struct Decay<'a, R> {
    map: &'a HeightMap<'a>,
    sums: &'a mut R,
    /// Whether sums are over all pairs of points, and still to be divided by their number.
    undivided: bool,
    width: usize,
    level: f64,
}

impl<'a, R: Rows> Decay<'a, R> {
    pub(super) fn new(map: &'a HeightMap<'a>, sums: &'a mut R, undivided: bool, decay: f64) -> Self {
        let width = sums.width();
        let mut found = Self { map, sums, undivided, width, level: 0.0 };
        found.level = decay * found.at(0, 0).unwrap_or(f64::NAN);
        found
    }

    /// Value at a lag of columns and rows; `None` beyond the map. A lag and its opposite have the same.
    fn at(&mut self, across: isize, along: isize) -> Option<f64> {
        let (across, along) = if along < 0 { (-across, -along) } else { (across, along) };
        let inside = self.map.closed() || across.unsigned_abs() < self.map.columns();
        let lag = along.unsigned_abs();
        if !inside || lag >= self.map.rows() {
            return None;
        }
        let sum = self.sums.row(lag)?[across.rem_euclid(self.width.cast_signed()) as usize];
        let beside = if self.map.closed() { 0 } else { across.unsigned_abs() };
        let pairs = (self.map.columns() - beside) * (self.map.rows() - lag);
        Some(if self.undivided { sum / pairs as f64 } else { sum })
    }

    /// Shortest and longest lag at which the level is reached, in mm. The shortest is NaN where it is never reached; the
    /// longest where the region reaches the end of the map, or goes all the way round.
    pub(super) fn lengths(&mut self) -> [f64; 2] {
        // A flat map has no autocorrelation.
        if self.level <= 0.0 {
            return [f64::NAN; 2];
        }
        let mut seen = vec![false; self.width * self.map.rows()];
        let mut open = vec![(0_isize, 0_isize)];
        seen[0] = true;
        let (mut shortest, mut longest) = (f64::INFINITY, 0.0_f64);
        let furthest = if self.map.closed() { self.width.cast_signed() / 2 } else { self.width.cast_signed() };
        let mut contained = true;
        while let Some((across, along)) = open.pop() {
            let here = self.at(across, along).unwrap_or(f64::NAN);
            for (dx, dy) in [(1, 0), (-1, 0), (0, 1), (0, -1)] {
                let (mut x, mut y) = (across + dx, along + dy);
                let Some(value) = self.at(x, y).filter(|_| x.abs() <= furthest) else {
                    contained = false;
                    continue;
                };
                if value <= self.level || here.is_nan() {
                    let part = self.crossing([across, along], [dx, dy], here, value);
                    let lag = ((across as f64 + part * dx as f64) * self.map.dx_mm())
                        .hypot((along as f64 + part * dy as f64) * self.map.dy_mm());
                    shortest = shortest.min(lag);
                    longest = longest.max(lag);
                    continue;
                }
                // The other half plane is this one's mirror image.
                if y < 0 {
                    (x, y) = (-x, -y);
                }
                let place = y.unsigned_abs() * self.width + x.rem_euclid(self.width.cast_signed()) as usize;
                if !std::mem::replace(&mut seen[place], true) {
                    open.push((x, y));
                }
            }
        }
        [if shortest.is_finite() { shortest } else { f64::NAN }, if contained { longest } else { f64::NAN }]
    }

    /// Where between two neighbouring lags the level is passed, 0 to 1: on the cubic through these and one beyond each,
    /// by bisection; on a straight line at the map's end.
    fn crossing(&mut self, [x, y]: [isize; 2], [dx, dy]: [isize; 2], here: f64, there: f64) -> f64 {
        let ends = self.at(x - dx, y - dy).zip(self.at(x + 2 * dx, y + 2 * dy));
        let Some((before, beyond)) = ends else { return (here - self.level) / (here - there) };
        let cubic = |t: f64| {
            -before * t * (t - 1.0) * (t - 2.0) / 6.0 + here * (t + 1.0) * (t - 1.0) * (t - 2.0) / 2.0
                - there * (t + 1.0) * t * (t - 2.0) / 2.0
                + beyond * (t + 1.0) * t * (t - 1.0) / 6.0
        };
        let (mut above, mut below) = (0.0, 1.0);
        for _ in 0..30 {
            let middle = 0.5 * (above + below);
            if cubic(middle) > self.level { above = middle } else { below = middle }
        }
        0.5 * (above + below)
    }
}
