//! What channels do to their readings: low-passes, delays, shares of other channels, gains and angles of one setup.

use super::{
    effects::{INITIAL, TURNED, ids, scene},
    *,
};

/// A single undulation of order 20 comes through a first-order low-pass with 1/√(1 + r²) and a lag of arctan r, where
/// r = tan(π·20/128) / tan(π·fc/fs).
#[test]
fn filter_attenuation() {
    let mut scene = plain();
    scene.recording.revolutions = 20;
    scene.form.harmonics = vec![FormHarmonic { order: 20, amplitude_um: 2.0, ..FormHarmonic::default() }];
    let sample_rate_hz = 128.0 * 500.0 / 60.0;
    let filter =
        FilterAttenuation { targets: ids(&["S1"]), cutoff_hz: 0.1 * sample_rate_hz, order: 1, declared: false };
    let with = SpindleConfig { effect: vec![Effect::FilterAttenuation(filter)], ..scene.clone() };
    let (before, after) = (readings(&scene, 0, INITIAL), readings(&with, 0, INITIAL));
    assert_eq!(before[1..], after[1..]);
    let pi = TAU / 2.0;
    let ratio = (pi * 20.0 / 128.0).tan() / (pi * 0.1).tan();
    let expected = |phi: f64| 2.0 / (1.0 + ratio * ratio).sqrt() * (20.0 * phi - ratio.atan()).cos();
    // The transient is over after some turns; the whole of the first ten is left to it.
    let settled = &after[0][10 * TURN..];
    assert!(largest_difference(settled, expected) < 1e-11);
}

/// With one effect more than the scene has.
fn beside(scene: &SpindleConfig, effect: Effect) -> SpindleConfig {
    SpindleConfig { effect: vec![effect], ..scene.clone() }
}

/// A channel that is late by whole samples records what it recorded so many samples before; a converter makes each
/// channel later than the one before.
#[test]
fn late_channels() {
    let scene = scene();
    let before = readings(&scene, 0, INITIAL);
    let sample_us = 1e6 * 60.0 / (scene.recording.speed_rpm * TURN as f64);
    let is_late = |after: &[f64], before: &[f64], samples: usize| {
        let differences = after[samples..].iter().zip(before).map(|(after, before)| (after - before).abs());
        differences.fold(0.0, f64::max) < 1e-9
    };
    let late = ChannelDelay { targets: ids(&["S2"]), delay_us: 3.0 * sample_us, declared: false };
    let after = readings(&beside(&scene, Effect::ChannelDelay(late)), 0, INITIAL);
    assert!(after[0] == before[0] && is_late(&after[1], &before[1], 3));
    let skew = Effect::ChannelSkew(ChannelSkew { delay_us: 2.0 * sample_us, declared: false });
    let after = readings(&beside(&scene, skew), 0, INITIAL);
    assert!((0..4).all(|channel| is_late(&after[channel], &before[channel], 2 * channel)));
}

/// Shares of other channels, gains of one setup, and an angle in one setup as everywhere.
#[test]
fn shares_gains_and_angles_of_one_setup() {
    let scene = scene();
    let both = |config: &SpindleConfig| [INITIAL, TURNED].map(|setup| readings(config, 0, setup));
    let before = both(&scene);
    let name = |setup: usize| vec![scene.rig.setups[setup].id.clone()];
    let near = |a: f64, b: f64| (a - b).abs() < 1e-12;
    let talk = CrossTalk { targets: ["S1".into(), "S4".into()], share: 0.03, declared: false };
    let after = both(&beside(&scene, Effect::CrossTalk(talk)));
    for (after, before) in after.iter().zip(&before) {
        assert_eq!(after[..3], before[..3]);
        assert!((0..TURN).all(|sample| near(after[3][sample], before[3][sample] + 0.03 * before[0][sample])));
    }
    let after = both(&beside(&scene, Effect::ChannelGhost(ChannelGhost { share: 0.02, declared: false })));
    let ghost = |channel: usize, sample: usize| before[0][channel][sample] + 0.02 * before[0][channel - 1][sample];
    assert!((1..4).all(|channel| (0..TURN).all(|sample| near(after[0][channel][sample], ghost(channel, sample)))));
    let gain = SetupGain { targets: name(TURNED), relative_gain: 0.1, declared: false };
    let after = both(&beside(&scene, Effect::SetupGain(gain)));
    assert_eq!(after[0], before[0]);
    assert!((0..4).all(|channel| near(after[1][channel][5], 1.1 * before[1][channel][5])));
    let turned = |setups| SensorAngle { targets: ids(&["S2"]), angle_deg: 1.5, setups, declared: false };
    let after = both(&beside(&scene, Effect::SensorAngle(turned(name(TURNED)))));
    let everywhere = both(&beside(&scene, Effect::SensorAngle(turned(Vec::new()))));
    assert_eq!((&after[0], &after[1]), (&before[0], &everywhere[1]));
}
