//! A clamping beside effects that are nearly alike, in asynchronous motion with a short memory.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use runout_core::{
    Result,
    closed_loop::Settings,
    measurement::{Block, Capture, SampleStream},
};
use runout_spindle::{diagnose::diagnose, effects, layout::Layout, selection::Selection};

use crate::{
    campaigns::{averaged_from, campaign, two_sections},
    trials::{fewest, trials},
};

/// Root mean square of the asynchronous motion along x and along y.
const ASYNCHRONOUS_UM: f64 = 0.05;
/// Time after which it forgets.
const MEMORY_S: f64 = 0.004;

/// Adds motion of the axis that is a first-order autoregression in time: its spectrum is flat to 40 Hz and falls above, which that of the
/// simulator's fractal does not.
struct Forgetful<'a> {
    input: Box<dyn SampleStream + 'a>,
    /// Directions of the sensors.
    sensors_rad: Vec<f64>,
    motion_um: [f64; 2],
    random: ChaCha8Rng,
}

impl SampleStream for Forgetful<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        let kept = (-1.0 / (self.capture().sample_rate_hz.unwrap() * MEMORY_S)).exp();
        for readings in block.samples.chunks_exact_mut(self.sensors_rad.len()) {
            for motion in &mut self.motion_um {
                let fresh: f64 = StandardNormal.sample(&mut self.random);
                *motion = kept * *motion + (1.0 - kept * kept).sqrt() * ASYNCHRONOUS_UM * fresh;
            }
            for (reading, direction) in readings.iter_mut().zip(&self.sensors_rad) {
                *reading += self.motion_um[0] * direction.cos() + self.motion_um[1] * direction.sin();
            }
        }
        Ok(more)
    }
}

/// A clamping, a turned sensor and a turn of all sensors differ by what the motion does, and orders of noise say nothing of it: the clamping is
/// named, alone or beside the others.
#[test]
fn a_clamping_is_named_beside_what_is_nearly_alike() {
    let campaigns = trials(24);
    let named = (0..campaigns as u64).filter(|seed| {
        let mut config = campaign(700 + seed, r#"[{"plugin":"reversal-angle","targets":["b"],"angle_deg":0.4}]"#);
        config.rig.sensors = two_sections(&[0.0, 99.844, 202.5]);
        for sensor in &mut config.rig.sensors {
            sensor.z_mm += 100.0;
        }
        config.rig.setups.truncate(2);
        config.rig.setups[1].part_deg = 180.0;
        (config.form.rms_um, config.form.max_order) = (1.0, 30);
        (config.motion.x_rms_um, config.motion.y_rms_um, config.motion.max_order) = (0.5, 0.5, 10);
        config.motion.tilt_rms_urad = 1.0;
        (config.noise.rms_um, config.asynchronous.rms_um) = (0.02, None);
        config.recording.revolutions = 20;
        (config.recording.samples_per_rev, config.recording.speed_rpm) = (256, 300.0);
        let rig = config.rig.clone().check().unwrap();
        let mut random = ChaCha8Rng::seed_from_u64(*seed);
        let (station, _) = averaged_from(&config, &rig, |input| {
            let sensors_rad = rig.sensors.iter().map(|sensor| sensor.angle_rad).collect();
            let own = ChaCha8Rng::from_rng(&mut random);
            Box::new(Forgetful { input, sensors_rad, motion_um: [0.0; 2], random: own })
        });
        let layout = Layout::new(&rig, false);
        let found = diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &Settings::default());
        let found = found.unwrap().diagnosis;
        let all = found.added.iter().flat_map(|one| std::iter::once(&one.effect).chain(&one.confounded_with));
        let all: Vec<&String> = all.collect();
        println!("simulated, seed {seed}: {all:?}");
        found.added.len() == 1 && all.iter().any(|one| one.starts_with("reversal-angle"))
    });
    let named = named.count();
    assert!(named >= fewest(campaigns, [23, 24], 0.98), "{named} of {campaigns}");
}
