//! Height maps of other programs: `inspect` and `convert`.

use std::path::Path;

use crate::folder::Folder;
use serde_json::Value;

fn data(name: &str) -> String {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../formats/maps/tests/data").join(name).display().to_string()
}

#[test]
fn a_map_is_shown() {
    let folder = Folder::with(&[]);
    let ran = folder.run(&["inspect", &data("no-dates.x3p")]);
    assert_eq!(ran.status, 0, "{}", ran.stderr);
    for part in
        ["X3P, height map of 5 rows and 7 columns", "0.00200000 mm along x", "2 points without one", "as-measured"]
    {
        assert!(ran.stdout.contains(part), "{part}: {}", ran.stdout);
    }
    let document: Value =
        serde_json::from_str(&folder.run(&["inspect", &data("layers.x3p"), "--json"]).stdout).unwrap();
    assert_eq!((&document["format"], document["layers"].as_array().map(Vec::len)), (&Value::from("X3P"), Some(3)));
}

#[test]
fn a_map_is_written_in_another_format() {
    let folder = Folder::with(&[]);
    for name in ["map.x3p", "map.sdf", "map.h5"] {
        let ran = folder.run(&["convert", &data("objects.sur"), name, "--layer", "right"]);
        assert_eq!(ran.status, 0, "{}", ran.stderr);
        assert!(ran.stdout.contains("the other maps of the file: it has left, right"), "{}", ran.stdout);
        let again = folder.run(&["convert", name, "again.x3p", "--json", "--overwrite"]);
        let document: Value = serde_json::from_str(&again.stdout).unwrap();
        assert_eq!(document["input"]["voids"], 2, "{name}");
    }
    let ran = folder.run(&["convert", &data("plain.sur"), "map.h5"]);
    assert_ne!(ran.status, 0);
    assert!(ran.stderr.contains("`map.h5` is there already") && ran.stderr.contains("--overwrite"), "{}", ran.stderr);
    let ran = folder.run(&["convert", &data("plain.sur"), "map.tif"]);
    assert_eq!(ran.status, 1);
    assert!(ran.stderr.contains("none of the formats that maps are written as"), "{}", ran.stderr);
    let ran = folder.run(&["convert", &data("bits16.sur"), "other.x3p", "--unit", "volt"]);
    assert!(ran.stderr.contains("`volt` is no unit of length"), "{}", ran.stderr);
}
