//! The points of a wall, and what they are about an axis.

use std::sync::OnceLock;

use super::{
    Cylinder, Values,
    columns::{About, Axis, Columns},
};
use crate::{near::DeviationSpread, roundness::Angles};

/// One circle of a wall.
#[derive(Debug, Clone, Copy)]
pub struct Section<'a> {
    /// Its height.
    pub z_mm: f64,
    /// Directions of its points.
    pub angles: &'a Angles,
    /// Radial deviations from the nominal radius, one at each angle; what is not finite is missing.
    pub form_um: &'a [f64],
}

/// Points of a wall.
///
/// A point p at height z is held as f = p/R, w = (|p|² − R²)/2R and ζ, which is −1 and 1 at the ends of the wall. About
/// the axis (x, y) + (a, b)·z its squared distance is |q|² − (a·q₁ + b·q₂)²/(1 + a² + b²) with q = p − (x, y) − (a, b)·z:
/// what the plane knows, less a term for the tilt.
#[derive(Debug, Clone)]
pub struct Points {
    pub(super) radius_um: f64,
    pub(super) middle_mm: f64,
    pub(super) half_um: f64,
    /// f, w and ζ; w is NaN where the point is missing.
    pub(super) held: Columns,
    /// The largest |w|.
    pub(super) span_um: f64,
    /// LSCY, from which all others are sought, once it is known: its axis and radius deviation.
    pub(super) least_squares: OnceLock<Option<(Axis, f64)>>,
}

/// A point: sine and cosine of its angle, z in mm, radial deviation in µm.
pub(super) type Place = ((f64, f64), f64, f64);

fn is_there(z_mm: f64, form_um: f64) -> bool {
    z_mm.is_finite() && form_um.is_finite()
}

impl Points {
    /// Points (angle in rad, z in mm, radial deviation in µm) about a nominal radius (positive).
    #[must_use]
    pub fn new(radius_mm: f64, points: impl IntoIterator<Item = (f64, f64, f64)>) -> Self {
        let points: Vec<_> = points.into_iter().map(|(angle, z, form)| (angle.sin_cos(), z, form)).collect();
        Self::of(radius_mm, points.len(), points.iter().copied())
    }

    /// The points of sections, one after the other.
    #[must_use]
    pub fn of_sections(radius_mm: f64, sections: &[Section]) -> Self {
        let points = sections.iter().flat_map(|section| {
            let directions = section.angles.sin_cos().zip(section.form_um);
            directions.map(|(direction, form)| (direction, section.z_mm, *form))
        });
        Self::of(radius_mm, sections.iter().map(|section| section.form_um.len()).sum(), points)
    }

    /// So many points, passed over twice.
    pub(super) fn of(radius_mm: f64, count: usize, points: impl Iterator<Item = Place> + Clone) -> Self {
        let radius_um = 1e3 * radius_mm;
        let heights = points.clone().filter(|(_, z, form)| is_there(*z, *form)).map(|(_, z, _)| z);
        let (bottom, top) =
            heights.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
        let (middle_mm, half_mm) = (0.5 * (bottom + top), 0.5 * (top - bottom));
        let least_squares = OnceLock::new();
        let half_um = 1e3 * half_mm;
        let mut all = Self { radius_um, middle_mm, half_um, held: Columns::default(), span_um: 0.0, least_squares };
        all.held.reserve(count);
        points.for_each(|point| all.push(point));
        all
    }

    /// Adds a point. LSCY, where it is known, stays that of the points before.
    pub(super) fn push(&mut self, ((sin, cos), z_mm, form_um): Place) {
        if is_there(z_mm, form_um) {
            let scale = 1.0 + form_um / self.radius_um;
            let level = form_um + form_um * form_um / (2.0 * self.radius_um);
            self.span_um = self.span_um.max(level.abs());
            self.held.push([scale * cos, scale * sin, level, self.zeta(z_mm)]);
        } else {
            self.held.push([0.0, 0.0, f64::NAN, 0.0]);
        }
    }

    /// Leaves the first points only.
    pub(super) fn truncate(&mut self, count: usize) {
        self.held.truncate(count);
    }

    /// Where a height is along the wall: −1 and 1 at its ends.
    pub(super) fn zeta(&self, z_mm: f64) -> f64 {
        1e3 * (z_mm - self.middle_mm) / self.half_um
    }

    /// Points, those that are missing included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.held.len()
    }

    /// Whether there is no point.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Share of the points that are there.
    #[must_use]
    pub fn coverage(&self) -> f64 {
        self.there().count() as f64 / self.len() as f64
    }

    pub(super) fn there(&self) -> impl Iterator<Item = usize> + '_ {
        let levels = self.held.levels().iter().enumerate();
        levels.filter(|(_, level)| !level.is_nan()).map(|(point, _)| point)
    }

    /// Deviation of each point from a cylinder, at right angles to its axis, outward positive; NaN where it is missing.
    pub fn deviations_um(&self, cylinder: &Cylinder) -> impl Iterator<Item = f64> + use<> {
        let lean = 1e-6 * self.half_um;
        let moved = 1e3 * (self.middle_mm - cylinder.z_mm) * 1e-6;
        let [x, y] = [(cylinder.x_um, cylinder.slope_x_urad), (cylinder.y_um, cylinder.slope_y_urad)]
            .map(|(at, slope)| at + slope * moved);
        let axis = [x, y, cylinder.slope_x_urad * lean, cylinder.slope_y_urad * lean];
        let deviation = cylinder.deviation_um;
        self.held.deviations(&self.frame(&axis)).into_iter().map(move |distance| distance - deviation)
    }

    /// CYLt, CYLp, CYLv and CYLq about a cylinder; NaN where no point is there.
    #[must_use]
    pub fn values(&self, cylinder: &Cylinder) -> Values {
        DeviationSpread::of(self.deviations_um(cylinder)).into()
    }

    /// What distances from an axis need of it.
    pub(super) fn frame(&self, axis: &Axis) -> About {
        About::new(axis, self.radius_um, self.half_um)
    }

    /// Distance from an axis less R, and its derivatives by the axis.
    pub(super) fn with_slopes(&self, point: usize, axis: &Axis) -> (f64, Axis) {
        self.frame(axis).with_slopes(self.held.at(point))
    }

    /// Deviations that differ by less are equal: rounding of coordinates.
    pub(super) fn tolerance(&self) -> f64 {
        4.0 * f64::EPSILON * (self.radius_um + self.span_um)
    }

    pub(super) fn about(&self, axis: Axis, deviation_um: f64, touches: Vec<super::Touch>) -> Cylinder {
        let [x_um, y_um, ..] = axis;
        let [slope_x_urad, slope_y_urad] = [axis[2], axis[3]].map(|lean| 1e6 * lean / self.half_um);
        Cylinder { z_mm: self.middle_mm, x_um, y_um, slope_x_urad, slope_y_urad, deviation_um, touches }
    }
}
