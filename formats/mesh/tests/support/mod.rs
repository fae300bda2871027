//! What the tests of all mesh formats need: a surface with a known shape, and a way through the registry to a file.

#![allow(dead_code, clippy::unwrap_used, clippy::print_stderr, reason = "tests, each of which uses a part")]

use std::{
    f64::consts::TAU,
    path::{Path, PathBuf},
    process::{Command, Output},
};

use runout_core::{
    Complex64, Error,
    atomic_file::commit_all,
    fault::Fault,
    height_grid::HeightGrid,
    pipeline::{Context, Registry, run::StationTables},
    provenance::{Input, Provenance},
    separation::{Quantity, SectionAt, Separation},
    stage::{About, Completed, Exporter, ResultInfo},
    station::StationResult,
    summary::{LostOrders, Summary},
    surface::Surface,
};
use toml::de::DeTable;

pub(crate) const RADIUS_MM: f64 = 15.0;
pub(crate) const ANGLES: usize = 360;

/// A lobed, bent and waisted part; in µm.
pub(crate) fn deviation_um(angle: f64, z_mm: f64) -> f64 {
    let along = (z_mm - 12.0) / 12.0;
    3.0 * (3.0 * angle + 0.5).cos() + 1.5 * (11.0 * angle).sin() * along + 4.0 * along * along * (angle - 0.3).cos()
        - 2.0 * (1.0 - along * along)
        + 0.4 * (40.0 * angle).cos()
}

pub(crate) fn angle(index: usize) -> f64 {
    TAU * index as f64 / ANGLES as f64
}

/// On rings at uneven distances.
pub(crate) fn surface() -> Surface {
    let z_mm = vec![0.0, 2.0, 5.0, 6.0, 9.0, 13.0, 14.5, 18.0, 22.0, 24.0];
    let deviation_um = z_mm.iter().flat_map(|z| (0..ANGLES).map(|index| deviation_um(angle(index), *z))).collect();
    Surface {
        radius_mm: RADIUS_MM,
        angles: ANGLES,
        z_mm,
        deviation_um,
        interpolation: "linear along z between the two sections",
        meetings: Vec::new(),
    }
}

/// What the mesh of [`surface`] must enclose when its deviations are drawn `scale` times larger, in mm³: prisms between
/// rings, each with the polygon area ½ sin(Δα) Σ rᵢ rᵢ₊₁, by the prismatoid's rule.
pub(crate) fn volume_mm3(surface: &Surface, scale: f64) -> f64 {
    let radius = |deviation: f64| surface.radius_mm + 1e-3 * scale * deviation;
    let rings: Vec<Vec<f64>> =
        (0..surface.z_mm.len()).map(|ring| surface.ring(ring).iter().map(|value| radius(*value)).collect()).collect();
    let area = |radii: &[f64]| {
        let around = radii.iter().zip(radii.iter().cycle().skip(1)).map(|(one, next)| one * next).sum::<f64>();
        0.5 * (TAU / surface.angles as f64).sin() * around
    };
    let slices = rings.windows(2).zip(surface.z_mm.windows(2)).map(|(rings, z)| {
        let middle: Vec<f64> = rings[0].iter().zip(&rings[1]).map(|(low, high)| 0.5 * (low + high)).collect();
        (z[1] - z[0]) / 6.0 * (area(&rings[0]) + 4.0 * area(&middle) + area(&rings[1]))
    });
    slices.sum()
}

/// Builds an exporter as a pipeline does, from the keys of its table.
pub(crate) fn exporter(registry: &Registry, toml: &str, folder: &Path) -> Result<Box<dyn Exporter>, Fault> {
    registry.exporters.build(&DeTable::parse(toml).unwrap(), &Context { folder, rig: None })
}

/// Runs an exporter over a surface.
pub(crate) fn export(exporter: &dyn Exporter, surface: Option<&Surface>) -> Result<Vec<PathBuf>, Error> {
    let title = "Waisted part\nwith a second line";
    let mut tables = StationTables::new(None, None);
    let mut export = exporter.begin(&tables.info(title))?;
    tables.write(&station(), &mut *export)?;
    let summary = Summary {
        title: title.into(),
        provenance: Provenance {
            program: "runout 0.0.0".into(),
            configuration: String::new(),
            inputs: vec![Input { path: "part.h5".into(), bytes: 3, blake3: "00ff".into() }],
        },
        lost_orders: LostOrders { form: vec![1, 4, 500], motion: Vec::new(), ..LostOrders::default() },
        ..Summary::default()
    };
    commit_all(tables.finish(export, &summary, surface)?)
}

/// A height map of 4 × 3 mm with a hole: 1 µm a mm along x, with waves of 0.1 µm.
pub(crate) fn heights() -> HeightGrid {
    let (columns, rows) = (41, 31);
    let height_nm = |index: usize| {
        let [x, y] = [0.1 * (index % columns) as f64, 0.1 * (index / columns) as f64];
        let is_hole = (x - 2.0).hypot(y - 1.5) < 0.45;
        if is_hole { f64::NAN } else { 1000.0 * (x - 2.0) + 100.0 * (3.0 * y).sin() }
    };
    HeightGrid {
        columns,
        step_x_mm: 0.1,
        step_y_mm: 0.1,
        origin_x_mm: 1.0,
        origin_y_mm: -2.0,
        std_nm: None,
        height_nm: (0..columns * rows).map(height_nm).collect(),
    }
}

/// Runs an exporter over heights.
pub(crate) fn export_heights(exporter: &dyn Exporter, heights: &HeightGrid) -> Result<Vec<PathBuf>, Error> {
    let export = exporter.begin(&ResultInfo::default())?;
    let (summary, about) = (Summary { title: "Flat".into(), ..Summary::default() }, About::default());
    let result = Completed {
        summary: &summary,
        about: &about,
        surface: None,
        heights: Some(heights),
        diagnosis: None,
        overview: None,
    };
    commit_all(export.finish(&result)?)
}

/// A form that holds orders 2 to 250, of which the surface's 360 angles hold 179.
fn station() -> StationResult {
    let mut estimate = vec![Complex64::ZERO; 251];
    estimate[2..].fill(Complex64::new(0.1, 0.0));
    StationResult {
        station: "s1".into(),
        z_mm: 0.0,
        angles: ANGLES,
        separation: Separation {
            sections: vec![SectionAt::whole("a", 0.0)],
            unknowns: vec![Quantity::Form(0)],
            variance: vec![f64::NAN; estimate.len()],
            observable: vec![true; estimate.len()],
            estimate,
            ..Separation::default()
        },
        profiles: Vec::new(),
        truth: None,
    }
}

/// Whether every edge belongs to two triangles, which pass it in opposite directions.
pub(crate) fn is_closed(triangles: &[[u32; 3]]) -> bool {
    let mut edges = std::collections::HashMap::new();
    for [a, b, c] in triangles {
        for edge in [(a, b), (b, c), (c, a)] {
            *edges.entry(edge).or_insert(0) += 1;
        }
    }
    edges.iter().all(|((from, to), count)| *count == 1 && edges.get(&(*to, *from)) == Some(&1))
}

/// What triangles enclose, by the divergence theorem; above 0 where they face outward.
pub(crate) fn enclosed_mm3(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> f64 {
    let of = |triangle: &[u32; 3]| {
        let [a, b, c] = triangle.map(|corner| positions[corner as usize]);
        let cross = [b[1] * c[2] - b[2] * c[1], b[2] * c[0] - b[0] * c[2], b[0] * c[1] - b[1] * c[0]];
        (a[0] * cross[0] + a[1] * cross[1] + a[2] * cross[2]) / 6.0
    };
    triangles.iter().map(of).sum()
}

/// Names in a folder.
pub(crate) fn names(folder: &Path) -> Vec<String> {
    let mut names: Vec<String> =
        std::fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// Says that a foreign program is not there; fails where it has to be.
pub(crate) fn skip(what: &str) {
    assert!(std::env::var_os("RUNOUT_REQUIRE_FOREIGN").is_none_or(|value| value != "1"), "{what}");
    eprintln!("skipped: {what}");
}

/// What trimesh sees in a mesh file, as JSON; `None` where it is not installed.
pub(crate) fn trimesh(file: &Path) -> Option<serde_json::Value> {
    let python = std::env::var_os("RUNOUT_PYTHON").unwrap_or_else(|| "python3".into());
    let there = Command::new(&python).args(["-c", "import trimesh"]).output().is_ok_and(|found| found.status.success());
    if !there {
        skip("trimesh is not installed for RUNOUT_PYTHON (default python3)");
        return None;
    }
    let script = concat!(env!("CARGO_MANIFEST_DIR"), "/../mesh/tests/support/trimesh_report.py");
    let output = Command::new(&python).arg(script).arg(file).output().unwrap();
    Some(report(&output))
}

/// One watertight piece, as trimesh loads it, with and without its merging of vertices; and for MeshLab where it is installed.
pub(crate) fn closed(found: &serde_json::Value) {
    for way in ["as_written", "merged"] {
        let solid = &found[way];
        for key in ["watertight", "winding_consistent", "is_volume"] {
            assert_eq!(solid[key], true, "{way}, {key}: {found:#}");
        }
        assert_eq!(solid["body_count"], 1, "{way}: {found:#}");
        assert!(solid["volume"].as_f64().unwrap() > 0.0, "{way}: {found:#}");
    }
    if let Some(meshlab) = found["meshlab"].as_object() {
        for (key, expected) in
            [("boundary_edges", 0), ("non_two_manifold_edges", 0), ("connected_components_number", 1)]
        {
            assert_eq!(meshlab[key], expected, "{key}: {found:#}");
        }
    } else {
        skip("pymeshlab is not installed for RUNOUT_PYTHON (default python3)");
    }
}

/// The JSON that a foreign program printed.
pub(crate) fn report(output: &Output) -> serde_json::Value {
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    serde_json::from_slice(&output.stdout).unwrap()
}
