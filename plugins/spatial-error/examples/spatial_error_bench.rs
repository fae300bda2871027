//! Times predictions from points that a file holds, for `cargo xtask bench-kriging`.
//!
//! Usage: `spatial_error_bench FILE FOLDER`. FILE holds little-endian f64: number of points, number of queries, range, nugget's
//! variance, the points, their values, the queries. Mean and variance go into FOLDER; seconds are printed, a line of JSON each.

#![allow(clippy::print_stdout, reason = "a program that prints figures")]

use std::{error::Error, path::Path, time::Instant};

use runout_spatial_error::kriging::{Covariance, Data, Family, Joint, Observed, Predicted, Predictor, Query};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().collect();
    let [_, file, folder] = &words[..] else { return Err("usage: spatial_error_bench FILE FOLDER".into()) };
    let numbers: Vec<f64> = std::fs::read(file)?
        .chunks_exact(8)
        .map(|bytes| Ok(f64::from_le_bytes(bytes.try_into()?)))
        .collect::<Result<_, Box<dyn Error>>>()?;
    let (count, asked, range, nugget) = (numbers[0] as usize, numbers[1] as usize, numbers[2], numbers[3]);
    let triples = |from: usize, count: usize| -> Vec<[f64; 3]> {
        numbers[from..from + 3 * count].chunks_exact(3).map(|at| [at[0], at[1], at[2]]).collect()
    };
    let places = triples(4, count);
    let values = numbers[4 + 3 * count..4 + 4 * count].to_vec();
    let queries = triples(4 + 4 * count, asked);
    let covariance =
        Covariance { family: Family::Gaussian, sill_um: 1.0, range_mm: [range; 3], nugget_um: nugget.sqrt() };
    for (trend, columns) in [("zero", 0), ("fitted", 1)] {
        let observed =
            Observed { mean_um: values.clone(), noise_um2: vec![0.0; count], share: vec![1.0; count], shared: None };
        let design = vec![faer::Mat::from_fn(count, columns, |_, _| 1.0)];
        let data = Data { places: places.clone(), observed: vec![observed], design, within: None };
        let joint = Joint::new(&data, &[covariance]).ok_or("the covariance is not positive definite")?;
        let design = faer::Mat::from_fn(asked, columns, |_, _| 1.0);
        let query = Query { places: &queries, design: design.as_ref(), nugget_counts: false };
        for (what, variance) in [("mean", false), ("mean and variance", true)] {
            let start = Instant::now();
            let found = Predictor::new(&joint, &data.places, variance).predict(0, &query);
            let seconds = start.elapsed().as_secs_f64();
            println!("{{\"trend\": \"{trend}\", \"what\": \"{what}\", \"seconds\": {seconds:e}}}");
            if variance {
                write(&Path::new(folder).join(format!("kriging-{trend}.f64")), &found)?;
            }
        }
    }
    Ok(())
}

fn write(path: &Path, found: &[Predicted]) -> std::io::Result<()> {
    let means = found.iter().map(|one| one.mean_um);
    let bytes: Vec<u8> = means.chain(found.iter().map(|one| one.variance_um2)).flat_map(f64::to_le_bytes).collect();
    std::fs::write(path, bytes)
}
