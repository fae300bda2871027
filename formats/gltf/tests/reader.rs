//! Files read back with the gltf crate.

#![allow(clippy::unwrap_used, clippy::float_cmp, reason = "tests; some numbers are exact by contract")]

use std::{
    collections::{HashMap, HashSet},
    path::Path,
};

use crate::support::{
    ANGLES, RADIUS_MM, angle, deviation_um, export, export_heights, exporter, heights, names, surface, volume_mm3,
};
use gltf::{Accessor, Gltf, Semantic};
use runout_core::{pipeline::Registry, stage::Takes, surface::Surface};

const RINGS: usize = 10;

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_gltf::register(&mut registry);
    registry
}

struct Read {
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
    colours: Vec<[u8; 4]>,
    deviation_um: Vec<f32>,
    triangles: Vec<[u32; 3]>,
    min: [f32; 3],
    max: [f32; 3],
    extras: serde_json::Value,
}

/// Words of four bytes, so many an element.
fn words<const N: usize>(blob: &[u8], accessor: &Accessor) -> Vec<[[u8; 4]; N]> {
    assert_eq!(accessor.size(), 4 * N);
    let view = accessor.view().unwrap();
    let start = view.offset() + accessor.offset();
    let stride = view.stride().unwrap_or(accessor.size());
    let element = |index: usize| &blob[start + index * stride..][..4 * N];
    let word = |bytes: &[u8], index: usize| <[u8; 4]>::try_from(&bytes[4 * index..][..4]).unwrap();
    (0..accessor.count()).map(|index| std::array::from_fn(|part| word(element(index), part))).collect()
}

fn read(file: &Path) -> Read {
    let Gltf { document, blob } = Gltf::open(file).unwrap();
    let blob = blob.unwrap();
    let mesh = document.default_scene().unwrap().nodes().next().unwrap().mesh().unwrap();
    let primitive = mesh.primitives().next().unwrap();
    assert!(primitive.material().index().is_none());
    let get = |semantic: Semantic| primitive.get(&semantic).unwrap();
    let vectors = |semantic| words::<3>(&blob, &get(semantic)).into_iter().map(|item| item.map(f32::from_le_bytes));
    let indices = words::<1>(&blob, &primitive.indices().unwrap());
    let indices: Vec<u32> = indices.into_iter().map(|[index]| u32::from_le_bytes(index)).collect();
    let corner = |value: Option<serde_json::Value>| serde_json::from_value(value.unwrap()).unwrap();
    let deviation_um = words::<1>(&blob, &get(Semantic::Extras("DEVIATION_UM".into())));
    Read {
        positions: vectors(Semantic::Positions).collect(),
        normals: vectors(Semantic::Normals).collect(),
        colours: words::<1>(&blob, &get(Semantic::Colors(0))).into_iter().map(|[colour]| colour).collect(),
        deviation_um: deviation_um.into_iter().map(|[value]| f32::from_le_bytes(value)).collect(),
        triangles: indices.chunks(3).map(|corners| corners.try_into().unwrap()).collect(),
        min: corner(get(Semantic::Positions).min()),
        max: corner(get(Semantic::Positions).max()),
        extras: serde_json::from_str(mesh.extras().as_ref().unwrap().get()).unwrap(),
    }
}

fn written(keys: &str, surface: &Surface) -> Vec<Read> {
    let folder = tempfile::tempdir().unwrap();
    let toml = format!("plugin = \"gltf\"\npath = \"out/part.glb\"\n{keys}");
    let exporter = exporter(&registry(), &toml, folder.path()).unwrap();
    let files = export(&*exporter, Some(surface)).unwrap();
    assert_eq!(files, exporter.outputs(&[]));
    assert_eq!(names(&folder.path().join("out")).len(), files.len());
    files.iter().map(|file| read(file)).collect()
}

fn minus(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

fn cross(a: [f64; 3], b: [f64; 3]) -> [f64; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

fn dot(a: [f64; 3], b: [f64; 3]) -> f64 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

#[test]
fn every_vertex_is_where_it_was_measured() {
    let surface = surface();
    let [read] = written("", &surface).try_into().ok().unwrap();
    assert_eq!(read.positions.len(), RINGS * ANGLES);
    assert_eq!(read.triangles.len(), 2 * (RINGS - 1) * ANGLES);
    for (index, (position, deviation)) in read.positions.iter().zip(&read.deviation_um).enumerate() {
        let (angle, z_mm) = (angle(index % ANGLES), surface.z_mm[index / ANGLES]);
        let expected_um = deviation_um(angle, z_mm);
        // Half a unit in the last place of an f32 near 8.
        assert!((f64::from(*deviation) - expected_um).abs() < 5e-7);
        let [x, y, z] = position.map(f64::from);
        // An f32 near 0.015 m is good to 1e-9 m; +Y is the spindle's z, and the part's angle runs from x to −Z.
        assert!((x.hypot(z) - 1e-3 * (RADIUS_MM + 1e-3 * expected_um)).abs() < 2e-9);
        assert!((y - 1e-3 * z_mm).abs() < 2e-9);
        let (sine, cosine) = (angle - (-z).atan2(x)).sin_cos();
        assert!(sine.abs() < 1e-6 && cosine > 0.0);
    }
    for axis in 0..3 {
        let values = || read.positions.iter().map(|position| position[axis]);
        assert_eq!(values().fold(f32::INFINITY, f32::min), read.min[axis]);
        assert_eq!(values().fold(f32::NEG_INFINITY, f32::max), read.max[axis]);
    }
}

#[test]
fn a_capped_mesh_is_a_solid_that_faces_outward() {
    let surface = surface();
    for (read, scale) in written("capped = true\nmagnification = 1000", &surface).into_iter().zip([1.0, 1000.0]) {
        assert_eq!(read.positions.len(), RINGS * ANGLES + 2 * (ANGLES + 1));
        // No two vertices are in one place: a reader that compares them by their numbers finds one closed piece.
        let places: HashSet<_> = read.positions.iter().map(|position| position.map(f32::to_bits)).collect();
        assert_eq!(places.len(), read.positions.len());
        let mut edges = HashMap::new();
        let mut volume = 0.0;
        for triangle in &read.triangles {
            let corners = triangle.map(|vertex| read.positions[vertex as usize].map(f64::from));
            volume += dot(corners[0], cross(corners[1], corners[2])) / 6.0;
            // Each face looks where its corners' normals look.
            let face = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
            // The rim has the wall's normals.
            let wall = |vertex: &&u32| (**vertex as usize) < RINGS * ANGLES;
            let of_cap = triangle.iter().any(|vertex| !wall(&vertex));
            for vertex in triangle.iter().filter(|vertex| !(of_cap && wall(vertex))) {
                assert!(dot(face, read.normals[*vertex as usize].map(f64::from)) > 0.0);
            }
            for (from, to) in [(0, 1), (1, 2), (2, 0)] {
                *edges.entry((triangle[from], triangle[to])).or_insert(0) += 1;
            }
        }
        assert!(edges.iter().all(|((from, to), count)| *count == 1 && edges.get(&(*to, *from)) == Some(&1)));
        let expected = 1e-9 * volume_mm3(&surface, scale);
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-9 m (1e-7).
        assert!((volume / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{volume} {expected}");
    }
}

#[test]
fn normals_are_units_that_point_away_from_the_axis() {
    for read in written("capped = true\nmagnification = 500", &surface()) {
        let wall = RINGS * ANGLES;
        for (index, (normal, position)) in read.normals.iter().zip(&read.positions).enumerate() {
            let normal = normal.map(f64::from);
            // Rounding of three f32 near 1.
            assert!((dot(normal, normal).sqrt() - 1.0).abs() < 2e-7);
            if index < wall {
                assert!(normal[0] * f64::from(position[0]) + normal[2] * f64::from(position[2]) > 0.0);
            } else {
                assert_eq!(normal, [0.0, if index <= wall + ANGLES { -1.0 } else { 1.0 }, 0.0]);
            }
        }
    }
}

#[test]
fn colours_follow_the_deviation_in_linear_light() {
    let surface = surface();
    let [read] = written("colour_range_um = 5\ncapped = true", &surface).try_into().ok().unwrap();
    for (colour, deviation) in read.colours.iter().zip(&surface.deviation_um) {
        assert_eq!(colour[3], 255);
        // sRGB (158, 20, 42) and (28, 58, 148) in linear light, and 236 between them.
        match deviation {
            5.0.. => assert_eq!(colour[..3], [87, 2, 6]),
            ..=-5.0 => assert_eq!(colour[..3], [3, 11, 76]),
            0.1.. => assert!(colour[0] > colour[2]),
            ..=-0.1 => assert!(colour[0] < colour[2]),
            _ => assert!(colour[..3].iter().all(|channel| *channel > 180)),
        }
    }
    // Caps: sRGB 150 all round.
    assert!(read.colours[RINGS * ANGLES..].iter().all(|colour| *colour == [78, 78, 78, 255]));
    assert!(read.deviation_um[RINGS * ANGLES..].iter().all(|deviation| *deviation == 0.0));
}

#[test]
fn a_perfect_cylinder_is_drawn_in_the_middle_colour() {
    let mut surface = surface();
    surface.deviation_um.fill(0.0);
    let [read] = written("", &surface).try_into().ok().unwrap();
    assert!(read.colours.windows(2).all(|pair| pair[0] == pair[1]));
}

#[test]
fn extras_say_what_it_is() {
    let surface = surface();
    let [plain, magnified] = written("magnification = 2.5", &surface).try_into().ok().unwrap();
    for (read, scale) in [(plain, 1.0), (magnified, 2.5)] {
        assert_eq!(read.extras["title"], "Waisted part\nwith a second line");
        assert_eq!(read.extras["unit"], "m");
        assert_eq!(read.extras["scale"], scale);
        assert_eq!(read.extras["radius_mm"], RADIUS_MM);
        assert_eq!(read.extras["band_upr"], serde_json::json!([2, 179]));
        assert_eq!(read.extras["lost_orders"], serde_json::json!([4]));
        assert_eq!(read.extras["checksum"], format!("blake3:{}", surface.checksum()));
        assert_eq!(read.extras["inputs"][0]["blake3"], "00ff");
    }
}

#[test]
fn failure_leaves_what_was_there() {
    let folder = tempfile::tempdir().unwrap();
    std::fs::write(folder.path().join("part.glb"), "before").unwrap();
    let build = |keys: &str| {
        let toml = format!("plugin = \"gltf\"\npath = \"part.glb\"\n{keys}");
        exporter(&registry(), &toml, folder.path()).unwrap()
    };
    let error = export(&*build(""), None).unwrap_err();
    assert!(error.to_string().contains("no surface"), "{error}");
    // 15 mm of radius and −7 µm drawn 10000 times larger.
    let error = export(&*build("magnification = 10000"), Some(&surface())).unwrap_err();
    assert!(error.advice().unwrap().contains("magnification"), "{error}");
    assert_eq!(names(folder.path()), ["part.glb"]);
    assert_eq!(std::fs::read(folder.path().join("part.glb")).unwrap(), b"before");
    assert_eq!(build("").takes(), Takes::Surface);
}

#[test]
fn wrong_keys_are_refused_by_name() {
    let refused = |keys: &str| {
        let toml = format!("plugin = \"gltf\"\n{keys}");
        exporter(&registry(), &toml, Path::new(".")).err().unwrap().to_string()
    };
    assert!(refused("path = \"part.gltf\"").contains("ending in .glb"));
    assert!(refused("path = \"\"").contains("ending in .glb"));
    assert!(refused("path = \"a.glb\"\nmagnification = 1").contains("above 1"));
    assert!(refused("path = \"a.glb\"\nmagnification = nan").contains("above 1"));
    assert!(refused("path = \"a.glb\"\ncolour_range_um = 0").contains("above 0"));
    assert!(refused("path = \"a.glb\"\ncaps = true").contains("caps"));
    assert!(refused("").contains("path"));
}

#[test]
fn a_height_map_is_an_open_sheet_with_its_hole() {
    let folder = tempfile::tempdir().unwrap();
    let build = |keys: &str| {
        let toml = format!("plugin = \"gltf\"\npath = \"out/flat.glb\"\n{keys}");
        exporter(&registry(), &toml, folder.path()).unwrap()
    };
    let heights = heights();
    let files = export_heights(&*build("magnification = 1000"), &heights).unwrap();
    let [plain, magnified] = [&files[0], &files[1]].map(|file| read(file));
    let there: Vec<usize> = (0..heights.height_nm.len()).filter(|node| heights.height_nm[*node].is_finite()).collect();
    assert!(heights.holes() > 20);
    for (found, scale) in [(&plain, 1.0), (&magnified, 1000.0)] {
        assert_eq!(found.positions.len(), there.len());
        for ((position, deviation), node) in found.positions.iter().zip(&found.deviation_um).zip(&there) {
            let (row, column) = (node / heights.columns, node % heights.columns);
            let height_nm = heights.height_nm[*node];
            // +Y is the height, and the map's y runs to −Z.
            let expected = [1.0 + 0.1 * column as f64, scale * 1e-6 * height_nm, 2.0 - 0.1 * row as f64];
            for (found, expected_mm) in position.iter().zip(expected) {
                assert!((f64::from(*found) - 1e-3 * expected_mm).abs() < 1e-9, "{position:?} {expected:?}");
            }
            assert!((f64::from(*deviation) - 1e-3 * height_nm).abs() < 1e-6);
        }
        let area = |triangle: &[u32; 3]| {
            let [a, b, c] = triangle.map(|vertex| found.positions[vertex as usize].map(|part| 1e3 * f64::from(part)));
            cross(minus(b, a), minus(c, a))[1]
        };
        assert!(found.triangles.iter().all(|triangle| area(triangle) > 0.0));
        // 12 mm² less a hole of 0.45 mm, up to the triangles at its edge.
        let whole: f64 = found.triangles.iter().map(|triangle| 0.5 * area(triangle)).sum();
        assert!((10.9..11.4).contains(&whole), "{whole}");
        assert_eq!(found.extras["scale"], scale);
        assert_eq!(found.extras.get("radius_mm"), None);
    }
    assert_eq!(plain.extras["checksum"], format!("blake3:{}", heights.checksum()));
    let error = export_heights(&*build("capped = true"), &heights).unwrap_err().to_string();
    assert!(error.contains("capped"), "{error}");
}
