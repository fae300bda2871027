//! Form removal: what is left is what a texture is evaluated on.

use nalgebra::{DMatrix, DVector};

use super::HeightMap;
use crate::{Error, Result};

/// Highest degree of a polynomial form.
const HIGHEST_DEGREE: usize = 8;
/// Singular values below this share of the largest are none: directions that the points measured cannot tell.
const RANK: f64 = 1e-12;

/// A map without the least-squares cylinder: mean radius, the axis' offset and its tilt, linear in deviations that are
/// small against the radius. Heights are then 1, cos θ, sin θ, z·cos θ and z·sin θ.
///
/// # Errors
/// Of a map that is not closed.
pub fn without_cylinder(map: &HeightMap) -> Result<HeightMap<'static>> {
    if !map.closed() {
        let problem = "only a map that goes all the way round is one";
        return Err(Error::new("remove", "the cylinder", problem).help("remove a polynomial instead"));
    }
    let angles: Vec<(f64, f64)> = (0..map.columns())
        .map(|column| (std::f64::consts::TAU * column as f64 / map.columns() as f64).sin_cos())
        .collect();
    Ok(without(map, 5, |row, column, terms| {
        let (sine, cosine) = angles[column];
        let z = middled(row, map.rows());
        terms.copy_from_slice(&[1.0, cosine, sine, z * cosine, z * sine]);
    }))
}

/// A closed map without the least-squares line along the axis: mean radius and taper. It is what a plane is of a wall, which
/// cannot slope around.
///
/// # Errors
/// Of a map that is not closed.
pub fn without_taper(map: &HeightMap) -> Result<HeightMap<'static>> {
    if !map.closed() {
        let problem = "only a map that goes all the way round has one";
        return Err(Error::new("remove", "the taper", problem).help("remove a polynomial of degree 1 instead"));
    }
    Ok(without(map, 2, |row, _, terms| terms.copy_from_slice(&[1.0, middled(row, map.rows())])))
}

/// A closed map without the least-squares body whose radius and centre are polynomials of a degree along the axis: 1, cos θ
/// and sin θ times powers of z. Degree 1 is a cone with a tilted axis, degree 2 a barrel with a bent one.
///
/// # Errors
/// Above degree 8, and of a map that is not closed.
pub fn without_turned_body(map: &HeightMap, degree: usize) -> Result<HeightMap<'static>> {
    let failure = |problem: String| Err(Error::new("remove", "the form", problem));
    if degree > HIGHEST_DEGREE {
        return failure(format!("its degree is {degree}; {HIGHEST_DEGREE} is the highest"));
    }
    if !map.closed() {
        return failure("only a map that goes all the way round is a turned body".into());
    }
    let angles: Vec<(f64, f64)> = (0..map.columns())
        .map(|column| (std::f64::consts::TAU * column as f64 / map.columns() as f64).sin_cos())
        .collect();
    let along: Vec<[f64; HIGHEST_DEGREE + 1]> = (0..map.rows()).map(|row| legendre(middled(row, map.rows()))).collect();
    Ok(without(map, 3 * (degree + 1), |row, column, terms| {
        let (sine, cosine) = angles[column];
        for (terms, power) in terms.as_chunks_mut::<3>().0.iter_mut().zip(&along[row]) {
            *terms = [1.0, cosine, sine].map(|term| term * power);
        }
    }))
}

/// A map without the least-squares polynomial in x and y of a total degree (0 the mean, 1 a plane).
///
/// # Errors
/// Above degree 8, and for degrees above 0 of a map that is closed: a polynomial has a step where it closes.
pub fn without_polynomial(map: &HeightMap, degree: usize) -> Result<HeightMap<'static>> {
    let failure = |problem: String| Err(Error::new("remove", "the polynomial", problem));
    if degree > HIGHEST_DEGREE {
        return failure(format!("its degree is {degree}; {HIGHEST_DEGREE} is the highest"));
    }
    if degree > 0 && map.closed() {
        return failure("the map goes all the way round, a polynomial does not".into());
    }
    let across: Vec<[f64; HIGHEST_DEGREE + 1]> =
        (0..map.columns()).map(|column| legendre(middled(column, map.columns()))).collect();
    let along: Vec<[f64; HIGHEST_DEGREE + 1]> = (0..map.rows()).map(|row| legendre(middled(row, map.rows()))).collect();
    let count = (degree + 1) * (degree + 2) / 2;
    Ok(without(map, count, |row, column, terms| {
        let powers = (0..=degree).flat_map(|x| (0..=degree - x).map(move |y| (x, y)));
        for (term, (x, y)) in terms.iter_mut().zip(powers) {
            *term = across[column][x] * along[row][y];
        }
    }))
}

/// −1 to 1 over the points of a line.
fn middled(point: usize, points: usize) -> f64 {
    2.0 * point as f64 / (points - 1) as f64 - 1.0
}

/// Legendre polynomials: nearly orthogonal on equal distances, so that normal equations do not lose digits.
fn legendre(x: f64) -> [f64; HIGHEST_DEGREE + 1] {
    let mut values = [1.0, x, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0];
    for n in 1..HIGHEST_DEGREE {
        let order = n as f64;
        values[n + 1] = ((2.0 * order + 1.0) * x * values[n] - order * values[n - 1]) / (order + 1.0);
    }
    values
}

/// The map without the least-squares combination of terms, which `fill` computes at a row and column.
fn without(map: &HeightMap, count: usize, fill: impl Fn(usize, usize, &mut [f64])) -> HeightMap<'static> {
    let columns = map.columns();
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    let mut terms = vec![0.0; count];
    for (point, height) in map.heights_um().iter().enumerate().filter(|(_, height)| height.is_finite()) {
        fill(point / columns, point % columns, &mut terms);
        for (column, term) in terms.iter().enumerate() {
            right[column] += term * height;
            for (row, other) in terms[..=column].iter().enumerate() {
                normal[(row, column)] += term * other;
            }
        }
    }
    normal.fill_lower_triangle_with_upper_triangle();
    let svd = normal.svd(true, true);
    let smallest = RANK * svd.singular_values.max();
    // Both factors were asked for: there is a solution.
    let solution = svd.solve(&right, smallest).unwrap_or_else(|_| DVector::zeros(count));
    let left = map.heights_um().iter().enumerate().map(|(point, height)| {
        fill(point / columns, point % columns, &mut terms);
        height - terms.iter().zip(solution.iter()).map(|(term, share)| term * share).sum::<f64>()
    });
    let left: Vec<f64> = left.collect();
    map.with(left)
}
