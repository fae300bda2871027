//! The weighted least-squares fit of location errors, component errors and the balls' placement.
//!
//! The component errors of a command act on this command's readings only. With W½ the inverse standard uncertainties, a command
//! gives W½·y = W½·A·g + W½·B·c, g the unknowns common to all commands and c its six component errors. A QR factorization of
//! W½·B gives rows that c cannot reach, Qₙᵀ·W½·(y − A·g), and c = P·(z − U·g) for any g. The rows of all commands, with the gauge as
//! ten exact conditions Σ G·c = 0, determine g. This is the same minimum as that of one dense system.
//!
//! Rotations are full: Gauss-Newton steps until they are below 10⁻⁶ µm. Angles count times a lever arm, so that all unknowns are mm.
//! What the layout cannot observe is found once, at the nominal places and with unit weights.
//!
//! Long because all unknowns are of one system, and observability, solution and covariance are of its blocks.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

use crate::kinematics::{Errors, place, turn};

/// A ball's reading at a command; mm, about an axis along z.
#[derive(Debug, Clone, Copy)]
pub struct Reading {
    pub ball: usize,
    pub command: usize,
    pub value: Vector3<f64>,
    pub std: f64,
}

/// What is measured: balls at command 0 (mm) and distinct commands (rad).
#[derive(Debug, Clone)]
pub struct Layout {
    pub balls: Vec<Vector3<f64>>,
    pub phi: Vec<f64>,
    /// Whether component errors are free at each command.
    pub component_errors: bool,
}

/// A declared or added effect: what one unit of its parameter adds to each reading, mm.
pub type Column = Vec<Vector3<f64>>;

/// A number with its standard uncertainty.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Estimate {
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
pub const GAUGE: usize = 10;
/// As many commands with all six component errors observable carry the gauge alone.
const ENOUGH_COMMANDS: usize = 4;

/// A fit, or why there is none.
pub fn fit(layout: &Layout, readings: &[Reading], effects: &[Column]) -> Result<Fit, String> {
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
        "the fit does not settle within {MAX_STEPS} steps: are the readings in mm and the balls' places right?"
    ))
}

/// Rows of readings that component errors cannot reach, and what the other unknowns and the effects add to them, at a fit
/// without the effects. In units of the standard uncertainty.
pub struct Redundant {
    pub rows: Vec<f64>,
    /// Command of each row.
    pub command: Vec<usize>,
    /// Orthonormal columns that span what location errors and placement can add.
    pub declared: Vec<Vec<f64>>,
    /// `[effect][row]`.
    pub effects: Vec<Vec<f64>>,
}

/// The redundant part of the readings for the closed loop.
pub fn redundant(layout: &Layout, readings: &[Reading], effects: &[Column]) -> Result<Redundant, String> {
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
    /// Rows without component errors, of all commands: what is left, and by the common unknowns.
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
    /// Unknowns that the rows determined.
    rank: usize,
}

/// The ten conditions of one command.
pub fn gauge(phi: f64) -> DMatrix<f64> {
    let back = turn(-phi);
    let mut conditions = DMatrix::zeros(GAUGE, 6);
    conditions.view_mut((0, 0), (6, 6)).fill_with_identity();
    for (row, first) in [(6, 0), (8, 3)] {
        conditions.view_mut((row, first), (2, 2)).copy_from(&back.fixed_view::<2, 2>(0, 0));
    }
    conditions
}

impl<'a> Problem<'a> {
    fn new(layout: &'a Layout, readings: &'a [Reading], effects: &'a [Column]) -> Self {
        let mut members = vec![Vec::new(); layout.phi.len()];
        for (index, reading) in readings.iter().enumerate() {
            members[reading.command].push(index);
        }
        let squares: f64 = layout.balls.iter().map(Vector3::norm_squared).sum();
        let lever = (squares / layout.balls.len().max(1) as f64).sqrt().max(1.0);
        let size = |column: &Column| {
            let squares: f64 = column.iter().map(Vector3::norm_squared).sum();
            let size = (squares / column.len().max(1) as f64).sqrt();
            if size > 0.0 { size } else { 1.0 }
        };
        Self { layout, readings, effects, effect_scale: effects.iter().map(size).collect(), members, lever }
    }

    fn start(&self) -> State {
        State {
            errors: vec![Errors::default(); self.layout.phi.len()],
            placement: vec![Vector3::zeros(); self.layout.balls.len()],
            effects: vec![0.0; self.effects.len()],
        }
    }

    /// Number of common unknowns: two offsets, two tilts, placements, effects.
    fn common(&self) -> usize {
        4 + 3 * self.layout.balls.len() + self.effects.len()
    }

    /// Rows of a command's readings: what is left of them, and their derivatives by common unknowns and component errors.
    fn rows(&self, command: usize, state: &State, weighted: bool) -> (DVector<f64>, DMatrix<f64>, DMatrix<f64>) {
        let members = &self.members[command];
        let mut left = DVector::zeros(3 * members.len());
        let mut common = DMatrix::zeros(3 * members.len(), self.common());
        let mut component = DMatrix::zeros(3 * members.len(), 6);
        let phi = self.layout.phi[command];
        for (index, member) in members.iter().enumerate() {
            let reading = &self.readings[*member];
            let weight = if weighted { reading.std.recip() } else { 1.0 };
            let nominal = self.layout.balls[reading.ball];
            let found = place(&state.errors[command], phi, &(nominal + state.placement[reading.ball]));
            let mut expected = found.at - turn(phi) * nominal;
            for ((column, value), scale) in self.effects.iter().zip(&state.effects).zip(0..) {
                expected += column[*member] * *value;
                let entry = column[*member] * (weight / self.effect_scale[scale]);
                common.fixed_view_mut::<3, 1>(3 * index, 4 + 3 * self.layout.balls.len() + scale).copy_from(&entry);
            }
            left.fixed_rows_mut::<3>(3 * index).copy_from(&((reading.value - expected) * weight));
            let mut put = |first: usize, columns: usize, derivative: Matrix3<f64>| {
                let scaled = derivative * weight;
                common.view_mut((3 * index, first), (3, columns)).copy_from(&scaled.columns(0, columns));
            };
            put(0, 2, Matrix3::identity());
            put(2, 2, found.by_tilt / self.lever);
            put(4 + 3 * reading.ball, 3, found.by_ball);
            component.view_mut((3 * index, 0), (3, 3)).copy_from(&(found.by_shift * weight));
            component.view_mut((3 * index, 3), (3, 3)).copy_from(&(found.by_angle * (weight / self.lever)));
        }
        (left, common, component)
    }

    /// Separates a command's rows into those that determine its component errors and the others.
    fn block(
        &self,
        command: usize,
        state: &State,
        known: &DMatrix<f64>,
        weighted: bool,
    ) -> (Block, DVector<f64>, DMatrix<f64>) {
        let (mut left, mut common, component) = self.rows(command, state, weighted);
        let (size, rank) = (left.len(), known.ncols());
        let mut gain = DMatrix::zeros(6, 0);
        if rank > 0 {
            let qr = (component * known).qr();
            qr.q_tr_mul(&mut left);
            qr.q_tr_mul(&mut common);
            // Full rank by construction of `known`.
            let inverse = qr.r().solve_upper_triangular(&DMatrix::identity(rank, rank));
            gain = known * inverse.unwrap_or_else(|| DMatrix::from_element(rank, rank, f64::NAN));
        }
        let free = (left.rows(rank, size - rank).into_owned(), common.rows(rank, size - rank).into_owned());
        let block = Block {
            gain,
            z: left.rows(0, rank).into_owned(),
            common: common.rows(0, rank).into_owned(),
            free_rows: size - rank,
        };
        (block, free.0, free.1)
    }

    fn structure(&self) -> Structure {
        let state = self.start();
        let commands = self.layout.phi.len();
        let (mut known, mut unknown) = (Vec::new(), Vec::new());
        for command in 0..commands {
            if !self.layout.component_errors {
                known.push(DMatrix::zeros(6, 0));
                unknown.push(DMatrix::zeros(6, 0));
                continue;
            }
            let (_, _, component) = self.rows(command, &state, false);
            let eigen = SymmetricEigen::new(component.tr_mul(&component));
            let most = eigen.eigenvalues.max();
            let is_known = |index: &usize| eigen.eigenvalues[*index] > ON_A_LINE * ON_A_LINE * most;
            let (yes, no): (Vec<usize>, Vec<usize>) = (0..6).partition(is_known);
            known.push(eigen.eigenvectors.select_columns(&yes));
            unknown.push(eigen.eigenvectors.select_columns(&no));
        }
        let complete = unknown.iter().filter(|columns| columns.ncols() == 0).count();
        let all = complete < ENOUGH_COMMANDS;
        let in_gauge: Vec<bool> =
            unknown.iter().map(|columns| self.layout.component_errors && (all || columns.ncols() == 0)).collect();
        let mut count = self.common();
        let mut first = Vec::with_capacity(commands);
        for command in 0..commands {
            first.push(count);
            if in_gauge[command] {
                count += unknown[command].ncols();
            }
        }
        let observable = DMatrix::identity(count, count);
        let mut structure = Structure { known, unknown, in_gauge, first, count, observable, sensitivity: Vec::new() };
        let system = self.assemble(&structure, &state, false);
        let size = (commands as f64).sqrt();
        let rows = system.free.nrows();
        let mut all = DMatrix::zeros(GAUGE + rows.max(1), count);
        all.rows_mut(0, GAUGE).copy_from(&(&system.gauge / commands as f64));
        all.view_mut((GAUGE, 0), (rows, self.common())).copy_from(&(&system.free / size));
        // A tall matrix has the row space of its triangular factor.
        let all = if all.nrows() > count { all.qr().r() } else { all };
        structure.observable = column_space(all.transpose(), DETERMINED);
        structure.sensitivity =
            (0..commands).map(|command| structure.sensitivity(command, &system.blocks[command], count)).collect();
        structure
    }

    fn system(&self, structure: &Structure, state: &State) -> System {
        self.assemble(structure, state, true)
    }

    fn assemble(&self, structure: &Structure, state: &State, weighted: bool) -> System {
        let common = self.common();
        let mut blocks = Vec::with_capacity(self.layout.phi.len());
        let (mut left, mut free) = (Vec::new(), Vec::new());
        let mut conditions = DMatrix::zeros(GAUGE, structure.count);
        let mut right = DVector::zeros(GAUGE);
        let mut gauge_covariance = DMatrix::zeros(GAUGE, GAUGE);
        for command in 0..self.layout.phi.len() {
            let (block, rows, columns) = self.block(command, state, &structure.known[command], weighted);
            left.extend(rows.iter().copied());
            free.push(columns);
            if structure.in_gauge[command] {
                let gauge = gauge(self.layout.phi[command]);
                let gained = &gauge * &block.gain;
                let mut by_common = conditions.columns_mut(0, common);
                by_common -= &gained * &block.common;
                let unknown = &structure.unknown[command];
                if unknown.ncols() > 0 {
                    let first = structure.first[command];
                    conditions.columns_mut(first, unknown.ncols()).copy_from(&(&gauge * unknown));
                }
                right -= &gained * &block.z + &gauge * self.component(&state.errors[command]);
                gauge_covariance += &gained * gained.transpose();
            }
            blocks.push(block);
        }
        let mut all = DMatrix::zeros(left.len(), common);
        let mut row = 0;
        for columns in free {
            all.rows_mut(row, columns.nrows()).copy_from(&columns);
            row += columns.nrows();
        }
        System { blocks, left: DVector::from_vec(left), free: all, gauge: conditions, right, gauge_covariance }
    }

    /// Component errors as unknowns: mm, and rad times the lever arm.
    fn component(&self, errors: &Errors) -> DVector<f64> {
        let angle = errors.angle * self.lever;
        DVector::from_iterator(6, errors.shift.iter().chain(angle.iter()).copied())
    }

    /// Adds a step. Gives its largest entry, mm.
    fn apply(&self, structure: &Structure, system: &System, solution: &Solution, state: &mut State) -> f64 {
        let x = &solution.unknowns;
        let common = x.rows(0, self.common()).into_owned();
        let mut largest = common.amax();
        for (command, block) in system.blocks.iter().enumerate() {
            let errors = &mut state.errors[command];
            errors.offset += Vector3::new(x[0], x[1], 0.0);
            errors.tilt += Vector3::new(x[2], x[3], 0.0) / self.lever;
            if !self.layout.component_errors {
                continue;
            }
            let mut step = &block.gain * (&block.z - &block.common * &common);
            let unknown = &structure.unknown[command];
            if structure.in_gauge[command] && unknown.ncols() > 0 {
                step += unknown * x.rows(structure.first[command], unknown.ncols());
            }
            largest = largest.max(step.amax());
            errors.shift += Vector3::new(step[0], step[1], step[2]);
            errors.angle += Vector3::new(step[3], step[4], step[5]) / self.lever;
        }
        for (ball, placement) in state.placement.iter_mut().enumerate() {
            *placement += Vector3::new(x[4 + 3 * ball], x[5 + 3 * ball], x[6 + 3 * ball]);
        }
        let first = 4 + 3 * self.layout.balls.len();
        for (index, value) in state.effects.iter_mut().enumerate() {
            *value += x[first + index] / self.effect_scale[index];
        }
        if x.iter().all(|entry| entry.is_finite()) { largest } else { f64::NAN }
    }

    fn finish(&self, structure: Structure, system: System, solution: Solution, state: State) -> Fit {
        let mut residual = vec![Vector3::zeros(); self.readings.len()];
        let mut chi2 = 0.0;
        for (command, members) in self.members.iter().enumerate() {
            let (left, ..) = self.rows(command, &state, false);
            for (index, member) in members.iter().enumerate() {
                let own = Vector3::new(left[3 * index], left[3 * index + 1], left[3 * index + 2]);
                residual[*member] = own;
                chi2 += own.norm_squared() / self.readings[*member].std.powi(2);
            }
        }
        let component: usize = structure.known.iter().map(DMatrix::ncols).sum();
        let dof = (3 * self.readings.len()).saturating_sub(component + solution.rank);
        Fit {
            layout: self.layout.clone(),
            lever: self.lever,
            effect_scale: self.effect_scale.clone(),
            structure,
            system,
            solution,
            state,
            residual,
            chi2,
            dof,
        }
    }
}

impl Structure {
    /// Component errors by the unknowns, 6 × count.
    fn sensitivity(&self, command: usize, block: &Block, count: usize) -> DMatrix<f64> {
        let mut by = DMatrix::zeros(6, count);
        let common = block.common.ncols();
        by.columns_mut(0, common).copy_from(&-(&block.gain * &block.common));
        let unknown = &self.unknown[command];
        if self.in_gauge[command] && unknown.ncols() > 0 {
            by.columns_mut(self.first[command], unknown.ncols()).copy_from(unknown);
        }
        by
    }

    fn all_observable(&self) -> bool {
        self.observable.ncols() == self.count
    }

    /// Whether a value with these derivatives by the unknowns is observable.
    fn observes(&self, gradient: &DVector<f64>) -> bool {
        if self.all_observable() {
            return true;
        }
        let inside = &self.observable * self.observable.tr_mul(gradient);
        (gradient - inside).norm() <= DEPENDS * gradient.norm().max(1.0)
    }
}

impl System {
    fn solve(&self, structure: &Structure) -> Result<Solution, String> {
        let basis = &structure.observable;
        let common = self.free.ncols();
        let conditions = &self.gauge * basis;
        let svd = conditions.svd(true, true);
        let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Err("the gauge has no decomposition".into()) };
        let most = svd.singular_values.max();
        let kept: Vec<usize> = (0..svd.singular_values.len())
            .filter(|index| most > 0.0 && svd.singular_values[*index] > DETERMINED * most)
            .collect();
        let along = v_t.select_rows(&kept).transpose();
        let mut inverse = along.clone();
        for (column, index) in kept.iter().enumerate() {
            let mut entry = inverse.column_mut(column);
            entry /= svd.singular_values[*index];
        }
        let inverse = inverse * u.select_columns(&kept).transpose();
        let within = complement(&along);
        let rows = &self.free * basis.rows(0, common);
        let free = &rows * &within;
        let rank = free.ncols();
        let count = basis.ncols();
        if rank == 0 {
            let by_gauge = basis * inverse;
            let covariance = &by_gauge * &self.gauge_covariance * by_gauge.transpose();
            return Ok(Solution { unknowns: &by_gauge * &self.right, covariance, by_gauge, rank });
        }
        if free.nrows() < rank {
            return Err("there are too few readings".into());
        }
        let qr = free.qr();
        let failure = "the readings do not determine the unknowns: their uncertainties differ too much";
        let inverse_r = qr.r().solve_upper_triangular(&DMatrix::identity(rank, rank)).ok_or(failure)?;
        let from_rows = &within * &inverse_r;
        let q_t = qr.q().transpose();
        // v = H⁺f + Z·T⁺(ρ − A·H⁺f)
        let project = DMatrix::identity(count, count) - &from_rows * (&q_t * &rows);
        let by_gauge = basis * (project * inverse);
        let by_rows = basis * from_rows;
        let unknowns = &by_gauge * &self.right + &by_rows * (q_t * &self.left);
        let covariance = &by_gauge * &self.gauge_covariance * by_gauge.transpose() + &by_rows * by_rows.transpose();
        Ok(Solution { unknowns, covariance, by_gauge, rank })
    }
}

/// A fit with its covariance.
pub struct Fit {
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

impl Fit {
    /// χ² per degree of freedom; NaN without any.
    pub fn chi2_per_dof(&self) -> f64 {
        if self.dof == 0 { f64::NAN } else { self.chi2 / self.dof as f64 }
    }

    /// Location errors: two offsets in mm, two tilts in rad.
    pub fn location(&self) -> [Estimate; 4] {
        let at = self.state.errors.first().copied().unwrap_or_default();
        let values = [at.offset.x, at.offset.y, at.tilt.x, at.tilt.y];
        [0, 1, 2, 3].map(|index| {
            let scale = if index < 2 { 1.0 } else { self.lever };
            self.common(index, values[index], scale)
        })
    }

    /// A ball's placement, mm.
    pub fn placement(&self, ball: usize) -> [Estimate; 3] {
        let values = self.state.placement[ball];
        [0, 1, 2].map(|coordinate| self.common(4 + 3 * ball + coordinate, values[coordinate], 1.0))
    }

    /// Values of the effects.
    pub fn effects(&self) -> Vec<Estimate> {
        let first = 4 + 3 * self.layout.balls.len();
        let values = self.state.effects.iter().enumerate();
        values.map(|(index, value)| self.common(first + index, *value, self.effect_scale[index])).collect()
    }

    fn common(&self, index: usize, value: f64, scale: f64) -> Estimate {
        let mut gradient = DVector::zeros(self.structure.count);
        gradient[index] = 1.0;
        if !self.structure.observes(&gradient) {
            return LOST;
        }
        Estimate { value, std: self.solution.covariance[(index, index)].max(0.0).sqrt() / scale }
    }

    /// Component errors at a command: three shifts in mm, three angles in rad.
    pub fn component(&self, command: usize) -> [Estimate; 6] {
        if !self.layout.component_errors {
            return [LOST; 6];
        }
        let errors = &self.state.errors[command];
        let (_, covariance) = self.at_command(command);
        let lost = &self.structure.unknown[command];
        [0, 1, 2, 3, 4, 5].map(|index| {
            let gradient = self.structure.sensitivity[command].row(index).transpose();
            let outside = !self.structure.in_gauge[command] && lost.row(index).norm() > DEPENDS;
            if outside || !self.structure.observes(&gradient) {
                return LOST;
            }
            let (value, scale) =
                if index < 3 { (errors.shift[index], 1.0) } else { (errors.angle[index - 3], self.lever) };
            Estimate { value, std: covariance[(index, index)].max(0.0).sqrt() / scale }
        })
    }

    /// Covariances at a command: unknowns with component errors, and of component errors.
    fn at_command(&self, command: usize) -> (DMatrix<f64>, DMatrix<f64>) {
        let block = &self.system.blocks[command];
        let by = self.structure.sensitivity(command, block, self.structure.count);
        let mut with_z = DMatrix::zeros(self.structure.count, block.z.len());
        if self.structure.in_gauge[command] {
            let gauge = gauge(self.layout.phi[command]);
            with_z = -(&self.solution.by_gauge * (gauge * &block.gain));
        }
        let direct = &with_z * block.gain.transpose();
        let with_unknowns = &direct + &self.solution.covariance * by.transpose();
        let crossed = &by * &direct;
        let own = &block.gain * block.gain.transpose();
        let covariance = own + &by * &self.solution.covariance * by.transpose() + &crossed + crossed.transpose();
        (with_unknowns, covariance)
    }

    /// Location and component errors at a command.
    pub fn errors(&self, command: usize) -> Errors {
        self.state.errors[command]
    }

    /// What location and component errors at a command do to a point that is nominally at `point` (mm, command 0).
    pub fn deviation(&self, command: usize, point: &Vector3<f64>) -> [Estimate; 3] {
        let phi = self.layout.phi[command];
        let errors = self.state.errors[command];
        let found = place(&errors, phi, point);
        let value = found.at - turn(phi) * point;
        let mut by_unknowns = DMatrix::zeros(3, self.structure.count);
        by_unknowns.view_mut((0, 0), (2, 2)).fill_with_identity();
        by_unknowns.view_mut((0, 2), (3, 2)).copy_from(&(found.by_tilt.columns(0, 2) / self.lever));
        let mut by_component = DMatrix::zeros(3, 6);
        by_component.view_mut((0, 0), (3, 3)).copy_from(&found.by_shift);
        by_component.view_mut((0, 3), (3, 3)).copy_from(&(found.by_angle / self.lever));
        let mut covariance = &by_unknowns * &self.solution.covariance * by_unknowns.transpose();
        let mut gradient = by_unknowns.clone();
        if self.layout.component_errors {
            let (with_unknowns, own) = self.at_command(command);
            let crossed = &by_unknowns * with_unknowns * by_component.transpose();
            covariance += &by_component * own * by_component.transpose() + &crossed + crossed.transpose();
            gradient += &by_component * &self.structure.sensitivity[command];
        }
        let lost = &by_component * &self.structure.unknown[command];
        [0, 1, 2].map(|index| {
            let outside = !self.structure.in_gauge[command] && lost.ncols() > 0 && lost.row(index).norm() > DEPENDS;
            if outside || !self.structure.observes(&gradient.row(index).transpose()) {
                return LOST;
            }
            Estimate { value: value[index], std: covariance[(index, index)].max(0.0).sqrt() }
        })
    }

    /// Where a ball is expected at angle φ (rad) with these errors, less its nominal place; mm.
    pub fn expected(&self, errors: &Errors, phi: f64, ball: usize) -> Vector3<f64> {
        let nominal = self.layout.balls[ball];
        place(errors, phi, &(nominal + self.state.placement[ball])).at - turn(phi) * nominal
    }
}
