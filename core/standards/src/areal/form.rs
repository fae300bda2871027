//! Form removal: what is left is what a texture is evaluated on.

use std::borrow::Cow;

use nalgebra::{DMatrix, DVector};

use super::HeightMap;
use runout_error::{Error, ErrorKind, Result};
use runout_numerics::lanes::product;

/// Highest degree of a polynomial form.
const HIGHEST_DEGREE: usize = 8;
/// Singular values below this share of the largest are none: directions that the points measured do not determine.
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
    let along = (0..map.rows()).map(|row| vec![1.0, middled(row, map.rows())]).collect();
    let products = vec![[0, 0], [1, 0], [2, 0], [1, 1], [2, 1]];
    Ok(without(map, &Terms { across: around(map), along, products }))
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
    let along = (0..map.rows()).map(|row| vec![1.0, middled(row, map.rows())]).collect();
    let across = vec![vec![1.0; map.columns()]];
    Ok(without(map, &Terms { across, along, products: vec![[0, 0], [0, 1]] }))
}

/// A closed map without the least-squares body whose radius and centre are polynomials of a degree along the axis: 1, cos θ
/// and sin θ times powers of z. Degree 1 is a cone with a tilted axis, degree 2 a barrel with a bent one.
///
/// # Errors
/// Above degree 8, and of a map that is not closed.
pub fn without_turned_body(map: &HeightMap, degree: usize) -> Result<HeightMap<'static>> {
    let failure = |problem: String| Err(Error::new("remove", "the form", problem).of(ErrorKind::Configuration));
    if degree > HIGHEST_DEGREE {
        return failure(format!("its degree is {degree}; {HIGHEST_DEGREE} is the highest"));
    }
    if !map.closed() {
        return failure("only a map that goes all the way round is a turned body".into());
    }
    let along = (0..map.rows()).map(|row| legendre(middled(row, map.rows())).to_vec()).collect();
    let products = (0..=degree).flat_map(|power| [[0, power], [1, power], [2, power]]).collect();
    Ok(without(map, &Terms { across: around(map), along, products }))
}

/// A map without the least-squares polynomial in x and y of a total degree (0 the mean, 1 a plane).
///
/// # Errors
/// Above degree 8, and for degrees above 0 of a map that is closed: a polynomial has a step where it closes.
pub fn without_polynomial(map: &HeightMap, degree: usize) -> Result<HeightMap<'static>> {
    let failure = |problem: String| Err(Error::new("remove", "the polynomial", problem).of(ErrorKind::Configuration));
    if degree > HIGHEST_DEGREE {
        return failure(format!("its degree is {degree}; {HIGHEST_DEGREE} is the highest"));
    }
    if degree > 0 && map.closed() {
        return failure("the map goes all the way round, a polynomial does not".into());
    }
    let points: Vec<[f64; HIGHEST_DEGREE + 1]> =
        (0..map.columns()).map(|column| legendre(middled(column, map.columns()))).collect();
    let across = (0..=degree).map(|power| points.iter().map(|point| point[power]).collect()).collect();
    let along = (0..map.rows()).map(|row| legendre(middled(row, map.rows())).to_vec()).collect();
    let products = (0..=degree).flat_map(|x| (0..=degree - x).map(move |y| [x, y])).collect();
    Ok(without(map, &Terms { across, along, products }))
}

/// 1, cosine and sine of the columns of a closed map.
fn around(map: &HeightMap) -> Vec<Vec<f64>> {
    let angles = || (0..map.columns()).map(|column| std::f64::consts::TAU * column as f64 / map.columns() as f64);
    vec![vec![1.0; map.columns()], angles().map(f64::cos).collect(), angles().map(f64::sin).collect()]
}

/// What is fitted: products of a function of the column and one of the row.
struct Terms {
    /// Functions over the columns, `[function][column]`.
    across: Vec<Vec<f64>>,
    /// Functions over the rows, `[row][function]`.
    along: Vec<Vec<f64>>,
    /// Of each term, its function across and its function along.
    products: Vec<[usize; 2]>,
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

/// The map without the least-squares combination of terms.
fn without(map: &HeightMap, Terms { across, along, products: terms }: &Terms) -> HeightMap<'static> {
    let (columns, count, functions) = (map.columns(), terms.len(), across.len());
    let mut normal = DMatrix::<f64>::zeros(count, count);
    let mut right = DVector::<f64>::zeros(count);
    // Σ over the columns of one row, of products of two functions; the same for every row that is whole.
    let sums_of = |known: &[Vec<f64>]| -> Vec<f64> {
        known.iter().flat_map(|one| across.iter().map(|other| product(one, other))).collect()
    };
    let whole = sums_of(across);
    let whole_row = |row: &[f64]| row.iter().all(|height| height.is_finite());
    for (row, along) in map.heights_um().chunks_exact(columns).zip(along) {
        let known: Vec<f64>;
        let (row, products) = if whole_row(row) {
            (row, Cow::Borrowed(&whole))
        } else {
            let there = |(height, function): (&f64, &f64)| if height.is_finite() { *function } else { 0.0 };
            let masked: Vec<Vec<f64>> =
                across.iter().map(|function| row.iter().zip(function).map(there).collect()).collect();
            known = row.iter().map(|height| if height.is_finite() { *height } else { 0.0 }).collect();
            (&known[..], Cow::Owned(sums_of(&masked)))
        };
        let sums: Vec<f64> = across.iter().map(|function| product(function, row)).collect();
        for (column, [x, y]) in terms.iter().enumerate() {
            right[column] += sums[*x] * along[*y];
            for (row, [other_x, other_y]) in terms[..=column].iter().enumerate() {
                normal[(row, column)] += products[x * functions + other_x] * along[*y] * along[*other_y];
            }
        }
    }
    normal.fill_lower_triangle_with_upper_triangle();
    let svd = normal.svd(true, true);
    let smallest = RANK * svd.singular_values.max();
    // Both factors were asked for: there is a solution.
    let solution = svd.solve(&right, smallest).unwrap_or_else(|_| DVector::zeros(count));
    let mut left = map.heights_um().to_vec();
    let mut shares = vec![0.0; functions];
    for (row, along) in left.chunks_exact_mut(columns).zip(along) {
        shares.fill(0.0);
        for ([x, y], share) in terms.iter().zip(solution.iter()) {
            shares[*x] += share * along[*y];
        }
        for (share, function) in shares.iter().zip(across) {
            row.iter_mut().zip(function).for_each(|(height, function)| *height -= share * function);
        }
    }
    map.with(left)
}
