//! The Python package: its wheel, and its tests.

use std::{path::PathBuf, process::Command};

use crate::{
    process::{Outcome, answer, root, run, say, target, tools},
    setup,
};

/// What builds the package, and what its tests take.
const BUILD: &str = "maturin>=1.9,<2";
const TEST_PACKAGES: [&str; 14] = [
    "duckdb",
    "h5py",
    "ipykernel",
    "moto[server]",
    "mypy",
    "nbclient",
    "nbformat",
    "numpy",
    "pandas",
    "polars",
    "pyarrow",
    "pytest",
    "ray[data]",
    "s3fs",
];
/// One module of each of them: all are there, or they are installed.
const TEST_MODULES: &str = "import duckdb, h5py, ipykernel, moto.server, mypy, nbclient, numpy, pandas, polars, pyarrow, pytest, ray.data, s3fs";

/// Builds the wheel into target/wheels, in the release profile or in that of the tests.
pub fn wheel(words: &[&str]) -> Outcome {
    let profile = match words {
        [] => "release",
        ["--dev"] => "dev",
        _ => return Err("wheel takes --dev or nothing".into()),
    };
    let environment = environment()?;
    if !environment.join("bin/maturin").is_file() {
        install(&environment, &[BUILD])?;
    }
    let wheels = target().join("wheels");
    let mut build = Command::new(environment.join("bin/maturin"));
    build.args(["build", "--profile", profile, "--manifest-path"]).arg(root().join("python/Cargo.toml"));
    build.env("CARGO_TARGET_DIR", target());
    run(build.arg("--interpreter").arg(environment.join("bin/python")).arg("--out").arg(&wheels))?;
    say(&format!("pip install {}/runout-*.whl", wheels.display()));
    Ok(())
}

/// Installs the wheel, built in the profile of the tests, and runs the tests on it.
pub fn test() -> Outcome {
    wheel(&["--dev"])?;
    let environment = environment()?;
    let python = environment.join("bin/python");
    if answer(&python, &["-c", TEST_MODULES]).is_none() {
        install(&environment, &TEST_PACKAGES)?;
    }
    let find = ["--no-index", "--no-deps", "--force-reinstall", "--find-links"];
    let wheels = target().join("wheels");
    run(Command::new(environment.join("bin/pip")).args(["install", "--quiet"]).args(find).arg(wheels).arg("runout"))?;
    let tests = root().join("python/tests");
    run(Command::new(python).args(["-m", "pytest"]).arg("--import-mode=prepend").arg(tests))
}

fn environment() -> Outcome<PathBuf> {
    let folder = tools().join("python-package");
    setup::python_environment(&folder)?;
    Ok(folder)
}

fn install(environment: &std::path::Path, packages: &[&str]) -> Outcome {
    run(Command::new(environment.join("bin/pip")).args(["install", "--quiet"]).args(packages))
}
