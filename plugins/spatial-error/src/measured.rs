//! Components that were measured.
//!
//! A column that is absent or empty is no reading. One that is constant, or a plane over the places, is none either: what stands in it was
//! filled in or computed, and as a reading without noise it would decide the placement of all components.

use nalgebra::DVector;
use runout_core::{
    Error, Result,
    consistency::{Check, Test},
    points::Points,
};

/// Components of the error.
pub(crate) const COMPONENTS: [&str; 3] = ["dx", "dy", "dz"];
/// Share of the largest residual beside a plane below which a component is not measured.
const CONSTANT: f64 = 1e-3;
/// Share of a coordinate outside the span of the others below which it varies with them.
const DEPENDENT: f64 = 1e-9;

/// Components that were measured, with their readings.
pub(crate) struct Measured {
    /// 0 dx, 1 dy, 2 dz.
    pub axes: Vec<usize>,
    /// In µm; NaN of the others.
    pub readings_um: Vec<[f64; 3]>,
    /// Components that are absent.
    pub notes: Vec<String>,
    /// Components that count as not measured.
    pub checks: Vec<Check>,
}

impl Measured {
    /// Of the columns of points at places, in mm, one a reading.
    pub(crate) fn of(points: &Points, places_mm: &[[f64; 3]]) -> Result<Self> {
        let columns = COMPONENTS.map(|component| {
            let name = format!("{component}_um");
            points.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice())
        });
        if columns.iter().all(Option::is_none) {
            let problem = "it has none of the columns `dx_um`, `dy_um`, `dz_um`: no component is measured".to_owned();
            return Err(Error::new("read", points.input.display().to_string(), problem));
        }
        let plane = plane(places_mm);
        let residual = columns.map(|column| column.map_or(0.0, |values| beside(values, &plane)));
        let largest = residual.iter().copied().fold(0.0, f64::max);
        let (mut axes, mut notes, mut checks) = (Vec::new(), Vec::new(), Vec::new());
        for axis in 0..3 {
            let component = COMPONENTS[axis];
            match columns[axis] {
                None => notes.push(format!("{component} is not measured: it is not predicted and not compensated")),
                Some(_) if residual[axis] < CONSTANT * largest => {
                    let share = residual[axis] / largest;
                    let check = Check::new(Test::Measured, component, share * share, &[], 0.0).finding(|| {
                        format!(
                            "`{component}_um` varies by {:.1e} µm beside a plane over the places, {share:.1e} of the other components: it counts \
                             as not measured, and is not predicted and not compensated",
                            residual[axis]
                        )
                    });
                    checks.push(check.named());
                }
                Some(_) => axes.push(axis),
            }
        }
        let reading = |row: usize| {
            let number =
                |axis: usize| columns[axis].filter(|_| axes.contains(&axis)).map_or(f64::NAN, |column| column[row]);
            [0, 1, 2].map(number)
        };
        let readings_um = (0..places_mm.len()).map(reading).collect();
        Ok(Self { axes, readings_um, notes, checks })
    }
}

/// Orthonormal columns of a constant and the coordinates.
fn plane(places_mm: &[[f64; 3]]) -> Vec<DVector<f64>> {
    let constant = DVector::from_element(places_mm.len(), 1.0);
    let coordinates =
        (0..3).map(|axis| DVector::from_iterator(places_mm.len(), places_mm.iter().map(|place| place[axis])));
    let mut basis: Vec<DVector<f64>> = Vec::new();
    for mut column in std::iter::once(constant).chain(coordinates) {
        let whole = column.norm();
        take_out(&mut column, &basis);
        let size = column.norm();
        if size > DEPENDENT * whole {
            basis.push(column / size);
        }
    }
    basis
}

fn take_out(column: &mut DVector<f64>, basis: &[DVector<f64>]) {
    for known in basis.iter().chain(basis) {
        let share = known.dot(column);
        column.axpy(-share, known, 1.0);
    }
}

/// Root mean square of what a plane leaves.
fn beside(values: &[f64], plane: &[DVector<f64>]) -> f64 {
    let mut left = DVector::from_column_slice(values);
    take_out(&mut left, plane);
    left.norm() / (values.len().max(1) as f64).sqrt()
}
