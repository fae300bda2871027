//! What the readings' noise makes of estimates and residuals.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use runout_core::{
    Complex64,
    numerics::{
        lanes::{Arithmetic, FusedWork, fused},
        side_by_side::{Complexes, Reals, TOGETHER},
    },
};

use super::{
    operators::Operators,
    readings::Readings,
    side_by_side::{Orders, adjoint_blocks_times, blocks_times, gather, lane, times_blocks},
};

/// Of all orders from 1, for readings with the covariance Σ, unknowns P·readings of the equations A, and weights W.
#[derive(Debug, Clone, Default)]
pub(crate) struct Propagation {
    /// P·Σ·Pᴴ of each order, `[unknown][unknown]`, order 1 with its own unknowns.
    pub covariance: Vec<Vec<Complex64>>,
    /// Mean of |residual|² of each order: the trace of (I − A·P)·Σ·(I − A·P)ᴴ.
    pub squares: Vec<f64>,
    /// Mean of |residual|² of each order, weighted by W, P being the least-squares operator of W·A: the trace of
    /// W·(I − A·P)·Σ·(I − A·P)ᴴ·Wᴴ. Empty without weights.
    pub weighted_squares: Vec<f64>,
}

impl Propagation {
    /// `None` where the readings' covariance is not known.
    #[must_use]
    pub(crate) fn of(readings: &Readings, operators: &Operators) -> Option<Self> {
        let setups = readings.covariance.as_ref()?;
        let size = readings.count / setups.len().max(1);
        let block = size * size;
        let mut propagation = Self::default();
        let mut workspaces: [Option<Workspace>; 2] = [None, None];
        for orders in Orders::up_to(operators.systems.len()) {
            let columns = operators.systems[orders.of(0) - 1].columns;
            let kind = usize::from(orders.of(0) > 1);
            let workspace = workspaces[kind].get_or_insert_with(|| Workspace::new(size, setups.len(), columns));
            for (spread, setup) in workspace.spread.chunks_exact_mut(block).zip(setups) {
                gather(orders.map(|order| &setup[order * block..(order + 1) * block]), spread);
            }
            let weights = operators.weights.as_ref();
            fused(Propagating {
                size,
                columns,
                matrices: orders.map(|order| &operators.systems[order - 1].matrix[..]),
                operators: orders.map(|order| &operators.orders[order - 1].operator[..]),
                weights: weights.map(|weights| orders.map(|order| weights[order - 1].entries())),
                workspace,
            });
            for place in 0..orders.each().len() {
                propagation.covariance.push(lane(&workspace.covariance, place));
                propagation.squares.push(workspace.squares[place].max(0.0));
                if weights.is_some() {
                    propagation.weighted_squares.push(workspace.weighted_squares[place].max(0.0));
                }
            }
        }
        Some(propagation)
    }

    /// With the covariance of each order times a factor.
    pub(crate) fn times(&mut self, factors: &[f64]) {
        for (covariance, factor) in self.covariance.iter_mut().zip(factors) {
            covariance.iter_mut().for_each(|entry| *entry *= *factor);
        }
    }
}

/// What eight orders need.
struct Workspace {
    /// Σ, `[setup][sensor][sensor]`.
    spread: Vec<Complexes>,
    /// A, W·A and Wᴴ·W·A, `[reading][unknown]`.
    matrix: Vec<Complexes>,
    weighted: Vec<Complexes>,
    twice_weighted: Vec<Complexes>,
    /// P and P·Σ, `[unknown][reading]`.
    operator: Vec<Complexes>,
    passed: Vec<Complexes>,
    covariance: Vec<Complexes>,
    weights: Vec<Complexes>,
    squares: Reals,
    weighted_squares: Reals,
}

impl Workspace {
    fn new(size: usize, setups: usize, columns: usize) -> Self {
        let blocks = vec![Complexes::ZERO; setups * size * size];
        let matrix = vec![Complexes::ZERO; setups * size * columns];
        Self {
            spread: blocks.clone(),
            weights: blocks,
            weighted: matrix.clone(),
            twice_weighted: matrix.clone(),
            operator: matrix.clone(),
            passed: matrix.clone(),
            matrix,
            covariance: vec![Complexes::ZERO; columns * columns],
            squares: [0.0; TOGETHER],
            weighted_squares: [0.0; TOGETHER],
        }
    }
}

/// Eight orders whose noise is propagated.
struct Propagating<'a> {
    /// Sensors of a setup.
    size: usize,
    columns: usize,
    matrices: [&'a [Complex64]; TOGETHER],
    operators: [&'a [Complex64]; TOGETHER],
    weights: Option<[&'a [Complex64]; TOGETHER]>,
    /// Its `spread` is given.
    workspace: &'a mut Workspace,
}

impl FusedWork for Propagating<'_> {
    #[inline(always)]
    fn call<A: Arithmetic>(self) {
        let Self { size, columns, matrices, operators, weights, workspace } = self;
        gather(matrices, &mut workspace.matrix);
        gather(operators, &mut workspace.operator);
        times_blocks::<A>(size, &workspace.operator, &workspace.spread, &mut workspace.passed);
        let readings = workspace.spread.len() / size;
        for (row, target) in workspace.covariance.chunks_exact_mut(columns).enumerate() {
            let passed = &workspace.passed[row * readings..(row + 1) * readings];
            for (operator, target) in workspace.operator.chunks_exact(readings).zip(target) {
                let mut sum = Complexes::ZERO;
                for (passed, entry) in passed.iter().zip(operator) {
                    sum = sum.plus_adjoint::<A>(entry, passed);
                }
                *target = sum;
            }
        }
        // Cheaper than the product: tr Σ − 2 Re tr(PΣ·A) + tr(AᴴA·PΣPᴴ).
        let mut trace = [0.0; TOGETHER];
        for entry in workspace.spread.chunks_exact(size * size).flat_map(|block| block.iter().step_by(size + 1)) {
            for lane in 0..TOGETHER {
                trace[lane] += entry.re[lane];
            }
        }
        let fitted = trace_of_product::<A>(columns, &workspace.passed, &workspace.matrix);
        let mut normal = [0.0; TOGETHER];
        for row in 0..columns {
            for col in 0..columns {
                let mut sum = Complexes::ZERO;
                for entries in workspace.matrix.chunks_exact(columns) {
                    sum = sum.plus_adjoint::<A>(&entries[row], &entries[col]);
                }
                normal = sum.real_of_adjoint::<A>(&workspace.covariance[row * columns + col], normal);
            }
        }
        workspace.squares = std::array::from_fn(|lane| trace[lane] - 2.0 * fitted[lane] + normal[lane]);
        let Some(weights) = weights else { return };
        gather(weights, &mut workspace.weights);
        // W·A·P is the projector on the columns of W·A, times W, which leaves tr(WΣWᴴ) − Re tr(PΣ·WᴴW·A).
        blocks_times::<A>(size, &workspace.weights, &workspace.matrix, &mut workspace.weighted);
        adjoint_blocks_times::<A>(size, &workspace.weights, &workspace.weighted, &mut workspace.twice_weighted);
        let fitted = trace_of_product::<A>(columns, &workspace.passed, &workspace.twice_weighted);
        let trace = trace_about::<A>(size, &workspace.weights, &workspace.spread);
        workspace.weighted_squares = std::array::from_fn(|lane| trace[lane] - fitted[lane]);
    }
}

/// Re tr(M·A) for M, `[unknown][reading]`, and A, `[reading][unknown]`.
#[inline(always)]
fn trace_of_product<A: Arithmetic>(columns: usize, rows: &[Complexes], matrix: &[Complexes]) -> Reals {
    let mut trace = [0.0; TOGETHER];
    for (column, row) in rows.chunks_exact(rows.len() / columns).enumerate() {
        for (entry, other) in row.iter().zip(matrix.chunks_exact(columns)) {
            trace = other[column].real_of_adjoint::<A>(&entry.conj(), trace);
        }
    }
    trace
}

/// tr(W·Σ·Wᴴ) for blocks of both.
#[inline(always)]
fn trace_about<A: Arithmetic>(size: usize, weights: &[Complexes], spread: &[Complexes]) -> Reals {
    let mut trace = [0.0; TOGETHER];
    for (weights, spread) in weights.chunks_exact(size * size).zip(spread.chunks_exact(size * size)) {
        for row in weights.chunks_exact(size) {
            for (column, entry) in row.iter().enumerate() {
                let mut sum = Complexes::ZERO;
                for (weight, spread) in row.iter().zip(spread.chunks_exact(size)) {
                    sum = sum.plus::<A>(weight, &spread[column]);
                }
                trace = sum.real_of_adjoint::<A>(entry, trace);
            }
        }
    }
    trace
}

#[cfg(test)]
mod tests {
    use std::sync::Arc;

    use super::{
        super::{
            algebra::{Blocks, leftover},
            operators::OrderOperator,
        },
        *,
    };
    use crate::layout::System;
    use runout_core::consistency::turns::TurnCourse;

    const SENSORS: usize = 3;
    const SETUPS: usize = 2;
    const COUNT: usize = SENSORS * SETUPS;
    const ORDERS: usize = 12;

    fn some(count: usize, phase: f64) -> Vec<Complex64> {
        // Squares, so that no row follows from others.
        let square = |index: usize| (index * index) as f64;
        let number = |index: usize| Complex64::from_polar(1.0 + square(index).sin(), square(index) * phase);
        (0..count).map(number).collect()
    }

    /// A·Bᴴ for A and B, `[row][reading]`.
    fn times_adjoint(left: &[Complex64], right: &[Complex64], length: usize) -> Vec<Complex64> {
        let dot = |a: &[Complex64], b: &[Complex64]| a.iter().zip(b).map(|(a, b)| a * b.conj()).sum();
        left.chunks_exact(length).flat_map(|a| right.chunks_exact(length).map(move |b| dot(a, b))).collect()
    }

    /// A covariance of every order from 0: M·Mᴴ and a little more on the diagonal.
    fn covariances(phase: f64) -> Vec<Complex64> {
        let one = |order: usize| {
            let half = some(SENSORS * SENSORS, phase + 0.3 * order as f64);
            let mut covariance = times_adjoint(&half, &half, SENSORS);
            covariance.iter_mut().step_by(SENSORS + 1).for_each(|entry| *entry += 0.5);
            covariance
        };
        (0..=ORDERS).flat_map(one).collect()
    }

    /// M·Σ·Mᴴ written out.
    fn spread(matrix: &[Complex64], setups: &[Vec<Complex64>], order: usize) -> Vec<Complex64> {
        let size = SENSORS * SENSORS;
        let blocks = setups.iter().flat_map(|setup| &setup[order * size..(order + 1) * size]).copied().collect();
        times_adjoint(&Blocks::new(SENSORS, blocks).after(matrix), matrix, COUNT)
    }

    fn trace(matrix: &[Complex64]) -> f64 {
        matrix.iter().step_by(COUNT + 1).map(|entry| entry.re).sum()
    }

    #[test]
    fn noise_is_propagated_as_written_out() {
        let setups = vec![covariances(0.7), covariances(1.9)];
        let readings = Readings {
            count: COUNT,
            max_order: ORDERS,
            samples_per_rev: 64,
            turn_angles: vec![64; SETUPS],
            mean: vec![Complex64::ZERO; (ORDERS + 1) * COUNT],
            covariance: Some(setups.clone()),
            scatter: None,
            turns: vec![10; SETUPS],
            near_tones: vec![Vec::new(); SETUPS],
            angle_std_rad: vec![0.0; SETUPS],
            courses: vec![TurnCourse::default(); SETUPS],
            places: (0..COUNT).collect(),
        };
        let scatter =
            Readings { covariance: None, scatter: Some(vec![covariances(2.3), covariances(0.2)]), ..readings.clone() };
        let weights = super::super::weights::whitening(&scatter).unwrap();
        // Order 1 has unknowns of its own; at some orders a column depends on the others.
        let (columns, deficient) = (|order: usize| if order == 1 { 4 } else { 3 }, |order: usize| order % 5 == 4);
        let systems: Vec<_> = (1..=ORDERS)
            .map(|order| {
                let columns = columns(order);
                let mut matrix = some(COUNT * columns, 1.3 + 0.01 * order as f64);
                if deficient(order) {
                    matrix.chunks_exact_mut(columns).for_each(|row| row[2] = row[0] - 2.0 * row[1]);
                }
                let all = vec![true; columns];
                Arc::new(System { columns, matrix, observable: all.clone(), determined: all })
            })
            .collect();
        let solve = |weights: Option<&Blocks>, system: &System| {
            let unweighted = Blocks::identity(SENSORS, SETUPS);
            let weights = weights.unwrap_or(&unweighted);
            let weighted = weights.times(&system.matrix, system.columns);
            let qr = runout_core::numerics::least_squares::PivotedQr::new(COUNT, system.columns, &weighted, 1e-9);
            OrderOperator { operator: weights.after(&qr.operator()), rank: qr.rank() }
        };
        for weighted in [false, true] {
            let weight = |order: usize| weighted.then(|| &weights[order - 1]);
            let orders = systems.iter().zip(1..).map(|(system, order)| solve(weight(order), system)).collect();
            let operators = Operators { orders, systems: systems.clone(), weights: weighted.then(|| weights.clone()) };
            let found = Propagation::of(&readings, &operators).unwrap();
            assert_eq!(
                (found.squares.len(), found.weighted_squares.len()),
                (ORDERS, if weighted { ORDERS } else { 0 })
            );
            for order in 1..=ORDERS {
                let OrderOperator { operator, rank } = &operators.orders[order - 1];
                assert_eq!(*rank, if deficient(order) { 2 } else { columns(order) });
                let near =
                    |found: f64, expected: f64| assert!((found / expected - 1.0).abs() < 1e-10, "{found} {expected}");
                let expected = spread(operator, &setups, order);
                let size = expected.iter().map(|entry| entry.norm()).fold(0.0, f64::max);
                for (found, expected) in found.covariance[order - 1].iter().zip(&expected) {
                    assert!((found - expected).norm() < 1e-12 * size, "{found} {expected}");
                }
                let left = leftover(&systems[order - 1].matrix, operator, COUNT);
                near(found.squares[order - 1], trace(&spread(&left, &setups, order)));
                if let Some(weights) = weight(order) {
                    let left = weights.times(&left, COUNT);
                    near(found.weighted_squares[order - 1], trace(&spread(&left, &setups, order)));
                }
            }
        }
    }
}
