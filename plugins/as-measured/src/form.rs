//! Form that is removed before values are computed, and what it is called.

use runout_core::{
    Error, ErrorKind, Result, height_grid::HeightGrid, numerics::least_squares::Basis,
    standards::areal::without_polynomial, summary::Value,
};

use crate::{
    config::{AsMeasuredConfig, DEGREE, FormRemoval},
    quadric::{Quadric, Shape},
};

const MM_PER_NM: f64 = 1e-6;
const NM_PER_UM: f64 = 1e3;
/// Radii above so many times the extent are those of a plane.
const FLAT: f64 = 1e6;

/// What was removed.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Removed {
    /// Its name, which does not depend on the data: "least-squares sphere removed".
    pub name: String,
    /// What was found, behind the name: ", radius 10.0021 mm". Empty where there is nothing to say.
    pub found: String,
    /// Radius and direction of it.
    pub values: Vec<Value>,
}

/// Removes the form from a map, or from a profile as a map of one row.
///
/// # Errors
/// When the points do not determine it.
pub(crate) fn remove(grid: &mut HeightGrid, config: &AsMeasuredConfig, object: &str) -> Result<Removed> {
    let is_profile = grid.rows() == 1;
    let named = |name: String| Removed { name, found: String::new(), values: Vec::new() };
    match config.form.unwrap_or(FormRemoval::Plane) {
        FormRemoval::None => Ok(named("no form removed".into())),
        form @ (FormRemoval::Plane | FormRemoval::Polynomial) => {
            let degree = if form == FormRemoval::Plane { 1 } else { config.degree.unwrap_or(DEGREE) };
            if is_profile {
                polynomial(&mut grid.height_nm, degree);
            } else {
                let flat = without_polynomial(&grid.height_map()?, degree)?;
                grid.height_nm.iter_mut().zip(flat.heights_um()).for_each(|(height, left)| *height = NM_PER_UM * left);
            }
            Ok(named(match (form, is_profile) {
                (FormRemoval::Plane, true) => "least-squares line removed".into(),
                (FormRemoval::Plane, false) => "least-squares plane removed".into(),
                _ => format!("least-squares polynomial of degree {degree} removed"),
            }))
        }
        form => quadric(grid, form, is_profile, object),
    }
}

fn quadric(grid: &mut HeightGrid, form: FormRemoval, is_profile: bool, object: &str) -> Result<Removed> {
    let (shape, name) = match form {
        _ if is_profile => (Shape::Circle, "circle"),
        FormRemoval::Sphere => (Shape::Sphere, "sphere"),
        _ => (Shape::Cylinder, "cylinder"),
    };
    let place = |index: usize| {
        let (row, column) = (index / grid.columns, index % grid.columns);
        [grid.origin_x_mm + grid.step_x_mm * column as f64, grid.origin_y_mm + grid.step_y_mm * row as f64]
    };
    let known = grid.height_nm.iter().enumerate().filter(|(_, height)| height.is_finite());
    let points: Vec<[f64; 3]> = known
        .map(|(index, height)| {
            let [x, y] = place(index);
            [x, y, MM_PER_NM * height]
        })
        .collect();
    let found = Quadric::fit(shape, &points).ok_or_else(|| {
        Error::new("fit a form to", object, format!("its {} points determine no {name}", points.len()))
            .of(ErrorKind::InsufficientData)
    })?;
    let forms: Vec<f64> = (0..grid.height_nm.len())
        .map(|index| {
            let [x, y] = place(index);
            found.at(x, y) / MM_PER_NM
        })
        .collect();
    grid.height_nm.iter_mut().zip(forms).for_each(|(height, form)| *height -= form);
    let radius_mm = 1.0 / found.curvature();
    let extent_mm = grid.step_x_mm * grid.columns as f64 + grid.step_y_mm * grid.rows() as f64;
    if radius_mm.abs() > FLAT * extent_mm {
        return Ok(Removed {
            name: format!("least-squares {name} removed"),
            found: ", which is flat".into(),
            values: Vec::new(),
        });
    }
    let side = if radius_mm > 0.0 { "outer" } else { "inner" };
    let value = |symbol: &str, value: f64, unit: &str, about: String| {
        Value::new(symbol, value, f64::NAN, unit, &about).of("form")
    };
    let about =
        format!("radius of the {name} that is removed, an {side} surface, by least squares of the vertical distance");
    let mut values = vec![value("radius", radius_mm.abs(), "mm", about)];
    values.extend(
        found
            .axis_deg()
            .map(|axis| value("axis", axis, "deg", "direction of the cylinder's axis from x towards y".into())),
    );
    Ok(Removed {
        name: format!("least-squares {name} removed"),
        found: format!(", radius {:.6} mm", radius_mm.abs()),
        values,
    })
}

/// A row without its polynomial of a degree.
fn polynomial(heights: &mut [f64], degree: usize) {
    let known: Vec<usize> = (0..heights.len()).filter(|place| heights[*place].is_finite()).collect();
    let last = (heights.len().max(2) - 1) as f64;
    let columns = (0..=degree).map(|power| {
        // Chebyshev polynomials: their columns stay independent at any degree.
        known
            .iter()
            .map(|place| (power as f64 * (2.0 * *place as f64 / last - 1.0).clamp(-1.0, 1.0).acos()).cos())
            .collect()
    });
    let mut left: Vec<f64> = known.iter().map(|place| heights[*place]).collect();
    Basis::of(columns.collect()).remove_from(&mut left);
    known.iter().zip(left).for_each(|(place, left)| heights[*place] = left);
}
