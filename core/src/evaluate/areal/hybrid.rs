//! Hybrid parameters (ISO 25178-2:2021, 4.4).

use super::HeightMap;

/// The six-neighbour differences of ISO 25178-2's local gradient: the derivative of the polynomial of degree 6 through a
/// point and three on each side, times 60.
const GRADIENT: [f64; 3] = [45.0, -9.0, 1.0];

/// Slopes and area.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hybrid {
    /// Root mean square gradient, over the points that have three measured neighbours on each side; NaN where none has.
    pub sdq: f64,
    /// Developed interfacial area ratio in %, over the cells whose four corners were measured.
    pub sdr_percent: f64,
}

impl Hybrid {
    pub(super) fn of(map: &HeightMap) -> Self {
        Self { sdq: gradient(map), sdr_percent: 100.0 * developed(map) }
    }
}

/// Derivative at the middle of seven values at distance 1.
pub(in crate::evaluate) fn derivative(at: impl Fn(isize) -> f64) -> f64 {
    let differences = [1, 2, 3].map(|step| at(step) - at(-step));
    GRADIENT.iter().zip(differences).map(|(weight, difference)| weight * difference).sum::<f64>() / 60.0
}

fn gradient(map: &HeightMap) -> f64 {
    let (columns, rows) = (map.columns(), map.rows());
    // µm over mm.
    let [across, along] = [map.dx_mm(), map.dy_mm()].map(|distance| 1e-3 / distance);
    let (mut sum, mut count) = (0.0, 0_usize);
    for row in 3..rows.saturating_sub(3) {
        let ring = |step: isize| &map.heights_um()[row.saturating_add_signed(step) * columns..][..columns];
        let rings: [&[f64]; 7] = std::array::from_fn(|index| ring(index.cast_signed() - 3));
        let here = rings[3];
        let mut add = |column: usize, dx: f64| {
            let slope = across * dx;
            let rise = along * derivative(|step| rings[(step + 3) as usize][column]);
            let square = slope * slope + rise * rise;
            if square.is_finite() {
                sum += square;
                count += 1;
            }
        };
        for (left, window) in here.windows(7).enumerate() {
            add(left + 3, derivative(|step| window[(step + 3) as usize]));
        }
        if map.closed() {
            for column in (0..3.min(columns)).chain(columns.saturating_sub(3).max(3)..columns) {
                let beside = |step: isize| (column.cast_signed() + step).rem_euclid(columns.cast_signed()) as usize;
                add(column, derivative(|step| here[beside(step)]));
            }
        }
    }
    (sum / count as f64).sqrt()
}

/// Area over projected area, minus 1: each cell is the mean of its two triangulations (annex D).
fn developed(map: &HeightMap) -> f64 {
    let columns = map.columns();
    let [across, along] = [map.dx_mm(), map.dy_mm()].map(|distance| 1e-3 / distance);
    let (mut sum, mut count) = (0.0, 0_usize);
    let area = |p: f64, q: f64| (1.0 + p * p + q * q).sqrt();
    let mut rows = map.heights_um().chunks_exact(columns);
    let Some(mut lower) = rows.next() else { return f64::NAN };
    for upper in rows {
        let mut add = |left: usize, right: usize| {
            let [p0, p1] = [lower, upper].map(|row| across * (row[right] - row[left]));
            let [q0, q1] = [left, right].map(|column| along * (upper[column] - lower[column]));
            let cell = 0.25 * (area(p0, q0) + area(p0, q1) + area(p1, q0) + area(p1, q1)) - 1.0;
            if cell.is_finite() {
                sum += cell;
                count += 1;
            }
        };
        (1..columns).for_each(|right| add(right - 1, right));
        if map.closed() {
            add(columns - 1, 0);
        }
        lower = upper;
    }
    sum / count as f64
}
