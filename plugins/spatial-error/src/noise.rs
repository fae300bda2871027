//! Noise of one reading from repeats: their scatter after a smooth drift in time that is common to all places.

use nalgebra::{DMatrix, DVector};
use runout_core::numerics::statistics::f_tail;

use crate::terms::legendre;

/// What is known of the noise.
#[derive(Debug, Clone, PartialEq)]
pub enum Noise {
    /// The column `std_um`, of each reading.
    Column(Vec<f64>),
    /// The key `std_um`.
    Stated(f64),
    /// Scatter of repeats, of each coordinate.
    Repeats {
        /// Standard deviation of x, y, z; NaN of components that were not measured.
        std_um: [f64; 3],
        /// Degrees of freedom of each.
        dof: usize,
    },
    /// Nothing: the nugget is noise.
    Unknown,
}

/// Degrees of freedom of each component below which repeats say nothing; and from which each component has its own noise.
const FEWEST: [usize; 2] = [4, 10];
/// Chance of as different scatter below which components with fewer degrees of freedom are not pooled.
const UNLIKE: f64 = 0.01;
/// Highest order of the drift, and degrees of freedom that each order asks for.
const ORDERS: [usize; 2] = [6, 12];
/// Scatter below this share of the deviations is that of copied rows.
const COPIED: f64 = 1e-9;

/// Noise of repeats of places, of the measured components.
#[must_use]
pub(crate) fn of_repeats(
    place_of: &[usize],
    places: usize,
    readings_um: &[[f64; 3]],
    measured: &[usize],
    time: &[f64],
) -> Noise {
    let mut members = vec![Vec::new(); places];
    place_of.iter().enumerate().for_each(|(row, place)| members[*place].push(row));
    members.retain(|rows| rows.len() > 1);
    let rows: Vec<usize> = members.iter().flatten().copied().collect();
    let free = rows.len() - members.len();
    if free < FEWEST[0] {
        return Noise::Unknown;
    }
    let orders = ORDERS[0].min(free / ORDERS[1]);
    let fields = measured.len();
    let function = |row: usize, column: usize| match measured.get(column) {
        Some(axis) => readings_um[row][*axis],
        None => legendre(column + 1 - fields, 2.0 * time[row] - 1.0),
    };
    let mut all = DMatrix::<f64>::zeros(rows.len(), fields + orders);
    let mut at = 0;
    for group in &members {
        for column in 0..fields + orders {
            let mean = group.iter().map(|row| function(*row, column)).sum::<f64>() / group.len() as f64;
            for (index, row) in group.iter().enumerate() {
                all[(at + index, column)] = function(*row, column) - mean;
            }
        }
        at += group.len();
    }
    // The drift's functions, orthonormal.
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in fields..fields + orders {
        let mut left: DVector<f64> = all.column(column).into_owned();
        let whole = left.norm();
        for known in &basis {
            let share = known.dot(&left);
            left.axpy(-share, known, 1.0);
        }
        if left.norm() > 1e-6 * whole.max(1e-12) && whole > 1e-9 {
            let size = left.norm();
            basis.push(left / size);
        }
    }
    let dof = free.saturating_sub(basis.len());
    if dof < FEWEST[0] {
        return Noise::Unknown;
    }
    let mut squares = vec![0.0; fields];
    for (field, squares) in squares.iter_mut().enumerate() {
        let mut left: DVector<f64> = all.column(field).into_owned();
        for known in &basis {
            let share = known.dot(&left);
            left.axpy(-share, known, 1.0);
        }
        *squares = left.norm_squared();
    }
    let size: f64 = readings_um.iter().flatten().filter(|value| value.is_finite()).map(|value| value * value).sum();
    let copied = |squares: f64| squares <= COPIED * COPIED * size;
    if copied(squares.iter().sum()) {
        return Noise::Unknown;
    }
    let mut std_um = [f64::NAN; 3];
    for (axis, own) in measured.iter().zip(&squares) {
        // Where they are few, components with about the same scatter have one noise. One that repeats exactly has that of the others.
        let is_pooled = |other: &&f64| {
            let ratio = (*other / own).max(own / *other);
            let alike = dof < FEWEST[1] && 2.0 * f_tail(ratio, dof as f64, dof as f64) > UNLIKE;
            copied(*own) || alike || ratio <= 1.0
        };
        let pooled: Vec<f64> = squares.iter().copied().filter(|other| is_pooled(&other)).collect();
        std_um[*axis] = (pooled.iter().sum::<f64>() / (pooled.len() * dof) as f64).sqrt();
    }
    Noise::Repeats { std_um, dof }
}
