//! The least-squares cylinder.

use nalgebra::{DMatrix, DVector};

use crate::{least_squares, scan::Scan};

/// A cylinder near the nominal one: to first order, its deviation from the nominal radius is
///
/// d(α, z) = r + (x + dx·(z − z₀)) cos α + (y + dy·(z − z₀)) sin α.
///
/// What first order leaves out is e²/(2R) of the axis's offset e: 1 nm for 5 µm on a radius of 15 mm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Its radius less the nominal one, in µm.
    pub radius_offset_um: f64,
    /// Where its axis passes [`z_mm`](Self::z_mm), in µm.
    pub x_um: f64,
    /// The same along y.
    pub y_um: f64,
    /// Slope of the axis dx/dz, in µm per mm.
    pub slope_x_um_per_mm: f64,
    /// Slope of the axis dy/dz, in µm per mm.
    pub slope_y_um_per_mm: f64,
    /// Middle of the points that it was fitted to.
    pub z_mm: f64,
}

impl Cylinder {
    /// Fits the five parameters to points; `None` where they cannot tell them, as on a single height.
    pub(crate) fn fit(points: &[Scan]) -> Option<Self> {
        let heights = points.iter().flat_map(|scan| &scan.z_mm);
        let (low, high) =
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(*z), high.max(*z)));
        let z_mm = 0.5 * (low + high);
        let rows: Vec<[f64; 6]> = points
            .iter()
            .flat_map(Scan::iter)
            .map(|(angle, z, deviation)| {
                let ((sine, cosine), arm) = (angle.sin_cos(), z - z_mm);
                [1.0, cosine, sine, arm * cosine, arm * sine, deviation]
            })
            .collect();
        let matrix = DMatrix::from_fn(rows.len(), 5, |row, column| rows[row][column]);
        let right = DVector::from_iterator(rows.len(), rows.iter().map(|row| row[5]));
        let found = least_squares::solve(matrix, right)?;
        let [radius_offset_um, x_um, y_um, slope_x_um_per_mm, slope_y_um_per_mm] = found.values[..] else {
            return None;
        };
        Some(Self { radius_offset_um, x_um, y_um, slope_x_um_per_mm, slope_y_um_per_mm, z_mm })
    }

    /// Its deviation from the nominal radius, in µm.
    #[must_use]
    pub fn deviation_um(&self, angle_rad: f64, z_mm: f64) -> f64 {
        let (sine, cosine) = angle_rad.sin_cos();
        let arm = z_mm - self.z_mm;
        self.radius_offset_um
            + (self.x_um + self.slope_x_um_per_mm * arm) * cosine
            + (self.y_um + self.slope_y_um_per_mm * arm) * sine
    }

    /// Tilt of the axis about x and y, right-handed, in µrad: about +x it moves the upper end towards −y.
    #[must_use]
    pub fn tilt_urad(&self) -> [f64; 2] {
        // µm per mm are mrad; the tilt is its own tangent at this size.
        [-1e3 * self.slope_y_um_per_mm, 1e3 * self.slope_x_um_per_mm]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shifted_and_tilted_cylinder_is_found_again() {
        // Radii seen from the nominal axis, exactly: |R' (cos, sin) + axis offset| along the ray at each angle.
        let (radius, offset, slope) = (15_000.0, [4.0, -3.0], [0.15, 0.17]);
        let scans: Vec<Scan> = [2.0, 9.0, 16.0]
            .map(|z| {
                let axis: [f64; 2] = std::array::from_fn(|axis| offset[axis] + slope[axis] * (z - 9.0));
                let mut scan = Scan::default();
                for index in 0..50 {
                    let angle = 0.13 * f64::from(index);
                    let along = axis[0] * angle.cos() + axis[1] * angle.sin();
                    let across = axis[1] * angle.cos() - axis[0] * angle.sin();
                    let reach = along + ((radius + 2.0_f64).powi(2) - across * across).sqrt();
                    scan.push(angle, z, reach - radius);
                }
                scan
            })
            .into();
        let found = Cylinder::fit(&scans).unwrap();
        // e²/(2R) = 26/30000 µm is what first order leaves out.
        let tolerance = 1e-3;
        assert!((found.radius_offset_um - 2.0).abs() < tolerance, "{found:?}");
        assert!((found.x_um - 4.0).abs() < tolerance && (found.y_um + 3.0).abs() < tolerance, "{found:?}");
        let tilt = found.tilt_urad();
        // 1e-3 µm over a lever of 7 mm.
        assert!((tilt[0] + 170.0).abs() < 0.15 && (tilt[1] - 150.0).abs() < 0.15, "{tilt:?}");
        assert!(Cylinder::fit(&scans[..1]).is_none());
    }
}
