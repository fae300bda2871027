//! The turns of a capture as a whole, and in parts where asked for.

use runout_core::{
    Complex64,
    consistency::turns::TurnTable,
    neighbours::Neighbours,
    profile::{Part, Split, TURN_ORDERS, TurnLevels, Turns},
    spread::Spread,
};

use super::{low_orders::LowOrders, mean::Mean, size::Size, spread::Extremes, turns::Turn};

/// Turns that are summed together at most: the sums are then read and written once for all of them.
const TOGETHER: usize = 4;
/// Memory that turns may take up which wait for others, in numbers.
const WAITING: usize = 1 << 17;
/// Turns a channel whose harmonics are evaluated, at least, where there are as many: what weights ask for.
const LOOKED_AT_A_CHANNEL: usize = 10;

/// The mean of all turns, and of parts of them; how far turns lie apart.
pub(super) struct Means {
    pub whole: Mean,
    parts: Option<Parts>,
    extremes: Option<Extremes>,
    /// Readings of the turns that are in no sum yet, `[turn][channel][angle]`, with room for the next one.
    waiting: Vec<f64>,
    /// Readings of one turn.
    readings: usize,
    /// Turns that are in no sum yet.
    pending: usize,
    /// Of so many turns, one is evaluated.
    stride: usize,
    levels: TurnLevels,
    low_orders: LowOrders,
}

struct Parts {
    /// How many turns are fitted.
    fitted: usize,
    fit: Mean,
    held_out: Mean,
    turns: Turns,
}

impl Means {
    /// For `planned` turns at most; the last ones of a share are held out.
    pub(crate) fn new(size: Size, planned: usize, held_out: Option<f64>, extremes: Option<Extremes>) -> Self {
        let parts = held_out.filter(|_| planned >= 4).map(|share| {
            let last = ((share * planned as f64).round() as usize).clamp(2, planned - 2);
            let fitted = planned - last;
            let kept = size.orders.min(TURN_ORDERS);
            Parts {
                fitted,
                fit: Mean::new(size, fitted),
                held_out: Mean::new(size, last),
                turns: Turns {
                    spans: Vec::with_capacity(planned),
                    numbers: Vec::with_capacity(planned),
                    orders: kept,
                    channels: size.channels,
                    harmonics: Vec::with_capacity(planned * kept * size.channels),
                },
            }
        });
        let stride = planned / (LOOKED_AT_A_CHANNEL * size.channels);
        let readings = size.readings();
        let together = (WAITING / readings.max(1)).clamp(1, TOGETHER);
        Self {
            whole: Mean::new(size, planned),
            parts,
            extremes,
            waiting: vec![0.0; together * readings],
            readings,
            pending: 0,
            stride: stride.max(1),
            levels: TurnLevels::default(),
            low_orders: LowOrders::new(size, planned),
        }
    }

    /// Turns taken.
    pub(crate) fn turns(&self) -> usize {
        self.whole.turns() + self.pending
    }

    /// Where the next turn's readings are to be put, `[channel][angle]`.
    pub(crate) fn next(&mut self) -> &mut [f64] {
        &mut self.waiting[self.pending * self.readings..][..self.readings]
    }

    /// Whether the harmonics of the next turn are evaluated: parts take each turn, the whole at as many of them as without parts,
    /// so that it is the same.
    pub(crate) fn looks_at_next(&self) -> bool {
        self.parts.is_some() || self.whole_looks_at_next()
    }

    fn whole_looks_at_next(&self) -> bool {
        self.turns().is_multiple_of(self.stride)
    }

    /// Takes a turn, whose readings are where the [next](Self::next) turn's are to be, with its
    /// harmonics, `[channel][order]`, and its motion.
    pub(crate) fn add(&mut self, turn: &Turn, harmonics: &[Complex64], motion: &[f64]) {
        let looked_at = self.whole_looks_at_next();
        let taken = self.turns();
        let readings = &self.waiting[self.pending * self.readings..][..self.readings];
        self.levels.numbers.push(turn.number);
        self.low_orders.take(turn.number, readings, &mut self.levels.levels_um);
        self.pending += 1;
        if looked_at {
            self.whole.look_at(harmonics);
        }
        let mut full = self.pending * self.readings == self.waiting.len();
        if let Some(Parts { fitted, fit, held_out, turns }) = &mut self.parts {
            let part = if taken < *fitted { fit } else { held_out };
            part.look_at(harmonics);
            turns.numbers.push(turn.number);
            turns.spans.push([turn.start, turn.end]);
            let orders = harmonics.len() / turns.channels;
            turns.harmonics.extend((0..turns.orders).flat_map(|order| harmonics[order..].iter().step_by(orders)));
            full |= taken + 1 == *fitted;
        }
        if let Some(extremes) = &mut self.extremes {
            extremes.add(motion);
        }
        if full {
            self.sum_up();
        }
    }

    /// Takes the turns that wait into the sums; to be called after the last one.
    pub(crate) fn sum_up(&mut self) {
        let turns = &self.waiting[..self.pending * self.readings];
        if turns.is_empty() {
            return;
        }
        if let Some(Parts { fitted, fit, held_out, .. }) = &mut self.parts {
            let part = if self.whole.turns() < *fitted { fit } else { held_out };
            part.add(turns);
        }
        self.whole.add(turns);
        self.pending = 0;
    }

    /// How far the turns lie apart, where wanted.
    pub(crate) fn spread(&mut self) -> Option<Spread> {
        self.extremes.take().and_then(Extremes::spread)
    }

    /// Mean levels of the turns taken.
    pub(crate) fn levels(&mut self) -> TurnLevels {
        std::mem::take(&mut self.levels)
    }

    /// Low orders of the turns taken.
    pub(crate) fn low_orders(&mut self) -> TurnTable {
        self.low_orders.table()
    }

    /// The scatter without what the covariance is taken from.
    pub(crate) fn scatter_beside(&self) -> Option<Vec<Complex64>> {
        self.whole.scatter_beside()
    }

    /// The parts, beside the neighbours of the whole; `None` where too few turns are left to fill them.
    pub(crate) fn split(&self, neighbours: Option<&Neighbours>) -> Option<Split> {
        let parts = self.parts.as_ref().filter(|parts| parts.held_out.turns() > 0)?;
        let fitted = parts.fit.turns();
        let part = |mean: &Mean, turns| {
            let neighbours = mean.neighbours();
            Part {
                mean: mean.mean(),
                covariance: mean.covariance(neighbours.as_ref()),
                scatter: mean.scatter(),
                neighbours,
                turns,
            }
        };
        Some(Split {
            fit: part(&parts.fit, 0..fitted),
            held_out: part(&parts.held_out, fitted..fitted + parts.held_out.turns()),
            neighbours: neighbours.cloned(),
            turns: parts.turns.clone(),
        })
    }
}

/// Leaves out the orders from `orders` on.
pub(super) fn truncate(split: &mut Split, orders: usize, channels: usize) {
    let parts = [&mut split.fit.neighbours, &mut split.held_out.neighbours, &mut split.neighbours];
    for coefficients in parts.into_iter().flatten().flat_map(|neighbours| &mut neighbours.coefficients) {
        coefficients.truncate(orders * channels);
    }
    for part in [&mut split.fit, &mut split.held_out] {
        part.mean.truncate(orders * channels);
        for matrices in [&mut part.covariance, &mut part.scatter].into_iter().flatten() {
            matrices.truncate(orders * channels * channels);
        }
    }
    let turns = &mut split.turns;
    if orders < turns.orders {
        let kept = turns.harmonics.chunks(turns.orders * channels).flat_map(|turn| &turn[..orders * channels]);
        turns.harmonics = kept.copied().collect();
        turns.orders = orders;
    }
}
