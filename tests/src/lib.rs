//! Tests that cross crates: conformance, foreign readers, the command line.
