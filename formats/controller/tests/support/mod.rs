//! Writing files, machines, and what is left of their errors.

#![allow(clippy::unwrap_used, dead_code, reason = "tests")]

pub(crate) mod controls;
pub(crate) mod tables;

use std::{collections::BTreeMap, fs, path::Path};

use nalgebra::{DMatrix, DVector, Vector3};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use runout_core::{
    Result,
    atomic_file::commit_all,
    component_curves::{ComponentCurves, curves_rows, curves_table, location_rows, location_table},
    pipeline::{Context, Registry},
    stage::{About, Completed, Exporter, Outcome, ResultInfo},
    summary::Summary,
    table::{TableRows, TableSpec},
};
use runout_spatial_error::simulate::Simulated;
use serde_json::json;
use toml::de::DeTable;

fn summary(values: &[(String, f64)]) -> Summary {
    let values: Vec<serde_json::Value> = (values.iter())
        .map(|(symbol, value)| json!({ "symbol": symbol, "value": value, "std": null, "unit": "um", "about": "" }))
        .collect();
    let whole = json!({
        "title": "Test machine", "provenance": { "program": "runout test", "configuration": "", "inputs": [] },
        "lost_orders": { "form": [], "motion": [] }, "part": null, "limits": [], "surface": null, "outputs": [],
        "stations": [], "values": values, "warnings": [],
    });
    serde_json::from_value(whole).unwrap()
}

pub(crate) fn exporter(toml: &str, folder: &Path) -> std::result::Result<Box<dyn Exporter>, String> {
    let mut registry = Registry::default();
    runout_controller::register(&mut registry);
    let built = registry.exporters.build(&DeTable::parse(toml).unwrap(), &Context { folder, rig: None });
    built.map_err(|fault| fault.to_string())
}

/// The files that are written of tables, with values, by their names.
fn all_written(
    toml: &str,
    tables: &[(TableSpec, TableRows)],
    values: &[(String, f64)],
) -> Result<BTreeMap<String, String>> {
    let folder = tempfile::tempdir().unwrap();
    let toml = format!("plugin = \"controller\"\npath = \"file.cma\"\n{toml}");
    let exporter = exporter(&toml, folder.path()).unwrap();
    let specs: Vec<TableSpec> = tables.iter().map(|(spec, _)| spec.clone()).collect();
    let mut export = exporter.begin(&ResultInfo { title: "Test machine".into(), tables: specs, longest_name: None })?;
    for (spec, rows) in tables {
        export.rows(spec, &rows.rows)?;
    }
    let (summary, about) = (summary(values), About::default());
    let completed =
        Completed { summary: &summary, about: &about, surface: None, heights: None, diagnosis: None, overview: None };
    commit_all(export.finish(&completed)?)?;
    let files = fs::read_dir(folder.path()).unwrap().map(|entry| entry.unwrap());
    let named = files.map(|file| (file.file_name().into_string().unwrap(), fs::read_to_string(file.path()).unwrap()));
    let named: BTreeMap<String, String> = named.collect();
    let said: Vec<_> = exporter.outputs(&[]).into_iter().map(|file| file.file_name().unwrap().to_owned()).collect();
    assert!(said.len() == named.len() && said.iter().all(|file| named.contains_key(file.to_str().unwrap())));
    Ok(named)
}

/// Of curves.
pub(crate) fn of_curves(toml: &str, curves: &ComponentCurves, rotary: bool) -> Result<String> {
    Ok(all_of_curves(toml, curves, rotary)?.remove("file.cma").unwrap())
}

/// All files of curves.
pub(crate) fn all_of_curves(toml: &str, curves: &ComponentCurves, rotary: bool) -> Result<BTreeMap<String, String>> {
    let spec = curves_table(rotary, "curves");
    let nodes = curves_rows(&spec, &curves.nodes).unwrap();
    let location = location_rows(&curves.location).unwrap();
    all_written(toml, &[(spec, nodes), (location_table(), location)], &[])
}

/// Of the outcome of a separator.
pub(crate) fn of_outcome(toml: &str, specs: &[TableSpec], outcome: &Outcome) -> Result<String> {
    Ok(all_of_outcome(toml, specs, outcome)?.remove("file.cma").unwrap())
}

/// All files of the outcome of a separator.
pub(crate) fn all_of_outcome(toml: &str, specs: &[TableSpec], outcome: &Outcome) -> Result<BTreeMap<String, String>> {
    let of = |rows: &TableRows| (specs.iter().find(|spec| spec.name == rows.table).unwrap().clone(), rows.clone());
    let tables: Vec<_> = outcome.tables.iter().map(of).collect();
    let value = |value: &runout_core::summary::Value| Some((value.symbol.clone(), value.number()?));
    all_written(toml, &tables, &outcome.values.iter().filter_map(value).collect::<Vec<_>>())
}

/// What `leave_out` has to name: as the error says it.
pub(crate) fn left_out(error: &runout_core::Error) -> String {
    let advice = error.advice().unwrap();
    advice[advice.find('`').unwrap() + 1..advice.rfind('`').unwrap()].to_owned()
}

/// Root mean square length of the errors of a machine whose control adds to its commands, in µm, less the rigid motion that fits best.
pub(crate) fn left_um(made: &Simulated, ends_mm: [f64; 3], adds_um: &dyn Fn([f64; 3]) -> Vector3<f64>) -> f64 {
    let mut random = ChaCha8Rng::seed_from_u64(11);
    let places: Vec<[f64; 3]> =
        (0..500).map(|_| [0, 1, 2].map(|axis| random.random_range(0.0..=ends_mm[axis]))).collect();
    let errors: Vec<Vector3<f64>> = (places.iter())
        .map(|place| {
            let adds = adds_um(*place);
            Vector3::from(made.error_um((Vector3::from(*place) + 1e-3 * adds).into())) + adds
        })
        .collect();
    let design = DMatrix::from_fn(3 * places.len(), 6, |row, column| {
        let (place, axis) = (1e-3 * Vector3::from(places[row / 3]), row % 3);
        if column < 3 {
            return f64::from(u8::from(column == axis));
        }
        let mut about = Vector3::zeros();
        about[column - 3] = 1.0;
        about.cross(&place)[axis]
    });
    let all = DVector::from_fn(3 * places.len(), |row, _| errors[row / 3][row % 3]);
    let fit = design.clone().svd(true, true).solve(&all, 1e-12).unwrap();
    ((all - design * fit).norm_squared() / places.len() as f64).sqrt()
}

/// The number after a word of a file.
pub(crate) fn number_after(text: &str, word: &str) -> f64 {
    let rest = &text[text.find(word).unwrap() + word.len()..];
    rest.split_whitespace().next().unwrap().trim_end_matches(',').parse().unwrap()
}
