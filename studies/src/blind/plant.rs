//! What goes wrong in a campaign, and how much.

mod channels;
mod profiles;

use runout_core::rig::SetupConfig;
use runout_spindle::simulate::{
    AsynchronousLine, AxialMotion, Backlash, Dent, Effect, EvenOrderMotion, FilterAttenuation, MotionHarmonic,
    PartAngleSign, ReversalAngle, RotationReversed, SensorAngle, SensorAxialPosition, SensorGain, SensorLine,
    SensorNonlinearity, SensorSign, SensorsAngle, SensorsSwapped, SetupMotionChange, SetupsSwapped, SlippedProbe,
    SpeedRipple, SpindleConfig, Step, ThermalDrift,
};

use super::draw::Planted;
use crate::chance::Chance;

/// Samples a turn with which a digital low-pass is the analogue one at the orders of the form.
const FINE_SAMPLES: usize = 2048;

fn planted(id: &'static str, target: Option<&String>, parameters: Vec<(&'static str, f64)>, size: String) -> Planted {
    Planted { id, target: target.cloned(), parameters, size, is_also: Vec::new() }
}

impl Chance {
    /// Puts something wrong into a campaign: from below what can be seen to large.
    pub(super) fn plant(&mut self, id: &str, large: bool, config: &mut SpindleConfig) -> Planted {
        let (effect, planted) = match id {
            "second-order-geometry" => {
                config.eccentricity.offset_um = self.size(3.0, 150.0);
                let size = format!("eccentricity {:.0} µm", config.eccentricity.offset_um);
                return planted("second-order-geometry", None, vec![], size);
            }
            "reversal-angle" | "sensors-angle" | "setup-motion-change" => self.of_setup(id, large, config),
            "speed-ripple" => self.speed_ripple(large),
            "speed-ripple-of-setup" => self.speed_ripple_of_setup(large, config),
            "sensor-sign" | "sensors-swapped" | "setups-swapped" | "rotation-reversed" | "part-angle-sign" => {
                self.mistake(id, Vec::new(), config)
            }
            "sensor-sign-of-setup" | "sensors-swapped-of-setup" | "rotation-reversed-of-setup" => {
                let setup = self.later_setup(config);
                self.mistake(id.trim_end_matches("-of-setup"), vec![setup], config)
            }
            "sensor-unit" => self.another_unit(config),
            "even-order-motion" | "axial-motion" | "asynchronous-line" => self.of_motion(id),
            "channel-delay" | "channel-skew" | "cross-talk" | "channel-ghost" => self.of_channels(id, config),
            "filter-attenuation-2" | "filter-attenuation-4" => self.low_pass(id, config),
            "sensor-gain-of-setup" | "sensor-angle-of-setup" | "setup-gain" | "index-offset" => {
                self.of_one_setup(id, config)
            }
            "lost-samples" | "turn-ratio" => self.of_turning(id, config),
            "probe-spot" | "bracket-motion" => self.of_shares(id, config),
            "chuck-form" | "clamping-form" | "electrical-run-out" => self.of_pattern(id, config),
            "dent" | "backlash" | "step" | "slipped-probe" => self.stranger(id, config),
            _ => self.of_sensor(id, large, config),
        };
        config.effect.push(effect);
        planted
    }

    /// Effects of a sensor.
    fn of_sensor(&mut self, id: &str, large: bool, config: &mut SpindleConfig) -> (Effect, Planted) {
        match id {
            "sensor-gain" => {
                let (target, relative_gain) = (self.sensor(config), self.signed(2e-4, 0.1, large));
                let size = format!("{:+.2} %", 100.0 * relative_gain);
                let planted = planted("sensor-gain", Some(&target), vec![("gain", relative_gain)], size);
                (
                    Effect::SensorGain(SensorGain {
                        targets: vec![target],
                        relative_gain,
                        setups: Vec::new(),
                        declared: false,
                    }),
                    planted,
                )
            }
            "sensor-angle" => {
                let (target, angle_deg) = (self.sensor(config), self.signed(0.003, 2.0, large));
                let parameters = vec![("angle", angle_deg)];
                let planted = planted("sensor-angle", Some(&target), parameters, format!("{angle_deg:+.3}°"));
                (
                    Effect::SensorAngle(SensorAngle {
                        targets: vec![target],
                        angle_deg,
                        setups: Vec::new(),
                        declared: false,
                    }),
                    planted,
                )
            }
            "sensor-axial-position" => {
                let (target, shift_mm) = (self.sensor(config), self.signed(0.02, 5.0, large));
                let size = format!("{shift_mm:+.2} mm");
                let planted = planted("sensor-axial-position", Some(&target), vec![("shift", shift_mm)], size);
                let effect = SensorAxialPosition { targets: vec![target], shift_mm, declared: false };
                (Effect::SensorAxialPosition(effect), planted)
            }
            "sensor-nonlinearity" => {
                let (target, quadratic_per_um) = (self.sensor(config), self.signed(2e-5, 5e-3, large));
                let cubic_per_um2 = if self.below(2) == 0 { 0.0 } else { self.signed(1e-6, 1e-4, large) };
                let parameters = vec![("quadratic", quadratic_per_um), ("cubic", cubic_per_um2)];
                let size = format!("{quadratic_per_um:+.1e}/µm, {cubic_per_um2:+.1e}/µm²");
                let planted = planted("sensor-nonlinearity", Some(&target), parameters, size);
                let targets = vec![target];
                let effect = SensorNonlinearity { targets, quadratic_per_um, cubic_per_um2, declared: false };
                (Effect::SensorNonlinearity(effect), planted)
            }
            "thermal-drift" => self.drift(large, config),
            "sensor-line" => self.pick_up(config),
            _ => {
                // The simulator's digital filter is the analogue one that the loop knows where it is sampled fast.
                config.recording.samples_per_rev = FINE_SAMPLES;
                let (target, cutoff_hz) = (self.sensor(config), self.size(300.0, 2100.0));
                let planted = planted("filter-attenuation", Some(&target), vec![], format!("{cutoff_hz:.0} Hz"));
                let effect = FilterAttenuation { targets: vec![target], cutoff_hz, order: 1, declared: false };
                (Effect::FilterAttenuation(effect), planted)
            }
        }
    }

    /// A drift along a straight line or with a time constant, in all captures or in one.
    fn drift(&mut self, large: bool, config: &SpindleConfig) -> (Effect, Planted) {
        let (target, rate_um_per_rev) = (self.sensor(config), self.signed(0.02, 2.0, large));
        let time_constant_turns = if self.below(2) == 0 { None } else { Some(self.size(10.0, 60.0)) };
        let turns = config.recording.revolutions as f64;
        let over_capture = |tau: f64| -rate_um_per_rev * tau * (-turns / tau).exp_m1();
        let over_capture = time_constant_turns.map_or(rate_um_per_rev * turns, over_capture);
        let mut parameters = vec![("over-capture", over_capture)];
        let mut size = format!("{rate_um_per_rev:+.3} µm/rev, {over_capture:+.2} µm over a capture");
        if let Some(turns) = time_constant_turns {
            parameters.push(("time-constant", turns));
            size = format!("{size}, {turns:.0} turns");
        }
        let mut setups = Vec::new();
        if self.below(4) == 0 {
            let setup = self.later_setup(config);
            // Captures that differ have a parameter each.
            parameters.retain(|(name, _)| *name == "time-constant");
            size = format!("{size} in {setup} only");
            setups.push(setup);
        }
        let planted = planted("thermal-drift", Some(&target), parameters, size);
        let targets = vec![target];
        let effect = ThermalDrift { targets, rate_um_per_rev, time_constant_turns, setups, declared: false };
        (Effect::ThermalDrift(effect), planted)
    }

    /// Mains or another line in one channel.
    fn pick_up(&mut self, config: &SpindleConfig) -> (Effect, Planted) {
        let (target, amplitude_um) = (self.sensor(config), self.size(0.02, 2.0));
        let turns_hz = config.recording.speed_rpm / 60.0;
        let frequency_hz = match self.below(3) {
            0 => 60.0,
            1 => 60.0 * (1 + self.below(3)) as f64 + 0.07,
            _ => (self.below(12) as f64 + self.between(0.2, 0.8)) * turns_hz,
        };
        let parameters = vec![("frequency", frequency_hz), ("amplitude", amplitude_um)];
        let size = format!("{amplitude_um:.3} µm at {frequency_hz:.2} Hz");
        let planted = planted("sensor-line", Some(&target), parameters, size);
        let targets = vec![target];
        let effect =
            SensorLine { targets, frequency_hz: Some(frequency_hz), order: None, amplitude_um, declared: false };
        (Effect::SensorLine(effect), planted)
    }

    /// Effects of a setup.
    fn of_setup(&mut self, id: &str, large: bool, config: &SpindleConfig) -> (Effect, Planted) {
        let target = self.later_setup(config);
        if id == "reversal-angle" {
            let angle_deg = self.signed(0.003, 1.0, large);
            let parameters = vec![("angle", angle_deg)];
            let planted = planted("reversal-angle", Some(&target), parameters, format!("{angle_deg:+.3}°"));
            return (
                Effect::ReversalAngle(ReversalAngle { targets: vec![target], angle_deg, declared: false }),
                planted,
            );
        }
        if id == "sensors-angle" {
            let angle_deg = self.signed(0.003, 1.0, large);
            let parameters = vec![("angle", angle_deg)];
            let planted = planted("sensors-angle", Some(&target), parameters, format!("{angle_deg:+.3}°"));
            return (Effect::SensorsAngle(SensorsAngle { targets: vec![target], angle_deg, declared: false }), planted);
        }
        let ratio = 1.0 + self.signed(0.003, 0.3, large);
        let size = format!("{ratio:.3}");
        let planted = planted("setup-motion-change", Some(&target), vec![("ratio", ratio)], size);
        let effect = SetupMotionChange { targets: vec![target], ratio, declared: false };
        (Effect::SetupMotionChange(effect), planted)
    }

    fn speed_ripple(&mut self, large: bool) -> (Effect, Planted) {
        let order = 1 + self.below(4);
        let amplitude = self.signed(1e-4, 0.01, large).abs();
        let parameters = vec![("amplitude", amplitude.to_degrees()), ("order", order as f64)];
        let planted = planted("speed-ripple", None, parameters, format!("{amplitude:.1e} rad at {order}/rev"));
        let effect = SpeedRipple {
            order: order as f64,
            amplitude_deg: amplitude.to_degrees(),
            phase_deg: self.between(0.0, 360.0),
            targets: vec![],
            declared: false,
        };
        (Effect::SpeedRipple(effect), planted)
    }

    fn speed_ripple_of_setup(&mut self, large: bool, config: &SpindleConfig) -> (Effect, Planted) {
        let target = config.rig.setups[self.below(config.rig.setups.len())].id.clone();
        match self.speed_ripple(large) {
            (Effect::SpeedRipple(ripple), common) => {
                let effect = SpeedRipple { targets: vec![target.clone()], ..ripple };
                (Effect::SpeedRipple(effect), Planted { target: Some(target), ..common })
            }
            other => other,
        }
    }

    /// The rig file is wrong, or the recording of a setup.
    fn mistake(&mut self, id: &str, setups: Vec<String>, config: &SpindleConfig) -> (Effect, Planted) {
        let named = |id: &'static str, targets: &[String], setups: &[String]| {
            let target = (targets.len() + setups.len() > 0).then(|| [targets, setups].concat().join(" "));
            planted(id, target.as_ref(), vec![], String::new())
        };
        let declared = false;
        match id {
            "sensor-sign" => {
                let targets = vec![self.sensor(config)];
                let planted = named("sensor-sign", &targets, &setups);
                (Effect::SensorSign(SensorSign { targets, setups, declared }), planted)
            }
            "sensors-swapped" => {
                let targets = self.two(config.rig.sensors.len()).map(|index| config.rig.sensors[index].id.clone());
                let planted = named("sensors-swapped", &targets, &setups);
                (Effect::SensorsSwapped(SensorsSwapped { targets, setups, declared }), planted)
            }
            "setups-swapped" => {
                let targets = self.two(config.rig.setups.len()).map(|index| config.rig.setups[index].id.clone());
                let planted = named("setups-swapped", &targets, &[]);
                (Effect::SetupsSwapped(SetupsSwapped { targets, declared }), planted)
            }
            "rotation-reversed" => {
                let planted = named("rotation-reversed", &[], &setups);
                (Effect::RotationReversed(RotationReversed { setups, declared }), planted)
            }
            _ => (Effect::PartAngleSign(PartAngleSign { declared }), named("part-angle-sign", &[], &[])),
        }
    }

    /// A channel in mil, mm, nm or volts of ten times the range.
    fn another_unit(&mut self, config: &SpindleConfig) -> (Effect, Planted) {
        let (target, factor) = (self.sensor(config), [1.0 / 25.4, 1e-3, 1e3, 0.1, 10.0][self.below(5)]);
        let (relative_gain, size) = (factor - 1.0, format!("{factor:.3} times"));
        let planted = planted("sensor-gain", Some(&target), vec![("gain", relative_gain)], size);
        let (targets, setups, declared) = (vec![target], Vec::new(), false);
        (Effect::SensorGain(SensorGain { targets, relative_gain, setups, declared }), planted)
    }

    /// Two different places among `count`, the first one before the second.
    fn two(&mut self, count: usize) -> [usize; 2] {
        let first = self.below(count - 1);
        [first, first + 1 + self.below(count - 1 - first)]
    }

    /// Motion that the declared model does not have.
    fn of_motion(&mut self, id: &str) -> (Effect, Planted) {
        match id {
            "even-order-motion" => {
                let rms = self.size(0.003, 1.0);
                let effect = EvenOrderMotion { x_rms_um: rms, y_rms_um: rms, max_order: 20, declared: false };
                let planted = planted("even-order-motion", None, vec![], format!("{rms:.3} µm rms"));
                (Effect::EvenOrderMotion(effect), planted)
            }
            "axial-motion" => {
                let (order, amplitude_um) = (1 + self.below(6), self.size(2.0, 100.0));
                let parameters = vec![("amplitude", amplitude_um), ("order", order as f64)];
                let planted = planted("axial-motion", None, parameters, format!("{amplitude_um:.1} µm at {order}/rev"));
                let harmonics = vec![MotionHarmonic { order, amplitude_um, phase_deg: self.between(0.0, 360.0) }];
                (Effect::AxialMotion(AxialMotion { harmonics, declared: false }), planted)
            }
            _ => {
                let (order, amplitude_um) = (self.below(4) as f64 + self.between(0.2, 0.8), self.size(0.02, 0.6));
                let parameters = vec![("amplitude", amplitude_um), ("order", order)];
                let size = format!("{amplitude_um:.3} µm at {order:.3}/rev");
                let planted = planted("asynchronous-line", None, parameters, size);
                let direction_deg = self.between(0.0, 180.0);
                let effect = AsynchronousLine { order, amplitude_um, direction_deg, declared: false };
                (Effect::AsynchronousLine(effect), planted)
            }
        }
    }

    fn stranger(&mut self, id: &str, config: &SpindleConfig) -> (Effect, Planted) {
        let sensor = self.sensor(config);
        let setup = config.rig.setups[self.below(config.rig.setups.len())].id.clone();
        let named = |id, size| planted(id, None, vec![], size);
        let targets = vec![sensor.clone()];
        match id {
            "dent" => {
                let (depth_um, width_deg) = (self.signed(0.05, 10.0, false), self.size(1.0, 8.0));
                let part_angle_deg = self.between(0.0, 360.0);
                let dent = Dent { depth_um, part_angle_deg, width_deg, ..Dent::default() };
                let (effect, place) = if self.below(2) == 0 {
                    (Dent { targets, ..dent }, format!("seen by {sensor}"))
                } else {
                    (Dent { setups: vec![setup.clone()], ..dent }, format!("there in {setup}"))
                };
                (Effect::Dent(effect), named("dent", format!("{depth_um:+.2} µm, {width_deg:.1}° wide, {place}")))
            }
            "backlash" => {
                let play_um = self.size(0.02, 1.0);
                let effect = Backlash { targets, play_um, ..Backlash::default() };
                (Effect::Backlash(effect), named("backlash", format!("{play_um:.3} µm in {sensor}")))
            }
            "step" => {
                let (step_um, from_deg) = (self.signed(0.02, 2.0, false), self.between(0.0, 360.0));
                let to_deg = (from_deg + self.between(20.0, 180.0)) % 360.0;
                let size = format!("{step_um:+.3} µm from {from_deg:.0}° to {to_deg:.0}° in {sensor}, {setup}");
                let effect = Step { targets, setups: vec![setup], step_um, from_deg, to_deg, declared: false };
                (Effect::Step(effect), named("step", size))
            }
            _ => {
                let turns = config.recording.revolutions as f64;
                let effect = SlippedProbe {
                    targets,
                    setup: self.later_setup(config),
                    after_turns: self.between(0.2 * turns, 0.8 * turns),
                    shift_um: self.signed(0.05, 5.0, false),
                    angle_deg: self.signed(0.003, 1.0, false),
                    relative_gain: self.signed(2e-4, 0.03, false),
                    declared: false,
                };
                let size = format!(
                    "{:+.2} µm, {:+.3}°, {:+.2} % after {:.0} turns of {}, {sensor}",
                    effect.shift_um,
                    effect.angle_deg,
                    100.0 * effect.relative_gain,
                    effect.after_turns,
                    effect.setup
                );
                // It stays there.
                let later = config.rig.setups.iter().skip_while(|setup| setup.id != effect.setup);
                let in_setup = |setup: &SetupConfig| {
                    ["sensor-angle", "sensor-gain"].map(|id| format!("{id} {sensor} {}", setup.id))
                };
                let is_also = later.flat_map(in_setup).collect();
                (Effect::SlippedProbe(effect), Planted { is_also, ..named("slipped-probe", size) })
            }
        }
    }
}
