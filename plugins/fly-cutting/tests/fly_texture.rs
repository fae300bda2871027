//! Maps of real material: its texture is no line of the spindle, and a line in it is found.

#![allow(clippy::unwrap_used, clippy::print_stdout, reason = "tests")]

use crate::{
    common::{CUT, diagnose, listing, scenario, separator},
    trials::trials,
};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use runout_core::height_grid::HeightGrid;

/// Sums over `length` neighbours, every `step`-th value being one.
fn summed(values: &[f64], length: usize, step: usize) -> Vec<f64> {
    let at = |place: usize| {
        let column = place / step % (values.len() / step).max(1);
        (0..length.min(column + 1)).map(|back| values[place - back * step]).sum()
    };
    (0..values.len()).map(at).collect()
}

/// Adds a texture of 60 nm that reaches `rows` along y and `columns` along x.
fn textured(mut grid: HeightGrid, seed: u64, [rows, columns]: [usize; 2]) -> HeightGrid {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut texture: Vec<f64> = (0..grid.height_nm.len()).map(|_| StandardNormal.sample(&mut random)).collect();
    for _ in 0..2 {
        texture = summed(&texture, columns, 1);
        texture = summed(&texture, rows, grid.columns);
    }
    let rms = (texture.iter().map(|value| value * value).sum::<f64>() / texture.len() as f64).sqrt();
    grid.height_nm.iter_mut().zip(&texture).for_each(|(height, texture)| *height += 60.0 * texture / rms);
    grid.std_nm = None;
    grid
}

#[test]
fn texture_is_no_line_of_the_spindle() {
    // The longest and the shortest reach in a usual run.
    let (mut lines, maps) = (0, trials(4));
    for (seed, reach) in [(2, [40, 6]), (3, [3, 2]), (0, [25, 3]), (1, [8, 2])].into_iter().take(maps) {
        let found =
            diagnose(textured(scenario(100, "noise_nm = 1.0").heights().unwrap(), seed, reach), &separator(CUT));
        let own = found.diagnosis.added.iter().filter(|one| one.effect == "spindle-line").count();
        let said = found.diagnosis.consistency.iter().filter(|check| !check.finding.is_empty()).count();
        println!("{reach:?}: {}", listing(&found.diagnosis));
        lines += own;
        assert!(said > 0, "{reach:?} {seed}");
    }
    assert!(4 * lines <= maps, "{lines} lines in {maps} maps");
}

/// Of 33 passes a period: of faster lines the deepest passes cut the others away, and little is left on the surface.
#[test]
fn a_line_in_texture_is_found() {
    for (seed, amplitude) in [(11, 25.0), (12, 40.0)].into_iter().take(trials(2)) {
        let line = format!(
            "noise_nm = 1.0\n[[effect]]\nplugin = 'spindle-line'\nfrequency_ratio = 0.03\namplitude_nm = {amplitude}\n"
        );
        let found = diagnose(textured(scenario(160, &line).heights().unwrap(), seed, [6, 2]), &separator(CUT));
        println!("{}", listing(&found.diagnosis));
        assert!(found.diagnosis.added.iter().any(|one| one.effect == "spindle-line"), "{seed}");
    }
}
