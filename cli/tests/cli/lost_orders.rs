//! Four fixed sensors, the part reversed: every even order is lost (half a turn changes neither form nor motion of even
//! order), and every command and file says so.

use std::{fs::File, path::Path};

use parquet::{
    file::reader::{FileReader, SerializedFileReader},
    record::{Row, RowAccessor},
};
use serde_json::{Value, json};

use crate::{
    commands::SCENARIO,
    folder::{Folder, RIG, pipeline},
};

/// The highest order of 128 samples a turn.
const HIGHEST: usize = 63;
/// Stations of the scenario; forms a and b, x, y and two tilts.
const UNKNOWNS: usize = 2 * 6;

fn even() -> Vec<usize> {
    (2..=HIGHEST).step_by(2).collect()
}

fn lost() -> Value {
    json!({ "form": even(), "motion": even() })
}

/// A folder with a recording of the rig.
fn campaign() -> Folder {
    let fixed = |text: &str| text.replace("sensors_deg = 180", "sensors_deg = 0");
    let text = fixed(&pipeline()) + "\n[[export]]\nplugin = \"hdf5\"\npath = \"result.h5\"\n";
    let folder = Folder::with(&[("pipeline.toml", &text), ("scenario.toml", SCENARIO), ("rig.toml", &fixed(RIG))]);
    document(&folder, &["simulate", "scenario.toml"]);
    folder
}

fn document(folder: &Folder, arguments: &[&str]) -> Value {
    let ran = folder.run(&[arguments, &["--json"]].concat());
    assert_eq!((ran.status, ran.stderr.as_str()), (0, ""), "{arguments:?}");
    serde_json::from_str(&ran.stdout).unwrap()
}

#[test]
fn every_command_reports_them() {
    let folder = campaign();
    assert_eq!(document(&folder, &["check", "pipeline.toml"])["lost_orders"], lost());
    let orders = format!("2..{HIGHEST}");
    assert_eq!(document(&folder, &["plan", "rig.toml", "--orders", &orders])["lost_orders"], lost());

    let compared = document(&folder, &["compare", "pipeline.toml", "--with", "harmonic-least-squares"]);
    let methods = compared["methods"].as_array().unwrap();
    assert_eq!(methods.len(), 2);
    for method in methods {
        assert_eq!(method["lost_orders"], lost(), "{method}");
    }
    for quantity in compared["stations"][0]["quantities"].as_array().unwrap() {
        for value in quantity["values"].as_array().unwrap() {
            for order in even() {
                assert_eq!(value["harmonics"]["re"][order - 1], Value::Null, "{}", value["method"]);
            }
        }
    }

    let found = document(&folder, &["run", "pipeline.toml"]);
    assert_eq!(found["lost_orders"], lost());
    for station in found["stations"].as_array().unwrap() {
        for section in station["sections"].as_array().unwrap() {
            for value in section["values"].as_array().unwrap() {
                // All are lost within reach of the filter's 50 UPR too.
                let highest = if value["filter"] == "none" { HIGHEST } else { 50 };
                assert_eq!([&value["band_upr"], &value["lost_orders"]], [&json!([2, highest]), &json!(even())]);
            }
        }
    }
}

/// With either separator.
#[test]
fn no_file_hides_them() {
    let folder = campaign();
    for plugin in ["four-sensor-reversal", "harmonic-least-squares"] {
        let plugin = format!("separate.plugin={plugin}");
        document(&folder, &["run", "pipeline.toml", "--set", &plugin]);
        let out = folder.path().join("out");

        let harmonics = rows(&out.join("harmonics.parquet"));
        assert_eq!(harmonics.len(), UNKNOWNS * HIGHEST);
        for row in &harmonics {
            let order = row.get_uint(3).unwrap() as usize;
            look(order, row.get_bool(7).unwrap(), [4, 5, 6].map(|column| number(row, column)));
        }

        let file = hdf5_metno::File::open(folder.path().join("result.h5")).unwrap();
        let column = |name: &str| file.dataset(&format!("harmonics/{name}")).unwrap();
        let numbers = ["re", "im", "std"].map(|name| column(name).read_1d::<f64>().unwrap());
        let observable = column("observable").read_1d::<bool>().unwrap();
        let orders = column("order").read_1d::<u32>().unwrap();
        assert_eq!(orders.len(), UNKNOWNS * HIGHEST);
        for (row, order) in orders.iter().enumerate() {
            look(*order as usize, observable[row], [0, 1, 2].map(|column| numbers[column][row]));
        }

        // Half a turn on, odd orders change their sign; an even one would not.
        for (table, columns) in [("form", 4..5), ("motion", 2..6)] {
            let all = rows(&out.join(format!("{table}.parquet")));
            for turn in all.chunks(128) {
                for column in columns.clone() {
                    let size = turn.iter().map(|row| number(row, column).abs()).fold(0.0, f64::max);
                    assert!(size > 0.1, "{table} {column}: {size} µm or µrad are left of 1.5 and more");
                    for (one, opposite) in turn.iter().zip(&turn[64..]) {
                        // 1e-9 µm: rounding of sums of 64 terms near 10.
                        assert!((number(one, column) + number(opposite, column)).abs() < 1e-9, "{table} {column}");
                    }
                }
            }
        }
    }
}

/// A row of the harmonics: real and imaginary part, standard uncertainty.
fn look(order: usize, observable: bool, numbers: [f64; 3]) {
    let expected = order % 2 == 1;
    assert_eq!(observable, expected, "order {order}");
    for number in numbers {
        assert_eq!(number.is_finite(), expected, "order {order}: {number}");
    }
}

fn rows(path: &Path) -> Vec<Row> {
    let reader = SerializedFileReader::new(File::open(path).unwrap()).unwrap();
    reader.get_row_iter(None).unwrap().map(Result::unwrap).collect()
}

/// A number, NaN where there is none.
fn number(row: &Row, column: usize) -> f64 {
    row.get_double(column).unwrap_or(f64::NAN)
}
