//! Seconds that reading all channels takes, beside the reference libraries: `assets/measure_speed.py` writes the files, and prints theirs.

use std::{env, fs, time::Instant};

use crate::support::opened;

#[test]
#[ignore = "measures the files in the folder that RUNOUT_SPEED names"]
#[allow(clippy::print_stderr, reason = "it measures")]
fn seconds_of_large_files() {
    let Some(folder) = env::var_os("RUNOUT_SPEED") else { return };
    let mut paths: Vec<_> = fs::read_dir(folder).unwrap().map(|entry| entry.unwrap().path()).collect();
    paths.sort();
    for path in paths {
        let mut best = f64::INFINITY;
        let mut count = 0;
        for _ in 0..3 {
            let begun = Instant::now();
            let file = opened(&path).unwrap();
            let channels: Vec<usize> = (0..file.channels().len()).collect();
            let mut columns = vec![Vec::new(); channels.len()];
            let mut samples = file.read(&channels).unwrap();
            count = 0;
            while samples.next(1 << 13, &mut columns).unwrap() > 0 {
                count += columns.iter().map(Vec::len).sum::<usize>();
                columns.iter_mut().for_each(Vec::clear);
            }
            best = best.min(begun.elapsed().as_secs_f64());
        }
        eprintln!("{}: {best:.3} s, {count} numbers", path.file_name().unwrap().to_string_lossy());
    }
}
