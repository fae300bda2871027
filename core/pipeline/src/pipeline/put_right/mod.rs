//! Mistakes of a recording that are put right before the closed loop: marks that do not count the part's turns, and stations under each other's name.

mod left;
pub mod marks;
mod stations;

use left::Left;
use runout_closed_loop::{
    Parameter, Settings,
    diagnosis::{Added, Step},
};
use runout_error::Result;
use runout_numerics::threads;
use runout_turning::{rig::Rig, separation::Separation};

use crate::{
    effects::EffectEntry,
    stage::{Station, StationDiagnosis, StationSeparator},
};

/// What was put right in a recording.
#[derive(Default)]
pub struct PutRight {
    added: Vec<Added>,
    advice: Vec<String>,
    /// Separations of the recordings as they are, by station, where they differ.
    declared: Vec<Option<Separation>>,
    /// What the recordings as they are leave, over all stations.
    level: Left,
}

/// Ids of the mistakes.
pub const IDS: [&str; 3] = [marks::TURN_RATIO, marks::LOST_SAMPLES, stations::ID];

/// The mistakes that are looked for, as they are listed with the effects.
#[must_use]
pub fn mistakes() -> Vec<EffectEntry> {
    let parameter =
        |name: &str, unit: &str, tolerance: f64| Parameter { name: name.into(), unit: unit.into(), tolerance };
    [
        (
            marks::TURN_RATIO,
            "the mark of a setup is on a shaft that turns by another angle",
            vec![parameter("turning", "deg/rev", 0.01)],
        ),
        (
            marks::LOST_SAMPLES,
            "samples of a setup are lost: from one turn on, its readings are those of later angles",
            vec![parameter("lost", "deg", 0.3), parameter("after", "rev", 1.0)],
        ),
        (stations::ID, "the recordings of two stations are exchanged in one setup", Vec::new()),
    ]
    .map(|(name, about, parameters)| EffectEntry::new(name, about, parameters, ()))
    .into()
}

/// Whether a mistake may be put right: a list of effects leaves out those that it does not name.
#[must_use]
pub fn is_looked_for(id: &str, settings: &Settings) -> bool {
    settings.effects.as_ref().is_none_or(|chosen| chosen.iter().any(|chosen| chosen == id))
}

/// Looks for mistakes of the recordings, and puts them right. Marks are already, where profiles were [recounted](marks::recounted).
///
/// # Errors
/// When a station cannot be separated.
pub fn put_right(
    stations: &mut [Station],
    settings: &Settings,
    rig: &Rig,
    separator: &dyn StationSeparator,
) -> Result<PutRight> {
    let exchanges = stations.len() > 1 && rig.setups.len() > 1 && is_looked_for(stations::ID, settings);
    let recounted = marks::take(stations);
    if !exchanges && recounted.is_empty() {
        return Ok(PutRight::default());
    }
    let left_of = |station: &Station| Ok(Left::of(&separator.separate(station)?));
    let mut left = threads::spread(stations, 2, left_of).into_iter().collect::<Result<Vec<Left>>>()?;
    let mut found = PutRight { declared: vec![None; stations.len()], ..PutRight::default() };
    let mut declared = left.clone();
    for (station, as_marked) in marks::as_marked(stations, &recounted) {
        let separation = separator.separate(&as_marked)?;
        declared[station] = Left::of(&separation);
        found.declared[station] = Some(separation);
    }
    found.level = Left::of_all(&declared);
    marks::say(&recounted, stations, rig, [found.level, Left::of_all(&left)], &mut found);
    if exchanges {
        stations::put_right(stations, &mut left, rig, separator, &mut found)?;
    }
    Ok(found)
}

impl PutRight {
    /// The separation of a station's recordings as they are, where something was put right.
    pub(super) fn declared(&mut self, station: usize) -> Option<Separation> {
        self.declared.get_mut(station)?.take()
    }

    /// Says in a diagnosis what was put right before it.
    pub fn say(self, found: &mut StationDiagnosis) {
        if self.added.is_empty() {
            return;
        }
        let diagnosis = &mut found.diagnosis;
        diagnosis.before.residual_rms_um = self.level.rms_um;
        diagnosis.before.chi2_per_dof = Some(self.level.chi2_per_dof);
        diagnosis.before.held_out_rms_um = None;
        diagnosis.added.splice(0..0, self.added);
        diagnosis.warnings.splice(0..0, self.advice);
        diagnosis.verdict = diagnosis.verdict.with_addition();
    }
}

/// An addition without parameters, by the residual before and after it.
fn addition(effect: &str, targets: Vec<String>, [before, after]: [Left; 2], p_value: f64) -> Added {
    Added {
        effect: effect.into(),
        targets,
        confounded_with: Vec::new(),
        distinguished_by: None,
        parameters: Vec::new(),
        change: None,
        residual_rms_um: Step { before: Some(before.rms_um), after: Some(after.rms_um) },
        held_out_rms_um: Step { before: None, after: None },
        held_out_expected_rms_um: None,
        delta_bic: after.chi2() - before.chi2() + before.dof.ln(),
        p_value,
    }
}
