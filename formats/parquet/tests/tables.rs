//! What the tables hold, read back by the parquet crate and by pyarrow.

#![allow(clippy::unwrap_used, clippy::print_stdout, clippy::float_cmp, reason = "tests")]

use std::{collections::HashMap, f64::consts::TAU, fs::File, path::Path, process::Command};

use arrow_array::{Array, BooleanArray, Float64Array, RecordBatch, StringArray, UInt32Array};
use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use runout_core::{
    Complex64,
    atomic_file::commit_all,
    draws::Uncertainty,
    evaluate::Value,
    pipeline::{Context, StageConfig, run::StationTables},
    provenance::{Input, Provenance},
    separation::{Quantity, SectionAt, Separation},
    station::StationResult,
    summary::{LostOrders, PartSummary, SectionSummary, StationSummary, Summary},
};
use runout_parquet::ParquetConfig;

const ANGLES: usize = 48;
const MAX_ORDER: usize = 6;
/// An order that is not observable with the made-up layout.
const LOST: usize = 4;

fn value(station: usize, unknown: usize, order: usize) -> Complex64 {
    if order == 0 {
        Complex64::ZERO
    } else {
        Complex64::from_polar(1.0 / order as f64, (station + 3 * unknown + order) as f64)
    }
}

/// A station with the forms of two sections, and x and y unless the part was only measured.
fn station(index: usize, motion: bool) -> StationResult {
    let mut unknowns = vec![Quantity::Form(0), Quantity::Form(1)];
    if motion {
        unknowns.extend([Quantity::X, Quantity::Y]);
    }
    let places = || (0..=MAX_ORDER).flat_map(|order| (0..unknowns.len()).map(move |unknown| (order, unknown)));
    let lost = |order: usize| order == LOST;
    let z_mm = 10.0 * index as f64;
    let separation = Separation {
        sections: vec![SectionAt::whole("a", z_mm), SectionAt::whole("b", z_mm + 30.0)],
        estimate: places()
            .map(
                |(order, unknown)| {
                    if lost(order) { Complex64::new(f64::NAN, f64::NAN) } else { value(index, unknown, order) }
                },
            )
            .collect(),
        variance: places().map(|(order, _)| if lost(order) { f64::NAN } else { 0.02 }).collect(),
        observable: places().map(|(order, _)| !lost(order)).collect(),
        unknowns,
        ..Separation::default()
    };
    let station = format!("s{index:02}");
    StationResult { station, z_mm, angles: ANGLES, separation, profiles: Vec::new(), truth: None }
}

fn summary() -> Summary {
    Summary {
        title: "Probelauf µ".into(),
        provenance: Provenance {
            program: "runout test".into(),
            configuration: "[load]\nplugin = \"csv\"\n".into(),
            inputs: vec![Input { path: "shaft.h5".into(), bytes: 12, blake3: "00ff".into() }],
        },
        lost_orders: LostOrders { form: vec![LOST], motion: vec![LOST], ..LostOrders::default() },
        warnings: vec!["order 4 is lost".into()],
        ..Summary::default()
    }
}

fn export(folder: &Path, stations: usize, motion: bool) {
    let context = Context { folder: Path::new(""), rig: None };
    let exporter = ParquetConfig { path: folder.to_path_buf() }.check(&context).unwrap();
    let mut tables = StationTables::new(None, None);
    let mut export = exporter.begin(&tables.info("")).unwrap();
    for index in 0..stations {
        tables.write(&station(index, motion), &mut *export).unwrap();
    }
    let written = commit_all(tables.finish(export, &summary(), None).unwrap()).unwrap();
    let outputs = exporter.outputs(&tables.specs());
    assert!(written.iter().all(|path| outputs.contains(path) && path.is_file()));
}

/// All rows, and the file's own metadata.
fn read(path: &Path) -> (RecordBatch, HashMap<String, String>) {
    let builder = ParquetRecordBatchReaderBuilder::try_new(File::open(path).unwrap()).unwrap();
    let entries = builder.metadata().file_metadata().key_value_metadata().cloned().unwrap_or_default();
    let entries = entries.into_iter().filter_map(|entry| Some((entry.key, entry.value?))).collect();
    let mut batches = builder.with_batch_size(1 << 20).build().unwrap();
    let batch = batches.next().unwrap().unwrap();
    assert!(batches.next().is_none());
    (batch, entries)
}

fn numbers<'a>(batch: &'a RecordBatch, name: &str) -> &'a Float64Array {
    batch.column_by_name(name).unwrap().as_any().downcast_ref().unwrap()
}

fn texts<'a>(batch: &'a RecordBatch, name: &str) -> &'a StringArray {
    batch.column_by_name(name).unwrap().as_any().downcast_ref().unwrap()
}

fn names(batch: &RecordBatch) -> Vec<String> {
    batch.schema().fields().iter().map(|field| field.name().clone()).collect()
}

/// Re Σ c e^{±inα} without the lost order, term by term.
fn sum(index: usize, unknown: usize, angle_deg: f64, sign: f64) -> f64 {
    let orders = (1..=MAX_ORDER).filter(|order| *order != LOST);
    orders
        .map(|order| {
            let c = value(index, unknown, order);
            let phase = sign * order as f64 * angle_deg / 360.0 * TAU;
            c.re * phase.cos() - c.im * phase.sin()
        })
        .sum()
}

#[test]
fn form_is_the_sum_of_observable_orders() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 3, true);
    let (form, entries) = read(&folder.path().join("form.parquet"));
    assert_eq!(names(&form), ["section", "station", "z_mm", "angle_deg", "form_um", "std_um"]);
    assert_eq!(form.num_rows(), 3 * 2 * ANGLES);
    // Rows 48 to 95 of station 2: section b at 20 + 30 mm.
    let row = 2 * 2 * ANGLES + ANGLES + 7;
    assert_eq!((texts(&form, "section").value(row), texts(&form, "station").value(row)), ("b", "s02"));
    assert_eq!(numbers(&form, "z_mm").value(row), 50.0);
    assert_eq!(numbers(&form, "angle_deg").value(row), 7.0 * 360.0 / ANGLES as f64);
    for row in 0..form.num_rows() {
        let (index, section) = (row / (2 * ANGLES), row / ANGLES % 2);
        let expected = sum(index, section, numbers(&form, "angle_deg").value(row), 1.0);
        // 1e-13: rounding of six terms near 1.
        assert!((numbers(&form, "form_um").value(row) - expected).abs() < 1e-13);
    }
    // Five observable orders, each of variance 0.02: √(½·0.1).
    assert!((numbers(&form, "std_um").value(0) - 0.05_f64.sqrt()).abs() < 1e-15);
    assert_eq!(entries["runout.title"], "Probelauf µ");
    assert_eq!(entries["runout.lost_orders"], r#"{"form":[4],"motion":[4]}"#);
    assert_eq!(entries["runout.band_upr"], "[1,6]");
    assert_eq!(entries["runout.warnings"], r#"["order 4 is lost"]"#);
    assert!(entries["runout.inputs"].contains(r#""blake3":"00ff""#));
    let schema = form.schema();
    let about = schema.field_with_name("form_um").unwrap().metadata();
    assert_eq!(about["unit"], "um");
    assert!(about["about"].contains("lost"));
}

#[test]
fn motion_is_null_where_it_was_not_solved_for() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 2, true);
    let (motion, _) = read(&folder.path().join("motion.parquet"));
    let mut columns = vec!["station", "angle_deg", "x_um", "y_um", "tilt_x_urad", "tilt_y_urad"];
    columns.extend(["std_x_um", "std_y_um", "std_tilt_x_urad", "std_tilt_y_urad"]);
    assert_eq!(names(&motion), columns);
    assert_eq!(motion.num_rows(), 2 * ANGLES);
    for row in 0..motion.num_rows() {
        let angle = numbers(&motion, "angle_deg").value(row);
        for (name, unknown) in [("x_um", 2), ("y_um", 3)] {
            let expected = sum(row / ANGLES, unknown, angle, -1.0);
            assert!((numbers(&motion, name).value(row) - expected).abs() < 1e-13);
        }
    }
    for name in ["tilt_x_urad", "tilt_y_urad", "std_tilt_x_urad", "std_tilt_y_urad"] {
        assert_eq!(numbers(&motion, name).null_count(), motion.num_rows(), "{name}");
    }
    assert_eq!(numbers(&motion, "std_x_um").null_count(), 0);
}

#[test]
fn harmonics_say_what_is_lost() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 2, true);
    let (table, _) = read(&folder.path().join("harmonics.parquet"));
    assert_eq!(names(&table), ["quantity", "section", "station", "order", "re", "im", "std", "observable"]);
    // Orders 1 to 6: no level is known.
    assert_eq!(table.num_rows(), 2 * 4 * MAX_ORDER);
    let orders: &UInt32Array = table.column_by_name("order").unwrap().as_any().downcast_ref().unwrap();
    let observable: &BooleanArray = table.column_by_name("observable").unwrap().as_any().downcast_ref().unwrap();
    for row in 0..table.num_rows() {
        let (index, unknown) = (row / (4 * MAX_ORDER), row / MAX_ORDER % 4);
        let order = orders.value(row) as usize;
        assert_eq!(order, row % MAX_ORDER + 1);
        assert_eq!(texts(&table, "quantity").value(row), ["form", "form", "x", "y"][unknown]);
        match unknown {
            0 | 1 => assert_eq!(texts(&table, "section").value(row), ["a", "b"][unknown]),
            _ => assert!(texts(&table, "section").is_null(row)),
        }
        assert_eq!(observable.value(row), order != LOST);
        let [re, im, std] = ["re", "im", "std"].map(|name| numbers(&table, name).value(row));
        if order == LOST {
            assert!(re.is_nan() && im.is_nan() && std.is_nan());
        } else {
            assert_eq!(Complex64::new(re, im), value(index, unknown, order));
            assert_eq!(std, 0.02_f64.sqrt());
        }
    }
}

#[test]
fn a_part_without_motion_has_no_motion_table_not_even_an_old_one() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 1, true);
    export(folder.path(), 1, false);
    let mut names: Vec<_> = std::fs::read_dir(folder.path())
        .unwrap()
        .map(|entry| entry.unwrap().file_name().into_string().unwrap())
        .collect();
    names.sort();
    assert_eq!(names, ["form.parquet", "harmonics.parquet", "values.parquet"]);
}

#[test]
fn a_run_that_fails_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 1, true);
    let before = std::fs::read(folder.path().join("form.parquet")).unwrap();
    let context = Context { folder: folder.path(), rig: None };
    let exporter = ParquetConfig { path: "".into() }.check(&context);
    assert!(exporter.is_err_and(|fault| fault.to_string().contains("folder")));
    let exporter = ParquetConfig { path: ".".into() }.check(&context).unwrap();
    let mut tables = StationTables::new(None, None);
    let info = tables.info("");
    let mut export = exporter.begin(&info).unwrap();
    tables.write(&station(5, true), &mut *export).unwrap();
    drop(export);
    assert_eq!(std::fs::read(folder.path().join("form.parquet")).unwrap(), before);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 4);
    let in_the_way = ParquetConfig { path: "form.parquet".into() }.check(&context).unwrap().begin(&info);
    assert!(in_the_way.is_err_and(|error| error.to_string().contains("there is a file of that name")));
}

#[test]
fn values_are_rows_and_null_where_there_is_none() {
    let folder = tempfile::tempdir().unwrap();
    let context = Context { folder: Path::new(""), rig: None };
    let exporter = ParquetConfig { path: folder.path().to_path_buf() }.check(&context).unwrap();
    let export = exporter.begin(&StationTables::new(None, None).info("")).unwrap();
    let interval = Uncertainty::new(0.1, [3.7, 4.1], 400);
    let value = |symbol: &str, value, uncertainty| Value {
        band_upr: [2, 50],
        lost_orders: vec![LOST],
        filter: Some("Gaussian 50 UPR".into()),
        coverage: 0.75,
        uncertainty,
        ..Value::referred(symbol, value, "um", "ISO 12181-1:2011", "MZCI")
    };
    let mut filled = summary();
    let section = SectionSummary {
        section: "a".into(),
        z_mm: 40.0,
        form_rms_um: 1.0,
        form_std_um: None,
        values: vec![value("RONt", 3.9, Some(interval))],
        truth_form_rms_error_um: None,
    };
    filled.stations = vec![StationSummary {
        station: "s00".into(),
        z_mm: 10.0,
        captures: Vec::new(),
        sections: vec![section],
        motion_along_deg: None,
        motion_z_mm: None,
        readings: vec![],
        motion_values: vec![value("total", 1.5, None)],
        residual_rms_um: None,
        expected_residual_rms_um: None,
        chi2_per_dof: None,
        residual_dof: None,
        residual_orders: None,
        truth: None,
        warnings: Vec::new(),
    }];
    filled.part = Some(PartSummary { values: vec![value("CYLt", 6.0, None)], ..PartSummary::default() });
    commit_all(StationTables::new(None, None).finish(export, &filled, None).unwrap()).unwrap();
    let (table, entries) = read(&folder.path().join("values.parquet"));
    assert_eq!(entries["runout.title"], "Probelauf µ");
    assert_eq!(table.num_rows(), 3);
    for (row, symbol, value) in [(0, "RONt", 3.9), (1, "total", 1.5), (2, "CYLt", 6.0)] {
        assert_eq!((texts(&table, "symbol").value(row), numbers(&table, "value").value(row)), (symbol, value));
        let there = ["station", "section"].map(|name| texts(&table, name).is_valid(row));
        assert_eq!(there, [row < 2, row < 1]);
        assert_eq!(numbers(&table, "z_mm").is_valid(row), row < 2);
        for name in ["std", "low_95", "high_95"] {
            assert_eq!(numbers(&table, name).is_valid(row), row < 1, "{name}");
        }
        assert_eq!(texts(&table, "lost_orders").value(row), "[4]");
        assert_eq!(numbers(&table, "coverage").value(row), 0.75);
    }
    let ends: &UInt32Array = table.column_by_name("band_high_upr").unwrap().as_any().downcast_ref().unwrap();
    assert_eq!((ends.value(0), numbers(&table, "high_95").value(0)), (50, 4.1));
    let schema = table.schema();
    assert!(schema.fields().iter().all(|field| field.metadata().contains_key("about")));
}

/// pyarrow, a reader that shares no code with the writer, adds the harmonics up and gets form and motion.
#[test]
fn pyarrow_reads_the_same() {
    let python = std::env::var("RUNOUT_PYTHON").unwrap_or_else(|_| "python3".into());
    let required = std::env::var("RUNOUT_REQUIRE_FOREIGN").is_ok_and(|value| value == "1");
    let there = Command::new(&python).args(["-c", "import numpy, pyarrow"]).output();
    if !there.is_ok_and(|output| output.status.success()) {
        assert!(!required, "{python} cannot import numpy and pyarrow, and RUNOUT_REQUIRE_FOREIGN is 1");
        println!("skipped: {python} cannot import numpy and pyarrow; RUNOUT_PYTHON may name one that can");
        return;
    }
    let folder = tempfile::tempdir().unwrap();
    export(folder.path(), 4, true);
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/tests/foreign/read_tables.py");
    let output = Command::new(&python).arg(script).arg(folder.path()).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout);
    assert!(output.status.success(), "{said}{}", String::from_utf8_lossy(&output.stderr));
    println!("{said}");
}
