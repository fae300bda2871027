//! Error motion values of an axis that was measured at standing positions: synchronous ones in fixed sensitive directions.
//!
//! Positions have no turns, so there are no asynchronous and no total values. Where the part turns and the tool stands still, no sensitive
//! direction rotates.

use super::{
    Centre, MotionKind,
    axial::{WHOLE, WITHOUT_FUNDAMENTAL},
    names::{centre_of_chart, described, fundamental_across, fundamental_along, kind_of, letter_id, place, unit},
    polar::Synchronous,
    synchronous::Named,
};
use crate::Value;
use runout_draws::{self as draws, Uncertainty};
use runout_numerics::Complex64;
use runout_turning::spread::{Direction, face_shares};

/// Angles an order, at least, on which errors are drawn: the ends of a range are looked for on a multiple of them.
const ANGLES_AN_ORDER: usize = 4;
/// Angles at least.
const FEWEST_ANGLES: usize = 64;

/// What a fixed direction takes of x, y, z (µm) and the tilts about x and y (µrad), in µm or µrad; `None` of one that rotates.
#[must_use]
pub fn weights(direction: Direction) -> Option<[f64; 5]> {
    let (quantity, second) = direction.parts();
    if second.is_some() {
        return None;
    }
    let [x, y, tilt_x, tilt_y] = quantity.cartesian();
    let mut weights = [x, y, f64::from(u8::from(direction.is_axial())), tilt_x, tilt_y];
    if let Direction::Face(at) = direction {
        for (tilt, share) in face_shares(at, None) {
            let [.., tilt_x, tilt_y] = tilt.cartesian();
            weights[3] += share * tilt_x;
            weights[4] += share * tilt_y;
        }
    }
    Some(weights)
}

/// Synchronous motion of an axis in one fixed sensitive direction, by order.
#[derive(Debug, Clone)]
pub struct StandingMotion<'a> {
    /// Name of the axis.
    pub of: &'a str,
    /// The direction, about an axis along z.
    pub direction: Direction,
    /// Letters of the machine's directions in the places of x, y and z.
    pub letters: [char; 3],
    /// Where along the axis radial motion is, in mm.
    pub z_mm: f64,
    /// Coefficients of Re Σ cₙ e^{inθ} by order from 0, θ the angle of the axis, in µm or µrad.
    pub harmonics: &'a [Complex64],
    /// Variance E|δ|² of each; empty where none is known.
    pub variance: &'a [f64],
    /// Degrees of freedom behind the variances; 0 where they are taken as exact.
    pub freedom: f64,
}

impl StandingMotion<'_> {
    /// The direction as symbols name it.
    #[must_use]
    pub fn id(&self) -> String {
        letter_id(self.direction, self.letters)
    }

    /// Its values: across the axis and of tilt without 1/rev, about each centre that is determined; along the axis with and without
    /// 1/rev, about the centre of the polar chart.
    #[must_use]
    pub fn values(&self, centres: &[Centre]) -> Vec<Value> {
        if !self.direction.is_axial() {
            let (kind, what) = kind_of(self.direction);
            return centres.iter().filter_map(|centre| self.about(*centre, 2, kind, what)).flatten().collect();
        }
        let whole = self.about(centre_of_chart(), 1, MotionKind::Synchronous, WHOLE);
        let residual = self.about(centre_of_chart(), 2, MotionKind::ResidualSynchronous, WITHOUT_FUNDAMENTAL);
        let fundamental = self.harmonics.get(1).map(|harmonic| {
            let value = 2.0 * harmonic.norm();
            let known = of_fundamental(value, self.variance.get(1).copied(), self.freedom);
            fundamental_along(&self.id(), value, known, &described(self.direction, self.z_mm, self.letters))
        });
        whole.into_iter().chain(residual).flatten().chain(fundamental).collect()
    }

    fn about(&self, centre: Centre, lowest: usize, kind: MotionKind, what: &str) -> Option<[Value; 2]> {
        let plot = Synchronous::fixed(lowest, self.harmonics, self.variance, self.freedom.round() as usize);
        let (id, described) = (self.id(), described(self.direction, self.z_mm, self.letters));
        let angles = (ANGLES_AN_ORDER * self.harmonics.len()).max(FEWEST_ANGLES);
        let seed = draws::seed(&[self.of, &id, kind.name(), centre.symbol()]);
        let seen = plot.seen(centre, angles, lowest, seed)?;
        let named = Named { kind, what, id: &id, described: &described, unit: unit(self.direction), centre };
        Some(plot.values(&named, &seen))
    }
}

/// The part of 1/rev across the axis that turns against it, radial or of tilt: no placement of what turns makes it.
#[derive(Debug, Clone, Copy)]
pub struct Fundamental {
    /// Whether it is of tilt.
    pub tilt: bool,
    /// Its amplitude, in µm or µrad.
    pub amplitude: f64,
    /// Variance E|δ|² of its phasor, where it is known.
    pub variance: Option<f64>,
    /// Degrees of freedom behind the variance; 0 where it is taken as exact.
    pub freedom: f64,
}

impl Fundamental {
    /// Its value, radial at a place along the axis whose directions have these letters.
    #[must_use]
    pub fn value(&self, z_mm: f64, letters: [char; 3]) -> Value {
        let value = 2.0 * self.amplitude;
        let known = of_fundamental(value, self.variance, self.freedom);
        fundamental_across(self.tilt, value, known, "axis", &place(z_mm, letters))
    }
}

/// Of twice an amplitude: the part of an error E|δ|² along the phasor is half of it.
fn of_fundamental(value: f64, variance: Option<f64>, freedom: f64) -> Option<Uncertainty> {
    let std = (2.0 * variance.filter(|variance| *variance > 0.0)?).sqrt();
    Some(Uncertainty::of_amplitude(value, std, freedom.round() as usize))
}
