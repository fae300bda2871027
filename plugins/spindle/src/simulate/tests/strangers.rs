//! Each unmodelled disturbance changes what it should, by what it should, and nothing else.

use super::{
    effects::{INITIAL, PART, TURNED, check, form, ids, motion, place, reading, scene},
    *,
};

/// A dent of 2 µm, 3° wide, at 350° of the part.
fn dent(channel: usize, setup: usize, phi: f64) -> f64 {
    let alpha = place(channel).0 - phi - PART[setup].to_radians();
    let from_middle = (alpha - 350.0_f64.to_radians()).sin().atan2((alpha - 350.0_f64.to_radians()).cos()).to_degrees();
    2.0 * (-from_middle * from_middle / 18.0).exp()
}

#[test]
fn a_dent_that_one_sensor_sees() {
    let effect =
        Dent { targets: ids(&["S2"]), depth_um: 2.0, part_angle_deg: 350.0, width_deg: 3.0, ..Dent::default() };
    check(
        Effect::Dent(effect.clone()),
        |channel, _| channel == 1,
        |channel, setup, phi| reading(channel, setup, phi) - dent(channel, setup, phi),
    );
    let form = Dent { targets: vec![], ..effect };
    assert!(simulator(&SpindleConfig { effect: vec![Effect::Dent(form)], ..scene() }).is_err());
}

#[test]
fn a_spike_that_is_gone_afterwards() {
    let effect =
        Dent { setups: ids(&["initial"]), depth_um: -2.0, part_angle_deg: -10.0, width_deg: 3.0, ..Dent::default() };
    check(
        Effect::Dent(effect),
        |_, setup| setup == INITIAL,
        |channel, setup, phi| reading(channel, setup, phi) + dent(channel, setup, phi),
    );
}

/// One undulation of ±1 µm: its slopes are followed half the play behind, its ends cut flat.
#[test]
fn backlash() {
    let mut scene = plain();
    scene.form.harmonics = vec![FormHarmonic { order: 2, amplitude_um: 1.0, ..FormHarmonic::default() }];
    let effect = Backlash { targets: ids(&["S1"]), play_um: 0.2, ..Backlash::default() };
    let with = SpindleConfig { effect: vec![Effect::Backlash(effect)], ..scene.clone() };
    let (before, after) = (readings(&scene, 0, INITIAL), readings(&with, 0, INITIAL));
    assert_eq!(before[1..], after[1..]);
    let (top, bottom) = after[0]
        .iter()
        .skip(TURN)
        .fold((-9.0_f64, 9.0_f64), |(top, bottom), value| (top.max(*value), bottom.min(*value)));
    assert!((top - 0.9).abs() < 1e-12 && (bottom + 0.9).abs() < 1e-12, "{bottom} to {top}");
    let mut followed = 0;
    for sample in TURN..2 * TURN {
        let u = before[0][sample];
        // A sample before, the surface was already 0.8 µm from where it turned.
        if u.abs() < 0.5 {
            let behind = 0.1 * (before[0][sample - 1] - u).signum();
            assert!((after[0][sample] - u - behind).abs() < 1e-12);
            followed += 1;
        }
    }
    assert!(followed > TURN / 4);
}

#[test]
fn a_step_over_part_of_the_turn() {
    // Between samples, so that rounding of the angle does not decide.
    let effect = Step {
        targets: ids(&["S4"]),
        setups: ids(&["turned"]),
        step_um: 0.4,
        from_deg: 301.0,
        to_deg: 21.0,
        declared: false,
    };
    check(
        Effect::Step(effect),
        |channel, setup| channel == 3 && setup == TURNED,
        |channel, setup, phi| {
            let angle = phi.to_degrees() % 360.0;
            reading(channel, setup, phi) + if (21.0..301.0).contains(&angle) { 0.0 } else { 0.4 }
        },
    );
}

#[test]
fn a_probe_that_slips() {
    let effect = SlippedProbe {
        targets: ids(&["S3"]),
        setup: "initial".into(),
        after_turns: 1.501,
        shift_um: 0.3,
        angle_deg: 0.7,
        relative_gain: 0.02,
        declared: false,
    };
    let slipped = |setup: usize, phi: f64| {
        let theta = 0.7_f64.to_radians();
        1.02 * (form(theta - phi - PART[setup].to_radians(), 230.0) + motion(theta, 230.0, phi)) + 0.3
    };
    check(
        Effect::SlippedProbe(effect.clone()),
        |channel, _| channel == 2,
        |channel, setup, phi| {
            let held = setup == INITIAL && phi < 1.501 * TAU;
            if held { reading(channel, setup, phi) } else { slipped(setup, phi) }
        },
    );
    let with = SpindleConfig { effect: vec![Effect::SlippedProbe(effect)], ..scene() };
    // However the samples are read.
    let simulator = simulator(&with).unwrap();
    let in_blocks = |samples| read(&simulator.recording_in_blocks(samples), 0, INITIAL).0;
    assert_eq!(in_blocks(4096), in_blocks(13));
}
