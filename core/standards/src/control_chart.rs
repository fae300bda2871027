//! Control charts of single values: individuals and moving range, with tests for special causes.
//!
//! The limits are those of ISO 7870-2 for subgroups of one value: X̄ ± 2.66 R̄ for the individuals and 3.267 R̄ for the moving range of
//! two, where 2.66 = 3/d₂ and 3.267 = D₄ with d₂ = 1.128. The tests are those of L. S. Nelson, The Shewhart control chart – tests
//! for special causes, J. Quality Technology 16 (1984) 237-239, numbers 1 to 4.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

/// Limits of the individuals in mean moving ranges: 3/d₂ of two values.
const INDIVIDUALS: f64 = 2.66;
/// Upper limit of the moving range in mean moving ranges: D₄ of two values.
const RANGE: f64 = 3.267;
/// Values in a row on one side of the mean (Nelson 2), that rise or fall (Nelson 3), and that alternate (Nelson 4).
const ONE_SIDE: usize = 9;
const STEADY: usize = 6;
const ALTERNATING: usize = 14;
/// Differences below so many roundings of the mean are none.
const ROUNDINGS: f64 = 8.0;

/// Mean and mean moving range of values, which come one by one in their order.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct ControlChart {
    count: usize,
    mean: f64,
    range_sum: f64,
    last: Option<f64>,
}

impl ControlChart {
    /// Takes the next value, in the unit of the chart; what is not finite is left out.
    pub fn take(&mut self, value: f64) {
        if !value.is_finite() {
            return;
        }
        self.count += 1;
        self.mean += (value - self.mean) / self.count as f64;
        self.range_sum += self.last.map_or(0.0, |last| (value - last).abs());
        self.last = Some(value);
    }

    /// How many values it has.
    #[must_use]
    pub fn count(&self) -> usize {
        self.count
    }

    /// X̄, the mean; nothing without values.
    #[must_use]
    pub fn mean(&self) -> Option<f64> {
        (self.count > 0).then_some(self.mean)
    }

    /// R̄, the mean moving range; nothing of fewer than two values.
    #[must_use]
    pub fn range_mean(&self) -> Option<f64> {
        (self.count > 1).then(|| self.range_sum / (self.count - 1) as f64)
    }

    /// Lower and upper control limit of the individuals; nothing of fewer than two values.
    #[must_use]
    pub fn limits(&self) -> Option<[f64; 2]> {
        let half = INDIVIDUALS * self.range_mean()?;
        Some([self.mean - half, self.mean + half])
    }

    /// Upper control limit of the moving range; nothing of fewer than two values.
    #[must_use]
    pub fn range_limit(&self) -> Option<f64> {
        Some(RANGE * self.range_mean()?)
    }

    /// A difference that is rounding.
    fn rounding(&self) -> f64 {
        ROUNDINGS * f64::EPSILON * self.mean.abs()
    }
}

/// A test for special causes that a value completes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Signal {
    /// A value beyond a control limit (Nelson 1).
    BeyondLimit,
    /// Nine values in a row on one side of the mean (Nelson 2).
    NineOnOneSide,
    /// Six values in a row that steadily rise or fall (Nelson 3).
    SixRisingOrFalling,
    /// Fourteen values in a row that alternate up and down (Nelson 4).
    FourteenAlternating,
    /// A moving range above its control limit.
    RangeBeyondLimit,
}

impl Signal {
    /// Every test.
    pub const ALL: [Self; 5] = [
        Self::BeyondLimit,
        Self::NineOnOneSide,
        Self::SixRisingOrFalling,
        Self::FourteenAlternating,
        Self::RangeBeyondLimit,
    ];

    /// Its name in files.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::BeyondLimit => "beyond-limit",
            Self::NineOnOneSide => "nine-on-one-side",
            Self::SixRisingOrFalling => "six-rising-or-falling",
            Self::FourteenAlternating => "fourteen-alternating",
            Self::RangeBeyondLimit => "range-beyond-limit",
        }
    }

    /// The rule that is broken, in words.
    #[must_use]
    pub const fn about(self) -> &'static str {
        match self {
            Self::BeyondLimit => "a value beyond a control limit (Nelson 1)",
            Self::NineOnOneSide => "nine values in a row on one side of the mean (Nelson 2)",
            Self::SixRisingOrFalling => "six values in a row that rise or fall (Nelson 3)",
            Self::FourteenAlternating => "fourteen values in a row that alternate (Nelson 4)",
            Self::RangeBeyondLimit => "a moving range above its control limit",
        }
    }
}

/// The tests, with what they remember of the values before.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Tests {
    last: Option<f64>,
    /// Values in a row on the side of this sign.
    side: (i8, usize),
    /// Differences in a row of this sign, and differences in a row that change their sign.
    direction: i8,
    steady: usize,
    alternating: usize,
}

/// What the tests say of one value.
#[derive(Debug, Clone, PartialEq)]
pub struct Judged {
    /// Absolute difference from the value before; nothing for the first.
    pub moving_range: Option<f64>,
    /// The tests that this value completes.
    pub signals: Vec<Signal>,
}

impl Tests {
    /// Judges the next value by a chart of all values; one that is not finite is left out and breaks no row.
    pub fn take(&mut self, value: f64, chart: &ControlChart) -> Judged {
        let mut signals = Vec::new();
        if !value.is_finite() {
            return Judged { moving_range: None, signals };
        }
        let rounding = chart.rounding();
        let sign = |difference: f64| i8::from(difference > rounding) - i8::from(difference < -rounding);
        if chart.limits().is_some_and(|[low, high]| value < low - rounding || value > high + rounding) {
            signals.push(Signal::BeyondLimit);
        }
        let side = sign(value - chart.mean);
        self.side = (side, if side != 0 && side == self.side.0 { self.side.1 + 1 } else { usize::from(side != 0) });
        if self.side.1 >= ONE_SIDE {
            signals.push(Signal::NineOnOneSide);
        }
        let moving_range = self.last.map(|last| (value - last).abs());
        if let Some(last) = self.last {
            let direction = sign(value - last);
            self.steady = if direction == 0 {
                0
            } else if direction == self.direction {
                self.steady + 1
            } else {
                1
            };
            let turned = direction != 0 && direction == -self.direction;
            self.alternating = if turned { self.alternating + 1 } else { usize::from(direction != 0) };
            self.direction = direction;
            // n values have n − 1 differences.
            if self.steady >= STEADY - 1 {
                signals.push(Signal::SixRisingOrFalling);
            }
            if self.alternating >= ALTERNATING - 1 {
                signals.push(Signal::FourteenAlternating);
            }
        }
        if let (Some(range), Some(limit)) = (moving_range, chart.range_limit())
            && range > limit + rounding
        {
            signals.push(Signal::RangeBeyondLimit);
        }
        self.last = Some(value);
        Judged { moving_range, signals }
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    fn judged(values: &[f64]) -> (ControlChart, Vec<Vec<Signal>>) {
        let mut chart = ControlChart::default();
        values.iter().for_each(|value| chart.take(*value));
        let mut tests = Tests::default();
        (chart, values.iter().map(|value| tests.take(*value, &chart).signals).collect())
    }

    fn completed(values: &[f64], signal: Signal) -> Vec<usize> {
        let (_, signals) = judged(values);
        (0..values.len()).filter(|index| signals[*index].contains(&signal)).collect()
    }

    /// Montgomery, Introduction to Statistical Quality Control, example 6.5 (loan processing cost): X̄ = 300.5, R̄ = 7.79,
    /// limits 279.78 and 321.22, upper limit of the range 25.45.
    #[test]
    fn limits_are_those_of_a_textbook() {
        let costs = [
            310.0, 288.0, 297.0, 298.0, 307.0, 303.0, 294.0, 297.0, 308.0, 306.0, 294.0, 299.0, 297.0, 299.0, 314.0,
            295.0, 293.0, 306.0, 301.0, 304.0,
        ];
        let (chart, signals) = judged(&costs);
        let [low, high] = chart.limits().unwrap();
        assert!((chart.mean().unwrap() - 300.5).abs() < 1e-9 && (chart.range_mean().unwrap() - 7.79).abs() < 5e-3);
        // 2.66 in the place of 3/1.128.
        assert!((low - 279.78).abs() < 0.01 && (high - 321.22).abs() < 0.01, "{low} {high}");
        assert!((chart.range_limit().unwrap() - 25.45).abs() < 0.01);
        assert!(signals.iter().all(Vec::is_empty), "{signals:?}");
    }

    #[test]
    fn each_test_is_completed_by_the_value_that_completes_it() {
        let mut outlier = [0.0, 0.1].repeat(10);
        outlier[12] = 5.0;
        assert_eq!(completed(&outlier, Signal::BeyondLimit), [12]);
        assert_eq!(completed(&outlier, Signal::RangeBeyondLimit), [12, 13]);
        // Mean 0.5: nine on each side, none of which rises or falls six times.
        let steps = [vec![0.0; 9], vec![1.0; 9]].concat();
        assert_eq!(completed(&steps, Signal::NineOnOneSide), [8, 17]);
        assert_eq!(completed(&steps, Signal::SixRisingOrFalling), [0; 0]);
        let rising = [3.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 2.0];
        assert_eq!(completed(&rising, Signal::SixRisingOrFalling), [6]);
        let falling: Vec<f64> = rising.iter().map(|value| -value).collect();
        assert_eq!(completed(&falling, Signal::SixRisingOrFalling), [6]);
        let alternating = [0.0, 1.0].repeat(7);
        assert_eq!(completed(&alternating, Signal::FourteenAlternating), [13]);
        assert_eq!(completed(&alternating[1..], Signal::FourteenAlternating), [0; 0]);
    }

    #[test]
    fn what_does_not_vary_has_no_signal_and_what_is_missing_breaks_no_row() {
        // 0.1 + 0.2 is not 0.3: the mean of equal values may differ from them by rounding.
        let (chart, signals) = judged(&[0.1 + 0.2; 30]);
        assert!(signals.iter().all(Vec::is_empty) && chart.range_mean() == Some(0.0));
        let gapped = [1.0, 2.0, f64::NAN, 3.0, 4.0, f64::INFINITY, 5.0, 6.0];
        assert_eq!(completed(&gapped, Signal::SixRisingOrFalling), [7]);
        assert_eq!(judged(&gapped).0.count(), 6);
        let (one, _) = judged(&[1.0]);
        assert!(one.limits().is_none() && one.range_limit().is_none() && one.mean() == Some(1.0));
        assert!(judged(&[]).0.mean().is_none());
    }
}
