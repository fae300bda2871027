//! The chores themselves.

use std::{collections::BTreeSet, fs, path::Path, process::Command, time::SystemTime};

use crate::{
    clock::Clock,
    foreign::{self, Readers},
    fuzz, house, kill_test,
    process::{Outcome, answer, root, run, say, target},
    python,
    setup::{self, cargo},
    site,
};

/// Picture of the crates, format, lints, tests, and the demo with the program that the tests were built with. With `complete`
/// files are also read by foreign readers, and a skipped test is a failure.
pub(crate) fn test(foreign_readers: bool, complete: bool) -> Outcome {
    let mut clock = Clock::start();
    house::check_quietly()?;
    setup::components()?;
    run(&mut cargo(&["fmt", "--all", "--check"])?)?;
    generate_classes(&["--check"])?;
    let nextest = answer("cargo-nextest", &["--version"]).is_some();
    let runner: &[&str] =
        if nextest { &["nextest", "run", "--workspace"] } else { &["test", "--workspace", "--all-targets"] };
    // Packages are fetched, and links of the docs are checked, while the compiler works.
    let readers = std::thread::scope(|scope| {
        let readers = foreign_readers.then(|| {
            scope.spawn(|| {
                let readers = Readers::install()?;
                python::install_test_packages()?;
                if complete {
                    site::pages()?;
                }
                Outcome::Ok(readers)
            })
        });
        run(&mut linting(&["build", "--workspace", "--all-targets"])?)?;
        run(linting(runner)?.arg("--no-run"))?;
        let readers = readers.map(|thread| thread.join().map_err(|_| "the packages could not be installed".to_owned()));
        readers.transpose()?.transpose()
    })?;
    clock.over("compile and lint");
    let mut tests = linting(runner)?;
    tests.arg("--no-fail-fast");
    // Foreign readers that one test starts inherit the open files of the others, and HDF5's locks on them with it.
    tests.env("HDF5_USE_FILE_LOCKING", "FALSE");
    let skips = target().join("skipped-tests.txt");
    let _ = fs::remove_file(&skips);
    tests.env("RUNOUT_SKIPS", &skips);
    if let Some(readers) = &readers {
        readers.equip(&mut tests);
    }
    run(&mut tests)?;
    clock.over("tests");
    let program = target().join("debug/runout");
    run_example(&program)?;
    let examples_of_docs = || run(&mut linting(&["test", "--workspace", "--doc", "--quiet"])?);
    let package = || if foreign_readers { python::test() } else { Ok(()) };
    if complete {
        // Each of them takes one processor.
        std::thread::scope(|scope| {
            let program = program.display().to_string();
            let worker = target().join("debug/examples/many_command_lines").display().to_string();
            let beside = scope.spawn(move || {
                fuzz::fuzz(&["--minutes", "1", &worker])?;
                examples_of_docs()
            });
            kill_test::test(&["--kills", "60", &program])?;
            package()?;
            beside.join().map_err(|_| "fuzzing and the examples of the docs ended early".to_owned())?
        })?;
    } else {
        examples_of_docs()?;
        package()?;
    }
    clock.over(if complete {
        "fuzzing, kills, examples of the docs and the Python package"
    } else {
        "examples of the docs and the Python package"
    });
    say(&clock.text());
    if !foreign_readers {
        say(
            "the tests of the Python package were skipped: they need packages of Python's (`cargo xtask test --ci` installs them)",
        );
    }
    let skips = Skips::read(&fs::read_to_string(&skips).unwrap_or_default());
    say(&skips.text());
    let there = std::env::var_os("RUNOUT_DATA").is_some() || target().join("data").is_dir();
    if complete && there && skips.skipped > 0 {
        return Err("a test was skipped; with --ci none may be (`cargo xtask data`, RUNOUT_DATA)".into());
    }
    Ok(())
}

/// A cargo command that compiles the crates of the workspace by clippy's compiler, which gives the lints as well: what the tests are built
/// of is compiled once, where `cargo clippy` would compile all of it for itself. A warning is an error.
fn linting(arguments: &[&str]) -> Outcome<Command> {
    let mut command = cargo(arguments)?;
    // As `cargo clippy -- --deny warnings` hands them on.
    let separator = "__CLIPPY_HACKERY__";
    command.env("RUSTC_WORKSPACE_WRAPPER", "clippy-driver");
    command.env("CLIPPY_ARGS", format!("--deny{separator}warnings{separator}"));
    Ok(command)
}

/// Tests without the measured data that they take, by what `tests/support/measured_data.rs` writes.
struct Skips {
    lines: Vec<String>,
    skipped: usize,
    not_compared: usize,
}

impl Skips {
    fn read(list: &str) -> Self {
        let mut lines: Vec<String> = list.lines().map(str::to_owned).collect();
        lines.sort();
        lines.dedup();
        // A test may lack several files.
        let tests = |outcome: &str| {
            let names =
                lines.iter().filter_map(|line| line.strip_prefix(outcome)?.strip_prefix(": ")?.split(": ").next());
            names.collect::<BTreeSet<&str>>().len()
        };
        let (skipped, not_compared) = (tests("skipped"), tests("not compared"));
        Self { lines, skipped, not_compared }
    }

    /// What is missing, and the counts in the last line.
    fn text(&self) -> String {
        let counts = format!(
            "tests skipped for want of measured data: {}; without a file that only some folders of data hold: {}",
            self.skipped, self.not_compared
        );
        self.lines.iter().map(String::as_str).chain([counts.as_str()]).collect::<Vec<_>>().join("\n")
    }
}

/// Advisories, licences, yanked versions and sources of dependencies.
pub(crate) fn deny() -> Outcome {
    if answer("cargo-deny", &["--version"]).is_none() {
        run(&mut cargo(&["install", "--locked", "cargo-deny"])?)?;
    }
    // The advisories' data base is fetched; everything else works without a network.
    run(&mut cargo(&["deny", "--offline", "check", "licenses", "bans", "sources"])?)?;
    run(&mut cargo(&["deny", "check", "advisories"])?)
}

/// Writes schemas/ anew, and what is made from them where there is a Python.
pub(crate) fn schemas() -> Outcome {
    run(&mut cargo(&["run", "--quiet", "--package", "runout", "--", "schema", "--out", "schemas"])?)?;
    generate_classes(&[])
}

/// Writes the classes of python/runout from schemas/, or checks them, where there is a Python.
fn generate_classes(arguments: &[&str]) -> Outcome {
    if answer("python3", &["--version"]).is_none() {
        say("there is no python3: the classes of python/runout were left as they are");
        return Ok(());
    }
    run(Command::new("python3").arg("python/tools/generate.py").args(arguments))
}

/// Makes the first example's campaign once, and runs its pipeline.
pub(crate) fn demo() -> Outcome {
    run(&mut cargo(&["build", "--release", "--package", "runout"])?)?;
    let program = target().join("release/runout");
    run_example(&program)?;
    let shown = program.strip_prefix(root()).unwrap_or(&program).display();
    say(&format!("\nThe program is {shown}; meshes open in MeshLab and Blender, tables in Python."));
    say(&format!("Open the report in a browser: {}", root().join("examples/01-four-sensor/out/report.html").display()));
    Ok(())
}

/// Takes the picture of the first example's report that the README shows.
pub(crate) fn report_picture() -> Outcome {
    demo()?;
    let browser = foreign::browser().ok_or("Chromium is not installed")?;
    let example = root().join("examples/01-four-sensor");
    let picture = example.join("report.png");
    let mut page = Command::new(browser);
    page.args([
        "--headless",
        "--no-sandbox",
        "--hide-scrollbars",
        "--enable-unsafe-swiftshader",
        "--window-size=1440,1260",
    ]);
    // Charts are drawn one after the other.
    page.arg("--virtual-time-budget=30000").arg(format!("--screenshot={}", picture.display()));
    run(page.arg(format!("file://{}", example.join("out/report.html").display())))
}

fn run_example(program: &Path) -> Outcome {
    let example = Path::new("examples/01-four-sensor");
    let scenario = example.join("scenario.toml");
    let campaign = example.join("shaft.h5");
    if newer(&campaign, &scenario) {
        say(&format!("the campaign is there: {}", campaign.display()));
    } else {
        run(Command::new(program).arg("simulate").arg(&scenario).arg("--out").arg(&campaign))?;
    }
    run(Command::new(program).arg("run").arg(example.join("pipeline.toml")))
}

/// Prints the figures that the READMEs show.
pub(crate) fn studies(arguments: &[&str]) -> Outcome {
    let mut words = vec!["run", "--release", "--quiet", "--package", "runout-studies", "--"];
    words.extend(arguments);
    run(&mut cargo(&words)?)
}

/// Whether `made` is there and not older than what it is made from.
fn newer(made: &Path, from: &Path) -> bool {
    let changed = |path: &Path| -> Option<SystemTime> { fs::metadata(root().join(path)).ok()?.modified().ok() };
    matches!((changed(made), changed(from)), (Some(made), Some(from)) if made >= from)
}

#[cfg(test)]
mod tests {
    use super::Skips;

    #[test]
    fn a_test_counts_once_whatever_it_lacks() {
        let list = "skipped: circles: a.csv is not there; fetch it\nskipped: circles: b.csv is not there\n\
                    skipped: circles: a.csv is not there; fetch it\nnot compared: cylinders: c.csv is not there\n";
        let skips = Skips::read(list);
        assert_eq!((skips.skipped, skips.not_compared, skips.lines.len()), (1, 1, 3));
        assert!(skips.text().ends_with("measured data: 1; without a file that only some folders of data hold: 1"));
        assert_eq!(Skips::read("").text().lines().count(), 1);
    }
}
