//! What the checked keys make of a profile or a run: filters, and the names of values and filters that may come.

use super::{Evaluate, Group, USUAL_UPR, once_each};
use crate::error_motion;
use crate::filter::{Filter, between_name, robust_name, waviness_name};
use crate::known::{KnownValue, Referred};
use runout_standards::{areal, texture::Kind, twist};

impl Evaluate {
    /// Cut-offs for orders up to `highest`; `None` is no filter.
    pub fn cutoffs_upr(&self, highest: usize) -> Vec<Option<f64>> {
        let usual: &[f64] = if highest as f64 >= USUAL_UPR { &[USUAL_UPR] } else { &[] };
        let cutoffs = self.filter_upr.as_deref().unwrap_or(usual);
        std::iter::once(None).chain(cutoffs.iter().copied().map(Some)).collect()
    }

    /// The filter of roundness and cylindricity with a cut-off; `None` is no filter.
    pub(crate) fn low_pass(&self, cutoff_upr: Option<f64>) -> Filter {
        Filter::round(self.filter, cutoff_upr.and(self.high_pass_upr), cutoff_upr)
    }

    /// Names of the filters that values may have.
    pub fn filter_names(&self) -> Vec<String> {
        let cutoffs = self.filter_upr.as_deref().unwrap_or(&[USUAL_UPR]);
        let round = std::iter::once(None).chain(cutoffs.iter().copied().map(Some));
        let round = round.map(|cutoff| self.low_pass(cutoff).name);
        let robust = self.robust_filter_upr.iter().map(|cutoff| robust_name(*cutoff));
        let waviness = self.lambda_c_mm.map(|c| waviness_name(c, self.texture.lambda_f_mm));
        let between = [between_name(self.lambda_s_mm, self.lambda_c_mm), between_name(self.lambda_s_mm, None)];
        once_each(round.chain(robust).chain(between).chain(waviness).collect())
    }

    /// The values that may come.
    #[must_use]
    pub fn known_values(&self) -> Vec<KnownValue> {
        let mut known: Vec<KnownValue> = Vec::new();
        let mut add = |symbols: &[&'static str], unit, referred| {
            known.extend(symbols.iter().map(|symbol| KnownValue::new(*symbol, unit, referred)));
        };
        if self.has(Group::Roundness) {
            add(&["RONt", "RONp", "RONv", "RONq"], "µm", Referred::Circles);
            add(&["dr/dtheta"], "µm/°", Referred::Circles);
            if self.slope_window_deg.is_some() {
                add(&["slope"], "µm", Referred::Other);
            }
        }
        if self.has(Group::Harmonics) {
            add(&["amplitude"], "µm", Referred::Other);
            add(&["phase"], "°", Referred::Other);
        }
        if self.has(Group::Straightness) {
            add(&["STRt", "STRp", "STRv", "STRq"], "µm", Referred::Lines);
        }
        if self.has(Group::Texture) {
            if self.of_closed {
                add(&["Ra"], "µm", Referred::Other);
            }
            for kind in &self.texture.profiles {
                if *kind == Kind::P || self.lambda_c_mm.is_some() {
                    kind.parameters().iter().for_each(|(symbol, unit, _)| add(&[*symbol], *unit, Referred::Other));
                    add(&[kind.material_ratio_symbol()], "%", Referred::Other);
                }
            }
        }
        if self.has(Group::Cylindricity) {
            add(&["CYLt", "CYLp", "CYLv", "CYLq"], "µm", Referred::Cylinders);
            add(&["CYLtt", "STRsg", "STRsa", "coaxiality", "parallelism"], "µm", Referred::Other);
            if !self.datum.is_empty() {
                add(&["eccentricity", "circular-run-out", "total-run-out"], "µm", Referred::Other);
            }
        }
        if self.has(Group::RunOut) {
            add(&["TIR"], "µm", Referred::Other);
            add(&["eccentricity-angle"], "°", Referred::Other);
            if !self.has(Group::Cylindricity) || self.datum.is_empty() {
                add(&["eccentricity"], "µm", Referred::Other);
            }
        }
        if self.has(Group::Areal) {
            areal::PARAMETERS.iter().for_each(|(symbol, unit, _)| add(&[*symbol], *unit, Referred::Other));
            add(&["Smr(c)"], "%", Referred::Other);
            add(&["Smc(p)"], "µm", Referred::Other);
        }
        if self.has(Group::Twist) {
            twist::PARAMETERS.iter().for_each(|(symbol, unit, _)| add(&[*symbol], *unit, Referred::Other));
        }
        if self.has(Group::ErrorMotion) {
            let of_axis = if self.of_turns { error_motion::symbols } else { error_motion::standing_symbols };
            known.extend(of_axis(&self.directions, &self.faces));
        }
        known
    }
}
