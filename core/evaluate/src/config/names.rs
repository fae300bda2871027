//! What the checked keys make of a profile or a run: filters, and the names of values and filters that may come.

use super::{Evaluate, Group, USUAL_UPR, once_each};
use crate::error_motion;
use crate::filter::{Filter, between_name, robust_name, waviness_name};
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

    /// Symbols and units of the values that may come.
    #[must_use]
    pub fn symbols(&self) -> Vec<(String, &'static str)> {
        let mut symbols: Vec<(&'static str, &'static str)> = Vec::new();
        if self.has(Group::Roundness) {
            symbols.extend(["RONt", "RONp", "RONv", "RONq"].map(|symbol| (symbol, "µm")));
            symbols.push(("dr/dtheta", "µm/°"));
            if self.slope_window_deg.is_some() {
                symbols.push(("slope", "µm"));
            }
        }
        if self.has(Group::Harmonics) {
            symbols.extend([("amplitude", "µm"), ("phase", "°")]);
        }
        if self.has(Group::Straightness) {
            symbols.extend(["STRt", "STRp", "STRv", "STRq"].map(|symbol| (symbol, "µm")));
        }
        if self.has(Group::Texture) {
            if self.of_closed {
                symbols.push(("Ra", "µm"));
            }
            for kind in &self.texture.profiles {
                if *kind == Kind::P || self.lambda_c_mm.is_some() {
                    symbols.extend(kind.parameters().iter().map(|(symbol, unit, _)| (*symbol, *unit)));
                    symbols.push((kind.material_ratio_symbol(), "%"));
                }
            }
        }
        if self.has(Group::Cylindricity) {
            let names = ["CYLt", "CYLp", "CYLv", "CYLq", "CYLtt", "STRsg", "STRsa", "coaxiality", "parallelism"];
            symbols.extend(names.map(|symbol| (symbol, "µm")));
            if !self.datum.is_empty() {
                symbols.extend(["eccentricity", "circular-run-out", "total-run-out"].map(|symbol| (symbol, "µm")));
            }
        }
        if self.has(Group::RunOut) {
            symbols.extend([("TIR", "µm"), ("eccentricity-angle", "°")]);
            if !self.has(Group::Cylindricity) || self.datum.is_empty() {
                symbols.push(("eccentricity", "µm"));
            }
        }
        if self.has(Group::Areal) {
            symbols.extend(areal::PARAMETERS.iter().map(|(symbol, unit, _)| (*symbol, *unit)));
            symbols.extend([("Smr(c)", "%"), ("Smc(p)", "µm")]);
        }
        if self.has(Group::Twist) {
            symbols.extend(twist::PARAMETERS.iter().map(|(symbol, unit, _)| (*symbol, *unit)));
        }
        let mut symbols: Vec<(String, &'static str)> =
            symbols.into_iter().map(|(symbol, unit)| (symbol.to_owned(), unit)).collect();
        if self.has(Group::ErrorMotion) {
            let of_axis = if self.of_turns { error_motion::symbols } else { error_motion::standing_symbols };
            symbols.extend(of_axis(&self.directions, &self.faces));
        }
        symbols
    }
}
