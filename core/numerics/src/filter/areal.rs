//! The areal Gaussian filter (ISO 16610-61).

use super::{Band, Degree, Smoother};
use crate::{Complex64, fourier::Fourier, height_map::HeightMap};

/// The areal Gaussian low-pass (ISO 16610-61) of a map, separable: circular around a closed map, and along the open
/// directions a regression that keeps a slope at the ends (ISO 16610-28).
///
/// A map with missing points is filtered by the mean under the Gaussian of the points that are there (no slope is kept
/// at the ends then); what was missing stays missing. The cut-off is a wavelength along the surface, above 0.
#[must_use]
pub fn areal_gaussian(map: &HeightMap, cutoff_mm: f64) -> Vec<f64> {
    let heights = map.heights_um();
    if map.missing() == 0 {
        return separable(map, heights.to_vec(), cutoff_mm, Degree::One);
    }
    let known = |there: fn(f64) -> f64| {
        heights.iter().map(|height| if height.is_finite() { there(*height) } else { 0.0 }).collect()
    };
    let shares = separable(map, known(|_| 1.0), cutoff_mm, Degree::Zero);
    let mut filtered = separable(map, known(|height| height), cutoff_mm, Degree::Zero);
    for ((value, share), height) in filtered.iter_mut().zip(shares).zip(heights) {
        *value = if height.is_finite() { *value / share } else { f64::NAN };
    }
    filtered
}

fn separable(map: &HeightMap, mut heights: Vec<f64>, cutoff_mm: f64, degree: Degree) -> Vec<f64> {
    let (rows, columns) = (map.rows(), map.columns());
    if map.closed() {
        let mut fourier = Fourier::new(columns);
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        let band = Band::low_pass(columns as f64 * map.dx_mm() / cutoff_mm);
        for row in heights.chunks_exact_mut(columns) {
            fourier.analyse(row.iter().copied(), &mut harmonics);
            band.apply(&mut harmonics);
            row.copy_from_slice(fourier.synthesise(harmonics.iter().copied()));
        }
    } else {
        let filter = line(columns, map.dx_mm(), cutoff_mm, degree);
        for row in heights.chunks_exact_mut(columns) {
            let filtered: Vec<f64> = filter
                .iter()
                .map(|(first, weights)| row[*first..].iter().zip(weights).map(|(height, weight)| height * weight).sum())
                .collect();
            row.copy_from_slice(&filtered);
        }
    }
    let mut filtered = vec![0.0; heights.len()];
    for (target, (first, weights)) in filtered.chunks_exact_mut(columns).zip(line(rows, map.dy_mm(), cutoff_mm, degree))
    {
        for (row, weight) in heights[first * columns..].chunks_exact(columns).zip(weights) {
            target.iter_mut().zip(row).for_each(|(sum, height)| *sum += weight * height);
        }
    }
    filtered
}

/// An open filter on equal distances, row by row.
fn line(points: usize, spacing: f64, cutoff: f64, degree: Degree) -> Vec<(usize, Vec<f64>)> {
    let positions: Vec<f64> = (0..points).map(|point| point as f64 * spacing).collect();
    let smoother = Smoother::open(&positions, cutoff, degree);
    (0..points).map(|point| smoother.row(point)).collect()
}
