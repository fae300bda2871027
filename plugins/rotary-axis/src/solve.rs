//! The weighted least-squares fit of location errors, component errors and the balls' placement.
//!
//! The component errors of a command act on this command's readings only. With W½ the inverse standard uncertainties, a command
//! gives W½·y = W½·A·g + W½·B·c, g the unknowns common to all commands and c its six component errors. A QR factorization of
//! W½·B gives rows that c cannot reach, Qₙᵀ·W½·(y − A·g), and c = P·(z − U·g) for any g. The rows of all commands, with the gauge as
//! ten exact conditions Σ G·c = 0, determine g. This is the same minimum as that of one dense system.
//!
//! Rotations are full: Gauss-Newton steps until they are below 10⁻⁶ µm. Angles count times a lever arm, so that all unknowns are mm.
//! What the layout cannot observe is found once, at the nominal places and with unit weights.

mod problem;
mod results;
mod system;

use nalgebra::{DMatrix, DVector, Vector3};

use crate::kinematics::{Errors, turn};
pub(crate) use results::Combined;

/// A ball's reading at a command; mm, about an axis along z.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Reading {
    pub ball: usize,
    pub command: usize,
    pub value: Vector3<f64>,
    pub std: f64,
}

/// What is measured: balls at command 0 (mm) and distinct commands (rad).
#[derive(Debug, Clone)]
pub(crate) struct Layout {
    pub balls: Vec<Vector3<f64>>,
    pub phi: Vec<f64>,
    /// Whether component errors are free at each command.
    pub component_errors: bool,
}

/// A declared or added effect: what one unit of its parameter adds to each reading, mm.
pub(crate) type Column = Vec<Vector3<f64>>;

/// A number with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Estimate {
    pub value: f64,
    pub std: f64,
}

/// What the layout cannot observe.
const LOST: Estimate = Estimate { value: f64::NAN, std: f64::NAN };
/// Balls whose lever arm about their common line is less than this share of the largest lever arm are on one line.
const ON_A_LINE: f64 = 1e-3;
/// Directions of the unknowns that the readings determine with less than this share of the best are not observable.
const DETERMINED: f64 = 1e-6;
/// A value that depends on directions that are not observable by more than this is not observable.
const DEPENDS: f64 = 1e-5;
const MAX_STEPS: usize = 60;
/// mm.
const SETTLED: f64 = 1e-9;
/// Number of conditions of the gauge.
pub(crate) const GAUGE: usize = 10;
/// As many commands with all six component errors observable carry the gauge alone.
const ENOUGH_COMMANDS: usize = 4;

/// A fit, or why there is none.
pub(crate) fn fit(layout: &Layout, readings: &[Reading], effects: &[Column]) -> Result<Fit, String> {
    let problem = Problem::new(layout, readings, effects);
    let structure = problem.structure();
    let mut state = problem.start();
    for _ in 0..MAX_STEPS {
        let system = problem.system(&structure, &state);
        let solution = system.solve(&structure)?;
        let step = problem.apply(&structure, &system, &solution, &mut state);
        if !step.is_finite() {
            return Err("the fit comes out as no number: look for absurd readings".into());
        }
        if step < SETTLED {
            let system = problem.system(&structure, &state);
            let solution = system.solve(&structure)?;
            return Ok(problem.finish(structure, system, solution, state));
        }
    }
    Err(format!(
        "the fit does not settle within {MAX_STEPS} steps: are the readings in mm, are the balls' places right, and do the balls lie nearly in a line?"
    ))
}

/// Rows of readings that component errors cannot reach, and what the other unknowns and the effects add to them, at a fit
/// without the effects. In units of the standard uncertainty.
pub(crate) struct Redundant {
    pub rows: Vec<f64>,
    /// Command of each row.
    pub command: Vec<usize>,
    /// Orthonormal columns that span what location errors and placement can add.
    pub declared: Vec<Vec<f64>>,
    /// `[effect][row]`.
    pub effects: Vec<Vec<f64>>,
}

/// The redundant part of the readings for the closed loop.
pub(crate) fn redundant(layout: &Layout, readings: &[Reading], effects: &[Column]) -> Result<Redundant, String> {
    let declared = fit(layout, readings, &[])?;
    let problem = Problem::new(layout, readings, effects);
    let structure = problem.structure();
    let mut state = problem.start();
    state.errors.clone_from(&declared.state.errors);
    state.placement.clone_from(&declared.state.placement);
    let system = problem.system(&structure, &state);
    let count = problem.common();
    let (free, all) = (count - effects.len(), &system.free);
    let columns = |matrix: DMatrix<f64>| matrix.column_iter().map(|column| column.iter().copied().collect()).collect();
    let left = all.columns(0, free).into_owned();
    let basis = if left.nrows() == 0 { DMatrix::zeros(0, 0) } else { column_space(left, DETERMINED) };
    let mut of_effects = all.columns(free, effects.len()).into_owned();
    for (index, mut column) in of_effects.column_iter_mut().enumerate() {
        column *= problem.effect_scale[index];
    }
    let command = system.blocks.iter().enumerate();
    let command = command.flat_map(|(command, block)| vec![command; block.free_rows]).collect();
    Ok(Redundant {
        rows: system.left.iter().copied().collect(),
        command,
        declared: columns(basis),
        effects: columns(of_effects),
    })
}

/// Orthonormal basis of the span of the columns.
fn column_space(matrix: DMatrix<f64>, tolerance: f64) -> DMatrix<f64> {
    let svd = matrix.svd(true, false);
    let most = svd.singular_values.max();
    let kept: Vec<usize> =
        (0..svd.singular_values.len()).filter(|index| svd.singular_values[*index] > tolerance * most).collect();
    svd.u.map_or_else(|| DMatrix::zeros(0, 0), |u| u.select_columns(&kept))
}

/// Orthonormal basis of everything outside the span of orthonormal columns.
fn complement(columns: &DMatrix<f64>) -> DMatrix<f64> {
    let (size, rank) = columns.shape();
    let mut transposed = DMatrix::identity(size, size);
    if rank > 0 {
        columns.clone().qr().q_tr_mul(&mut transposed);
    }
    transposed.rows(rank, size - rank).transpose()
}

struct Problem<'a> {
    layout: &'a Layout,
    readings: &'a [Reading],
    effects: &'a [Column],
    effect_scale: Vec<f64>,
    /// Readings of each command.
    members: Vec<Vec<usize>>,
    /// mm.
    lever: f64,
}

/// Values of all unknowns.
#[derive(Debug, Clone)]
struct State {
    /// One a command; location errors are the same in all.
    errors: Vec<Errors>,
    placement: Vec<Vector3<f64>>,
    effects: Vec<f64>,
}

/// What can be observed of which unknowns.
struct Structure {
    /// Of each command: directions of the component errors that its readings determine, and the others.
    known: Vec<DMatrix<f64>>,
    unknown: Vec<DMatrix<f64>>,
    /// Whether the gauge runs over the command.
    in_gauge: Vec<bool>,
    /// Place of each command's undetermined directions among the unknowns.
    first: Vec<usize>,
    /// Number of unknowns: common ones, and undetermined directions.
    count: usize,
    /// Orthonormal directions of the unknowns that are observable.
    observable: DMatrix<f64>,
    /// At the nominal places: how component errors change with the unknowns.
    sensitivity: Vec<DMatrix<f64>>,
}

/// A command's readings, separated.
struct Block {
    /// V·R⁻¹: component errors per unit of z, 6 × r.
    gain: DMatrix<f64>,
    /// First r rows of Qᵀ·W½·y and of Qᵀ·W½·A.
    z: DVector<f64>,
    common: DMatrix<f64>,
    free_rows: usize,
}

/// The linear system at a state.
struct System {
    blocks: Vec<Block>,
    /// Rows without component errors, of all commands: the residual, and by the common unknowns.
    left: DVector<f64>,
    free: DMatrix<f64>,
    /// The gauge: C·x = f.
    gauge: DMatrix<f64>,
    right: DVector<f64>,
    gauge_covariance: DMatrix<f64>,
}

struct Solution {
    unknowns: DVector<f64>,
    covariance: DMatrix<f64>,
    /// Unknowns by the right side of the gauge.
    by_gauge: DMatrix<f64>,
    /// Unknowns by independent errors of variance 1 of the rows that component errors cannot reach.
    by_rows: DMatrix<f64>,
    /// Unknowns that the rows determined.
    rank: usize,
}

/// The ten conditions of one command.
pub(crate) fn gauge(phi: f64) -> DMatrix<f64> {
    let back = turn(-phi);
    let mut conditions = DMatrix::zeros(GAUGE, 6);
    conditions.view_mut((0, 0), (6, 6)).fill_with_identity();
    for (row, first) in [(6, 0), (8, 3)] {
        conditions.view_mut((row, first), (2, 2)).copy_from(&back.fixed_view::<2, 2>(0, 0));
    }
    conditions
}

/// A fit with its covariance.
pub(crate) struct Fit {
    layout: Layout,
    lever: f64,
    effect_scale: Vec<f64>,
    structure: Structure,
    system: System,
    solution: Solution,
    state: State,
    /// Reading less model, mm.
    pub residual: Vec<Vector3<f64>>,
    /// Weighted sum of squares.
    pub chi2: f64,
    pub dof: usize,
}
