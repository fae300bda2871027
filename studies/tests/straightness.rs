//! Example 4's file is what its command makes.

use runout_studies::straightness;

#[test]
fn the_examples_traces_are_made_anew() {
    let committed = include_str!("../../examples/04-straightness-reversal/traces.csv");
    assert!(straightness::traces().unwrap() == committed, "run: cargo xtask studies straightness-traces FILE");
}
