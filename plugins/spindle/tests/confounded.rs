//! Effects between which the data do not decide: form is never farther from the truth than before, and form, motion and
//! values carry what is open, at any size. The data come from the time-domain simulator, which shares no formula with the
//! model.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::panic, reason = "tests")]

use crate::campaigns::{averaged, campaign};
use runout_core::{
    Complex64,
    closed_loop::{
        Settings,
        diagnosis::{Added, Verdict},
    },
    measurement::StationTruth,
    numerics::fourier::Fourier,
    separation::{Quantity, Separation},
    stage::StationDiagnosis,
    standards::roundness::ront_lsci_um,
};
use runout_spindle::{diagnose::diagnose, effects, layout::Layout, selection::Selection, simulate::SpindleConfig};

/// Orders that are compared: the simulated form's and motion's.
const BAND: std::ops::RangeInclusive<usize> = 2..=60;

/// Angles of the truth's RONt: as many as the estimate's, or more, so that neither misses crests.
const FINE_ANGLES: usize = 4096;

/// A diagnosis beside the truth.
struct Judged {
    found: StationDiagnosis,
    truth: StationTruth,
}

/// Root mean square error of an estimate and what it states, in µm or µrad.
#[derive(Clone, Copy)]
struct Compared {
    error: f64,
    stated: f64,
}

impl Compared {
    fn ratio(self) -> f64 {
        self.error / self.stated
    }
}

fn judged(config: &SpindleConfig) -> Judged {
    let rig = config.rig.clone().check().unwrap();
    let (station, truth) = averaged(config, &rig);
    let layout = Layout::new(&rig, false);
    let found =
        diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &Settings::default()).unwrap();
    Judged { found, truth }
}

/// Harmonics of a curve on equal angles.
fn harmonics(curve: &[f64]) -> Vec<Complex64> {
    let mut harmonics = vec![Complex64::ZERO; *BAND.end() + 1];
    Fourier::new(curve.len()).analyse(curve.iter().copied(), &mut harmonics);
    harmonics
}

/// Error and stated uncertainty over these quantities together.
fn compared(separation: &Separation, quantities: &[(Quantity, Vec<Complex64>)]) -> Compared {
    let (mut error, mut stated) = (0.0, 0.0);
    let width = separation.unknowns.len();
    for (quantity, truth) in quantities {
        let unknown = separation.position(*quantity).unwrap();
        for order in BAND {
            let index = order * width + unknown;
            if separation.observable[index] {
                error += 0.5 * (separation.estimate[index] - truth[order]).norm_sqr();
                stated += 0.5 * separation.variance_of(index);
            }
        }
    }
    let mean = |sum: f64| (sum / quantities.len() as f64).sqrt();
    Compared { error: mean(error), stated: mean(stated) }
}

impl Judged {
    fn forms(&self) -> Vec<(Quantity, Vec<Complex64>)> {
        let forms = self.truth.form_um.iter().enumerate();
        forms.map(|(section, curve)| (Quantity::Form(section), harmonics(curve))).collect()
    }

    fn motion(&self, index: usize) -> (Quantity, Vec<Complex64>) {
        let quantity = [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY][index];
        let curve = &self.truth.motion.as_ref().unwrap()[index];
        (quantity, harmonics(curve).iter().map(Complex64::conj).collect())
    }

    fn form(&self) -> [Compared; 2] {
        [&self.found.before, &self.found.after].map(|each| compared(&each[0], &self.forms()))
    }

    /// The largest error over stated uncertainty of one section's form, one motion, and one value.
    fn worst(&self) -> [f64; 3] {
        let after = &self.found.after[0];
        let form = self.forms().into_iter().map(|form| compared(after, &[form]).ratio()).fold(0.0, f64::max);
        let motion = (0..4).map(|index| compared(after, &[self.motion(index)]).ratio()).fold(0.0, f64::max);
        let moved = self.found.diagnosis.moved.iter().filter(|moved| moved.value == "RONt");
        let ront = moved
            .zip(&self.truth.form_um)
            .map(|(moved, curve)| (moved.after - ront_lsci_um(&fine(curve))).abs() / moved.std.unwrap());
        [form, motion, ront.fold(0.0, f64::max)]
    }

    fn set(&self, name: &str) -> Option<&Added> {
        let holds = |added: &&Added| named(added) == name || added.confounded_with.iter().any(|one| one == name);
        self.found.diagnosis.added.iter().find(holds)
    }
}

/// A curve on more angles.
fn fine(curve: &[f64]) -> Vec<f64> {
    let mut fourier = Fourier::new(curve.len());
    let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
    fourier.analyse(curve.iter().copied(), &mut harmonics);
    Fourier::new(FINE_ANGLES).synthesise(harmonics).to_vec()
}

/// "effect target".
fn named(added: &Added) -> String {
    std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ")
}

fn gain(sensor: &str, size: f64) -> String {
    format!(r#"{{"plugin":"sensor-gain","targets":["{sensor}"],"relative_gain":{size}}}"#)
}

fn angle(sensor: &str, size_deg: f64) -> String {
    format!(r#"{{"plugin":"sensor-angle","targets":["{sensor}"],"angle_deg":{size_deg}}}"#)
}

fn moved(setup: &str, ratio: f64) -> String {
    format!(r#"{{"plugin":"setup-motion-change","targets":["{setup}"],"ratio":{ratio}}}"#)
}

/// Part and sensors reversed instead of three part angles.
fn reversed(mut config: SpindleConfig) -> SpindleConfig {
    config.rig.setups.truncate(2);
    config.rig.setups[1].part_deg = 180.0;
    config.rig.setups[1].sensors_deg = 180.0;
    config
}

/// The sets hold what was planted, give no uncertainty of one member and say what decides; form is not farther from the truth
/// than before, and form, motion and RONt are within two stated standard uncertainties.
fn does_not_mislead(config: &SpindleConfig, planted: &[&str]) {
    let judged = judged(config);
    let [before, after] = judged.form();
    let worst = judged.worst();
    println!(
        "simulated, {planted:?}: form {:.4} → {:.4} ± {:.4} µm; form, motion, RONt: {worst:.2?} of what is stated",
        before.error, after.error, after.stated
    );
    assert_eq!(judged.found.diagnosis.verdict, Verdict::Explained, "{planted:?}");
    for name in planted {
        let set = judged.set(name).unwrap_or_else(|| panic!("{name}: {:?}", judged.found.diagnosis.added));
        if set.confounded_with.is_empty() {
            // Second order decides where an effect is large: then it is the right one.
            assert_eq!(named(set), *name);
            assert!(set.parameters.iter().all(|parameter| parameter.std.is_some()), "{set:?}");
        } else {
            assert!(set.distinguished_by.is_some(), "{set:?}");
            assert!(set.parameters.iter().all(|parameter| parameter.std.is_none()), "{set:?}");
        }
    }
    assert!(after.error <= 1.01 * before.error, "{planted:?}: {} → {}", before.error, after.error);
    assert!(worst.iter().all(|ratio| *ratio < 2.0), "{planted:?}: {worst:?}");
}

#[test]
fn a_gain_of_any_size_does_not_mislead() {
    for (seed, sensor, size) in [(4, "S4", -0.05), (4, "S4", -0.10), (5, "S3", 0.10), (6, "S2", 0.01), (7, "S1", -0.03)]
    {
        does_not_mislead(&campaign(seed, &format!("[{}]", gain(sensor, size))), &[&format!("sensor-gain {sensor}")]);
    }
    does_not_mislead(&reversed(campaign(8, &format!("[{}]", gain("S2", 0.07)))), &["sensor-gain S2"]);
}

#[test]
fn an_angle_of_any_size_does_not_mislead() {
    for (seed, sensor, size) in [(1, "S3", 2.0), (2, "S2", -0.5), (3, "S1", 0.05)] {
        does_not_mislead(&campaign(seed, &format!("[{}]", angle(sensor, size))), &[&format!("sensor-angle {sensor}")]);
    }
    does_not_mislead(&reversed(campaign(4, &format!("[{}]", angle("S4", -1.0)))), &["sensor-angle S4"]);
}

/// Angle and delay of either sensor of a section explain as much: none of them is left out of the set, however many candidates there are.
#[test]
fn a_delay_of_any_size_does_not_mislead() {
    for (seed, sensor, delay_us) in [(1, "S4", -184.9), (2, "S1", 60.0), (3, "S3", 15.0)] {
        let delay = format!(r#"[{{"plugin":"channel-delay","targets":["{sensor}"],"delay_us":{delay_us}}}]"#);
        does_not_mislead(&reversed(campaign(seed, &delay)), &[&format!("channel-delay {sensor}")]);
    }
}

#[test]
fn two_sets_together_do_not_mislead() {
    let effects = format!("[{},{}]", gain("S1", -0.05), gain("S3", 0.08));
    does_not_mislead(&campaign(1, &effects), &["sensor-gain S1", "sensor-gain S3"]);
    let effects = format!("[{},{}]", gain("S4", 0.1), angle("S3", -1.0));
    does_not_mislead(&campaign(2, &effects), &["sensor-gain S4", "sensor-angle S3"]);
}

#[test]
fn a_set_beside_an_effect_that_is_decided_does_not_mislead() {
    let effects = format!("[{},{}]", gain("S4", -0.07), moved("b", 0.9));
    does_not_mislead(&campaign(3, &effects), &["sensor-gain S4"]);
}

/// A sweep over sizes, sensors and pairs; prints one line a campaign. `cargo test … -- --ignored --nocapture sweep`.
#[test]
#[ignore = "some hundred campaigns"]
#[allow(clippy::too_many_lines, reason = "a list of cases")]
fn sweep() {
    let mut cases: Vec<(String, bool, String)> = Vec::new();
    let wanted = std::env::var("SWEEP").unwrap_or_default();
    let axial = |sensor: &str, size: f64| {
        format!(r#"{{"plugin":"sensor-axial-position","targets":["{sensor}"],"shift_mm":{size}}}"#)
    };
    let bent = |sensor: &str, size: f64| {
        format!(r#"{{"plugin":"sensor-nonlinearity","targets":["{sensor}"],"quadratic_per_um":{size}}}"#)
    };
    let clamped = |size: f64| format!(r#"{{"plugin":"reversal-angle","targets":["b"],"angle_deg":{size}}}"#);
    for turned in [false, true] {
        for sensor in ["S1", "S2", "S3", "S4"] {
            for size in [0.001, 0.01, 0.03, -0.05, 0.07, -0.10, 0.10] {
                cases.push((format!("gain {sensor} {size}"), turned, gain(sensor, size)));
            }
            for size in [0.01, -0.1, 0.5, -1.0, 2.0] {
                cases.push((format!("angle {sensor} {size}"), turned, angle(sensor, size)));
            }
            for size in [0.3, 3.0] {
                cases.push((format!("axial {sensor} {size}"), turned, axial(sensor, size)));
            }
        }
        for (a, b) in [("S1", "S3"), ("S2", "S1"), ("S4", "S3"), ("S3", "S4")] {
            for (g, d) in [(-0.05, 0.3), (0.1, -1.0), (0.01, 0.05)] {
                cases.push((
                    format!("pair gain {a} {g}, angle {b} {d}"),
                    turned,
                    format!("{},{}", gain(a, g), angle(b, d)),
                ));
            }
            cases.push((
                format!("pair gain {a} -0.05, gain {b} 0.08"),
                turned,
                format!("{},{}", gain(a, -0.05), gain(b, 0.08)),
            ));
            cases.push((
                format!("pair angle {a} -0.5, angle {b} 0.8"),
                turned,
                format!("{},{}", angle(a, -0.5), angle(b, 0.8)),
            ));
            cases.push((
                format!("pair gain {a} -0.05, bent {b} 0.002"),
                turned,
                format!("{},{}", gain(a, -0.05), bent(b, 0.002)),
            ));
            cases.push((
                format!("pair gain {a} 0.08, clamped 0.34"),
                turned,
                format!("{},{}", gain(a, 0.08), clamped(0.34)),
            ));
            cases.push((
                format!("pair gain {a} 0.08, moved 0.9"),
                turned,
                format!("{},{}", gain(a, 0.08), moved("b", 0.9)),
            ));
            cases.push((
                format!("pair angle {a} 0.5, moved 0.9"),
                turned,
                format!("{},{}", angle(a, 0.5), moved("b", 0.9)),
            ));
        }
    }
    for seed in 0..20 {
        cases.push((format!("clean {seed}"), seed % 2 == 0, String::new()));
    }
    for (number, (name, turned, effects)) in cases.iter().enumerate() {
        if !name.starts_with(&wanted) {
            continue;
        }
        let mut config = campaign(number as u64 + 1, &format!("[{effects}]"));
        if *turned {
            config = reversed(config);
        }
        let start = std::time::Instant::now();
        let judged = judged(&config);
        let [before, after] = judged.form();
        let [form, motion, ront] = judged.worst();
        let diagnosis = &judged.found.diagnosis;
        let added: Vec<String> = diagnosis
            .added
            .iter()
            .map(|added| {
                format!(
                    "{} {} {:?} {:?}",
                    added.effect,
                    added.targets.join(" "),
                    added.confounded_with,
                    added.parameters.iter().map(|one| one.value).collect::<Vec<_>>()
                )
            })
            .collect();
        println!(
            "{}{name}{}: {:?} {:.4} → {:.4} ± {:.4}, ratio {:.3}, worst form {form:.2} motion {motion:.2} RONt {ront:.2}, χ² {:.2} → {:.2}, {} ms, {}",
            if after.error > 1.01 * before.error {
                "WORSE "
            } else if form.max(motion).max(ront) > 2.0 {
                "SMALL "
            } else {
                ""
            },
            if *turned { ", reversed" } else { "" },
            diagnosis.verdict,
            before.error,
            after.error,
            after.stated,
            after.error / before.error,
            diagnosis.before.chi2_per_dof.unwrap(),
            diagnosis.after.chi2_per_dof.unwrap(),
            start.elapsed().as_millis(),
            added.join("; ")
        );
        if ront > 2.0 {
            for (moved, curve) in
                diagnosis.moved.iter().filter(|moved| moved.value == "RONt").zip(&judged.truth.form_um)
            {
                println!(
                    "    RONt {:?}: {:.4} → {:.4} ± {:.4}, truth {:.4}",
                    moved.section,
                    moved.before,
                    moved.after,
                    moved.std.unwrap(),
                    ront_lsci_um(curve)
                );
            }
        }
        if diagnosis.verdict != Verdict::Explained {
            println!("    refused {:?}", diagnosis.refused);
        }
    }
}
