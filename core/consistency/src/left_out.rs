//! Regions that were left out of a fit and predicted: their errors, whitened by their joint covariance, have a χ² of as many degrees of
//! freedom as there are readings.

use nalgebra::{Cholesky, DMatrix, DVector};
use runout_numerics::{number::significant, statistics::chi2_above_and_below};

use crate::check::{Check, Test};

/// Errors of the predictions of one component.
#[derive(Debug, Clone, PartialEq)]
pub struct LeftOut {
    /// The component: "dx".
    pub name: String,
    /// χ² of the whitened errors.
    pub chi2: f64,
    /// Number of readings.
    pub count: usize,
}

impl LeftOut {
    /// Of errors with their joint covariance `[reading][reading]`; `None` where that is not positive.
    #[must_use]
    pub fn of(name: impl Into<String>, errors: &[f64], covariance: DMatrix<f64>) -> Option<Self> {
        let factor = Cholesky::new(covariance)?;
        let whitened = factor.l().solve_lower_triangular(&DVector::from_column_slice(errors))?;
        Some(Self { name: name.into(), chi2: whitened.norm_squared(), count: errors.len() })
    }

    /// Chance of so large or so small a χ², both sides together.
    #[must_use]
    pub fn p(&self) -> f64 {
        let [above, below] = chi2_above_and_below(self.chi2, self.count as f64);
        (2.0 * above.min(below)).min(1.0)
    }

    fn ratio(&self) -> f64 {
        self.chi2 / self.count.max(1) as f64
    }
}

/// Chance of the worst component, over their number, below which predictions are widened.
const WORST: f64 = 0.01;
/// Chance of a component's own below which it is then.
const OWN: f64 = 0.2;

/// A check for each component, with the factor on its predictions: √(χ²/n) where χ² is above n.
#[must_use]
pub fn left_out(components: &[LeftOut]) -> Vec<Check> {
    let count = components.len() as f64;
    let worst = components.iter().map(LeftOut::p).fold(1.0, f64::min);
    let widens = worst < WORST / count;
    let check = |one: &LeftOut| {
        let (ratio, p) = (one.ratio(), (one.p() * count).min(1.0));
        let factor = if widens && one.p() < OWN { ratio.sqrt() } else { 1.0 };
        let check = Check::new(Test::LeftOut, &one.name, ratio, &[one.count as f64], p);
        let check = check.finding(|| {
            let size = ratio.max(0.0).sqrt();
            if ratio > 1.0 {
                format!("{} of regions left out is predicted {size:.2} times worse than its uncertainty says", one.name)
            } else {
                format!(
                    "{} of regions left out is predicted with {} of its uncertainty: it is stated too large",
                    one.name,
                    significant(size, 2)
                )
            }
        });
        check.widening(factor)
    };
    components.iter().map(check).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::Random;

    /// Errors that are strongly correlated have the χ² of independent ones once they are whitened.
    #[test]
    fn correlated_predictions_are_whitened_together() {
        let mut random = Random::new(6);
        let count = 24;
        let covariance =
            DMatrix::from_fn(count, count, |row, column| (-(row as f64 - column as f64).abs() / 15.0).exp());
        let root = Cholesky::new(covariance.clone()).unwrap().l();
        let trial = |random: &mut Random, size: f64| {
            let errors = |random: &mut Random, size: f64| -> Vec<f64> {
                let white = DVector::from_fn(count, |_, _| size * random.normal());
                (&root * white).iter().copied().collect()
            };
            let sound = LeftOut::of("dx", &errors(random, 1.0), covariance.clone()).unwrap();
            let other = LeftOut::of("dy", &errors(random, size), covariance.clone()).unwrap();
            left_out(&[sound, other])
        };
        let (mut clean, mut found, mut factor) = (0, 0, 0.0);
        for _ in 0..400 {
            clean += usize::from(trial(&mut random, 1.0).iter().any(Check::refutes));
            let checks = trial(&mut random, 2.0);
            found += usize::from(checks[1].refutes());
            factor += checks[1].factor / 400.0;
        }
        assert!(clean < 5 && found > 380 && (1.8..2.1).contains(&factor), "{clean} {found} {factor}");
        let constant = LeftOut { name: "dz".into(), chi2: 1e-9, count };
        assert!(left_out(&[constant])[0].finding.contains("too large"));
    }
}
