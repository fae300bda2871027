//! What noise adds to the values of a polar plot.

use runout_numerics::{Complex64, fourier::Fourier};
use runout_standards::{
    roundness::{self, FixedCentre},
    uncertainty::{
        DRAWS, Errors, LikelyForm, NORMAL_95, Noise, Uncertainty, extreme, forms_to_draw, likely_forms,
        likely_values_of, overlooked_by, stand_in, student_95,
    },
};

/// How two values of a plot are found.
pub(super) enum Measure<'a> {
    /// Peak to valley and root mean square, which errors change without moving the centre.
    AboutFixedCentre,
    /// By this.
    Of(&'a dyn Fn(&[f64]) -> [f64; 2]),
}

/// How many orders a plot has, on which it depends what stands for the truth.
#[derive(Debug, Clone, Copy)]
pub(super) enum Orders {
    /// So many that neighbours show the noise of an order.
    Many,
    /// So few that one line may be in the neighbourhood of all others.
    Few,
}

/// A value's share of noise, and its uncertainty without it.
type Shared = (f64, Uncertainty);

/// What is known of the noise of a plot's harmonics, by order from 0.
pub(super) struct NoiseOf<'a> {
    /// E|δ|².
    pub variance: &'a [f64],
    /// Real degrees of freedom that it comes from; 0, and nothing, where it is taken as exact.
    pub freedom: &'a [usize],
    /// Orders below are exact.
    pub lowest: usize,
    pub seed: u64,
}

/// What noise adds to two values of a plot in the mean, and the uncertainty of each without it; `None` where no variance is
/// known. Tilt has noise of all orders and little motion above the low ones, so that noise adds up.
///
/// Of many orders, what the true motion may be is drawn, as the true form is of roundness: motion far below the noise has values that noise nearly
/// hides, not none: draws about what stands out of the noise held the truth in 57 to 79 % then. The interval holds that of these draws too: single
/// weak orders between strong ones are motion more often than the orders beside them let expect. The share of noise
/// is taken from the draws about what stands out, which errs less: the median of the others is a fifth of that share too large.
///
/// Of few orders, those near noise may be motion or not. The interval reaches from what is right where they are noise to what is right where
/// all that was found is motion: one of both alone holds the truth in 30 to 80 % of simulated plots with motion of about its noise.
pub(super) fn without_noise(
    found: [f64; 2],
    plot: &[f64],
    noise: &NoiseOf,
    (measure, orders): (&Measure, Orders),
) -> Option<[Shared; 2]> {
    if plot.len() < 2 {
        return None;
    }
    let NoiseOf { variance, lowest, seed, .. } = *noise;
    let mut fourier = Fourier::new(plot.len());
    let mut harmonics = vec![Complex64::ZERO; variance.len().min(fourier.max_order() + 1)];
    fourier.analyse(plot.iter().copied(), &mut harmonics);
    let mut about = |weights: &[f64]| {
        // What is above the orders with a known variance stays.
        let noise = harmonics.iter().zip(weights).map(|(value, weight)| value * (1.0 - weight));
        let mut likely = plot.to_vec();
        likely.iter_mut().zip(fourier.synthesise(noise)).for_each(|(value, noise)| *value -= noise);
        drawn_about(found, &likely, Errors::new(variance, lowest, seed)?, &mut fourier, measure)
    };
    let ([range, rms], [other_range, other_rms]) = match orders {
        Orders::Many => {
            let about_stand_in = about(&stand_in(&harmonics, variance, lowest))?;
            (about_stand_in, likely_values(found, plot, &harmonics, noise, &mut fourier, measure)?)
        }
        Orders::Few => {
            let about_clear = about(&clear_of_noise(&harmonics, variance, lowest))?;
            (about_clear, about(&vec![1.0; harmonics.len()])?.map(|(_, known)| known))
        }
    };
    Some([joined(range, &other_range), joined(rms, &other_rms)])
}

/// From draws of what the true motion may be.
fn likely_values(
    found: [f64; 2],
    plot: &[f64],
    harmonics: &[Complex64],
    noise: &NoiseOf,
    fourier: &mut Fourier,
    measure: &Measure,
) -> Option<[Uncertainty; 2]> {
    let NoiseOf { variance, freedom, lowest, seed } = *noise;
    let likely = likely_forms(harmonics, variance, freedom, lowest);
    // As wide as it is badly known.
    let wider = freedom.iter().map(|freedom| (student_95(*freedom as f64) / NORMAL_95).powi(2));
    let wider = wider.chain(std::iter::repeat(1.0));
    let widened: Vec<f64> = variance.iter().zip(wider).map(|(variance, wider)| variance * wider).collect();
    let numbers = Noise::new(variance.len(), seed);
    let forms = forms_to_draw(&likely, harmonics, &widened, DRAWS, &numbers, fourier);
    let drawn: Vec<[f64; 2]> = forms.iter().flat_map(|form| values_of(form, fourier, measure)).collect();
    let transforms = forms.iter().filter(|form| !form.least).map(LikelyForm::transforms).sum();
    let mut each = drawn.iter();
    let known = likely_values_of(&forms, transforms, |disturbed, values| {
        values.extend(if disturbed { each.next().copied().unwrap_or(found) } else { found });
    });
    let [(_, range), (_, rms)] = <[_; 2]>::try_from(known).ok()?;
    let range = match overlooked_by(&forms, plot) {
        Some(of_noise) => range?.of_any_form(found[0], of_noise, 2.0),
        None => range?,
    };
    Some([range, rms?])
}

/// The values of as many draws of a form as it says.
fn values_of(form: &LikelyForm, fourier: &mut Fourier, measure: &Measure) -> Vec<[f64; 2]> {
    let mut errors = form.errors();
    match measure {
        Measure::AboutFixedCentre => {
            let plot = about_mean(&form.mean_um);
            let both = |values: roundness::Values| [values.ront_um, values.ronq_um];
            let mut next = || match &mut errors {
                Some(errors) => both(plot.values(&errors.turned(fourier))),
                None => both(plot.about()),
            };
            (0..form.draws).map(|_| next()).collect()
        }
        Measure::Of(values) => {
            let mut drawn = form.mean_um.clone();
            let mut next = || {
                if let Some(errors) = &mut errors {
                    errors.draw(fourier, &form.mean_um, &mut drawn);
                }
                values(&drawn)
            };
            (0..form.draws).map(|_| next()).collect()
        }
    }
}

/// Errors of orders from 1 on leave the mean.
fn about_mean(plot: &[f64]) -> FixedCentre {
    let mean = plot.iter().sum::<f64>() / plot.len() as f64;
    FixedCentre::new(plot.iter().map(|value| value - mean).collect())
}

fn drawn_about(
    found: [f64; 2],
    likely: &[f64],
    mut errors: Errors,
    fourier: &mut Fourier,
    measure: &Measure,
) -> Option<[Shared; 2]> {
    let (about, drawn): ([f64; 2], Vec<[f64; 2]>) = match measure {
        Measure::AboutFixedCentre => {
            let plot = about_mean(likely);
            let both = |values: roundness::Values| [values.ront_um, values.ronq_um];
            (both(plot.about()), (0..DRAWS).map(|_| both(plot.values(&errors.turned(fourier)))).collect())
        }
        Measure::Of(values) => {
            let mut drawn = likely.to_vec();
            let mut next = || {
                errors.draw(fourier, likely, &mut drawn);
                values(&drawn)
            };
            let all = (0..DRAWS).map(|_| next()).collect();
            (values(likely), all)
        }
    };
    let (first, second) = drawn.into_iter().map(|[first, second]| (first, second)).unzip();
    Some([extreme(found[0], about[0], first)?, extreme(found[1], about[1], second)?])
}

/// With an interval that holds both.
fn joined((share, known): Shared, other: &Uncertainty) -> Shared {
    let low = known.interval_95[0].min(other.interval_95[0]);
    let high = known.interval_95[1].max(other.interval_95[1]);
    let std = known.std.max((high - low) / (2.0 * NORMAL_95));
    (share, Uncertainty { std, interval_95: [low, high], ..known })
}

/// Power over its variance from which on an order is motion: noise alone exceeds it in 1 of 8000 cases.
const CLEAR: f64 = 9.0;

/// Weights by order of what is motion beyond doubt: an order that is clear of noise keeps its share of power without noise, the others the
/// share that they have together. Orders below `lowest` keep all.
fn clear_of_noise(harmonics: &[Complex64], variance: &[f64], lowest: usize) -> Vec<f64> {
    let ratio = |order: usize| harmonics[order].norm_sqr() / variance[order];
    let weak: Vec<f64> = (lowest..harmonics.len()).map(ratio).filter(|ratio| *ratio <= CLEAR).collect();
    let mean = weak.iter().sum::<f64>() / weak.len().max(1) as f64;
    let together = if mean - 1.0 > 2.0 / (weak.len().max(1) as f64).sqrt() { 1.0 - 1.0 / mean } else { 0.0 };
    let weight = |order: usize| match ratio(order) {
        _ if order < lowest => 1.0,
        own if own > CLEAR => 1.0 - 1.0 / own,
        _ => together,
    };
    (0..harmonics.len()).map(weight).collect()
}
