//! What the chain of a channel does: delays, low-passes, cross-talk, gains of one setup.

use runout_core::closed_loop::diagnosis::Verdict;
use runout_spindle::simulate::SpindleConfig;

use super::{CLEAN_UM, diagnosed};
use crate::campaigns::campaign;

/// One effect: it is named by itself or in its set, with its size where it is alone, and form is no farther off than before.
fn finds(effect: &str, named: &str, parameter: Option<(&str, f64)>) {
    finds_in(&|config| config, effect, named, parameter);
}

/// One effect in a campaign that differs: it is named by itself or in its set, with its size where it is alone, and form is no
/// farther off than before.
fn finds_in(
    changed: &dyn Fn(SpindleConfig) -> SpindleConfig,
    effect: &str,
    named: &str,
    parameter: Option<(&str, f64)>,
) {
    for seed in 1..=2 {
        let (found, [before, after]) = diagnosed(&changed(campaign(seed, &format!("[{effect}]"))));
        let diagnosis = &found.diagnosis;
        println!(
            "simulated, {effect}, seed {seed}: {:?}, form error {before:.4} → {after:.4} µm, {:?}",
            diagnosis.verdict, diagnosis.added
        );
        assert_eq!(diagnosis.verdict, Verdict::Explained, "{effect}: {:?}", diagnosis.unexplained);
        let [added] = &diagnosis.added[..] else { panic!("{effect}: {:?}", diagnosis.added) };
        let itself = std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ");
        assert!(itself == named || added.confounded_with.iter().any(|other| other == named), "{effect}: {added:?}");
        if let Some((name, truth)) = parameter.filter(|_| itself == named && added.confounded_with.is_empty()) {
            let found = added.parameters.iter().find(|known| known.name == name).unwrap();
            // Five standard uncertainties, and 1 %: partials leave out what exact geometry adds.
            let off = (found.value - truth).abs();
            assert!(off < 5.0 * found.std.unwrap() + 0.01 * truth.abs(), "{effect}: {found:?} for {truth}");
        }
        assert!(after <= 1.01 * before.max(CLEAN_UM), "{effect}: {before} → {after}");
        let stated = (0..2).map(|section| found.after[0].angle_std(section)).fold(0.0, f64::max);
        assert!(after < 3.0 * stated, "{effect}: error {after}, stated {stated}");
    }
}

/// Degrees that the spindle turns in 100 µs.
fn turned_deg() -> f64 {
    100e-6 * 6.0 * campaign(1, "[]").recording.speed_rpm
}

#[test]
fn a_late_channel_is_found() {
    let effect = r#"{"plugin":"channel-delay","targets":["S2"],"delay_us":100}"#;
    finds(effect, "channel-delay S2", Some(("delay", turned_deg())));
}

#[test]
fn a_multiplexed_converter_is_found() {
    finds(r#"{"plugin":"channel-skew","delay_us":50}"#, "channel-skew", Some(("delay", 0.5 * turned_deg())));
}

#[test]
fn low_passes_of_higher_order_are_found() {
    let config = campaign(1, "[]");
    let turns_hz = config.recording.speed_rpm / 60.0;
    for (order, named) in [(2, "filter-attenuation-2 S3"), (4, "filter-attenuation-4 S3")] {
        let effect = format!(
            r#"{{"plugin":"filter-attenuation","targets":["S3"],"cutoff_hz":{},"order":{order}}}"#,
            40.0 * turns_hz
        );
        // The digital filter is the analogue one far below the sampling rate.
        let oversampled = |mut config: SpindleConfig| {
            config.recording.samples_per_rev = 4096;
            config
        };
        finds_in(&oversampled, &effect, named, Some(("cut-off", 40.0)));
    }
}

#[test]
fn what_one_setup_has_is_found() {
    finds(
        r#"{"plugin":"sensor-gain","targets":["S3"],"setups":["b"],"relative_gain":0.02}"#,
        "sensor-gain S3 b",
        Some(("gain", 0.02)),
    );
    finds(
        r#"{"plugin":"sensor-angle","targets":["S3"],"setups":["c"],"angle_deg":0.2}"#,
        "sensor-angle S3 c",
        Some(("angle", 0.2)),
    );
    finds(r#"{"plugin":"setup-gain","targets":["b"],"relative_gain":0.03}"#, "setup-gain b", Some(("gain", 0.03)));
    finds(r#"{"plugin":"index-offset","targets":["c"],"angle_deg":0.3}"#, "index-offset c", Some(("angle", 0.3)));
}

#[test]
fn shares_of_other_channels_are_found() {
    finds(r#"{"plugin":"cross-talk","targets":["S1","S4"],"share":0.02}"#, "cross-talk S1 S4", Some(("share", 0.02)));
    finds(r#"{"plugin":"channel-ghost","share":0.01}"#, "channel-ghost", Some(("share", 0.01)));
}

/// What two sensors a section take for motion, and what a wide spot takes from the form of any rig.
#[test]
fn what_no_layout_shows_is_said() {
    let blind = |config: &SpindleConfig| {
        let found = diagnosed(config).0.diagnosis.blind_to;
        found.into_iter().map(|one| (one.effect, one.bias_per_unit.value)).collect::<Vec<_>>()
    };
    let four = blind(&campaign(1, "[]"));
    assert!(four.contains(&("chuck-form".into(), 1.0)) && four.contains(&("bracket-motion".into(), 1.0)), "{four:?}");
    let spot = four.iter().find(|(effect, _)| effect == "probe-spot").unwrap().1;
    // 4 µm rms of a form with orders to 60 on 30 mm.
    assert!((1e-4..0.1).contains(&spot), "{spot}");
    let mut config = campaign(1, "[]");
    for (index, angle_deg) in [202.5, 202.5].into_iter().enumerate() {
        let mut third = config.rig.sensors[2 * index].clone();
        (third.id, third.angle_deg) = (format!("S{}", 5 + index), angle_deg);
        config.rig.sensors.push(third);
    }
    let six = blind(&config);
    assert!(six.iter().all(|(effect, _)| effect != "chuck-form"), "{six:?}");
}
