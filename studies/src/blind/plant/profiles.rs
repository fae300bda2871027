//! What single sensors, setups and the spindle add to the form, or take from it.

use runout_spindle::simulate::{
    BracketMotion, ChuckForm, ClampingForm, Effect, ElectricalRunOut, Lobes, ProbeSpot, SpindleConfig,
};

use super::planted;
use crate::{blind::draw::Planted, chance::Chance};

impl Chance {
    /// Shares of form and motion that one sensor sees.
    pub(super) fn of_shares(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let (target, declared) = (self.sensor(config), false);
        if id == "probe-spot" {
            let width_mm = self.size(0.1, 6.0);
            let size = format!("{width_mm:.2} mm");
            let planted = planted("probe-spot", Some(&target), vec![("width", width_mm)], size);
            return (Effect::ProbeSpot(ProbeSpot { targets: vec![target], width_mm, declared }), planted);
        }
        let share = self.signed(1e-3, 0.3, false);
        let size = format!("{:+.2} %", 100.0 * share);
        let planted = planted("bracket-motion", Some(&target), vec![("share", share)], size);
        (Effect::BracketMotion(BracketMotion { targets: vec![target], share, declared }), planted)
    }

    /// A pattern of one order beside the form.
    pub(super) fn of_pattern(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let (order, amplitude_um) = (2 + self.below(11), self.size(2e-3, 2.0));
        let (phase_deg, declared) = (self.between(-180.0, 180.0), false);
        let parameters = vec![("amplitude", amplitude_um), ("order", order as f64), ("phase", phase_deg)];
        let size = format!("{amplitude_um:.3} µm at {order}/rev");
        let target = match id {
            "chuck-form" => None,
            "clamping-form" => Some(self.later_setup(config)),
            _ => Some(self.sensor(config)),
        };
        let targets = target.clone().into_iter().collect();
        let lobes = Lobes { targets, order, amplitude_um, phase_deg, declared };
        let (id, effect) = match id {
            "chuck-form" => ("chuck-form", Effect::ChuckForm(ChuckForm(lobes))),
            "clamping-form" => ("clamping-form", Effect::ClampingForm(ClampingForm(lobes))),
            _ => ("electrical-run-out", Effect::ElectricalRunOut(ElectricalRunOut(lobes))),
        };
        (effect, planted(id, target.as_ref(), parameters, size))
    }
}
