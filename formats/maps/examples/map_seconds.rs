//! Seconds that reading height maps takes, a line a file: `cargo xtask bench-formats` compares them with surfalize's.
#![allow(clippy::print_stdout, reason = "what it prints is read by a program")]

use std::{env, path::Path, time::Instant};

use runout_core::Result;
use runout_maps::{Wanted, read};

fn main() -> Result<()> {
    for path in env::args_os().skip(1) {
        let begun = Instant::now();
        let map = read(Path::new(&path), &Wanted { unit: Some("um".into()), ..Wanted::default() })?;
        println!("{} {}", begun.elapsed().as_secs_f64(), map.grid.height_nm.len());
    }
    Ok(())
}
