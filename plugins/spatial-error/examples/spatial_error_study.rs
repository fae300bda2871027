//! Studies of simulated machines: `coverage [MACHINES [SEED]]`, `blind [CAMPAIGNS [SEED]]`, `many [PLACES]`.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "a program that prints figures")]

#[path = "../tests/support/mod.rs"]
mod support;

#[path = "../tests/support/study.rs"]
mod study;

fn main() {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let number = |index: usize, default: u64| words.get(index).and_then(|word| word.parse().ok()).unwrap_or(default);
    match words.first().map(String::as_str) {
        Some("coverage") => study::coverage(number(1, 100) as usize, number(2, 1)).print(),
        Some("blind") => study::blind(number(1, 100) as usize, number(2, 1)).print(),
        Some("many") => study::many(number(1, 10_000) as usize),
        _ => println!("spatial_error_study coverage [MACHINES [SEED]] | blind [CAMPAIGNS [SEED]] | many [PLACES]"),
    }
}
