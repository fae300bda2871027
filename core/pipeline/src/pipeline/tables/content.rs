//! What the tables of form and motion hold, for those who read them.

use std::collections::BTreeSet;

use serde_json::json;

use crate::{stage::About, summary::Summary};
use runout_numerics::fourier;
use runout_turning::{azimuth::Azimuth, separation::CONVENTION, station::StationResult};

/// What the stations hold, as they come in.
#[derive(Debug, Clone, Default)]
pub(super) struct Content {
    lost_form: BTreeSet<usize>,
    lost_motion: BTreeSet<usize>,
    level_known: bool,
    highest_order: usize,
    highest_on_angles: usize,
    line: Option<Azimuth>,
    form_band_upr: Option<[usize; 2]>,
}

impl Content {
    pub(crate) fn note(&mut self, result: &StationResult) {
        let separation = &result.separation;
        let highest = separation.max_order();
        for (unknown, quantity) in separation.unknowns.iter().enumerate() {
            let lost = if quantity.is_form() { &mut self.lost_form } else { &mut self.lost_motion };
            lost.extend(separation.lost_orders(unknown));
            self.level_known |= separation.coefficients(unknown).next().is_some_and(|level| level.re != 0.0);
            let lowest = separation.coefficients(unknown).position(|value| value.norm_sqr() > 0.0);
            if let (true, Some(lowest)) = (quantity.is_form(), lowest) {
                let [low, high] = self.form_band_upr.unwrap_or([lowest, highest]);
                self.form_band_upr = Some([low.min(lowest), high.max(highest)]);
            }
        }
        self.line = self.line.or(separation.azimuth());
        self.highest_order = self.highest_order.max(highest);
        self.highest_on_angles = self.highest_on_angles.max(highest.min(fourier::max_order(result.angles)));
    }

    pub(crate) fn about(&self, summary: &Summary) -> About {
        let lowest = usize::from(!self.level_known);
        let lost_form: BTreeSet<_> = self.lost_form.iter().chain(&summary.lost_orders.form).collect();
        let lost_motion: BTreeSet<_> = self.lost_motion.iter().chain(&summary.lost_orders.motion).collect();
        let notes = [
            ("lost_orders", json!({ "form": lost_form, "motion": lost_motion }).to_string()),
            ("band_upr", json!([lowest, self.highest_order]).to_string()),
            ("band_over_angle_upr", json!([lowest, self.highest_on_angles]).to_string()),
        ];
        let line = self.line.map(|line| ("motion_along_deg", json!(line.degrees()).to_string()));
        let notes = notes.into_iter().chain(line).map(|(key, value)| (key.to_owned(), value)).collect();
        About { convention: format!("{CONVENTION} {BANDS}"), notes, form_band_upr: self.form_band_upr }
    }
}

/// What `band_upr` and `band_over_angle_upr` are.
const BANDS: &str =
    "band_upr: lowest and highest order of the harmonics; band_over_angle_upr: of form and motion over angle.";
