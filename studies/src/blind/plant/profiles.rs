//! What single sensors, setups and the spindle add to the form, or take from it.

use runout_spindle::simulate::{BracketMotion, Effect, ProbeSpot, SpindleConfig};

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
}
