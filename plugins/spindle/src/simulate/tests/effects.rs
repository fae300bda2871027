//! Each effect changes what it should, by what it should, and nothing else.

use super::*;

pub(super) const INITIAL: usize = 0;
pub(super) const TURNED: usize = 1;

/// Form cos(3α) + ½ cos(7α + 40°) with a twist, and motion of known harmonics: x 1.2 cos 2Φ, y 0.7 cos(3Φ − 50°),
/// tilt about x 4 cos 5Φ, about y 6 cos 4Φ µrad.
pub(super) fn scene() -> SpindleConfig {
    let mut config = plain();
    config.form.harmonics = vec![
        FormHarmonic { order: 3, amplitude_um: 1.0, ..FormHarmonic::default() },
        FormHarmonic { order: 7, amplitude_um: 0.5, phase_deg: 40.0, twist_deg_per_mm: 2.0 },
    ];
    config.motion.x = vec![MotionHarmonic { order: 2, amplitude_um: 1.2, phase_deg: 0.0 }];
    config.motion.y = vec![MotionHarmonic { order: 3, amplitude_um: 0.7, phase_deg: 50.0 }];
    config.motion.tilt_x = vec![TiltHarmonic { order: 5, amplitude_urad: 4.0, phase_deg: 0.0 }];
    config.motion.tilt_y = vec![TiltHarmonic { order: 4, amplitude_urad: 6.0, phase_deg: 0.0 }];
    config
}

pub(super) fn form(alpha: f64, z_mm: f64) -> f64 {
    (3.0 * alpha).cos() + 0.5 * (7.0 * alpha + (40.0 + 2.0 * z_mm).to_radians()).cos()
}

pub(super) fn motion(theta: f64, z_mm: f64, phi: f64) -> f64 {
    let x = 1.2 * (2.0 * phi).cos() + 1e-3 * z_mm * 6.0 * (4.0 * phi).cos();
    let y = 0.7 * (3.0 * phi - 50.0_f64.to_radians()).cos() - 1e-3 * z_mm * 4.0 * (5.0 * phi).cos();
    theta.cos() * x + theta.sin() * y
}

/// Angle and z of the sensors of [`rig`].
pub(super) fn place(channel: usize) -> (f64, f64) {
    ([0.0, TAU / 4.0][channel % 2], [200.0, 230.0][channel / 2])
}

pub(super) const PART: [f64; 2] = [0.0, 99.844];

/// Checks that `effect` leaves all channels of all setups as they are but `changed`, which become `expected`, a function
/// of channel, setup and spindle angle. 1e-11 µm: rounding of angles on these orders.
pub(super) fn check(
    effect: Effect,
    changed: impl Fn(usize, usize) -> bool,
    expected: impl Fn(usize, usize, f64) -> f64,
) {
    check_in(&scene(), effect, changed, expected, 1e-11);
}

fn check_in(
    scene: &SpindleConfig,
    effect: Effect,
    changed: impl Fn(usize, usize) -> bool,
    expected: impl Fn(usize, usize, f64) -> f64,
    tolerance_um: f64,
) {
    let with = SpindleConfig { effect: vec![effect], ..scene.clone() };
    for setup in [INITIAL, TURNED] {
        let before = readings(scene, 0, setup);
        let after = readings(&with, 0, setup);
        for channel in 0..4 {
            if changed(channel, setup) {
                assert_ne!(before[channel], after[channel]);
                let difference = largest_difference(&after[channel], |phi| expected(channel, setup, phi));
                assert!(difference < tolerance_um, "channel {channel}, setup {setup}: {difference:e} µm");
            } else {
                assert_eq!(before[channel], after[channel], "channel {channel}, setup {setup}");
            }
        }
    }
}

pub(super) fn reading(channel: usize, setup: usize, phi: f64) -> f64 {
    let (theta, z_mm) = place(channel);
    form(theta - phi - PART[setup].to_radians(), z_mm) + motion(theta, z_mm, phi)
}

pub(super) fn ids(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

#[test]
fn sensor_gain() {
    let effect = SensorGain { targets: ids(&["S2", "S3"]), relative_gain: 0.017, setups: Vec::new(), declared: false };
    check(
        Effect::SensorGain(effect),
        |channel, _| channel == 1 || channel == 2,
        |channel, setup, phi| 1.017 * reading(channel, setup, phi),
    );
}

#[test]
fn sensor_angle() {
    let effect = SensorAngle { targets: ids(&["S4"]), angle_deg: 1.1, setups: Vec::new(), declared: false };
    check(
        Effect::SensorAngle(effect),
        |channel, _| channel == 3,
        |_, setup, phi| {
            let theta = 91.1_f64.to_radians();
            form(theta - phi - PART[setup].to_radians(), 230.0) + motion(theta, 230.0, phi)
        },
    );
}

#[test]
fn sensor_axial_position() {
    let effect = SensorAxialPosition { targets: ids(&["S1"]), shift_mm: -0.8, declared: false };
    check(
        Effect::SensorAxialPosition(effect),
        |channel, _| channel == 0,
        |_, setup, phi| form(-phi - PART[setup].to_radians(), 199.2) + motion(0.0, 199.2, phi),
    );
}

#[test]
fn sensor_nonlinearity() {
    let effect =
        SensorNonlinearity { targets: ids(&["S1"]), quadratic_per_um: 1.7e-3, cubic_per_um2: -2e-4, declared: false };
    check(
        Effect::SensorNonlinearity(effect),
        |channel, _| channel == 0,
        |channel, setup, phi| {
            let u = reading(channel, setup, phi);
            u + 1.7e-3 * u.powi(2) - 2e-4 * u.powi(3)
        },
    );
}

#[test]
fn reversal_angle() {
    let effect = ReversalAngle { targets: ids(&["turned"]), angle_deg: 0.34, declared: false };
    check(
        Effect::ReversalAngle(effect),
        |_, setup| setup == TURNED,
        |channel, _, phi| {
            let (theta, z_mm) = place(channel);
            form(theta - phi - 100.184_f64.to_radians(), z_mm) + motion(theta, z_mm, phi)
        },
    );
}

#[test]
fn part_eccentricity() {
    let effect = PartEccentricity {
        targets: ids(&["turned"]),
        section: Some("b".into()),
        offset_um: 8.0,
        direction_deg: 25.0,
        tilt_urad: 12.0,
        tilt_direction_deg: -70.0,
        declared: false,
    };
    let clamped = |channel: usize, phi: f64| {
        let (theta, z_mm) = place(channel);
        let alpha = theta - phi - PART[TURNED].to_radians();
        // The part is higher where its axis has moved to.
        8.0 * (alpha - 25.0_f64.to_radians()).cos()
            + 1e-3 * (z_mm - 200.0) * 12.0 * (alpha + 70.0_f64.to_radians()).cos()
    };
    check(
        Effect::PartEccentricity(effect.clone()),
        |channel, setup| setup == TURNED && channel >= 2,
        |channel, setup, phi| reading(channel, setup, phi) + clamped(channel, phi),
    );
    check(
        Effect::PartEccentricity(PartEccentricity { section: None, ..effect }),
        |_, setup| setup == TURNED,
        |channel, setup, phi| reading(channel, setup, phi) + clamped(channel, phi),
    );
}

#[test]
fn second_order_geometry() {
    let effect = Effect::SecondOrderGeometry(SecondOrderGeometry::default());
    let exact = SpindleConfig { geometry: Geometry::Exact, ..scene() };
    check_in(&exact, effect.clone(), |_, _| false, |_, _, _| 0.0, 0.0);
    assert!(simulator(&SpindleConfig { effect: vec![effect], ..scene() }).is_err());
}

#[test]
fn setup_motion_change() {
    let effect = SetupMotionChange { targets: ids(&["turned"]), ratio: 0.82, declared: false };
    check(
        Effect::SetupMotionChange(effect),
        |_, setup| setup == TURNED,
        |channel, setup, phi| {
            let (theta, z_mm) = place(channel);
            reading(channel, setup, phi) - 0.18 * motion(theta, z_mm, phi)
        },
    );
}

#[test]
fn even_order_motion() {
    let scene = scene();
    let effect = EvenOrderMotion { x_rms_um: 0.4, y_rms_um: 0.0, max_order: 10, declared: false };
    let with = SpindleConfig { effect: vec![Effect::EvenOrderMotion(effect)], ..scene.clone() };
    let added = |channel: usize, setup: usize| -> Vec<f64> {
        let (before, after) = (readings(&scene, 0, setup), readings(&with, 0, setup));
        after[channel].iter().zip(&before[channel]).map(|(after, before)| after - before).collect()
    };
    let x = added(0, INITIAL);
    assert!((rms(x[..TURN].iter().copied()) - 0.4).abs() < 1e-12);
    // Even: half a turn brings it back, and it is the same in both sections and setups; y has none.
    let close = |a: &[f64], b: &[f64]| a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-12);
    assert!(close(&x[..TURN], &x[TURN / 2..]));
    assert!(close(&x, &added(2, TURNED)));
    assert!(added(1, INITIAL).iter().all(|value| value.abs() < 1e-15));
    let simulator = simulator(&with).unwrap();
    let truth = simulator.spindle_recording().truth(0).unwrap().unwrap().motion.unwrap();
    assert!(
        largest_difference(&truth[0], |phi| 1.2 * (2.0 * phi).cos() + x[(phi / TAU * TURN as f64).round() as usize])
            < 1e-12
    );
}

#[test]
fn thermal_drift() {
    let effect = ThermalDrift {
        targets: ids(&["S3"]),
        rate_um_per_rev: 0.6,
        time_constant_turns: Some(25.0),
        ..ThermalDrift::default()
    };
    check(
        Effect::ThermalDrift(effect),
        |channel, _| channel == 2,
        |channel, setup, phi| reading(channel, setup, phi) + 15.0 * (1.0 - (-phi / TAU / 25.0).exp()),
    );
}

#[test]
fn a_straight_drift_of_one_setup() {
    let effect = ThermalDrift {
        targets: ids(&["S1"]),
        rate_um_per_rev: -0.4,
        setups: ids(&["turned"]),
        ..ThermalDrift::default()
    };
    check(
        Effect::ThermalDrift(effect),
        |channel, setup| channel == 0 && setup == TURNED,
        |channel, setup, phi| reading(channel, setup, phi) - 0.4 * phi / TAU,
    );
}

#[test]
fn sensor_line() {
    let scene = scene();
    let rate_hz = scene.recording.speed_rpm / 60.0 * TURN as f64;
    let by_time = SensorLine { frequency_hz: Some(60.0), order: None, ..SensorLine::default() };
    let by_angle = SensorLine { frequency_hz: None, order: Some(7.3), ..SensorLine::default() };
    for (line, omega) in [(by_time, TAU * 60.0 / rate_hz), (by_angle, TAU * 7.3 / TURN as f64)] {
        let effect = SensorLine { targets: ids(&["S2", "S3"]), amplitude_um: 0.3, ..line };
        let with = SpindleConfig { effect: vec![Effect::SensorLine(effect)], ..scene.clone() };
        for setup in [INITIAL, TURNED] {
            let (before, after) = (readings(&scene, 0, setup), readings(&with, 0, setup));
            let added: Vec<Vec<f64>> =
                after.iter().zip(&before).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
            assert!(added[0].iter().chain(&added[3]).all(|value| value.abs() <= 0.0));
            // Both channels have it at the same phase.
            assert!(added[1].iter().zip(&added[2]).all(|(a, b)| (a - b).abs() < 1e-13));
            // One sinusoid: s(k+1) + s(k−1) = 2 cos(ω) s(k), and its amplitude.
            assert!(added[1].windows(3).all(|s| (s[0] + s[2] - 2.0 * omega.cos() * s[1]).abs() < 1e-12));
            let (s, next) = (added[1][40], added[1][41]);
            let amplitude = s.hypot((next - s * omega.cos()) / omega.sin());
            assert!((amplitude - 0.3).abs() < 1e-9, "{amplitude}");
        }
    }
    let both =
        SensorLine { targets: ids(&["S2"]), frequency_hz: Some(50.0), order: Some(6.0), ..SensorLine::default() };
    assert!(simulator(&SpindleConfig { effect: vec![Effect::SensorLine(both)], ..scene }).is_err());
}

#[test]
fn asynchronous_line() {
    let scene = scene();
    let effect = AsynchronousLine { order: 0.42, amplitude_um: 0.3, direction_deg: 60.0, declared: false };
    let with = SpindleConfig { effect: vec![Effect::AsynchronousLine(effect)], ..scene.clone() };
    for setup in [INITIAL, TURNED] {
        let (before, after) = (readings(&scene, 0, setup), readings(&with, 0, setup));
        let added: Vec<Vec<f64>> =
            after.iter().zip(&before).map(|(a, b)| a.iter().zip(b).map(|(a, b)| a - b).collect()).collect();
        // To and fro along 60°: y is √3 times x, and both sections move alike.
        assert!(added[0].iter().zip(&added[1]).all(|(x, y)| (x * 3.0_f64.sqrt() - y).abs() < 1e-13));
        assert!(added[0].iter().zip(&added[2]).all(|(a, b)| (a - b).abs() < 1e-13));
        // One sinusoid at 0.42 per turn: s(k+1) + s(k−1) = 2 cos(ω) s(k), and its amplitude.
        let omega = TAU * 0.42 / TURN as f64;
        assert!(added[0].windows(3).all(|s| (s[0] + s[2] - 2.0 * omega.cos() * s[1]).abs() < 1e-13));
        let (s, next) = (added[0][40], added[0][41]);
        let amplitude = s.hypot((next - s * omega.cos()) / omega.sin());
        assert!((amplitude - 0.15).abs() < 1e-10, "{amplitude}");
    }
}

#[test]
fn speed_ripple() {
    let scene = scene();
    let effect = SpeedRipple {
        order: 2.0,
        amplitude_deg: 0.004_f64.to_degrees(),
        phase_deg: 30.0,
        targets: vec![],
        declared: false,
    };
    let with = SpindleConfig { effect: vec![Effect::SpeedRipple(effect)], ..scene };
    let phase = 30.0_f64.to_radians();
    for setup in [INITIAL, TURNED] {
        let after = readings(&with, 0, setup);
        for (channel, readings) in after.iter().enumerate() {
            let difference = largest_difference(readings, |nominal| {
                let phi = nominal + 0.004 * ((2.0 * nominal + phase).sin() - phase.sin());
                reading(channel, setup, phi)
            });
            assert!(difference < 1e-11, "{difference:e}");
        }
    }
    // A ripple that repeats every turn leaves the marks in their places.
    let simulator = simulator(&with).unwrap();
    let marks = simulator.spindle_recording().open(0, 0).unwrap().capture().marks.clone();
    assert!(marks.iter().enumerate().all(|(turn, mark)| (mark - (turn * TURN) as f64).abs() < 1e-10), "{marks:?}");
}

#[test]
fn axial_motion() {
    let effect = AxialMotion {
        harmonics: vec![MotionHarmonic { order: 3, amplitude_um: 5.0, phase_deg: 10.0 }],
        declared: false,
    };
    check(
        Effect::AxialMotion(effect),
        |_, _| true,
        |channel, setup, phi| {
            let (theta, z_mm) = place(channel);
            let axial_mm = 5e-3 * (3.0 * phi - 10.0_f64.to_radians()).cos();
            form(theta - phi - PART[setup].to_radians(), z_mm - axial_mm) + motion(theta, z_mm, phi)
        },
    );
}

/// A scenario cannot declare its effects to a separation: the pipeline does.
#[test]
fn an_effect_that_claims_to_be_declared_is_refused() {
    let with = |declared| {
        let gain = SensorGain { targets: vec!["S1".into()], relative_gain: 0.01, setups: Vec::new(), declared };
        simulator(&SpindleConfig { effect: vec![Effect::SensorGain(gain)], ..scene() })
    };
    let refused = with(true).err().map(|fault| fault.to_string()).unwrap_or_default();
    assert!(with(false).is_ok() && refused.contains("expected false"), "{refused}");
}
