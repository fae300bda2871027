//! Mistakes in the rig file that the data suggest, and those that they cannot show.

use runout_core::{
    Result,
    closed_loop::{
        Fit, Model, Setting,
        diagnosis::{BiasPerUnit, Blind, Diagnosis},
    },
};

use super::{
    SpindleModel,
    data::{self, Shared},
};
use crate::{
    effects::{Alterations, Mistake},
    selection::Selection,
    wiring,
};

/// What moves form and motion by less is another way to say the same, in µm.
const SAME_UM: f64 = 1e-6;
/// A mistake that changes χ² by less than the square of this, in units of the residual, is not observable.
const VISIBLE: f64 = 3.0;

impl SpindleModel {
    pub(super) fn alterations(&self, applied: &[Setting]) -> Alterations {
        let Shared { layout, kinds, places, .. } = &*self.traced;
        data::altered(layout, kinds, places, applied).unwrap_or_else(|_| Alterations::none(layout))
    }

    /// The effect that is a mistake at a target.
    fn effect_of(&self, (mistake, target): (Mistake, usize)) -> Option<usize> {
        let is =
            |place: &data::Place| place.index == target && self.traced.kinds[place.kind].mistake() == Some(mistake);
        self.traced.places.iter().position(is)
    }

    /// Mistakes beside some effects that would leave far less, as effects: the first station decides.
    pub(super) fn suspects(&self, applied: &[Setting]) -> Vec<Vec<usize>> {
        let Some(data) = self.traced.data.first() else { return Vec::new() };
        let alterations = self.alterations(applied);
        let suspects = wiring::suspects(&self.traced.layout, &alterations, &data.readings, data.weights.as_deref());
        let effects = |suspect: &wiring::Suspect| suspect.mistakes.iter().map(|one| self.effect_of(*one)).collect();
        suspects.iter().filter_map(effects).collect()
    }

    /// What to do about recordings that are wrong.
    pub(super) fn advice(&self, applied: &[Setting]) -> Vec<String> {
        let rig = &self.traced.selection.rig;
        let of = |setting: &Setting| {
            self.traced.kind(setting.effect).mistake()?.advice(self.traced.places[setting.effect].index, rig)
        };
        applied.iter().filter_map(of).collect()
    }

    /// Several swaps are one change of the rig file: the ids in their true order, said of the first of them.
    pub(super) fn join_swaps(&self, diagnosis: &mut Diagnosis, applied: &[Setting]) {
        let alterations = self.alterations(applied);
        let Selection { rig, sensors, setups, .. } = &self.traced.selection;
        let sensor_ids: Vec<&str> = rig.sensors.iter().map(|sensor| sensor.id.as_str()).collect();
        let setup_ids: Vec<&str> = rig.setups.iter().map(|setup| setup.id.as_str()).collect();
        for (mistake, list, ids, files, places) in [
            (Mistake::SensorsSwapped, "sensors", sensor_ids, sensors, &alterations.places),
            (Mistake::SetupsSwapped, "setups", setup_ids, setups, &alterations.clampings),
        ] {
            let mut swaps: Vec<_> = diagnosis
                .added
                .iter_mut()
                .filter(|added| added.effect == mistake.id() && added.targets.len() == 2)
                .collect();
            if swaps.len() < 2 {
                continue;
            }
            let moved = places.iter().enumerate().filter(|(recorded, place)| recorded != *place);
            let mut keys: Vec<(usize, &str)> = moved.map(|(recorded, place)| (files[*place], ids[recorded])).collect();
            keys.sort_unstable();
            let keys: Vec<String> = keys.iter().map(|(place, id)| format!("{list}.{place}.id = \"{id}\"")).collect();
            for swap in &mut swaps {
                swap.change = None;
            }
            swaps[0].change = Some(keys.join("\n"));
        }
    }

    /// Mistakes that leave no trace in these data, and what they would do to form or motion: signs of all sensors of a section among
    /// them, which make form and motion the negative of what they are said to be.
    pub(super) fn unobservable(&self, applied: &[Setting]) -> Result<Vec<Blind>> {
        let Some(data) = self.traced.data.first() else { return Ok(Vec::new()) };
        let declared = self.fit(applied)?;
        if !declared.remainder().noise_is_known() {
            return Ok(Vec::new());
        }
        let limit = VISIBLE * VISIBLE * declared.remainder().chi2_per_dof().max(1.0);
        let alterations = self.alterations(applied);
        let mut blind = Vec::new();
        for mistakes in wiring::traceless(&self.traced.layout, &alterations, &data.readings, data.weights.as_deref()) {
            let Some(effects) = mistakes.iter().map(|one| self.effect_of(*one)).collect::<Option<Vec<usize>>>() else {
                continue;
            };
            let with = effects.iter().map(|effect| Setting { effect: *effect, values: Vec::new() });
            let other = self.fit(&applied.iter().cloned().chain(with).collect::<Vec<_>>())?;
            // The exact geometry may show what the linear equations do not.
            if (other.remainder().chi2() - declared.remainder().chi2()).abs() > limit {
                continue;
            }
            let [form_um, motion_um] = declared.apart_um(&other);
            let (on, value) = if form_um >= motion_um { ("form", form_um) } else { ("motion", motion_um) };
            if value > SAME_UM {
                let targets = effects.iter().flat_map(|effect| self.traced.effects[*effect].targets.iter().cloned());
                blind.push(Blind {
                    effect: self.traced.effects[effects[0]].id.clone(),
                    targets: targets.collect(),
                    bias_per_unit: BiasPerUnit { value, unit: "um".into(), on: on.into() },
                });
            }
        }
        Ok(blind)
    }
}
