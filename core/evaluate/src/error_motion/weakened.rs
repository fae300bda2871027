//! Error motion values behind a low-pass, and below orders that are not there.

use super::MotionKind;
use crate::Value;
use runout_draws::stands_out;
use runout_turning::separation::Separation;

/// The values with their bands ending where filters before the averages pass half of the power, at `half_power_upr`. Where motion stands
/// out from its noise from half of that on, values of repeating motion say that it is weakened.
#[must_use]
pub fn behind_low_pass(mut values: Vec<Value>, separation: &Separation, half_power_upr: f64) -> Vec<Value> {
    let weakened = has_motion_above(separation, 0.5 * half_power_upr);
    for value in &mut values {
        if 0.5 * half_power_upr >= value.band_upr[1] as f64 {
            continue;
        }
        value.weakened_above_upr = (weakened && repeats(value)).then_some(half_power_upr);
        value.band_upr[1] = value.band_upr[1].min(half_power_upr as usize).max(value.band_upr[0]);
    }
    values
}

/// The values where readings go on above the highest order of the averages: those of repeating motion lack it.
#[must_use]
pub fn below_absent(mut values: Vec<Value>) -> Vec<Value> {
    values.iter_mut().filter(|value| repeats(value)).for_each(|value| value.absent_above_upr = Some(value.band_upr[1]));
    values
}

fn repeats(value: &Value) -> bool {
    MotionKind::split(&value.symbol).is_some_and(|(kind, _)| kind != MotionKind::Asynchronous)
}

/// Whether a motion stands out from its noise above an order.
fn has_motion_above(separation: &Separation, order_upr: f64) -> bool {
    let motions = separation.unknowns.iter().enumerate().filter(|(_, quantity)| !quantity.is_form());
    motions.into_iter().any(|(unknown, _)| {
        let harmonics = separation.coefficients(unknown).zip(separation.noise_variance(unknown)).enumerate();
        harmonics
            .skip(1)
            .any(|(order, (harmonic, variance))| order as f64 > order_upr && stands_out(harmonic, variance))
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::error_motion::tests::separation;
    use runout_numerics::Complex64;

    /// Motion of order 20 behind a low-pass at order 11: what is left of it proves nothing.
    #[test]
    fn motion_above_a_low_pass_is_said_to_be_weakened() {
        let value = |symbol: &str| Value { band_upr: [2, 63], ..Value::referred(symbol, 1.0, "um", "", "LSC") };
        let of = |order: usize| {
            let separation = Separation {
                variance: vec![1e-8; 4 * 21],
                ..separation(&[(order, [Complex64::from(0.02), Complex64::ZERO, Complex64::ZERO, Complex64::ZERO])])
            };
            let values = vec![value("synchronous-radial-x"), value("asynchronous-radial-x")];
            behind_low_pass(values, &separation, 10.8)
                .into_iter()
                .map(|value| (value.band_upr, value.weakened_above_upr))
        };
        assert!(of(20).eq([([2, 10], Some(10.8)), ([2, 10], None)]));
        assert!(of(8).eq([([2, 10], Some(10.8)), ([2, 10], None)]));
        assert!(of(3).eq([([2, 10], None), ([2, 10], None)]));
    }

    #[test]
    fn repeating_motion_lacks_what_is_above_the_highest_order() {
        let value = |symbol: &str| Value { band_upr: [2, 63], ..Value::referred(symbol, 1.0, "um", "", "LSC") };
        let found = below_absent(["synchronous-radial-x", "asynchronous-radial-x"].map(value).into());
        assert_eq!([found[0].absent_above_upr, found[1].absent_above_upr], [Some(63), None]);
    }
}
