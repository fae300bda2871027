//! The Python package: its wheel, and its tests.

use std::{
    env::consts::{DLL_PREFIX, DLL_SUFFIX},
    fs,
    path::{Path, PathBuf},
    process::Command,
};

use crate::{
    process::{Outcome, answer, root, run, say, target, tools},
    setup,
};

/// What builds the package, and what its tests take.
const BUILD: &str = "maturin>=1.9,<2";
/// Links to the C library of manylinux_2_28, older than that of the machine that builds: the wheel runs on every Linux since 2019.
const LINKER: &str = "ziglang>=0.15";
const LINKED: [&str; 3] = ["--zig", "--compatibility", "manylinux_2_28"];
const TEST_PACKAGES: [&str; 16] = [
    "dask",
    "duckdb",
    "h5py",
    "ipykernel",
    "matplotlib",
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
const TEST_MODULES: &str = "import dask.bag, duckdb, h5py, ipykernel, moto.server, mypy, nbclient, numpy, pandas, polars, pyarrow, pytest, ray.data, s3fs";

/// Builds the wheel into target/wheels, in the release profile or in that of the tests.
pub(crate) fn wheel(words: &[&str]) -> Outcome {
    let profile = match words {
        [] => "release",
        ["--dev"] => "dev",
        _ => return Err("wheel takes --dev or nothing".into()),
    };
    let environment = environment()?;
    if !environment.join("bin/maturin").is_file() {
        install(&environment, &[BUILD])?;
    }
    let for_others = profile == "release" && cfg!(target_os = "linux");
    if for_others && answer(environment.join("bin/python"), &["-c", "import ziglang"]).is_none() {
        install(&environment, &[LINKER])?;
    }
    let wheels = target().join("wheels");
    let mut build = Command::new(environment.join("bin/maturin"));
    build.args(["build", "--profile", profile, "--manifest-path"]).arg(root().join("python/Cargo.toml"));
    if for_others {
        // The linker is a module of the first Python there.
        let path = std::env::var_os("PATH").unwrap_or_default();
        let path = std::env::join_paths(std::iter::once(environment.join("bin")).chain(std::env::split_paths(&path)));
        build.args(LINKED).env("PATH", path.map_err(|error| format!("PATH: {error}"))?);
    }
    build.env("CARGO_TARGET_DIR", target()).env("CMAKE", setup::ready()?);
    run(build.arg("--interpreter").arg(environment.join("bin/python")).arg("--out").arg(&wheels))?;
    say(&format!("pip install {}/runout-*.whl", wheels.display()));
    Ok(())
}

/// Installs what the package's tests take.
pub(crate) fn install_test_packages() -> Outcome {
    let environment = environment()?;
    if answer(environment.join("bin/python"), &["-c", TEST_MODULES]).is_none() {
        install(&environment, &TEST_PACKAGES)?;
    }
    Ok(())
}

/// Runs the tests of the package on the library that the workspace was built with before: maturin would compile all
/// dependencies again, since it builds the one crate with fewer features.
pub(crate) fn test() -> Outcome {
    let place = target().join("python");
    assemble(&place.join("runout"))?;
    let python = environment()?.join("bin/python");
    let tests = root().join("python/tests");
    run(Command::new(python).env("PYTHONPATH", place).args(["-m", "pytest"]).arg("--import-mode=prepend").arg(tests))
}

/// The package as a wheel would install it.
fn assemble(package: &Path) -> Outcome {
    let words = |error: std::io::Error| format!("cannot make {}: {error}", package.display());
    let _ = fs::remove_dir_all(package);
    fs::create_dir_all(package).map_err(words)?;
    for entry in fs::read_dir(root().join("python/runout")).map_err(words)? {
        let path = entry.map_err(words)?.path();
        if let Some(name) = path.file_name().filter(|_| path.is_file()) {
            fs::copy(&path, package.join(name)).map_err(words)?;
        }
    }
    let library = format!("{DLL_PREFIX}_native{DLL_SUFFIX}");
    let module = if cfg!(windows) { "_native.pyd" } else { "_native.abi3.so" };
    fs::copy(target().join("debug").join(library), package.join(module)).map_err(words)?;
    Ok(())
}

fn environment() -> Outcome<PathBuf> {
    let folder = tools().join("python-package");
    setup::python_environment(&folder)?;
    Ok(folder)
}

fn install(environment: &std::path::Path, packages: &[&str]) -> Outcome {
    run(Command::new(environment.join("bin/pip")).args(["install", "--quiet"]).args(packages))
}
