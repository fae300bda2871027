//! Delays, filters and shares of channels, and what one setup has by itself.

use runout_spindle::simulate::{
    ChannelDelay, ChannelGhost, ChannelSkew, CrossTalk, Effect, FilterAttenuation, IndexOffset, LostSamples,
    SensorAngle, SensorGain, SetupGain, SpindleConfig, TurnRatio,
};

use super::{FINE_SAMPLES, planted};
use crate::{blind::draw::Planted, chance::Chance};

impl Chance {
    /// Delays and shares of channels.
    pub(super) fn of_channels(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let deg_per_us = 6e-6 * config.recording.speed_rpm;
        match id {
            "channel-delay" => {
                let (target, delay_us) = (self.sensor(config), self.signed(1.0, 500.0, false));
                let (parameters, size) = (vec![("delay", delay_us * deg_per_us)], format!("{delay_us:+.1} µs"));
                let planted = planted("channel-delay", Some(&target), parameters, size);
                (Effect::ChannelDelay(ChannelDelay { targets: vec![target], delay_us, declared: false }), planted)
            }
            "channel-skew" => {
                let delay_us = self.signed(0.5, 200.0, false);
                let (parameters, size) =
                    (vec![("delay", delay_us * deg_per_us)], format!("{delay_us:+.1} µs a channel"));
                (
                    Effect::ChannelSkew(ChannelSkew { delay_us, declared: false }),
                    planted("channel-skew", None, parameters, size),
                )
            }
            "cross-talk" => {
                let [one, other] = self.two(config.rig.sensors.len());
                let pair = if self.below(2) == 0 { [one, other] } else { [other, one] };
                let targets = pair.map(|index| config.rig.sensors[index].id.clone());
                let share = self.signed(2e-4, 0.05, false);
                let size = format!("{:+.2} %", 100.0 * share);
                let planted = planted("cross-talk", Some(&targets.join(" ")), vec![("share", share)], size);
                (Effect::CrossTalk(CrossTalk { targets, share, declared: false }), planted)
            }
            _ => {
                let share = self.signed(2e-4, 0.05, false);
                let size = format!("{:+.2} %", 100.0 * share);
                (
                    Effect::ChannelGhost(ChannelGhost { share, declared: false }),
                    planted("channel-ghost", None, vec![("share", share)], size),
                )
            }
        }
    }

    /// An anti-alias filter of higher order: sampled so fast that the digital filter is the analogue one.
    pub(super) fn low_pass(&mut self, id: &str, config: &mut SpindleConfig) -> (Effect, Planted) {
        config.recording.samples_per_rev = FINE_SAMPLES;
        let (target, cutoff_rev) = (self.sensor(config), self.size(40.0, 400.0));
        let (id, order) =
            if id == "filter-attenuation-2" { ("filter-attenuation-2", 2) } else { ("filter-attenuation-4", 4) };
        let cutoff_hz = cutoff_rev * config.recording.speed_rpm / 60.0;
        let planted = planted(id, Some(&target), vec![], format!("{cutoff_rev:.0} orders"));
        let effect = FilterAttenuation { targets: vec![target], cutoff_hz, order, declared: false };
        (Effect::FilterAttenuation(effect), planted)
    }

    /// What one setup has by itself.
    pub(super) fn of_one_setup(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let (sensor, setup) = (self.sensor(config), self.later_setup(config));
        let both = format!("{sensor} {setup}");
        let (targets, setups, declared) = (vec![sensor], vec![setup.clone()], false);
        match id {
            "sensor-gain-of-setup" => {
                let relative_gain = self.signed(5e-4, 0.1, false);
                let size = format!("{:+.2} %", 100.0 * relative_gain);
                let planted = planted("sensor-gain", Some(&both), vec![("gain", relative_gain)], size);
                (Effect::SensorGain(SensorGain { targets, relative_gain, setups, declared }), planted)
            }
            "sensor-angle-of-setup" => {
                let angle_deg = self.signed(0.005, 1.0, false);
                let parameters = vec![("angle", angle_deg)];
                let planted = planted("sensor-angle", Some(&both), parameters, format!("{angle_deg:+.3}°"));
                (Effect::SensorAngle(SensorAngle { targets, angle_deg, setups, declared }), planted)
            }
            "setup-gain" => {
                let relative_gain = self.signed(5e-4, 0.1, false);
                let size = format!("{:+.2} %", 100.0 * relative_gain);
                let planted = planted("setup-gain", Some(&setup), vec![("gain", relative_gain)], size);
                (Effect::SetupGain(SetupGain { targets: setups, relative_gain, declared }), planted)
            }
            _ => {
                let angle_deg = self.signed(0.005, 1.0, false);
                let parameters = vec![("angle", angle_deg)];
                let planted = planted("index-offset", Some(&setup), parameters, format!("{angle_deg:+.3}°"));
                (Effect::IndexOffset(IndexOffset { targets: setups, angle_deg, declared }), planted)
            }
        }
    }

    /// How the recording of one setup turns against its mark.
    pub(super) fn of_turning(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let setup = self.later_setup(config);
        let targets = vec![setup.clone()];
        if id == "turn-ratio" {
            let turning_deg = self.signed(2e-4, 20.0, false);
            let parameters = vec![("turning", turning_deg)];
            let planted = planted("turn-ratio", Some(&setup), parameters, format!("{turning_deg:+.4}°/rev"));
            return (Effect::TurnRatio(TurnRatio { targets, turning_deg, declared: false }), planted);
        }
        let turns = config.recording.revolutions as f64;
        let (angle_deg, after_turns) = (self.size(0.01, 120.0), turns * self.between(0.2, 0.7));
        let parameters = vec![("lost", angle_deg), ("after", after_turns)];
        let size = format!("{angle_deg:.3}° after {after_turns:.1} turns");
        let planted = planted("lost-samples", Some(&setup), parameters, size);
        (Effect::LostSamples(LostSamples { targets, after_turns, angle_deg, declared: false }), planted)
    }
}
