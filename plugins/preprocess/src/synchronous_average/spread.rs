//! How far turns lie apart in what they say of the axis's motion: lowest and highest at each angle, in one pass.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::f64::consts::TAU;

use runout_core::{
    numerics::lanes::{NullaryFnOnce, load, vectorised},
    separation::Quantity,
    spread::{Direction, Projection, Spread},
};

use super::level::Levelled;

/// Motion of the axis in one turn after the other.
pub(super) struct Motion {
    projection: Projection,
    /// Channels and weights of each motion.
    weights: Vec<Vec<(usize, f64)>>,
    angles: usize,
    /// Of one turn, `[motion][angle]`.
    values: Vec<f64>,
}

impl Motion {
    /// For turns on `angles` equal angles with these sensors; `None` where one that it takes is missing.
    pub(super) fn new(projection: &Projection, sensors: &[usize], angles: usize) -> Option<Self> {
        let channel = |(sensor, weight): &(usize, f64)| {
            sensors.iter().position(|found| found == sensor).map(|channel| (channel, *weight))
        };
        let row = |(_, weights): &(Quantity, Vec<(usize, f64)>)| weights.iter().map(channel).collect();
        let weights: Option<Vec<Vec<(usize, f64)>>> = projection.rows.iter().map(row).collect();
        let weights = weights.filter(|rows| !rows.is_empty())?;
        let values = vec![0.0; weights.len() * angles];
        Some(Self { projection: projection.clone(), weights, angles, values })
    }

    /// The motion of a turn, `[motion][angle]`, from its readings, `[channel][angle]`.
    pub(super) fn of_turn(&mut self, readings: &[f64]) -> &[f64] {
        let angles = self.angles;
        for (target, weights) in self.values.chunks_exact_mut(angles).zip(&self.weights) {
            target.fill(0.0);
            for (channel, weight) in weights {
                let readings = &readings[channel * angles..(channel + 1) * angles];
                target.iter_mut().zip(readings).for_each(|(to, reading)| *to += weight * reading);
            }
        }
        &self.values
    }

    /// Extremes of no turn yet.
    pub(super) fn spread(&self) -> Extremes {
        let rows = &self.projection.rows;
        let place = |wanted: Quantity| rows.iter().position(|(quantity, _)| *quantity == wanted);
        let places = |direction: Direction| {
            let (first, second) = direction.parts();
            Some(match second {
                None => (direction, place(first)?, None),
                Some((second, factor)) => (direction, place(first)?, Some((place(second)?, factor))),
            })
        };
        let directions: Vec<Place> = self.projection.directions().into_iter().filter_map(places).collect();
        let angle = |step: usize| self.projection.rotation * TAU * step as f64 / self.angles as f64;
        let length = directions.len() * self.angles;
        let along = |(row, (quantity, _)): (usize, &(Quantity, _))| quantity.is_axial().then_some(row);
        Extremes {
            levelled: Levelled::new(rows.iter().enumerate().filter_map(along).collect(), self.angles),
            cos: (0..self.angles).map(|step| angle(step).cos()).collect(),
            sin: (0..self.angles).map(|step| angle(step).sin()).collect(),
            directions,
            turns: 0,
            low: vec![f64::INFINITY; length],
            high: vec![f64::NEG_INFINITY; length],
            squares: Vec::new(),
            sum: vec![0.0; rows.len() * self.angles],
            projection: self.projection.clone(),
        }
    }
}

/// Points that are evaluated together.
const LANES: usize = 8;

/// Takes a turn in one direction into the lowest and the highest at each angle, and gives the sum of its squares.
struct Widening<'a> {
    low: &'a mut [f64],
    high: &'a mut [f64],
    first: &'a [f64],
    /// Of a direction that turns: a factor of the second motion, cos and sin of the angle, and that motion.
    turned: Option<(f64, [&'a [f64]; 3])>,
}

impl NullaryFnOnce for Widening<'_> {
    type Output = f64;

    #[inline(always)]
    fn call(self) -> f64 {
        let Self { low, high, first, turned } = self;
        let mut squares = [0.0; LANES];
        let whole = first.len() - first.len() % LANES;
        for offset in (0..whole).step_by(LANES) {
            let mut values: [f64; LANES] = load(first, offset);
            if let Some((factor, columns)) = turned {
                let [cos, sin, second]: [[f64; LANES]; 3] = columns.map(|column| load(column, offset));
                for lane in 0..LANES {
                    values[lane] = cos[lane] * values[lane] + factor * sin[lane] * second[lane];
                }
            }
            let (mut lows, mut highs): ([f64; LANES], [f64; LANES]) = (load(low, offset), load(high, offset));
            for lane in 0..LANES {
                squares[lane] += values[lane] * values[lane];
                lows[lane] = if values[lane] < lows[lane] { values[lane] } else { lows[lane] };
                highs[lane] = if values[lane] > highs[lane] { values[lane] } else { highs[lane] };
            }
            low[offset..offset + LANES].copy_from_slice(&lows);
            high[offset..offset + LANES].copy_from_slice(&highs);
        }
        let mut squares: f64 = squares.iter().sum();
        for point in whole..first.len() {
            let value = match turned {
                Some((factor, [cos, sin, second])) => cos[point] * first[point] + factor * sin[point] * second[point],
                None => first[point],
            };
            squares += value * value;
            (low[point], high[point]) = (low[point].min(value), high[point].max(value));
        }
        squares
    }
}

/// A direction, the motion that counts and with which factor another one.
type Place = (Direction, usize, Option<(usize, f64)>);

/// Lowest and highest turn at each angle, and the sum of all.
pub(super) struct Extremes {
    projection: Projection,
    /// Turns that wait for their level along the axis, where that is among the motions.
    levelled: Option<Levelled>,
    directions: Vec<Place>,
    cos: Vec<f64>,
    sin: Vec<f64>,
    turns: usize,
    /// `[direction][angle]`.
    low: Vec<f64>,
    high: Vec<f64>,
    /// Of each direction, over all turns and angles.
    squares: Vec<f64>,
    /// `[motion][angle]`.
    sum: Vec<f64>,
}

impl Extremes {
    /// Takes the motion of a turn, `[motion][angle]`.
    pub(super) fn add(&mut self, motion: &[f64]) {
        match &mut self.levelled {
            None => self.take(motion),
            Some(levelled) => {
                levelled.add(motion);
                self.take_levelled(false);
            }
        }
    }

    fn take_levelled(&mut self, end: bool) {
        while let Some(motion) = self.levelled.as_mut().and_then(|levelled| levelled.next(end)) {
            self.take(&motion);
        }
    }

    fn take(&mut self, motion: &[f64]) {
        self.turns += 1;
        self.sum.iter_mut().zip(motion).for_each(|(sum, value)| *sum += value);
        let angles = self.cos.len();
        self.squares.resize(self.directions.len(), 0.0);
        let extremes = self.low.chunks_exact_mut(angles).zip(self.high.chunks_exact_mut(angles)).zip(&mut self.squares);
        for ((_, first, second), ((low, high), squares)) in self.directions.iter().zip(extremes) {
            let row = |row: usize| &motion[row * angles..(row + 1) * angles];
            let turned = second.map(|(second, factor)| (factor, [&self.cos[..], &self.sin, row(second)]));
            *squares += vectorised(Widening { low, high, first: row(*first), turned });
        }
    }

    /// Extremes about the mean; `None` below two turns.
    pub(super) fn spread(mut self) -> Option<Spread> {
        self.take_levelled(true);
        if self.turns < 2 {
            return None;
        }
        let angles = self.cos.len();
        let share = 1.0 / self.turns as f64;
        let extremes = self.low.chunks_exact_mut(angles).zip(self.high.chunks_exact_mut(angles)).zip(&mut self.squares);
        for ((_, first, second), ((low, high), squares)) in self.directions.iter().zip(extremes) {
            let sum = |row: usize, angle: usize| self.sum[row * angles + angle];
            for (angle, (low, high)) in low.iter_mut().zip(high).enumerate() {
                let mean = share
                    * match second {
                        None => sum(*first, angle),
                        Some((second, factor)) => {
                            self.cos[angle] * sum(*first, angle) + factor * self.sin[angle] * sum(*second, angle)
                        }
                    };
                *low -= mean;
                *high -= mean;
                *squares -= self.turns as f64 * mean * mean;
            }
            *squares /= ((self.turns - 1) * angles) as f64;
        }
        Some(Spread {
            projection: self.projection,
            directions: self.directions.iter().map(|(direction, ..)| *direction).collect(),
            angles,
            turns: self.turns,
            low: self.low,
            high: self.high,
            variance: self.squares,
        })
    }
}
