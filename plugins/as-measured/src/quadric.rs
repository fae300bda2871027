//! Spheres and cylinders by least squares of the vertical distance.
//!
//! A form is described where its normal passes the middle of the points: height c, slopes b, curvature κ (positive where it bulges out of the material) and,
//! of a cylinder, the direction φ of its axis. With the unit normal n ∝ (−b, 1) and the axis d, which is tangent there, a point r = (x, y, h) of the form
//! obeys κ|r − (r·d)d|² + 2 n·r = 0, which has one root h that stays finite as κ goes to 0: a plane is no special case.

use nalgebra::{DMatrix, DVector};

/// Steps of the iteration, and the relative change of the sum of squares at which it ends.
const STEPS: usize = 60;
const SETTLED: f64 = 1e-14;
/// Damping at the beginning.
const DAMPING: f64 = 1e-3;
/// Step of a numerical derivative, as a share of what a parameter moves.
const STEP: f64 = 1e-6;

/// Which form.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Shape {
    Sphere,
    Cylinder,
    /// A circle in the plane of x and z.
    Circle,
}

/// A form that was fitted: x and y from `middle_mm`, all lengths in mm.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Quadric {
    shape: Shape,
    middle_mm: [f64; 2],
    parameters: Vec<f64>,
}

impl Quadric {
    /// The least-squares form of points `[x, y, z]` in mm; `None` where they do not determine it.
    pub(crate) fn fit(shape: Shape, points_mm: &[[f64; 3]]) -> Option<Self> {
        let count = points_mm.len() as f64;
        let middle_mm = [0, 1].map(|axis| points_mm.iter().map(|point| point[axis]).sum::<f64>() / count);
        let reach =
            |axis: usize| points_mm.iter().map(|point| (point[axis] - middle_mm[axis]).abs()).fold(0.0, f64::max);
        let reach_mm = reach(0).max(reach(1));
        let parameters = start(shape, points_mm, middle_mm, reach_mm)?;
        let mut fitted = Self { shape, middle_mm, parameters };
        fitted.settle(points_mm, reach_mm)?;
        Some(fitted)
    }

    /// Height of the form at a place, in mm.
    pub(crate) fn at(&self, x_mm: f64, y_mm: f64) -> f64 {
        height(self.shape, &self.parameters, x_mm - self.middle_mm[0], y_mm - self.middle_mm[1])
    }

    /// Curvature in 1/mm, positive where it bulges out of the material.
    pub(crate) fn curvature(&self) -> f64 {
        let place = if self.shape == Shape::Circle { 2 } else { 3 };
        self.parameters[place]
    }

    /// Direction of the axis of a cylinder from x, in degrees from 0 to 180.
    pub(crate) fn axis_deg(&self) -> Option<f64> {
        (self.shape == Shape::Cylinder).then(|| self.parameters[4].to_degrees().rem_euclid(180.0))
    }

    /// Levenberg-Marquardt.
    fn settle(&mut self, points_mm: &[[f64; 3]], reach_mm: f64) -> Option<()> {
        // What a parameter moves the form by at the rim is about 1 mm for each of these steps.
        let scales = scales(self.shape, reach_mm);
        let (mut sum, mut damping) = (self.sum(points_mm), DAMPING);
        for _ in 0..STEPS {
            let (normal, right) = self.equations(points_mm, &scales);
            let mut settled = true;
            for _ in 0..STEPS {
                let mut damped = normal.clone();
                // A flat cylinder has an axis in any direction.
                let least = 1e-15 * normal.diagonal().max();
                for place in 0..scales.len() {
                    damped[(place, place)] += damping * damped[(place, place)] + least;
                }
                let step = damped.cholesky()?.solve(&right);
                let moved = self
                    .parameters
                    .iter()
                    .zip(step.iter().zip(&scales))
                    .map(|(value, (step, scale))| value + step * scale);
                let next = Self { parameters: moved.collect(), ..self.clone() };
                let next_sum = next.sum(points_mm);
                if next_sum <= sum {
                    settled = sum - next_sum <= SETTLED * sum;
                    (self.parameters, sum, damping) = (next.parameters, next_sum, 0.1 * damping);
                    break;
                }
                damping *= 10.0;
            }
            if settled {
                break;
            }
        }
        self.parameters.iter().all(|value| value.is_finite()).then_some(())
    }

    fn sum(&self, points_mm: &[[f64; 3]]) -> f64 {
        points_mm.iter().map(|[x, y, z]| (z - self.at(*x, *y)).powi(2)).sum()
    }

    fn equations(&self, points_mm: &[[f64; 3]], scales: &[f64]) -> (DMatrix<f64>, DVector<f64>) {
        let count = scales.len();
        let (mut normal, mut right) = (DMatrix::zeros(count, count), DVector::zeros(count));
        let mut partials = vec![0.0; count];
        let mut moved = self.parameters.clone();
        for [x_mm, y_mm, z] in points_mm {
            let [x, y] = [x_mm - self.middle_mm[0], y_mm - self.middle_mm[1]];
            let residual = z - height(self.shape, &self.parameters, x, y);
            for (place, partial) in partials.iter_mut().enumerate() {
                let mut beside = |step: f64| {
                    moved[place] = self.parameters[place] + step * scales[place];
                    height(self.shape, &moved, x, y)
                };
                *partial = (beside(STEP) - beside(-STEP)) / (2.0 * STEP);
                moved[place] = self.parameters[place];
            }
            for row in 0..count {
                right[row] += partials[row] * residual;
                for column in 0..count {
                    normal[(row, column)] += partials[row] * partials[column];
                }
            }
        }
        (normal, right)
    }
}

/// What changes the form by 1 mm at the rim, about.
fn scales(shape: Shape, reach_mm: f64) -> Vec<f64> {
    let (slope, curvature) = (1.0 / reach_mm, 2.0 / (reach_mm * reach_mm));
    match shape {
        Shape::Circle => vec![1.0, slope, curvature],
        Shape::Sphere => vec![1.0, slope, slope, curvature],
        Shape::Cylinder => vec![1.0, slope, slope, curvature, 1.0],
    }
}

/// Height above the plane of x and y at a place from the middle.
fn height(shape: Shape, parameters: &[f64], x: f64, y: f64) -> f64 {
    let (level, [slope_x, slope_y], curvature, axis) = match (shape, parameters) {
        (Shape::Circle, &[level, slope, curvature]) => (level, [slope, 0.0], curvature, None),
        (Shape::Sphere, &[level, slope_x, slope_y, curvature]) => (level, [slope_x, slope_y], curvature, None),
        (Shape::Cylinder, &[level, slope_x, slope_y, curvature, axis]) => {
            (level, [slope_x, slope_y], curvature, Some(axis))
        }
        _ => return f64::NAN,
    };
    let up = 1.0 / (1.0 + slope_x * slope_x + slope_y * slope_y).sqrt();
    let [axis_x, axis_y, axis_z] = axis.map_or([0.0; 3], |axis: f64| {
        let [x, y] = [axis.cos(), axis.sin()];
        let rise = slope_x * x + slope_y * y;
        let length = (1.0 + rise * rise).sqrt();
        [x / length, y / length, rise / length]
    });
    let along = x * axis_x + y * axis_y;
    let square = curvature * (1.0 - axis_z * axis_z);
    let half = up - curvature * along * axis_z;
    let rest = curvature * (x * x + y * y - along * along) - 2.0 * up * (slope_x * x + slope_y * y);
    // Beyond the rim of the body its height there.
    level - rest / (half + (half * half - square * rest).max(0.0).sqrt())
}

/// Parameters of the polynomial of degree 2 that fits.
fn start(shape: Shape, points_mm: &[[f64; 3]], middle_mm: [f64; 2], reach_mm: f64) -> Option<Vec<f64>> {
    let terms = |x: f64, y: f64| match shape {
        Shape::Circle => vec![1.0, x, x * x],
        _ => vec![1.0, x, y, x * x, x * y, y * y],
    };
    let count = terms(0.0, 0.0).len();
    if points_mm.len() <= count || reach_mm.is_nan() || reach_mm <= 0.0 {
        return None;
    }
    let (mut normal, mut right) = (DMatrix::<f64>::zeros(count, count), DVector::<f64>::zeros(count));
    for [x, y, z] in points_mm {
        let row = DVector::from_vec(terms((x - middle_mm[0]) / reach_mm, (y - middle_mm[1]) / reach_mm));
        normal.ger(1.0, &row, &row, 1.0);
        right.axpy(*z, &row, 1.0);
    }
    let found = normal.cholesky()?.solve(&right);
    let (slope, bend) = (1.0 / reach_mm, 1.0 / (reach_mm * reach_mm));
    Some(match shape {
        Shape::Circle => vec![found[0], found[1] * slope, -2.0 * found[2] * bend],
        Shape::Sphere => vec![found[0], found[1] * slope, found[2] * slope, -(found[3] + found[5]) * bend],
        Shape::Cylinder => {
            let bends = nalgebra::Matrix2::new(found[3], 0.5 * found[4], 0.5 * found[4], found[5]).symmetric_eigen();
            let steep = usize::from(bends.eigenvalues[1].abs() > bends.eigenvalues[0].abs());
            let axis = bends.eigenvectors.column(1 - steep).into_owned();
            vec![
                found[0],
                found[1] * slope,
                found[2] * slope,
                -2.0 * bends.eigenvalues[steep] * bend,
                axis[1].atan2(axis[0]),
            ]
        }
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn grid(height: impl Fn(f64, f64) -> f64) -> Vec<[f64; 3]> {
        let nodes = (0..41)
            .flat_map(|row| (0..51).map(move |column| [0.1 * f64::from(column) + 3.0, 0.1 * f64::from(row) - 7.0]));
        nodes.map(|[x, y]| [x, y, height(x, y)]).collect()
    }

    fn left(found: &Quadric, points: &[[f64; 3]]) -> f64 {
        points.iter().map(|[x, y, z]| (z - found.at(*x, *y)).abs()).fold(0.0, f64::max)
    }

    /// Distance from a centre, and from an axis in space: no parameter of the fit is in these.
    #[test]
    fn exact_bodies_leave_nothing() {
        let sphere = grid(|x, y| 2.0 + (400.0 - (x - 9.0).powi(2) - (y + 4.0).powi(2)).sqrt());
        let found = Quadric::fit(Shape::Sphere, &sphere).unwrap();
        assert!(left(&found, &sphere) < 1e-11, "{}", left(&found, &sphere));
        assert!((1.0 / found.curvature() - 20.0).abs() < 1e-7, "{found:?}");
        // A hollow cylinder of radius 8 mm whose axis has the direction (cos 30°, sin 30°, 0.05).
        let direction = nalgebra::Vector3::new(30_f64.to_radians().cos(), 30_f64.to_radians().sin(), 0.05).normalize();
        let distance = |x: f64, y: f64, z: f64| {
            let from = nalgebra::Vector3::new(x - 5.0, y + 5.0, z - 9.0);
            (from - direction * from.dot(&direction)).norm()
        };
        let hollow = grid(|x, y| {
            let (mut low, mut high) = (-2.0, 5.0);
            for _ in 0..200 {
                let middle = 0.5 * (low + high);
                if distance(x, y, middle) > 8.0 { low = middle } else { high = middle }
            }
            low
        });
        let found = Quadric::fit(Shape::Cylinder, &hollow).unwrap();
        assert!(left(&found, &hollow) < 1e-10, "{}", left(&found, &hollow));
        assert!((1.0 / found.curvature() + 8.0).abs() < 1e-6, "{found:?}");
        assert!((found.axis_deg().unwrap() - 30.0).abs() < 0.3, "{found:?}");
        let circle: Vec<[f64; 3]> = (0..100)
            .map(|place| f64::from(place) * 0.05)
            .map(|x| [x, 0.0, (25.0 - (x - 1.0).powi(2)).sqrt()])
            .collect();
        let found = Quadric::fit(Shape::Circle, &circle).unwrap();
        assert!(left(&found, &circle) < 1e-11 && (1.0 / found.curvature() - 5.0).abs() < 1e-8);
    }

    #[test]
    fn a_plane_is_a_body_without_curvature() {
        let plane = grid(|x, y| 0.02 * x - 0.01 * y);
        for shape in [Shape::Sphere, Shape::Cylinder] {
            let found = Quadric::fit(shape, &plane).unwrap();
            assert!(left(&found, &plane) < 1e-12 && found.curvature().abs() < 1e-10);
        }
        assert_eq!(Quadric::fit(Shape::Sphere, &plane[..5]), None);
    }
}
