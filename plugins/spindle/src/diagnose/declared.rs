//! A spindle as declared, before there are turns: what it may lack is known already.

use std::sync::Arc;

use runout_core::{
    Result,
    closed_loop::{Effect, Setting, Settings},
    effects::EffectCatalogue,
    profile::Profile,
    stage::{Station, StationDiagnosis, StationModel},
};

use super::{SpindleModel, data::Place, declared_by, places, run};
use crate::{effects::SpindleEffect, layout::Layout, selection::Selection};

/// A rig, how its readings are taken, and the effects that it may lack.
pub struct DeclaredSpindle {
    selection: Selection,
    layout: Layout,
    second_order: bool,
    kinds: Vec<Arc<dyn SpindleEffect>>,
    places: Vec<Place>,
    effects: Vec<Effect>,
}

impl DeclaredSpindle {
    /// With the spindle effects of a catalogue.
    #[must_use]
    pub fn new(selection: Selection, layout: Layout, second_order: bool, catalogue: &EffectCatalogue) -> Self {
        let kinds = catalogue.of::<Arc<dyn SpindleEffect>>();
        let places = places(&kinds, &selection, &layout, second_order);
        let effects = places.iter().map(|place| place.effect.clone()).collect();
        Self { selection, layout, second_order, kinds, places, effects }
    }
}

impl StationModel for DeclaredSpindle {
    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn changes(&self, effect: usize, applied: &[Setting]) -> Vec<String> {
        declared_by(&self.selection, &self.layout, &self.kinds, &self.places, effect, applied)
    }

    fn bytes(&self, station: &Station) -> u64 {
        let orders = station.profiles.iter().map(Profile::max_order).min().unwrap_or(0);
        let (readings, setups) = (self.layout.readings.len(), self.selection.rig.setups.len().max(1));
        SpindleModel::bytes(orders, [readings, readings / setups, self.layout.unknowns.len()])
    }

    fn diagnose(&self, stations: &mut [Station], settings: &Settings) -> Result<StationDiagnosis> {
        let (selection, layout, kinds) = (self.selection.clone(), self.layout.clone(), self.kinds.clone());
        let model = SpindleModel::new(selection, layout, self.second_order, kinds, stations)?;
        stations.iter_mut().flat_map(|station| &mut station.profiles).for_each(|profile| profile.split = None);
        run(&model, stations, settings)
    }
}
