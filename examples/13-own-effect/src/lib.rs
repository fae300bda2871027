//! `ac-coupling`: the input of one channel is AC-coupled, so that it passes on what is slow too small and too early.
//!
//! A first-order high-pass s/(s + ω) has at order n the response H = 1/(1 + i c/n), with −3 dB at the order c (time runs with
//! e^{−inΦ}, s = −i n). A reading Re Σ u e^{−inΦ} becomes Re Σ H u e^{−inΦ}, and ∂ln H/∂c = −(i/n)/(1 + i c/n) (Horowitz, Hill, *The Art of
//! Electronics*, section 1.7).
//!
//! The low-passes of the toolkit (`filter-attenuation`) act on high orders; this effect acts on the lowest ones.

mod high_pass;

use std::sync::Arc;

use runout_core::{
    Complex64,
    pipeline::{Plugin, Registry},
};
use runout_spindle::effects::{self, About, ActsOn, Alterations, Predicted, SpindleEffect, Transfer, parameter};

pub use high_pass::HighPassChannelConfig;

/// Adds the effect `ac-coupling`, and the preprocessor `high-pass-channel` to try it with.
pub fn register(registry: &mut Registry) {
    registry.effects.add(effects::entry(Arc::new(AcCoupling)));
    registry.preprocessors.add(Plugin::of::<HighPassChannelConfig>());
}

/// A channel without the slow part of its signal.
pub struct AcCoupling;

const ID: &str = "ac-coupling";

impl SpindleEffect for AcCoupling {
    fn about(&self) -> About {
        // At 600 rpm, 0.1/rev is 1 Hz.
        let parameters = vec![parameter("cut-off", "1/rev", 0.1)];
        About { id: ID, does: "the input of a channel is AC-coupled", acts_on: ActsOn::Sensor, parameters }
    }

    fn alter(&self, target: usize, values: &[f64], alterations: &mut Alterations) {
        let cut_off = values[0];
        // The mean level is no part of form or motion; a response is never 0.
        let response = move |order: usize| Complex64::new(1.0, cut_off / order.max(1) as f64).inv();
        alterations.sensors[target].transfers.push(Transfer::new(response).of(ID, values));
    }

    fn partials(&self, target: usize, predicted: &Predicted) -> Vec<Vec<Complex64>> {
        let cut_off = predicted.alterations.sensors[target].applied(ID).map_or(0.0, |values| values[0]);
        let change = |order: usize| -Complex64::I / Complex64::new(order as f64, cut_off);
        vec![predicted.each(|reading| reading.sensor == target, |order, at| change(order) * predicted.readings[at])]
    }

    fn is_possible(&self, values: &[f64]) -> bool {
        values.iter().all(|cut_off| *cut_off > 0.0)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

    use std::path::Path;

    use runout_core::{
        closed_loop::{Effect, Fit, Model, Setting, Settings, diagnosis::Verdict},
        inspection::Inspection,
        measurement::Recording,
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
        let setup = |(id, part_deg): (&str, f64)| SetupConfig { id: id.into(), part_deg, ..SetupConfig::default() };
        let mut config = SpindleConfig::new(RigConfig {
            interruptions: Vec::new(),
            bearings: Vec::new(),
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

    /// The simulated recording with one channel behind a high-pass, averaged with a fifth of the turns held out.
    fn averaged(config: &SpindleConfig, rig: &Rig, high_pass: &HighPassChannelConfig) -> Station {
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
        let (Preprocessor::Conditioner(high_pass), Preprocessor::Averager(average)) =
            (high_pass.clone().check(&context).unwrap(), average.check(&context).unwrap())
        else {
            panic!("other stages");
        };
        let wanted = AverageRequest { hold_out: Some(0.2), ..AverageRequest::default() };
        let profile = |setup| {
            let stream = Inspection::new(recording.open(0, setup).unwrap());
            average.average_requested(high_pass.attach(Box::new(stream)).unwrap(), wanted).unwrap()
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

    /// Two seeds and sizes. The filter is in the recording, not in the model.
    #[test]
    fn an_ac_coupled_channel_is_found() {
        for (seed, id, cut_off) in [(1, "S2", 0.5), (2, "S3", 1.0)] {
            let config = campaign(seed);
            let rig = config.rig.clone().check().unwrap();
            let cutoff_hz = cut_off * config.recording.speed_rpm / 60.0;
            let station = averaged(&config, &rig, &HighPassChannelConfig { sensor: id.into(), cutoff_hz });
            let (selection, layout) = (Selection::whole(&rig), Layout::new(&rig, false));
            let said = diagnose(selection, layout, true, every_effect(), &[station], &Settings::default()).unwrap();
            let diagnosis = said.diagnosis;
            let chi2 = [&diagnosis.before, &diagnosis.after].map(|level| level.chi2_per_dof.unwrap());
            println!(
                "simulated, {id} from {cut_off}/rev on: χ² {:.2} → {:.2}, {:?}",
                chi2[0], chi2[1], diagnosis.added
            );
            assert_eq!(diagnosis.verdict, Verdict::Explained, "{:?}", diagnosis.added);
            let [added] = &diagnosis.added[..] else { panic!("{:?}", diagnosis.added) };
            assert_eq!((&*added.effect, &*added.targets), (ID, &[id.to_owned()][..]));
            assert!(added.confounded_with.is_empty(), "{:?}", added.confounded_with);
            let found = &added.parameters[0];
            // Five standard uncertainties: what two seeds never reach by chance.
            assert!((found.value - cut_off).abs() < 5.0 * found.std.unwrap(), "{found:?} for {cut_off}");
        }
    }

    /// The signature is what the residual does when the cut-off is a little more and a little less.
    #[test]
    fn partials_are_finite_differences() {
        let config = campaign(3);
        let rig = config.rig.clone().check().unwrap();
        let station = averaged(&config, &rig, &HighPassChannelConfig { sensor: "S1".into(), cutoff_hz: 0.0 });
        let layout = Layout::new(&rig, false);
        let model =
            SpindleModel::new(Selection::whole(&rig), layout, true, vec![Arc::new(AcCoupling)], &[station]).unwrap();
        let declared = model.fit(&[]).unwrap();
        let norm = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
        for (effect, Effect { targets, .. }) in model.effects().iter().enumerate() {
            let step = 1e-4;
            let residual = |cut_off: f64| {
                let applied = [Setting { effect, values: vec![cut_off] }];
                model.fit(&applied).unwrap().remainder().residual.clone()
            };
            let (above, below) = (residual(step), residual(-step));
            let analytic = &declared.signature(effect)[0];
            let slope = above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step));
            let off: Vec<f64> = slope.zip(analytic).map(|(slope, analytic)| slope - analytic).collect();
            // 5 %: what exact geometry adds to the linear reading, and the projection's own change (Kaufman).
            assert!(norm(&off) < 0.05 * norm(analytic), "{targets:?}: {} of {}", norm(&off), norm(analytic));
        }
    }
}
