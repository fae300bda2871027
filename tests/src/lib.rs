//! Tests that cross crates: checks for every plugin of a kind (`tests/conformance`, which writes a page of them), interrupted runs, memory, separators beside each other.
