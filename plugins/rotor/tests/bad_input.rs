//! What cannot be a rotor, and what looks like a mistake.

#![allow(clippy::unwrap_used, reason = "tests")]

use crate::support;
use std::{fs, path::Path};

use crate::support::{MATERIALS, loader, points, separator, solved};

const SHAFT: &str = r#"segments = [{ length_mm = 200, outer_mm = 50, material = "steel" }]"#;

/// Writes a rotor's file and opens it.
fn message(text: &str) -> String {
    let folder = tempfile::tempdir().unwrap();
    fs::write(folder.path().join("rotor.toml"), text).unwrap();
    let error = points(r#"path = "rotor.toml""#, folder.path()).unwrap_err();
    format!("{error} {}", error.advice().unwrap_or_default())
}

#[test]
fn mistakes_of_a_file_have_their_place() {
    let material = r#"materials = [{ id = "steel", youngs_gpa = 210, poisson = 0.3, density_kg_per_m3 = 7850 }]"#;
    let cases = [
        (r#"segments = [{ length_mm = 0, outer_mm = 50, material = "steel" }]"#, "line 2", "above 0 mm, found 0"),
        (r#"segments = [{ length_mm = -3, outer_mm = 50, material = "steel" }]"#, "line 2", "found -3"),
        (r#"segments = [{ length_mm = nan, outer_mm = 50, material = "steel" }]"#, "line 2", "found NaN"),
        (
            r#"segments = [{ length_mm = 9, outer_mm = 5, inner_mm = 5, material = "steel" }]"#,
            "line 2",
            "outer diameter",
        ),
        (r#"segments = [{ length_mm = 9, outer_mm = 5, material = "steal" }]"#, "line 2", "did you mean `steel`"),
        (r#"segments = [{ length_mm = 9, outer_mm = 5, material = "steel", elements = 0 }]"#, "line 2", "at least one"),
        (
            r#"segments = [{ length_mm = 9, outer_mm = 5, material = "steel", elements = 900 }]"#,
            "line 2",
            "at most 199",
        ),
        (r#"segments = [{ length_mm = 9, outer_mm = 5, material = "steel", element = 9 }]"#, "line 2", "`elements`"),
        ("", "line 1", "at least one segment"),
        ("segments = []", "line 2", "at least one segment"),
        ("segments = 3", "line 2", "expected a list"),
    ];
    for (segments, place, part) in cases {
        let message = message(&format!("{material}\n{segments}\n"));
        assert!(message.contains(place) && message.contains(part), "{segments}: {message}");
        assert!(message.contains("rotor.toml"), "{message}");
    }
    let parts = [
        ("disks = [{ z_mm = 250, mass_kg = 1, polar_kg_m2 = 1, diametral_kg_m2 = 1 }]", "from 0 to 200 mm, found 250"),
        ("disks = [{ z_mm = -1, mass_kg = 1, polar_kg_m2 = 1, diametral_kg_m2 = 1 }]", "found -1"),
        ("disks = [{ z_mm = 10, mass_kg = 0, polar_kg_m2 = 1, diametral_kg_m2 = 1 }]", "a mass above 0 kg"),
        ("disks = [{ z_mm = 10, mass_kg = 1, polar_kg_m2 = 3, diametral_kg_m2 = 1 }]", "at most twice"),
        ("bearings = [{ z_mm = 201, kxx_n_per_m = 1e6, kyy_n_per_m = 1e6 }]", "found 201"),
        ("bearings = [{ z_mm = 0, kxx_n_per_m = -1e6, kyy_n_per_m = 1e6 }]", "at least 0 N/m"),
        ("bearings = [{ z_mm = 0, kxx_n_per_m = 1e6, kyy_n_per_m = 1e6, kxy_n_per_m = inf }]", "finite"),
        ("bearings = [{ z_mm = 0, kxx_n_per_m = 1e6 }]", "kyy_n_per_m"),
        (r#"supports = [{ z_mm = 0, kind = "hinged" }]"#, "hinged"),
        (r#"supports = [{ z_mm = 0, kind = "pinned" }, { z_mm = 0, kind = "clamped" }]"#, "already"),
        (r#"matrices = { stiffness = "K.mtx", mass = "M.mtx" }"#, "whole rotor"),
    ];
    for (part, expected) in parts {
        let message = message(&format!("{material}\n{SHAFT}\n{part}\n"));
        assert!(message.contains(expected), "{part}: {message}");
    }
    let materials = [
        ("youngs_gpa = 0, poisson = 0.3, density_kg_per_m3 = 7850", "above 0 GPa"),
        ("youngs_gpa = 210, poisson = 0.3, density_kg_per_m3 = -1", "above 0 kg/m³"),
        ("youngs_gpa = 210, poisson = 0.7, density_kg_per_m3 = 7850", "up to 0.5"),
        ("youngs_gpa = 210, density_kg_per_m3 = 7850", "`poisson` or `shear_gpa`"),
        ("youngs_gpa = 210, shear_gpa = 8.1, density_kg_per_m3 = 7850", "would be 11.96"),
    ];
    for (keys, expected) in materials {
        let message = message(&format!("materials = [{{ id = \"steel\", {keys} }}]\n{SHAFT}\n"));
        assert!(message.contains(expected), "{keys}: {message}");
    }
    assert!(message("segments = [").contains("line 1"));
    assert!(points(r#"path = "none.toml""#, Path::new("/nowhere")).unwrap_err().to_string().contains("none.toml"));
}

#[test]
fn the_configuration_is_checked_before_a_run() {
    let fault = |config: &str| loader(config, Path::new("")).err().map(|fault| fault.message).unwrap_or_default();
    assert!(fault("").contains("the file of a rotor"));
    assert!(fault(r#"path = """#).contains("name of a file"));
    assert!(fault(&format!("path = \"rotor.toml\"\n{SHAFT}")).contains("belongs into it"));
    assert!(fault(SHAFT).contains("unknown material"));
    let fault = |config: &str| separator(config).err().map(|fault| fault.message).unwrap_or_default();
    assert!(fault("modes = 0").contains("from 1 to 200"));
    assert!(fault("campbell_rpm = [0, -10]").contains("at least 0 rpm"));
    assert!(fault("campbell_rpm = [nan]").contains("at least 0 rpm"));
    assert!(fault("avoid_orders = [0]").contains("above 0"));
    assert!(fault("avoid_within_percent = 100").contains("less than 100"));
    assert_eq!(fault(""), "");
}

#[test]
fn units_that_look_wrong_are_warned_of() {
    let warnings = |text: &str| points(text, Path::new("")).unwrap().remarks.join("\n");
    let steel = |keys: &str| format!("materials = [{{ id = \"steel\", {keys} }}]\n{SHAFT}");
    assert_eq!(warnings(&steel("youngs_gpa = 210, poisson = 0.3, density_kg_per_m3 = 7850")), "");
    let cases = [
        ("youngs_gpa = 2.1e11, poisson = 0.3, density_kg_per_m3 = 7850", "MPa or Pa"),
        ("youngs_gpa = 210000, poisson = 0.3, density_kg_per_m3 = 7850", "MPa or Pa"),
        ("youngs_gpa = 210, poisson = 0.3, density_kg_per_m3 = 7.85", "g/cm³"),
        ("youngs_gpa = 210, shear_gpa = 30, poisson = 0.3, density_kg_per_m3 = 7850", "differs from"),
    ];
    for (keys, part) in cases {
        assert!(warnings(&steel(keys)).contains(part), "{keys}");
    }
    let with = |part: &str| warnings(&format!("{MATERIALS}{SHAFT}\n{part}"));
    assert!(with("bearings = [{ z_mm = 0, kxx_n_per_m = 300, kyy_n_per_m = 3e8 }]").contains("N/µm"));
    assert!(
        with("disks = [{ z_mm = 0, mass_kg = 2, polar_kg_m2 = 1600, diametral_kg_m2 = 900 }]").contains("gyration")
    );
    let thin = r#"segments = [{ length_mm = 0.2, outer_mm = 0.05, material = "steel" }]"#;
    assert!(warnings(&format!("{MATERIALS}{thin}")).contains("is it in m?"));
}

/// Files of a folder, and a model that names them.
fn of_matrices(files: &[(&str, &str)], keys: &str) -> Result<runout_core::stage::Outcome, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in files {
        fs::write(folder.path().join(name), format!("%%MatrixMarket matrix {text}")).unwrap();
    }
    fs::write(folder.path().join("rotor.toml"), format!("[matrices]\n{keys}\n")).unwrap();
    let said = |error: runout_core::Error| format!("{error} {}", error.advice().unwrap_or_default());
    let points = points(r#"path = "rotor.toml""#, folder.path()).map_err(said)?;
    assert_eq!(points.inputs().len(), 1 + files.len());
    separator("").unwrap().separate(&points).map_err(said)
}

const K_AND_M: &str = "stiffness = \"K.mtx\"\nmass = \"M.mtx\"";

#[test]
fn matrices_that_are_no_rotor_are_refused() {
    let mass = ("M.mtx", "array real general\n2 2\n2\n0\n0\n2\n");
    let good = "array real general\n2 2\n8e6\n0\n0\n2e6\n";
    let cases = [
        (
            ("K.mtx", "array real general\n2 2\n8e6\n1e6\n0\n2e6\n"),
            mass,
            "row 2, column 1 is 1e6, row 1, column 2 is 0",
        ),
        (("K.mtx", "array real general\n2 2\n8e6\n0\n0\n-2e6\n"), mass, "positive semidefinite"),
        (("K.mtx", "array real general\n2 2\n0\n0\n0\n0\n"), mass, "other than 0"),
        (("K.mtx", good), ("M.mtx", "array real general\n2 2\n2\n0\n0\n-2\n"), "positive definite"),
        (("K.mtx", good), ("M.mtx", "array real general\n2 2\n2\n0\n0\n0\n"), "without mass"),
        (("K.mtx", good), ("M.mtx", "array real general\n1 1\n2\n"), "expected 1 rows"),
        (("K.mtx", "array real general\n2 1\n8e6\n0\n"), mass, "square"),
        (("K.mtx", "array real general\n2 2\n8e6\n0\n0\n1e999\n"), mass, "finite"),
        (("K.mtx", "coordinate real general\n2 2 1\n0 1 8e6\n"), mass, "one-indexed"),
    ];
    for (stiffness, mass, part) in cases {
        let message = of_matrices(&[stiffness, mass], K_AND_M).unwrap_err();
        assert!(message.contains(part), "{}: {message}", stiffness.1);
    }
    let gyroscopic = ("G.mtx", "array real general\n2 2\n0\n1\n1\n0\n");
    let keys = format!("{K_AND_M}\ngyroscopic = \"G.mtx\"");
    assert!(of_matrices(&[("K.mtx", good), mass, gyroscopic], &keys).unwrap_err().contains("skew-symmetric"));
    let keys = format!("{K_AND_M}\nnode_z_mm = [0, 10]\nnode_dofs = [\"x\", \"y\"]");
    assert!(of_matrices(&[("K.mtx", good), mass], &keys).unwrap_err().contains("2 nodes of 2"));
    let keys = format!("{K_AND_M}\nnode_dofs = [\"x\", \"y\"]");
    assert!(of_matrices(&[("K.mtx", good), mass], &keys).unwrap_err().contains("node_z_mm"));
    assert!(of_matrices(&[("K.mtx", good)], K_AND_M).unwrap_err().contains("M.mtx"));
}

#[test]
fn matrices_of_two_masses_have_their_frequencies() {
    let files = [
        ("K.mtx", "coordinate real symmetric\n2 2 3\n1 1 3e6\n2 1 -1e6\n2 2 3e6\n"),
        ("M.mtx", "array real symmetric\n2 2\n2\n0\n2\n"),
    ];
    let outcome = of_matrices(&files, K_AND_M).unwrap();
    // (3 ∓ 1)·10⁶/2: 1000 and √2·1000 rad/s.
    let f: Vec<f64> = outcome.values.iter().filter(|one| one.symbol == "f").map(|one| one.value).collect();
    assert_eq!(f.len(), 2);
    support::near(f[0], 1000.0 / std::f64::consts::TAU, 1e-12);
    support::near(f[1], 2e6f64.sqrt() / std::f64::consts::TAU, 1e-12);
    assert!(outcome.remarks.iter().any(|remark| remark.contains("2 modes")), "{:?}", outcome.remarks);
    // A foundation of two directions as one node: x and y known.
    let keys = format!("{K_AND_M}\nnode_z_mm = [30]\nnode_dofs = [\"x\", \"y\"]");
    let outcome = of_matrices(&files, &keys).unwrap();
    assert!(outcome.values.iter().any(|one| one.of.as_deref() == Some("1 planar")), "{:?}", outcome.values);
}

#[test]
fn a_rotor_that_is_held_everywhere_has_no_modes() {
    let parts = r#"segments = [{ length_mm = 10, outer_mm = 5, material = "steel", elements = 1 }]
        supports = [{ z_mm = 0, kind = "clamped" }, { z_mm = 10, kind = "clamped" }]"#;
    let error = points(&format!("{MATERIALS}{parts}"), Path::new("")).unwrap_err().to_string();
    assert!(error.contains("at least one degree of freedom"), "{error}");
}

#[test]
fn rigid_bodies_are_reported_and_left_out() {
    let outcome = solved(SHAFT, "modes = 4\ncampbell_rpm = [0, 6000]");
    assert!(outcome.remarks.iter().any(|remark| remark.starts_with("4 motions")), "{:?}", outcome.remarks);
    let lowest = outcome.values.iter().find(|one| one.symbol == "f").unwrap().value;
    assert!(lowest > 100.0, "{lowest}");
}
