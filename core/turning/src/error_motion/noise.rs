//! What noise adds to the values of a polar plot.

use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::{
    roundness::{self, FixedCentre},
    uncertainty::{DRAWS, Errors, Uncertainty, extreme, stand_in},
};

/// How two values of a plot are found.
pub(super) enum Measure<'a> {
    /// Peak to valley and root mean square, which errors change without moving the centre.
    AboutFixedCentre,
    /// By this.
    Of(&'a dyn Fn(&[f64]) -> [f64; 2]),
}

/// What noise adds to two values of a plot in the mean, and the uncertainty of each without it; `None` where no variance is
/// known. Tilt has noise of all orders and little motion above the low ones, so that noise adds up.
pub(super) fn without_noise(
    found: [f64; 2],
    plot: &[f64],
    variance: &[f64],
    lowest: usize,
    seed: u64,
    measure: &Measure,
) -> Option<[(f64, Uncertainty); 2]> {
    if plot.len() < 2 {
        return None;
    }
    let mut errors = Errors::new(variance, lowest, seed)?;
    let mut fourier = Fourier::new(plot.len());
    let mut harmonics = vec![Complex64::ZERO; variance.len().min(fourier.max_order() + 1)];
    fourier.analyse(plot.iter().copied(), &mut harmonics);
    let weights = stand_in(&harmonics, variance, lowest);
    // What is above the orders with a known variance stays.
    let noise: Vec<Complex64> = harmonics.iter().zip(weights).map(|(value, weight)| value * (1.0 - weight)).collect();
    let mut likely = plot.to_vec();
    likely.iter_mut().zip(fourier.synthesise(noise)).for_each(|(value, noise)| *value -= noise);
    let (about, drawn): ([f64; 2], Vec<[f64; 2]>) = match measure {
        Measure::AboutFixedCentre => {
            // Errors of orders from 1 on leave the mean.
            let mean = likely.iter().sum::<f64>() / likely.len() as f64;
            likely.iter_mut().for_each(|value| *value -= mean);
            let plot = FixedCentre::new(likely);
            let both = |values: roundness::Values| [values.ront_um, values.ronq_um];
            (both(plot.about()), (0..DRAWS).map(|_| both(plot.values(&errors.turned(&mut fourier)))).collect())
        }
        Measure::Of(values) => {
            let mut drawn = likely.clone();
            let mut next = || {
                errors.draw(&mut fourier, &likely, &mut drawn);
                values(&drawn)
            };
            let all = (0..DRAWS).map(|_| next()).collect();
            (values(&likely), all)
        }
    };
    let (first, second) = drawn.into_iter().map(|[first, second]| (first, second)).unzip();
    Some([extreme(found[0], about[0], first)?, extreme(found[1], about[1], second)?])
}
