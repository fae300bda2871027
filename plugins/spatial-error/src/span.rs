//! What places span: a point, a line, a plane, space; and their convex hull.

use nalgebra::{DMatrix, DVector, Matrix3, SymmetricEigen, Vector3};

/// Places thinner than this share of their extent span nothing in this direction.
const THIN: f64 = 1e-4;
/// Distance from the hull, as a share of the extent, that is none.
const ON: f64 = 1e-7;
/// Steps to the nearest point of a hull at most.
const STEPS: usize = 200;

/// The affine span of places, with their hull.
#[derive(Debug, Clone)]
pub struct Span {
    middle: Vector3<f64>,
    /// Directions in which the places do not extend.
    missing: Vec<Vector3<f64>>,
    extent: f64,
    /// Places that may be corners of the hull.
    corners: Vec<Vector3<f64>>,
}

impl Span {
    /// Of places.
    #[must_use]
    pub fn of(places: &[[f64; 3]]) -> Self {
        let points: Vec<Vector3<f64>> = places.iter().map(|place| Vector3::from(*place)).collect();
        let middle = points.iter().sum::<Vector3<f64>>() / points.len().max(1) as f64;
        let spread: Matrix3<f64> = points.iter().map(|point| (point - middle) * (point - middle).transpose()).sum();
        let directions = SymmetricEigen::new(spread).eigenvectors;
        let thickness = |direction: &Vector3<f64>| {
            points.iter().map(|point| (point - middle).dot(direction).abs()).fold(0.0, f64::max)
        };
        let extent = points.iter().map(|point| (point - middle).norm()).fold(0.0, f64::max);
        let all = directions.column_iter().map(Vector3::from);
        let missing = all.filter(|direction| thickness(direction) <= THIN * extent).collect();
        Self { middle, missing, extent, corners: corners(points) }
    }

    /// 0 a point, 1 a line, 2 a plane, 3 space.
    #[must_use]
    pub fn dimensions(&self) -> usize {
        3 - self.missing.len()
    }

    /// Whether a place is in the span: predictions elsewhere are lost.
    #[must_use]
    pub fn holds(&self, place: [f64; 3]) -> bool {
        let from = Vector3::from(place) - self.middle;
        self.missing.iter().all(|direction| from.dot(direction).abs() <= 2.0 * THIN * self.extent + 1e-9)
    }

    /// Whether a place is outside the convex hull.
    #[must_use]
    pub fn is_outside(&self, place: [f64; 3]) -> bool {
        let from = Vector3::from(place);
        let along = |point: &Vector3<f64>| {
            // Within a plane or a line, what is off it does not count.
            let mut at = point - from;
            for direction in &self.missing {
                at -= direction * at.dot(direction);
            }
            at
        };
        let points: Vec<Vector3<f64>> = self.corners.iter().map(along).collect();
        distance(&points, ON * self.extent) > ON * self.extent
    }
}

/// Places but for those between two others on a line along an axis: these are no corners.
fn corners(mut points: Vec<Vector3<f64>>) -> Vec<Vector3<f64>> {
    for axis in 0..3 {
        let (a, b) = ((axis + 1) % 3, (axis + 2) % 3);
        points.sort_by(|one, other| {
            one[a].total_cmp(&other[a]).then(one[b].total_cmp(&other[b])).then(one[axis].total_cmp(&other[axis]))
        });
        let same = |one: &Vector3<f64>, other: &Vector3<f64>| {
            one[a].to_bits() == other[a].to_bits() && one[b].to_bits() == other[b].to_bits()
        };
        let is_end = |index: usize| {
            let first = index == 0 || !same(&points[index - 1], &points[index]);
            first || index + 1 == points.len() || !same(&points[index + 1], &points[index])
        };
        points = (0..points.len()).filter(|index| is_end(*index)).map(|index| points[index]).collect();
    }
    points
}

/// Distance of the origin from the convex hull of points, or a number above `enough` as soon as it is known to be further away.
///
/// P. Wolfe, *Finding the nearest point in a polytope*, Mathematical Programming 11 (1976) 128.
fn distance(points: &[Vector3<f64>], enough: f64) -> f64 {
    let Some(first) = points.iter().min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared())) else {
        return f64::INFINITY;
    };
    let mut used = vec![*first];
    let mut weights = vec![1.0];
    let mut nearest = *first;
    for _ in 0..STEPS {
        let size = nearest.norm();
        if size <= enough {
            return size;
        }
        let Some(next) = points.iter().min_by(|a, b| nearest.dot(a).total_cmp(&nearest.dot(b))) else { break };
        // All points are beyond a plane that is further away than `enough`.
        if nearest.dot(next) > enough * size {
            return size;
        }
        if nearest.dot(next) >= size * size * (1.0 - 1e-12) || used.contains(next) {
            return size;
        }
        used.push(*next);
        weights.push(0.0);
        loop {
            let Some(affine) = affine_nearest(&used) else {
                used.pop();
                weights.pop();
                return size;
            };
            if affine.iter().all(|weight| *weight > 1e-12) {
                weights = affine;
                break;
            }
            let share = weights
                .iter()
                .zip(&affine)
                .filter(|(_, to)| **to <= 1e-12)
                .map(|(from, to)| from / (from - to).max(1e-300))
                .fold(1.0, f64::min);
            for (weight, to) in weights.iter_mut().zip(&affine) {
                *weight += share * (to - *weight);
            }
            let kept: Vec<bool> = weights.iter().map(|weight| *weight > 1e-12).collect();
            let keep = |index: &usize| kept[*index];
            used = (0..used.len()).filter(keep).map(|index| used[index]).collect();
            weights = (0..weights.len()).filter(keep).map(|index| weights[index]).collect();
            if used.len() == 1 {
                weights = vec![1.0];
                break;
            }
        }
        nearest = used.iter().zip(&weights).map(|(point, weight)| point * *weight).sum();
    }
    nearest.norm()
}

/// Weights of the point nearest to the origin in the affine span of points.
fn affine_nearest(points: &[Vector3<f64>]) -> Option<Vec<f64>> {
    let count = points.len();
    let scale = points.iter().map(Vector3::norm_squared).fold(0.0, f64::max).max(f64::MIN_POSITIVE);
    let mut system = DMatrix::<f64>::zeros(count + 1, count + 1);
    for row in 0..count {
        for column in 0..count {
            system[(row, column)] = points[row].dot(&points[column]) / scale;
        }
        system[(row, count)] = 1.0;
        system[(count, row)] = 1.0;
    }
    let mut right = DVector::zeros(count + 1);
    right[count] = 1.0;
    let solved = system.lu().solve(&right)?;
    let weights: Vec<f64> = solved.iter().take(count).copied().collect();
    weights.iter().all(|weight| weight.is_finite()).then_some(weights)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_has_eight_corners_and_an_inside() {
        let grid: Vec<[f64; 3]> = (0..125)
            .map(|index| [index % 5, index / 5 % 5, index / 25].map(|at| 30.0 * f64::from(at) - 11.0))
            .collect();
        let span = Span::of(&grid);
        assert_eq!((span.corners.len(), span.dimensions()), (8, 3));
        for (place, outside) in [
            ([0.0, 0.0, 0.0], false),
            ([-11.0, -11.0, -11.0], false),
            ([109.0, 50.0, 50.0], false),
            ([109.001, 50.0, 50.0], true),
            ([50.0, 50.0, -12.0], true),
            ([500.0, 900.0, -12.0], true),
            ([50.0, 50.0, 50.0], false),
        ] {
            assert_eq!(span.is_outside(place), outside, "{place:?}");
        }
    }

    /// Against all half-spaces through three points: brute force.
    #[test]
    fn scattered_places_have_the_hull_of_all_half_spaces() {
        let mut seed = 7_u64;
        let mut uniform = || {
            seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (seed >> 11) as f64 / (1_u64 << 53) as f64
        };
        let places: Vec<[f64; 3]> = (0..25).map(|_| [100.0 * uniform(), 300.0 * uniform(), 10.0 * uniform()]).collect();
        let points: Vec<Vector3<f64>> = places.iter().map(|place| Vector3::from(*place)).collect();
        let span = Span::of(&places);
        let mut counts = [0, 0];
        for _ in 0..300 {
            let query = [120.0 * uniform() - 10.0, 340.0 * uniform() - 20.0, 12.0 * uniform() - 1.0];
            let mut outside = false;
            for i in 0..25 {
                for j in 0..i {
                    for k in 0..j {
                        let normal = (points[j] - points[i]).cross(&(points[k] - points[i]));
                        let sides = points.iter().map(|point| (point - points[i]).dot(&normal));
                        let (low, high) = sides.fold((0.0_f64, 0.0_f64), |(a, b), side| (a.min(side), b.max(side)));
                        let own = (Vector3::from(query) - points[i]).dot(&normal);
                        let tiny = 1e-9 * normal.norm();
                        outside |= (low > -tiny && own < -tiny) || (high < tiny && own > tiny);
                    }
                }
            }
            counts[usize::from(outside)] += 1;
            assert_eq!(span.is_outside(query), outside, "{query:?}");
        }
        assert!(counts.iter().all(|count| *count > 20), "{counts:?}");
    }

    #[test]
    fn a_tilted_plane_is_one() {
        let plane: Vec<[f64; 3]> = (0..36_u32)
            .map(|index| {
                let (a, b) = (f64::from(index % 6) * 20.0, f64::from(index / 6) * 30.0);
                [a, b, 0.5 * a - 0.2 * b + 3.0]
            })
            .collect();
        let span = Span::of(&plane);
        assert_eq!(span.dimensions(), 2);
        assert!(span.holds([10.0, 10.0, 6.0]) && !span.holds([10.0, 10.0, 7.0]));
        assert!(!span.is_outside([10.0, 10.0, 6.0]) && span.is_outside([-10.0, 10.0, -4.0]));
        let line: Vec<[f64; 3]> = (0..9_u32).map(|index| [f64::from(index), 0.0, 5.0]).collect();
        assert_eq!(Span::of(&line).dimensions(), 1);
        assert_eq!(Span::of(&[[1.0, 2.0, 3.0]]).dimensions(), 0);
    }
}
