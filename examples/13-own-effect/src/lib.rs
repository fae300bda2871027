//! `probe-lag`: one channel is late by a constant time, as behind electronics with a group delay of their own. A multiplexer
//! that reads a channel after the others makes its lag negative.
//!
//! At a constant speed the time is an angle λ of the spindle, and the reading is u(Φ − λ). By the shift theorem (Bracewell, *The
//! Fourier Transform and Its Applications*, chapter 6) a reading Re Σ c e^{−inΦ} becomes Re Σ c e^{inλ} e^{−inΦ}, and
//! ∂c/∂λ = i n c.
//!
//! Three effects of the toolkit come close. To first order a low-pass in one channel (`filter-attenuation`, p = λ) is the
//! same: the amplitudes of high orders distinguish them, once nλ is no longer small. A turned sensor (`sensor-angle`) shifts the
//! form as much and the motion otherwise. A lag in all channels alike is another zero of the spindle's angle, and is never
//! observable.

mod channel_delay;

use std::sync::Arc;

use runout_core::{
    Complex64,
    pipeline::{Plugin, Registry},
};
use runout_spindle::effects::{self, About, ActsOn, Alterations, Predicted, SpindleEffect, Transfer, parameter};

pub use channel_delay::ChannelDelayConfig;

/// Adds the effect `probe-lag`, and the preprocessor `channel-delay` to try it with.
pub fn register(registry: &mut Registry) {
    registry.effects.add(effects::entry(Arc::new(ProbeLag)));
    registry.preprocessors.add(Plugin::of::<ChannelDelayConfig>());
}

/// A channel that is late.
pub struct ProbeLag;

impl SpindleEffect for ProbeLag {
    fn about(&self) -> About {
        // One sample of 512 a turn is 0.012 rad.
        let parameters = vec![parameter("lag", "rad", 0.01)];
        About { id: "probe-lag", does: "a channel is later than the others", acts_on: ActsOn::Sensor, parameters }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let lag = values[0];
        let late = Transfer::new(move |order| Complex64::from_polar(1.0, order as f64 * lag));
        alterations.sensors[target].transfers.push(late);
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let late = |order: usize, at: usize| Complex64::I * order as f64 * predicted.readings[at];
        vec![predicted.each(|reading| reading.sensor == target, late)]
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

    use std::{f64::consts::TAU, path::Path};

    use runout_core::{
        inspection::Inspection,
        measurement::Recording,
        model::{Effect, Fit, Model, Setting, closed_loop::Settings, diagnosis::Verdict},
        pipeline::{Context, StageConfig},
        rig::{Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
        stage::{AverageRequest, Preprocessor, Station},
    };
    use runout_preprocess::SynchronousAverageConfig;
    use runout_spindle::{
        diagnose::{SpindleModel, diagnose},
        layout::Layout,
        selection::Selection,
        simulate::{self, SpindleConfig},
    };

    use super::*;

    const SAMPLES_PER_REV: usize = 512;

    /// Three sensors in one section, the part at two angles, as in this example's scenario.
    fn campaign(seed: u64) -> SpindleConfig {
        let sensor = |(id, angle_deg): (&str, f64)| SensorConfig {
            id: id.into(),
            angle_deg,
            z_mm: 100.0,
            section: "a".into(),
            sign: 1,
            ..SensorConfig::default()
        };
        let setup = |(id, part_deg): (&str, f64)| SetupConfig { id: id.into(), part_deg, sensors_deg: 0.0 };
        let mut config = SpindleConfig::new(RigConfig {
            interruptions: Vec::new(),
            part_radius_mm: 30.0,
            rotation: Rotation::Ccw,
            sensors: [("S1", 0.0), ("S2", 99.844), ("S3", 202.5)].into_iter().map(sensor).collect(),
            setups: [("a", 0.0), ("b", 180.0)].into_iter().map(setup).collect(),
        });
        config.seed = seed;
        config.form.rms_um = 4.0;
        config.motion.x_rms_um = 1.5;
        config.motion.y_rms_um = 1.5;
        config.eccentricity.offset_um = 8.0;
        config.asynchronous.rms_um = Some(0.15);
        config.noise.rms_um = 0.05;
        config
    }

    /// The simulated recording with one channel moved by whole samples, averaged with a fifth of the turns held out.
    fn averaged(config: &SpindleConfig, rig: &Rig, delay: &ChannelDelayConfig) -> Station {
        let simulator = simulate::simulator(config).unwrap();
        let recording = simulator.spindle_recording();
        let context = Context { folder: Path::new(""), rig: None };
        let average = SynchronousAverageConfig {
            samples_per_rev: SAMPLES_PER_REV,
            min_turns: 2,
            turn_tolerance_percent: 5.0,
            outlier_sigma: None,
            speed_tolerance_percent: 2.0,
        };
        let (Preprocessor::Conditioner(delay), Preprocessor::Averager(average)) =
            (delay.clone().check(&context).unwrap(), average.check(&context).unwrap())
        else {
            panic!("other stages");
        };
        let wanted = AverageRequest { hold_out: Some(0.2), ..AverageRequest::default() };
        let profile = |setup| {
            let stream = Inspection::new(recording.open(0, setup).unwrap());
            average.average_requested(delay.attach(Box::new(stream)).unwrap(), wanted).unwrap()
        };
        let profiles = (0..rig.setups.len()).map(profile).collect();
        Station { name: "s001".into(), z_mm: 0.0, profiles }
    }

    /// Those of the toolkit, and the one of this crate.
    fn every_effect() -> Vec<Arc<dyn SpindleEffect>> {
        let mut registry = Registry::default();
        runout_spindle::register(&mut registry);
        register(&mut registry);
        registry.effects.of()
    }

    /// Two seeds: a lag of one sample in S2, and of two in S3. The shift is that of the recording, not of the model.
    #[test]
    fn a_late_channel_is_found() {
        for (seed, id, samples) in [(1, "S2", 1), (2, "S3", 2)] {
            let config = campaign(seed);
            let rig = config.rig.clone().check().unwrap();
            let station = averaged(&config, &rig, &ChannelDelayConfig { sensor: id.into(), samples });
            let (selection, layout) = (Selection::whole(&rig), Layout::new(&rig, false));
            let said = diagnose(selection, layout, true, every_effect(), &[station], &Settings::default()).unwrap();
            let diagnosis = said.diagnosis;
            let chi2 = [&diagnosis.before, &diagnosis.after].map(|level| level.chi2_per_dof.unwrap());
            println!("simulated, {id} {samples} late: χ² {:.2} → {:.2}, {:?}", chi2[0], chi2[1], diagnosis.added);
            assert_eq!(diagnosis.verdict, Verdict::Explained, "{:?}", diagnosis.added);
            let [added] = &diagnosis.added[..] else { panic!("{:?}", diagnosis.added) };
            assert_eq!((&*added.effect, &*added.targets), ("probe-lag", &[id.to_owned()][..]));
            assert!(added.confounded_with.is_empty(), "{:?}", added.confounded_with);
            let lag = &added.parameters[0];
            let truth = TAU * samples as f64 / SAMPLES_PER_REV as f64;
            // Five standard uncertainties: what two seeds never reach by chance.
            assert!((lag.value - truth).abs() < 5.0 * lag.std.unwrap(), "{lag:?} for {truth}");
        }
    }

    /// The signature is what the residual does when the lag is a little more and a little less.
    #[test]
    fn partials_are_finite_differences() {
        let config = campaign(3);
        let rig = config.rig.clone().check().unwrap();
        let station = averaged(&config, &rig, &ChannelDelayConfig { sensor: "S1".into(), samples: 0 });
        let layout = Layout::new(&rig, false);
        let model =
            SpindleModel::new(Selection::whole(&rig), layout, true, vec![Arc::new(ProbeLag)], &[station]).unwrap();
        let declared = model.fit(&[]).unwrap();
        let norm = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
        for (effect, Effect { targets, .. }) in model.effects().iter().enumerate() {
            let step = 1e-4;
            let residual = |lag: f64| {
                let applied = [Setting { effect, values: vec![lag] }];
                model.fit(&applied).unwrap().remainder().residual.clone()
            };
            let (late, early) = (residual(step), residual(-step));
            let analytic = &declared.signature(effect)[0];
            let slope = late.iter().zip(&early).map(|(late, early)| (late - early) / (2.0 * step));
            let off: Vec<f64> = slope.zip(analytic).map(|(slope, analytic)| slope - analytic).collect();
            // 5 %: what exact geometry adds to the linear reading, and the projection's own change (Kaufman).
            assert!(norm(&off) < 0.05 * norm(analytic), "{targets:?}: {} of {}", norm(&off), norm(analytic));
        }
    }
}
