//! What holds for every campaign: the same samples however they are read, a truth that fits them, sizes as asked.

use std::f64::consts::TAU;

use runout_core::{measurement::Recording, rig::Rotation};

use super::*;

fn everything() -> SpindleConfig {
    let mut config = reference();
    let recording = &mut config.recording;
    (recording.revolutions, recording.start_up_turns, recording.run_down_turns) = (3, 2, 1);
    recording.samples_per_rev = 200;
    recording.speed_wobble_percent = 0.3;
    recording.phase = Phase::Encoder;
    recording.format = SampleFormat::I16;
    recording.range_um = Some(100.0);
    config.asynchronous.tilt_rms_urad = 0.1;
    config.asynchronous.lines = vec![LineConfig { order: 0.42, amplitude_um: 0.2, direction_deg: 30.0 }];
    let targets = vec!["S2".to_owned()];
    config.effect = vec![
        Effect::ThermalDrift(ThermalDrift {
            targets: targets.clone(),
            rate_um_per_rev: 0.6,
            time_constant_turns: Some(25.0),
            setups: Vec::new(),
            declared: false,
        }),
        Effect::FilterAttenuation(FilterAttenuation { targets, cutoff_hz: 300.0, order: 3, declared: false }),
        Effect::AxialMotion(AxialMotion {
            harmonics: vec![MotionHarmonic { order: 1, amplitude_um: 2.0, phase_deg: 0.0 }],
            declared: false,
        }),
    ];
    config
}

#[test]
fn blocks_of_any_size_hold_the_same_samples() {
    let simulator = simulator(&everything()).unwrap();
    let whole = read(&simulator.recording_in_blocks(1_000_000), 1, 2);
    assert_eq!(whole.1.len(), whole.0[0].len());
    for block_samples in [1, 7, 64, 1001] {
        assert_eq!(read(&simulator.recording_in_blocks(block_samples), 1, 2), whole, "{block_samples}");
    }
}

#[test]
fn the_seed_decides_and_the_scenario_text_repeats_it() {
    let config = everything();
    let first = simulator(&config).unwrap();
    let samples = read(&first.spindle_recording(), 1, 1);
    let text = first.scenario().replace("plugin = \"spindle\"\n", "");
    let again: SpindleConfig = toml::from_str(&text).unwrap();
    assert_eq!(read(&simulator(&again).unwrap().spindle_recording(), 1, 1), samples);

    let other = SpindleConfig { seed: 12, ..config.clone() };
    assert_ne!(readings(&other, 1, 1), samples.0);
    // What other stations and setups there are changes nothing here, beyond the scale of the form.
    let mut fewer = config;
    fewer.recording.stations.count = 2;
    fewer.form.rms_um = 0.0;
    let mut more = fewer.clone();
    more.recording.stations.count = 9;
    more.rig.setups.push(setup("iv", 30.0, 0.0));
    assert_eq!(readings(&fewer, 1, 1), readings(&more, 1, 1));
}

/// Φ is a whole number of turns at each mark, as the encoder's angles on either side show.
#[test]
fn marks_and_encoder_agree() {
    let simulator = simulator(&everything()).unwrap();
    let recording = simulator.spindle_recording();
    let marks = recording.open(0, 1).unwrap().capture().marks.clone();
    let (_, angles) = read(&recording, 0, 1);
    assert_eq!(marks.len(), 7);
    for (turn, mark) in marks.iter().enumerate() {
        let sample = mark.floor() as usize;
        let angle = angles[sample] + mark.fract() * (angles[sample + 1] - angles[sample]);
        // 2e-5 turns: the ramp's curvature over one sample of 200.
        assert!((angle - turn as f64).abs() < 2e-5, "{turn}: {angle}");
    }
}

#[test]
fn readings_are_the_truth_at_the_sensor() {
    let mut config = plain();
    config.seed = 4;
    config.form.rms_um = 4.0;
    config.form.max_order = 40;
    config.motion = MotionConfig { x_rms_um: 1.5, y_rms_um: 0.9, tilt_rms_urad: 3.0, ..MotionConfig::default() };
    config.recording.stations.first_z_mm = 17.0;
    config.rig.setups[1].part_deg = 90.0;
    let simulator = simulator(&config).unwrap();
    let recording = simulator.spindle_recording();
    let truth = recording.truth(0).unwrap().unwrap();
    let [x, y, tilt_x, tilt_y] = truth.motion.unwrap();
    let shift = |sample: usize, quarters: usize| (4 * TURN + quarters * TURN / 4 - sample % TURN) % TURN;
    for (setup, part_quarters) in [(0, 0), (1, 1)] {
        let (channels, _) = read(&recording, 0, setup);
        for (channel, (section, sensor_quarters, z_mm)) in
            [(0, 0, 217.0), (0, 1, 217.0), (1, 0, 247.0), (1, 1, 247.0)].into_iter().enumerate()
        {
            for (sample, reading) in channels[channel].iter().enumerate() {
                let at = sample % TURN;
                let form = truth.form_um[section][shift(sample, 4 + sensor_quarters - part_quarters)];
                let motion = match sensor_quarters {
                    0 => x[at] + 1e-3 * z_mm * tilt_y[at],
                    _ => y[at] - 1e-3 * z_mm * tilt_x[at],
                };
                // 1e-11 µm: rounding of angles over 40 orders.
                assert!((reading - form - motion).abs() < 1e-11, "setup {setup} channel {channel} sample {sample}");
            }
        }
    }
}

#[test]
fn a_part_that_turns_clockwise_shows_its_form_backwards() {
    let mut config = plain();
    config.rig.rotation = Rotation::Cw;
    config.form.harmonics = vec![FormHarmonic { order: 3, amplitude_um: 2.0, phase_deg: 20.0, twist_deg_per_mm: 0.0 }];
    let phase = 20.0_f64.to_radians();
    let channels = readings(&config, 0, 0);
    // 1e-13 µm: rounding of values near 1.
    assert!(largest_difference(&channels[0], |phi| 2.0 * (3.0 * phi + phase).cos()) < 1e-13);
    let quarter = TAU / 4.0;
    assert!(largest_difference(&channels[1], |phi| 2.0 * (3.0 * (quarter + phi) + phase).cos()) < 1e-13);
}

#[test]
fn sections_that_meet_are_one_circle() {
    let simulator = simulator(&reference()).unwrap();
    let recording = simulator.spindle_recording();
    let here = recording.truth(0).unwrap().unwrap();
    let there = recording.truth(3).unwrap().unwrap();
    assert_eq!(here.form_um[1], there.form_um[0], "b at 0 mm is a at 30 mm");
    let rms_of = |section: usize| rms(here.form_um[section].iter().copied());
    let between = rms(here.form_um[0].iter().zip(&here.form_um[1]).map(|(a, b)| a - b));
    assert!(between > 0.3 && between < 1.2 * rms_of(0), "sections differ, and share a part: {between} µm");
    // Orders 0 and 1 are no form.
    for order in [0.0, 1.0] {
        let sum: f64 =
            here.form_um[0].iter().enumerate().map(|(k, h)| h * (TAU * order * k as f64 / 512.0).cos()).sum();
        assert!(sum.abs() / 512.0 < 1e-12);
    }
    let squares = (0..4).flat_map(|station| recording.truth(station).unwrap().unwrap().form_um);
    let mean = squares.map(|circle| rms(circle.iter().copied()).powi(2)).sum::<f64>() / 8.0;
    assert!((mean.sqrt() - 4.0).abs() < 1e-12, "rms over all sections: {}", mean.sqrt());
}

/// Exact minus linear against the expansion −(t/R)·h′ − t²/(2R), to a hundredth of itself.
#[test]
fn exact_geometry_departs_from_linear_by_the_second_order() {
    for (offset_um, expected_um) in [(8.0, 0.002), (150.0, 0.2)] {
        let mut config = plain();
        config.recording.revolutions = 1;
        config.form.harmonics = vec![FormHarmonic { order: 12, amplitude_um: 3.0, ..FormHarmonic::default() }];
        config.effect = vec![Effect::PartEccentricity(PartEccentricity {
            targets: vec!["initial".into()],
            offset_um,
            ..PartEccentricity::default()
        })];
        let linear = readings(&config, 0, 0).swap_remove(0);
        config.geometry = Geometry::Exact;
        let exact = readings(&config, 0, 0).swap_remove(0);
        let departure: Vec<f64> = exact.iter().zip(&linear).map(|(exact, linear)| exact - linear).collect();
        let largest = departure.iter().fold(0.0_f64, |largest, value| largest.max(value.abs()));
        assert!(largest > expected_um, "{offset_um}: {largest}");
        let difference = largest_difference(&departure, |phi| {
            // α = −Φ; the offset points at part angle 0, which stands at Φ: across the line of S1 it is e·sin Φ.
            let (slope, across) = (-36.0 * (-12.0 * phi).sin(), offset_um * phi.sin());
            -across / 30_000.0 * slope - across * across / 60_000.0
        });
        assert!(difference < 0.01 * largest + 1e-6, "{offset_um}: {difference} of {largest}");
    }
}

#[test]
fn noise_is_as_large_as_asked_and_each_sensors_own() {
    let mut config = reference();
    let noisy = readings(&config, 2, 1);
    config.noise.rms_um = 0.0;
    let clean = readings(&config, 2, 1);
    let noise: Vec<Vec<f64>> =
        noisy.iter().zip(&clean).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
    let count = noise[0].len() as f64;
    for channel in &noise {
        // Four standard deviations of an rms of 30 753 normal values.
        assert!((rms(channel.iter().copied()) / 0.05 - 1.0).abs() < 4.0 / (2.0 * count).sqrt());
    }
    let product: f64 = noise[0].iter().zip(&noise[1]).map(|(a, b)| a * b).sum();
    assert!((product / count).abs() < 4.0 * 0.05_f64.powi(2) / count.sqrt());
}

/// Order 1 of the motion: what turns with the spindle is clamping, what turns against it is error motion.
#[test]
fn first_order_truth_is_what_turns_against_the_spindle() {
    let harmonic = |amplitude_um: f64, phase_deg: f64| vec![MotionHarmonic { order: 1, amplitude_um, phase_deg }];
    for (rotation, sense) in [(Rotation::Ccw, 1.0), (Rotation::Cw, -1.0)] {
        // x = cos Φ, y = sense · ½ sin Φ: circles of ¾ with the part and of ¼ against it.
        let mut config = plain();
        config.rig.rotation = rotation;
        config.motion.x = harmonic(1.0, 0.0);
        config.motion.y = harmonic(0.5 * sense, 90.0);
        let simulator = simulator(&config).unwrap();
        let [x, y, ..] = simulator.spindle_recording().truth(0).unwrap().unwrap().motion.unwrap();
        assert!(largest_difference(&x, |phi| 0.25 * phi.cos()) < 1e-15);
        assert!(largest_difference(&y, |phi| -0.25 * sense * phi.sin()) < 1e-15);
    }
}

#[test]
fn integers_are_codes_within_limits() {
    let mut config = reference();
    config.rig.sensors[1].sign = -1;
    let exact = readings(&config, 0, 0);
    config.recording.format = SampleFormat::I16;
    config.recording.range_um = Some(12.0);
    let simulator = simulator(&config).unwrap();
    let recording = simulator.spindle_recording();
    let limits = recording.open(0, 0).unwrap().capture().converter_limits_um.clone().unwrap();
    assert!((limits[1][1] - 12.0 * 32768.0 / 32767.0).abs() < 1e-12 && (limits[1][0] + 12.0).abs() < 1e-12);
    let (codes, _) = read(&recording, 0, 0);
    let mut clipped = 0;
    for (channel, [low, high]) in limits.iter().enumerate() {
        for (code, value) in codes[channel].iter().zip(&exact[channel]) {
            let expected = value.clamp(*low, *high);
            assert!((code - expected).abs() <= 0.5001 * 12.0 / 32767.0);
            clipped += usize::from(*code <= *low || *code >= *high);
        }
    }
    assert!(clipped > 0, "8 µm of eccentricity and 4 µm of form go beyond 12 µm");
}

/// The example of the paper's experiment: Ra of 4 to 5 µm or so, nothing clipped, sections that overlap.
#[test]
fn the_example_is_what_it_says() {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/../../examples/01-four-sensor/scenario.toml");
    let mut table: toml::Table = std::fs::read_to_string(path).unwrap().parse().unwrap();
    for key in ["title", "plugin", "output"] {
        table.remove(key).unwrap();
    }
    let simulator = simulator(&table.try_into().unwrap()).unwrap();
    let recording = simulator.spindle_recording();
    assert_eq!(recording.stations().len(), 31);
    assert!((recording.stations()[30].z_mm - 60.0).abs() < 1e-12);
    for station in [0, 15, 30] {
        for circle in recording.truth(station).unwrap().unwrap().form_um {
            let ra = circle.iter().map(|h| h.abs()).sum::<f64>() / circle.len() as f64;
            assert!((3.5..5.5).contains(&ra), "station {station}: Ra {ra} µm");
        }
        for setup in 0..2 {
            let limits = recording.open(station, setup).unwrap().capture().converter_limits_um.clone().unwrap();
            let (channels, _) = read(&recording, station, setup);
            for (channel, [low, high]) in channels.iter().zip(limits) {
                assert!(channel.iter().all(|reading| *reading > 0.9 * low && *reading < 0.9 * high));
            }
        }
    }
}
