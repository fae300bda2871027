//! The equations of all commands at a state, and the steps from one state to the next.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

use super::{
    Block, Column, DETERMINED, ENOUGH_COMMANDS, Fit, GAUGE, Layout, ON_A_LINE, Problem, Reading, Solution, State,
    Structure, System, column_space, gauge,
};
use crate::kinematics::{Errors, place, turn};

impl<'a> Problem<'a> {
    pub(super) fn new(layout: &'a Layout, readings: &'a [Reading], effects: &'a [Column]) -> Self {
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

    pub(super) fn start(&self) -> State {
        State {
            errors: vec![Errors::default(); self.layout.phi.len()],
            placement: vec![Vector3::zeros(); self.layout.balls.len()],
            effects: vec![0.0; self.effects.len()],
        }
    }

    /// Number of common unknowns: two offsets, two tilts, placements, effects.
    pub(super) fn common(&self) -> usize {
        4 + 3 * self.layout.balls.len() + self.effects.len()
    }

    /// Rows of a command's readings: their residual, and their derivatives by common unknowns and component errors.
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

    pub(super) fn structure(&self) -> Structure {
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

    pub(super) fn system(&self, structure: &Structure, state: &State) -> System {
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
    pub(super) fn apply(&self, structure: &Structure, system: &System, solution: &Solution, state: &mut State) -> f64 {
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

    pub(super) fn finish(&self, structure: Structure, system: System, solution: Solution, state: State) -> Fit {
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
