//! Location errors, component errors, placement and effects of a fit, with their standard uncertainties.

use nalgebra::{DMatrix, DVector, Matrix6, Vector3, Vector6};

use super::{DEPENDS, Estimate, Fit, LOST, gauge};
use crate::kinematics::{Errors, place, turn};

impl Fit {
    /// χ² per degree of freedom; NaN without any.
    pub(crate) fn chi2_per_dof(&self) -> f64 {
        if self.dof == 0 { f64::NAN } else { self.chi2 / self.dof as f64 }
    }

    /// Location errors: two offsets in mm, two tilts in rad.
    pub(crate) fn location(&self) -> [Estimate; 4] {
        let at = self.state.errors.first().copied().unwrap_or_default();
        let values = [at.offset.x, at.offset.y, at.tilt.x, at.tilt.y];
        [0, 1, 2, 3].map(|index| {
            let scale = if index < 2 { 1.0 } else { self.lever };
            self.common(index, values[index], scale)
        })
    }

    /// A ball's placement, mm.
    pub(crate) fn placement(&self, ball: usize) -> [Estimate; 3] {
        let values = self.state.placement[ball];
        [0, 1, 2].map(|coordinate| self.common(4 + 3 * ball + coordinate, values[coordinate], 1.0))
    }

    /// Values of the effects.
    pub(crate) fn effects(&self) -> Vec<Estimate> {
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
    pub(crate) fn component(&self, command: usize) -> [Estimate; 6] {
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

    /// Combinations of the component errors at a command: each row takes three shifts (mm) and three angles (rad).
    pub(crate) fn combined(&self, command: usize, rows: &[[f64; 6]]) -> Combined {
        let Errors { shift, angle, .. } = self.state.errors[command];
        let found = Vector6::new(shift.x, shift.y, shift.z, angle.x, angle.y, angle.z);
        // As the unknowns count angles.
        let scale = Vector6::new(1.0, 1.0, 1.0, self.lever, self.lever, self.lever);
        let rows = DMatrix::from_fn(rows.len(), 6, |row, column| rows[row][column]);
        let scaled = &rows * Matrix6::from_diagonal(&scale.map(f64::recip));
        let (sensitivity, unknown) = (&self.structure.sensitivity[command], &self.structure.unknown[command]);
        let lost = scaled.row_iter().map(|row| {
            let row = row / row.norm();
            let outside = !self.structure.in_gauge[command] && (row * unknown).norm() > DEPENDS;
            outside || !self.structure.observes(&(row * sensitivity).transpose())
        });
        let lost: Vec<bool> = lost.collect();
        let block = &self.system.blocks[command];
        let own = &scaled * &block.gain;
        let by = self.structure.sensitivity(command, block, self.structure.count);
        Combined {
            value: (rows * found).iter().zip(lost).map(|(value, lost)| if lost { f64::NAN } else { *value }).collect(),
            own: &own * own.transpose(),
            common: scaled * by * &self.solution.by_rows,
        }
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
    pub(crate) fn errors(&self, command: usize) -> Errors {
        self.state.errors[command]
    }

    /// What location and component errors at a command do to a point that is nominally at `point` (mm, command 0).
    pub(crate) fn deviation(&self, command: usize, point: &Vector3<f64>) -> [Estimate; 3] {
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
    pub(crate) fn expected(&self, errors: &Errors, phi: f64, ball: usize) -> Vector3<f64> {
        let nominal = self.layout.balls[ball];
        place(errors, phi, &(nominal + self.state.placement[ball])).at - turn(phi) * nominal
    }
}

/// Combinations of the component errors at a command, with their errors but for those that act as placement of the axis or of all balls.
pub(crate) struct Combined {
    /// NaN where not observable.
    pub value: Vec<f64>,
    /// Covariance of what only this command's readings add.
    pub own: DMatrix<f64>,
    /// What each change that all commands share adds, one column a change of standard deviation 1.
    pub common: DMatrix<f64>,
}
