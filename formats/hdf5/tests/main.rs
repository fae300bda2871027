//! Measurement and result files, written, read, damaged, and seen by h5py.
#![allow(clippy::unwrap_used, reason = "tests")]

mod beside_csv;
mod damage;
mod double;
mod foreign;
mod harmful;
mod height_map;
mod mismatch;
mod old_format;
mod other_programs;
mod result;
mod round_trip;
