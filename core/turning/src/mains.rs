//! The mains: where electrical pick-up has a line, and at which speeds that line is at a whole order.

/// Frequencies of mains, in Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// Multiples of them that are named.
const MULTIPLES: std::ops::RangeInclusive<u32> = 1..=10;
/// How far a grid's frequency is from its nominal value, as a share.
const GRID: f64 = 0.002;

/// A multiple of the mains' frequency within a tolerance, in Hz.
#[must_use]
pub fn near(frequency_hz: f64, tolerance_hz: f64) -> Option<f64> {
    let known = MAINS_HZ.iter().flat_map(|hertz| MULTIPLES.map(move |multiple| hertz * f64::from(multiple)));
    let near = known.filter(|hertz| (hertz - frequency_hz).abs() <= tolerance_hz + GRID * hertz);
    near.min_by(|a, b| (a - frequency_hz).abs().total_cmp(&(b - frequency_hz).abs()))
}

/// What is to be known where the mains' frequency is at a whole order for captures at these speeds (rpm) of so many turns: an average
/// over T turns does not separate what is nearer to an order than 1/T. One note a frequency.
#[must_use]
pub fn whole_orders(captures: &[(f64, usize)]) -> Vec<String> {
    let at = |hertz: &f64| {
        captures.iter().find_map(|(speed_rpm, turns)| {
            let order = hertz * 60.0 / speed_rpm.abs();
            let off = (order - order.round()).abs();
            let whole = order.is_finite() && order.round() >= 1.0 && *turns > 0 && off < 1.0 / *turns as f64;
            whole.then(|| {
                let read_as = order.round();
                format!(
                    "{hertz} Hz is order {order:.2} at {speed_rpm:.0} rpm: mains pick-up would be read as form or motion of \
                     order {read_as}; another speed separates them"
                )
            })
        })
    };
    MAINS_HZ.iter().filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn multiples_within_a_tolerance_are_mains() {
        assert_eq!(near(50.0, 0.0), Some(50.0));
        assert_eq!(near(150.2, 0.0), Some(150.0));
        assert_eq!(near(55.0, 1.0), None);
        assert_eq!(near(f64::NAN, 1.0), None);
    }

    #[test]
    fn a_whole_order_is_said_within_the_resolution_only() {
        let said = whole_orders(&[(500.0, 40)]);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("50 Hz is order 6.00 at 500 rpm") && said[0].contains("of order 6;"), "{said:?}");
        // 50 Hz and 60 Hz are orders 5 and 6.
        assert_eq!(whole_orders(&[(600.0, 60)]).len(), 2);
        // Order 6.037: 0.037 is above 1/40 and below 1/10.
        assert_eq!(whole_orders(&[(496.9, 40)]), Vec::<String>::new());
        assert_eq!(whole_orders(&[(496.9, 10)]).len(), 1);
        for nothing in [(0.0, 40), (f64::NAN, 40), (500.0, 0), (1e6, 40)] {
            assert_eq!(whole_orders(&[nothing]), Vec::<String>::new(), "{nothing:?}");
        }
    }
}
