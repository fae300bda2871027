//! Spectrum and autocorrelation of a map, by one transform.

use std::sync::Arc;

use super::HeightMap;
use runout_numerics::{
    Complex64,
    fourier::{ComplexToReal, complex_forward, complex_inverse, real_forward, real_inverse},
};

/// Columns that are transformed together, for the sake of cache lines.
const TOGETHER: usize = 8;

/// Autocorrelation of a map over lags of rows from 0 and of columns, `[row lag][column lag]`. Column lags are taken
/// round the row's length: negative ones stand at its end.
pub(super) struct Correlation {
    values: Vec<f64>,
    /// Column lags in a row: all of a closed map, twice those of an open one.
    pub(super) width: usize,
    /// Of each row of lags, what the last transform takes, until it is asked for.
    spectrum: Vec<Complex64>,
    waiting: Vec<bool>,
    inverse: Arc<dyn ComplexToReal<f64>>,
    scratch: Vec<Complex64>,
    scale: f64,
}

impl Correlation {
    /// Whether the row at a lag was asked for.
    pub(super) fn is_known(&self, lag: usize) -> bool {
        !self.waiting[lag]
    }

    /// All lags of columns at a lag of rows: the sums of products.
    pub(super) fn row(&mut self, lag: usize) -> &mut [f64] {
        let target = &mut self.values[lag * self.width..][..self.width];
        if std::mem::take(&mut self.waiting[lag]) {
            let bins = self.width / 2 + 1;
            let line = &mut self.spectrum[lag * bins..][..bins];
            // Real in exact arithmetic; the inverse transform asks for it.
            line[0].im = 0.0;
            if self.width.is_multiple_of(2) {
                line[bins - 1].im = 0.0;
            }
            // The buffers have the plan's lengths.
            let scratch = &mut self.scratch[..self.inverse.get_scratch_len()];
            let _ = self.inverse.process_with_scratch(line, target, scratch);
            for value in &mut *target {
                *value *= self.scale;
            }
        }
        target
    }
}

/// A line of the map's spectrum.
pub(super) struct Line {
    /// Periods over the columns, from 0 to below half of them.
    pub(super) across: usize,
    /// Periods over the rows, from below half of them to above minus half.
    pub(super) along: isize,
    /// Of the line, which stands for its opposite too where `across` is not 0.
    pub(super) amplitude: f64,
}

/// Sums of products at all lags, of `heights` on the map's grid; `visit` sees the spectrum.
///
/// Open directions are padded with as many zeros as there are points: no end meets the other. Every second bin of a
/// padded spectrum is one of the map itself, so that one transform serves both.
pub(super) fn correlate(map: &HeightMap, heights: &[f64], mut visit: impl FnMut(Line)) -> Correlation {
    let (rows, columns) = (map.rows(), map.columns());
    let pad = if map.closed() { 1 } else { 2 };
    let (width, height) = (pad * columns, 2 * rows);
    let (forward, inverse) = (real_forward(width), real_inverse(width));
    let bins = width / 2 + 1;
    let mut spectrum = vec![Complex64::ZERO; rows * bins];
    let mut line = forward.make_input_vec();
    let mut scratch = vec![Complex64::ZERO; forward.get_scratch_len().max(inverse.get_scratch_len())];
    for (row, target) in heights.chunks_exact(columns).zip(spectrum.chunks_exact_mut(bins)) {
        line[..columns].copy_from_slice(row);
        line[columns..].fill(0.0);
        // The buffers have the plan's lengths.
        let _ = forward.process_with_scratch(&mut line, target, &mut scratch[..forward.get_scratch_len()]);
    }

    let (down, up) = (complex_forward(height), complex_inverse(height));
    let mut column_scratch = vec![Complex64::ZERO; down.get_inplace_scratch_len().max(up.get_inplace_scratch_len())];
    let mut block = vec![Complex64::ZERO; TOGETHER * height];
    for first in (0..bins).step_by(TOGETHER) {
        let together = TOGETHER.min(bins - first);
        let block = &mut block[..together * height];
        block.fill(Complex64::ZERO);
        for (row, line) in spectrum.chunks_exact(bins).enumerate() {
            for (index, bin) in line[first..first + together].iter().enumerate() {
                block[index * height + row] = *bin;
            }
        }
        down.process_with_scratch(block, &mut column_scratch);
        for (index, column) in block.chunks_exact(height).enumerate() {
            let bin = first + index;
            if bin.is_multiple_of(pad) && 2 * (bin / pad) < columns {
                for line in lines(column, rows, bin / pad) {
                    visit(line);
                }
            }
        }
        for bin in &mut *block {
            *bin = bin.norm_sqr().into();
        }
        up.process_with_scratch(block, &mut column_scratch);
        for (row, line) in spectrum.chunks_exact_mut(bins).enumerate() {
            for (index, bin) in line[first..first + together].iter_mut().enumerate() {
                *bin = block[index * height + row];
            }
        }
    }

    let scale = (width as f64 * height as f64).recip();
    let (values, waiting) = (vec![0.0; rows * width], vec![true; rows]);
    Correlation { values, width, spectrum, waiting, inverse, scratch, scale }
}

/// Lines of one column of the padded spectrum; those at half the sampling, whose direction cannot be known, are left out.
fn lines(column: &[Complex64], rows: usize, across: usize) -> impl Iterator<Item = Line> + '_ {
    (0..rows).filter(move |along| 2 * along != rows).map(move |along| Line {
        across,
        along: if 2 * along < rows { along.cast_signed() } else { along.cast_signed() - rows.cast_signed() },
        amplitude: column[2 * along].norm_sqr().sqrt(),
    })
}
