//! A pair of signals with known components: the curve that it draws, where a reading is on it, and the angle behind a reading, exactly.
//!
//! Noise is the same in both signals, so that a reading is off by its distance from the curve along the curve's normal, whatever the
//! curve's form. Offset, gain ratio and quadrature angle make an ellipse, which is found directly ([`Signal::ellipse`]); the exact fit
//! of any components begins there.

use nalgebra::{Matrix2, Vector2};
use runout_core::{
    Complex64, Error, ErrorKind, Result,
    closed_loop::{
        Model,
        linear_terms::{Declared, LinearTerms, Observations},
    },
    numerics::least_squares::{Basis, dot},
};

use crate::components::{Component, UNIT};

/// A circle with components that rotate.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Signal {
    /// Radius of the circle, in counts.
    pub radius: f64,
    /// Components and their p, in counts.
    pub components: Vec<(Component, Complex64)>,
}

/// A reading of a phase and a radius beside the curve.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// The angle at which the curve has the reading's phase, in rad.
    pub angle_rad: f64,
    /// The curve's outward normal there, of length 1.
    pub normal: Complex64,
    /// Distance of the reading from the curve along it, in counts.
    pub distance: f64,
}

/// Steps of Newton's iteration for an angle: from the angle on the ellipse, a few are enough.
const STEPS: usize = 60;
/// Its largest step, in rad.
const LARGEST_STEP: f64 = 0.3;
/// An angle is found when a step changes it by less, in rad: rounding.
const SETTLED: f64 = 1e-15;
/// Rounds of the exact fit, and halvings of a step that made it worse.
const ROUNDS: usize = 30;
const HALVINGS: usize = 8;
/// Angles at which a curve is tested.
const TESTED: usize = 360;
/// Least share of the mean rate at which phase and corrected angle grow along a curve that turns once about the origin.
const LEAST_RATE: f64 = 0.05;

impl Signal {
    /// The ellipse through readings: a x² + b xy + c y² + d x + e y = 1 by least squares, which holds for curves around the origin.
    /// `None` where the readings make none.
    pub(crate) fn ellipse(phase_rad: &[f64], radius: &[f64]) -> Option<Self> {
        let mean = radius.iter().sum::<f64>() / radius.len() as f64;
        let z = || phase_rad.iter().zip(radius).map(|(phase, radius)| Complex64::from_polar(radius / mean, *phase));
        let column = |of: fn(Complex64) -> f64| z().map(of).collect::<Vec<f64>>();
        let conic = Basis::of(vec![
            column(|z| z.re * z.re),
            column(|z| z.re * z.im),
            column(|z| z.im * z.im),
            column(|z| z.re),
            column(|z| z.im),
        ]);
        let [a, b, c, d, e] = <[f64; 5]>::try_from(conic.coefficients(&vec![1.0; radius.len()])).ok()?;
        let form = Matrix2::new(a, 0.5 * b, 0.5 * b, c);
        let inverse = form.try_inverse().filter(|_| a > 0.0 && form.determinant() > 0.0)?;
        let slope = Vector2::new(d, e);
        let centre = inverse * slope * -0.5;
        // (z − centre)ᵀ·form·(z − centre) = level: z = centre + √(level·form⁻¹)·(cos, sin).
        let level = 1.0 + (centre.transpose() * form * centre)[(0, 0)];
        let square = inverse * level;
        let root = square.determinant().sqrt();
        let axes = (square + Matrix2::identity() * root) / (square.trace() + 2.0 * root).sqrt();
        let offset = mean * Complex64::new(centre[0], centre[1]);
        let backward = mean * Complex64::new(0.5 * (axes[(0, 0)] - axes[(1, 1)]), axes[(0, 1)]);
        let components = vec![(Component(0), offset), (Component(-1), backward)];
        let found = Self { radius: 0.5 * mean * axes.trace(), components };
        found.is_usable().then_some(found)
    }

    /// Fits radius and `free` components to the readings' distances from the curve, with components that are known, and beside others
    /// of which only the first order in the radius counts.
    ///
    /// # Errors
    /// When the samples do not determine them.
    pub(crate) fn fit(
        phase_rad: &[f64],
        radius: &[f64],
        known: &[(Component, Complex64)],
        free: &[Component],
        beside: &[Component],
    ) -> Result<Self> {
        let ellipse = Self::ellipse(phase_rad, radius);
        let begun = |component: &Component| {
            let of_ellipse = ellipse.iter().flat_map(|ellipse| &ellipse.components);
            of_ellipse.clone().find(|(own, _)| own == component).map_or(Complex64::ZERO, |(_, p)| *p)
        };
        let components = known.iter().copied().chain(free.iter().map(|component| (*component, begun(component))));
        let mean = radius.iter().sum::<f64>() / radius.len() as f64;
        let mut signal =
            Self { radius: ellipse.as_ref().map_or(mean, |found| found.radius), components: components.collect() };
        if !signal.is_usable() {
            signal.radius = mean;
            signal.components[known.len()..].iter_mut().for_each(|(_, p)| *p = Complex64::ZERO);
        }
        let columns = |of: &[Component], places: &[Place]| -> Vec<Vec<f64>> {
            let waves = of.iter().flat_map(|component| [0, 1].map(|wave| (*component, wave)));
            waves.map(|(component, wave)| places.iter().map(|place| place.column(component, wave)).collect()).collect()
        };
        // The residual of the distances beside components of the first order.
        let left = |signal: &Self| {
            let places = signal.places(phase_rad, radius);
            let mut left: Vec<f64> = places.iter().map(|place| place.distance).collect();
            Basis::of(columns(beside, &places)).remove_from(&mut left);
            (dot(&left, &left), places, left)
        };
        let (mut squares, mut places, mut distances) = left(&signal);
        for _ in 0..ROUNDS {
            let round = places.iter().map(Place::of_radius).collect();
            let all = std::iter::once(round).chain(columns(free, &places)).chain(columns(beside, &places));
            let basis = Basis::of(all.collect());
            if basis.dependent() {
                let problem = format!("{} samples do not determine {} components", radius.len(), free.len());
                return Err(Error::new("fit", "the signal", problem).of(ErrorKind::InsufficientData));
            }
            let steps = basis.coefficients(&distances);
            let trial = |share: f64| {
                let mut trial = signal.clone();
                trial.radius += share * steps[0];
                for ((component, p), step) in trial.components[known.len()..].iter_mut().zip(steps[1..].chunks_exact(2))
                {
                    *p += share * component.of_radius([step[0], step[1]]);
                }
                trial
            };
            let better = (0..HALVINGS).map(|halving| trial((-(halving as f64)).exp2())).find_map(|trial| {
                let found = left(&trial);
                (found.0 < squares).then_some((trial, found))
            });
            let Some((found, (now, at, off))) = better else { break };
            let settled = squares - now <= 1e-12 * squares;
            (signal, squares, places, distances) = (found, now, at, off);
            if settled {
                break;
            }
        }
        Ok(signal)
    }

    /// Whether the curve turns once about the origin, its phase and the angle that is found from it growing all along.
    pub(crate) fn is_usable(&self) -> bool {
        let grows = |step: usize| {
            let angle = std::f64::consts::TAU * step as f64 / TESTED as f64;
            (self.slope(angle) / self.at(angle)).im > LEAST_RATE
                && self.rate(angle, self.radius) > LEAST_RATE * self.radius
        };
        self.radius > self.component(-1).norm() && (0..TESTED).all(grows)
    }

    fn component(&self, turns: i32) -> Complex64 {
        self.components.iter().filter(|(component, _)| component.0 == turns).map(|(_, p)| *p).sum()
    }

    /// What components add to the pair at an angle.
    fn others(&self, angle_rad: f64) -> Complex64 {
        self.components.iter().map(|(component, p)| p * Complex64::cis(f64::from(component.0) * angle_rad)).sum()
    }

    /// The pair at an angle.
    fn at(&self, angle_rad: f64) -> Complex64 {
        self.radius * Complex64::cis(angle_rad) + self.others(angle_rad)
    }

    /// How the pair changes with the angle.
    fn slope(&self, angle_rad: f64) -> Complex64 {
        let terms = self.components.iter().map(|(component, p)| {
            let turns = f64::from(component.0);
            turns * p * Complex64::cis(turns * angle_rad)
        });
        Complex64::i() * (self.radius * Complex64::cis(angle_rad) + terms.sum::<Complex64>())
    }

    /// The direction of the ellipse's own vector (cos, sin), times a length: (R·w − q·w̄)/(R² − |q|²) of w = R·e + q·ē.
    fn on_ellipse(&self, w: Complex64) -> Complex64 {
        let backward = self.component(-1);
        (self.radius * w - backward * w.conj()) / (self.radius * self.radius - backward.norm_sqr())
    }

    /// How far a reading moves across the turning vector of length `own` as the angle that is found from it grows, in counts per rad.
    fn rate(&self, angle_rad: f64, own: f64) -> f64 {
        let terms = self.components.iter().map(|(component, p)| {
            f64::from(component.0) * (p * Complex64::cis(f64::from(component.0 - 1) * angle_rad)).re
        });
        own + terms.sum::<f64>()
    }

    /// The true angle behind a reading of a phase and a radius: that at which z less all components has the angle itself. With it the
    /// change of the angle by one count of noise, in rad.
    pub(crate) fn angle_rad(&self, phase_rad: f64, radius: f64) -> [f64; 2] {
        let z = Complex64::from_polar(radius, phase_rad);
        let start = self.on_ellipse(z - self.component(0)).arg();
        let own = |angle: f64| (z - self.others(angle)) * Complex64::cis(-angle);
        let angle = settle(start, |angle| {
            let own = own(angle);
            own.im / self.rate(angle, own.re)
        });
        [angle, self.rate(angle, own(angle).re).abs().recip()]
    }

    /// Where the curve has a phase.
    fn angle_at_phase(&self, phase_rad: f64) -> f64 {
        let ray = Complex64::cis(phase_rad);
        // |t·a − b| = 1: the ray meets the ellipse.
        let (a, b) = (self.on_ellipse(ray), self.on_ellipse(self.component(0)));
        let middle = (a * b.conj()).re;
        let root = (middle * middle - a.norm_sqr() * (b.norm_sqr() - 1.0)).max(0.0).sqrt();
        let start = ((middle + root) / a.norm_sqr() * a - b).arg();
        settle(start, |angle| {
            let z = self.at(angle);
            -(z / ray).arg() / (self.slope(angle) / z).im
        })
    }

    /// Where readings are beside the curve.
    pub(crate) fn places(&self, phase_rad: &[f64], radius: &[f64]) -> Vec<Place> {
        let place = |(phase, radius): (&f64, &f64)| {
            let angle_rad = self.angle_at_phase(*phase);
            let slope = self.slope(angle_rad);
            let normal = -Complex64::i() * slope / slope.norm();
            let along = (normal * Complex64::cis(-phase)).re;
            Place { angle_rad, normal, distance: along * (radius - self.at(angle_rad).norm()) }
        };
        phase_rad.iter().zip(radius).map(place).collect()
    }
}

impl Place {
    /// Change of the curve along its normal by the radius.
    pub(crate) fn of_radius(&self) -> f64 {
        (Complex64::cis(self.angle_rad) * self.normal.conj()).re
    }

    /// Change of the curve along its normal by the cosine or the sine of a component, as the radius of a circle would have them.
    pub(crate) fn column(&self, component: Component, wave: usize) -> f64 {
        let unit = component.of_radius([[1.0, 0.0], [0.0, 1.0]][wave]);
        (unit * Complex64::cis(f64::from(component.0) * self.angle_rad) * self.normal.conj()).re
    }
}

/// Least squares of columns, by the model of linear terms that the loop uses.
///
/// # Errors
/// When the columns are dependent.
pub(crate) fn least_squares(values: Vec<f64>, columns: Vec<Declared>) -> Result<Vec<f64>> {
    let group = vec![0; values.len()];
    let observations = Observations {
        values,
        unit: UNIT.into(),
        std: None,
        group,
        groups: vec!["all".into()],
        ..Observations::default()
    };
    Ok(LinearTerms::new(observations, columns, Vec::new())?.fit(&[])?.declared().to_vec())
}

/// Newton's iteration: `step` is what an angle lacks.
fn settle(start: f64, step: impl Fn(f64) -> f64) -> f64 {
    let mut angle = start;
    for _ in 0..STEPS {
        let step = step(angle).clamp(-LARGEST_STEP, LARGEST_STEP);
        angle += step;
        if step.abs() < SETTLED || !step.is_finite() {
            break;
        }
    }
    angle
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn angle_and_radius_are_exact_at_large_errors() {
        let components = vec![
            (Component(0), Complex64::new(30.0, -20.0)),
            (Component(-1), Complex64::new(8.0, 5.0)),
            (Component(-3), Complex64::new(4.0, 0.0)),
        ];
        let signal = Signal { radius: 500.0, components };
        for step in 0..50 {
            let angle = 0.13 * f64::from(step);
            let z = 500.0 * Complex64::cis(angle)
                + Complex64::new(30.0, -20.0)
                + Complex64::new(8.0, 5.0) * Complex64::cis(-angle)
                + 4.0 * Complex64::cis(-3.0 * angle);
            let error = signal.angle_rad(z.arg(), z.norm())[0] - angle;
            // Rounding.
            assert!(Complex64::cis(error).arg().abs() < 1e-13, "{angle}: {error}");
            assert!(signal.places(&[z.arg()], &[z.norm()])[0].distance.abs() < 1e-10);
        }
    }

    /// Ellipses far from a circle, without noise: the direct fit gives their components.
    #[test]
    fn an_ellipse_is_found_directly() {
        for (offset, ratio, skew) in
            [([500.0, -200.0], 1.0_f64, 0.0_f64), ([-80.0, 40.0], 0.4, 0.0), ([10.0, 30.0], 0.8, 0.7)]
        {
            let pair = |step: i32| {
                let angle = 0.11 * f64::from(step);
                Complex64::new(offset[0] + 900.0 * angle.cos(), offset[1] + 900.0 * ratio * (angle + skew).sin())
            };
            let readings: Vec<Complex64> = (0..200).map(pair).collect();
            let [phase, radius] =
                [Complex64::arg, Complex64::norm].map(|of| readings.iter().map(|z| of(*z)).collect::<Vec<f64>>());
            let found = Signal::ellipse(&phase, &radius).unwrap();
            assert!((found.component(0) - Complex64::new(offset[0], offset[1])).norm() < 1e-8, "{found:?}");
            assert!(found.places(&phase, &radius).iter().all(|place| place.distance.abs() < 1e-8));
        }
    }
}
