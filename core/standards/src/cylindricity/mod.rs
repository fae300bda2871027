//! Cylindricity (ISO 12180-1): reference cylinders of a wall, exact in space, and the deviations about them.
//!
//! The cylinders belong to the points (R + r)(cos θ, sin θ) at z themselves, at right angles to the tilted axis.

mod columns;
mod determine;
mod disturbed;
mod least_squares;
mod lines;
mod points;
mod search;
mod series;
mod zone;

use super::near::DeviationSpread;
pub use super::reference::{Reference, Undetermined};
pub use disturbed::Disturbed;
pub use lines::{Generatrices, MedianLine};
pub use points::{Points, Section};
pub use series::Series;

/// A reference cylinder.
#[derive(Debug, Clone, PartialEq)]
pub struct Cylinder {
    /// Height, midway along the wall, at which the axis passes through (`x_um`, `y_um`).
    pub z_mm: f64,
    /// The axis there, from the axis of angles.
    pub x_um: f64,
    /// Place of the axis along y at `z_mm`, from the axis of angles, in µm.
    pub y_um: f64,
    /// dx/dz of the axis, in µrad (1000 µrad are 1 µm/mm).
    pub slope_x_urad: f64,
    /// dy/dz of the axis.
    pub slope_y_urad: f64,
    /// Its radius less the nominal one.
    pub deviation_um: f64,
    /// What holds it; empty for LSCY.
    pub touches: Vec<Touch>,
}

/// A point that holds a reference cylinder.
///
/// With the derivatives g of a point's distance by the axis' four coordinates, Σ λg over the outer equals Σ λg over the
/// inner, and either λ add up to 1 (of MCCY the inner to 10⁻³ and the outer to 1.001, of MICY the other way round). That is
/// the proof that no small move of the axis helps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Touch {
    /// Which point.
    pub point: usize,
    /// Whether from outside the part: at the zone's outer cylinder, or MCCY.
    pub outer: bool,
    /// λ ≥ 0.
    pub multiplier: f64,
}

/// Deviations of a wall about a reference cylinder, in µm (ISO 12180-1, parameters).
///
/// CYLt is defined about all four cylinders, the others about LSCY; about another cylinder they are what the same formula
/// gives.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Values {
    /// Peak to valley, CYLt.
    pub cylt_um: f64,
    /// Largest deviation outwards, CYLp.
    pub cylp_um: f64,
    /// Largest deviation inwards, as a positive number, CYLv.
    pub cylv_um: f64,
    /// Root mean square deviation over the points that are there, CYLq.
    pub cylq_um: f64,
    /// Points that are there.
    pub points: usize,
}

impl From<DeviationSpread> for Values {
    fn from(course: DeviationSpread) -> Self {
        Self {
            cylt_um: course.high - course.low,
            cylp_um: course.high.max(0.0),
            cylv_um: (-course.low).max(0.0),
            cylq_um: course.rms(),
            points: course.points,
        }
    }
}
