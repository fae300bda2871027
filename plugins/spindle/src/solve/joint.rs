//! The solution of all orders together, where a large eccentricity couples them.
//!
//! A surface that moves laterally by t is seen turned by t/R. Form of order n thereby goes to the orders around it by the
//! share n·e/(2R) of an eccentricity e and, where n·e/R is near to 1 or above it, to many of them. Orders solved one by one,
//! with what exact geometry adds taken from the last solution, then do not settle. Here the angles at which each line meets
//! the profile are kept (they follow from eccentricity and motion, which are known far better than a wave's length), which
//! makes readings linear in form and motion again; the weighted least squares over all orders are found by conjugate
//! gradients (CGLS: Björck, *Numerical Methods for Least Squares Problems*, 1996, algorithm 7.4.1), with the solution order
//! by order as preconditioner. New angles, and again (Gauss–Newton), until nothing moves.

use runout_core::{Complex64, numerics::fourier::Fourier, separation::Quantity};

use super::{
    algebra::apply,
    interpolation::{POINTS, weights_at},
    operators::Operators,
    second_order::OVERSAMPLING,
};
use crate::layout::Layout;

/// Steps of the conjugate gradients, at most.
const MOST_STEPS: usize = 200;
/// Steps end where the gradient is this share of the first one: the next pass, with new angles, goes on.
const SMALL: f64 = 1e-4;

/// A place between the points of a section's table, with the weights of the points around.
#[derive(Clone, Copy)]
struct Place {
    first: usize,
    weights: [f64; POINTS],
}

/// Readings over what the orders' own solutions take: linear, with the places where lines meet the profile as they are.
pub(super) struct Joint<'a> {
    layout: &'a Layout,
    operators: &'a Operators,
    max_order: usize,
    turn: Fourier,
    fine: Fourier,
    /// `[reading][angle]`: where the line meets the profile, and where it would without eccentricity and motion.
    met: Vec<Place>,
    straight: Vec<Place>,
    /// Of each order from 1: what makes its weighted readings as noisy as those of the others.
    scales: Vec<f64>,
}

impl<'a> Joint<'a> {
    /// `met_rad` are the part angles where lines meet the profile, `[reading][angle]`.
    pub(super) fn new(layout: &'a Layout, operators: &'a Operators, samples_per_rev: usize, met_rad: &[f64]) -> Self {
        let fine = Fourier::new(samples_per_rev * OVERSAMPLING);
        let place = |angle_rad: f64| {
            let (first, weights) = weights_at(fine.length(), angle_rad);
            Place { first: first % fine.length(), weights }
        };
        let straight = layout.readings.iter().flat_map(|reading| {
            (0..samples_per_rev).map(|step| layout.part_angle_rad(reading, step, samples_per_rev)).map(place)
        });
        let straight = straight.collect();
        let met = met_rad.iter().copied().map(place).collect();
        let rms = |order: usize| {
            let weights = operators.weights.as_ref()?.get(order - 1)?;
            let squares = weights.entries().iter().map(Complex64::norm_sqr).sum::<f64>();
            Some((squares / layout.readings.len().max(1) as f64).sqrt()).filter(|rms| *rms > 0.0)
        };
        let max_order = operators.orders.len();
        Self {
            layout,
            operators,
            max_order,
            turn: Fourier::new(samples_per_rev),
            fine,
            met,
            straight,
            scales: (1..=max_order).map(|order| rms(order).map_or(1.0, f64::recip)).collect(),
        }
    }

    /// The change of the readings order by order, `[order][reading]` from order 0, whose own solutions are together nearest
    /// to a change of all readings.
    pub(super) fn solve(&mut self, change: &[Complex64]) -> Vec<Complex64> {
        let mut left = self.weighted(change);
        let mut solution = vec![Complex64::ZERO; change.len()];
        let mut gradient = self.backward(&left);
        let mut direction = gradient.clone();
        let mut square = norm_sqr(&gradient);
        let enough = SMALL * SMALL * square;
        for _ in 0..MOST_STEPS {
            if square <= enough || square == 0.0 {
                break;
            }
            let ahead = self.forward(&direction);
            let length = norm_sqr(&ahead);
            if length == 0.0 {
                break;
            }
            let step = square / length;
            solution.iter_mut().zip(&direction).for_each(|(value, direction)| *value += direction * step);
            left.iter_mut().zip(&ahead).for_each(|(value, ahead)| *value -= ahead * step);
            gradient = self.backward(&left);
            let next = norm_sqr(&gradient);
            let ratio = next / square;
            direction.iter_mut().zip(&gradient).for_each(|(value, gradient)| *value = gradient + *value * ratio);
            square = next;
        }
        self.scale(&mut solution);
        solution
    }

    fn scale(&self, values: &mut [Complex64]) {
        let count = self.layout.readings.len();
        for (row, scale) in values.chunks_exact_mut(count).skip(1).zip(&self.scales) {
            for value in row {
                *value *= *scale;
            }
        }
    }

    /// W times readings; order 0 is in no equation.
    fn weighted(&self, readings: &[Complex64]) -> Vec<Complex64> {
        let count = self.layout.readings.len();
        let mut weighted = readings.to_vec();
        weighted[..count].fill(Complex64::ZERO);
        if let Some(weights) = &self.operators.weights {
            for (row, weights) in weighted.chunks_exact_mut(count).skip(1).zip(weights) {
                row.copy_from_slice(&weights.times(row, 1));
            }
        }
        weighted
    }

    /// Weighted readings of the orders' own solutions of `readings`.
    fn forward(&mut self, readings: &[Complex64]) -> Vec<Complex64> {
        let mut scaled = readings.to_vec();
        self.scale(&mut scaled);
        let count = self.layout.readings.len();
        let width = self.layout.unknowns.len();
        let mut found = vec![Complex64::ZERO; readings.len()];
        let mut unknowns = vec![Complex64::ZERO; (self.max_order + 1) * width];
        for order in 1..=self.max_order {
            let row = order * count..(order + 1) * count;
            let solution = apply(&self.operators.orders[order - 1].operator, &scaled[row.clone()]);
            found[row].copy_from_slice(&apply(&self.operators.systems[order - 1].matrix, &solution));
            if order > 1 {
                unknowns[order * width..(order + 1) * width].copy_from_slice(&solution);
            }
        }
        let samples = self.turn.length();
        let mut curve = vec![0.0; samples];
        let mut harmonics = vec![Complex64::ZERO; self.max_order + 1];
        for (unknown, section) in sections(self.layout) {
            let form = unknowns.iter().skip(unknown).step_by(width).map(|value| self.layout.of_part(*value));
            let table = repeated(self.fine.synthesise(form));
            for (index, _) in seen(self.layout, section) {
                for (step, value) in curve.iter_mut().enumerate() {
                    let [met, straight] = [&self.met, &self.straight].map(|places| places[index * samples + step]);
                    *value = met.of(&table) - straight.of(&table);
                }
                self.turn.analyse_in_place(&mut curve, &mut harmonics);
                for (order, harmonic) in harmonics.iter().enumerate().skip(1) {
                    found[order * count + index] += harmonic.conj();
                }
            }
        }
        self.weighted(&found)
    }

    /// The adjoint of [`forward`](Self::forward), in the real inner product Re Σ a*·b.
    fn backward(&mut self, weighted: &[Complex64]) -> Vec<Complex64> {
        let count = self.layout.readings.len();
        let width = self.layout.unknowns.len();
        let mut readings = weighted.to_vec();
        if let Some(weights) = &self.operators.weights {
            for (row, weights) in readings.chunks_exact_mut(count).skip(1).zip(weights) {
                // Wᴴ·r = (rᴴ·W)ᴴ.
                let conjugate: Vec<Complex64> = row.iter().map(Complex64::conj).collect();
                row.iter_mut().zip(weights.after(&conjugate)).for_each(|(value, entry)| *value = entry.conj());
            }
        }
        let samples = self.turn.length();
        let mut forms = vec![Complex64::ZERO; (self.max_order + 1) * width];
        let length = self.fine.length();
        let mut table = Vec::with_capacity(length + POINTS);
        let mut harmonics = vec![Complex64::ZERO; self.max_order + 1];
        for (unknown, section) in sections(self.layout) {
            table.clear();
            table.resize(length + POINTS, 0.0);
            for (index, _) in seen(self.layout, section) {
                let own = (0..=self.max_order)
                    .map(|order| if order == 0 { Complex64::ZERO } else { readings[order * count + index].conj() });
                let curve = self.turn.synthesise(own);
                for (step, value) in curve.iter().enumerate() {
                    let value = value * 2.0 / samples as f64;
                    self.met[index * samples + step].add(&mut table, value);
                    self.straight[index * samples + step].add(&mut table, -value);
                }
            }
            for point in (length..table.len()).rev() {
                table[point - length] += table[point];
            }
            table.truncate(length);
            let half = 0.5 * length as f64;
            self.fine.analyse_in_place(&mut table, &mut harmonics);
            for (order, harmonic) in harmonics.iter().enumerate().skip(2) {
                forms[order * width + unknown] = self.layout.of_part(harmonic * half);
            }
        }
        let mut gradient = vec![Complex64::ZERO; weighted.len()];
        for order in 1..=self.max_order {
            let row = order * count..(order + 1) * count;
            let system = &self.operators.systems[order - 1];
            let mut unknowns = adjoint_times(&system.matrix, &readings[row.clone()], system.columns);
            if order > 1 {
                let forms = &forms[order * width..(order + 1) * width];
                unknowns.iter_mut().zip(forms).for_each(|(value, form)| *value += form);
            }
            gradient[row].copy_from_slice(&adjoint_times(&self.operators.orders[order - 1].operator, &unknowns, count));
        }
        self.scale(&mut gradient);
        gradient
    }
}

impl Place {
    /// The value here of a table that begins anew at its end ([`repeated`]).
    fn of(&self, table: &[f64]) -> f64 {
        let points = &table[self.first..self.first + POINTS];
        self.weights.iter().zip(points).map(|(weight, point)| weight * point).sum()
    }

    /// The adjoint of [`of`](Self::of).
    fn add(&self, table: &mut [f64], value: f64) {
        let points = &mut table[self.first..self.first + POINTS];
        self.weights.iter().zip(points).for_each(|(weight, point)| *point += weight * value);
    }
}

/// A table of one turn, and the first of its points again: no place runs over its end.
fn repeated(turn: &[f64]) -> Vec<f64> {
    turn.iter().cycle().take(turn.len() + POINTS).copied().collect()
}

/// Places of the forms among the unknowns, and their sections.
fn sections(layout: &Layout) -> impl Iterator<Item = (usize, usize)> + '_ {
    layout.unknowns.iter().enumerate().filter_map(|(unknown, quantity)| match quantity {
        Quantity::Form(section) => Some((unknown, *section)),
        _ => None,
    })
}

/// Readings of a section.
fn seen(layout: &Layout, section: usize) -> impl Iterator<Item = (usize, &crate::layout::Reading)> {
    layout.readings.iter().enumerate().filter(move |(_, reading)| reading.section == section)
}

/// Aᴴ times a vector, for A with so many columns.
fn adjoint_times(matrix: &[Complex64], vector: &[Complex64], columns: usize) -> Vec<Complex64> {
    let mut product = vec![Complex64::ZERO; columns];
    for (row, value) in matrix.chunks_exact(columns.max(1)).zip(vector) {
        product.iter_mut().zip(row).for_each(|(sum, entry)| *sum += entry.conj() * value);
    }
    product
}

fn norm_sqr(values: &[Complex64]) -> f64 {
    values.iter().map(Complex64::norm_sqr).sum()
}
