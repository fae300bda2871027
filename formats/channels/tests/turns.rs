//! Marks, angles, pulses and times, from files to the angle of each sample.

use std::{fmt::Write as _, fs};

use runout_channels::ChannelsConfig;
use runout_core::{
    Result,
    measurement::{Block, Capture, Recording},
    pipeline::{Context, StageConfig},
    rig::{Rig, RigConfig, SensorConfig, SetupConfig, Unit},
    stage::{Request, Source},
};
use tempfile::TempDir;

/// Rate of the sensors, and turns per second at the beginning and gained per second.
const RATE_HZ: f64 = 1000.0;
const TURNS_A_S: f64 = 6.3;
const GAINED_A_S: f64 = 0.4;
const SAMPLES: usize = 3000;

pub(crate) fn turns_at(time_s: f64) -> f64 {
    0.2 + TURNS_A_S * time_s + 0.5 * GAINED_A_S * time_s * time_s
}

pub(crate) fn rig(setups: &[&str], unit: Unit) -> Rig {
    let um_per_volt = matches!(unit, Unit::Volt | Unit::Millivolt).then_some(20.0);
    let sensor = |id: &str, sign| SensorConfig {
        id: id.into(),
        section: id.into(),
        sign,
        unit,
        um_per_volt,
        ..SensorConfig::default()
    };
    let setup = |id: &&str| SetupConfig { id: (*id).into(), ..SetupConfig::default() };
    let config = RigConfig {
        interruptions: Vec::new(),
        bearings: Vec::new(),
        part_radius_mm: 30.0,
        rotation: <_>::default(),
        sensors: vec![sensor("S1", 1), sensor("S2", -1)],
        setups: setups.iter().map(setup).collect(),
    };
    config.check().unwrap()
}

/// A table of columns at even times.
pub(crate) fn csv(rate_hz: f64, start_s: f64, columns: &[(&str, &dyn Fn(f64) -> f64)], samples: usize) -> String {
    let mut text = format!("time_s,{}\n", columns.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(","));
    for sample in 0..samples {
        let time_s = start_s + sample as f64 / rate_hz;
        write!(text, "{time_s:.9}").unwrap();
        for (_, value) in columns {
            write!(text, ",{:.12}", value(time_s)).unwrap();
        }
        text.push('\n');
    }
    text
}

pub(crate) fn opened(files: &[(&str, String)], load: &str, rig: &Rig) -> Result<(TempDir, Box<dyn Recording>)> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let config: ChannelsConfig = toml::from_str(load).unwrap();
    let loader = config.check(&Context { folder: folder.path(), rig: Some(rig) }).unwrap();
    let Source::Turns(recording) = loader.open(&Request { rig: Some(rig), columns: &[] })? else {
        panic!("turns are given")
    };
    Ok((folder, recording))
}

/// Capture, readings and angles of a setup.
fn read(recording: &dyn Recording, setup: usize) -> (Capture, Vec<f64>, Vec<f64>) {
    let mut stream = recording.open(0, setup).unwrap();
    let (mut samples, mut angles, mut block) = (Vec::new(), Vec::new(), Block::default());
    while stream.next_block(&mut block).unwrap() {
        samples.append(&mut block.samples);
        angles.append(&mut block.angle_rev);
    }
    (stream.capture().clone(), samples, angles)
}

fn s1(time_s: f64) -> f64 {
    (40.0 * time_s).sin()
}

fn s2(time_s: f64) -> f64 {
    time_s
}

/// Largest difference of angles in turns, whole turns aside.
fn off(angles: &[f64], whole: f64) -> f64 {
    let of = |(sample, angle): (usize, &f64)| (angle - turns_at(sample as f64 / RATE_HZ) - whole).abs();
    angles.iter().enumerate().map(of).fold(0.0, f64::max)
}

#[test]
fn an_angle_is_read_in_any_unit_wrapped_or_not() {
    let units: [(&str, &dyn Fn(f64) -> f64); 8] = [
        ("unit = \"deg\" }", &|time| 360.0 * turns_at(time)),
        ("unit = \"deg\" }", &|time| (360.0 * turns_at(time)).rem_euclid(360.0)),
        ("unit = \"deg\" }", &|time| (360.0 * turns_at(time) + 180.0).rem_euclid(360.0) - 180.0),
        ("unit = \"rad\" }", &|time| (std::f64::consts::TAU * turns_at(time)).rem_euclid(std::f64::consts::TAU)),
        ("unit = \"rev\" }", &turns_at),
        ("unit = \"counts\" }\npulses_per_turn = 4096", &|time| (4096.0 * turns_at(time)).rem_euclid(4096.0)),
        // Counters of 16 bits, which begin anew behind 16 turns and behind 13.1.
        ("unit = \"counts\" }\npulses_per_turn = 4096", &|time| (4096.0 * turns_at(time)).rem_euclid(65_536.0)),
        ("unit = \"counts\" }\npulses_per_turn = 5000", &|time| (5000.0 * turns_at(time)).rem_euclid(65_536.0)),
    ];
    for (unit, angle) in units {
        let file = csv(RATE_HZ, 0.0, &[("S1", &s1), ("S2", &s2), ("Enc", angle)], SAMPLES);
        let load = format!("path = \"a.csv\"\nangle = {{ channel = \"Enc\", {unit}");
        let (_folder, recording) = opened(&[("a.csv", file)], &load, &rig(&["only"], Unit::Micrometre)).unwrap();
        let (capture, samples, angles) = read(&*recording, 0);
        assert_eq!((capture.samples, samples.len(), angles.len()), (SAMPLES as u64, 2 * SAMPLES, SAMPLES));
        assert!((capture.sample_rate_hz.unwrap() - RATE_HZ).abs() < 1e-6);
        // 12 digits are written.
        assert!(off(&angles, 0.0) < 1e-9, "{unit}: {}", off(&angles, 0.0));
        assert!(
            (samples[2 * 700] - s1(0.7)).abs() < 1e-11 && (samples[2 * 700 + 1] + 0.7).abs() < 1e-11,
            "S2 has the sign −1"
        );
        // The first whole turn is where the angle says 1.
        let first_s = capture.marks[0] / RATE_HZ;
        assert!((turns_at(first_s) - 1.0).abs() < 1e-5, "{unit}: {}", turns_at(first_s));
    }
}

/// A pulse of some duration at each whole number of turns, times `a_turn`; its edges rise and fall within two samples.
pub(crate) fn pulses(a_turn: f64, height: f64) -> impl Fn(f64) -> f64 {
    move |time_s| {
        let phase = (a_turn * turns_at(time_s)).rem_euclid(1.0);
        let slope = RATE_HZ / (a_turn * (TURNS_A_S + GAINED_A_S * time_s)) / 4.0;
        let nearest = if phase > 0.5 { phase - 1.0 } else { phase };
        height * (0.5 + nearest * slope).clamp(0.0, 1.0) * f64::from(u8::from(!(0.4..=0.75).contains(&phase)))
    }
}

#[test]
fn a_trace_gives_marks_between_samples_and_two_values_half_a_sample() {
    let trace = pulses(1.0, 5.0);
    let digital = |time_s: f64| f64::from(u8::from(trace(time_s) > 2.5));
    for (mark, within, tolerance) in [(&trace as &dyn Fn(f64) -> f64, 0.0, 1e-4), (&digital, 0.5, 5e-3)] {
        let file = csv(RATE_HZ, -0.5, &[("S1", &s1), ("S2", &s2), ("Index", mark)], SAMPLES);
        let load = "path = \"a.csv\"\nmarker = { channel = \"Index\" }";
        let (_folder, recording) = opened(&[("a.csv", file)], load, &rig(&["only"], Unit::Micrometre)).unwrap();
        let (capture, ..) = read(&*recording, 0);
        assert!((capture.marks_within_samples - within).abs() < 1e-12);
        assert!(capture.marks.len() > 15, "{}", capture.marks.len());
        for mark in &capture.marks {
            let turns = turns_at(mark / RATE_HZ - 0.5);
            assert!((turns - turns.round()).abs() < tolerance, "{turns}");
        }
    }
}

#[test]
fn pulses_of_an_encoder_give_the_angle_from_the_mark_of_its_zero() {
    let (many, zero) = (pulses(16.0, 5.0), pulses(1.0, 5.0));
    let file = csv(RATE_HZ, 0.0, &[("S1", &s1), ("S2", &s2), ("A", &many), ("Z", &zero)], SAMPLES);
    let load = "path = \"a.csv\"\nmarker = { channel = \"A\" }\npulses_per_turn = 16\nzero = { channel = \"Z\" }";
    let (_folder, recording) = opened(&[("a.csv", file)], load, &rig(&["only"], Unit::Micrometre)).unwrap();
    let (capture, _, angles) = read(&*recording, 0);
    let whole = (angles[0] - turns_at(0.0)).round();
    // Between pulses of 10 samples the speed is constant to 10⁻⁵ turns; each crossing is known to some 10⁻⁵.
    assert!(off(&angles, whole) < 2e-4, "{}", off(&angles, whole));
    for mark in &capture.marks {
        let turns = turns_at(mark / RATE_HZ);
        assert!((turns - turns.round()).abs() < 1e-3, "{turns}");
    }
}

#[test]
fn times_of_marks_and_channels_of_other_rates_are_brought_to_the_samples() {
    // A file a channel: the angle at 400 Hz, begun 3 ms earlier, and a trace at 5 kHz.
    let sensors = |values: &dyn Fn(f64) -> f64| csv(RATE_HZ, 0.1, &[("value", values)], SAMPLES);
    let steady = |time_s: f64| 360.0 * (0.2 + TURNS_A_S * time_s);
    let trace = pulses(1.0, 5.0);
    let files = [
        ("S1.csv", sensors(&s1)),
        ("S2.csv", sensors(&s2)),
        ("Enc.csv", csv(400.0, 0.097, &[("value", &steady)], 1300)),
        ("Index.csv", csv(5000.0, 0.0, &[("value", &trace)], 15_600)),
    ];
    let load = "pattern = \"{channel}.csv\"\nchannel_path = \"value\"\nangle = { channel = \"Enc\", unit = \"deg\" }";
    let (_folder, recording) = opened(&files, load, &rig(&["only"], Unit::Micrometre)).unwrap();
    let (_, _, angles) = read(&*recording, 0);
    for (sample, angle) in angles.iter().enumerate() {
        let expected = steady(0.1 + sample as f64 / RATE_HZ) / 360.0;
        assert!((angle - expected).abs() < 1e-8, "{sample}: {angle} for {expected}");
    }
    let load = "pattern = \"{channel}.csv\"\nchannel_path = \"value\"\nmarker = { channel = \"Index\" }";
    let (_folder, recording) = opened(&files, load, &rig(&["only"], Unit::Micrometre)).unwrap();
    let (capture, ..) = read(&*recording, 0);
    for mark in &capture.marks {
        let turns = turns_at(0.1 + mark / RATE_HZ);
        assert!((turns - turns.round()).abs() < 1e-4, "{turns}");
    }
}

#[test]
fn readings_come_in_the_unit_of_the_sensor() {
    let mark = pulses(1.0, 5.0);
    for (name, unit, gain) in [
        ("S1 [mm]", Unit::Micrometre, 1e3),
        ("S1 [mil]", Unit::Micrometre, 25.4),
        ("S1 [V]", Unit::Volt, 1.0),
        ("S1 (mV)", Unit::Volt, 1e-3),
        ("S1", Unit::Millimetre, 1.0),
    ] {
        let other = name.replace("S1", "S2");
        let file = csv(RATE_HZ, 0.0, &[(name, &s1), (&other, &s2), ("index", &mark)], SAMPLES);
        let (_folder, recording) = opened(&[("a.csv", file)], "path = \"a.csv\"", &rig(&["only"], unit)).unwrap();
        let (_, samples, _) = read(&*recording, 0);
        assert!((samples[2 * 700] - gain * s1(0.7)).abs() < 1e-9 * gain.max(1.0), "{name}");
        let says = recording.remarks().iter().any(|remark| remark.contains("no unit of S1, S2"));
        assert_eq!(says, name == "S1", "{:?}", recording.remarks());
    }
}

#[test]
fn setups_are_files_by_a_pattern() {
    let mark = pulses(1.0, 5.0);
    let file = |gain: f64| {
        let scaled = move |time_s: f64| gain * s1(time_s);
        csv(RATE_HZ, 0.0, &[("S1", &scaled), ("S2", &s2), ("index", &mark)], SAMPLES)
    };
    let files = [("run-1_x.csv", file(1.0)), ("run-2_x.csv", file(2.0))];
    let load = "pattern = \"{setup}_{station}.csv\"\nstations = [{ name = \"x\", z_mm = 4 }]\nsetups = { initial = \"run-1\", reversed = \"run-2\" }";
    let (_folder, recording) = opened(&files, load, &rig(&["initial", "reversed"], Unit::Micrometre)).unwrap();
    let [one, other] = [0, 1].map(|setup| read(&*recording, setup).1[2 * 700]);
    assert!((other - 2.0 * one).abs() < 1e-10 && recording.inputs().len() == 2);
    assert!((recording.stations()[0].z_mm - 4.0).abs() < 1e-12);
}

#[test]
fn a_number_of_pulses_that_the_zero_contradicts_is_refused() {
    let (many, zero) = (pulses(16.0, 5.0), pulses(1.0, 5.0));
    let file = csv(RATE_HZ, 0.0, &[("S1", &s1), ("S2", &s2), ("A", &many), ("Z", &zero)], SAMPLES);
    let load = "path = \"a.csv\"\nmarker = { channel = \"A\" }\npulses_per_turn = 18\nzero = { channel = \"Z\" }";
    let problem = opened(&[("a.csv", file)], load, &rig(&["only"], Unit::Micrometre))
        .and_then(|(_folder, recording)| recording.open(0, 0).map(drop))
        .unwrap_err()
        .to_string();
    assert!(problem.contains("expected 18 pulses from a zero to the next, found 16"), "{problem}");
}
