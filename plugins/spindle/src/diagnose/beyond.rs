//! What no layout of a rig shows, whatever is fitted, and what it does to form or motion all the same.

use runout_core::closed_loop::{
    Fit,
    diagnosis::{BiasPerUnit, Blind},
};

use super::{SpindleFit, SpindleModel};
use crate::layout::ENOUGH;

impl SpindleModel {
    /// With two sensors a section, the form of a chuck under them, which turns with the spindle and not with the part, and a bracket that
    /// moves are motion. In any rig, sensors that all see an arc of the width w take sinc(n·w/2R) of order n for the form, 1 − n²w²/24R², and those that all
    /// have a low-pass of first order at the order c take 1 − n²/2c² of its size.
    pub(super) fn beyond_the_layout(&self, after: &SpindleFit) -> Vec<Blind> {
        let blind = |effect: &str, value: f64, unit: &str, on: &str| Blind {
            effect: effect.into(),
            targets: Vec::new(),
            bias_per_unit: BiasPerUnit { value, unit: unit.into(), on: on.into() },
        };
        let layout = &self.traced.layout;
        let radial = || layout.readings.iter().filter(|reading| reading.setup == 0 && !reading.view.is_axial());
        let mut found = Vec::new();
        if radial().count() > 0 && radial().all(|reading| layout.radial_sensors(reading.section) < ENOUGH) {
            found.push(blind("chuck-form", 1.0, "um/um", "motion"));
            found.push(blind("bracket-motion", 1.0, "um/um", "motion"));
        }
        let radius_mm = self.traced.selection.rig.part_radius_mm;
        let orders = after.max_order().saturating_sub(1);
        let forms = layout.forms().count();
        if orders > 0 && forms > 0 {
            let results = after.results();
            let by_order = |(index, part): (usize, &f64)| {
                let order = (2 + index / 2 % orders) as f64;
                if part.is_finite() { (part * order * order).powi(2) } else { 0.0 }
            };
            let squares: f64 = results.iter().take(2 * orders * forms).enumerate().map(by_order).sum();
            let rms_um = (0.5 * squares / forms as f64).sqrt();
            if rms_um.is_finite() && rms_um > 0.0 {
                found.push(blind("probe-spot", rms_um / (24.0 * radius_mm * radius_mm), "um/mm2", "form"));
                found.push(blind("filter-attenuation", 0.5 * rms_um, "um/rev2", "form"));
            }
        }
        found
    }
}
