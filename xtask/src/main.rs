//! Chores of this repository: set-up, demo, tests, schemas. It needs nothing but Rust, so that it can bring the rest.

mod areal;
mod bench;
mod bench_batch;
mod bench_diagnose;
mod chores;
mod clock;
#[cfg(any(test, feature = "data"))]
mod data;
mod foreign;
mod fuzz;
mod gallery;
mod house;
mod kill_test;
mod measured;
mod process;
mod python;
mod random;
mod readmes;
mod report_check;
mod results;
mod setup;
mod site;

use std::process::ExitCode;

use process::{Outcome, say};

const HELP: &str = "\
cargo xtask COMMAND

  setup         find or bring what a build needs besides Rust: a C compiler, make, CMake 3.26 or newer
  demo          build runout, make the campaign of examples/01-four-sensor once, run its pipeline
  data [--from FOLDER]
                fetch public measured files, or take them from a folder, and convert them to target/data, where examples
                and tests find them
  test [--ci]   check-house, format, lints, tests, and the demo with the tests' build; the last line counts tests
                skipped for want of measured data. With --ci none may be, files are also read by Python and Node, which it
                installs below target/, and the tests of the Python package run with the library of the tests' build
  check-house   print the graphs of crates and of their modules; fail on an arrow that ARCHITECTURE.md does not have, on a
                cycle of modules, and on a long file without a reason
  fuzz [--inputs N] [--minutes M] [--seed S] [--folder DIR] [WORKER]
                give mutated configurations, tables, HDF5 files and overrides to the program, many in one process; 2 minutes
                without more; with a folder in memory (DIR) no file is synced to a disk
  kill-test [--kills N] [--seed S] [PROGRAM]
                kill runs at every step and at all times, and look at what is left; 1000 kills without more
  deny          advisories, licences, yanked versions and sources of dependencies (deny.toml), by cargo-deny
  report-picture
                take the picture of example 1's report that the README shows, by Chromium
  report-check [PROGRAM]
                run all examples with a report, look at each page in Chromium, and print size and time of each
  site [--links | PROGRAM]
                build the website target/site/html from docs/ and READMEs, with a gallery of the examples' reports; fails on a
                dead link or anchor; --links builds the pages only
  studies ...   print figures of the READMEs from simulated campaigns; without arguments, says which
  schemas       write schemas/ anew from the types, and the Python package's classes of stages from them
  wheel [--dev] build the Python package into target/wheels; --dev in the profile of the tests, which is quick and its code slow
  bench-campaign [SCRATCH] [--stations K] [--rounds N] [--i16] [--beside PROGRAM]...
                time a campaign of 98 million samples beside the same work in NumPy and SciPy, and beside other versions of runout; 1.6 GB in target/bench
  bench-peers [SCRATCH] [--stations K] [--rounds N]
                the same with samples of 64 bits and of 16, and write the table into benchmarks/README.md
  bench-stages [SCRATCH] [--rounds N]
                each stage and the peers' side by side, one thread; the table goes into benchmarks/README.md
  bench-roundness
                time reference circles of 2560 and 36 000 points beside SciPy and others
  bench-kriging [POINTS QUERIES ROUNDS]
                time predictions from 1000 measured points beside scikit-learn and pykrige, one thread
  bench-batch [SCRATCH] [--recordings N] [--rounds N] [--jobs A,B] [--program FILE]
                time `runout batch` of 1000 recordings of 2 MB on one job and on two; 2 GB in target/bench/batch
  bench-formats [ROUNDS]
                time reading TDMS, MAT, NPY, WAV, UFF, X3P, SDF and SUR beside their reference libraries, one thread
  bench-diagnose [PROGRAM]
                time `runout diagnose` of a height map of 1000 x 1000 and of 300 spindle stations, and print its memory
  areal-peers [RINGS POINTS ROUNDS]
                print areal and profile values of one surface beside surfalize's, with both times
  record-results FOLDER [PROGRAM]
                run the commands of all examples' READMEs in a copy of the examples below FOLDER
  check-readmes FOLDER PROGRAM
                run the same commands, and name each line that a README shows as printed and no command prints
  compare-results A B [RELATIVE]
                compare every number in two such folders (Parquet, HDF5, JSON), to 1e-12 or RELATIVE

Every command does the set-up it needs first.
";

/// Brings measured data; what it needs is built now, if it is not.
fn measured_data(words: &[&str]) -> Outcome {
    let from = match words {
        [] => None,
        ["--from", folder] => Some(std::path::absolute(folder).map_err(|error| format!("{folder}: {error}"))?),
        _ => return Err("data takes --from FOLDER or nothing".into()),
    };
    #[cfg(any(test, feature = "data"))]
    return data::bring(from.as_deref());
    #[cfg(not(any(test, feature = "data")))]
    {
        let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
        let mut again = std::process::Command::new(cargo);
        again.args(["run", "--quiet", "--package", "xtask", "--features", "data", "--", "data"]);
        process::run(again.args(from.map(|folder| ["--from".into(), folder.into_os_string()]).into_iter().flatten()))
    }
}

fn main() -> ExitCode {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let words: Vec<&str> = words.iter().map(String::as_str).collect();
    let outcome: Outcome = match words[..] {
        [] | ["help" | "--help" | "-h"] => {
            say(HELP);
            Ok(())
        }
        ["setup"] => setup::report(),
        ["demo"] => chores::demo(),
        ["report-picture"] => chores::report_picture(),
        ["report-check", ref rest @ ..] => report_check::check(rest),
        ["site", ref rest @ ..] => gallery::site(rest),
        ["test"] => chores::test(std::env::var_os("RUNOUT_REQUIRE_FOREIGN").is_some_and(|value| value == "1"), false),
        ["test", "--ci"] => chores::test(true, true),
        ["fuzz", ref rest @ ..] => fuzz::fuzz(rest),
        ["kill-test", ref rest @ ..] => kill_test::test(rest),
        ["deny"] => chores::deny(),
        ["check-house", ref rest @ ..] => house::check(rest),
        ["data", ref rest @ ..] => measured_data(rest),
        ["schemas"] => chores::schemas(),
        ["wheel", ref rest @ ..] => python::wheel(rest),
        ["areal-peers", ref rest @ ..] => areal::peers(rest),
        ["record-results", ref rest @ ..] => results::record(rest),
        ["check-readmes", ref rest @ ..] => readmes::check(rest),
        ["compare-results", ref rest @ ..] => results::compare(rest),
        ["bench-campaign", ref rest @ ..] => bench::campaign(rest),
        ["bench-peers", ref rest @ ..] => bench::all_peers(rest),
        ["bench-batch", ref rest @ ..] => bench_batch::batch(rest),
        ["bench-diagnose", ref rest @ ..] => bench_diagnose::diagnose(rest),
        ["bench-stages", ref rest @ ..] => bench::stages(rest),
        ["bench-roundness"] => bench::roundness(),
        ["bench-kriging", ref rest @ ..] => bench::kriging(rest),
        ["bench-formats", ref rest @ ..] => bench::formats(rest),
        ["studies", ref arguments @ ..] => chores::studies(arguments),
        _ => {
            say(&format!("unknown command `{}`\n\n{HELP}", words.join(" ")));
            return ExitCode::from(2);
        }
    };
    match outcome {
        Ok(()) => ExitCode::SUCCESS,
        Err(problem) => {
            say(&format!("error: {problem}"));
            ExitCode::FAILURE
        }
    }
}
