//! Error motion values of simulated spindles whose synchronous and asynchronous motion is known.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

use std::{f64::consts::TAU, path::Path, time::Instant};

use crate::campaigns::campaign;
use crate::common::{FOUR_SENSORS, Sum, rig, value};
use runout_core::{
    error_motion::{Centre, ErrorMotion},
    evaluate::Value,
    inspection::Inspection,
    measurement::Recording,
    pipeline::{Context, StageConfig},
    profile::Profile,
    rig::{Rig, Rotation},
    separation::{Quantity, Separation},
    stage::{AverageRequest, Averager, Preprocessor, Station, StationSeparator},
    standards::reference::Reference,
};
use runout_preprocess::SynchronousAverageConfig;
use runout_spindle::{
    separators::{HarmonicLeastSquares, Weighting},
    simulate::{self, LineConfig, MotionConfig, MotionHarmonic, SpindleConfig, TiltHarmonic},
};

const ANGLES: usize = 512;
const LSC: Centre = Centre::Plot(Reference::LeastSquares);

fn averager() -> Box<dyn Averager> {
    let average = SynchronousAverageConfig {
        samples_per_rev: ANGLES,
        min_turns: 2,
        turn_tolerance_percent: 5.0,
        outlier_sigma: None,
        speed_tolerance_percent: 2.0,
    };
    match average.check(&Context { folder: Path::new(""), rig: None }).unwrap() {
        Preprocessor::Averager(averager) => averager,
        _ => panic!("no averager"),
    }
}

/// The separation, the averages behind it, and the steepest slope of the true form.
fn measured(config: &SpindleConfig) -> (Separation, Vec<Profile>, f64) {
    let rig = config.rig.clone().check().unwrap();
    let separator = HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance);
    let simulator = simulate::simulator(config).unwrap();
    let recording = simulator.spindle_recording();
    let averager = averager();
    let profile = |setup| {
        let projection = separator.projection(setup);
        let wanted = AverageRequest { projection: projection.as_ref(), ..AverageRequest::default() };
        averager.average_requested(Box::new(Inspection::new(recording.open(0, setup).unwrap())), wanted).unwrap()
    };
    let station = Station { name: "s001".into(), z_mm: 0.0, profiles: (0..rig.setups.len()).map(profile).collect() };
    let forms = recording.truth(0).unwrap().unwrap().form_um;
    let slope = |form: &Vec<f64>| {
        let arc_um = TAU * 1e3 * rig.part_radius_mm / form.len() as f64;
        form.windows(2).map(|pair| (pair[1] - pair[0]).abs() / arc_um).fold(0.0, f64::max)
    };
    let steepest = forms.iter().map(slope).fold(0.0, f64::max);
    (separator.separate(&station).unwrap(), station.profiles, steepest)
}

fn values(separation: &Separation, profiles: &[Profile], slope: f64) -> Vec<Value> {
    ErrorMotion { station: "s001", z_mm: 0.0, angles: ANGLES, separation, profiles, slope }.values(&[LSC])
}

fn find<'a>(values: &'a [Value], symbol: &str) -> &'a Value {
    values.iter().find(|value| value.symbol == symbol).unwrap_or_else(|| panic!("no {symbol}"))
}

/// Cosines of order, amplitude and phase, as [`value`] takes them.
fn sum(harmonics: &[(usize, f64, f64)]) -> Sum {
    harmonics.iter().map(|(order, amplitude, phase_deg)| (*order, *amplitude, -phase_deg.to_radians())).collect()
}

/// Peak to valley without mean and 1/rev.
fn range(curve: impl Fn(f64) -> f64) -> f64 {
    // Crests lie between the angles of the averages.
    const COUNT: usize = 64 * ANGLES;
    let angles: Vec<f64> = (0..COUNT).map(|step| TAU * step as f64 / COUNT as f64).collect();
    let part = |with: fn(f64) -> f64| 2.0 / COUNT as f64 * angles.iter().map(|a| curve(*a) * with(*a)).sum::<f64>();
    let [x, y] = [part(f64::cos), part(f64::sin)];
    let left = angles.iter().map(|angle| curve(*angle) - x * angle.cos() - y * angle.sin());
    let (low, high) = left.fold((f64::MAX, f64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    high - low
}

const X: [(usize, f64, f64); 3] = [(2, 0.5, 20.0), (3, 0.8, -70.0), (7, 0.2, 10.0)];
const Y: [(usize, f64, f64); 3] = [(2, 0.4, 0.0), (5, 0.6, 120.0), (11, 0.1, 45.0)];
const TILT_X: [(usize, f64, f64); 2] = [(3, 2.0, 30.0), (4, 1.0, 0.0)];
const TILT_Y: [(usize, f64, f64); 2] = [(2, 3.0, -15.0), (6, 0.5, 80.0)];
/// Amplitudes in µm of 1/rev that turns with the spindle and against it.
const WITH: f64 = 2.0;
const AGAINST: f64 = 0.3;
/// Amplitude in µm and direction of the asynchronous line.
const LINE: (f64, f64) = (0.25, 30.0);
/// Midway between the sensors, in mm.
const PLANE_MM: f64 = 115.0;

fn spindle(rotation: Rotation) -> SpindleConfig {
    let mut config = campaign(7, "[]");
    config.rig.rotation = rotation;
    config.motion = MotionConfig::default();
    let shift = |(order, amplitude_um, phase_deg): (usize, f64, f64)| MotionHarmonic { order, amplitude_um, phase_deg };
    let tilt =
        |(order, amplitude_urad, phase_deg): (usize, f64, f64)| TiltHarmonic { order, amplitude_urad, phase_deg };
    config.motion.x = X.into_iter().map(shift).collect();
    config.motion.y = Y.into_iter().map(shift).collect();
    config.motion.tilt_x = TILT_X.into_iter().map(tilt).collect();
    config.motion.tilt_y = TILT_Y.into_iter().map(tilt).collect();
    // y is d·sin Φ of what turns with the spindle.
    let quarter = 90.0 * rotation.direction();
    config.motion.x.extend([(1, WITH, 0.0), (1, AGAINST, 0.0)].map(shift));
    config.motion.y.extend([(1, WITH, quarter), (1, AGAINST, -quarter)].map(shift));
    config.noise.rms_um = 0.0;
    config.asynchronous.rms_um = None;
    config
}

#[test]
fn known_motion_comes_back_within_its_uncertainty() {
    for rotation in [Rotation::Ccw, Rotation::Cw] {
        let sense = rotation.direction();
        let mut config = spindle(rotation);
        config.asynchronous.lines =
            vec![LineConfig { order: std::f64::consts::SQRT_2, amplitude_um: LINE.0, direction_deg: LINE.1 }];
        let (separation, profiles, slope) = measured(&config);
        let values = values(&separation, &profiles, slope);
        let [x, y, tilt_x, tilt_y] = [sum(&X), sum(&Y), sum(&TILT_X), sum(&TILT_Y)];
        let x = |angle: f64| value(&x, angle) + PLANE_MM * 1e-3 * value(&tilt_y, angle);
        let y = |angle: f64| value(&y, angle) - PLANE_MM * 1e-3 * value(&tilt_x, angle);
        let rotating = |angle: f64| {
            let x = x(angle) + AGAINST * angle.cos();
            let y = y(angle) - sense * AGAINST * angle.sin();
            angle.cos() * x + sense * angle.sin() * y
        };
        let turning_tilt =
            |angle: f64| angle.cos() * value(&tilt_y, angle) - sense * angle.sin() * value(&tilt_x, angle);
        for (symbol, truth) in [
            ("synchronous-radial-x", range(x)),
            ("synchronous-radial-y", range(y)),
            ("synchronous-radial-rotating", range(rotating)),
            ("residual-synchronous-tilt-x", range(|angle| value(&tilt_x, angle))),
            ("residual-synchronous-tilt-y", range(|angle| value(&tilt_y, angle))),
            ("residual-synchronous-tilt-rotating", range(turning_tilt)),
            ("fundamental-radial", 2.0 * AGAINST),
            ("fundamental-tilt", 0.0),
        ] {
            let found = find(&values, symbol);
            // Tilt at 1/rev states none.
            let std = if symbol == "fundamental-tilt" { 0.01 } else { found.uncertainty.as_ref().unwrap().std };
            println!("{symbol}: {:.5} ± {std:.5} {}, truth {truth:.5}", found.value, found.unit);
            // Three standard uncertainties; 1e-4 µm or µrad: second-order geometry, what 1/rev of 2 µm leaves of it.
            assert!((found.value - truth).abs() < 3.0 * std + 1e-4, "{symbol}: {found:?}, truth {truth}");
            assert!(found.value > 0.98 * truth - 0.05 && found.value < 1.02 * truth + 0.05, "{symbol}: {found:?}");
        }
        let (amplitude, along) = (LINE.0, LINE.1.to_radians());
        for (symbol, truth) in [
            ("asynchronous-radial-x", 2.0 * amplitude * along.cos()),
            ("asynchronous-radial-y", 2.0 * amplitude * along.sin()),
            ("asynchronous-radial-rotating", 2.0 * amplitude),
            ("asynchronous-tilt-x", 0.0),
            ("asynchronous-tilt-y", 0.0),
        ] {
            let found = find(&values, symbol);
            let known = found.uncertainty.as_ref().unwrap();
            println!("{symbol}: {:.5} ± {:.5} {}, truth {truth:.5}", found.value, known.std, found.unit);
            let [low, high] = known.interval_95;
            // A part that moves across a sensor carries its slope past it; of two sections 30 mm apart it is a tilt.
            let moved = slope * 2.0 * amplitude * if found.unit == "urad" { 2.0 / 30e-3 } else { 1.0 };
            assert!((low..=high).contains(&truth) && known.std < 2.0 * moved, "{symbol}: {found:?}, truth {truth}");
        }
        // All turns: where synchronous motion is largest, the line is somewhere near its crest in 60 turns.
        let [synchronous, total] = ["synchronous-radial-x", "total-radial-x"].map(|symbol| find(&values, symbol).value);
        assert!((total - synchronous - 2.0 * amplitude * along.cos()).abs() < 0.02, "{synchronous} {total}");
    }
}

/// Probes at 30° observe motion along 30°, and nothing else of it.
#[test]
fn motion_along_an_oblique_line_comes_back() {
    for rotation in [Rotation::Ccw, Rotation::Cw] {
        let mut config = spindle(rotation);
        let line_deg = 30.0_f64;
        config.rig.sensors.retain(|sensor| ["S1", "S3"].contains(&sensor.id.as_str()));
        // On opposite sides: one line all the same.
        config.rig.sensors[0].angle_deg = line_deg;
        config.rig.sensors[1].angle_deg = line_deg + 180.0;
        config.rig.setups.truncate(2);
        (config.rig.setups[1].part_deg, config.rig.setups[1].sensors_deg) = (180.0, 180.0);
        let line = LineConfig { order: std::f64::consts::SQRT_2, amplitude_um: LINE.0, direction_deg: line_deg + 50.0 };
        config.asynchronous.lines = vec![line];
        let (separation, profiles, slope) = measured(&config);
        assert_eq!(separation.azimuth().unwrap().to_string(), "30°");
        assert!(separation.unknowns.iter().all(|unknown| unknown.is_form() || unknown.azimuth().is_some()));
        let values = values(&separation, &profiles, slope);
        let (sine, cosine) = line_deg.to_radians().sin_cos();
        let [x, y, tilt_x, tilt_y] = [sum(&X), sum(&Y), sum(&TILT_X), sum(&TILT_Y)];
        let tilt = |angle: f64| cosine * value(&tilt_y, angle) - sine * value(&tilt_x, angle);
        let along = |angle: f64| cosine * value(&x, angle) + sine * value(&y, angle) + PLANE_MM * 1e-3 * tilt(angle);
        let asynchronous = 2.0 * LINE.0 * 50.0_f64.to_radians().cos();
        let synchronous = [range(along), range(tilt)];
        for (symbol, truth) in [
            ("synchronous-radial-along", synchronous[0]),
            ("residual-synchronous-tilt-along", synchronous[1]),
            ("asynchronous-radial-along", asynchronous),
            ("total-radial-along", synchronous[0] + asynchronous),
        ] {
            let found = find(&values, symbol);
            println!("{symbol}: {:.5} {}, truth {truth:.5}; {}", found.value, found.unit, found.source);
            // Across the line the part moves unseen by 2 µm at 1/rev: (2 µm)²/(2·30 mm) and the form's slope, below 0.02 µm, and
            // of sections 30 mm apart 30 times as much of tilt.
            let tolerance = if found.unit == "urad" { 0.6 } else { 0.03 };
            assert!((found.value - truth).abs() < tolerance, "{symbol}: {found:?}, truth {truth}");
            assert!(found.unit == "urad" || found.source.contains("at 30° from x"), "{}", found.source);
        }
        assert!(values.iter().all(|value| value.symbol.contains("-along")), "neither x nor y is observable");
    }
}

/// Without asynchronous motion the spread is what noise makes, by the stated factor.
#[test]
fn noise_enters_by_the_stated_factor() {
    let sigma_um = 0.05;
    let mut config = spindle(Rotation::Ccw);
    config.noise.rms_um = sigma_um;
    let (separation, profiles, slope) = measured(&config);
    let values = values(&separation, &profiles, slope);
    for (symbol, gain) in [("asynchronous-radial-x", 0.5_f64.sqrt()), ("asynchronous-tilt-y", 2.0_f64.sqrt() / 30e-3)] {
        let found = find(&values, symbol);
        let ratio = found.value / (gain * sigma_um);
        println!("{symbol}: {:.4} {}, {ratio:.2} σ of the combination; {}", found.value, found.unit, found.source);
        // The largest of 3 · 512 ranges of 60 normal numbers: 6.6 to 8.5 σ in 99.8 % (drawn apart from this code).
        assert!((6.6..8.5).contains(&ratio), "{symbol}: {ratio}");
        assert!(found.source.contains(&format!("{gain:.3}")), "{}", found.source);
        let known = found.uncertainty.as_ref().unwrap();
        assert!(known.std > 0.0 && known.interval_95[0] < found.value);
    }
}

#[test]
fn motion_is_observable_along_the_one_direction_of_all_sensors() {
    let one = rig(&[(0.0, 0.0, "a")], &[(0.0, 0.0), (180.0, 180.0)]);
    let separator = HarmonicLeastSquares::new(&one, false, Weighting::None);
    for (setup, weight) in [(0, 1.0), (1, -1.0)] {
        let projection = separator.projection(setup).unwrap();
        let [(Quantity::X, weights)] = &projection.rows[..] else { panic!("{projection:?}") };
        assert!(matches!(weights[..], [(0, found)] if (found - weight).abs() < 1e-15), "{weights:?}");
    }
    let oblique = rig(&[(45.0, 0.0, "a")], &[(0.0, 0.0), (180.0, 180.0)]);
    let separator = HarmonicLeastSquares::new(&oblique, false, Weighting::None);
    for (setup, weight) in [(0, 1.0), (1, -1.0)] {
        let projection = separator.projection(setup).unwrap();
        let [(Quantity::Along(line), weights)] = &projection.rows[..] else { panic!("{projection:?}") };
        assert_eq!(line.to_string(), "45°");
        assert!(matches!(weights[..], [(0, found)] if (found - weight).abs() < 1e-15), "{weights:?}");
    }
    let four = rig(&FOUR_SENSORS, &[(0.0, 0.0)]);
    let rows = HarmonicLeastSquares::new(&four, false, Weighting::None).projection(0).unwrap().rows;
    let quantities: Vec<Quantity> = rows.iter().map(|(quantity, _)| *quantity).collect();
    assert_eq!(quantities, [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY]);
}

/// Not a test: what the spread costs beside the average. `cargo test -p runout-spindle error_motion:: -- --ignored
/// --nocapture`.
#[test]
#[ignore = "a measurement of time"]
fn cost_of_the_spread() {
    for (samples, wobble) in [(512, 0.0), (512, 0.5), (2560, 0.5)] {
        let mut config = campaign(1, "[]");
        config.recording.samples_per_rev = samples;
        config.recording.speed_wobble_percent = wobble;
        let checked: Rig = config.rig.clone().check().unwrap();
        let separator = HarmonicLeastSquares::new(&checked, true, Weighting::TurnCovariance);
        let simulator = simulate::simulator(&config).unwrap();
        let recording = simulator.spindle_recording();
        let mut stream = recording.open(0, 0).unwrap();
        let capture = stream.capture().clone();
        let (mut data, mut block) = (Vec::new(), runout_core::measurement::Block::default());
        while stream.next_block(&mut block).unwrap() {
            data.extend_from_slice(&block.samples);
        }
        let memory = runout_core::measurement::MemoryStream {
            capture,
            samples: data,
            angle_rev: Vec::new(),
            block_samples: 4096,
            next: 0,
        };
        let (averager, projection) = (averager(), separator.projection(0));
        let best = |wanted: AverageRequest| {
            let time = || {
                let input = memory.clone();
                let start = Instant::now();
                averager.average_requested(Box::new(Inspection::new(Box::new(input))), wanted).unwrap();
                start.elapsed().as_secs_f64() * 1e3
            };
            (0..30).map(|_| time()).fold(f64::INFINITY, f64::min)
        };
        let plain = best(AverageRequest::default());
        let spread = best(AverageRequest { projection: projection.as_ref(), ..AverageRequest::default() });
        let (separation, profiles, slope) = measured(&config);
        let start = Instant::now();
        let count = values(&separation, &profiles, slope).len();
        println!(
            "60 turns of {samples}, wobble {wobble} %: {plain:.2} ms, with the spread {spread:.2} ms ({:+.1} %); {count} \
             values {:.2} ms",
            100.0 * (spread / plain - 1.0),
            start.elapsed().as_secs_f64() * 1e3
        );
    }
}
