//! Twist (lead) of turned and ground shafts, after MBN 31007-07: the strongest helix on a cylindrical surface.
//!
//! A helix with G threads and the axial period DP is a wave cos(G θ + 2π z/DP·s + φ) with its harmonics. The strongest line of
//! the spectrum over the angle (whole numbers G) and the axis (any frequency) is its fundamental; its phase moves along the axis
//! from angle to angle by the lead. Depth and supply cross-section are those of the profile that repeats with it: all harmonics
//! of the line, at multiples of both G and the axial frequency. The standard itself measures generatrices at 72 angles and reads
//! the phases of their spectra; a surface has them all.

use std::f64::consts::TAU;

use super::areal::HeightMap;
use runout_numerics::{
    Complex64,
    fourier::{Fourier, complex_forward, max_order},
    golden_section,
    statistics::upper_median,
};

/// Most threads that are looked for.
const MOST_THREADS: usize = 512;
/// Fewest periods on the length.
const FEWEST_PERIODS: f64 = 4.0;
/// Fewest rings in a period.
const FEWEST_RINGS: f64 = 2.5;
/// A line that is so many times as strong as the median one is no noise: the largest of a million lines of noise has 4.5.
const SIGNIFICANT: f64 = 6.0;
/// Bins of the axial spectrum for each of its resolution.
const FINER: usize = 4;
/// How well the strongest frequency is sought, in bins: power near it differs by less than f64 resolves.
const REFINED: f64 = 1e-12;
/// Harmonics of the helix at most.
const HARMONICS: usize = 32;
/// Points of the profile that repeats.
const POINTS: usize = 1024;
/// Columns that are transformed together, for the sake of cache lines.
const TOGETHER: usize = 8;

/// Symbol, unit and meaning of every value, in the order of [`Twist::values`].
pub const PARAMETERS: [(&str, &str, &str); 6] = [
    ("DG", "", "number of threads"),
    ("DP", "mm", "period length"),
    ("Dγ", "°", "lead angle, positive of a right-handed helix"),
    ("Dt", "µm", "twist depth"),
    ("DF", "µm²", "theoretical supply cross-section of one thread"),
    ("DFu", "µm²", "theoretical supply cross-section of a turn"),
];

/// The strongest helix of a surface.
#[derive(Debug, Clone, Copy, PartialEq)]
#[non_exhaustive]
pub struct Twist {
    /// DG: number of threads, 0 where the grooves are rings.
    pub threads: usize,
    /// DP: distance along the axis from one groove to the next, in mm.
    pub period_mm: f64,
    /// Dγ: angle between groove and circumference in degrees, atan(DG·DP/(2πR)); positive where the groove moves towards +z with
    /// a growing angle (right-handed, where the angle grows counter-clockwise seen against +z), negative the other way.
    pub lead_angle_deg: f64,
    /// Dt: height of the repeating profile, in µm.
    pub depth_um: f64,
    /// DF: area of the repeating profile below its highest point over one period along the axis, in µm².
    pub supply_um2: f64,
    /// DFu = DF·DG, in µm²: what all threads together carry past a line around the shaft in a turn.
    pub supply_per_turn_um2: f64,
}

impl Twist {
    /// The numbers of [`PARAMETERS`].
    #[must_use]
    pub fn values(&self) -> [f64; PARAMETERS.len()] {
        [
            self.threads as f64,
            self.period_mm,
            self.lead_angle_deg,
            self.depth_um,
            self.supply_um2,
            self.supply_per_turn_um2,
        ]
    }
}

/// The strongest helix of a closed map without form, on periods of at least 2.5 rings of which at least four lie on its length,
/// and at most 512 threads.
///
/// # Errors
/// In words, why there is none: the map is open, interrupted or too short, or no line stands out of its spectrum.
pub fn twist(map: &HeightMap) -> Result<Twist, String> {
    let failure = |problem: &str| Err(format!("no twist: {problem}"));
    if !map.closed() || map.missing() > 0 {
        return failure("the surface does not go all the way round");
    }
    if (map.rows() as f64) < FEWEST_PERIODS * FEWEST_RINGS {
        return failure("fewer than 10 rings");
    }
    let lines = Lines::new(map);
    let Some((threads, frequency)) = lines.strongest() else {
        return failure("no helix is significant in the surface's spectrum");
    };
    let frequency = lines.refined(threads, frequency);
    // Below this, rings have less than two points of a wave.
    let nyquist = 0.5 / map.dy_mm();
    let harmonics: Vec<Complex64> = (1..=HARMONICS)
        .take_while(|harmonic| *harmonic as f64 * frequency.abs() < 0.95 * nyquist && harmonic * threads < lines.orders)
        .map(|harmonic| lines.amplitude(harmonic * threads, harmonic as f64 * frequency))
        .collect();
    let profile = |point: usize| {
        let phase = TAU * point as f64 / POINTS as f64;
        let wave =
            |(index, value): (usize, &Complex64)| (value * Complex64::from_polar(1.0, (index + 1) as f64 * phase)).re;
        harmonics.iter().enumerate().map(wave).sum::<f64>()
    };
    let heights: Vec<f64> = (0..POINTS).map(profile).collect();
    let (low, high) =
        heights.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), one| (low.min(*one), high.max(*one)));
    let period_mm = frequency.abs().recip();
    // The profile has the mean 0: below its highest point lies high · period, in µm · mm.
    let supply_um2 = 1e3 * high * period_mm;
    let circumference_mm = map.columns() as f64 * map.dx_mm();
    let lead_mm = threads as f64 * period_mm;
    Ok(Twist {
        threads,
        period_mm,
        lead_angle_deg: -frequency.signum() * (lead_mm / circumference_mm).atan().to_degrees(),
        depth_um: high - low,
        supply_um2,
        supply_per_turn_um2: supply_um2 * threads as f64,
    })
}

/// Harmonics of every ring, under a window along the axis.
struct Lines {
    /// Orders of each ring, from 0.
    orders: usize,
    rows: usize,
    dy_mm: f64,
    /// `[order][row]`, times the window, which sums to 1.
    weighted: Vec<Complex64>,
    /// Amplitude below which a line is rounding, in µm.
    rounding_um: f64,
}

/// Rounding over the largest height.
const ROUNDING: f64 = 1e-9;

impl Lines {
    fn new(map: &HeightMap) -> Self {
        let (rows, columns) = (map.rows(), map.columns());
        let orders = max_order(columns).min(HARMONICS * MOST_THREADS) + 1;
        let mut fourier = Fourier::new(columns);
        let mut ring = vec![Complex64::ZERO; orders];
        let mut weighted = vec![Complex64::ZERO; orders * rows];
        let hann = |row: usize| 1.0 - (TAU * (row as f64 + 0.5) / rows as f64).cos();
        let sum: f64 = (0..rows).map(hann).sum();
        // The mean of each order along the axis is form: its leakage would hide long periods.
        for (row, heights) in map.heights_um().chunks_exact(columns).enumerate() {
            fourier.analyse(heights.iter().copied(), &mut ring);
            for (order, value) in ring.iter().enumerate() {
                weighted[order * rows + row] = *value;
            }
        }
        for order in weighted.chunks_exact_mut(rows) {
            let mean = order.iter().enumerate().map(|(row, value)| value * hann(row)).sum::<Complex64>() / sum;
            for (row, value) in order.iter_mut().enumerate() {
                *value = (*value - mean) * (hann(row) / sum);
            }
        }
        let rounding_um =
            ROUNDING * map.heights_um().iter().fold(0.0, |largest: f64, height| largest.max(height.abs()));
        Self { orders, rows, dy_mm: map.dy_mm(), weighted, rounding_um }
    }

    /// Amplitude of Re A e^{i(order θ + 2π f z)}, z from the first ring, in µm. A ring's level is no complex harmonic: order 0
    /// has half of the wave there.
    fn amplitude(&self, order: usize, frequency_per_mm: f64) -> Complex64 {
        let turn = Complex64::from_polar(1.0, -TAU * frequency_per_mm * self.dy_mm);
        let mut phase = Complex64::ONE;
        let mut sum = Complex64::ZERO;
        for value in &self.weighted[order * self.rows..][..self.rows] {
            sum += value * phase;
            phase *= turn;
        }
        if order == 0 { 2.0 * sum } else { sum }
    }

    /// Threads and signed axial frequency of the strongest line, where one stands out.
    fn strongest(&self) -> Option<(usize, f64)> {
        let length = (FINER * self.rows).next_power_of_two();
        let transform = complex_forward(length);
        let mut scratch = vec![Complex64::ZERO; transform.get_inplace_scratch_len()];
        let mut block = vec![Complex64::ZERO; TOGETHER * length];
        let step = (length as f64 * self.dy_mm).recip();
        let lowest = (FEWEST_PERIODS / (self.rows as f64 * self.dy_mm) / step).ceil() as usize;
        let highest = (length as f64 / FEWEST_RINGS) as usize;
        let mut best = (0.0, 0, 0.0);
        let mut powers = Vec::new();
        let orders = self.orders.min(MOST_THREADS + 1);
        for first in (0..orders).step_by(TOGETHER) {
            let together = TOGETHER.min(orders - first);
            let block = &mut block[..together * length];
            block.fill(Complex64::ZERO);
            for (index, column) in block.chunks_exact_mut(length).enumerate() {
                column[..self.rows].copy_from_slice(&self.weighted[(first + index) * self.rows..][..self.rows]);
            }
            transform.process_with_scratch(block, &mut scratch);
            for (index, column) in block.chunks_exact(length).enumerate() {
                let order = first + index;
                let scale = if order == 0 { 4.0 } else { 1.0 };
                let mut look = |bin: usize, frequency: f64| {
                    let power = scale * column[bin].norm_sqr();
                    powers.push(power);
                    if power > best.0 {
                        best = (power, order, frequency);
                    }
                };
                for bin in lowest..=highest {
                    look(bin, bin as f64 * step);
                    if order > 0 {
                        look(length - bin, -(bin as f64) * step);
                    }
                }
            }
        }
        let median = upper_median(&mut powers)?;
        (best.0 > SIGNIFICANT * SIGNIFICANT * median && best.0 > self.rounding_um.powi(2)).then_some((best.1, best.2))
    }

    /// The frequency at which a line is strongest, within a bin of one given.
    fn refined(&self, order: usize, frequency: f64) -> f64 {
        let step = ((FINER * self.rows).next_power_of_two() as f64 * self.dy_mm).recip();
        let power = |frequency: f64| self.amplitude(order, frequency).norm_sqr();
        golden_section::maximum(frequency - step, frequency + step, REFINED * step, power)
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    const RADIUS_MM: f64 = 20.0;
    const COLUMNS: usize = 720;
    const STEP_MM: f64 = 0.005;

    fn map(height: impl Fn(f64, f64) -> f64) -> HeightMap<'static> {
        let heights = (0..400 * COLUMNS)
            .map(|point| height(TAU * (point % COLUMNS) as f64 / COLUMNS as f64, (point / COLUMNS) as f64 * STEP_MM));
        let dx_mm = TAU * RADIUS_MM / COLUMNS as f64;
        HeightMap::new(heights.collect::<Vec<_>>(), COLUMNS, dx_mm, STEP_MM, true).unwrap()
    }

    /// Numbers between −0.5 and 0.5, independent from point to point: the mixing of splitmix64.
    fn noise(theta: f64, z: f64) -> f64 {
        let mut bits = theta.to_bits() ^ z.to_bits().rotate_left(17);
        for factor in [0xbf58_476d_1ce4_e5b9_u64, 0x94d0_49bb_1331_11eb, 0x9e37_79b9_7f4a_7c15] {
            bits = (bits ^ (bits >> 30)).wrapping_mul(factor);
        }
        ((bits ^ (bits >> 31)) >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
    }

    /// A turned thread: feed 0.1 mm, arcs of 0.8 µm, one thread or more, either hand.
    #[test]
    fn a_turned_helix_has_its_numbers() {
        let period = 0.0973;
        for (threads, hand) in [(1.0, 1.0), (1.0, -1.0), (3.0, 1.0), (24.0, -1.0), (0.0, 1.0)] {
            let arc = |theta: f64, z: f64| {
                // The groove lies where z = hand · threads · period · θ/2π + whole periods.
                let at = (z / period - hand * threads * theta / TAU).rem_euclid(1.0);
                0.8 * (2.0 * at - 1.0).powi(2)
            };
            let wavy = map(|theta, z| arc(theta, z) + 0.5 * (2.0 * theta).cos() + 0.2 * noise(theta, z));
            let found = twist(&wavy).unwrap();
            assert!((found.threads as f64 - threads).abs() < 0.5, "{found:?}");
            assert!((found.period_mm / period - 1.0).abs() < 1e-4, "{found:?}");
            let expected = hand * (threads * period / (TAU * RADIUS_MM)).atan().to_degrees();
            assert!((found.lead_angle_deg - expected).abs() < 1e-4, "{found:?}, {expected}");
            // 19 rings in a period hold nine harmonics of the arcs: their crest, a kink, is 0.8·(2/π²)·Σ 4/k² from k = 10, 5 %, too low.
            assert!((found.depth_um - 0.8).abs() < 0.06, "{found:?}");
            // Below the crest of a parabola lie two thirds of its height.
            let area = 2.0 / 3.0 * 0.8 * 1e3 * period;
            assert!((found.supply_um2 / area - 1.0).abs() < 0.08, "{found:?}, {area}");
            assert!((found.supply_per_turn_um2 - threads * found.supply_um2).abs() < 1e-9);
        }
    }

    /// A sine has its closed forms: depth 2 A, and half of depth · period below its crest.
    #[test]
    fn a_sine_helix_is_exact() {
        let wave = |theta: f64, z: f64| 0.3 * (5.0 * theta - TAU * z / 0.05 + 0.4).cos();
        let found = twist(&map(wave)).unwrap();
        assert!((found.depth_um - 0.6).abs() < 1e-5 && (found.period_mm - 0.05).abs() < 1e-8, "{found:?}");
        assert!((found.supply_um2 - 0.3 * 50.0).abs() < 1e-3 && found.threads == 5, "{found:?}");
        assert!(found.lead_angle_deg > 0.0);
    }

    #[test]
    fn noise_has_no_twist() {
        assert!(twist(&map(noise)).unwrap_err().contains("is significant"));
        let gapped = map(noise);
        let mut heights = gapped.heights_um().to_vec();
        heights[7] = f64::NAN;
        assert!(twist(&gapped.with(heights)).unwrap_err().contains("all the way round"));
        assert!(twist(&map(|_, _| 1.0)).is_err());
    }
}
