//! Areal and profile values of a height map in a file, and how long they take: for `benchmarks/areal`.
//!
//! `surface_values FILE COLUMNS DX_MM DY_MM open|closed ROUNDS`; FILE holds heights in µm, row by row, as little-endian
//! f64. Prints JSON: areal values, profile values of the first row, and the shortest of the rounds in seconds.

#![allow(clippy::print_stdout, reason = "a program that prints values")]

use std::{error::Error, time::Instant};

use runout_core::{
    numerics::height_map::HeightMap,
    standards::{areal, parameter::Parameter, texture},
};
use serde_json::{Map, Value, json};

fn main() -> Result<(), Box<dyn Error>> {
    let words: Vec<String> = std::env::args().skip(1).collect();
    let [file, columns, dx_mm, dy_mm, ends, rounds] = &words[..] else {
        return Err("usage: surface_values FILE COLUMNS DX_MM DY_MM open|closed ROUNDS".into());
    };
    let bytes = std::fs::read(file).map_err(|error| format!("cannot read {file}: {error}"))?;
    let heights: Vec<f64> = bytes.as_chunks().0.iter().map(|bytes| f64::from_le_bytes(*bytes)).collect();
    let (columns, rounds): (usize, usize) = (columns.parse()?, rounds.parse()?);
    let dx_mm: f64 = dx_mm.parse()?;
    let map = HeightMap::new(heights, columns, dx_mm, dy_mm.parse()?, ends == "closed")?;

    let settings = areal::Settings::default();
    let (areal, areal_s) = timed(rounds, || areal::areal(&map, &settings));
    let positions: Vec<f64> = (0..columns).map(|column| column as f64 * dx_mm).collect();
    let profile = &map.heights_um()[..columns];
    let (texture, texture_s) = timed(rounds, || texture::along(&positions, profile, &texture::Settings::default()));
    let result = json!({
        "areal": values(&areal.parameters()),
        "profile": values(&texture.parameters()),
        "areal_s": areal_s,
        "profile_s": texture_s,
    });
    println!("{result}");
    Ok(())
}

/// What the work gives, and the shortest time that it took.
fn timed<T>(rounds: usize, work: impl Fn() -> T) -> (T, f64) {
    let round = || {
        let start = Instant::now();
        let result = work();
        (result, start.elapsed().as_secs_f64())
    };
    (1..rounds).fold(round(), |best, _| {
        let next = round();
        if next.1 < best.1 { next } else { best }
    })
}

fn values(parameters: &[Parameter]) -> Map<String, Value> {
    parameters.iter().map(|one| (one.symbol.into(), json!({"value": one.value, "unit": one.unit}))).collect()
}
