//! Times the reference circles of points that a file holds, for `cargo xtask bench-roundness`.
//!
//! Usage: `reference_circles FILE`, with x and y in mm as pairs of little-endian f64. Prints a line of JSON a circle:
//! seconds (least and median), and what the peers print of it.

#![allow(clippy::print_stdout, reason = "a program that prints figures")]

use std::{error::Error, hint::black_box, time::Instant};

use runout_core::standards::{
    reference::Reference,
    roundness::{Angles, Points},
};

const ROUNDS: usize = 301;

fn main() -> Result<(), Box<dyn Error>> {
    let path = std::env::args().nth(1).ok_or("usage: reference_circles FILE")?;
    let numbers: Vec<f64> = std::fs::read(path)?
        .chunks_exact(8)
        .map(|bytes| Ok(1e3 * f64::from_le_bytes(bytes.try_into()?)))
        .collect::<Result<_, Box<dyn Error>>>()?;
    let (x_um, y_um): (Vec<f64>, Vec<f64>) = numbers.chunks_exact(2).map(|pair| (pair[0], pair[1])).unzip();
    let mut points = Points::default();
    points.set_plane(&x_um, &y_um);
    for reference in Reference::ALL {
        let circle = points.reference(reference).ok_or("no circle")?;
        let value = match reference {
            Reference::LeastSquares | Reference::MinimumZone => points.values(&circle).ront_um,
            _ => points.radius_um() + circle.deviation_um,
        };
        report(reference.symbol(), x_um.len(), value, &mut || {
            black_box(points.reference(reference));
        });
    }
    let (angles, form_um) = (Angles::equal(x_um.len()), vec![0.5; x_um.len()]);
    report("profile", x_um.len(), f64::NAN, &mut || points.set_profile(&angles, &form_um, 30.0));
    Ok(())
}

fn report(stage: &str, count: usize, value: f64, work: &mut dyn FnMut()) {
    let mut seconds: Vec<f64> = (0..ROUNDS)
        .map(|_| {
            let start = Instant::now();
            work();
            start.elapsed().as_secs_f64()
        })
        .collect();
    seconds.sort_by(f64::total_cmp);
    let (least, median) = (seconds[0], seconds[ROUNDS / 2]);
    println!(
        "{{\"stage\": \"{stage}\", \"N\": {count}, \"wall_min_s\": {least:e}, \"wall_med_s\": {median:e}, \"value_um\": {value}}}"
    );
}
