//! Spatial parameters of a map with errors added and taken away, many times over.
//!
//! The autocorrelation of z ± e is A(z, z) ± [A(z, e) + A(e, z)] + A(e, e). Where it falls to its level within few rows, only these
//! lags are computed, ring by ring, instead of a transform of the whole map. The spectrum that the direction is taken from is that of the map plus or
//! minus that of the errors. Of the dominant wavelength, errors of the lines that may be the strongest are drawn.

#![allow(clippy::inline_always, reason = "see runout_numerics::lanes")]

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::{
    HeightMap,
    correlation::{Line, correlate},
    direction::Directions,
    spatial::{Decay, Rows, Spatial},
};
use runout_numerics::{
    Complex64,
    fourier::{real_forward, real_inverse},
    lanes::{NullaryFnOnce, vectorised},
};

/// Row lags that are computed one by one, at most.
const MOST_LAGS: usize = 10;
/// Row lags beyond those that the map itself asks for.
const SPARE_LAGS: usize = 1;
/// Lines whose amplitude is less than the largest by more than so many of their standard deviations are not the dominant one.
const FAR: f64 = 8.0;

/// A map, and what its draws share.
pub struct SpatialDraws<'a> {
    map: HeightMap<'a>,
    decay: f64,
    /// Sums of products at the lags of rows that are kept, `[row lag][column lag]`.
    sums: Vec<f64>,
    lags: usize,
    rows: Planes,
    lines: Vec<SpectralLine>,
    directions: Directions,
    spectra: Vec<Complex64>,
    strongest: Option<Strongest>,
    random: ChaCha8Rng,
}

/// A line of the map's spectrum.
struct SpectralLine {
    across: usize,
    amplitude: f64,
    wavelength_mm: f64,
}

/// Of the lines that may be dominant: amplitude, standard deviation of an error's real part, and wavelength.
struct Strongest(Vec<[f64; 3]>);

/// Spectra of rows, real and imaginary parts apart.
#[derive(Default)]
struct Planes {
    re: Vec<f64>,
    im: Vec<f64>,
    bins: usize,
}

impl Planes {
    fn of(heights_um: &[f64], columns: usize) -> Self {
        let forward = real_forward(columns);
        let (mut signal, mut line, mut scratch) =
            (forward.make_input_vec(), forward.make_output_vec(), forward.make_scratch_vec());
        let (count, bins) = (heights_um.len() / columns * line.len(), line.len());
        let (mut re, mut im) = (Vec::with_capacity(count), Vec::with_capacity(count));
        for row in heights_um.chunks_exact(columns) {
            signal.copy_from_slice(row);
            // The buffers have the plan's lengths.
            let _ = forward.process_with_scratch(&mut signal, &mut line, &mut scratch);
            re.extend(line.iter().map(|bin| bin.re));
            im.extend(line.iter().map(|bin| bin.im));
        }
        Self { re, im, bins }
    }

    fn row(&self, row: usize) -> [&[f64]; 2] {
        [&self.re, &self.im].map(|plane| &plane[row * self.bins..(row + 1) * self.bins])
    }

    fn count(&self) -> usize {
        self.re.len() / self.bins.max(1)
    }
}

/// Adds conj(z)·e' + conj(e)·z' to one sum and conj(e)·e' to another.
struct Products<'a> {
    form: [[&'a [f64]; 2]; 2],
    errors: [[&'a [f64]; 2]; 2],
    crossed: [&'a mut [f64]; 2],
    own: [&'a mut [f64]; 2],
}

impl NullaryFnOnce for Products<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { form: [z, z_far], errors: [e, e_far], crossed: [re, im], own: [own_re, own_im] } = self;
        let bins = re.len();
        let [z, z_far, e, e_far] = [z, z_far, e, e_far].map(|planes| planes.map(|plane| &plane[..bins]));
        let (im, own_re, own_im) = (&mut im[..bins], &mut own_re[..bins], &mut own_im[..bins]);
        for bin in 0..bins {
            re[bin] += z[0][bin] * e_far[0][bin]
                + z[1][bin] * e_far[1][bin]
                + e[0][bin] * z_far[0][bin]
                + e[1][bin] * z_far[1][bin];
            im[bin] += z[0][bin] * e_far[1][bin] - z[1][bin] * e_far[0][bin] + e[0][bin] * z_far[1][bin]
                - e[1][bin] * z_far[0][bin];
            own_re[bin] += e[0][bin] * e_far[0][bin] + e[1][bin] * e_far[1][bin];
            own_im[bin] += e[0][bin] * e_far[1][bin] - e[1][bin] * e_far[0][bin];
        }
    }
}

/// Rows of an autocorrelation of which only the first are there.
struct Few {
    sums: Vec<f64>,
    width: usize,
    /// Whether another was asked for.
    lacked: bool,
}

impl Rows for Few {
    fn width(&self) -> usize {
        self.width
    }

    fn row(&mut self, lag: usize) -> Option<&[f64]> {
        let row = self.sums.get(lag * self.width..(lag + 1) * self.width);
        self.lacked |= row.is_none();
        row
    }
}

impl<'a> SpatialDraws<'a> {
    /// About a closed map with mean 0, of which nothing is missing, and the map's own values; `None` for other maps, and where the
    /// autocorrelation falls to its level too slowly for single lags. Errors of rows have to be independent.
    #[must_use]
    pub fn new(centred: HeightMap<'a>, decay: f64) -> Option<(Self, Spatial)> {
        if !centred.closed() || centred.missing() > 0 {
            return None;
        }
        let columns = centred.columns();
        let lengths = [columns as f64 * centred.dx_mm(), centred.rows() as f64 * centred.dy_mm()];
        let mut lines = Vec::new();
        let mut correlation = correlate(&centred, centred.heights_um(), |Line { across, along, amplitude }| {
            if across == 0 && along == 0 {
                return;
            }
            let (fx, fy) = (across as f64 / lengths[0], along as f64 / lengths[1]);
            lines.push(SpectralLine { across, amplitude, wavelength_mm: fx.hypot(fy).recip() });
        });
        let [sal_mm, longest_mm] = Decay::new(&centred, &mut correlation, true, decay).lengths();
        let asked = (0..centred.rows()).rev().find(|lag| correlation.is_known(*lag)).unwrap_or(0);
        let lags = (asked + 1 + SPARE_LAGS).min(centred.rows());
        if lags > MOST_LAGS {
            return None;
        }
        let sums = (0..lags).flat_map(|lag| correlation.row(lag).to_vec()).collect();
        let rows = Planes::of(centred.heights_um(), columns);
        let directions = Directions::new(&centred);
        let strongest = lines.iter().max_by(|a, b| a.amplitude.total_cmp(&b.amplitude));
        let own = Spatial {
            sal_mm,
            str: sal_mm / longest_mm,
            std_deg: directions.direction_deg(centred.heights_um()),
            ssw_mm: strongest.map_or(f64::NAN, |line| line.wavelength_mm),
        };
        let random = ChaCha8Rng::seed_from_u64(1);
        let spectra = directions.spectra(centred.heights_um());
        let draws = Self { map: centred, decay, sums, lags, rows, lines, directions, spectra, strongest: None, random };
        Some((draws, own))
    }

    /// Values of the map with errors added and taken away.
    pub fn both(&mut self, errors_um: &[f64]) -> [Spatial; 2] {
        let errors = Planes::of(errors_um, self.map.columns());
        let lengths = self.autocorrelations(&errors).map(|sums| self.lengths(sums));
        let strongest = self.strongest.get_or_insert_with(|| Strongest::of(&self.lines, &errors));
        let dominant = strongest.draw(&mut self.random);
        let directions = self.directions.both_deg(&self.spectra, errors_um);
        let found = lengths.into_iter().zip(directions.into_iter().zip(dominant)).enumerate();
        let mut both = found.map(|(sign, (lengths, (std_deg, ssw_mm)))| {
            let [sal_mm, longest_mm] = lengths.unwrap_or_else(|| {
                // The lags that are there do not reach.
                let sign = if sign == 0 { 1.0 } else { -1.0 };
                let heights = self.map.heights_um().iter().zip(errors_um).map(|(height, error)| height + sign * error);
                let map = self.map.with(heights.collect());
                let mut correlation = correlate(&map, map.heights_um(), |_| ());
                Decay::new(&map, &mut correlation, true, self.decay).lengths()
            });
            Spatial { sal_mm, str: sal_mm / longest_mm, std_deg, ssw_mm }
        });
        [both.next().unwrap_or(Spatial::NONE), both.next().unwrap_or(Spatial::NONE)]
    }

    /// Sums of products at the lags kept, with errors added and taken away.
    fn autocorrelations(&self, errors: &Planes) -> [Vec<f64>; 2] {
        let columns = self.map.columns();
        let inverse = real_inverse(columns);
        let (mut line, mut row, mut scratch) =
            (inverse.make_input_vec(), inverse.make_output_vec(), inverse.make_scratch_vec());
        let mut both = [self.sums.clone(), self.sums.clone()];
        let bins = self.rows.bins;
        for lag in 0..self.lags {
            let mut sums = [(); 4].map(|()| vec![0.0; bins]);
            for near in 0..self.rows.count() - lag {
                let [re, im, own_re, own_im] = &mut sums;
                vectorised(Products {
                    form: [self.rows.row(near), self.rows.row(near + lag)],
                    errors: [errors.row(near), errors.row(near + lag)],
                    crossed: [re, im],
                    own: [own_re, own_im],
                });
            }
            let [re, im, own_re, own_im] = &sums;
            for (which, [re, im]) in [[re, im], [own_re, own_im]].into_iter().enumerate() {
                for (bin, (re, im)) in line.iter_mut().zip(re.iter().zip(im)) {
                    *bin = Complex64::new(*re, *im);
                }
                // Real by right; the inverse transform asks for it.
                line[0].im = 0.0;
                if columns.is_multiple_of(2) {
                    line[bins - 1].im = 0.0;
                }
                // The buffers have the plan's lengths.
                let _ = inverse.process_with_scratch(&mut line, &mut row, &mut scratch);
                for (sign, sums) in [1.0, if which == 0 { -1.0 } else { 1.0 }].into_iter().zip(&mut both) {
                    let target = &mut sums[lag * columns..(lag + 1) * columns];
                    target.iter_mut().zip(&row).for_each(|(sum, value)| *sum += sign * value / columns as f64);
                }
            }
        }
        both
    }

    /// Shortest and longest lag; `None` where the lags kept do not reach.
    fn lengths(&self, sums: Vec<f64>) -> Option<[f64; 2]> {
        let mut few = Few { sums, width: self.map.columns(), lacked: false };
        let lengths = Decay::new(&self.map, &mut few, true, self.decay).lengths();
        (!few.lacked).then_some(lengths)
    }
}

impl Strongest {
    /// Of errors that are alike at all periods along the rows: the mean of |E|² over these is the sum over the rows.
    fn of(lines: &[SpectralLine], errors: &Planes) -> Self {
        let mut squares = vec![0.0; errors.bins];
        for row in 0..errors.count() {
            let [re, im] = errors.row(row);
            squares.iter_mut().zip(re.iter().zip(im)).for_each(|(sum, (re, im))| *sum += re * re + im * im);
        }
        let std = |line: &SpectralLine| (0.5 * squares[line.across]).sqrt();
        let least = lines.iter().map(|line| line.amplitude - FAR * std(line)).fold(0.0, f64::max);
        let strongest = lines.iter().filter(|line| line.amplitude + FAR * std(line) > least);
        Self(strongest.map(|line| [line.amplitude, std(line), line.wavelength_mm]).collect())
    }

    /// Dominant wavelength with errors added and taken away.
    fn draw(&self, random: &mut ChaCha8Rng) -> [f64; 2] {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let errors: Vec<Complex64> = self.0.iter().map(|_| Complex64::new(normal(), normal())).collect();
        [1.0, -1.0].map(|sign| {
            let with_error = self.0.iter().zip(&errors);
            let amplitudes = with_error.map(|([amplitude, std, wavelength_mm], error)| {
                ((amplitude + sign * std * error).norm(), *wavelength_mm)
            });
            amplitudes.max_by(|a, b| a.0.total_cmp(&b.0)).map_or(f64::NAN, |(_, wavelength_mm)| wavelength_mm)
        })
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use std::f64::consts::TAU;

    use super::*;

    const ROWS: usize = 30;
    const COLUMNS: usize = 64;

    fn map(random: &mut ChaCha8Rng, along: usize) -> HeightMap<'static> {
        let mut normal = || -> f64 { StandardNormal.sample(random) };
        let white: Vec<f64> = (0..(ROWS + along) * COLUMNS).map(|_| normal()).collect();
        // Means over neighbours along and across: correlated over some lags.
        let at = |place: usize| {
            let (row, column) = (place / COLUMNS, place % COLUMNS);
            let each = (0..along).flat_map(|down| (0..5).map(move |beside| (down, beside)));
            each.map(|(down, beside)| white[(row + down) * COLUMNS + (column + beside) % COLUMNS]).sum::<f64>()
        };
        let heights: Vec<f64> = (0..ROWS * COLUMNS).map(at).collect();
        let map = HeightMap::new(heights, COLUMNS, 0.1, 0.2, true).unwrap();
        map.with(crate::areal::height::centred(map.heights_um()))
    }

    /// Lengths are those of whole transforms, of small errors and of errors as large as the map.
    #[test]
    fn lengths_with_errors_are_those_of_whole_transforms() {
        let mut random = ChaCha8Rng::seed_from_u64(2);
        for (along, size) in [(1, 0.02), (3, 0.1), (2, 1.0)] {
            let base = map(&mut random, along);
            let (mut draws, own) = SpatialDraws::new(base.clone(), 0.2).unwrap();
            assert_eq!(own, Spatial::of(&base, 0.2));
            for _ in 0..5 {
                let errors: Vec<f64> = (0..ROWS * COLUMNS)
                    .map(|_| size * Distribution::<f64>::sample(&StandardNormal, &mut random))
                    .collect();
                let found = draws.both(&errors);
                for (sign, found) in [1.0, -1.0].into_iter().zip(found) {
                    let heights = base.heights_um().iter().zip(&errors).map(|(height, error)| height + sign * error);
                    let expected = Spatial::of(&base.with(heights.collect()), 0.2);
                    let same = |a: f64, b: f64| (a - b).abs() < 1e-9 * b || (a.is_nan() && b.is_nan());
                    assert!(same(found.sal_mm, expected.sal_mm), "{along} {size}: {found:?} {expected:?}");
                    assert!(same(found.str, expected.str), "{along} {size}: {found:?} {expected:?}");
                }
            }
        }
    }

    /// Directions are those of whole transforms, and the dominant wavelength changes as often: of two lines that are nearly as strong.
    #[test]
    fn directions_and_wavelengths_are_those_of_whole_transforms() {
        let mut random = ChaCha8Rng::seed_from_u64(4);
        let wave = |place: usize| {
            let (row, column) = ((place / COLUMNS) as f64 / ROWS as f64, (place % COLUMNS) as f64 / COLUMNS as f64);
            (TAU * 5.0 * column).cos() + 0.98 * (TAU * (3.0 * column + 4.0 * row)).cos()
        };
        let base =
            HeightMap::new((0..ROWS * COLUMNS).map(wave).collect::<Vec<f64>>(), COLUMNS, 0.1, 0.2, true).unwrap();
        let (mut draws, own) = SpatialDraws::new(base.clone(), 0.2).unwrap();
        let (mut quick, mut slow) = (0_u32, 0_u32);
        for _ in 0..300 {
            let errors: Vec<f64> =
                (0..ROWS * COLUMNS).map(|_| 0.5 * Distribution::<f64>::sample(&StandardNormal, &mut random)).collect();
            let heights = base.heights_um().iter().zip(&errors).map(|(height, error)| height + error);
            let expected = Spatial::of(&base.with(heights.collect()), 0.2);
            let [found, _] = draws.both(&errors);
            assert!((found.std_deg - expected.std_deg).abs() < 1e-9);
            for (count, one) in [(&mut quick, found), (&mut slow, expected)] {
                *count += u32::from((one.ssw_mm - own.ssw_mm).abs() > 1e-9);
            }
        }
        // √300/2: 9 at most.
        assert!(quick.abs_diff(slow) < 40 && slow > 30, "{quick} {slow}");
    }
}
