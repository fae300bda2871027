//! The mains: where electrical pick-up has a line, and at which speeds that line is at a whole order.
//!
//! What is above half the sampling rate appears below it, at its distance from the nearest multiple of the rate (its alias), unless a
//! low-pass before the sampling takes it away.

use std::fmt;

/// Frequencies of mains, in Hz.
const MAINS_HZ: [f64; 2] = [50.0, 60.0];
/// Multiples of them that are named.
const MULTIPLES: std::ops::RangeInclusive<u32> = 1..=10;
/// How far a grid's frequency is from its nominal value, as a share.
const GRID: f64 = 0.002;

/// A multiple of the mains' frequency.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mains {
    /// Its frequency.
    pub hertz: f64,
    /// Whether it is above half the sampling rate.
    pub is_alias: bool,
}

/// "mains (50 Hz)".
impl fmt::Display for Mains {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { hertz, is_alias } = self;
        match is_alias {
            false => write!(formatter, "mains ({hertz:.0} Hz)"),
            true => write!(formatter, "where mains of {hertz:.0} Hz, above half the sampling rate, would appear"),
        }
    }
}

/// Where a frequency appears that is sampled at a rate, in Hz, and whether that is another one; of an unknown rate, the frequency itself.
fn seen_at(hertz: f64, rate_hz: Option<f64>) -> (f64, bool) {
    match rate_hz.filter(|rate| *rate > 0.0 && hertz > 0.5 * rate) {
        Some(rate) => ((hertz - rate * (hertz / rate).round()).abs(), true),
        None => (hertz, false),
    }
}

/// The multiple of the mains' frequency that appears within a tolerance, in Hz, of a frequency; aliases only where no other does.
#[must_use]
pub fn near(frequency_hz: f64, tolerance_hz: f64, rate_hz: Option<f64>) -> Option<Mains> {
    let known = MAINS_HZ.iter().flat_map(|hertz| MULTIPLES.map(move |multiple| hertz * f64::from(multiple)));
    let each = known.map(|hertz| {
        let (seen_hz, is_alias) = seen_at(hertz, rate_hz);
        (Mains { hertz, is_alias }, (seen_hz - frequency_hz).abs())
    });
    let near = each.filter(|(mains, off)| *off <= tolerance_hz + GRID * mains.hertz);
    near.min_by(|(a, a_off), (b, b_off)| a.is_alias.cmp(&b.is_alias).then(a_off.total_cmp(b_off)))
        .map(|(mains, _)| mains)
}

/// A capture, as far as it decides where a line appears.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sampled {
    /// Speed, in rpm.
    pub speed_rpm: f64,
    /// Turns in its average.
    pub turns: usize,
    /// Samples a second, where known.
    pub rate_hz: Option<f64>,
}

/// What is to be known where the mains' frequency is at a whole order for captures: an average over T turns does not separate what is
/// nearer to an order than 1/T. One note a frequency.
#[must_use]
pub fn whole_orders(captures: &[Sampled]) -> Vec<String> {
    let at = |hertz: &f64| {
        captures.iter().find_map(|Sampled { speed_rpm, turns, rate_hz }| {
            let (seen_hz, is_alias) = seen_at(*hertz, *rate_hz);
            let order = seen_hz * 60.0 / speed_rpm.abs();
            let off = (order - order.round()).abs();
            let whole = order.is_finite() && order.round() >= 1.0 && *turns > 0 && off < 1.0 / *turns as f64;
            let alias = match rate_hz.filter(|_| is_alias) {
                Some(rate) => format!(", above half the sampling rate of {rate:.0} Hz, appears at {seen_hz:.2} Hz, which"),
                None => String::new(),
            };
            whole.then(|| {
                let read_as = order.round();
                format!(
                    "{hertz} Hz{alias} is order {order:.2} at {speed_rpm:.0} rpm: mains pick-up would be read as form or motion of \
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

    fn sampled(speed_rpm: f64, turns: usize, rate_hz: Option<f64>) -> Sampled {
        Sampled { speed_rpm, turns, rate_hz }
    }

    #[test]
    fn multiples_within_a_tolerance_are_mains() {
        let hertz = |frequency_hz, tolerance_hz| near(frequency_hz, tolerance_hz, None).map(|mains| mains.hertz);
        assert_eq!(hertz(50.0, 0.0), Some(50.0));
        assert_eq!(hertz(150.2, 0.0), Some(150.0));
        assert_eq!(hertz(55.0, 1.0), None);
        assert_eq!(hertz(f64::NAN, 1.0), None);
    }

    /// Samples of a cosine of 350 Hz at 800 Hz are those of 350 Hz, at 512 Hz those of 162 Hz.
    #[test]
    fn a_line_above_half_the_rate_appears_as_its_alias() {
        let cosine =
            |hertz: f64, sample: u32, rate: f64| (std::f64::consts::TAU * hertz * f64::from(sample) / rate).cos();
        assert!((0..200).all(|sample| (cosine(350.0, sample, 512.0) - cosine(162.0, sample, 512.0)).abs() < 1e-9));
        assert_eq!(near(162.0, 0.1, Some(512.0)), Some(Mains { hertz: 350.0, is_alias: true }));
        assert_eq!(near(162.0, 0.1, Some(800.0)), None);
        assert_eq!(near(50.0, 0.1, Some(512.0)), Some(Mains { hertz: 50.0, is_alias: false }));
        // Sampled 80 times a second, 50 Hz is no order 5 at 600 rpm but order 3.
        let said = whole_orders(&[sampled(600.0, 60, Some(80.0))]);
        assert!(said.iter().any(|one| one.contains("appears at 30.00 Hz, which is order 3.00 at 600 rpm")), "{said:?}");
        // Sampled once a turn, it is in the mean level, and no order is known.
        assert_eq!(whole_orders(&[sampled(600.0, 60, Some(10.0))]), Vec::<String>::new());
    }

    #[test]
    fn a_whole_order_is_said_within_the_resolution_only() {
        let said = whole_orders(&[sampled(500.0, 40, Some(51_200.0))]);
        assert_eq!(said.len(), 1, "{said:?}");
        assert!(said[0].starts_with("50 Hz is order 6.00 at 500 rpm") && said[0].contains("of order 6;"), "{said:?}");
        // 50 Hz and 60 Hz are orders 5 and 6.
        assert_eq!(whole_orders(&[sampled(600.0, 60, None)]).len(), 2);
        // Order 6.037: 0.037 is above 1/40 and below 1/10.
        assert_eq!(whole_orders(&[sampled(496.9, 40, None)]), Vec::<String>::new());
        assert_eq!(whole_orders(&[sampled(496.9, 10, None)]).len(), 1);
        for (speed_rpm, turns) in [(0.0, 40), (f64::NAN, 40), (500.0, 0), (1e6, 40)] {
            assert_eq!(whole_orders(&[sampled(speed_rpm, turns, None)]), Vec::<String>::new(), "{speed_rpm}");
        }
    }
}
