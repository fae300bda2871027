//! What a file says about itself: enough to know what its numbers are.

use std::collections::BTreeSet;

use runout_core::{
    azimuth::Azimuth,
    numerics::fourier,
    pipeline::run::{StationResult, Summary},
    provenance::Provenance,
    separation::CONVENTION,
};
use serde_json::json;

/// What the stations hold, as they come in.
#[derive(Debug, Default)]
pub struct Content {
    lost_form: BTreeSet<usize>,
    lost_motion: BTreeSet<usize>,
    level_known: bool,
    highest_order: usize,
    highest_on_angles: usize,
    line: Option<Azimuth>,
}

impl Content {
    /// Takes note of a station.
    pub fn note(&mut self, result: &StationResult) {
        let separation = &result.separation;
        for (unknown, quantity) in separation.unknowns.iter().enumerate() {
            let lost = if quantity.is_form() { &mut self.lost_form } else { &mut self.lost_motion };
            lost.extend(separation.lost_orders(unknown));
            self.level_known |= separation.coefficients(unknown).next().is_some_and(|level| level.re != 0.0);
        }
        self.line = self.line.or(separation.azimuth());
        let highest = separation.max_order();
        self.highest_order = self.highest_order.max(highest);
        self.highest_on_angles = self.highest_on_angles.max(highest.min(fourier::max_order(result.angles)));
    }

    /// Keys and values for the files' metadata; lists are JSON.
    pub fn entries(&self, summary: &Summary) -> Vec<(String, String)> {
        let lowest = usize::from(!self.level_known);
        let lost_form: BTreeSet<_> = self.lost_form.iter().chain(&summary.lost_orders.form).collect();
        let lost_motion: BTreeSet<_> = self.lost_motion.iter().chain(&summary.lost_orders.motion).collect();
        let mut entries = common(summary, &format!("{CONVENTION} {BANDS}"));
        let own = [
            ("lost_orders", json!({ "form": lost_form, "motion": lost_motion }).to_string()),
            ("band_upr", json!([lowest, self.highest_order]).to_string()),
            ("band_over_angle_upr", json!([lowest, self.highest_on_angles]).to_string()),
        ];
        entries.extend(own.map(named));
        entries.extend(self.line.map(|line| named(("motion_along_deg", json!(line.degrees()).to_string()))));
        entries
    }
}

/// What every file says of itself.
pub fn common(summary: &Summary, convention: &str) -> Vec<(String, String)> {
    let warnings: Vec<String> = summary.all_warnings().collect();
    let mut entries = entries(&summary.title, &summary.provenance, convention, &warnings);
    entries.push(named(("effects", json!(summary.effects).to_string())));
    entries
}

/// The same, of what is no run.
pub fn entries(title: &str, provenance: &Provenance, convention: &str, warnings: &[String]) -> Vec<(String, String)> {
    let entries = [
        ("title", title.to_owned()),
        ("program", provenance.program.clone()),
        ("configuration", provenance.configuration.clone()),
        ("inputs", json!(provenance.inputs).to_string()),
        ("convention", convention.to_owned()),
        ("warnings", json!(warnings).to_string()),
    ];
    entries.map(named).into()
}

fn named((key, value): (&str, String)) -> (String, String) {
    (format!("runout.{key}"), value)
}

/// What `band_upr` and `band_over_angle_upr` are.
const BANDS: &str =
    "band_upr: lowest and highest order of the harmonics; band_over_angle_upr: of form and motion over angle.";
