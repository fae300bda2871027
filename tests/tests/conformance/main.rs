//! What every plugin of a kind must do, on all plugins of the program, and the page that says so.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

mod campaign;
mod changed;
mod effects;
mod exporters;
mod harmonics;
mod loaders;
mod made;
mod separators;
mod stages;
mod table;

use std::{env, fs, sync::Arc, time::Instant};

#[test]
fn every_plugin_does_what_its_kind_must_and_the_page_says_so() {
    let registry = Arc::new(campaign::registry());
    let kinds: [fn(&_) -> table::Kind; 6] =
        [loaders::test, stages::preprocessors, stages::simulators, exporters::test, effects::test, separators::test];
    let of = |test: fn(&_) -> table::Kind| {
        let (begun, kind) = (Instant::now(), test(&registry));
        println!("{}: {:.1} s", kind.heading, begun.elapsed().as_secs_f64());
        kind.failures().for_each(|failure| println!("{failure}"));
        kind
    };
    let kinds: Vec<_> = kinds.into_iter().map(of).collect();
    let failures: Vec<String> = kinds.iter().flat_map(|kind| kind.failures().collect::<Vec<_>>()).collect();
    assert!(failures.is_empty(), "{}", failures.join("\n"));
    let (made, file) = (table::page(&kinds), campaign::repository().join("docs/appendix/plugin-conformance.md"));
    if env::var_os("RUNOUT_WRITE_PAGE").is_some() {
        fs::write(&file, &made).unwrap();
    }
    let there = fs::read_to_string(&file).unwrap_or_default();
    assert!(there == made, "{} is not what the suite makes: RUNOUT_WRITE_PAGE=1 writes it", file.display());
}
