//! Roundness (ISO 12181-1): reference circles of a profile, exact in the plane, and the deviations about them.
//!
//! The circles belong to the points (R + rᵢ)(cos θᵢ, sin θᵢ) themselves. The limaçon that a roundness instrument's
//! linear equations fit instead differs from them by terms of deviation²/R; here no such term is left out, so the same
//! functions serve polar plots about a base circle of any size and points of the plane.
//!
//! ```
//! use runout_standards::roundness::{Angles, Points, Reference};
//!
//! let angles = Angles::equal(360);
//! let form_um: Vec<f64> = (0..360).map(|i| 2.0 * f64::from(3 * i).to_radians().cos()).collect();
//! let mut points = Points::default();
//! points.set_profile(&angles, &form_um, 30.0);
//! let circle = points.reference(Reference::MinimumZone).unwrap();
//! assert!((points.values(&circle).ront_um - 4.0).abs() < 1e-3);
//! ```

mod circumscribed;
mod crests;
mod determine;
mod disturbed;
mod equal_heights;
mod least_squares;
mod points;
mod search;
mod series;
mod warm;

use super::near::DeviationSpread;
pub use super::reference::{Reference, Undetermined};
pub use crests::{Heights, Sum};
pub use disturbed::{CircleSearch, Disturbed};
pub use points::{Angles, Points};
pub use series::{Located, Series, between_angles};

/// A reference circle.
#[derive(Debug, Clone, PartialEq)]
pub struct Circle {
    /// Its centre from the origin of angles (of coordinates, for points of the plane).
    pub x_um: f64,
    /// Its centre along y, from the origin of angles (of coordinates, for points of the plane).
    pub y_um: f64,
    /// Its radius less [`Points::radius_um`], without the rounding that the radius itself would bring.
    pub deviation_um: f64,
    /// Points that touch it, or the zone's outer circle, from outside the part; ascending.
    pub outer: Vec<usize>,
    /// Points that touch it, or the zone's inner circle, from inside; ascending.
    pub inner: Vec<usize>,
}

/// Deviations of a profile about a reference circle, in µm (ISO 12181-1, parameters).
///
/// RONt is defined about all four circles, the others about LSCI; about another circle they are what the same formula
/// gives. The local deviation is the distance from the centre less the circle's radius.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Values {
    /// Peak to valley, RONt.
    pub ront_um: f64,
    /// Largest deviation outwards, RONp.
    pub ronp_um: f64,
    /// Largest deviation inwards, as a positive number, RONv.
    pub ronv_um: f64,
    /// Root mean square deviation over the points that are there, RONq.
    pub ronq_um: f64,
    /// Points that are there.
    pub points: usize,
}

impl From<DeviationSpread> for Values {
    fn from(course: DeviationSpread) -> Self {
        Self {
            ront_um: course.high - course.low,
            ronp_um: course.high.max(0.0),
            ronv_um: (-course.low).max(0.0),
            ronq_um: course.rms(),
            points: course.points,
        }
    }
}

/// Peak-to-valley deviation RONt about the least-squares reference circle LSCI (ISO 12181-1), in µm.
///
/// `form_um` lies on equal angles and holds no orders 0 and 1: its least-squares circle is then the nominal circle, up
/// to terms of form²/radius.
#[must_use]
pub fn ront_lsci_um(form_um: &[f64]) -> f64 {
    let [low, high] = ends_um(form_um);
    high - low
}

/// The lowest and the highest at an angle; missing points are NaN, and so are both where nothing is there.
fn ends_um(profile_um: &[f64]) -> [f64; 2] {
    // Lanes that do not wait for each other: draws ask for this many thousand times.
    let (mut low, mut high) = ([f64::INFINITY; 8], [f64::NEG_INFINITY; 8]);
    for chunk in profile_um.chunks(8) {
        for (value, (low, high)) in chunk.iter().zip(low.iter_mut().zip(&mut high)) {
            *low = if *value < *low { *value } else { *low };
            *high = if *value > *high { *value } else { *high };
        }
    }
    let low = low.into_iter().fold(f64::INFINITY, f64::min);
    let high = high.into_iter().fold(f64::NEG_INFINITY, f64::max);
    if low > high { [f64::NAN; 2] } else { [low, high] }
}
