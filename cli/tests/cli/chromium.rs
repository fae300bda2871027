//! Chromium, driven by the scripts of `tests/browser`.

use std::{
    path::{Path, PathBuf},
    process::Command,
};

#[allow(clippy::print_stderr, reason = "a skipped test, sizes and times are worth a line")]
pub(crate) fn say(text: &str) {
    eprintln!("{text}");
}

/// Chromium and the modules that drive it; nothing, with the reason printed, where they are missing.
fn browser() -> Option<(PathBuf, String)> {
    let here = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser");
    let modules = std::env::var_os("RUNOUT_NODE_MODULES").map_or_else(|| here.join("node_modules"), PathBuf::from);
    let chromium = std::env::var("RUNOUT_CHROMIUM").unwrap_or_else(|_| "chromium".into());
    let missing = if !modules.join("puppeteer-core").is_dir() || !modules.join("axe-core").is_dir() {
        "puppeteer-core and axe-core are not installed in RUNOUT_NODE_MODULES"
    } else if Command::new(&chromium).arg("--version").output().is_err() {
        "Chromium is not installed (RUNOUT_CHROMIUM names it)"
    } else {
        return Some((modules, chromium));
    };
    assert!(std::env::var_os("RUNOUT_REQUIRE_FOREIGN").is_none_or(|value| value != "1"), "{missing}");
    say(&format!("skipped: {missing}"));
    None
}

/// What a script of `tests/browser` says of a report.
pub(crate) fn in_chromium(script: &str, report: &Path) -> Option<serde_json::Value> {
    let (modules, chromium) = browser()?;
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/browser").join(script);
    // The program is named as a path: the browser is not looked up by puppeteer.
    let chromium = std::env::split_paths(&std::env::var_os("PATH").unwrap_or_default())
        .map(|folder| folder.join(&chromium))
        .find(|path| path.is_file())
        .unwrap_or_else(|| PathBuf::from(chromium));
    let output = Command::new("node").arg(script).arg(modules).arg(chromium).arg(report).output().unwrap();
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    Some(serde_json::from_slice(&output.stdout).unwrap())
}
