//! What single sensors, setups and the spindle add to the form, or take from it.

use runout_spindle::simulate::{
    BracketMotion, ChuckForm, ClampingForm, Effect, ElectricalRunOut, ProbeSpot, SpindleConfig,
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
        match id {
            "chuck-form" => (
                Effect::ChuckForm(ChuckForm { order, amplitude_um, phase_deg, declared }),
                planted("chuck-form", None, parameters, size),
            ),
            "clamping-form" => {
                let target = self.later_setup(config);
                let planted = planted("clamping-form", Some(&target), parameters, size);
                let targets = vec![target];
                (Effect::ClampingForm(ClampingForm { targets, order, amplitude_um, phase_deg, declared }), planted)
            }
            _ => {
                let target = self.sensor(config);
                let planted = planted("electrical-run-out", Some(&target), parameters, size);
                let targets = vec![target];
                let run_out = ElectricalRunOut { targets, order, amplitude_um, phase_deg, declared };
                (Effect::ElectricalRunOut(run_out), planted)
            }
        }
    }
}
