//! The maximum of a function of one variable by golden section: one value of the function a step.

/// Steps after which the interval is 1e-16 of what it was: it gets no shorter in f64.
const MOST_STEPS: usize = 77;

/// Where a function with one maximum between two places has it. The interval that is left is no longer than `tolerance`, or as short as f64 allows.
pub fn maximum(mut low: f64, mut high: f64, tolerance: f64, value: impl Fn(f64) -> f64) -> f64 {
    let share = 0.5 * (5.0_f64.sqrt() - 1.0);
    let (mut a, mut b) = (high - share * (high - low), low + share * (high - low));
    let (mut at_a, mut at_b) = (value(a), value(b));
    for _ in 0..MOST_STEPS {
        if high - low <= tolerance {
            break;
        }
        if at_a > at_b {
            (high, b, at_b) = (b, a, at_a);
            a = high - share * (high - low);
            at_a = value(a);
        } else {
            (low, a, at_a) = (a, b, at_b);
            b = low + share * (high - low);
            at_b = value(b);
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_maximum_is_found_within_the_tolerance() {
        for tolerance in [0.1, 1e-6, 0.0] {
            let found = maximum(-3.0, 5.0, tolerance, |x| -(x - 1.25).abs());
            assert!((found - 1.25).abs() <= tolerance.max(1e-14), "{found}");
            assert!((maximum(0.0, 1.0, tolerance, |x| x) - 1.0).abs() <= tolerance.max(1e-14), "at an end");
        }
    }
}
