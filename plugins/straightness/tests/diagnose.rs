//! The closed loop on simulated traces: shifts, gains, tilts and drifts, and traces that lack nothing.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    common::{Campaign, Shot, ground, rms},
    trials::trials,
};
use runout_core::closed_loop::{Settings, diagnosis::Diagnosis};
use runout_straightness::{AxialReversal, AxialReversalConfig, Straightness};

fn separator(slide_cutoff_mm: Option<f64>) -> AxialReversal {
    AxialReversalConfig { slide_cutoff_mm, ..AxialReversalConfig::default() }.separator().unwrap()
}

struct Diagnosed {
    diagnosis: Diagnosis,
    after: Straightness,
}

fn diagnosed(campaign: &Campaign, slide_cutoff_mm: Option<f64>) -> Diagnosed {
    let separator = separator(slide_cutoff_mm);
    let settings = Settings { max_added: 40, ..Settings::default() };
    let (diagnosis, after) = separator.diagnosed(&campaign.points(), &settings).unwrap();
    Diagnosed { diagnosis, after }
}

fn run(campaign: &Campaign, slide_cutoff_mm: Option<f64>) -> Straightness {
    separator(slide_cutoff_mm).separated(&campaign.points()).unwrap()
}

fn errors(campaign: &Campaign, found: &Straightness) -> [f64; 2] {
    campaign.errors(&found.z_mm, [&found.part_um, &found.slide_um])
}

/// "effect target" of all that was added, with what it is confounded with.
fn named(diagnosis: &Diagnosis) -> Vec<Vec<String>> {
    let of = |one: &runout_core::closed_loop::diagnosis::Added| {
        let mut names = vec![format!("{} {}", one.effect, one.targets.join(" "))];
        names.extend(one.confounded_with.iter().cloned());
        names
    };
    diagnosis.added.iter().map(of).collect()
}

/// Waves of the slide of 1.2, 2 and 5 times its cut-off, a hundred times the noise: nothing is there to be found, and errors are those of noise.
/// What contradicts the values of a run.
fn found_of(straightness: &Straightness) -> impl Iterator<Item = &String> {
    straightness.checks.iter().filter(|check| check.refutes()).map(|check| &check.finding)
}

#[test]
fn a_slide_with_waves_near_its_cutoff_lacks_nothing() {
    for seed in 0..trials(6) as u64 {
        let mut campaign = ground(20 + seed, [3, 3]);
        campaign.noise_um = 0.05;
        campaign.length_mm = 300.0;
        campaign.step_mm = 2.0;
        campaign.part = vec![[1.0, 150.0, 0.4], [0.4, 37.0, 1.1]];
        campaign.slide = vec![[2.0, 60.0, 0.3 * seed as f64], [1.5, 100.0, 1.0], [2.5, 250.0, 2.0]];
        let found = run(&campaign, Some(50.0));
        let [part, slide] = errors(&campaign, &found);
        // Of three traces on each side, 0.05/√6 = 0.02 µm; of the smooth slide less.
        assert!(part < 0.04 && slide < 0.03, "{seed}: {part} {slide}");
        let diagnosis = diagnosed(&campaign, Some(50.0)).diagnosis;
        assert!(diagnosis.added.is_empty(), "{seed}: {:?}", named(&diagnosis));
    }
}

#[test]
fn shifted_traces_are_found_and_corrected() {
    let mut campaign = ground(1, [3, 3]);
    campaign.traces[1].shift_mm = 0.12;
    campaign.traces[5].shift_mm = -0.09;
    let before = run(&campaign, None);
    let said = found_of(&before).find(|found| found.contains("axial shifts")).expect("run contradicts its values");
    assert!(said.contains("initial-2") && said.contains("reversed-3"), "{said}");
    let found = diagnosed(&campaign, None);
    println!("{:#?}\n{:?}", found.diagnosis.added, found.diagnosis.warnings);
    let mut names = named(&found.diagnosis);
    names.sort();
    assert_eq!(names, [["axial-registration initial-2"], ["axial-registration reversed-3"]]);
    for one in &found.diagnosis.added {
        let expected = if one.targets[0] == "initial-2" { 0.12 } else { -0.09 };
        // A shift is known to noise/(slope·√points) = 0.02/(1.3·√500) mm = 0.7 µm times √1.5, of one trace against two; the
        // splines and the sampling add to it.
        assert!((one.parameters[0].value - expected).abs() < 0.01, "{one:?}");
        assert_eq!(one.parameters[0].unit, "mm");
    }
    let (before_um, after_um) = (errors(&campaign, &before), errors(&campaign, &found.after));
    println!("errors {before_um:?} → {after_um:?}, stated {:?}", rms(&found.after.slide_std_um));
    assert!(after_um[1] < 0.5 * before_um[1], "{before_um:?} {after_um:?}");
    // Root mean square over correlated errors: 2 stated standard uncertainties.
    assert!(after_um[0] < 2.0 * rms(&found.after.part_std_um) && after_um[1] < 2.0 * rms(&found.after.slide_std_um));
    let strt = found.diagnosis.moved.iter().find(|one| one.value == "STRt" && one.section.as_deref() == Some("slide"));
    assert!(strt.unwrap().std.is_some());
}

/// Shifts of 40 to 170 µm in every trace, in any direction: the differences within a setup are found, what is left open is in the
/// stated uncertainty.
#[test]
fn shifts_of_all_traces_leave_a_stated_uncertainty() {
    // Both signs, and one more.
    let (mut held, mut worse, campaigns) = (0, 0, trials(6).max(3) as u64);
    for seed in 0..campaigns {
        let mut campaign = ground(100 + seed, [3, 3]);
        let shifts = [0.12, -0.07, 0.04, -0.17, 0.09, -0.05];
        for (trace, shot) in campaign.traces.iter_mut().enumerate() {
            shot.shift_mm = shifts[(trace + seed as usize) % shifts.len()] * if seed % 2 == 0 { 1.0 } else { -1.0 };
        }
        let found = diagnosed(&campaign, None);
        let before = errors(&campaign, &run(&campaign, None));
        let after = errors(&campaign, &found.after);
        let stated = rms(&found.after.slide_std_um);
        let parts = rms(&found.after.part_std_um);
        println!(
            "{seed}: slide {:.4} → {:.4} ± {stated:.4}, part {:.4} → {:.4} ± {parts:.4}, {:?}",
            before[1],
            after[1],
            before[0],
            after[0],
            named(&found.diagnosis)
        );
        let registered = |names: &Vec<String>| names[0].starts_with("axial-registration");
        let shifted: usize = named(&found.diagnosis).iter().map(Vec::len).sum();
        assert!(shifted >= 3 && named(&found.diagnosis).iter().all(registered), "{seed}");
        held += usize::from(after[1] < 2.0 * stated && after[0] < 2.0 * parts);
        worse += usize::from(after[1] > 1.01 * before[1] || after[0] > 1.01 * before[0]);
    }
    println!(
        "{held} of {campaigns} within 2 stated standard uncertainties, {worse} farther from the truth than before"
    );
    assert!(held as u64 >= campaigns - 1, "{held} of {campaigns}");
    assert_eq!(worse, 0, "farther from the truth than before");
}

#[test]
fn with_a_bound_on_the_slide_single_traces_are_registered() {
    let mut campaign = ground(3, [1, 1]);
    campaign.traces[1].shift_mm = 0.15;
    // Nothing contradicts two traces: blind, with the bias, and a word on what is likely.
    let blind = diagnosed(&campaign, None);
    assert!(blind.diagnosis.added.is_empty());
    let listed = blind.diagnosis.blind_to.iter().find(|one| one.effect == "axial-registration").unwrap();
    assert_eq!(
        (listed.targets.as_slice(), listed.bias_per_unit.unit.as_str()),
        (&["reversed".to_owned()][..], "um/mm")
    );
    assert!(listed.bias_per_unit.value > 0.1, "{listed:?}");
    let hint = |warnings: &[String]| {
        warnings.iter().any(|one| one.contains("likely to be shifted by 0.1") && one.contains("slide_cutoff_mm"))
    };
    assert!(hint(&blind.diagnosis.warnings), "{:?}", blind.diagnosis.warnings);
    assert!(hint(&found_of(&run(&campaign, None)).cloned().collect::<Vec<_>>()));
    assert!(blind.after.slide_std_um.iter().all(|std| std.is_nan()));

    let found = diagnosed(&campaign, Some(25.0));
    println!("{:#?}", found.diagnosis.added);
    assert_eq!(named(&found.diagnosis), [["axial-registration reversed"]]);
    assert!(
        found.diagnosis.warnings.iter().any(|one| one.contains("a shift of all traces together is not observable"))
    );
    assert!((found.diagnosis.added[0].parameters[0].value - 0.15).abs() < 0.01);
    assert!(found_of(&run(&campaign, Some(25.0))).any(|found| found.contains("axial shifts")));
    let (before, after) = (errors(&campaign, &run(&campaign, None)), errors(&campaign, &found.after));
    println!("{before:?} → {after:?}, stated {} {}", rms(&found.after.part_std_um), rms(&found.after.slide_std_um));
    assert!(after[1] < 0.5 * before[1]);
    assert!(after[1] < 3.0 * rms(&found.after.slide_std_um) && after[0] < 3.0 * rms(&found.after.part_std_um));
}

#[test]
fn traces_that_lack_nothing_raise_no_alarm() {
    for (seed, (repeats, cutoff)) in
        [([3, 3], None), ([2, 2], None), ([4, 1], None), ([1, 1], Some(25.0)), ([3, 2], Some(25.0))]
            .into_iter()
            .cycle()
            .take(trials(20))
            .enumerate()
    {
        let campaign = ground(40 + seed as u64, repeats);
        let found = diagnosed(&campaign, cutoff);
        assert!(found.diagnosis.added.is_empty(), "{seed}: {:?}", named(&found.diagnosis));
        let ran = run(&campaign, cutoff);
        assert!(found_of(&ran).all(|found| !found.contains("shift")), "{seed}: {:?}", ran.checks);
    }
}

/// The traces agree better where their own waves meet, and best beyond the largest shift.
#[test]
fn a_wave_of_each_trace_is_no_shift() {
    for seed in 0..trials(9) as u64 {
        let mut campaign = ground(400 + seed, [3, 3]);
        (campaign.noise_um, campaign.length_mm, campaign.step_mm) = (0.05, 300.0, 2.0);
        campaign.part = vec![[1.2, 260.0, 0.7], [0.4, 90.0, 1.9], [0.15, 31.0, 0.2]];
        campaign.slide = vec![[1.0, 300.0, 1.1], [0.5, 110.0, 2.5]];
        for (trace, shot) in campaign.traces.iter_mut().enumerate() {
            shot.own = vec![[0.1, 15.0, 2.4 * (7 * seed + trace as u64) as f64]];
        }
        let names = named(&diagnosed(&campaign, None).diagnosis);
        println!("{seed}: {names:?}");
        assert!(!names.iter().flatten().any(|name| name.starts_with("axial-registration")), "{seed}: {names:?}");
    }
}

#[test]
fn other_effects_of_one_trace_are_named() {
    let cases: [(&str, Shot); 3] = [
        ("sensor-gain", Shot { gain: 0.06, ..Shot::default() }),
        ("part-tilt", Shot { bow_um: 0.4, ..Shot::default() }),
        ("thermal-drift", Shot { drift: [0.6, 0.15], ..Shot::default() }),
    ];
    for (effect, shot) in cases {
        let mut campaign = ground(7, [3, 3]);
        campaign.traces[2] = shot;
        let found = diagnosed(&campaign, None);
        let names = named(&found.diagnosis);
        println!("{effect}: {names:?} {:?}", found.diagnosis.added.first().map(|one| &one.parameters));
        assert!(names.len() == 1 && names[0].contains(&format!("{effect} initial-3")), "{effect}: {names:?}");
        let (before, after) = (errors(&campaign, &run(&campaign, None)), errors(&campaign, &found.after));
        assert!(after[1] <= 1.01 * before[1] && after[0] <= 1.01 * before[0], "{effect}: {before:?} {after:?}");
    }
}

/// A drift linear in time is a slope of its trace, and every trace has one: neither seen nor of any effect.
#[test]
fn a_linear_drift_is_a_slope() {
    let campaign = ground(9, [2, 2]);
    let mut points = campaign.points();
    let plain = separator(None).separated(&points).unwrap();
    for (row, reading) in points.columns[1].values.iter_mut().enumerate() {
        *reading += 0.004 * row as f64;
    }
    let drifting = separator(None).separated(&points).unwrap();
    let differ = plain.slide_um.iter().zip(&drifting.slide_um).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
    // 1e-9 µm: rounding of readings near 30 µm, interpolated.
    assert!(differ < 1e-9, "{differ}");
}

#[test]
fn flagged_points_are_left_out() {
    let mut campaign = ground(11, [3, 2]);
    let clean = run(&campaign, None);
    campaign.traces[1].chip = true;
    let flagged = run(&campaign, None);
    assert!(
        flagged.warnings.iter().any(|warning| warning.contains("left out by their flag: initial-2 20")),
        "{:?}",
        flagged.warnings
    );
    assert!(flagged.warnings.iter().any(|warning| warning.contains("trace initial-2 has no points from")));
    let (before, after) = (errors(&campaign, &clean), errors(&campaign, &flagged));
    println!("{before:?} {after:?}");
    assert!(after.iter().zip(before).all(|(after, before)| *after < 1.2 * before), "{before:?} {after:?}");
    let mut points = campaign.points();
    points.columns.pop();
    let chipped = separator(None).separated(&points).unwrap();
    assert!(errors(&campaign, &chipped)[1] > 5.0 * after[1], "without the flag the chip is in the result");
    // The loop does not see it either.
    assert!(diagnosed(&campaign, None).diagnosis.added.is_empty());
}
