//! Components that were measured.
//!
//! A column that is absent or empty is no reading. One that is constant, or a plane over the places, is none either: what stands in it was
//! filled in or computed, and as a reading without noise it would decide the placement of all components.

use nalgebra::DVector;
use runout_core::{
    Error, Result,
    consistency::{Check, Test},
    numerics::number::significant,
    points::Points,
};

/// A median deviation above this, in µm, looks like another unit.
const LARGE_UM: f64 = 2000.0;
/// The largest deviation below this, in µm, looks like another unit.
const SMALL_UM: f64 = 0.02;
/// A largest deviation below this share of the extent of the places looks like another unit.
const SMALL_SHARE: f64 = 2e-6;
/// Share of the other components below which the largest deviation of one looks like another unit.
const UNLIKE: f64 = 0.01;
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
                            "`{component}_um` varies by {} µm beside a plane over the places, {} of the other components: it counts \
                             as not measured, and is not predicted and not compensated",
                            significant(residual[axis], 2),
                            significant(share, 2)
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

/// What looks like another unit.
pub(crate) fn looks_wrong(places: &[[f64; 3]], readings_um: &[[f64; 3]], measured: &[usize]) -> Vec<String> {
    let mut remarks = Vec::new();
    let sizes_of = |axis: usize| readings_um.iter().map(move |reading| reading[axis].abs());
    let mut sizes: Vec<f64> = measured.iter().flat_map(|axis| sizes_of(*axis)).collect();
    sizes.sort_by(f64::total_cmp);
    let median = sizes[sizes.len() / 2];
    let largest = sizes.last().copied().unwrap_or(0.0);
    if median > LARGE_UM {
        remarks.push(format!(
            "the median deviation is {median:.0} µm: are `dx_um`, `dy_um`, `dz_um` in nm or places themselves?"
        ));
    }
    let extent = (0..3)
        .map(|axis| {
            let each = || places.iter().map(|place| place[axis]);
            each().fold(f64::NEG_INFINITY, f64::max) - each().fold(f64::INFINITY, f64::min)
        })
        .fold(0.0, f64::max);
    // No machine is as good as that over its travel, and a tracker is not placed so well.
    let small_um = SMALL_UM.max(SMALL_SHARE * extent * 1e3);
    let of_column = |axis: usize| sizes_of(axis).fold(0.0, f64::max);
    if largest > 0.0 && largest < small_um {
        remarks.push(format!(
            "the largest deviation is {} µm over {extent:.0} mm: are `dx_um`, `dy_um`, `dz_um` in mm?",
            significant(largest, 2)
        ));
    } else {
        for axis in measured.iter().copied() {
            let own = of_column(axis);
            let others = measured.iter().filter(|other| **other != axis).map(|other| of_column(*other));
            let others = others.fold(f64::INFINITY, f64::min);
            if own > 0.0 && own < small_um && own < UNLIKE * others {
                remarks.push(format!(
                    "`{}_um` is {} µm at most, and the other components are {others:.1} µm or more: is it in mm?",
                    COMPONENTS[axis],
                    significant(own, 2)
                ));
            }
        }
    }
    if extent > 0.0 && extent < 10.0 && largest > 1.0 {
        remarks.push(format!("all places are within {extent:.3} mm: are `x_mm`, `y_mm`, `z_mm` in m?"));
    }
    if extent > 50_000.0 {
        remarks.push(format!("the places are {extent:.0} mm apart: are `x_mm`, `y_mm`, `z_mm` in µm?"));
    }
    remarks
}
