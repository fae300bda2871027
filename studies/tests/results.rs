//! Results that are compared number by number.

use std::fs;

use runout_studies::results::compare;

#[test]
fn numbers_that_differ_are_named() {
    let folder = tempfile::tempdir().unwrap();
    for (side, number) in [("a", "1.0"), ("b", "1.000000001")] {
        fs::create_dir(folder.path().join(side)).unwrap();
        let text = format!("{{\"values\": [{number}, 2.0], \"inputs\": [{{\"bytes\": {}}}]}}", number.len());
        fs::write(folder.path().join(side).join("summary.json"), text).unwrap();
    }
    fs::write(folder.path().join("b/new.json"), "{}").unwrap();
    let sides = ["a", "b"].map(|side| folder.path().join(side));
    let found = compare(&sides[0], &sides[1], 1e-12).unwrap();
    assert!(found.differ());
    let report = found.report();
    let lines: Vec<&str> = report.lines().collect();
    let [compared, beyond, missing] = lines[..] else { panic!("{report}") };
    assert!(compared.starts_with("2 numbers compared"), "{report}");
    assert!(beyond.contains("summary.json: /values/0: "), "{report}");
    assert_eq!(missing.trim(), "only in one: new.json");
    assert!(!compare(&sides[0], &sides[0], 0.0).unwrap().differ());
}
