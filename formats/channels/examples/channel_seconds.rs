//! Seconds that reading all numbers of recordings takes, a line a file: `cargo xtask bench-formats` compares them with the reference libraries'.
#![allow(clippy::print_stdout, reason = "what it prints is read by a program")]

use std::{env, path::Path, time::Instant};

use runout_core::{Result, input_file::InputFile};

/// Samples of a channel that are read at a time.
const BLOCK: usize = 1 << 13;

fn numbers(path: &Path) -> Result<usize> {
    let file = runout_channels::open(&InputFile::new(path)?, None)?;
    let channels: Vec<usize> = (0..file.channels().len()).collect();
    let mut columns = vec![Vec::new(); channels.len()];
    let mut samples = file.read(&channels)?;
    let mut count = 0;
    while samples.next(BLOCK, &mut columns)? > 0 {
        count += columns.iter().map(Vec::len).sum::<usize>();
        columns.iter_mut().for_each(Vec::clear);
    }
    Ok(count)
}

fn main() -> Result<()> {
    for path in env::args_os().skip(1) {
        let begun = Instant::now();
        let count = numbers(Path::new(&path))?;
        println!("{} {count}", begun.elapsed().as_secs_f64());
    }
    Ok(())
}
