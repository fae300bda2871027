//! Areal and profile values beside surfalize's: `benchmarks/areal`.

use std::{path::Path, process::Command};

use crate::{
    process::{Outcome, answer, run, target, tools},
    setup::{self, cargo},
};

/// What the committed table and golden file were made with.
const PACKAGE: &str = "surfalize==0.19.2";
/// Rings, points of a ring, rounds.
const DEFAULTS: [&str; 3] = ["400", "2560", "7"];

/// Prints the table of `docs/appendix/values.md`; rings, points of a ring and rounds may be given.
pub(crate) fn peers(words: &[&str]) -> Outcome {
    if words.len() > DEFAULTS.len() || words.iter().any(|word| word.parse::<u32>().map_or(true, |number| number == 0)) {
        return Err("areal-peers takes rings, points of a ring and rounds: whole numbers of at least 1".into());
    }
    let folder = tools().join("areal-venv");
    setup::python_environment(&folder)?;
    let python = folder.join("bin/python");
    if answer(&python, &["-c", "import surfalize"]).is_none() {
        run(Command::new(folder.join("bin/pip")).args(["install", "--quiet", PACKAGE]))?;
    }
    run(&mut cargo(&["build", "--release", "--package", "runout-core", "--example", "surface_values"])?)?;
    let mut compare = Command::new(python);
    compare.arg("-B").arg(Path::new("benchmarks/areal/compare.py"));
    compare.arg(target().join("release/examples/surface_values")).arg(target().join("bench"));
    run(compare.args(words).args(&DEFAULTS[words.len()..]))
}
