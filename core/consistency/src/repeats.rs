//! Repeats against the fit: what repeated readings scatter by is noise only if the fit leaves about as much.

use runout_numerics::statistics::f_tail;

use crate::check::{Check, Test};

/// Degrees of freedom of repeats from which they are noise.
pub const FEWEST: f64 = 6.0;

/// The scatter of repeats against what the fit leaves beside it: mean squares with their degrees of freedom, F on both sides.
#[must_use]
pub fn repeats(scatter: [f64; 2], residual: [f64; 2]) -> Check {
    let ([noise, noise_dof], [left, left_dof]) = (scatter, residual);
    let ratio = left / noise.max(f64::MIN_POSITIVE);
    let p = 2.0 * f_tail(ratio, left_dof, noise_dof).min(f_tail(ratio.recip(), noise_dof, left_dof));
    Check::new(Test::Repeats, "repeats", ratio, &[left_dof, noise_dof], p).finding(|| {
        let size = ratio.sqrt();
        if ratio > 1.0 {
            format!("the fit leaves {size:.1} times what repeated readings scatter by")
        } else {
            format!("repeated readings scatter {:.1} times as far as the fit leaves: they are no repeats", size.recip())
        }
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn repeats_that_are_none_are_said() {
        assert!(!repeats([1.0, 12.0], [1.3, 40.0]).refutes());
        assert!(repeats([1.0, 12.0], [30.0, 40.0]).finding.contains("5.5 times"));
        assert!(repeats([900.0, 12.0], [1.0, 40.0]).finding.contains("no repeats"));
    }
}
