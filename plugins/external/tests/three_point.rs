//! The three-point separator of examples/26-own-program beside the built-in one.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::path::Path;

use crate::support::{of_repository, pipeline, python, registry, rig};
use runout_core::pipeline::{
    compare::{Comparing, Comparison},
    run::{Observer, Silent},
};

fn script() -> String {
    of_repository("examples/26-own-program/three_point.py").display().to_string()
}

fn compared(python: &str, script: &str, rotation: &str, observer: &dyn Observer) -> Comparison {
    let stages = format!(
        "[separate]\nplugin = \"three-point\"\nsecond_order = false\n\
         [[compare]]\nplugin = \"external\"\ncommand = [{python:?}, {script:?}]\n"
    );
    let mut pipeline = pipeline(Path::new(""), &rig(rotation), &stages);
    let comparing = Comparing::new(&mut pipeline, &[], &registry(), Path::new("")).unwrap();
    let mut stations = Vec::new();
    let take = |station| {
        stations.push(station);
        Ok(())
    };
    let mut comparison = comparing.run(None, observer, Vec::new(), take).unwrap();
    comparison.stations = stations;
    comparison
}

#[test]
fn a_program_is_equal_to_the_same_method_that_is_built_in() {
    let Some(python) = python() else { return };
    for rotation in ["ccw", "cw"] {
        let comparison = compared(&python, &script(), rotation, &Silent);
        assert_eq!(comparison.stations.len(), 3);
        let (mut worst, mut harmonics) = (0.0_f64, 0);
        for quantity in comparison.stations.iter().flat_map(|station| &station.quantities) {
            let [built_in, external] = &quantity.values[..] else { panic!("{} of one method only", quantity.quantity) };
            for order in 1..built_in.harmonics.re.len() {
                let of = |all: &[Option<f64>]| all[order];
                let [a, b] = [built_in, external].map(|one| of(&one.harmonics.re).zip(of(&one.harmonics.im)));
                assert_eq!(a.is_some(), b.is_some(), "{} of order {}: a lost order", quantity.quantity, order + 1);
                let (Some(a), Some(b)) = (a, b) else { continue };
                worst = worst.max((a.0 - b.0).abs()).max((a.1 - b.1).abs());
                harmonics += 1;
                // That of the built-in method is smoothed over orders.
                let ratio = of(&external.harmonics.std).unwrap() / of(&built_in.harmonics.std).unwrap();
                assert!((0.2..5.0).contains(&ratio), "± {ratio} of the built-in at order {}", order + 1);
            }
            let difference = &quantity.differences[0];
            assert!(difference.orders_compared > 30 && difference.expected_rms.is_none() && difference.worst.is_none());
        }
        println!("{rotation}: {harmonics} harmonics of 3 stations differ by at most {worst:.1e} µm");
        assert!(worst < 1e-9 && harmonics > 400);
        let notes = comparison.methods[1].notes.join("; ");
        assert!(notes.contains("E_n against an external separator is not known"), "{notes}");
    }
}

/// One process serves all stations, and what it writes to stderr reaches who watches.
#[test]
fn one_process_serves_all_stations_and_is_heard() {
    struct Heard(std::sync::Mutex<Vec<String>>);
    impl Observer for Heard {
        fn message(&self, text: &str) {
            self.0.lock().unwrap().push(text.to_owned());
        }
    }
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(script()).unwrap();
    let text = text.replace(
        "    answer(pa.table({",
        "    print(\"\\x1b[2J done\", file=sys.stderr, flush=True)\n    answer(pa.table({",
    );
    let script = folder.path().join("talks.py");
    std::fs::write(
        &script,
        "import os, pathlib\npathlib.Path(__file__ + str(os.getpid())).touch()\n".to_owned() + &text,
    )
    .unwrap();
    let heard = Heard(std::sync::Mutex::new(Vec::new()));
    compared(&python, &script.display().to_string(), "ccw", &heard);
    let heard = heard.0.into_inner().unwrap();
    assert!(!heard.is_empty() && heard.iter().all(|text| text == "[2J done"), "{heard:?}");
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2, "the script, and one process");
}

#[test]
fn without_std_there_is_no_uncertainty_and_a_reason() {
    let Some(python) = python() else { return };
    let folder = tempfile::tempdir().unwrap();
    let text = std::fs::read_to_string(script()).unwrap();
    let text = text.replace(", \"std\": pa.array(std.ravel(), pa.float64(), mask=lost.ravel())", "");
    std::fs::write(folder.path().join("own.py"), text).unwrap();
    let stages = format!(
        "[separate]\nplugin = \"external\"\ncommand = [{python:?}, \"own.py\"]\nconfig = {{ max_noise_gain = 3 }}\n\
         [[export]]\nplugin = \"parquet\"\npath = \"out\"\n"
    );
    let summary = pipeline(folder.path(), &rig("ccw"), &stages).run().unwrap();
    let text = summary.warnings.join("\n");
    assert!(text.contains("the separator gives no `std`: there is no ±"), "{text}");
    let station = &summary.stations[0];
    assert!(station.sections[0].form_std_um.is_none() && !station.sections[0].values.is_empty(), "{station:?}");
    assert!(station.sections[0].values.iter().all(|value| value.uncertainty.is_none()), "no ± where none is known");
    // Lost by the key of its own: they are said.
    assert!(!summary.lost_orders.form.is_empty(), "{:?}", summary.lost_orders);
    assert!(folder.path().join("out/harmonics.parquet").is_file());
}
