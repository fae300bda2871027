//! Coordinates of a coordinate measuring machine as angle, distance and height about the axis of the part, which is found from them.

use nalgebra::{Matrix3, Matrix5, Vector3, Vector5};
use runout_core::points::Column;
use schemars::JsonSchema;
use serde::Deserialize;

/// Direction near which the axis of a part lies.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "lowercase")]
pub enum Axis {
    /// Along x.
    X,
    /// Along y.
    Y,
    /// Along z.
    Z,
}

/// Steps of the iteration.
const STEPS: usize = 50;
/// Heights over a smaller share of the radius do not show the tilt of the axis.
const SHOWS_TILT: f64 = 0.1;
/// Another direction that leaves less than so many times the least is as likely.
const LIKELY: f64 = 3.0;
/// Points that are so much flatter than they are wide lie in a plane, and those that a circle leaves so small a share of its radius are on one.
const FLAT: f64 = 0.02;
const ROUND: f64 = 0.01;
/// Fewest points: as many as parameters, and one.
const FEWEST: usize = 6;

/// Points about an axis.
pub(crate) struct About {
    /// `angle_deg`, `radius_mm` and `z_mm`.
    pub columns: [Column; 3],
    /// What was found, in words.
    pub remark: String,
}

struct Fitted {
    axis: Axis,
    /// Place and slope of the axis, radius: x₀, y₀, a, b, R in mm.
    parameters: Vector5<f64>,
    rms_mm: f64,
}

/// Places about the least-squares axis near a direction; without one, near the direction that leaves least.
pub(crate) fn about(points_mm: &[[f64; 3]], axis: Option<Axis>) -> Result<About, String> {
    if points_mm.len() < FEWEST {
        return Err(format!("{} points do not determine an axis", points_mm.len()));
    }
    let candidates = axis.map_or_else(|| vec![Axis::X, Axis::Y, Axis::Z], |axis| vec![axis]);
    let mut found: Vec<Fitted> = candidates.into_iter().filter_map(|axis| fit(points_mm, axis)).collect();
    found.sort_by(|one, other| one.rms_mm.total_cmp(&other.rms_mm));
    let best = found.first().ok_or("they lie on no circle and no cylinder")?;
    // Through points near a plane there is a cylinder along it too, as large as one likes.
    let flat = across_plane(points_mm).filter(|_| axis.is_none());
    let is_circle = |one: &&Fitted| flat == Some(one.axis) && one.rms_mm < ROUND * one.parameters[4];
    if let Some(circle) = found.iter().find(is_circle) {
        return Ok(circle.placed(points_mm));
    }
    if let Some(other) = found.get(1).filter(|other| other.rms_mm < LIKELY * best.rms_mm) {
        return Err(format!(
            "an axis near {:?} leaves {:.4} mm, one near {:?} {:.4} mm: `axis` in [load] says which one it is",
            best.axis, best.rms_mm, other.axis, other.rms_mm
        )
        .to_lowercase());
    }
    Ok(best.placed(points_mm))
}

/// The direction nearest to the normal of the plane in which points lie.
fn across_plane(points_mm: &[[f64; 3]]) -> Option<Axis> {
    let points = || points_mm.iter().map(|point| Vector3::from(*point));
    let middle = points().sum::<Vector3<f64>>() / points_mm.len() as f64;
    let spread: Matrix3<f64> = points().map(|point| (point - middle) * (point - middle).transpose()).sum();
    let principal = spread.symmetric_eigen();
    let mut order = [0, 1, 2];
    order.sort_by(|one, other| principal.eigenvalues[*one].total_cmp(&principal.eigenvalues[*other]));
    let is_flat = principal.eigenvalues[order[0]] < FLAT * FLAT * principal.eigenvalues[order[1]];
    let normal = principal.eigenvectors.column(order[0]).abs();
    is_flat.then(|| [Axis::X, Axis::Y, Axis::Z][normal.imax()])
}

/// Coordinates with the axis as the third.
fn turned([x, y, z]: [f64; 3], axis: Axis) -> Vector3<f64> {
    match axis {
        Axis::X => Vector3::new(y, z, x),
        Axis::Y => Vector3::new(z, x, y),
        Axis::Z => Vector3::new(x, y, z),
    }
}

/// Gauss-Newton on the distance from the axis, from the circle that fits algebraically.
fn fit(points_mm: &[[f64; 3]], axis: Axis) -> Option<Fitted> {
    let points: Vec<Vector3<f64>> = points_mm.iter().map(|point| turned(*point, axis)).collect();
    let count = points.len() as f64;
    let middle = points.iter().sum::<Vector3<f64>>() / count;
    let (mut normal, mut right) = (nalgebra::Matrix3::<f64>::zeros(), Vector3::zeros());
    for point in &points {
        let row = Vector3::new(point.x - middle.x, point.y - middle.y, 1.0);
        normal += row * row.transpose();
        right += row * (row.x * row.x + row.y * row.y);
    }
    let start = normal.lu().solve(&right)?;
    let radius = (start.z + 0.25 * (start.x * start.x + start.y * start.y)).max(0.0).sqrt();
    let heights = points.iter().map(|point| point.z);
    let range = heights.clone().fold(f64::NEG_INFINITY, f64::max) - heights.fold(f64::INFINITY, f64::min);
    let shows_tilt = range > SHOWS_TILT * radius;
    let mut parameters = Vector5::new(middle.x + 0.5 * start.x, middle.y + 0.5 * start.y, 0.0, 0.0, radius);
    for _ in 0..STEPS {
        let (mut normal, mut right) = (Matrix5::<f64>::zeros(), Vector5::<f64>::zeros());
        for point in &points {
            let (across, distance) = distance(point, &parameters, middle.z);
            let [x, y] = [across.x / distance, across.y / distance];
            let z = if shows_tilt { point.z - middle.z } else { 0.0 };
            let row = Vector5::new(-x, -y, -x * z, -y * z, -1.0);
            normal += row * row.transpose();
            right -= row * (distance - parameters[4]);
        }
        if !shows_tilt {
            (normal[(2, 2)], normal[(3, 3)]) = (1.0, 1.0);
        }
        let step = normal.lu().solve(&right)?;
        parameters += step;
        if step.norm() < 1e-13 * radius {
            break;
        }
    }
    let squares =
        points.iter().map(|point| (distance(point, &parameters, middle.z).1 - parameters[4]).powi(2)).sum::<f64>();
    // From here on the axis passes the height 0.
    let slopes = [parameters[2], parameters[3]];
    parameters[0] -= slopes[0] * middle.z;
    parameters[1] -= slopes[1] * middle.z;
    let rms_mm = (squares / count).sqrt();
    (rms_mm.is_finite() && parameters[4] > 0.0).then_some(Fitted { axis, parameters, rms_mm })
}

/// From the axis to a point, at right angles to it, and how long that is.
fn distance(point: &Vector3<f64>, parameters: &Vector5<f64>, middle_z: f64) -> (Vector3<f64>, f64) {
    let direction = Vector3::new(parameters[2], parameters[3], 1.0).normalize();
    let from = point - Vector3::new(parameters[0], parameters[1], middle_z);
    let across = from - direction * from.dot(&direction);
    (across, across.norm().max(f64::MIN_POSITIVE))
}

impl Fitted {
    fn placed(&self, points_mm: &[[f64; 3]]) -> About {
        let [x, y, a, b, radius] = <[f64; 5]>::from(self.parameters);
        let direction = Vector3::new(a, b, 1.0).normalize();
        let first = (Vector3::x() - direction * direction.x).normalize();
        let second = direction.cross(&first);
        let [mut angle_deg, mut radius_mm, mut z_mm] = [const { Vec::new() }; 3];
        for point in points_mm {
            let from = turned(*point, self.axis) - Vector3::new(x, y, 0.0);
            let [u, v] = [from.dot(&first), from.dot(&second)];
            angle_deg.push(v.atan2(u).to_degrees().rem_euclid(360.0));
            radius_mm.push(u.hypot(v));
            z_mm.push(from.dot(&direction));
        }
        let [one, two, along] = match self.axis {
            Axis::X => ["y", "z", "x"],
            Axis::Y => ["z", "x", "y"],
            Axis::Z => ["x", "y", "z"],
        };
        let remark = format!(
            "the axis is near {along}: it passes {one} = {x:.5} mm, {two} = {y:.5} mm at {along} = 0 with slopes of {:.1} and {:.1} µrad; least-squares radius \
             {radius:.6} mm, which leaves {:.3} µm rms. Angles count from {one} towards {two}",
            1e6 * a,
            1e6 * b,
            1e3 * self.rms_mm
        );
        let column = |name: &str, values: Vec<f64>| Column { name: name.into(), values };
        About {
            columns: [column("angle_deg", angle_deg), column("radius_mm", radius_mm), column("z_mm", z_mm)],
            remark,
        }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// A tilted cylinder of radius 12.5 mm about a point in space, three circles of 40 points.
    fn cylinder() -> Vec<[f64; 3]> {
        let direction = Vector3::new(0.01, -0.02, 1.0).normalize();
        let first = direction.cross(&Vector3::new(0.3, 1.0, 0.2)).normalize();
        let second = direction.cross(&first);
        let circle = |z: f64| (0..40).map(move |index| (f64::from(index) * 9.0_f64.to_radians(), z));
        [-8.0, 0.0, 15.0]
            .into_iter()
            .flat_map(circle)
            .map(|(angle, z)| {
                let point = Vector3::new(101.0, -52.0, 33.0)
                    + direction * z
                    + (first * angle.cos() + second * angle.sin()) * 12.5;
                [point.x, point.y, point.z]
            })
            .collect()
    }

    #[test]
    fn axis_and_heights_of_a_cylinder_are_found() {
        let points = cylinder();
        for axis in [Some(Axis::Z), None] {
            let found = about(&points, axis).unwrap();
            let [angle, radius, z] = &found.columns;
            assert!(radius.values.iter().all(|radius| (radius - 12.5).abs() < 1e-9), "{}", found.remark);
            // Heights of a circle are one height.
            assert!(z.values[..40].iter().all(|height| (height - z.values[0]).abs() < 1e-9));
            assert!((z.values[40] - z.values[0] - 8.0).abs() < 1e-9);
            assert!(((angle.values[1] - angle.values[0]).rem_euclid(360.0) - 9.0).abs() < 1e-9);
        }
        // The same, with another axis along x.
        let lying: Vec<[f64; 3]> = points.iter().map(|[x, y, z]| [*z, *x, *y]).collect();
        assert!(about(&lying, None).unwrap().remark.contains("near x"));
    }

    #[test]
    fn a_circle_at_one_height_has_no_tilt() {
        let circle: Vec<[f64; 3]> = (0..90)
            .map(|index| f64::from(index).to_radians() * 4.0)
            .map(|angle| [3.0 + 5.0 * angle.cos(), 5.0 * angle.sin(), 7.0])
            .collect();
        let found = about(&circle, None).unwrap();
        assert!(
            found.remark.contains("slopes of 0.0 and 0.0") && found.remark.contains("5.000000 mm"),
            "{}",
            found.remark
        );
        assert!(about(&circle[..4], None).is_err());
    }

    /// Heights that scatter, and a plane out of level: a cylinder of metres lies along the plane too, and leaves as little.
    #[test]
    fn one_circle_of_a_measuring_machine_is_a_circle() {
        for (scatter_mm, slope) in [(1e-3, 0.0), (0.0, 1e-4), (1e-3, 1e-3)] {
            let circle: Vec<[f64; 3]> = (0..90)
                .map(|index| (f64::from(index), f64::from(index).to_radians() * 4.0))
                .map(|(index, angle)| {
                    let x = 3.0 + 20.0 * angle.cos();
                    [
                        x,
                        20.0 * angle.sin() + 1e-3 * (index * 1.7).cos(),
                        7.0 + slope * x + scatter_mm * (index * 2.3).sin(),
                    ]
                })
                .collect();
            let found = about(&circle, None).unwrap();
            assert!(found.remark.contains("near z"), "{scatter_mm} {slope}: {}", found.remark);
        }
        // A strip of a cylinder along x is as flat.
        let strip: Vec<[f64; 3]> = (0..90)
            .map(|index| (f64::from(index % 9) - 4.0, f64::from(index / 9)))
            .map(|(across, along)| [10.0 * along, across, 0.5 * across * across / 200.0])
            .collect();
        assert!(!about(&strip, None).is_ok_and(|found| found.remark.contains("near z")));
    }
}
