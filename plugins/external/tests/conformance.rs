//! The checks of `runout plugins test`: a program that is right passes, and each mistake is named.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use std::{fs, path::Path};

use crate::support::{of_repository, python};
use runout_external::{Check, CheckResult, Conformance};
use serde_json::Map;

fn checks(python: &str, script: &Path) -> Vec<Check> {
    let command = vec![python.to_owned(), script.display().to_string()];
    let rig = Conformance::three_sensors().unwrap();
    Conformance { command, config: Map::new(), rig, timeout_s: 30.0 }.run(Path::new(".")).unwrap()
}

#[test]
fn a_program_that_is_right_passes_and_each_mistake_is_named() {
    let Some(python) = python() else { return };
    let script = of_repository("examples/26-own-program/three_point.py");
    for check in checks(&python, &script) {
        println!("{check:?}");
        assert_eq!(check.found, CheckResult::Holds, "{}", check.name);
    }
    let text = fs::read_to_string(&script).unwrap();
    let folder = tempfile::tempdir().unwrap();
    let found = "found = np.einsum(\"nqs,ns->nq\", rows, u[2:])";
    let mistakes = [
        ("equal data give equal", found, format!("{found} + np.random.default_rng().normal()")),
        ("the order of stations", "while tables := request():", "asked = 0\nwhile tables := request():\n    asked += 1e-9".into()),
        ("what no rig can separate", "lost = ~(", "rows = np.nan_to_num(rows); found = np.nan_to_num(found); lost = False & (".into()),
        ("data times 3", found, format!("{found} + 0.001")),
        ("noise doubled", "std = np.sqrt(", "std = 0.01 + 0 * np.sqrt(".into()),
        ("bad input", "    rig, config, station =", "    if 're' not in profiles.column_names:\n        sys.stdout.buffer.write(b'end 0\\n'); sys.stdout.buffer.flush(); continue\n    rig, config, station =".into()),
        ("an order that the rig loses", "    quantity = np.tile", "    lost[3] |= station['station'] == 's2'\n    quantity = np.tile".into()),
    ];
    for (name, from, to) in mistakes {
        assert!(text.contains(from), "{from}");
        let mut wrong = text.replace(from, &to);
        if name == "the order of stations" {
            wrong = wrong.replace(found, &format!("{found} + asked"));
        }
        let script = folder.path().join("wrong.py");
        fs::write(&script, wrong).unwrap();
        let checks = checks(&python, &script);
        let check = checks.iter().find(|check| check.name.starts_with(name)).unwrap();
        println!("{check:?}");
        assert!(matches!(check.found, CheckResult::Fails(_)), "{name}");
    }
    let others = [
        ("", "it starts and answers", "closed its output"),
        ("raise SystemExit('no licence')", "it starts and answers", "no licence"),
        (
            "import sys\nsys.stdin.buffer.readline(); print('hello', flush=True)",
            "its answers are in the protocol",
            "hello",
        ),
    ];
    for (text, name, words) in others {
        let script = folder.path().join("wrong.py");
        fs::write(&script, text).unwrap();
        let checks = checks(&python, &script);
        let failed: Vec<&Check> = checks.iter().filter(|check| check.found != CheckResult::Holds).collect();
        let [Check { name: failed, found: CheckResult::Fails(why) }] = failed[..] else { panic!("{checks:?}") };
        assert!(*failed == name && why.contains(words), "{checks:?}");
    }
}
