//! Matrix Market files of every kind, and what is wrong with one.

use std::fs;

use runout_rotor::{Rotor, read};

/// A rotor of these three files.
fn rotor(stiffness: &str, mass: &str, gyroscopic: &str) -> Result<Rotor, String> {
    let folder = tempfile::tempdir().unwrap();
    for (name, text) in [("K.mtx", stiffness), ("M.mtx", mass), ("G.mtx", gyroscopic)] {
        fs::write(folder.path().join(name), text).unwrap();
    }
    let path = folder.path().join("rotor.toml");
    fs::write(&path, "[matrices]\nstiffness = 'K.mtx'\nmass = 'M.mtx'\ngyroscopic = 'G.mtx'\n").unwrap();
    read(&path).map_err(|error| error.to_string())
}

const MASS: &str = "%%MatrixMarket matrix array real general\n2 2\n2\n0\n0\n2\n";
const TURNING: &str = "%%MatrixMarket matrix coordinate real skew-symmetric\n2 2 1\n2 1 -7\n";

#[test]
fn every_kind_of_file_reads() {
    for text in [
        "coordinate real general\n% note\n2 2 4\n1 1 4\n1 2 -1.0\n2 1 -1e0\n2 2 3\n",
        "array real general\n2 2\n4\n-1\n-1\n3\n",
        "coordinate real symmetric\n2 2 3\n1 1 4\n2 1 -1\n2 2 3\n",
        "array real symmetric\n2 2\n4\n-1\n3\n",
        "array integer symmetric\n2 2\n4\n-1\n3\n",
        // Elements of the same place are added.
        "coordinate real symmetric\n2 2 4\n1 1 1\n1 1 3\n2 1 -1\n2 2 3\n",
    ] {
        let found = rotor(&format!("%%MatrixMarket matrix {text}"), MASS, TURNING).unwrap().equations;
        let rows = |matrix: &faer::Mat<f64>| [0, 1].map(|row| [0, 1].map(|column| matrix[(row, column)]));
        assert_eq!(rows(&found.stiffness), [[4.0, -1.0], [-1.0, 3.0]], "{text}");
        assert_eq!(rows(&found.gyroscopic), [[0.0, 7.0], [-7.0, 0.0]]);
    }
    // Rows and columns are not exchanged.
    let skew = "%%MatrixMarket matrix array real general\n2 2\n0\n-7\n7\n0\n";
    let found = rotor(MASS, MASS, skew).unwrap().equations;
    assert!((found.gyroscopic[(1, 0)] + 7.0).abs() < 1e-12);
}

#[test]
fn what_is_wrong_is_said() {
    let cases = [
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n0 1 4\n", "one-indexed"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n3 1 4\n", "out of bounds"),
        ("%%MatrixMarket matrix coordinate real general\n2 2 2\n1 1 4\n", "2 entries required"),
        ("%%MatrixMarket matrix coordinate real symmetric\n2 2 1\n1 2 4\n", "lower triangle"),
        ("%%MatrixMarket matrix coordinate real general\n2 3 1\n1 1 4\n", "square"),
        ("%%MatrixMarket matrix coordinate real general\n5000 5000 1\n1 1 4\n", "at most"),
        ("%%MatrixMarket matrix coordinate complex general\n1 1 1\n1 1 4 0\n", "K.mtx"),
        ("%%MatrixMarket matrix array real general\n2 2\n1\nx\n3\n4\n", "4:1"),
        (
            "%%MatrixMarket matrix array real general\n99999999999999999999 2\n1\n",
            "line 2: 99999999999999999999 is too large",
        ),
        ("%%MatrixMarket matrix coordinate real general\n2 2 1\n99999999999999999999 2 1\n", "line 3"),
        ("1 2\n", "K.mtx"),
        ("", "K.mtx"),
    ];
    for (text, part) in cases {
        let problem = rotor(text, MASS, TURNING).err().unwrap_or_default();
        assert!(problem.contains(part), "{text:?}: {problem}");
        assert!(!problem.contains('\n'), "{problem}");
    }
}
