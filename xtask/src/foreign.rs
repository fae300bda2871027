//! Readers that others wrote, for tests of our files: h5py, pyarrow, openpyxl, trimesh, MeshLab, the Khronos glTF validator, and Chromium with
//! the accessibility checks of axe.

use std::{path::PathBuf, process::Command};

use crate::{
    process::{Outcome, answer, run, tools},
    setup,
};

/// Modules, and the packages that bring them.
const PYTHON_PACKAGES: [[&str; 2]; 13] = [
    ["numpy"; 2],
    ["scipy"; 2],
    ["h5py"; 2],
    ["pyarrow"; 2],
    ["polars"; 2],
    ["duckdb"; 2],
    ["openpyxl"; 2],
    ["trimesh"; 2],
    // With these trimesh reads 3MF.
    ["lxml"; 2],
    ["networkx"; 2],
    ["pymeshlab"; 2],
    ["sklearn", "scikit-learn"],
    ["pykrige"; 2],
];
/// The Khronos validator's releases are pre-releases to npm: the version has to be named.
const NODE_PACKAGES: [&str; 3] = ["gltf-validator@2.0.0-dev.3.10", "puppeteer-core@24", "axe-core@4"];
/// Names of the browser, by distribution.
const BROWSERS: [&str; 3] = ["chromium", "chromium-browser", "google-chrome"];

/// The browser's name, where it is installed.
pub(crate) fn browser() -> Option<&'static str> {
    BROWSERS.into_iter().find(|name| answer(name, &["--version"]).is_some())
}

/// Where the readers are.
pub(crate) struct Readers {
    browser: &'static str,
    interpreter: PathBuf,
    node_modules: PathBuf,
}

impl Readers {
    /// Installs them below target/ where they are not yet; Chromium, Node.js and npm by the system's packages.
    pub(crate) fn install() -> Outcome<Self> {
        let python = tools().join("python-venv");
        setup::python_environment(&python)?;
        let interpreter = python.join("bin/python");
        let [modules, packages] = [0, 1].map(|part| PYTHON_PACKAGES.map(|names| names[part]));
        if answer(&interpreter, &["-c", &format!("import {}", modules.join(", "))]).is_none() {
            run(Command::new(python.join("bin/pip")).args(["install", "--quiet"]).args(packages))?;
        }
        let node = tools().join("node");
        if answer("node", &["--version"]).is_none() {
            setup::install(&["nodejs"], "Node.js")?;
        }
        let is_there = |package: &str| {
            let name = package.split('@').next().unwrap_or(package);
            node.join("node_modules").join(name).join("package.json").is_file()
        };
        if !NODE_PACKAGES.into_iter().all(is_there) {
            if answer("npm", &["--version"]).is_none() {
                setup::install(&["npm"], "npm")?;
            }
            std::fs::create_dir_all(&node).map_err(|error| format!("cannot create {}: {error}", node.display()))?;
            let quiet = ["install", "--no-audit", "--no-fund", "--no-save", "--loglevel=error", "--prefix"];
            run(Command::new("npm").args(quiet).arg(&node).args(NODE_PACKAGES))?;
        }
        if browser().is_none() {
            setup::install(&["chromium"], "Chromium")?;
        }
        let browser = browser().ok_or("Chromium is not installed, and no package of it could be installed")?;
        Ok(Self { browser, interpreter, node_modules: node.join("node_modules") })
    }

    /// Sets in the environment of a test run where they are, and that none may be left out.
    pub(crate) fn equip(&self, tests: &mut Command) {
        tests
            .env("RUNOUT_CHROMIUM", self.browser)
            .env("RUNOUT_PYTHON", &self.interpreter)
            .env("RUNOUT_NODE_MODULES", &self.node_modules)
            .env("RUNOUT_REQUIRE_FOREIGN", "1");
    }
}
