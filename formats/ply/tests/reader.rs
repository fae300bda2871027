//! Files read back property by property, and by trimesh and MeshLab where they are installed.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "../../mesh/tests/support/mod.rs"]
mod support;

use std::path::Path;

use runout_core::pipeline::Registry;
use support::{
    ANGLES, RADIUS_MM, angle, closed, deviation_um, enclosed_mm3, export, export_heights, exporter, heights, is_closed,
    names, surface, trimesh, volume_mm3,
};

const RINGS: usize = 10;
/// Bytes of a vertex and of a triangle.
const VERTEX: usize = 7 * 4 + 3;
const FACE: usize = 1 + 3 * 4;

/// A file as its header describes it.
struct Ply {
    comments: Vec<String>,
    positions: Vec<[f64; 3]>,
    normals: Vec<[f64; 3]>,
    colours: Vec<[u8; 3]>,
    quality: Vec<f64>,
    triangles: Vec<[u32; 3]>,
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_ply::register(&mut registry);
    registry
}

fn read(file: &Path) -> Ply {
    let bytes = std::fs::read(file).unwrap();
    let end = bytes.windows(11).position(|window| window == b"end_header\n").unwrap() + 11;
    let header = String::from_utf8(bytes[..end].to_vec()).unwrap();
    let lines: Vec<&str> = header.lines().collect();
    assert_eq!(lines[..2], ["ply", "format binary_little_endian 1.0"]);
    let comments = lines.iter().filter_map(|line| line.strip_prefix("comment ")).map(str::to_owned).collect();
    let body: Vec<&str> = lines[2..].iter().copied().filter(|line| !line.starts_with("comment ")).collect();
    let count = |line: &str, name: &str| line.strip_prefix(name).unwrap().parse::<usize>().unwrap();
    let [vertices, triangles] = [count(body[0], "element vertex "), count(body[11], "element face ")];
    let properties: Vec<&str> = body[1..11].iter().map(|line| line.strip_prefix("property ").unwrap()).collect();
    let expected = [
        "float x",
        "float y",
        "float z",
        "float nx",
        "float ny",
        "float nz",
        "uchar red",
        "uchar green",
        "uchar blue",
        "float quality",
    ];
    assert_eq!(properties, expected);
    assert_eq!(body[12..], ["property list uchar int vertex_indices", "end_header"]);
    assert_eq!(bytes.len(), end + VERTEX * vertices + FACE * triangles);
    let (of_vertices, of_faces) = bytes[end..].split_at(VERTEX * vertices);
    let mut ply =
        Ply { comments, positions: vec![], normals: vec![], colours: vec![], quality: vec![], triangles: vec![] };
    for vertex in of_vertices.chunks(VERTEX) {
        let float = |at: usize| f64::from(f32::from_le_bytes(vertex[at..at + 4].try_into().unwrap()));
        ply.positions.push([0, 4, 8].map(float));
        ply.normals.push([12, 16, 20].map(float));
        ply.colours.push(vertex[24..27].try_into().unwrap());
        ply.quality.push(float(27));
    }
    for face in of_faces.chunks(FACE) {
        assert_eq!(face[0], 3);
        ply.triangles.push([1, 5, 9].map(|at| u32::from_le_bytes(face[at..at + 4].try_into().unwrap())));
    }
    ply
}

#[test]
fn every_vertex_has_its_place_colour_and_deviation() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"ply\"\npath = \"part.ply\"\nmagnification = 1000";
    let files = export(&*exporter(&registry(), toml, folder.path()).unwrap(), Some(&surface)).unwrap();
    assert_eq!(names(folder.path()), ["part-x1000.ply", "part.ply"]);
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let ply = read(file);
        assert_eq!((ply.positions.len(), ply.triangles.len()), (RINGS * ANGLES, 2 * (RINGS - 1) * ANGLES));
        assert!(ply.comments.contains(&format!("scale: deviations drawn x{scale}")), "{:?}", ply.comments);
        assert!(ply.comments.iter().any(|line| line.contains(&surface.checksum())));
        for (index, position) in ply.positions.iter().enumerate() {
            let (ring, index) = (index / ANGLES, index % ANGLES);
            let expected_um = deviation_um(angle(index), surface.z_mm[ring]);
            let radius = RADIUS_MM + 1e-3 * scale * expected_um;
            // An f32 near 24 mm is good to 2e-6 mm; the deviation, below 16 µm, to 1e-6 µm.
            for (found, expected) in
                position.iter().zip([radius * angle(index).cos(), radius * angle(index).sin(), surface.z_mm[ring]])
            {
                assert!((found - expected).abs() < 2e-6, "{position:?}");
            }
            let place = ring * ANGLES + index;
            assert!((ply.quality[place] - expected_um).abs() < 1e-6);
            let [red, _, blue] = ply.colours[place];
            assert!(
                expected_um.abs() < 0.1 || (red > blue) == (expected_um > 0.0),
                "{:?} {expected_um}",
                ply.colours[place]
            );
            let outward = position[0] * ply.normals[place][0] + position[1] * ply.normals[place][1];
            assert!(outward > 0.0);
        }
        assert!(!is_closed(&ply.triangles));
    }
}

#[test]
fn a_capped_mesh_is_a_solid() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"ply\"\npath = \"part.ply\"\ncapped = true\nmagnification = 1000";
    let files = export(&*exporter(&registry(), toml, folder.path()).unwrap(), Some(&surface)).unwrap();
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let ply = read(file);
        assert_eq!(ply.positions.len(), RINGS * ANGLES + 2 * (ANGLES + 1));
        assert!(is_closed(&ply.triangles));
        let expected = volume_mm3(&surface, scale);
        let found = enclosed_mm3(&ply.positions, &ply.triangles);
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-6 mm (1e-7).
        assert!((found / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{found} {expected}");
        // What is drawn and not measured has no deviation.
        assert!(ply.quality[..RINGS * ANGLES].iter().all(|quality| quality.is_finite()));
        assert!(ply.quality[RINGS * ANGLES..].iter().all(|quality| quality.is_nan()));
        if let Some(found) = trimesh(file) {
            closed(&found);
            assert!((found["volume"].as_f64().unwrap() / expected - 1.0).abs() < 1e-4);
            assert!(found["colours"].as_u64().unwrap() > 100);
        }
    }
}

#[test]
fn a_height_map_keeps_its_hole() {
    let folder = tempfile::tempdir().unwrap();
    let toml = "plugin = \"ply\"\npath = \"flat.ply\"";
    let heights = heights();
    let files = export_heights(&*exporter(&registry(), toml, folder.path()).unwrap(), &heights).unwrap();
    let ply = read(&files[0]);
    assert_eq!(ply.positions.len(), heights.height_nm.len() - heights.holes());
    let known: Vec<f64> = heights.height_nm.iter().copied().filter(|height| height.is_finite()).collect();
    for (found, expected_nm) in ply.quality.iter().zip(known) {
        assert!((found - 1e-3 * expected_nm).abs() < 1e-6);
    }
    let closed = format!("{toml}\ncapped = true");
    let refused = export_heights(&*exporter(&registry(), &closed, folder.path()).unwrap(), &heights).unwrap_err();
    assert!(refused.to_string().contains("capped"), "{refused}");
}
