//! Files read back with tobj, and by trimesh where it is installed.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "../../mesh/tests/support/mod.rs"]
mod support;

use std::{
    collections::{HashMap, HashSet},
    f64::consts::TAU,
    path::Path,
};

use runout_core::pipeline::Registry;
use support::{
    ANGLES, RADIUS_MM, angle, closed, deviation_um, export, export_heights, exporter, heights, names, surface, trimesh,
    volume_mm3,
};
use tobj::{LoadOptions, Mesh};

const RINGS: usize = 10;

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_obj::register(&mut registry);
    registry
}

/// Reads positions, colours and normals with indices of their own.
fn read(file: &Path) -> Mesh {
    let (models, _) = tobj::load_obj(file, &LoadOptions::default()).unwrap();
    assert_eq!(models.len(), 1);
    models.into_iter().next().unwrap().mesh
}

fn vectors(flat: &[f32]) -> Vec<[f64; 3]> {
    flat.chunks(3).map(|item| [item[0].into(), item[1].into(), item[2].into()]).collect()
}

#[test]
fn every_vertex_is_where_it_was_measured() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let exporter = exporter(&registry(), "plugin = \"obj\"\npath = \"part.obj\"", folder.path()).unwrap();
    let files = export(&*exporter, Some(&surface)).unwrap();
    assert_eq!(files, exporter.outputs(&[]));
    assert_eq!(names(folder.path()), ["part.obj"]);
    let mesh = read(&files[0]);
    let positions = vectors(&mesh.positions);
    assert_eq!(positions.len(), RINGS * ANGLES);
    assert_eq!(mesh.indices.len(), 6 * (RINGS - 1) * ANGLES);
    assert_eq!(mesh.indices, mesh.normal_indices);
    let colours = vectors(&mesh.vertex_color);
    assert_eq!(colours.len(), RINGS * ANGLES);
    assert!(colours.iter().flatten().all(|channel| (0.0..=1.0).contains(channel)));
    // tobj gives vertices in the order in which triangles use them.
    let mut met = HashSet::new();
    for ([x, y, z], colour) in positions.into_iter().zip(colours) {
        let index = (y.atan2(x).rem_euclid(TAU) / TAU * ANGLES as f64).round() as usize % ANGLES;
        let ring = surface.z_mm.iter().position(|ring| (z - ring).abs() < 1e-6).unwrap();
        assert!(met.insert((ring, index)));
        let (angle, expected_um) = (angle(index), deviation_um(angle(index), surface.z_mm[ring]));
        let radius = RADIUS_MM + 1e-3 * expected_um;
        // An f32 near 15 mm is good to 1e-6 mm.
        assert!((x - radius * angle.cos()).abs() < 1e-6);
        assert!((y - radius * angle.sin()).abs() < 1e-6);
        assert!(expected_um.abs() < 0.1 || (colour[0] > colour[2]) == (expected_um > 0.0));
    }
}

#[test]
fn a_capped_mesh_is_closed_by_its_indices_and_faces_outward() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"obj\"\npath = \"part.obj\"\ncapped = true\nmagnification = 1000";
    let files = export(&*exporter(&registry(), toml, folder.path()).unwrap(), Some(&surface)).unwrap();
    assert_eq!(names(folder.path()), ["part-x1000.obj", "part.obj"]);
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let mesh = read(file);
        let (positions, normals) = (vectors(&mesh.positions), vectors(&mesh.normals));
        assert_eq!(positions.len(), RINGS * ANGLES + 2 * (ANGLES + 1));
        assert_eq!(mesh.indices, mesh.normal_indices);
        let mut edges = HashMap::new();
        let mut volume = 0.0;
        for (triangle, looks) in mesh.indices.chunks(3).zip(mesh.normal_indices.chunks(3)) {
            let [a, b, c] = [0, 1, 2].map(|corner| positions[triangle[corner] as usize]);
            let cross = |a: [f64; 3], b: [f64; 3]| {
                [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
            };
            let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
            let side = |to: [f64; 3]| [to[0] - a[0], to[1] - a[1], to[2] - a[2]];
            volume += dot(a, cross(b, c)) / 6.0;
            let corners = [a, b, c];
            let flat = corners.iter().all(|corner| corner[2].to_bits() == a[2].to_bits());
            for normal in looks {
                let normal = normals[*normal as usize];
                // The rim of a flat end has the wall's normals, its own vertices those of the end.
                let of_rim = flat && normal[2].abs() < 0.999;
                assert!(dot(cross(side(b), side(c)), normal) > 0.0 || of_rim);
                // Rounding of three f32 near 1.
                assert!((dot(normal, normal).sqrt() - 1.0).abs() < 2e-7);
            }
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry((triangle[from], triangle[to])).or_insert(0) += 1;
            }
        }
        assert!(edges.iter().all(|((from, to), count)| *count == 1 && edges.get(&(*to, *from)) == Some(&1)));
        let expected = volume_mm3(&surface, scale);
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-6 mm (1e-7).
        assert!((volume / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{volume} {expected}");
        if let Some(found) = trimesh(file) {
            closed(&found);
            assert!((found["volume"].as_f64().unwrap() / expected - 1.0).abs() < 1e-4);
            assert!(found["colours"].as_u64().unwrap() > 100);
        }
    }
}

#[test]
fn comments_say_what_it_is() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"obj\"\npath = \"part.obj\"\nmagnification = 2.5";
    let files = export(&*exporter(&registry(), toml, folder.path()).unwrap(), Some(&surface)).unwrap();
    let text = std::fs::read_to_string(&files[1]).unwrap();
    let comments: Vec<&str> = text.lines().take_while(|line| line.starts_with('#')).collect();
    // A title of two lines must not end the comment.
    assert_eq!(comments[0], "# title: Waisted part with a second line");
    for expected in ["# unit: mm", "# scale: deviations drawn x2.5", "# band_upr: 2 to 179", "# lost_orders: 4"] {
        assert!(comments.contains(&expected), "{expected} in {comments:#?}");
    }
    assert!(comments.iter().any(|line| line.contains(&surface.checksum())));
}

#[test]
fn failure_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("part.obj"), "before").unwrap();
    let exporter = exporter(&registry(), "plugin = \"obj\"\npath = \"part.obj\"", folder.path()).unwrap();
    assert!(export(&*exporter, None).unwrap_err().to_string().contains("no surface"));
    assert_eq!(names(folder.path()), ["part.obj"]);
    assert_eq!(std::fs::read(folder.path().join("part.obj")).unwrap(), b"before");
}

#[test]
fn a_height_map_is_an_open_sheet_with_its_hole() {
    let folder = tempfile::tempdir().unwrap();
    let exporter =
        exporter(&registry(), "plugin = \"obj\"\npath = \"flat.obj\"\nmagnification = 1000", folder.path()).unwrap();
    let heights = heights();
    let files = export_heights(&*exporter, &heights).unwrap();
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let mesh = read(file);
        let positions = vectors(&mesh.positions);
        assert_eq!(positions.len(), heights.height_nm.len() - heights.holes());
        assert_eq!(mesh.indices, mesh.normal_indices);
        let mut met = HashSet::new();
        for [x, y, z] in positions {
            let [column, row] = [(x - 1.0) / 0.1, (y + 2.0) / 0.1].map(|place| place.round() as usize);
            let height_nm = heights.height_nm[row * heights.columns + column];
            assert!(met.insert((row, column)));
            assert!((z - scale * 1e-6 * height_nm).abs() < 1e-6 * scale.max(1.0) * 1e-3 + 1e-9, "{z} {height_nm}");
        }
        // Without a title of its own, the text still says which way is up.
        assert!(std::fs::read_to_string(file).unwrap().contains("z upwards"));
    }
}
