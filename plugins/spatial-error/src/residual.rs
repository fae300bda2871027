//! What the fit leaves of each reading.

use crate::{campaign::Campaign, solve::Solution};

/// Reading less the fit at its place, trend and field, in µm.
#[must_use]
pub(crate) fn residual_um(campaign: &Campaign, solution: &Solution) -> Vec<[f64; 3]> {
    let terms = &solution.terms;
    let trend = &solution.joint.trend;
    // What noise is taken to be of the mean at each place.
    let of_mean: Vec<Vec<f64>> = if solution.fitted.is_none() {
        let fields = || solution.joint.fields.iter().enumerate();
        let mean = |place: usize| {
            fields().map(|(field, of)| solution.noise_um2(campaign, place, field) * of.alpha[place]).collect()
        };
        (0..campaign.places_mm.len()).map(mean).collect()
    } else {
        let predicted = solution.predict(campaign, &campaign.places_mm, false);
        let mean = |place: usize, (field, axis): (usize, usize)| {
            let of_trend: f64 =
                (0..terms.len()).map(|column| solution.data.design[field][(place, column)] * trend[column]).sum();
            let at_first: f64 = terms
                .iter()
                .zip(trend.iter())
                .map(|(term, value)| value * term.at(&campaign.volume, campaign.places_mm[place], 0.0)[axis])
                .sum();
            solution.data.observed[field].mean_um[place] - predicted[place][axis].mean_um - of_trend + at_first
        };
        let fields = || solution.measured.iter().copied().enumerate();
        (0..campaign.places_mm.len()).map(|place| fields().map(|field| mean(place, field)).collect()).collect()
    };
    let moving: Vec<usize> = (0..terms.len()).filter(|column| terms[*column].moves_in_time()).collect();
    let one = |(row, place): (usize, &usize)| {
        let of_field = |(field, axis): (usize, &usize)| {
            let drift: f64 = moving
                .iter()
                .map(|column| {
                    let now =
                        terms[*column].at(&campaign.volume, campaign.places_mm[*place], campaign.time[row])[*axis];
                    trend[*column] * (now - solution.data.design[field][(*place, *column)])
                })
                .sum();
            let from_mean = campaign.readings_um[row][*axis] - solution.data.observed[field].mean_um[*place];
            of_mean[*place][field] + from_mean - drift
        };
        solution.by_axis(solution.measured.iter().enumerate().map(of_field), f64::NAN)
    };
    campaign.place_of.iter().enumerate().map(one).collect()
}
