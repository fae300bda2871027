//! The examples of the library run, and give what they say.
#![allow(clippy::unwrap_used, missing_docs, reason = "tests")]

use std::{fs, path::Path};

use runout_core::ErrorKind;

#[path = "../examples/own_exporter.rs"]
mod own_exporter;
#[path = "../examples/own_separator.rs"]
mod own_separator;
#[path = "../examples/pipeline.rs"]
mod pipeline;

fn example(file: &str) -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../examples").join(file)
}

#[test]
fn a_pipeline_runs_from_rust() {
    let out = tempfile::tempdir().unwrap();
    let summary = pipeline::separate(&example("08-text-recording/shaft.csv"), &out.path().join("tables")).unwrap();
    assert_eq!(summary.stations.len(), 1);
    assert!(summary.outputs.iter().any(|file| file.ends_with("form.parquet")) && !summary.placed_values().is_empty());
    for file in &summary.outputs {
        assert!(file.exists(), "{}", file.display());
    }
    let missing = pipeline::separate(&out.path().join("none.csv"), out.path()).unwrap_err();
    let kind = missing.downcast_ref::<runout_core::Error>().map(runout_core::Error::kind);
    assert_eq!(kind, Some(ErrorKind::MissingFile), "{missing}");
}

/// z = 1 + 0.1 x, and 0.4 µm more at the middle of five points: the plane rises by a fifth of it.
#[test]
fn an_own_separator_finds_a_plane() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("points.csv");
    fs::write(&file, "x_mm,y_mm,z_um\n0,0,1\n10,0,2\n0,10,1\n10,10,2\n5,5,1.9\n").unwrap();
    let summary = own_separator::flatness(&file, &folder.path().join("out")).unwrap();
    let [flatness, x, y] = &summary.values[..] else { panic!("{:?}", summary.values) };
    assert!((flatness.value - 0.4).abs() < 1e-9 && flatness.uncertainty.is_none(), "{flatness:?}");
    assert!((x.value - 0.1).abs() < 1e-12 && y.value.abs() < 1e-12);
    // 0.1 µm on four points 5 mm from the middle: 0.1/√(4·25).
    assert!((x.std().unwrap() - 0.01).abs() < 1e-12, "{x:?}");
    assert!(folder.path().join("out/plane.parquet").exists());

    fs::write(&file, "x_mm,y_mm,z_um\n0,0,1\n1,1,2\n2,2,1\n").unwrap();
    let line = own_separator::flatness(&file, &folder.path().join("out")).unwrap_err();
    let kind = line.downcast_ref::<runout_core::Error>().map(runout_core::Error::kind);
    assert_eq!(kind, Some(ErrorKind::InsufficientData), "{line}");
}

#[test]
fn an_own_exporter_writes_the_tables_of_a_domain_that_it_does_not_know() {
    let folder = tempfile::tempdir().unwrap();
    let file = folder.path().join("page.md");
    own_exporter::page(&example("04-straightness-reversal/traces.csv"), &file).unwrap();
    let page = fs::read_to_string(file).unwrap();
    assert!(page.contains("## straightness (") && page.contains("| part_um | um |"), "{page}");
}
