//! Corrections of the axes that take a displacement away: damped least squares on the Jacobian of a chain, within limits.
//!
//! A linear axis moves the tool along its direction; a rotary one turns it about its line, which the linear axes before it in the
//! chain carry. Near a singular place the smallest singular value is damped (Nakamura, Hanafusa, J. Dyn. Sys. Meas. Control 108
//! (1986) 163), so that corrections stay bounded. Axes at their limits are held there, and the others are solved again.

use nalgebra::{DMatrix, DVector, Matrix3xX, Vector3};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// An axis that corrects.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Axis {
    /// Its name.
    pub id: String,
    /// Linear or rotary.
    pub kind: Kind,
    /// Direction of its motion, or of its line with right-handed rotation; of any length.
    pub direction: [f64; 3],
    /// A point of a rotary axis' line with all axes at 0, in mm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub point_mm: Option<[f64; 3]>,
    /// Largest correction of a linear axis, in µm.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_um: Option<f64>,
    /// Largest correction of a rotary axis, in µrad.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub limit_urad: Option<f64>,
}

/// What an axis does.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, Serialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Kind {
    /// Moves along its direction.
    Linear,
    /// Turns about its line.
    Rotary,
}

/// Axes that correct, from the base to the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Chain {
    axes: Vec<Axis>,
    limits: Vec<f64>,
    tool_mm: Vector3<f64>,
    /// From a command in space to the commands of the linear axes.
    commands: DMatrix<f64>,
}

/// A correction.
#[derive(Debug, Clone, PartialEq)]
pub struct Correction {
    /// What to add to each axis' command: µm of linear, µrad of rotary axes.
    pub add: Vec<f64>,
    /// What remains of the displacement, in µm.
    pub remains_um: [f64; 3],
    /// Whether an axis is at its limit.
    pub limited: bool,
}

/// A singular value below this share of the largest is damped.
const SMALL: f64 = 0.05;
/// A singular value below this share of the largest is none.
const NONE: f64 = 1e-9;
/// µrad of a rotary axis count as this many µm of a linear one: at an arm of 100 mm.
const ROTARY_SHARE: f64 = 0.1;

impl Axis {
    /// Linear axes along x, y and z, in the order of a chain.
    #[must_use]
    pub fn xyz(chain: [usize; 3]) -> Vec<Self> {
        let one = |axis: usize| {
            let mut direction = [0.0; 3];
            direction[axis] = 1.0;
            let id = ["X", "Y", "Z"][axis].to_owned();
            Self { id, kind: Kind::Linear, direction, point_mm: None, limit_um: None, limit_urad: None }
        };
        chain.map(one).into()
    }

    /// Name of its column in the table of corrections.
    #[must_use]
    pub fn column(&self) -> String {
        format!("correct_{}_{}", self.id.to_lowercase(), self.unit())
    }

    /// Unit of its correction.
    #[must_use]
    pub fn unit(&self) -> &'static str {
        if self.kind == Kind::Linear { "um" } else { "urad" }
    }

    fn check(&self) -> Result<(), String> {
        let refuse = |problem: &str| Err(format!("axis `{}`: {problem}", self.id));
        let name = |letter: char| letter.is_ascii_alphanumeric() || letter == '_' || letter == '-';
        if self.id.is_empty() || !self.id.chars().all(name) {
            return refuse("`id` is a name of letters and digits");
        }
        let length = Vector3::from(self.direction).norm();
        if !(length.is_finite() && length > 1e-9) {
            return refuse("`direction` has no length");
        }
        if self.point_mm.is_some_and(|point| point.iter().any(|value| !value.is_finite())) {
            return refuse("`point_mm` has a number that is not finite");
        }
        match (self.kind, self.point_mm, self.limit_um, self.limit_urad) {
            (Kind::Rotary, None, ..) => return refuse("a rotary axis needs `point_mm`, a point of its line"),
            (Kind::Rotary, _, Some(_), _) => return refuse("the limit of a rotary axis is `limit_urad`"),
            (Kind::Linear, _, _, Some(_)) => return refuse("the limit of a linear axis is `limit_um`"),
            _ => {}
        }
        if let Some(limit) = self.limit_um.or(self.limit_urad).filter(|limit| !(limit.is_finite() && *limit > 0.0)) {
            return Err(format!("axis `{}`: its limit must be above 0, found {limit}", self.id));
        }
        Ok(())
    }
}

impl Chain {
    /// Checks axes; `limit_um` is the limit of linear axes that have none.
    ///
    /// # Errors
    /// The first axis that cannot be.
    pub fn new(axes: Vec<Axis>, limit_um: Option<f64>, tool_mm: [f64; 3]) -> Result<Self, String> {
        if axes.is_empty() {
            return Err("expected at least one axis".into());
        }
        for (index, axis) in axes.iter().enumerate() {
            axis.check()?;
            if axes[..index].iter().any(|other| other.column() == axis.column()) {
                return Err(format!("two axes are named `{}`", axis.id));
            }
        }
        let limit = |axis: &Axis| match axis.kind {
            Kind::Linear => axis.limit_um.or(limit_um).unwrap_or(f64::INFINITY),
            Kind::Rotary => axis.limit_urad.unwrap_or(f64::INFINITY),
        };
        let limits = axes.iter().map(limit).collect();
        let linear: Vec<Vector3<f64>> = axes
            .iter()
            .filter(|axis| axis.kind == Kind::Linear)
            .map(|axis| Vector3::from(axis.direction).normalize())
            .collect();
        let commands = if linear.is_empty() {
            DMatrix::zeros(0, 3)
        } else {
            let directions = DMatrix::from_fn(3, linear.len(), |row, column| linear[column][row]);
            directions.pseudo_inverse(NONE).map_err(str::to_owned)?
        };
        Ok(Self { axes, limits, tool_mm: Vector3::from(tool_mm), commands })
    }

    /// The axes.
    #[must_use]
    pub fn axes(&self) -> &[Axis] {
        &self.axes
    }

    /// What one unit of each axis' command moves the tool by, in µm, at a command in mm.
    #[must_use]
    pub fn jacobian(&self, place_mm: [f64; 3]) -> Matrix3xX<f64> {
        let place = Vector3::from(place_mm);
        let commands = &self.commands * place;
        let mut carried = Vector3::zeros();
        let mut linear = 0;
        let columns: Vec<Vector3<f64>> = self
            .axes
            .iter()
            .map(|axis| {
                let direction = Vector3::from(axis.direction).normalize();
                match axis.kind {
                    Kind::Linear => {
                        carried += direction * commands[linear];
                        linear += 1;
                        direction
                    }
                    Kind::Rotary => {
                        let line = Vector3::from(axis.point_mm.unwrap_or_default()) + carried;
                        1e-3 * direction.cross(&(place + self.tool_mm - line))
                    }
                }
            })
            .collect();
        Matrix3xX::from_columns(&columns)
    }

    /// What takes a displacement, in µm, away. Of a component that is NaN nothing is known: it is not corrected, and an axis that moves
    /// nothing else has no correction.
    #[must_use]
    pub fn correct(&self, place_mm: [f64; 3], displaced_um: [f64; 3]) -> Correction {
        let mut jacobian = self.jacobian(place_mm);
        let whole: Vec<f64> = jacobian.column_iter().map(|column| column.norm()).collect();
        let unknown: Vec<usize> = (0..3).filter(|axis| displaced_um[*axis].is_nan()).collect();
        unknown.iter().for_each(|axis| jacobian.row_mut(*axis).fill(0.0));
        let displaced = Vector3::from(displaced_um).map(|by| if by.is_nan() { 0.0 } else { by });
        let wanted = -displaced;
        let count = self.axes.len();
        let mut add = DVector::<f64>::zeros(count);
        let mut held = vec![false; count];
        // Each pass holds one axis more, or lets one go: the cost falls each time one is let go.
        for _ in 0..4 * count {
            let free: Vec<usize> = (0..count).filter(|axis| !held[*axis]).collect();
            let of_held: Vector3<f64> =
                (0..count).filter(|axis| held[*axis]).map(|axis| jacobian.column(axis) * add[axis]).sum();
            let solved = self.damped(&jacobian, &free, wanted - of_held);
            let over = |(index, axis): (usize, &usize)| {
                let ratio = solved[index].abs() / self.limits[*axis];
                (ratio > 1.0 + 1e-12).then_some((ratio, index, *axis))
            };
            let worst = free.iter().enumerate().filter_map(over).max_by(|a, b| a.0.total_cmp(&b.0));
            if let Some((_, index, axis)) = worst {
                held[axis] = true;
                add[axis] = self.limits[axis].copysign(solved[index]);
                continue;
            }
            free.iter().zip(&solved).for_each(|(axis, value)| add[*axis] = *value);
            let left = wanted - &jacobian * &add;
            let inward =
                |axis: &usize| held[*axis] && left.dot(&jacobian.column(*axis)) * add[*axis] < -1e-9 * left.norm();
            let Some(released) = (0..count).find(inward) else { break };
            held[released] = false;
            add[released] = 0.0;
        }
        for axis in 0..count {
            add[axis] = add[axis].clamp(-self.limits[axis], self.limits[axis]);
        }
        let mut remains = displaced + &jacobian * &add;
        unknown.iter().for_each(|axis| remains[*axis] = f64::NAN);
        for axis in (0..count).filter(|axis| whole[*axis] > 0.0 && jacobian.column(*axis).norm() <= NONE * whole[*axis])
        {
            add[axis] = f64::NAN;
        }
        Correction { add: add.iter().copied().collect(), remains_um: remains.into(), limited: held.contains(&true) }
    }

    /// The least motion of some axes that is nearest to a wanted displacement.
    fn damped(&self, jacobian: &Matrix3xX<f64>, free: &[usize], wanted: Vector3<f64>) -> Vec<f64> {
        if free.is_empty() {
            return Vec::new();
        }
        let size = |axis: usize| if self.axes[axis].kind == Kind::Linear { 1.0 } else { 1.0 / ROTARY_SHARE };
        let scaled = DMatrix::from_fn(3, free.len(), |row, column| jacobian[(row, free[column])] * size(free[column]));
        let svd = scaled.svd(true, true);
        let (Some(left), Some(right)) = (&svd.u, &svd.v_t) else { return vec![0.0; free.len()] };
        let largest = svd.singular_values.max();
        let mut solved = DVector::<f64>::zeros(free.len());
        for (index, value) in svd.singular_values.iter().enumerate().filter(|(_, value)| **value > NONE * largest) {
            let share = value / (SMALL * largest);
            let damping = if share < 1.0 { SMALL * largest * (1.0 - share) } else { 0.0 };
            let gain = value / (value * value + damping * damping);
            solved += right.row(index).transpose() * (gain * left.column(index).dot(&wanted));
        }
        free.iter().zip(solved.iter()).map(|(axis, value)| value * size(*axis)).collect()
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn rotary(limit_urad: Option<f64>) -> Axis {
        let (id, kind) = ("B".into(), Kind::Rotary);
        let point_mm = Some([0.0, 0.0, 50.0]);
        Axis { id, kind, direction: [0.0, 2.0, 0.0], point_mm, limit_um: None, limit_urad }
    }

    #[test]
    fn three_linear_axes_take_all_away() {
        let chain = Chain::new(Axis::xyz([2, 0, 1]), None, [0.0; 3]).unwrap();
        let found = chain.correct([10.0, 20.0, 30.0], [3.0, -4.0, 5.0]);
        assert_eq!(
            chain.axes().iter().map(Axis::column).collect::<Vec<_>>(),
            ["correct_z_um", "correct_x_um", "correct_y_um"]
        );
        for (add, wanted) in found.add.iter().zip([-5.0, -3.0, 4.0]) {
            assert!((add - wanted).abs() < 1e-12);
        }
        assert!(found.remains_um.iter().all(|left| left.abs() < 1e-12) && !found.limited);
    }

    /// Limited minima against a search over a fine grid of corrections.
    #[test]
    fn limits_are_kept_and_nothing_better_is_within_them() {
        let mut axes = Axis::xyz([0, 1, 2]);
        axes[1].direction = [0.3, 1.0, 0.0];
        axes[2].direction = [0.5, 0.1, 0.8];
        let chain = Chain::new(axes, Some(4.0), [0.0; 3]).unwrap();
        for displaced in [[9.0, 1.0, 0.0], [2.0, -8.0, 7.0], [20.0, 20.0, -20.0], [1.0, 1.0, 1.0], [-3.0, 6.0, 3.0]] {
            let found = chain.correct([0.0; 3], displaced);
            let cost = Vector3::from(found.remains_um).norm();
            assert!(found.add.iter().all(|add| add.abs() <= 4.0 + 1e-12));
            let jacobian = chain.jacobian([0.0; 3]);
            let steps = || (-20..=20).map(|step| 0.2 * f64::from(step));
            for x in steps() {
                for y in steps() {
                    for z in steps() {
                        let left = Vector3::from(displaced) + &jacobian * DVector::from_vec(vec![x, y, z]);
                        assert!(left.norm() > cost - 1e-9, "{displaced:?}: {x} {y} {z} is better");
                    }
                }
            }
        }
    }

    #[test]
    fn a_rotary_axis_is_carried_and_helps() {
        let mut axes = Axis::xyz([0, 1, 2]);
        axes.remove(0);
        axes.push(rotary(None));
        let chain = Chain::new(axes, None, [0.0, 0.0, -100.0]).unwrap();
        // 150 mm below its line, one µrad moves by −0.15 µm along x, wherever Y and Z are.
        let jacobian = chain.jacobian([0.0, 70.0, 30.0]);
        assert!((jacobian[(0, 2)] + 0.15).abs() < 1e-12, "{jacobian}");
        let found = chain.correct([0.0, 70.0, 30.0], [3.0, 1.0, 1.0]);
        assert!(found.remains_um.iter().all(|left| left.abs() < 1e-9), "{found:?}");
        assert!((found.add[2] - 20.0).abs() < 1e-9);
    }

    #[test]
    fn a_singular_place_has_bounded_corrections() {
        let axes = vec![
            Axis { direction: [1.0, 0.0, 0.0], ..Axis::xyz([0, 1, 2]).remove(0) },
            Axis { direction: [1.0, 1e-4, 0.0], ..Axis::xyz([1, 0, 2]).remove(0) },
        ];
        let found = Chain::new(axes, None, [0.0; 3]).unwrap().correct([0.0; 3], [1.0, 1.0, 0.0]);
        assert!(found.add.iter().all(|add| add.abs() < 20.0), "{found:?}");
    }

    #[test]
    fn axes_that_cannot_be_are_refused() {
        let one = |change: &dyn Fn(&mut Axis)| {
            let mut axis = rotary(Some(5.0));
            change(&mut axis);
            Chain::new(vec![axis], None, [0.0; 3]).unwrap_err()
        };
        assert!(one(&|axis| axis.point_mm = None).contains("point_mm"));
        assert!(one(&|axis| axis.direction = [0.0; 3]).contains("direction"));
        assert!(one(&|axis| axis.limit_um = Some(1.0)).contains("limit_urad"));
        assert!(one(&|axis| axis.limit_urad = Some(-1.0)).contains("above 0"));
        assert!(one(&|axis| axis.id = String::new()).contains("id"));
        let twice = vec![rotary(None), rotary(None)];
        assert!(Chain::new(twice, None, [0.0; 3]).unwrap_err().contains("two axes"));
        assert!(Chain::new(Vec::new(), None, [0.0; 3]).is_err());
    }
}
