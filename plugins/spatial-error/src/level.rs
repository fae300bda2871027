//! How far a fit is from its readings, and what noise makes of that.

use runout_core::closed_loop::diagnosis::Level;

use crate::{campaign::Campaign, noise::Noise, projections::Projections, residual::residual_um, solve::Solution};

/// How far a fit is from its readings.
pub(crate) fn level(campaign: &Campaign, solution: &Solution) -> Level {
    let residual = residual_um(campaign, solution);
    let readings = campaign.numbers() as f64;
    let squares: f64 = residual.iter().flatten().filter(|left| left.is_finite()).map(|left| left * left).sum();
    let left_out = solution.left_out();
    let each = || left_out.iter().flatten().filter(|one| one.std_um.is_finite());
    let count = each().count().max(1) as f64;
    let known = campaign.noise != Noise::Unknown;
    let expected = known.then(|| expected_squares(campaign, solution)).flatten();
    let finite = |value: f64| value.is_finite().then_some(value);
    Level {
        residual_rms_um: (squares / readings).sqrt(),
        degrees_of_freedom: campaign.numbers().saturating_sub(solution.terms.len()),
        noise_floor_um: expected.and_then(|expected| finite((expected / readings).sqrt())),
        chi2_per_dof: expected.and_then(|expected| finite(squares / expected)),
        held_out_rms_um: finite((each().map(|one| one.residual_um.powi(2)).sum::<f64>() / count).sqrt()),
        held_out_expected_rms_um: known
            .then(|| (each().map(|one| one.std_um.powi(2)).sum::<f64>() / count).sqrt())
            .and_then(finite),
        unit: None,
        orders: None,
    }
}

/// What the noise lets the squares of the residual be: of the mean at a place v²·P, of its repeats their scatter. `None` where
/// predictions use neighbours.
fn expected_squares(campaign: &Campaign, solution: &Solution) -> Option<f64> {
    if solution.fitted.is_some() {
        return None;
    }
    let projections = Projections::of(&solution.joint);
    let mut repeats = vec![0.0; campaign.places_mm.len()];
    campaign.place_of.iter().for_each(|place| repeats[*place] += 1.0);
    let mut expected = 0.0;
    for place in 0..campaign.places_mm.len() {
        let projection = projections.block(&[place]);
        for field in 0..campaign.measured.len() {
            let noise = solution.noise_um2(campaign, place, field);
            expected += repeats[place] * noise * noise * projection[(field, field)];
            // Scatter within a place: (n − 1)·σ², and σ² is n times the variance of the mean.
            expected += (repeats[place] - 1.0) * repeats[place] * noise;
        }
    }
    Some(expected)
}
