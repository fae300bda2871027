//! What a rig would show of each effect before anyone measures: against what is known of the layouts of `docs/appendix/physics.md`,
//! and against what the closed loop finds in simulated campaigns, which share no formula with it.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

use crate::campaigns::{averaged, campaign};
use crate::common::{FOUR_SENSORS, rig};
use runout_core::{
    closed_loop::{
        Settings,
        diagnosis::{Added, Diagnosis},
        foresight::Foresight,
    },
    rig::Rig,
};
use runout_spindle::{
    diagnose::diagnose,
    effects,
    layout::Layout,
    plan::{Addition, changes, foresee, foresee_rig},
    selection::Selection,
};

const THREE_PART_ANGLES: [(f64, f64); 3] = [(0.0, 0.0), (99.844, 0.0), (202.5, 0.0)];

fn four_sensors() -> Rig {
    rig(&FOUR_SENSORS, &THREE_PART_ANGLES)
}

/// Three sensors in each of two sections, fixed, the part at 0 and 180°.
fn six_sensors() -> Rig {
    let sections = [(100.0, "a"), (130.0, "b")];
    let sensors: Vec<_> =
        sections.iter().flat_map(|(z, section)| [0.0, 99.844, 202.5].map(|angle| (angle, *z, *section))).collect();
    rig(&sensors, &[(0.0, 0.0), (180.0, 0.0)])
}

fn pair(effect: &str, one: &str, other: &str) -> Vec<String> {
    vec![format!("{effect} {one}"), format!("{effect} {other}")]
}

fn visible_from(foresight: &Foresight, effect: &str, target: Option<&str>) -> f64 {
    let found = foresight
        .visible
        .iter()
        .find(|visible| visible.effect == effect && visible.targets.first().map(String::as_str) == target);
    found.unwrap().parameters[0].visible_from
}

#[test]
fn two_sensors_a_section_show_only_the_ratio_of_their_gains() {
    let foresight = foresee_rig(&four_sensors()).unwrap();
    for effect in ["sensor-gain", "sensor-angle"] {
        for [one, other] in [["S1", "S2"], ["S3", "S4"]] {
            let expected = pair(effect, one, other);
            assert!(foresight.confounded.contains(&expected), "{expected:?} not in {:?}", foresight.confounded);
        }
        // And with nothing else.
        let sets = foresight.confounded.iter().filter(|set| set.iter().any(|name| name.starts_with(effect)));
        assert_eq!(sets.count(), 2, "{:?}", foresight.confounded);
    }
}

#[test]
fn three_sensors_a_section_distinguish_gains_and_angles() {
    let foresight = foresee_rig(&six_sensors()).unwrap();
    for effect in ["sensor-gain", "sensor-angle", "reversal-angle", "setup-motion-change"] {
        assert!(!foresight.confounded.iter().flatten().any(|name| name.starts_with(effect)), "{effect}");
        assert!(foresight.visible.iter().any(|visible| visible.effect == effect), "{effect}");
        assert!(!foresight.blind_names().any(|name| name.starts_with(effect)), "{effect}");
    }
}

/// With part and sensors turned together, a part clamped at another angle is a part whose form is turned by half of it:
/// the readings of both setups say the same of any form, so nothing shows, and form is wrong all the same.
#[test]
fn a_full_reversal_is_blind_to_the_angle_of_the_part() {
    let reversed = rig(&FOUR_SENSORS, &[(0.0, 0.0), (180.0, 180.0)]);
    let foresight = foresee_rig(&reversed).unwrap();
    let unseen = foresight.blind_to.iter().find(|unseen| unseen.blind.effect == "reversal-angle").unwrap();
    // Form is off by δ/2 times its slope: n c/2 with c = A/n at 39 orders, √(39/2) A/2 where A²/2 Σ 1/n² is (4 µm)².
    let squares: f64 = (2..=40_u32).map(|order| f64::from(order).powi(-2)).sum();
    let turned = 0.5 * (39.0 / 2.0_f64).sqrt() * 4.0 * (2.0 / squares).sqrt() * 1.0_f64.to_radians();
    let form = unseen.bias.iter().find(|bias| bias.on == "form").unwrap();
    assert_eq!(form.unit, "um/deg");
    // The two sections' forms are drawn; 15 %: three times the scatter of their sizes.
    assert!((form.value / turned - 1.0).abs() < 0.15, "{} and {turned}", form.value);
}

/// Mistakes that leave no trace are named before a measurement too, and no addition is asked for them.
#[test]
fn mistakes_without_a_trace_are_foreseen() {
    let reversed = rig(&FOUR_SENSORS, &[(0.0, 0.0), (180.0, 180.0)]);
    // By the linear equations: at an eccentricity of 8 µm the exact geometry shows them.
    let (selection, layout) = (Selection::whole(&reversed), Layout::new(&reversed, false));
    let foresight = foresee(&selection, &layout, false, effects::all()).unwrap();
    let blind: Vec<String> = foresight.blind_names().collect();
    for mistake in ["sensor-sign S1 S2", "sensor-sign S3 S4", "setups-swapped k0 k1"] {
        assert!(blind.iter().any(|name| name == mistake), "{mistake}: {blind:?}");
    }
    let changes = changes(&reversed, &foresight, &[], 15.0).unwrap();
    let asked = changes.still_blind.iter().chain(changes.found.iter().flat_map(|change| &change.reveals));
    assert!(asked.clone().all(|name| !name.starts_with("sensor-sign")), "{:?}", asked.collect::<Vec<_>>());
}

#[test]
fn a_third_sensor_distinguishes_the_gains_of_its_section() {
    let (rig, clearance_deg) = (four_sensors(), 15.0);
    let foresight = foresee_rig(&rig).unwrap();
    let found = changes(&rig, &foresight, &[], clearance_deg).unwrap();
    for (section, [one, other]) in [["S1", "S2"], ["S3", "S4"]].into_iter().enumerate() {
        for effect in ["sensor-gain", "sensor-angle"] {
            let change = found.found.iter().find(|change| change.distinguishes.contains(&pair(effect, one, other)));
            let change = change.unwrap_or_else(|| panic!("nothing distinguishes {effect}:  {found:?}"));
            // No setup does: whatever both sensors scale or turn together, form and motion take.
            assert!(matches!(change.addition, Addition::Sensor { section: of, .. } if of == section), "{change:?}");
        }
    }
    // What a filter and a delay of one sensor do to small angles is the same in any layout.
    for set in &found.still_confounded {
        let of_one_channel =
            |name: &String| name.starts_with("filter-attenuation") || name.starts_with("channel-delay");
        assert!(set.iter().all(of_one_channel), "{set:?}");
    }
}

/// The layout that assumes odd motion would show that it is not.
#[test]
fn an_assumption_that_fails_would_show() {
    let fixed = rig(&FOUR_SENSORS, &[(0.0, 0.0), (180.0, 0.0)]);
    let shows = |assumed| {
        let foresight =
            foresee(&Selection::whole(&fixed), &Layout::new(&fixed, assumed), true, effects::all()).unwrap();
        foresight.visible.iter().any(|visible| visible.effect == "even-order-motion")
    };
    assert!(shows(true) && !shows(false));
}

fn diagnosed(seed: u64, planted: &str) -> Diagnosis {
    let config = campaign(seed, planted);
    let rig = config.rig.clone().check().unwrap();
    let (station, _) = averaged(&config, &rig);
    let layout = Layout::new(&rig, false);
    let settings = Settings::default();
    diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &settings).unwrap().diagnosis
}

/// Effects of twice the size from which they are said to be visible are found, and confounded as foreseen.
#[test]
fn the_loop_finds_what_was_foreseen() {
    let foresight = foresee_rig(&campaign(7, "[]").rig.check().unwrap()).unwrap();
    let size = |effect: &str, target: &str| 2.0 * visible_from(&foresight, effect, Some(target));
    let campaigns = [
        ("sensor-gain", "S1", format!(r#""relative_gain":{}"#, size("sensor-gain", "S1"))),
        ("sensor-angle", "S3", format!(r#""angle_deg":{}"#, size("sensor-angle", "S3"))),
        ("reversal-angle", "b", format!(r#""angle_deg":{}"#, size("reversal-angle", "b"))),
        ("setup-motion-change", "c", format!(r#""ratio":{}"#, 1.0 + size("setup-motion-change", "c"))),
        ("sensor-nonlinearity", "S2", format!(r#""quadratic_per_um":{}"#, size("sensor-nonlinearity", "S2"))),
    ];
    for (effect, target, value) in campaigns {
        let found = diagnosed(7, &format!(r#"[{{"plugin":"{effect}","targets":["{target}"],{value}}}]"#));
        let name = format!("{effect} {target}");
        println!("simulated, {name} with {value}: {:?}", found.added);
        let [added] = &found.added[..] else { panic!("{name}: {:?}, refused {:?}", found.added, found.refused) };
        let mut set = vec![format!("{} {}", added.effect, added.targets.join(""))];
        set.extend(added.confounded_with.iter().cloned());
        assert!(set.contains(&name), "{name}: {added:?}");
        let foreseen = foresight.confounded.iter().find(|set| set.contains(&name));
        // What was foreseen to look the same does; at small sizes more may.
        assert!(foreseen.is_none_or(|foreseen| foreseen.iter().all(|member| set.contains(member))), "{name}: {set:?}");
    }
}

/// An effect of the size from which it is said to be visible is named in every second campaign, alone or in a set, and of twice the size in nearly all:
/// what it does depends on the phases of form and motion.
#[test]
fn what_is_visible_is_named() {
    let foresight = foresee_rig(&campaign(7, "[]").rig.check().unwrap()).unwrap();
    let visible_from = visible_from(&foresight, "sensor-gain", Some("S1"));
    let named = |gain: f64| {
        let planted = format!(r#"[{{"plugin":"sensor-gain","targets":["S1"],"relative_gain":{gain}}}]"#);
        let is_named = |seed: &u64| {
            let found = diagnosed(*seed, &planted).added;
            let names =
                |one: &Added| one.effect == "sensor-gain" || one.confounded_with.join(" ").contains("sensor-gain");
            found.iter().any(names)
        };
        (20..32).filter(is_named).count()
    };
    let [once, twice] = [1.0, 2.0].map(|times| named(times * visible_from));
    println!("a gain of {visible_from}: named in {once} of 12, of twice the size in {twice}");
    assert!(once >= 3 && twice >= 11, "{once} {twice}");
}
