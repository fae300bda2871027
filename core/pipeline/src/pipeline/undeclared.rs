//! Grooves in the form that the rig does not declare as interruptions.

use runout_turning::{
    groove::{Groove, groove},
    separation::Quantity,
    station::StationResult,
};

/// Sections whose groove is named.
const NAMED: usize = 3;

/// What the forms of a run show.
#[derive(Debug, Default)]
pub(super) struct Undeclared {
    found: Vec<(String, Groove)>,
}

impl Undeclared {
    /// Takes the forms of a station: what is at one angle of the part in all setups is in its form.
    pub(crate) fn take(&mut self, result: &StationResult) {
        for (unknown, quantity) in result.separation.unknowns.iter().enumerate() {
            let Quantity::Form(section) = quantity else { continue };
            let Some(at) = result.separation.sections.get(*section).filter(|at| at.gaps.is_empty()) else { continue };
            if let Some(groove) = groove(&result.over_angle(unknown)) {
                self.found.push((format!("section {} at station {}", at.id, result.station), groove));
            }
        }
    }

    /// What to declare.
    pub(crate) fn warning(mut self) -> Option<String> {
        self.found.sort_by(|a, b| b.1.depth_um.total_cmp(&a.1.depth_um));
        let (_, deepest) = self.found.first()?;
        let (from_deg, to_deg) = (deepest.from_deg.floor(), deepest.to_deg.ceil());
        let named = |(place, groove): &(String, Groove)| {
            format!(
                "from {:.1} to {:.1} degrees, {:.1} µm deep ({place})",
                groove.from_deg, groove.to_deg, groove.depth_um
            )
        };
        let each: Vec<String> = self.found.iter().take(NAMED).map(named).collect();
        let more = self.found.len() - each.len();
        let more = if more > 0 { format!(", and in {more} more forms") } else { String::new() };
        Some(format!(
            "the part seems interrupted {}{more}: declare it in [rig], as in interruptions = [{{ from_deg = {from_deg}, to_deg = {to_deg} }}]; \
             otherwise every value includes it",
            each.join(", "),
        ))
    }
}
