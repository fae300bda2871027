//! Uncertainty of distances between centres of sections and an axis through some of them.
//!
//! A distance of centres grows with noise, and draws about a wall that has it say little of one near 0. Centres are linear in the
//! errors of order 1, so that no draw is needed: an error along x or y is known, and the distance is an amplitude. The largest of
//! several distances changes by no more than the largest error of a centre.
//!
//! Taper, straightness of generatrices and parallelism are largest sizes of what is linear in the form: f(t + e) differs from
//! f(t) by f(e) at most, which draws of the errors alone give.

use runout_draws::Uncertainty;

/// Share of noise that the largest error of several centres exceeds.
const BEYOND: f64 = 0.05;
/// Share of draws that the largest error of several centres exceeds. It is smaller than [`BEYOND`], as the quantile is known from some hundred draws.
const OF_DRAWS_BEYOND: f64 = 0.025;
/// From so many times the largest error on, draws give the interval.
const CLEAR: f64 = 4.0;

/// Standard uncertainty along x and along y of the distance of one section's centre from the least-squares line through the
/// centres of the datum sections, from the variance E|δ|² of order 1 of each section. `place` is that of the section.
pub(super) fn std_um(z_mm: &[f64], variance: &[f64], place: usize, datums: &[usize]) -> f64 {
    let count = datums.len().max(1) as f64;
    let mean = datums.iter().map(|datum| z_mm[*datum]).sum::<f64>() / count;
    let spread: f64 = datums.iter().map(|datum| (z_mm[*datum] - mean).powi(2)).sum();
    let share = |datum: usize| {
        let leans = if spread > 0.0 { (z_mm[place] - mean) * (z_mm[datum] - mean) / spread } else { 0.0 };
        1.0 / count + leans
    };
    let own = |ring: usize| if ring == place { 1.0 } else { 0.0 };
    let of = |ring: usize| {
        let moves = own(ring) - if datums.contains(&ring) { share(ring) } else { 0.0 };
        0.5 * moves * moves * variance[ring]
    };
    (0..z_mm.len()).map(of).sum::<f64>().sqrt()
}

/// Of a diameter that holds several centres, twice the largest distance: as draws give it where it is clear of noise, else from
/// it less to it plus the largest error that noise alone makes of so many centres. `std_um` is the largest of theirs.
pub(super) fn of_diameter(known: Uncertainty, value_um: f64, std_um: f64, centres: usize) -> Uncertainty {
    let noise_um = 2.0 * std_um * (2.0 * (centres.max(1) as f64 / BEYOND).ln()).sqrt();
    near_noise(known, value_um, noise_um, 2.0 * std_um)
}

/// Of a value that errors change by no more than they make of a wall without form, from what draws of them alone make of it.
pub(super) fn of_size(known: Uncertainty, value_um: f64, mut of_noise_um: Vec<f64>) -> Uncertainty {
    of_noise_um.sort_by(f64::total_cmp);
    let beyond = ((1.0 - OF_DRAWS_BEYOND) * of_noise_um.len() as f64) as usize;
    let Some(noise_um) = of_noise_um.get(beyond).copied().filter(|noise_um| noise_um.is_finite()) else { return known };
    let rms_um = (of_noise_um.iter().map(|noise| noise * noise).sum::<f64>() / of_noise_um.len() as f64).sqrt();
    near_noise(known, value_um, noise_um, rms_um)
}

/// Whether a value is so far above such a noise that draws about the form give its interval.
pub(super) fn is_clear(value_um: f64, noise_um: f64) -> bool {
    value_um > CLEAR * noise_um
}

fn near_noise(known: Uncertainty, value_um: f64, noise_um: f64, std_um: f64) -> Uncertainty {
    if is_clear(value_um, noise_um) {
        return known;
    }
    let interval_95 = [(value_um - noise_um).max(0.0), value_um + noise_um];
    Uncertainty::new(known.std.max(std_um), interval_95, known.draws)
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;
    use rand_distr::{Distribution, StandardNormal};

    use super::*;

    const Z_MM: [f64; 5] = [0.0, 5.0, 10.0, 15.0, 20.0];
    const DATUMS: [usize; 2] = [0, 4];

    /// Centres with noise about a straight axis, section 1 beside it by so much: how often both intervals cover the true value.
    fn held(beside_um: f64) -> [f64; 2] {
        let mut random = ChaCha8Rng::seed_from_u64(7);
        let mut normal = || -> f64 { StandardNormal.sample(&mut random) };
        let (walls, std) = (4000, 0.003);
        let stds = [1, 2, 3].map(|ring| std_um(&Z_MM, &[2.0 * std * std; 5], ring, &DATUMS));
        let largest = stds.into_iter().fold(0.0, f64::max);
        let mut inside = [0; 2];
        for _ in 0..walls {
            let mut centre = |x: f64| [x + std * normal(), std * normal()];
            let centres = [centre(0.0), centre(beside_um), centre(0.0), centre(0.0), centre(0.0)];
            let distance = |ring: usize| {
                let up = Z_MM[ring] / Z_MM[4];
                let [x, y] = [0, 1].map(|k| centres[ring][k] - (1.0 - up) * centres[0][k] - up * centres[4][k]);
                x.hypot(y)
            };
            let of_one = Uncertainty::of_amplitude(distance(1), stds[0], 0).interval_95;
            let value = 2.0 * [1, 2, 3].map(distance).into_iter().fold(0.0, f64::max);
            let reach = 2.0 * 1.96 * stds[0];
            let drawn = Uncertainty::new(2.0 * largest, [value - reach, value + reach], 400);
            let of_all = of_diameter(drawn, value, largest, 3).interval_95;
            for (inside, (truth, [low, high])) in
                inside.iter_mut().zip([(beside_um, of_one), (2.0 * beside_um, of_all)])
            {
                *inside += u32::from(low <= truth && truth <= high);
            }
        }
        inside.map(|inside| f64::from(inside) / f64::from(walls))
    }

    #[test]
    fn intervals_cover_distances_from_zero_to_far_above_noise() {
        for beside_um in [0.0, 0.003, 0.01, 0.1, 1.0] {
            let [one, all] = held(beside_um);
            // Of an amplitude between noise and twice that, the lower end at 0 adds some.
            assert!((0.935..=0.99).contains(&one), "{beside_um}: {one}");
            assert!(all >= 0.935, "{beside_um}: {all}");
        }
    }

    /// Between two datum sections the axis has half of the variance of each, outside more.
    #[test]
    fn the_axis_has_its_share() {
        let variance = [2.0; 5];
        assert!((std_um(&Z_MM, &variance, 2, &DATUMS) - 1.5_f64.sqrt()).abs() < 1e-12);
        assert!(std_um(&Z_MM, &variance, 0, &DATUMS) < 1e-12);
        let all = [0, 1, 2, 3, 4];
        assert!((std_um(&Z_MM, &variance, 2, &all) - 0.8_f64.sqrt()).abs() < 1e-12);
        assert!((std_um(&Z_MM, &variance, 1, &[2]) - 2.0_f64.sqrt()).abs() < 1e-12);
    }
}
