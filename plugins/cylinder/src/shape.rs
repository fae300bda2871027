//! The least-squares cylinder, and where points are relative to its axis.

use nalgebra::Vector3;

use runout_core::numerics::least_squares::Basis;

use crate::scan::Scan;

/// A cylinder near the nominal one, whose axis is z. A measured point of angle α, height z and deviation d is the point at
/// (R + d)·(cos α, sin α) and z, where R is the nominal radius.
///
/// Distances count from the fitted axis exactly: an axis that is off centre by e changes the radii that the nominal axis
/// sees by e²/(2R) and more, and the section of a tilted cylinder at one height is an ellipse.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// The nominal radius R, in mm.
    pub nominal_mm: f64,
    /// Its radius less the nominal one, in µm.
    pub radius_offset_um: f64,
    /// Where its axis passes [`z_mm`](Self::z_mm), in µm.
    pub x_um: f64,
    /// Place of its axis along y at [`z_mm`](Self::z_mm), in µm.
    pub y_um: f64,
    /// Slope of the axis dx/dz, in µm per mm; 0 where the tilt is not observable.
    pub slope_x_um_per_mm: f64,
    /// Slope of the axis dy/dz, in µm per mm; 0 where the tilt is not observable.
    pub slope_y_um_per_mm: f64,
    /// Middle of the points that it was fitted to.
    pub z_mm: f64,
    /// Whether the tilt of the axis was fitted.
    pub tilted: bool,
}

/// Steps of the fit at most: an axis that is off centre by a tenth of the radius takes six.
const STEPS: usize = 50;
/// The fit ends when a step moves no point by more than this share of the radius: rounding.
const SETTLED: f64 = 1e-14;

impl Cylinder {
    /// Fits radius, position and, where `tilted`, direction of the axis: the least squares of the points' distances from the
    /// cylinder (LSCY of ISO 12180-1; LSCI of ISO 12181-1 where the axis is parallel to z). `None` where the points do not
    /// determine these.
    pub(crate) fn fit(points: &[Scan], nominal_mm: f64, tilted: bool) -> Option<Self> {
        let heights = points.iter().flat_map(|scan| &scan.z_mm);
        let (low, high) =
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(*z), high.max(*z)));
        let mut fitted = Self {
            nominal_mm,
            radius_offset_um: 0.0,
            x_um: 0.0,
            y_um: 0.0,
            slope_x_um_per_mm: 0.0,
            slope_y_um_per_mm: 0.0,
            z_mm: 0.5 * (low + high),
            tilted,
        };
        let reach_mm = 0.5 * (high - low);
        for _ in 0..STEPS {
            let moved_um = fitted.improve(points)?.into_iter().zip([1.0, 1.0, 1.0, reach_mm, reach_mm]);
            let moved_um = moved_um.map(|(step, reach)| (step * reach).abs()).fold(0.0, f64::max);
            if moved_um <= SETTLED * 1e3 * nominal_mm {
                break;
            }
        }
        Some(fitted)
    }

    /// One Gauss-Newton step; gives how far it went: radius, and position and slope of the axis.
    fn improve(&mut self, points: &[Scan]) -> Option<[f64; 5]> {
        let columns = if self.tilted { 5 } else { 3 };
        let frame = self.frame();
        let placed: Vec<(f64, f64, f64)> =
            points.iter().flat_map(Scan::iter).map(|(angle, z, deviation)| frame.place(angle, z, deviation)).collect();
        let entry = |column: usize, (angle, z, _): &(f64, f64, f64)| {
            let arm = z - self.z_mm;
            match column {
                0 => 1.0,
                1 => angle.cos(),
                2 => angle.sin(),
                3 => arm * angle.cos(),
                _ => arm * angle.sin(),
            }
        };
        let column = |column: usize| placed.iter().map(|place| entry(column, place)).collect();
        let basis = Basis::of((0..columns).map(column).collect());
        if basis.dependent() {
            return None;
        }
        let found = basis.coefficients(&placed.iter().map(|(_, _, form)| *form).collect::<Vec<f64>>());
        let mut step = [0.0; 5];
        step.iter_mut().zip(&found).for_each(|(step, value)| *step = *value);
        self.radius_offset_um += step[0];
        let [across, other, along] = &frame.axes;
        let direction = along + (across * step[3] + other * step[4]) / UM_PER_MM;
        let at = frame.origin + across * step[1] + other * step[2];
        [self.slope_x_um_per_mm, self.slope_y_um_per_mm] =
            [direction.x, direction.y].map(|share| UM_PER_MM * share / direction.z);
        // The axis is given where it passes z_mm.
        let foot = at - direction * (at.z / direction.z);
        (self.x_um, self.y_um) = (foot.x, foot.y);
        step.iter().all(|step| step.is_finite()).then_some(step)
    }

    /// The points relative to its axis: angle and height about and along it, and distance from its surface in µm.
    #[must_use]
    pub(crate) fn place(&self, scan: &Scan) -> Scan {
        let frame = self.frame();
        let mut placed = Scan::default();
        for (angle, z, deviation) in scan.iter() {
            let (angle, z, form) = frame.place(angle, z, deviation);
            placed.push(angle, z, form);
        }
        placed
    }

    /// First-order run-out of its axis at a place on it, in µm: what the linear model of the closed loop has to find.
    pub(crate) fn run_out_um(&self, angle_rad: f64, z_mm: f64) -> f64 {
        let (sine, cosine) = angle_rad.sin_cos();
        let arm = z_mm - self.z_mm;
        (self.x_um + self.slope_x_um_per_mm * arm) * cosine + (self.y_um + self.slope_y_um_per_mm * arm) * sine
    }

    /// Tilt of the axis about x and y, right-handed, in µrad: about +x it moves the upper end towards −y.
    #[must_use]
    pub fn tilt_urad(&self) -> [f64; 2] {
        let urad = |slope_um_per_mm: f64| 1e6 * (slope_um_per_mm / UM_PER_MM).atan();
        [-urad(self.slope_y_um_per_mm), urad(self.slope_x_um_per_mm)]
    }

    /// A height, or the end of a range of sections where it is beyond by no more than the heights within a section differ: the
    /// points of a circle at one height of the machine have different heights along a tilted axis.
    pub(crate) fn at_end(&self, z_mm: f64, ends: Option<(f64, f64)>) -> f64 {
        let waver_mm = 1e-3 * self.slope_x_um_per_mm.hypot(self.slope_y_um_per_mm) * self.radius_mm();
        match ends {
            Some((low, high)) if z_mm > low - waver_mm && z_mm < high + waver_mm => z_mm.clamp(low, high),
            _ => z_mm,
        }
    }

    /// Its radius, in mm.
    #[must_use]
    pub fn radius_mm(&self) -> f64 {
        self.nominal_mm + self.radius_offset_um / UM_PER_MM
    }

    fn frame(&self) -> Frame {
        let along = Vector3::new(self.slope_x_um_per_mm, self.slope_y_um_per_mm, UM_PER_MM).normalize();
        // The least rotation that takes z to the axis: angles keep their meaning.
        let share = (1.0 + along.z).recip();
        let across = Vector3::new(1.0 - along.x * along.x * share, -along.x * along.y * share, -along.x);
        let other = Vector3::new(-along.x * along.y * share, 1.0 - along.y * along.y * share, -along.y);
        Frame {
            origin: Vector3::new(self.x_um, self.y_um, 0.0),
            axes: [across, other, along],
            z_mm: self.z_mm,
            nominal_um: UM_PER_MM * self.nominal_mm,
            radius_um: UM_PER_MM * self.nominal_mm + self.radius_offset_um,
        }
    }
}

const UM_PER_MM: f64 = 1e3;

/// The coordinates about the axis: lengths in µm, z from the cylinder's `z_mm`.
struct Frame {
    origin: Vector3<f64>,
    axes: [Vector3<f64>; 3],
    z_mm: f64,
    nominal_um: f64,
    radius_um: f64,
}

impl Frame {
    /// (angle in rad, z in mm, distance from the surface in µm) of a measured point.
    fn place(&self, angle_rad: f64, z_mm: f64, deviation_um: f64) -> (f64, f64, f64) {
        let (sine, cosine) = angle_rad.sin_cos();
        let radius_um = self.nominal_um + deviation_um;
        let point = Vector3::new(radius_um * cosine, radius_um * sine, UM_PER_MM * (z_mm - self.z_mm)) - self.origin;
        let [x, y, z] = [0, 1, 2].map(|axis| self.axes[axis].dot(&point));
        (y.atan2(x), self.z_mm + z / UM_PER_MM, x.hypot(y) - self.radius_um)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// An axis far off centre and tilted by 2 mrad: circles at constant height see an ellipse. Points by bisection along the
    /// ray of each angle, distances by the cross product.
    #[test]
    fn a_cylinder_far_off_centre_is_found_exactly() {
        let (radius, through, direction) = (25_002.0, [500.0, -300.0, 9_000.0], [1.5e-3, 1.7e-3, 1.0]);
        let distance = |point: [f64; 3]| {
            let [x, y, z] = [0, 1, 2].map(|axis| point[axis] - through[axis]);
            let [u, v, w]: [f64; 3] = direction;
            let cross = [y * w - z * v, z * u - x * w, x * v - y * u];
            (cross.iter().map(|entry| entry * entry).sum::<f64>() / (u * u + v * v + w * w)).sqrt()
        };
        let scans: Vec<Scan> = [2.0, 9.0, 16.0]
            .map(|z| {
                let mut scan = Scan::default();
                for index in 0..50 {
                    let angle = 0.13 * f64::from(index);
                    let at = |reach: f64| [reach * angle.cos(), reach * angle.sin(), 1e3 * z];
                    let (mut low, mut high) = (20_000.0, 30_000.0);
                    for _ in 0..80 {
                        let middle = 0.5 * (low + high);
                        if distance(at(middle)) < radius { low = middle } else { high = middle }
                    }
                    scan.push(angle, z, low - 25_000.0);
                }
                scan
            })
            .into();
        let found = Cylinder::fit(&scans, 25.0, true).unwrap();
        // 1e-8 µm: rounding of 25 000 µm over 150 points; slopes over a lever of 7 mm.
        let tolerance = 1e-8;
        assert!((found.radius_offset_um - 2.0).abs() < tolerance, "{found:?}");
        assert!((found.x_um - 500.0).abs() < tolerance && (found.y_um + 300.0).abs() < tolerance, "{found:?}");
        let tilt = found.tilt_urad();
        assert!((tilt[0] + 1e6 * 1.7e-3_f64.atan()).abs() < 1e-5, "{tilt:?}");
        assert!((tilt[1] - 1e6 * 1.5e-3_f64.atan()).abs() < 1e-5, "{tilt:?}");
        for scan in &scans {
            assert!(found.place(scan).deviation_um.iter().all(|form| form.abs() < 1e-7));
        }
        assert!(Cylinder::fit(&scans[..1], 25.0, true).is_none());
        // At one height the ellipse is left: R·tilt²/4 = 25 000 · (1.5² + 1.7²)·1e-6/4 = 0.0321 µm of 2/rev.
        let alone = Cylinder::fit(&scans[..1], 25.0, false).unwrap();
        let largest = alone.place(&scans[0]).deviation_um.into_iter().fold(0.0, f64::max);
        assert!((largest - 0.0321).abs() < 5e-4, "{largest}");
    }
}
