//! Ranges before and after compensation, on touches that the fit has not seen.

use runout_core::numerics::least_squares::{SINGULAR, least_norm};

use crate::{
    config::TouchProbeConfig,
    design::{Content, Design, Fitted, Weights, form_order, lobing_order},
    effects::Missing,
    lobe::Lobe,
    touches::Touches,
};

/// Most fits.
const MOST_FOLDS: usize = 10;

/// Mean range over passes, in µm, and the standard deviation of that mean.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Range {
    pub um: f64,
    pub std_um: f64,
}

/// Ranges of the radius of a pass: touches of one setup and repeat about their own least-squares circle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Ranges {
    pub before: Range,
    /// Lobing taken out.
    pub after: Range,
    /// Lobing and the form of the ring taken out.
    pub without_form: Range,
    /// Whether whole repeats were held out; else every fifth touch was.
    pub by_repeats: bool,
    /// Touches of a pass, in the mean.
    pub touches: f64,
}

/// Ranges on data that are left out of the fit in turns.
pub(crate) fn ranges(
    config: &TouchProbeConfig,
    touches: &Touches,
    missing: &[Missing],
    content: &Content,
    readings_um: &[f64],
    weights: &Weights,
) -> Ranges {
    let design = Design::new(config, touches, missing, content);
    let by_repeats = touches.repeats.len() > 1;
    let folds = if by_repeats { touches.repeats.len().min(MOST_FOLDS) } else { 5 };
    let place = |repeat: usize| touches.repeats.iter().position(|known| *known == repeat).unwrap_or(0);
    let fold: Vec<usize> = (touches.all.iter().enumerate())
        .map(|(row, touch)| if by_repeats { place(touch.repeat) % folds } else { row % folds })
        .collect();
    let (mut after, mut without_form) = (vec![f64::NAN; readings_um.len()], vec![f64::NAN; readings_um.len()]);
    for number in 0..folds {
        let used: Vec<usize> = (0..fold.len()).filter(|row| fold[*row] != number).collect();
        let fit = design.fit(readings_um, weights, &used);
        let lobes = Lobe::all(config, &fit);
        for row in (0..fold.len()).filter(|row| fold[*row] == number) {
            let less = readings_um[row] - effects(&fit, row);
            after[row] = less - lobing(&fit, &lobes, row);
            without_form[row] = after[row] - form(&fit, row);
        }
    }
    let passes: Vec<Vec<usize>> = touches.passes().into_iter().filter(|pass| pass.len() > 4).collect();
    let of =
        |values: &[f64]| range(&passes.iter().map(|pass| about_circle(touches, values, pass)).collect::<Vec<f64>>());
    let count = passes.iter().map(Vec::len).sum::<usize>() as f64 / passes.len().max(1) as f64;
    Ranges { before: of(readings_um), after: of(&after), without_form: of(&without_form), by_repeats, touches: count }
}

/// Lobing that a fit predicts of a touch: orders with evidence.
fn lobing(fit: &Fitted, lobes: &[Lobe], row: usize) -> f64 {
    let evident = lobes.iter().filter(|lobe| lobe.evident);
    let places = evident.filter_map(|lobe| fit.design.pair(lobing_order, lobe.order)).flatten();
    places.map(|place| fit.solved.coefficients[place] * fit.design.columns[place][row]).sum()
}

fn form(fit: &Fitted, row: usize) -> f64 {
    let of_form = |place: &usize| form_order(&fit.design.parameters[*place]).is_some();
    let places = (0..fit.design.parameters.len()).filter(of_form);
    places.map(|place| fit.solved.coefficients[place] * fit.design.columns[place][row]).sum()
}

fn effects(fit: &Fitted, row: usize) -> f64 {
    let of_effect = |place: &usize| matches!(fit.design.parameters[*place], crate::design::Parameter::Effect { .. });
    let places = (0..fit.design.parameters.len()).filter(of_effect);
    places.map(|place| fit.solved.coefficients[place] * fit.design.columns[place][row]).sum()
}

/// Range of some values about their least-squares circle.
fn about_circle(touches: &Touches, values: &[f64], pass: &[usize]) -> f64 {
    let column = |of: fn(f64) -> f64| pass.iter().map(|row| of(touches.all[*row].angle)).collect::<Vec<f64>>();
    let left = least_norm(
        &[column(|_| 1.0), column(f64::cos), column(f64::sin)],
        &pass.iter().map(|row| values[*row]).collect::<Vec<f64>>(),
        SINGULAR,
    )
    .residual;
    left.iter().copied().fold(f64::NEG_INFINITY, f64::max) - left.iter().copied().fold(f64::INFINITY, f64::min)
}

fn range(each: &[f64]) -> Range {
    let count = each.len() as f64;
    let mean = each.iter().sum::<f64>() / count;
    let scatter = each.iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (count - 1.0);
    Range { um: mean, std_um: (scatter / count).sqrt() }
}
