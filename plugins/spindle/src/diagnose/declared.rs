//! A spindle as declared, before there are turns: what it may lack is known already.

use std::sync::Arc;

use runout_core::{
    Result,
    model::{Effect, closed_loop::Settings},
    pipeline::effects::EffectCatalogue,
    stage::{Station, StationDiagnosis, StationModel},
};

use super::{diagnose, places};
use crate::{effects::SpindleEffect, layout::Layout, selection::Selection};

/// A rig, how its readings are taken, and the effects that it may lack.
pub struct DeclaredSpindle {
    selection: Selection,
    layout: Layout,
    second_order: bool,
    kinds: Vec<Arc<dyn SpindleEffect>>,
    effects: Vec<Effect>,
}

impl DeclaredSpindle {
    /// With the spindle effects of a catalogue.
    #[must_use]
    pub fn new(selection: Selection, layout: Layout, second_order: bool, catalogue: &EffectCatalogue) -> Self {
        let kinds = catalogue.of::<Arc<dyn SpindleEffect>>();
        let effects = places(&kinds, &selection, &layout, second_order).into_iter().map(|place| place.effect).collect();
        Self { selection, layout, second_order, kinds, effects }
    }
}

impl StationModel for DeclaredSpindle {
    fn effects(&self) -> &[Effect] {
        &self.effects
    }

    fn diagnose(&self, stations: &[Station], settings: &Settings) -> Result<StationDiagnosis> {
        let (selection, layout) = (self.selection.clone(), self.layout.clone());
        diagnose(selection, layout, self.second_order, self.kinds.clone(), stations, settings)
    }
}
