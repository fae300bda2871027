//! What happens at one order in one setup or one channel, added to the samples of simulated recordings.

use std::f64::consts::TAU;

use runout_core::{
    Complex64, Result,
    closed_loop::{Settings, diagnosis::Verdict},
    measurement::{Block, Capture, SampleStream},
    numerics::fourier::Fourier,
    separation::Quantity,
    stage::StationDiagnosis,
};
use runout_spindle::{diagnose::diagnose, effects, layout::Layout, selection::Selection, simulate::SpindleConfig};

use super::errors_over_stated;
use crate::campaigns::{averaged_from, campaign};

/// amplitude·cos(order·Φ − phase) more in a channel, in µm.
type More = fn(setup: usize, channel: usize, turns: f64) -> f64;

struct WithMore<'a> {
    input: Box<dyn SampleStream + 'a>,
    more: More,
}

impl SampleStream for WithMore<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        let capture = self.input.capture();
        let [first, second, ..] = capture.marks[..] else { panic!("no turn") };
        let channels = capture.sensors.len();
        for (sample, readings) in (block.start..).zip(block.samples.chunks_exact_mut(channels)) {
            // The speed is even.
            let turns = (sample as f64 - first) / (second - first);
            for (channel, reading) in readings.iter_mut().enumerate() {
                *reading += (self.more)(capture.setup, channel, turns);
            }
        }
        Ok(more)
    }
}

/// Sensors at some angles in section a, the part at 0 and at another angle.
fn rig(seed: u64, angles_deg: &[f64], part_deg: f64) -> SpindleConfig {
    let mut config = campaign(seed, "[]");
    let sensor = config.rig.sensors[0].clone();
    let sensors = angles_deg.iter().enumerate();
    config.rig.sensors = sensors
        .map(|(index, angle_deg)| runout_core::rig::SensorConfig {
            id: format!("S{}", index + 1),
            angle_deg: *angle_deg,
            ..sensor.clone()
        })
        .collect();
    config.rig.setups.truncate(2);
    config.rig.setups[1].part_deg = part_deg;
    config.motion.tilt_rms_urad = 0.0;
    config
}

/// What is found, and `[form, motion]` each with `[error, stated]` before and after.
fn found(config: &SpindleConfig, more: More) -> (StationDiagnosis, [[[f64; 2]; 2]; 2]) {
    let rig = config.rig.clone().check().unwrap();
    let (station, truth) = averaged_from(config, &rig, |input| Box::new(WithMore { input, more }));
    let settings = Settings::default();
    let layout = Layout::new(&rig, false);
    let found = diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &settings).unwrap();
    let errors = [&found.before, &found.after].map(|separations| errors_over_stated(&separations[0], &truth));
    (found, errors)
}

/// Three sensors and two part angles see the whole motion: it is named with both of its amplitudes, and form is as of a sound campaign.
#[test]
fn a_motion_that_differs_in_one_setup_is_named() {
    let more: More = |setup, channel, turns| {
        let angle = [0.0_f64, 99.844, 202.5][channel].to_radians();
        let (x, y) = (0.15 * (3.0 * TAU * turns).cos(), 0.1 * (3.0 * TAU * turns + 1.1).cos());
        if setup == 1 { x * angle.cos() + y * angle.sin() } else { 0.0 }
    };
    for seed in 1..=3 {
        let (found, errors) = found(&rig(seed, &[0.0, 99.844, 202.5], 125.0), more);
        let diagnosis = &found.diagnosis;
        println!("simulated, seed {seed}: {:?} {:?} {errors:.4?}", diagnosis.verdict, diagnosis.added);
        assert_eq!((diagnosis.verdict, diagnosis.added.len()), (Verdict::Explained, 1));
        let added = &diagnosis.added[0];
        assert_eq!((added.effect.as_str(), added.targets[0].as_str()), ("setup-motion-order", "b"));
        for (name, truth) in [("x-amplitude", 0.15), ("y-amplitude", 0.1), ("y-phase", -1.1_f64.to_degrees())] {
            let value = added.parameters.iter().find(|known| known.name == name).unwrap();
            assert!((value.value - truth).abs() < 5.0 * value.std.unwrap(), "{value:?} for {truth}");
        }
        assert!(errors[1].iter().all(|[error, stated]| *error < 2.0 * stated), "{errors:?}");
    }
}

/// Four sensors and a reversal see a part of it: what they do not see may be as large, and is in the stated uncertainty of the form.
#[test]
fn what_a_layout_leaves_open_of_a_motion_is_stated() {
    let more: More = |setup, channel, turns| {
        let along =
            if channel % 2 == 0 { 0.15 * (3.0 * TAU * turns).cos() } else { 0.1 * (3.0 * TAU * turns + 1.1).cos() };
        if setup == 1 { along } else { 0.0 }
    };
    for seed in 1..=3 {
        let mut config = campaign(seed, "[]");
        config.rig.setups.truncate(2);
        config.rig.setups[1].part_deg = 180.0;
        let rig = config.rig.clone().check().unwrap();
        let (station, truth) = averaged_from(&config, &rig, |input| Box::new(WithMore { input, more }));
        let (layout, settings) = (Layout::new(&rig, false), Settings::default());
        let found = diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &settings).unwrap();
        let after = &found.after[0];
        for (section, curve) in truth.form_um.iter().enumerate() {
            let mut harmonics = vec![Complex64::ZERO; 4];
            Fourier::new(curve.len()).analyse(curve.iter().copied(), &mut harmonics);
            let index = 3 * after.unknowns.len() + after.position(Quantity::Form(section)).unwrap();
            let (error, std) = ((after.estimate[index] - harmonics[3]).norm(), after.variance_of(index).sqrt());
            println!("simulated, seed {seed}: section {section}, order 3 is {error:.4} µm off, {std:.4} µm stated");
            // Of a complex number, three standard deviations are exceeded once in 8000.
            assert!(error < 3.0 * std && std < 0.3, "{error} {std}");
        }
    }
}

/// Pick-up of a whole order in one channel: which channel it is, is not observable, and the motion is as uncertain as that makes it.
#[test]
fn pick_up_of_a_whole_order_is_named_with_its_set() {
    let more: More = |_, channel, turns| if channel == 2 { 0.1 * (8.0 * TAU * turns).cos() } else { 0.0 };
    for seed in 1..=3 {
        let (found, errors) = found(&rig(seed, &[0.0, 99.844, 202.5], 125.0), more);
        let diagnosis = &found.diagnosis;
        println!("simulated, seed {seed}: {:?} {:?} {errors:.4?}", diagnosis.verdict, diagnosis.added);
        assert_eq!((diagnosis.verdict, diagnosis.added.len()), (Verdict::Explained, 1));
        let added = &diagnosis.added[0];
        let itself = format!("{} {}", added.effect, added.targets.join(" "));
        let set: Vec<&String> = std::iter::once(&itself).chain(&added.confounded_with).collect();
        assert!(set.iter().any(|member| *member == "synchronous-pick-up S3"), "{set:?}");
        assert!(errors[1].iter().all(|[error, stated]| *error < 3.0 * stated), "{errors:?}");
    }
}
