//! Areal and profile values beside those of surfalize (PyPI), from a file that it wrote: `surfalize/write.py`.

#![allow(clippy::unwrap_used, reason = "a test")]

use std::collections::BTreeMap;

use runout_core::{
    numerics::height_map::HeightMap,
    standards::{
        areal::{MaterialRatio, Settings, areal},
        texture,
    },
};
use serde::Deserialize;

#[derive(Deserialize)]
struct Golden {
    columns: usize,
    dx_mm: f64,
    dy_mm: f64,
    areal: BTreeMap<String, f64>,
    as_many_classes_as_points: BTreeMap<String, f64>,
    profile: BTreeMap<String, f64>,
    heights_10_pm: Vec<f64>,
}

impl Golden {
    fn read() -> Self {
        serde_json::from_str(include_str!("surfalize/values.json")).unwrap()
    }

    fn map(&self) -> HeightMap<'static> {
        let heights: Vec<f64> = self.heights_10_pm.iter().map(|height| height * 1e-5).collect();
        HeightMap::new(heights, self.columns, self.dx_mm, self.dy_mm, false).unwrap()
    }
}

fn assert_near(symbol: &str, ours: f64, theirs: f64, share: f64) {
    assert!((ours - theirs).abs() <= share * theirs.abs(), "{symbol}: {ours} instead of {theirs}");
}

#[test]
fn areal_values_are_those_of_surfalize_where_it_defines_them_alike() {
    let golden = Golden::read();
    let found = areal(&golden.map(), &Settings::default());
    for one in found.parameters() {
        let symbol = one.symbol;
        let exact = golden.as_many_classes_as_points.get(symbol);
        let (theirs, share) = match (symbol, exact) {
            // The lag where the autocorrelation passes 0.2: it takes the nearest of 1000 points on rays to whole
            // points, runout the crossing of the grid's lines.
            ("Sal" | "Str", _) => (golden.areal[symbol], 0.02),
            // Its Sxp takes the ratios that its Sdc has here.
            ("Sxp", _) => (golden.as_many_classes_as_points["Sdc"], 1e-9),
            // It has none of the first; forward differences there, over seven points here: see below.
            // Its Std follows the lattice of Fourier bins, 0° before all: closed forms are the truth of Std.
            ("Sda" | "Sha" | "Sdv" | "Shv" | "Sdq" | "Std", _) => continue,
            // Areas under the curve end there at the nearest point, here on it.
            ("Spk" | "Svk" | "Vmp" | "Vmc" | "Vvc" | "Vvv", Some(theirs)) => (*theirs, 5e-3),
            (_, Some(theirs)) => (*theirs, 1e-9),
            ("Sak1" | "Sak2" | "Spkx" | "Svkx", None) => (golden.areal[symbol], 1e-2),
            // Rounding: sums of 8640 numbers, and area ratios of 1 + 1e-8.
            ("Sdr", _) => (golden.areal[symbol], 1e-6),
            _ => (golden.areal[symbol], 1e-9),
        };
        println!("{symbol:6} {:14.8} {theirs:14.8} {:10.2e}", one.value, one.value / theirs - 1.0);
        assert_near(symbol, one.value, theirs, share);
    }
}

/// surfalize 0.19.2, `AbbottFirestoneCurve(surface, nbins=8640).mr(c)` and `.mc(p)` of the same map, whose heights it does not
/// refer to their mean.
#[test]
fn the_material_ratio_curve_is_that_of_surfalize() {
    let curve = MaterialRatio::of(&Golden::read().map());
    for (height_um, percent) in [(-0.3, 96.304_962_5), (-0.1, 77.951_041_5), (0.2, 26.012_357_3), (0.35, 8.899_756_9)] {
        // Its curve begins half a class further.
        assert_near("Smr(c)", curve.smr_percent(height_um), percent, 2e-4);
    }
    for (percent, height_um) in [(2.5, 0.502_431_75), (10.0, 0.335_753), (50.0, 0.064_64), (80.0, -0.114_912)] {
        assert_near("Smc(p)", curve.smc_um(percent), height_um, 1e-5);
    }
}

/// Its Sdq takes forward differences; by them, this map gives its number.
#[test]
fn sdq_by_forward_differences_is_that_of_surfalize() {
    let golden = Golden::read();
    let map = golden.map();
    let row = |row: usize| &map.heights_um()[row * map.columns()..][..map.columns()];
    let mean = |squares: Vec<f64>| squares.iter().sum::<f64>() / squares.len() as f64;
    let across = (0..map.rows()).flat_map(|at| {
        row(at).windows(2).map(|pair| (1e-3 * (pair[1] - pair[0]) / map.dx_mm()).powi(2)).collect::<Vec<_>>()
    });
    let along = (1..map.rows()).flat_map(|at| {
        row(at)
            .iter()
            .zip(row(at - 1))
            .map(|(here, below)| (1e-3 * (here - below) / map.dy_mm()).powi(2))
            .collect::<Vec<_>>()
    });
    let sdq = (mean(across.collect()) + mean(along.collect())).sqrt();
    assert_near("Sdq", sdq, golden.areal["Sdq"], 1e-9);
}

#[test]
fn profile_values_are_those_of_surfalize() {
    let golden = Golden::read();
    let map = golden.map();
    let profile = &map.heights_um()[..map.columns()];
    // Five sections, as its default has it. It parts them by points, 24 each, runout by length: along an open line of 119
    // distances that is another parting, around a closed one of 120 the same.
    let radius_mm = map.columns() as f64 * map.dx_mm() / std::f64::consts::TAU;
    let found = texture::around(profile, radius_mm, &texture::Settings::default());
    assert_eq!(found.sections, 5);
    for one in found.parameters() {
        match one.symbol {
            // It takes Rdq by forward differences, and has no others.
            symbol if symbol != "Rdq" && !golden.profile.contains_key(symbol) => (),
            // Where a whole section lies above the mean line, it adds the lowest point's distance; runout takes it off, so
            // that Rz = Rp + Rv.
            "Rv" => {
                let mean = profile.iter().sum::<f64>() / profile.len() as f64;
                let lowest = |section: &[f64]| section.iter().map(|height| height - mean).fold(f64::INFINITY, f64::min);
                let depths: Vec<f64> = profile.chunks(profile.len() / 5).map(lowest).collect();
                let over = |depth: fn(&f64) -> f64| depths.iter().map(depth).sum::<f64>() / depths.len() as f64;
                assert_near("Rv", over(|lowest| lowest.abs()), golden.profile["Rv"], 1e-9);
                assert_near("Rv", one.value, over(|lowest| -lowest), 1e-9);
            }
            "Rdq" => {
                let squares = profile.windows(2).map(|pair| (1e-3 * (pair[1] - pair[0]) / map.dx_mm()).powi(2));
                let forward = (squares.sum::<f64>() / (profile.len() - 1) as f64).sqrt();
                assert_near("Rdq", forward, golden.profile["Rdq"], 1e-9);
            }
            symbol => assert_near(symbol, one.value, golden.profile[symbol], 1e-9),
        }
    }
}
