//! A part with a keyway beside the same part without, recorded in time and run from file to values.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{num::NonZeroUsize, path::Path};

use runout_core::{
    closed_loop::diagnosis::Verdict,
    evaluate::Value,
    measurement::Recording,
    pipeline::{
        INCLUDE_KEY, Pipeline, Registry,
        diagnose::diagnose,
        document::Sources,
        run::{Silent, run},
    },
    rig::Gaps,
    standards::{
        reference::Reference,
        roundness::{Angles, Points},
    },
    summary::Summary,
};
use runout_hdf5::{WriteOptions, write_measurement};
use runout_spindle::simulate::{SpindleConfig, SpindleSimulator, simulator};

const RIG: &str = r#"
    [rig]
    part_radius_mm = 30
    sensors = [
      { id = "S1", angle_deg = 0,  z_mm = 200, section = "a" },
      { id = "S2", angle_deg = 90, z_mm = 200, section = "a" },
      { id = "S3", angle_deg = 0,  z_mm = 230, section = "b" },
      { id = "S4", angle_deg = 90, z_mm = 230, section = "b" },
    ]
    setups = [
      { id = "initial" },
      { id = "turned", part_deg = 99.844 },
      { id = "further", part_deg = 202.5 },
    ]
"#;
const RECORDING: &str = r#"
    [recording]
    revolutions = 40
    samples_per_rev = 1024
    format = "i16"
    range_um = 60
    [recording.stations]
    count = 2
    [form]
    rms_um = 2
    max_order = 30
    [motion]
    x_rms_um = 1
    y_rms_um = 1
    [eccentricity]
    offset_um = 8
    [noise]
    rms_um = 0.05
"#;
/// 300 µm are beyond the converter's range: the readings clip.
const KEYWAY: &str = "[[form.keyways]]\nfrom_deg = 352\nto_deg = 4\ndepth_um = 300\n";
const INTERRUPTED: &str = "interruptions = [{ from_deg = 351.5, to_deg = 4.5 }]\n";
const STAGES: &str = r#"
    [[preprocess]]
    plugin = "synchronous-average"
    samples_per_rev = 512
    [separate]
    plugin = "harmonic-least-squares"
    [evaluate]
    values = ["roundness", "texture", "cylindricity"]
    references = ["LSCI", "MZCI"]
    filter_upr = [50]
"#;

fn simulated(recording: &str, keyway: &str) -> SpindleSimulator {
    let config: SpindleConfig = toml::from_str(&format!("seed = 3\n{RIG}\n{recording}\n{keyway}")).unwrap();
    simulator(&config).unwrap()
}

fn summary(folder: &Path, name: &str, keyway: &str, interruptions: &str) -> Summary {
    summary_of(folder, name, [RECORDING, keyway, interruptions, STAGES])
}

fn summary_of(folder: &Path, name: &str, parts: [&str; 4]) -> Summary {
    run(&pipeline_of(folder, name, parts), NonZeroUsize::new(2), &Silent).unwrap()
}

fn pipeline_of(folder: &Path, name: &str, [recording, keyway, interruptions, stages]: [&str; 4]) -> Pipeline {
    let mut registry = Registry::default();
    runout_hdf5::register(&mut registry);
    runout_preprocess::register(&mut registry);
    runout_spindle::register(&mut registry);
    let simulator = simulated(recording, keyway);
    let path = folder.join(format!("{name}.h5"));
    write_measurement(&simulator.spindle_recording(), simulator.rig(), &path, &WriteOptions::default(), &mut |_| {})
        .unwrap();
    let text = format!(
        "{RIG}{interruptions}\n[load]\nplugin = \"hdf5\"\npath = \"{name}.h5\"\n{stages}\n\
         [[export]]\nplugin = \"hdf5\"\npath = \"{name}-result.h5\"\n"
    );
    let sources = Sources::from_text("pipeline.toml", &text, folder.to_owned(), &[], INCLUDE_KEY).unwrap();
    Pipeline::from_sources(&sources, &registry).unwrap()
}

fn values(summary: &Summary) -> Vec<&Value> {
    let sections = summary.stations.iter().flat_map(|station| &station.sections);
    sections.flat_map(|section| &section.values).chain(summary.part.iter().flat_map(|part| &part.values)).collect()
}

#[test]
fn a_keyway_is_left_out_of_every_value_and_each_says_so() {
    let folder = tempfile::tempdir().unwrap();
    let whole = summary(folder.path(), "whole", "", "");
    let masked = summary(folder.path(), "masked", "", INTERRUPTED);
    let grooved = summary(folder.path(), "grooved", KEYWAY, INTERRUPTED);
    let coverage = 1.0 - 13.0 / 360.0;
    assert!(values(&whole).iter().all(|value| (value.coverage - 1.0).abs() < 1e-12));
    assert_eq!(values(&masked).len(), values(&grooved).len());
    assert!(values(&grooved).len() > 30);
    for (one, other) in values(&masked).iter().zip(values(&grooved)) {
        assert_eq!((&one.symbol, &one.filter), (&other.symbol, &other.filter));
        assert!((other.coverage - coverage).abs() < 3e-3, "{}: {}", other.symbol, other.coverage);
        let uncertainty = one.uncertainty.as_ref().unwrap();
        println!(
            "{} {}: {:.4} and {:.4}, std {:.4}",
            one.symbol,
            one.filter.as_deref().unwrap(),
            one.value,
            other.value,
            uncertainty.std
        );
        // The same readings but for the keyway: what bridging it changes is of the size of the uncertainty.
        let apart = (one.value - other.value).abs();
        assert!(apart < 3.0 * uncertainty.std + 0.01 * one.value, "{}: {} and {}", one.symbol, one.value, other.value);
    }
    // What is known of the part besides the keyway is the truth.
    let simulator = simulated(RECORDING, KEYWAY);
    let recording = simulator.spindle_recording();
    let mut gaps = Gaps::default();
    gaps.add(351.5_f64.to_radians(), 13_f64.to_radians());
    for (index, station) in grooved.stations.iter().enumerate() {
        let truth = recording.truth(index).unwrap().unwrap();
        for (section, form_um) in station.sections.iter().zip(truth.form_um) {
            let mut form_um = form_um;
            gaps.blank(&mut form_um);
            let mut points = Points::default();
            points.set_profile(&Angles::equal(form_um.len()), &form_um, 30.0);
            let truth = points.values(&points.reference(Reference::LeastSquares).unwrap());
            let found = |symbol: &str| section.values.iter().find(|value| value.symbol == symbol).unwrap();
            for (value, truth) in [(found("RONt"), truth.ront_um), (found("RONq"), truth.ronq_um)] {
                let uncertainty = value.uncertainty.as_ref().unwrap();
                println!("{}: {:.4}, truth {truth:.4}, std {:.4}", value.symbol, value.value, uncertainty.std);
                assert!((value.value - truth).abs() < 3.0 * uncertainty.std, "{value:?}, not {truth}");
                // The edges of the keyway are known to a sample, which the uncertainty holds; no more than that.
                assert!(uncertainty.std < 0.01 * truth, "{uncertainty:?}");
            }
        }
        // The other readings say what the axis does while a sensor looks into the keyway.
        assert!(station.chi2_per_dof.unwrap() < 1.3, "{:?}", station.chi2_per_dof);
    }

    // No turn is lost to readings that the keyway drives to the converter's end.
    let used = |summary: &Summary| -> Vec<usize> {
        summary.stations.iter().flat_map(|station| &station.captures).map(|capture| capture.turns_used).collect()
    };
    assert_eq!(used(&masked), used(&grooved));

    // Without the rig's word, the keyway is form.
    let mistaken = summary(folder.path(), "mistaken", &KEYWAY.replace("300", "30"), "");
    let ront = |summary: &Summary| values(summary).iter().find(|value| value.symbol == "RONt").unwrap().value;
    assert!(ront(&mistaken) > 3.0 * ront(&whole), "{} and {}", ront(&mistaken), ront(&whole));
}

/// An effect that is found beside a keyway has the size that it has: hidden readings follow the model that has it.
#[test]
fn an_effect_is_found_beside_a_keyway() {
    let folder = tempfile::tempdir().unwrap();
    let recording = RECORDING.replace("count = 2", "count = 1").replace("max_order = 30", "max_order = 20");
    let effect = "[[effect]]\nplugin = \"reversal-angle\"\ntargets = [\"turned\"]\nangle_deg = 0.3\n";
    let stages = STAGES.replace("samples_per_rev = 512", "samples_per_rev = 128");
    let pipeline =
        pipeline_of(folder.path(), "shifted", [&recording, &format!("{KEYWAY}{effect}"), INTERRUPTED, &stages]);
    let found = diagnose(&pipeline, NonZeroUsize::new(1), &Silent).unwrap();
    let [added] = &found.added[..] else { panic!("{:?} {:?}", found.added, found.refused) };
    let angle = &added.parameters[0];
    println!("{} {} ± {:?}", added.effect, angle.value, angle.std);
    assert_eq!((added.effect.as_str(), found.verdict), ("reversal-angle", Verdict::Explained));
    assert!((angle.value - 0.3).abs() < 4.0 * angle.std.unwrap(), "{angle:?}");
}

/// A speed that wobbles by 0.1 % puts marks and angles between samples: interpolation, and a low-pass before it, do not take
/// the keyway to angles beside it.
#[test]
fn a_keyway_between_samples_stays_where_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let recording = RECORDING.replace(
        "samples_per_rev = 1024",
        "samples_per_rev = 512\n    speed_wobble_percent = 0.1\n    speed_rpm = 500",
    );
    // The edges are those of the keyway.
    let interrupted = "interruptions = [{ from_deg = 352, to_deg = 4 }]\n";
    let filtered = format!("[[preprocess]]\nplugin = \"low-pass\"\ncutoff_hz = 1000\n{STAGES}");
    for (name, stages) in [("plain", STAGES), ("filtered", &filtered)] {
        let [masked, grooved] = ["", KEYWAY].map(|keyway| {
            let name = format!("{name}-{}", if keyway.is_empty() { "masked" } else { "grooved" });
            summary_of(folder.path(), &name, [&recording, keyway, interrupted, stages])
        });
        assert_eq!(values(&masked).len(), values(&grooved).len());
        for (one, other) in values(&masked).iter().zip(values(&grooved)) {
            // Where errors are too much of a slope, neither has an interval.
            assert_eq!(one.no_uncertainty, other.no_uncertainty);
            let std = one.uncertainty.as_ref().map_or(0.0, |uncertainty| uncertainty.std);
            let apart = (one.value - other.value).abs();
            println!(
                "{name}, {} {}: {:.4} and {:.4}",
                one.symbol,
                one.filter.as_deref().unwrap(),
                one.value,
                other.value
            );
            assert!(apart < std + 0.002 * one.value, "{}: {} and {}", one.symbol, one.value, other.value);
        }
    }
}
