//! Noise of one reading from repeats: their scatter after a smooth drift in time that is common to all places.

use nalgebra::{DMatrix, DVector};

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
        /// Standard deviation of x, y, z.
        std_um: [f64; 3],
        /// Degrees of freedom of each.
        dof: usize,
    },
    /// Nothing: the nugget is noise.
    Unknown,
}

/// Degrees of freedom of each coordinate below which repeats say nothing; and from which each coordinate has its own noise.
const FEWEST: [usize; 2] = [4, 10];
/// Highest order of the drift, and degrees of freedom that each order asks for.
const ORDERS: [usize; 2] = [6, 12];
/// Scatter below this share of the deviations is that of copied rows.
const COPIED: f64 = 1e-9;

/// Noise of repeats of places.
#[must_use]
pub(crate) fn of_repeats(place_of: &[usize], places: usize, readings_um: &[[f64; 3]], time: &[f64]) -> Noise {
    let mut members = vec![Vec::new(); places];
    place_of.iter().enumerate().for_each(|(row, place)| members[*place].push(row));
    members.retain(|rows| rows.len() > 1);
    let rows: Vec<usize> = members.iter().flatten().copied().collect();
    let free = rows.len() - members.len();
    if free < FEWEST[0] {
        return Noise::Unknown;
    }
    let orders = ORDERS[0].min(free / ORDERS[1]);
    let function = |row: usize, column: usize| match column {
        0..3 => readings_um[row][column],
        _ => legendre(column - 2, 2.0 * time[row] - 1.0),
    };
    let mut all = DMatrix::<f64>::zeros(rows.len(), 3 + orders);
    let mut at = 0;
    for group in &members {
        for column in 0..3 + orders {
            let mean = group.iter().map(|row| function(*row, column)).sum::<f64>() / group.len() as f64;
            for (index, row) in group.iter().enumerate() {
                all[(at + index, column)] = function(*row, column) - mean;
            }
        }
        at += group.len();
    }
    // The drift's functions, orthonormal.
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for column in 3..3 + orders {
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
    let mut squares = [0.0; 3];
    for (axis, squares) in squares.iter_mut().enumerate() {
        let mut left: DVector<f64> = all.column(axis).into_owned();
        for known in &basis {
            let share = known.dot(&left);
            left.axpy(-share, known, 1.0);
        }
        *squares = left.norm_squared();
    }
    let size: f64 = readings_um.iter().flatten().map(|value| value * value).sum();
    if squares.iter().sum::<f64>() <= COPIED * COPIED * size {
        return Noise::Unknown;
    }
    let pooled = (squares.iter().sum::<f64>() / (3 * dof) as f64).sqrt();
    let own = dof >= FEWEST[1] && squares.iter().all(|squares| *squares > 0.0);
    let std_um = squares.map(|squares| if own { (squares / dof as f64).sqrt() } else { pooled });
    Noise::Repeats { std_um, dof }
}
