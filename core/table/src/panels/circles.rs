//! Reference circles of the curves of a polar figure.

use arrow_array::RecordBatch;

use super::{
    Panels,
    columns::{Names, Numbers, joined},
};
use crate::circles::{CENTRE, CIRCLE, ECCENTRICITY, FILTER, GAUSSIAN_UPR, PEAK, RADIUS, REFUTED_BY, RONT, VALLEY};

/// A reference circle of a curve behind a filter; what is not known is NaN.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    /// The filter of the curve.
    pub filter: String,
    /// Cut-off of a Gaussian low-pass, 0 without filter; NaN for other filters.
    pub gaussian_upr: f64,
    /// Symbol of the circle.
    pub symbol: String,
    /// Its centre from the origin of the curve.
    pub centre: [f64; 2],
    /// Its radius less the nominal one.
    pub radius: f64,
    /// Peak to valley about it, and its standard uncertainty.
    pub ront: [f64; 2],
    /// Whether its own data refute that value.
    pub is_refuted: bool,
    /// Angle in degrees and deviation of the highest point about it.
    pub peak: [f64; 2],
    /// Angle in degrees and deviation of the lowest point about it.
    pub valley: [f64; 2],
    /// Distance of the centre from the axis, and the angle to it in degrees.
    pub eccentricity: [f64; 2],
}

impl Circle {
    /// With lengths in another unit.
    pub(super) fn scaled(&self, scale: f64) -> Self {
        let both = |[one, other]: [f64; 2]| [scale * one, scale * other];
        Self {
            centre: both(self.centre),
            radius: scale * self.radius,
            ront: both(self.ront),
            peak: [self.peak[0], scale * self.peak[1]],
            valley: [self.valley[0], scale * self.valley[1]],
            eccentricity: [scale * self.eccentricity[0], self.eccentricity[1]],
            ..self.clone()
        }
    }
}

impl Panels {
    /// Takes rows of the table of reference circles; those of curves that are not drawn are left out.
    pub(super) fn add_circles(&mut self, rows: &RecordBatch) {
        let names = |columns: &[String]| columns.iter().map(|column| Names::of(rows, column)).collect::<Vec<_>>();
        let (panel_names, curve_names) = (names(&self.panel_columns), names(&self.curve_columns));
        let text = |column: &str, row: usize| Names::of(rows, column).get(row).to_owned();
        let number = |column: &str, row: usize| Numbers::of(rows, column).map_or(f64::NAN, |all| all.get(row));
        for row in 0..rows.num_rows() {
            let (panel, curve) = (joined(&panel_names, row), joined(&curve_names, row));
            let panel = self.drawn.iter_mut().rev().find(|known| known.name == panel);
            let curve = panel.and_then(|panel| panel.curves.iter_mut().find(|known| known.name == curve));
            let Some(curve) = curve else { continue };
            let both = |columns: [&str; 2]| columns.map(|column| number(column, row));
            curve.circles.push(Circle {
                filter: text(FILTER, row),
                gaussian_upr: number(GAUSSIAN_UPR, row),
                symbol: text(CIRCLE, row),
                centre: both(CENTRE),
                radius: number(RADIUS, row),
                ront: both(RONT),
                is_refuted: !text(REFUTED_BY, row).is_empty(),
                peak: both(PEAK),
                valley: both(VALLEY),
                eccentricity: both(ECCENTRICITY),
            });
        }
    }
}
