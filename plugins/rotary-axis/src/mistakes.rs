//! Mistakes of the file: coordinates that are exchanged or have the other sign, commands that count the other way.

use runout_core::points::{Points, mistakes};

use crate::{campaign::Campaign, config::RotaryAxis, solve::fit};

/// Mistakes are looked for where the fit leaves more than so many times the noise, or, without one, more than this, in µm.
const FAR: f64 = 5.0;
/// And said where the correction leaves less than this share of it.
const SHARE: f64 = 0.2;
const EXCHANGED: [[&str; 2]; 3] = [["dx_mm", "dy_mm"], ["dy_mm", "dz_mm"], ["dx_mm", "dz_mm"]];

impl RotaryAxis {
    /// The likeliest mistake, where a fit leaves so much: in units of the noise, or in µm where that is not known.
    pub(crate) fn mistake(&self, points: &Points, left: f64) -> Option<String> {
        if left < FAR {
            return None;
        }
        let command = [self.0.axis.command()];
        let negated: [&[&str]; 5] = [&["dx_mm"], &["dy_mm"], &["dz_mm"], &["dx_mm", "dy_mm", "dz_mm"], &command];
        let corrected = mistakes::columns(points, &EXCHANGED, &negated);
        let left_of = |(what, points): (String, Points)| {
            let campaign = Campaign::of(&self.0, &points).ok()?;
            let found = fit(&campaign.layout, &campaign.readings, &[]).ok()?;
            Some((what, found.chi2_per_dof().sqrt()))
        };
        mistakes::likeliest(left, SHARE * left, corrected.filter_map(left_of))
    }
}
