//! The closed loop and the corrected angle on signals simulated in the time domain: two signals with offsets, gains, a quadrature
//! error and harmonics of their own, noise, and a rotation that is not even. Nothing here is shared with the model.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{
    f64::consts::{PI, TAU},
    fmt::Write,
    path::{Path, PathBuf},
};

use arrow_array::{Array, cast::AsArray, types::Float64Type};
use runout_core::{
    closed_loop::{
        self,
        diagnosis::{Diagnosis, Verdict},
    },
    pipeline::{Pipeline, Registry, diagnose::diagnose, document::Sources, run::Silent},
    points::Points,
    stage::{LinearModel, PointSeparator},
};
use runout_quadrature::{Quadrature, QuadratureConfig};

use crate::trials::{fewest, trials};

struct Random(u64);

impl Random {
    fn uniform(&mut self) -> f64 {
        self.0 = self.0.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
        ((self.0 >> 11) as f64 + 0.5) / (1_u64 << 53) as f64
    }

    fn normal(&mut self) -> f64 {
        (-2.0 * self.uniform().ln()).sqrt() * (TAU * self.uniform()).cos()
    }
}

/// One signal: offset, and amplitude and phase of each harmonic from the first.
#[derive(Debug, Clone, Default)]
struct Channel {
    offset: f64,
    harmonics: Vec<(f64, f64)>,
}

impl Channel {
    fn at(&self, angle: f64) -> f64 {
        let waves = self.harmonics.iter().zip(1..);
        self.offset + waves.map(|((size, phase), order)| size * (f64::from(order) * angle + phase).cos()).sum::<f64>()
    }
}

/// Cosine and sine of 500 counts; the sine lags a quarter turn.
fn perfect() -> [Channel; 2] {
    [0.0, -0.5 * PI]
        .map(|phase| Channel { offset: 0.0, harmonics: vec![(500.0, phase), (0.0, 0.0), (0.0, 0.0), (0.0, 0.0)] })
}

struct Recording {
    csv: String,
    true_rad: Vec<f64>,
    phase_rad: Vec<f64>,
}

/// Samples equal in time of a rotation of 40 periods that is up to 30 % too fast or too slow within each.
fn recorded(channels: &[Channel; 2], noise: f64, reference: bool, random: &mut Random) -> Recording {
    let count = 4_000;
    let [ripple, at] = [0.3 * random.uniform(), TAU * random.uniform()];
    let mut recording = Recording { csv: "time_s,phase_deg,radius_counts".into(), true_rad: vec![], phase_rad: vec![] };
    recording.csv.push_str(if reference { ",reference_deg\n" } else { "\n" });
    for sample in 0..count {
        let time = f64::from(sample) / f64::from(count);
        let even = 40.0 * TAU * time;
        let angle = even + ripple * (even + at).sin() + 3.0 * (TAU * time).sin();
        let [x, y] = [0, 1].map(|channel: usize| channels[channel].at(angle) + noise * random.normal());
        let phase = y.atan2(x);
        write!(recording.csv, "{time},{},{}", phase.to_degrees(), x.hypot(y)).unwrap();
        if reference {
            // Another zero than the signal's.
            write!(recording.csv, ",{}", (angle + 1.3).to_degrees()).unwrap();
        }
        recording.csv.push('\n');
        recording.true_rad.push(angle);
        recording.phase_rad.push(phase);
    }
    recording
}

/// Root mean square of angles less the truth, without their mean, in rad.
fn error_rms(angles: &[f64], truth: &[f64]) -> f64 {
    let wrap = |angle: f64| (angle + PI).rem_euclid(TAU) - PI;
    let off: Vec<f64> = angles.iter().zip(truth).map(|(angle, truth)| wrap(angle - truth)).collect();
    let mean = off.iter().sum::<f64>() / off.len() as f64;
    (off.iter().map(|off| (off - mean).powi(2)).sum::<f64>() / off.len() as f64).sqrt()
}

fn model(blocks: usize, max_order: usize) -> Quadrature {
    QuadratureConfig { blocks, max_order }.model().unwrap()
}

fn load(path: &Path) -> Points {
    runout_points::read(path, &model(50, 6).columns()).unwrap()
}

/// The diagnosis, and root mean squares of the angle in rad: error before, error after, stated.
fn corrected(recording: &Recording, effects: Option<&[&str]>) -> (Diagnosis, [f64; 3]) {
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &recording.csv).unwrap();
    let points = load(file.path());
    let model = model(50, 6);
    let effects = effects.map(|ids| ids.iter().map(|id| (*id).to_owned()).collect::<Vec<_>>());
    let terms = model.terms(&points).unwrap().considering(effects.as_deref());
    let settings = closed_loop::Settings { effects, max_added: 20, ..closed_loop::Settings::default() };
    let closed = closed_loop::diagnose(&terms, &settings).unwrap();
    let conclusion = model.outcome(&points, &closed.after).unwrap();
    let table = &conclusion.tables[0];
    assert_eq!(table.table, "angle");
    let column = |name: &str| {
        let column = table.rows.column_by_name(name).unwrap().as_primitive::<Float64Type>();
        column.values().iter().map(|degrees| degrees.to_radians()).collect::<Vec<f64>>()
    };
    assert_eq!(table.rows.column_by_name("time_s").unwrap().null_count(), 0);
    let stated = column("std_deg").iter().map(|std| std * std).sum::<f64>() / recording.true_rad.len() as f64;
    let errors = [&recording.phase_rad, &column("corrected_deg")].map(|angles| error_rms(angles, &recording.true_rad));
    (closed.diagnosis, [errors[0], errors[1], stated.sqrt()])
}

fn names(found: &Diagnosis) -> Vec<&str> {
    found.added.iter().map(|added| added.effect.as_str()).collect()
}

/// A pair with errors of every kind, each of a random size about `size` of the radius.
fn disturbed(size: f64, random: &mut Random) -> [Channel; 2] {
    let mut channels = perfect();
    for channel in &mut channels {
        channel.offset = 500.0 * size * random.normal();
        channel.harmonics[0].0 *= 1.0 + 0.5 * size * random.normal();
        channel.harmonics[0].1 += 0.5 * size * random.normal();
        for order in 1..4 {
            let share = size / (order + 1) as f64;
            channel.harmonics[order] = (500.0 * share * random.normal(), TAU * random.uniform());
        }
    }
    channels
}

#[test]
fn without_a_reference_the_angle_never_becomes_worse_and_its_uncertainty_holds() {
    let mut random = Random(1);
    let (mut held, mut worst, mut campaigns) = (0, 0.0_f64, 0);
    for campaign in 0..trials(60) {
        // A tenth of what is usual to five times as much.
        let size = [0.001, 0.003, 0.01, 0.02, 0.05][campaign % 5];
        let recording = recorded(&disturbed(size, &mut random), 0.5, false, &mut random);
        let (found, [before, after, stated]) = corrected(&recording, None);
        println!("size {size}: {before:.5} → {after:.5} ± {stated:.5} rad, {:?}", names(&found));
        worst = worst.max(after / before);
        held += usize::from(after <= 2.0 * stated);
        campaigns += 1;
        for added in &found.added {
            assert!(!added.confounded_with.is_empty(), "the radius alone decided {added:?}");
        }
    }
    println!("worst after / before {worst:.4}; {held} of {campaigns} within two standard uncertainties");
    assert!(worst <= 1.01, "{worst}");
    assert!(held >= fewest(campaigns, [57, 60], 0.97), "{held} of {campaigns}");
}

#[test]
fn an_offset_and_second_harmonics_are_one_set_that_a_reference_decides() {
    // As a Hall encoder beside its axis: no offset, second harmonics that only turn forward.
    let mut channels = perfect();
    channels[0].harmonics[1] = (12.0, 0.7);
    channels[1].harmonics[1] = (12.0, 0.7 - 0.5 * PI);
    let blind = recorded(&channels, 0.5, false, &mut Random(2));
    let (found, [before, after, stated]) = corrected(&blind, None);
    assert_eq!(names(&found)[0], "quadrature-offset");
    assert_eq!(found.added[0].confounded_with, ["harmonic-2-forward"]);
    assert!(found.added[0].distinguished_by.as_ref().unwrap().contains("reference_deg"));
    println!("{before:.5} → {after:.5} ± {stated:.5} rad");
    assert!(after <= 1.01 * before && after <= 2.0 * stated);
    let seen = recorded(&channels, 0.5, true, &mut Random(2));
    let (found, [before, after, stated]) = corrected(&seen, None);
    println!("with a reference: {before:.5} → {after:.5} ± {stated:.5} rad, {:?}", names(&found));
    assert_eq!(names(&found), ["harmonic-2-forward"]);
    assert!(found.added[0].confounded_with.is_empty());
    // 12 counts, forward: p = 12·e^{0.7i}, c = Re p, s = −Im p; five standard uncertainties.
    let truth = [12.0 * 0.7_f64.cos(), -12.0 * 0.7_f64.sin()];
    for (parameter, truth) in found.added[0].parameters.iter().zip(truth) {
        assert!((parameter.value - truth).abs() < 5.0 * parameter.std.unwrap(), "{parameter:?} instead of {truth}");
    }
    // Noise of 0.5 counts along the circle is 1 mrad.
    assert!(after < 0.1 * before && after < 1.1e-3 && after < 1.1 * stated && stated < 1.1 * after);
    // The held-out error is that of the angle, in counts along the circle.
    let [from, to] = [found.before.held_out_rms_um, found.after.held_out_rms_um].map(Option::unwrap);
    assert!((from / (500.0 * before) - 1.0).abs() < 0.05 && (to / (500.0 * after) - 1.0).abs() < 0.05, "{from} {to}");
}

#[test]
fn with_a_reference_every_campaign_becomes_better_and_its_uncertainty_holds() {
    let mut random = Random(3);
    let (mut held, campaigns) = (0, trials(30));
    for campaign in 0..campaigns {
        let size = [0.003, 0.01, 0.05][campaign % 3];
        let recording = recorded(&disturbed(size, &mut random), 0.5, true, &mut random);
        let (found, [before, after, stated]) = corrected(&recording, None);
        println!("size {size}: {before:.5} → {after:.5} ± {stated:.5} rad, {:?}", names(&found));
        assert!(after <= before, "{before} → {after}");
        assert!(found.after.held_out_rms_um <= found.before.held_out_rms_um);
        held += usize::from(after <= 1.2 * stated);
    }
    // Noise is all that is left, and known to some percent.
    assert!(held >= fewest(campaigns, [28, 30], 0.97), "{held} of {campaigns}");
}

#[test]
fn signals_that_are_known_to_be_sines_are_corrected_exactly() {
    let sines = ["quadrature-offset", "quadrature-gain-and-angle"];
    let mut random = Random(4);
    let mut far = [0, 0];
    for campaign in 0..20 {
        // Up to a tenth of the radius: first order alone would leave 5 counts.
        let size = [0.01, 0.03, 0.1][campaign % 3];
        let mut channels = perfect();
        let mut within = |size: f64| size * (2.0 * random.uniform() - 1.0);
        let [x, y, gain, angle] = [500.0 * size, 500.0 * size, size, size].map(&mut within);
        channels[0].offset = x;
        channels[1].offset = y;
        channels[1].harmonics[0] = (500.0 * (1.0 + gain), angle - 0.5 * PI);
        let recording = recorded(&channels, 0.5, false, &mut random);
        let (found, [before, after, stated]) = corrected(&recording, Some(&sines));
        println!("size {size}: {before:.5} → {after:.5} ± {stated:.5} rad");
        // Noise of 0.5 counts of 500.
        assert!(after < 1.1e-3 && after < 1.1 * stated && stated < 1.15 * after, "{found:?}");
        let truths = [("cosine", x), ("sine", y), ("gain_ratio_less_1", gain), ("angle_error", angle)];
        for parameter in found.added.iter().flat_map(|added| &added.parameters) {
            let truth = truths.iter().find(|(name, _)| *name == parameter.name).unwrap().1;
            far[1] += 1;
            far[0] += usize::from((parameter.value - truth).abs() > 2.0 * parameter.std.unwrap());
        }
    }
    println!("{} of {} parameters beyond two standard uncertainties", far[0], far[1]);
    assert!(far[1] > 60 && far[0] * 100 <= far[1] * 12, "{far:?}");
}

/// Ellipses far from a circle: offsets up to 0.7 of the radius, gain ratios of 0.4 to 1.6, quadrature angles up to 40°.
#[test]
fn strong_ellipses_are_corrected_exactly() {
    let sines = ["quadrature-offset", "quadrature-gain-and-angle"];
    let mut random = Random(6);
    let (mut far, mut all) = (0, 0);
    for (x, y, gain, degrees) in [
        (0.5, 0.0, 1.0, 0.0_f64),
        (0.3, -0.6, 1.0, 0.0),
        (0.0, 0.0, 0.4, 0.0),
        (0.05, 0.1, 1.6, 0.0),
        (0.0, 0.0, 1.0, 40.0),
        (0.2, 0.25, 0.7, -25.0),
    ] {
        let mut channels = perfect();
        channels[0].offset = 500.0 * x;
        channels[1].offset = 500.0 * y;
        channels[1].harmonics[0] = (500.0 * gain, degrees.to_radians() - 0.5 * PI);
        let recording = recorded(&channels, 1.0, false, &mut random);
        let (found, [before, after, stated]) = corrected(&recording, Some(&sines));
        println!("{x} {y} {gain} {degrees}°: {before:.5} → {after:.5} ± {stated:.5} rad, {:?}", found.after);
        assert!(after < 0.2_f64.to_radians() * 1.5 && after < 1.15 * stated && stated < 1.15 * after, "{found:?}");
        // The residual is the noise of the signals.
        assert!((found.after.residual_rms_um - 1.0).abs() < 0.06, "{:?}", found.after);
        let truths = [
            ("cosine", 500.0 * x),
            ("sine", 500.0 * y),
            ("gain_ratio_less_1", gain - 1.0),
            ("angle_error", degrees.to_radians()),
        ];
        for parameter in found.added.iter().flat_map(|added| &added.parameters) {
            let truth = truths.iter().find(|(name, _)| *name == parameter.name).unwrap().1;
            println!("  {} {} ± {:?}, truth {truth}", parameter.name, parameter.value, parameter.std);
            all += 1;
            far += usize::from((parameter.value - truth).abs() > 2.5 * parameter.std.unwrap());
        }
    }
    assert!(all > 14 && far <= 2, "{far} of {all}");
}

#[test]
fn what_an_effect_explains_that_was_not_chosen_stays_unexplained() {
    let mut random = Random(5);
    let mut channels = perfect();
    channels[1].harmonics[0].0 = 510.0;
    channels[0].harmonics[2] = (6.0, 0.4);
    let recording = recorded(&channels, 0.5, true, &mut random);
    let (all, _) = corrected(&recording, None);
    assert!(names(&all).contains(&"harmonic-3-forward"), "{:?}", names(&all));
    let (some, _) = corrected(&recording, Some(&["quadrature-gain-and-angle"]));
    assert_eq!(some.verdict, Verdict::Unexplained, "{:?}", names(&some));
    let is_named = |place: &str| place.contains("harmonic") && place.contains("none of the chosen `effects`");
    assert!(some.unexplained.iter().any(|left| is_named(&left.place)), "{:?}", some.unexplained);
}

#[test]
fn a_reference_that_does_not_follow_is_refused() {
    let file = tempfile::NamedTempFile::new().unwrap();
    let rows = (0..400).map(|row| format!("{row},500,{}\n", -row));
    let text: String = std::iter::once("phase_deg,radius_counts,reference_deg\n".to_owned()).chain(rows).collect();
    std::fs::write(file.path(), text).unwrap();
    let model = model(10, 4);
    let error = model.terms(&load(file.path())).unwrap_err();
    assert!(error.to_string().contains("does not follow phase_deg"), "{error}");
}

#[test]
fn the_pipeline_takes_exporters_of_tables_only() {
    let mut registry = Registry::default();
    runout_points::register(&mut registry);
    runout_quadrature::register(&mut registry);
    let recording = recorded(&perfect(), 0.5, false, &mut Random(5));
    let file = tempfile::NamedTempFile::new().unwrap();
    std::fs::write(file.path(), &recording.csv).unwrap();
    let text =
        format!("load = {{ plugin = 'points', path = '{}' }}\nseparate.plugin = 'quadrature'\n", file.path().display());
    let sources = Sources::from_text("test.toml", &text, PathBuf::new(), &[], "rig").unwrap();
    let found = diagnose(&Pipeline::from_sources(&sources, &registry).unwrap(), None, &Silent).unwrap();
    assert!(found.added.is_empty(), "{:?}", found.added);
    assert!(found.warnings.iter().any(|warning| warning.contains("standard uncertainty of one corrected angle")));
}
