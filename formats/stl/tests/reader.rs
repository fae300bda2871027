//! Files read back triangle by triangle, and by trimesh and MeshLab where they are installed.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "../../mesh/tests/support/mod.rs"]
mod support;

use std::{collections::HashMap, path::Path};

use runout_core::pipeline::Registry;
use support::{
    ANGLES, enclosed_mm3, export, export_heights, exporter, heights, is_closed, names, surface, trimesh, volume_mm3,
};

const RINGS: usize = 10;

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_stl::register(&mut registry);
    registry
}

/// Header, positions, triangles, normals.
type Stl = (String, Vec<[f64; 3]>, Vec<[u32; 3]>, Vec<[f64; 3]>);

/// The header, vertices that are equal to the last bit as one, and triangles of them with their normals.
fn read(file: &Path) -> Stl {
    let bytes = std::fs::read(file).unwrap();
    let count = u32::from_le_bytes(bytes[80..84].try_into().unwrap()) as usize;
    assert_eq!(bytes.len(), 84 + 50 * count);
    let mut known: HashMap<[u8; 12], u32> = HashMap::new();
    let (mut positions, mut triangles, mut normals) = (Vec::new(), Vec::new(), Vec::new());
    let vector =
        |at: &[u8]| [0, 4, 8].map(|start| f64::from(f32::from_le_bytes(at[start..start + 4].try_into().unwrap())));
    for facet in bytes[84..].chunks(50) {
        normals.push(vector(&facet[..12]));
        triangles.push([12, 24, 36].map(|start| {
            let corner = &facet[start..start + 12];
            *known.entry(corner.try_into().unwrap()).or_insert_with(|| {
                positions.push(vector(corner));
                positions.len() as u32 - 1
            })
        }));
    }
    (String::from_utf8(bytes[..80].to_vec()).unwrap(), positions, triangles, normals)
}

#[test]
fn a_capped_part_is_a_solid_that_faces_outward() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"stl\"\npath = \"part.stl\"\ncapped = true\nmagnification = 1000";
    let files = export(&*exporter(&registry(), toml, folder.path()).unwrap(), Some(&surface)).unwrap();
    assert_eq!(names(folder.path()), ["part-x1000.stl", "part.stl"]);
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let (header, positions, triangles, normals) = read(file);
        assert!(!header.starts_with("solid") && header.contains(&format!(", mm, x{scale}, blake3:")), "{header}");
        assert_eq!(positions.len(), RINGS * ANGLES + 2 * (ANGLES + 1));
        assert!(is_closed(&triangles));
        let (found, expected) = (enclosed_mm3(&positions, &triangles), volume_mm3(&surface, scale));
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-6 mm (1e-7).
        assert!((found / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{found} {expected}");
        for ([a, ..], normal) in triangles.iter().zip(&normals) {
            let [x, y, z] = positions[*a as usize];
            let length = normal.iter().map(|part| part * part).sum::<f64>();
            assert!((length - 1.0).abs() < 1e-6, "{normal:?}");
            // Of the wall away from the axis, of the ends away from the middle.
            let outward = if normal[2].abs() > 0.999 { (z - 12.0) * normal[2] } else { x * normal[0] + y * normal[1] };
            assert!(outward > 0.0 || scale > 1.0, "{normal:?} at {x} {y} {z}");
        }
        if let Some(found) = trimesh(file) {
            // Vertices are not shared in the file: what is read without merging them is triangles alone.
            for key in ["watertight", "winding_consistent", "is_volume"] {
                assert_eq!(found["merged"][key], true, "{key}: {found:#}");
            }
            assert_eq!(found["merged"]["body_count"], 1, "{found:#}");
            assert!((found["merged"]["volume"].as_f64().unwrap() / expected - 1.0).abs() < 1e-4);
        }
    }
}

#[test]
fn a_part_without_ends_and_a_map_are_open() {
    let folder = tempfile::tempdir().unwrap();
    let exporter = exporter(&registry(), "plugin = \"stl\"\npath = \"part.stl\"", folder.path()).unwrap();
    let files = export(&*exporter, Some(&surface())).unwrap();
    let (_, positions, triangles, _) = read(&files[0]);
    assert_eq!((positions.len(), triangles.len()), (RINGS * ANGLES, 2 * (RINGS - 1) * ANGLES));
    assert!(!is_closed(&triangles));
    let heights = heights();
    let files = export_heights(&*exporter, &heights).unwrap();
    let (_, positions, _, normals) = read(&files[0]);
    assert_eq!(positions.len(), heights.height_nm.len() - heights.holes());
    assert!(normals.iter().all(|normal| normal[2] > 0.99), "upwards");
}
