//! Files read back part by part, and by trimesh and MeshLab where they are installed.

#![allow(clippy::unwrap_used, reason = "tests")]

#[path = "../../mesh/tests/support/mod.rs"]
mod support;

use std::{fs::File, io::Read, path::Path};

use quick_xml::{Reader, events::Event};
use runout_core::pipeline::Registry;
use support::{
    ANGLES, closed, enclosed_mm3, export, export_heights, exporter, heights, is_closed, names, surface, trimesh,
    volume_mm3,
};

const RINGS: usize = 10;

#[derive(Default)]
struct Model {
    unit: String,
    kind: String,
    metadata: String,
    colours: Vec<String>,
    positions: Vec<[f64; 3]>,
    triangles: Vec<[u32; 3]>,
    places: Vec<usize>,
}

fn registry() -> Registry {
    let mut registry = Registry::default();
    runout_3mf::register(&mut registry);
    registry
}

fn read(file: &Path) -> Model {
    let mut archive = zip::ZipArchive::new(File::open(file).unwrap()).unwrap();
    assert_eq!(archive.file_names().count(), 3);
    let mut part = |name: &str| {
        let mut text = String::new();
        archive.by_name(name).unwrap().read_to_string(&mut text).unwrap();
        text
    };
    assert!(part("_rels/.rels").contains("/3D/3dmodel.model") && part("[Content_Types].xml").contains("3dmodel+xml"));
    let text = part("3D/3dmodel.model");
    let mut model = Model::default();
    let mut reader = Reader::from_str(&text);
    loop {
        match reader.read_event().unwrap() {
            Event::Eof => return model,
            Event::Start(element) | Event::Empty(element) => {
                let attribute = |name: &str| {
                    let found = element.try_get_attribute(name).unwrap().unwrap_or_else(|| panic!("no {name}"));
                    found.value.into_owned()
                };
                match element.name().as_ref() {
                    "model" => model.unit = attribute("unit"),
                    "object" => model.kind = attribute("type"),
                    "base" => model.colours.push(attribute("displaycolor")),
                    "vertex" => model.positions.push(["x", "y", "z"].map(|axis| attribute(axis).parse().unwrap())),
                    "triangle" => {
                        model.triangles.push(["v1", "v2", "v3"].map(|corner| attribute(corner).parse().unwrap()));
                        model.places.push(attribute("p1").parse().unwrap());
                    }
                    _ => {}
                }
            }
            Event::Text(words) => model.metadata.push_str(&words),
            _ => {}
        }
    }
}

#[test]
fn a_capped_part_is_a_solid_with_colours() {
    let folder = tempfile::tempdir().unwrap();
    let surface = surface();
    let toml = "plugin = \"3mf\"\npath = \"part.3mf\"\ncapped = true\nmagnification = 1000";
    let exporter = exporter(&registry(), toml, folder.path()).unwrap();
    let files = export(&*exporter, Some(&surface)).unwrap();
    assert_eq!(names(folder.path()), ["part-x1000.3mf", "part.3mf"]);
    let first = std::fs::read(&files[0]).unwrap();
    for (file, scale) in files.iter().zip([1.0, 1000.0]) {
        let model = read(file);
        assert_eq!([model.unit.as_str(), model.kind.as_str()], ["millimeter", "model"]);
        assert!(model.metadata.contains(&surface.checksum()) && model.metadata.contains(&format!("drawn x{scale}")));
        assert_eq!(model.positions.len(), RINGS * ANGLES + 2 * (ANGLES + 1));
        assert!(is_closed(&model.triangles));
        let (found, expected) = (enclosed_mm3(&model.positions, &model.triangles), volume_mm3(&surface, scale));
        // Triangles halve each cell by a diagonal (1e-5 of the magnified volume); f32 rounds to 1e-6 mm (1e-7).
        assert!((found / expected - 1.0).abs() < if scale > 1.0 { 1e-4 } else { 1e-6 }, "{found} {expected}");
        assert!(model.places.iter().all(|place| *place < model.colours.len()));
        // The ends are grey, the wall is not.
        let wall = 2 * (RINGS - 1) * ANGLES;
        let is_grey = |place: &usize| model.colours[*place] == "#969696";
        assert!(model.places[wall..].iter().all(is_grey) && !model.places[..wall].iter().any(is_grey));
        if let Some(found) = trimesh(file) {
            closed(&found);
            assert!((found["volume"].as_f64().unwrap() / expected - 1.0).abs() < 1e-4);
        }
    }
    export(&*exporter, Some(&surface)).unwrap();
    assert!(first == std::fs::read(&files[0]).unwrap(), "equal runs give equal bytes");
}

#[test]
fn a_map_is_a_surface_and_no_solid() {
    let folder = tempfile::tempdir().unwrap();
    let exporter = exporter(&registry(), "plugin = \"3mf\"\npath = \"flat.3mf\"", folder.path()).unwrap();
    let heights = heights();
    let files = export_heights(&*exporter, &heights).unwrap();
    let model = read(&files[0]);
    assert_eq!(model.kind, "surface");
    assert_eq!(model.positions.len(), heights.height_nm.len() - heights.holes());
    assert!(!is_closed(&model.triangles));
}
