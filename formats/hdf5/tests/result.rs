//! Result files, read back.

use std::path::Path;

use hdf5_metno::{
    File, H5Type, Location,
    types::{FixedUnicode, VarLenUnicode},
};
use runout_core::{
    Complex64,
    atomic_file::commit_all,
    closed_loop::correction::Correction,
    pipeline::{Context, StageConfig, run::StationTables},
    provenance::{Input, Provenance},
    separation::{Quantity, SectionAt, Separation},
    stage::Export,
    station::StationResult,
    summary::{LostOrders, StationSummary, Summary},
};
use runout_hdf5::{ResultConfig, inspect};

pub(crate) const ANGLES: usize = 8;

/// Form of section `a` at orders 0 to 2, order 1 lost, and x without tilt.
pub(crate) fn station(name: &str) -> StationResult {
    let number = Complex64::new;
    StationResult {
        station: name.into(),
        z_mm: 12.5,
        angles: ANGLES,
        separation: Separation {
            sections: vec![SectionAt::whole("ä", 212.5)],
            unknowns: vec![Quantity::Form(0), Quantity::X],
            estimate: vec![
                number(0.0, 0.0),
                number(0.0, 0.0),
                number(f64::NAN, f64::NAN),
                number(0.5, 0.25),
                number(2.0, -1.0),
                number(0.0, 1.0),
            ],
            variance: vec![0.0, 0.0, f64::NAN, 0.01, 0.04, 0.09],
            observable: vec![true, true, false, true, true, true],
            ..Separation::default()
        },
        profiles: Vec::new(),
        truth: None,
    }
}

pub(crate) fn summary() -> Summary {
    Summary {
        title: "Shaft".into(),
        provenance: Provenance {
            program: "runout 0.1.0".into(),
            configuration: "title = \"Shaft\"\n# µm\n".into(),
            inputs: vec![Input { path: "shaft.h5".into(), bytes: 1234, blake3: "ab".repeat(32) }],
        },
        lost_orders: LostOrders { form: vec![1], motion: Vec::new(), ..LostOrders::default() },
        stations: vec![StationSummary {
            station: "s1".into(),
            z_mm: 12.5,
            captures: Vec::new(),
            sections: Vec::new(),
            motion_along_deg: None,
            motion_z_mm: None,
            readings: vec![],
            motion_values: Vec::new(),
            residual_rms_um: None,
            expected_residual_rms_um: None,
            chi2_per_dof: None,
            residual_dof: None,
            residual_orders: None,
            truth: None,
            warnings: vec!["left out 3 points".into()],
        }],
        warnings: vec!["order 1 of the form is lost".into(), "s1: left out 3 points".into()],
        effects: vec![Correction {
            effect: "reversal-angle".into(),
            targets: vec!["b".into()],
            confounded_with: Vec::new(),
            parameters: Vec::new(),
            known: true,
        }],
        ..Summary::default()
    }
}

pub(crate) fn begin(path: &Path) -> (StationTables, Box<dyn Export>) {
    let context = Context { folder: Path::new(""), rig: None };
    let exporter = ResultConfig { path: path.to_owned() }.check(&context).unwrap();
    let tables = StationTables::new(None, None);
    assert_eq!(exporter.outputs(&tables.specs()), [path]);
    let export = exporter.begin(&tables.info("Shaft")).unwrap();
    (tables, export)
}

/// Writes a result of two stations.
pub(crate) fn write(path: &Path) {
    let (mut tables, mut export) = begin(path);
    for name in ["s1", "s2"] {
        tables.write(&station(name), &mut *export).unwrap();
    }
    assert!(!path.exists(), "no file before it is finished");
    assert_eq!(commit_all(tables.finish(export, &summary(), None).unwrap()).unwrap(), [path]);
}

fn column<T: H5Type>(file: &File, name: &str) -> Vec<T> {
    file.dataset(name).unwrap().read_raw::<T>().unwrap()
}

fn texts(file: &File, name: &str) -> Vec<String> {
    column::<FixedUnicode<64>>(file, name).iter().map(|text| text.as_str().to_owned()).collect()
}

#[test]
fn tables_hold_every_station() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.h5");
    write(&path);
    let file = File::open(&path).unwrap();
    let form: Vec<f64> = column(&file, "form/form_um");
    assert_eq!(form.len(), 2 * ANGLES);
    for (index, found) in form.iter().enumerate() {
        // Re (2 − i) e^{2iα}, by hand.
        let angle = std::f64::consts::TAU * (index % ANGLES) as f64 / ANGLES as f64;
        let expected = 2.0 * (2.0 * angle).cos() + (2.0 * angle).sin();
        assert!((found - expected).abs() < 1e-14, "{found} {expected}");
    }
    let x_um: Vec<f64> = column(&file, "motion/x_um");
    // Re [(0.5 + 0.25 i) + i] at 0; Re [(0.5 + 0.25i)(−i) + i·(−1)] at a quarter turn, by hand.
    assert!((x_um[0] - 0.5).abs() < 1e-14 && (x_um[2] - 0.25).abs() < 1e-14, "{x_um:?}");
    assert_eq!(texts(&file, "form/section"), vec!["ä"; 2 * ANGLES]);
    assert_eq!(texts(&file, "motion/station")[ANGLES - 1..=ANGLES], ["s1", "s2"]);
    assert!(column::<f64>(&file, "motion/tilt_x_urad").iter().all(|value| value.is_nan()));
    let std_um: Vec<f64> = column(&file, "form/std_um");
    assert!((std_um[0] - 0.02_f64.sqrt()).abs() < 1e-15, "{std_um:?}");

    assert_eq!(column::<u32>(&file, "harmonics/order"), [1, 2, 1, 2, 1, 2, 1, 2]);
    assert_eq!(texts(&file, "harmonics/quantity"), ["form", "form", "x", "x", "form", "form", "x", "x"]);
    assert_eq!(texts(&file, "harmonics/section")[1..3], ["ä", ""]);
    assert_eq!(column::<bool>(&file, "harmonics/observable")[..3], [false, true, true]);
    let (re, std): (Vec<f64>, Vec<f64>) = (column(&file, "harmonics/re"), column(&file, "harmonics/std"));
    assert!(re[0].is_nan() && std[0].is_nan());
    assert!((re[1] - 2.0).abs() < 1e-15 && (std[1] - 0.2).abs() < 1e-15 && (std[3] - 0.3).abs() < 1e-15);

    let report = inspect(&path).unwrap();
    assert_eq!(report.format.as_deref(), Some("runout-result"));
    let rows: Vec<(&str, usize)> = report.tables.iter().map(|table| (table.table.as_str(), table.rows)).collect();
    assert_eq!(rows, [("form", 16), ("harmonics", 8), ("motion", 16), ("values", 0)]);
}

#[test]
fn a_result_explains_itself() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("result.h5");
    write(&path);
    let file = File::open(&path).unwrap();
    let text = |location: &Location, name: &str| -> String {
        location.attr(name).unwrap().read_scalar::<VarLenUnicode>().unwrap().as_str().to_owned()
    };
    assert!(text(&file, "convention").contains("outward positive"));
    for group in ["form", "motion", "harmonics"] {
        for column in file.group(group).unwrap().datasets().unwrap() {
            let (name, unit) = (column.name(), text(&column, "unit"));
            assert!(!text(&column, "about").is_empty(), "{name}");
            let expected = ["um", "urad", "mm", "deg"].into_iter().find(|unit| name.ends_with(&format!("_{unit}")));
            if let Some(expected) = expected {
                assert_eq!(unit, expected, "{name}");
            }
        }
    }
    for name in ["re", "im", "std"] {
        let column = file.dataset(&format!("harmonics/{name}")).unwrap();
        assert_eq!(text(&column, "unit"), "um; urad for tilt");
    }
    assert!(text(&file.dataset("harmonics/std").unwrap(), "about").starts_with("sqrt(E|delta|^2)"));
    let lines = |name: &str| -> Vec<String> {
        column::<VarLenUnicode>(&file, name).iter().map(|text| text.as_str().to_owned()).collect()
    };
    let warnings = lines("warnings");
    assert_eq!(lines("effects"), ["reversal-angle b (declared as known)"]);
    assert_eq!(warnings, ["order 1 of the form is lost", "s1: left out 3 points"]);
}

#[test]
fn an_unfinished_result_leaves_nothing() {
    let folder = tempfile::tempdir().unwrap();
    let (mut tables, mut export) = begin(&folder.path().join("result.h5"));
    tables.write(&station("s1"), &mut *export).unwrap();
    assert!(tables.write(&station(&"long".repeat(20)), &mut *export).is_err());
    drop(export);
    assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 0);
}
