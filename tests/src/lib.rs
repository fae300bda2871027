//! Tests that cross crates: the checks that every plugin of a kind passes (`tests/conformance`, which writes
//! `docs/appendix/plugin-conformance.md`), interrupted runs, memory, separators beside each other.
