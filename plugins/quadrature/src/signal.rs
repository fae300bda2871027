//! A pair of signals with known components: its radius over its own phase, and the angle behind a reading, exactly.

use runout_core::{
    Complex64, Result,
    model::{
        Model,
        linear_terms::{Declared, LinearTerms, Observations},
    },
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

/// Steps of a fixed-point iteration: components of a fifth of the radius in all gain a digit in two.
const STEPS: usize = 60;
/// An angle is found when a step changes it by less, in rad: rounding.
const SETTLED: f64 = 1e-15;

/// Rounds of the exact fit. Each leaves the error of the one before times the components over the radius.
const ROUNDS: usize = 30;

impl Signal {
    /// Fits radius and `free` components to the exact radius over the phase, with components that are known, and beside others
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
        let named = |column: Vec<f64>| Declared { name: "component".into(), unit: UNIT.into(), column };
        let waves = free.iter().chain(beside).flat_map(|component| [0, 1].map(|wave| (*component, wave)));
        let waves =
            waves.map(|(component, wave)| phase_rad.iter().map(|phase| component.across(*phase)[wave]).collect());
        let columns: Vec<Declared> = std::iter::once(vec![1.0; radius.len()]).chain(waves).map(named).collect();
        let components = known.iter().copied().chain(free.iter().map(|component| (*component, Complex64::ZERO)));
        let mut signal =
            Self { radius: radius.iter().sum::<f64>() / radius.len() as f64, components: components.collect() };
        for _ in 0..ROUNDS {
            let readings = phase_rad.iter().zip(radius);
            let left = readings.map(|(phase, radius)| radius - signal.radius_at_phase(*phase)).collect();
            let steps = least_squares(left, columns.clone())?;
            signal.radius += steps[0];
            let mut moved = steps[0].abs();
            for ((component, p), step) in signal.components[known.len()..].iter_mut().zip(steps[1..].chunks_exact(2)) {
                *p += component.of_radius([step[0], step[1]]);
                moved = moved.max(step[0].abs()).max(step[1].abs());
            }
            if moved < 1e-13 * signal.radius {
                break;
            }
        }
        Ok(signal)
    }

    /// Whether the components are small enough beside the radius for all of this to converge.
    pub(crate) fn is_usable(&self) -> bool {
        let sum: f64 = self.components.iter().map(|(_, p)| p.norm()).sum();
        self.radius > 0.0 && sum < 0.5 * self.radius
    }

    /// What components add to the turning vector, as it sees them, over the radius.
    fn beside(&self, angle_rad: f64) -> Complex64 {
        let terms = self.components.iter();
        terms.map(|(component, p)| p * Complex64::cis(f64::from(component.0 - 1) * angle_rad)).sum::<Complex64>()
            / self.radius
    }

    /// The true angle behind a reading of a phase and a radius: that at which z less all components has the angle itself.
    pub(crate) fn angle_rad(&self, phase_rad: f64, radius: f64) -> f64 {
        settle(phase_rad, |angle| {
            let others: Complex64 =
                self.components.iter().map(|(component, p)| p * Complex64::cis(f64::from(component.0) * angle)).sum();
            let own = Complex64::from_polar(radius, phase_rad) - others;
            phase_rad + (own * Complex64::cis(-phase_rad)).arg()
        })
    }

    /// The radius that the pair has where its phase is this, not its angle.
    pub(crate) fn radius_at_phase(&self, phase_rad: f64) -> f64 {
        let angle = settle(phase_rad, |angle| phase_rad - (1.0 + self.beside(angle)).arg());
        self.radius * (1.0 + self.beside(angle)).norm()
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

fn settle(start: f64, next: impl Fn(f64) -> f64) -> f64 {
    let mut angle = start;
    for _ in 0..STEPS {
        let better = next(angle);
        let moved = (better - angle).abs();
        angle = better;
        if moved < SETTLED {
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
            let error = signal.angle_rad(z.arg(), z.norm()) - angle;
            // Rounding.
            assert!(Complex64::cis(error).arg().abs() < 1e-13, "{angle}: {error}");
            assert!((signal.radius_at_phase(z.arg()) - z.norm()).abs() < 1e-10);
        }
    }
}
