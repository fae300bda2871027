//! Mistakes that were made in one setup, and channels in another unit.

use runout_core::closed_loop::diagnosis::Verdict;

use super::{CLEAN_UM, diagnosed, name, names, reversed, six};

#[test]
fn mistakes_of_one_setup_are_found_and_corrected() {
    for (seed, effect, mistake, advice) in [
        (1, r#"{"plugin":"sensor-sign","targets":["S2"],"setups":["b"]}"#, "sensor-sign S2 b", "opposite sign"),
        (2, r#"{"plugin":"sensor-sign","targets":["S5"],"setups":["a"]}"#, "sensor-sign S5 a", "opposite sign"),
        (
            3,
            r#"{"plugin":"sensors-swapped","targets":["S1","S3"],"setups":["c"]}"#,
            "sensors-swapped S1 S3 c",
            "swapped",
        ),
        (
            4,
            r#"{"plugin":"sensors-swapped","targets":["S2","S6"],"setups":["b"]}"#,
            "sensors-swapped S2 S6 b",
            "swapped",
        ),
        (5, r#"{"plugin":"rotation-reversed","setups":["b"]}"#, "rotation-reversed b", "turns the other way"),
    ] {
        let (found, [before, after]) = names(&six(seed, &format!("[{effect}]")), &[mistake], &[]);
        assert!(found.diagnosis.added[0].confounded_with.is_empty(), "{mistake}: {:?}", found.diagnosis.added);
        assert!(after < CLEAN_UM && before > 10.0 * after, "{mistake}: {before} → {after}");
        let said = found.diagnosis.warnings.iter().any(|warning| warning.contains(advice));
        assert!(said, "{mistake}: {:?}", found.diagnosis.warnings);
    }
}

/// With two sensors a section the layout may not decide: form does not get worse.
#[test]
fn mistakes_of_one_setup_do_not_move_form_away_from_the_truth() {
    for (seed, effect) in [
        (1, r#"{"plugin":"sensor-sign","targets":["S3"],"setups":["b"]}"#),
        (2, r#"{"plugin":"sensors-swapped","targets":["S1","S2"],"setups":["b"]}"#),
        (3, r#"{"plugin":"rotation-reversed","setups":["b"]}"#),
    ] {
        let (found, [before, after]) = diagnosed(&reversed(seed, &format!("[{effect}]")));
        println!("simulated, {effect}: form error {before:.4} → {after:.4} µm, {:?}", found.diagnosis.added);
        assert!(after <= 1.01 * before, "{effect}: {before} → {after}");
    }
}

/// A channel in mil, mm or nm, or in a range that is ten times as large.
#[test]
fn a_channel_in_another_unit_is_found() {
    for (seed, factor) in [(1, 1.0 / 25.4), (2, 1e-3), (3, 1e3), (4, 10.0), (5, 0.1)] {
        let gain = factor - 1.0;
        let effect = format!(r#"[{{"plugin":"sensor-gain","targets":["S5"],"relative_gain":{gain}}}]"#);
        let (found, [before, after]) = diagnosed(&six(seed, &effect));
        println!("simulated, {effect}: form error {before:.4} → {after:.4} µm, {:?}", found.diagnosis.added);
        let [added] = &found.diagnosis.added[..] else { panic!("{effect}: {:?}", found.diagnosis.added) };
        assert_eq!(name(added), "sensor-gain S5");
        let found_gain = 1.0 + added.parameters[0].value;
        assert!((found_gain / factor - 1.0).abs() < 1e-3, "{effect}: {added:?}");
        assert!(found.diagnosis.verdict == Verdict::Explained && after < CLEAN_UM, "{effect}: {before} → {after}");
    }
}
