//! The program as its users meet it: arguments in, text, files and exit status out.
#![allow(clippy::unwrap_used, clippy::indexing_slicing, missing_docs, reason = "tests")]

mod batch;
mod channels;
mod chromium;
mod commands;
mod compare;
mod diagnosed;
mod diagnostics;
mod every_exporter;
mod figures;
mod folder;
mod lost_orders;
mod maps;
mod measured;
mod new;
mod odd_files;
mod one_line;
mod other_rigs;
mod points;
mod print;
mod put_right;
mod reading;
mod remarks;
mod report;
mod rotor;
mod safety;
mod schemas;
mod speed;
mod straightness;
mod text_recording;
#[path = "../../../tests/support/trials.rs"]
mod trials;
mod values;
mod warnings;
mod widths;
