//! Each order's course over the turns as a sum of cosines.

use std::f64::consts::PI;

use runout_numerics::{Complex64, fourier::Fourier};

use super::TurnTable;

/// Components of a window.
pub(super) const TOGETHER: usize = 2;

/// Orthonormal cosine transforms over the rows of every order and channel.
pub(super) struct Spectrum {
    /// Power of each order in windows of [`TOGETHER`] components, channels summed, `[order from 1][window]`. The first is slow.
    pub windows: Vec<Vec<f64>>,
    /// The slow components, `[order from 1][component][channel]`.
    pub slow: Vec<[Vec<Complex64>; TOGETHER]>,
    /// Power of what changes its sign from row to row, beside the largest other window, by order from 1.
    pub alternating: Vec<f64>,
}

impl Spectrum {
    pub(super) fn of(table: &TurnTable) -> Self {
        let rows = table.rows();
        let mut fourier = Fourier::new(2 * rows);
        let mut harmonics = [vec![Complex64::ZERO; rows], vec![Complex64::ZERO; rows]];
        let mut mirrored = vec![0.0; 2 * rows];
        let scale = (0.5 * rows as f64).sqrt();
        // The rows' mirror image lies half a row behind.
        let turned = |component: usize| scale * Complex64::cis(-PI * component as f64 / (2 * rows) as f64);
        let turned: Vec<Complex64> = (0..rows).map(turned).collect();
        let mut found = Self { windows: Vec::new(), slow: Vec::new(), alternating: Vec::new() };
        for order in 1..=table.orders {
            let mut power = vec![0.0; rows];
            let mut slow = [vec![Complex64::ZERO; table.channels], vec![Complex64::ZERO; table.channels]];
            let mut alternating = 0.0;
            for channel in 0..table.channels {
                for (harmonics, part) in
                    harmonics.iter_mut().zip([|value: Complex64| value.re, |value: Complex64| value.im])
                {
                    for (row, value) in table.series(order, channel).enumerate() {
                        mirrored[row] = part(value);
                        mirrored[2 * rows - 1 - row] = part(value);
                    }
                    fourier.analyse_in_place(&mut mirrored, harmonics);
                }
                for (component, power) in power.iter_mut().enumerate().skip(1) {
                    let [re, im] = [0, 1].map(|part: usize| (turned[component] * harmonics[part][component]).re);
                    *power += re * re + im * im;
                    if let Some(slow) = slow.get_mut(component - 1) {
                        slow[channel] = Complex64::new(re, im);
                    }
                }
                let signed = table.series(order, channel).enumerate();
                let sum: Complex64 = signed.map(|(row, value)| if row % 2 == 0 { value } else { -value }).sum();
                alternating += sum.norm_sqr() / rows as f64;
            }
            let windows: Vec<f64> = power[1..].chunks_exact(TOGETHER).map(|window| window.iter().sum()).collect();
            // What alternates leaks into the fastest windows.
            let others = &windows[..windows.len() - windows.len() / 4];
            let most = others.iter().copied().fold(0.0, f64::max);
            found.alternating.push(alternating / most.max(f64::MIN_POSITIVE));
            found.windows.push(windows);
            found.slow.push(slow);
        }
        found
    }

    /// The slow course of an order and channel about its mean, one value a row.
    pub(super) fn course(&self, order: usize, channel: usize, rows: usize) -> impl Iterator<Item = Complex64> + '_ {
        let slow = &self.slow[order - 1];
        (0..rows).map(move |row| {
            let wave = |component: usize| (PI * component as f64 * (row as f64 + 0.5) / rows as f64).cos();
            (slow[0][channel] * wave(1) + slow[1][channel] * wave(2)) * (2.0 / rows as f64).sqrt()
        })
    }
}
