//! What other people's programs say of our files. `npm install` in `tests/foreign` brings the validator.

#![allow(clippy::unwrap_used, reason = "tests")]

use std::{
    path::{Path, PathBuf},
    process::Command,
};

use crate::support::{closed, export, export_heights, exporter, heights, report, skip, surface, trimesh, volume_mm3};
use runout_core::{pipeline::Registry, stage::Exporter};

fn gltf(folder: &Path, keys: &str) -> Box<dyn Exporter> {
    let mut registry = Registry::default();
    runout_gltf::register(&mut registry);
    let toml = format!("plugin = \"gltf\"\npath = \"part.glb\"\n{keys}");
    exporter(&registry, &toml, folder).unwrap()
}

fn files(folder: &Path, keys: &str) -> Vec<PathBuf> {
    export(&*gltf(folder, keys), Some(&surface())).unwrap()
}

fn flat_files(folder: &Path) -> Vec<PathBuf> {
    export_heights(&*gltf(folder, "magnification = 1000"), &heights()).unwrap()
}

#[test]
fn khronos_validator_finds_nothing() {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/foreign");
    let modules = std::env::var_os("RUNOUT_NODE_MODULES").map_or_else(|| here.join("node_modules"), PathBuf::from);
    if !modules.join("gltf-validator").is_dir() {
        return skip("gltf-validator is not installed in RUNOUT_NODE_MODULES (default tests/foreign/node_modules)");
    }
    let folder = tempfile::tempdir().unwrap();
    let keys = ["", "capped = true\nmagnification = 1000", "colour_range_um = 0.001"];
    let round = keys.map(|keys| -> Box<dyn Fn() -> Vec<PathBuf>> { Box::new(|| files(folder.path(), keys)) });
    let flat: Box<dyn Fn() -> Vec<PathBuf>> = Box::new(|| flat_files(folder.path()));
    // Each writes over the files before it.
    for write in round.into_iter().chain([flat]) {
        for file in write() {
            let output = Command::new("node").arg(here.join("validate.mjs")).arg(&modules).arg(&file).output();
            let Ok(output) = output else { return skip("node is not installed") };
            let report = report(&output);
            let issues = &report["issues"];
            for kind in ["numErrors", "numWarnings", "numInfos", "numHints"] {
                assert_eq!(issues[kind], 0, "{}: {issues:#}", file.display());
            }
            assert_eq!(report["info"]["materialCount"], 0);
        }
    }
}

#[test]
fn trimesh_finds_a_coloured_solid() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    for (file, scale) in files(folder.path(), "capped = true\nmagnification = 1000").iter().zip([1.0, 1000.0]) {
        let Some(found) = trimesh(file) else { return };
        closed(&found);
        let volume = found["volume"].as_f64().unwrap() * 1e9;
        let expected = volume_mm3(&surface, scale);
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-9 m (1e-7).
        assert!((volume / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{volume} {expected}");
        assert!(found["colours"].as_u64().unwrap() > 100);
        let range = found["deviation_range"].as_array().unwrap();
        let lowest = surface.deviation_um.iter().copied().fold(f64::INFINITY, f64::min);
        // Half a unit in the last place of an f32 near 8.
        assert!((range[0].as_f64().unwrap() - lowest).abs() < 5e-7);
    }
    for file in flat_files(folder.path()) {
        let Some(found) = trimesh(&file) else { return };
        assert_eq!(found["as_written"]["watertight"], false, "{found:#}");
        assert_eq!(found["as_written"]["winding_consistent"], true, "{found:#}");
        let range = found["deviation_range"].as_array().unwrap();
        let lowest =
            heights().height_nm.iter().copied().filter(|height| height.is_finite()).fold(f64::INFINITY, f64::min);
        assert!((range[0].as_f64().unwrap() - 1e-3 * lowest).abs() < 5e-7);
    }
}
