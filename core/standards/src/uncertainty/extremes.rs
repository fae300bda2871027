//! Intervals of extremes, and of distances of extremes about a centre.

use std::f64::consts::SQRT_2;

use super::{Lacking, NORMAL_95, Uncertainty};

/// No error at some thousand independent angles is above so many standard deviations in 97.5 % of all cases.
const LARGEST_OF_ALL: f64 = 4.5;

impl Uncertainty {
    /// The same of a value with kinks: an interval that reaches as far below the value as above it, the farther of both.
    ///
    /// Where an error changes which contacts hold a circle (nearly opposite contacts of MICI and MCCI), draws about the value
    /// do not show on which side of it the truth lies. Where the value lies above its interval, draws lie above the truth as it lies above them:
    /// the centre of a form with two lobes moves along its long axis with the least error, and only upwards from the true value.
    #[must_use]
    pub fn on_both_sides(mut self, value: f64) -> Self {
        let [low, high] = self.interval_95;
        let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let reach = (value - low).max(high - value);
        let ends = if value > high { [low - reach, high] } else { [value - reach, value + reach] };
        self.interval_95 = [ends[0].max(floor), ends[1]];
        self
    }

    /// The same of a peak to valley about a centre that is held loosely along one direction: it changes by no more than the centre moves, and is
    /// no smaller than that about the best centre, of which it lies `above_um` and which noise raises by no more than twice its largest error.
    #[must_use]
    pub fn of_loose_centre(mut self, value: f64, above_um: f64, std: f64) -> Self {
        let floor = (value - above_um - 2.0 * LARGEST_OF_ALL * std).max(0.0);
        self.interval_95[0] = self.interval_95[0].min(floor);
        self
    }

    /// The same where the curvature of the profile at two opposite contacts holds the centre: a centre that is right to `centre_std` adds that to
    /// the errors at both ends, whichever of them it moves towards.
    #[must_use]
    pub fn of_bent_contacts(value: f64, above_um: f64, std: f64, centre_std: f64) -> Self {
        let floor = (value - above_um - 2.0 * LARGEST_OF_ALL * std).max(0.0);
        let std = centre_std.hypot(SQRT_2 * std);
        let reach = NORMAL_95 * std;
        Self { std, interval_95: [(value - reach).max(floor), value + reach], draws: 0 }
    }

    /// The same of an extreme of a profile, or of the distance of two (`ends`), whatever the true profile is: noise of the standard deviation `std`
    /// at any one angle raises an extreme by no more than the largest of its errors, and lowers it by no more than the error where the true one
    /// is. The interval holds that of the draws too.
    #[must_use]
    pub fn of_any_form(mut self, value: f64, std: f64, ends: f64) -> Self {
        let [low, high] = &mut self.interval_95;
        *low = low.min((value - ends * LARGEST_OF_ALL * std).max(0.0));
        *high = high.max(value + NORMAL_95 * ends.sqrt() * std);
        self.std = self.std.max((*high - *low) / (2.0 * NORMAL_95));
        self
    }

    /// Of an extreme that is alone, or of the distance of two, about a centre that errors do not move: as large as the errors there, whatever the form.
    #[must_use]
    pub fn of_extremes_alone(value: f64, std: f64) -> Self {
        let reach = NORMAL_95 * std;
        Self { std, interval_95: [(value - reach).max(0.0), value + reach], draws: 0 }
    }

    /// The same where draws are of forms that may [lack](Lacking) so much of an extreme.
    #[must_use]
    pub fn with_lacking(mut self, lacking: Lacking) -> Self {
        let [low, high] = self.interval_95;
        let floor = if low >= 0.0 { 0.0 } else { f64::NEG_INFINITY };
        let Lacking { left_um, wider_um, .. } = lacking;
        self.interval_95 = [(low - (wider_um - left_um).max(0.0)).max(floor), high + (wider_um + left_um).max(0.0)];
        self
    }
}
