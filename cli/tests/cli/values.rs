//! The standards' values of a run, and limits on the shop floor.

use serde_json::Value;

use crate::folder::{Folder, RIG, pipeline};

const SCENARIO: &str = r#"
plugin = "spindle"
seed = 5
output = "shaft.h5"
rig = "rig.toml"

[recording]
revolutions = 12
samples_per_rev = 256

[recording.stations]
count = 2

[form]
rms_um = 4
max_order = 20

[motion]
x_rms_um = 1.5
y_rms_um = 1.5

[noise]
rms_um = 0.05
"#;

/// Peaks of a form of 4 µm rms are some 10 to 25 µm apart.
const LIMITS: &str = r#"
[surface]
step_mm = 1

[evaluate]
values = ["roundness", "texture", "cylindricity", "areal"]
references = ["MZCI", "LSCI"]
filter_upr = [15]

[[limit]]
symbol = "RONt"
reference = "MZCI"
filter = "none"
upper = 100
unit = "um"

[[limit]]
symbol = "CYLt"
upper = 1
unit = "um"
"#;

fn campaign(text: &str) -> Folder {
    let text = pipeline() + text;
    let folder = Folder::with(&[("pipeline.toml", &*text), ("scenario.toml", SCENARIO), ("rig.toml", RIG)]);
    assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
    folder
}

#[test]
fn limits_are_decided_and_end_the_program_only_when_asked() {
    let folder = campaign(LIMITS);
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    let decisions: Vec<&Value> = summary["limits"].as_array().unwrap().iter().map(|one| &one["decision"]).collect();
    assert_eq!(decisions, ["conforms", "does-not-conform"]);
    assert_eq!(summary["limits"][0]["values"].as_array().unwrap().len(), 4, "two stations, two sections each");
    assert_eq!(summary["limits"][1]["values"].as_array().unwrap().len(), 4, "two references, two filters");
    let symbols: Vec<&Value> = summary["part"]["values"].as_array().unwrap().iter().map(|one| &one["symbol"]).collect();
    assert!(["CYLt", "Sa", "Sdr"].iter().all(|symbol| symbols.iter().any(|found| found == symbol)), "{symbols:?}");

    let failed = folder.run(&["run", "pipeline.toml", "--fail-on-limit", "--json"]);
    assert_eq!(failed.status, 1);
    assert!(failed.stderr.contains("not proven to be kept: CYLt ≤ 1 um"), "{}", failed.stderr);
    let document: Value = serde_json::from_str(&failed.stdout).unwrap();
    assert_eq!(document["limits"], summary["limits"]);
    let shown = folder.run(&["run", "pipeline.toml", "--fail-on-limit"]);
    assert_eq!(shown.status, 1);
    for word in ["Limits", "conforms", "does not conform", "The whole part", "Not proven to be kept"] {
        assert!(shown.stdout.contains(word), "no {word} in\n{}", shown.stdout);
    }

    let kept = folder.run(&["run", "pipeline.toml", "--fail-on-limit", "--set", "limit.1.upper=500"]);
    assert_eq!((kept.status, kept.stderr.as_str()), (0, ""));
    let table = folder.run(&["inspect", "out/values.parquet", "--json"]);
    assert!(table.stdout.contains("low_95"), "{}", table.stdout);
}

const CURVE: &str = r#"
[[limit]]
symbol = "amplitude"
section = "a"
orders = "2..30"
upper_curve = "3 / n"
unit = "um"

[[export]]
plugin = "csv"
path = "out/values.csv"

[[export]]
plugin = "figures"
path = "figures"
formats = ["svg"]
"#;

/// A form to order 20, of orders of which the layout loses some: each order has its own limit, and the worst comes first.
#[test]
fn a_limit_curve_is_decided_order_by_order() {
    let folder = campaign(CURVE);
    let ran = folder.run(&["run", "pipeline.toml", "--json"]);
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""));
    let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
    let values = summary["limits"][0]["values"].as_array().unwrap();
    assert_eq!(values.len(), 2 * 29, "two stations, orders 2 to 30");
    let mut worst = (0.0, 0);
    for value in values {
        let order = value["band_upr"][0].as_u64().unwrap();
        let upper = value["upper"].as_f64().unwrap();
        assert!((upper * order as f64 - 3.0).abs() < 1e-9, "{value}");
        let decision = value["decision"].as_str().unwrap();
        let Some(interval) = value["interval_95"].as_array() else {
            assert!(
                value["value"].is_null() && value["missing"].as_str().unwrap().contains("not observable"),
                "{value}"
            );
            assert_eq!(decision, "undecided");
            continue;
        };
        let [low, high] = [0, 1].map(|end| interval[end].as_f64().unwrap());
        let expected = if high <= upper {
            "conforms"
        } else if low > upper {
            "does-not-conform"
        } else {
            "undecided"
        };
        assert_eq!(decision, expected, "{value}");
        if high / upper > worst.0 {
            worst = (high / upper, order);
        }
    }
    assert!(worst.0 > 1.0, "a form of 4 µm rms breaks the curve: {worst:?}");
    let shown = folder.run(&["run", "pipeline.toml"]).stdout;
    let first = shown.lines().skip_while(|line| !line.contains("Not proven")).nth(1).unwrap();
    assert!(first.contains(&format!("order {}", worst.1)), "{worst:?} in {first}");
    assert!(shown.lines().nth(1).unwrap().contains("amplitude of orders 2..30 of section a ≤ 3 / n µm"), "{shown}");
    let csv = std::fs::read_to_string(folder.path().join("out/values.csv")).unwrap();
    let of_curve = csv.lines().filter(|line| line.contains("amplitude") && line.contains(",1.5,")).count();
    assert_eq!(of_curve, 2, "order 2 of two stations has the limit 1.5:\n{csv}");
    let drawn = std::fs::read_to_string(folder.path().join("figures/form-harmonics.svg")).unwrap();
    assert!(drawn.contains("limit of section a"));
    for (key, wrong, said) in [
        ("orders", "50..2", "ascending orders"),
        ("upper_curve", "3 / m", "found `m`"),
        ("upper_curve", "3 - n", "found 0 at order 3"),
    ] {
        let refused = folder.run(&["run", "pipeline.toml", "--set", &format!("limit.0.{key}={wrong}")]);
        assert!(refused.status == 2 && refused.stderr.contains(said), "{}", refused.stderr);
    }
}

/// A sharp edge has all orders, and 63 of them are solved for: what it has above is not known, and matters where no filter takes it away.
#[test]
fn a_limit_beside_an_edge_is_undecided_without_a_filter() {
    let harmonic =
        |order: u32| format!("{{ order = {order}, amplitude_um = {}, phase_deg = 90 }}", 2.0 / f64::from(order));
    let edge: Vec<String> = (2..=120).map(harmonic).collect();
    let edge = format!("rms_um = 0\nharmonics = [{}]", edge.join(", "));
    let limit = |filter: &str| {
        format!(
            "[[limit]]\nsymbol = \"RONt\"\nreference = \"MZCI\"\nfilter = \"{filter}\"\nupper = 100\nunit = \"um\"\n"
        )
    };
    for (form, unfiltered) in [("rms_um = 4\nmax_order = 20", "conforms"), (&*edge, "undecided")] {
        let text = pipeline()
            + "[evaluate]\nreferences = [\"MZCI\"]\nfilter_upr = [15]\n"
            + &limit("none")
            + &limit("Gaussian 15 UPR");
        let scenario = SCENARIO.replace("rms_um = 4\nmax_order = 20", form);
        let folder = Folder::with(&[("pipeline.toml", &*text), ("scenario.toml", &*scenario), ("rig.toml", RIG)]);
        assert_eq!(folder.run(&["simulate", "scenario.toml"]).status, 0);
        let ran = folder.run(&["run", "pipeline.toml", "--json"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        let summary: Value = serde_json::from_str(&ran.stdout).unwrap();
        let decisions = [0, 1].map(|limit| summary["limits"][limit]["decision"].as_str().unwrap());
        assert_eq!(decisions, [unfiltered, "conforms"], "{}", summary["limits"]);
    }
}

#[test]
fn warnings_end_the_program_only_when_asked() {
    let folder = campaign("");
    let sound = folder.run(&["run", "pipeline.toml", "--fail-on-warning"]);
    assert_eq!(sound.status, 0, "{}{}", sound.stdout, sound.stderr);
    let wrong = ["run", "pipeline.toml", "--set", "rig.sensors.0.sign=-1"];
    let warned = folder.run(&wrong);
    assert_eq!(warned.status, 0, "{}", warned.stderr);
    let failed = folder.run(&[&wrong[..], &["--fail-on-warning"]].concat());
    assert_eq!(failed.status, 1);
    assert!(failed.stderr.contains("--fail-on-warning"), "{}", failed.stderr);
    assert!(failed.stdout.contains("sensor-sign"), "the likely mistake is named\n{}", failed.stdout);
}

#[test]
fn what_cannot_be_evaluated_or_limited_has_a_place() {
    let folder = campaign("");
    let refused = |arguments: &[&str], words: &[&str]| {
        let ran = folder.run(&[&["run", "pipeline.toml"], arguments].concat());
        assert_eq!(ran.status, 2, "{}", ran.stderr);
        assert!(words.iter().all(|word| ran.stderr.contains(word)), "{}", ran.stderr);
    };
    refused(&["--fail-on-limit"], &["the pipeline has no limit", "[[limit]]"]);
    refused(&["--set", "evaluate.values=[\"roundnes\"]"], &["did you mean `roundness`"]);
    refused(&["--set", "evaluate.references=[\"LSC\"]"], &["did you mean `LSCI`"]);
    refused(&["--set", "evaluate.filter_upr=[0]"], &["above 0"]);
    refused(
        &["--set", "limit=[{ symbol = \"RONt\", unit = \"um\", upper = 1, section = \"c\" }]"],
        &["no value has the section `c`", "`a`"],
    );
    refused(&["--set", "limit=[{ symbol = \"Rz\", unit = \"um\", upper = 1 }]"], &["no value `Rz`", "`RONt`"]);
}
