//! The table `variogram`: half the mean squared difference of places by their distance, beside the fitted covariance.

use runout_core::table::{ArrayRef, ColumnSpec, Figure, Measure, TableSpec, counts, numbers, texts};

use crate::{
    campaign::{COMPONENTS, Campaign},
    solve::Solution,
};

/// Classes of distance along each axis.
const CLASSES: usize = 12;
/// Places that are compared at most: all pairs of them.
const MOST: usize = 800;
/// Cosine of the angle from an axis up to which a pair counts as along it.
const ALONG: f64 = 0.9;

/// The table.
#[must_use]
pub(crate) fn table() -> TableSpec {
    let um2 = |name: &str, about: &str| ColumnSpec::number(name, "um2", about);
    TableSpec::new(
        "variogram",
        "semivariance of what the trend leaves of the mean readings, by component and axis",
        vec![
            ColumnSpec::name("component", "dx, dy or dz"),
            ColumnSpec::name("axis", "pairs of places within 26° of this axis"),
            ColumnSpec::number("lag_mm", "mm", "mean distance of the pairs"),
            ColumnSpec::count("pairs", "", "how many"),
            um2("semivariance_um2", "half the mean squared difference"),
            um2("model_um2", "that of the fitted covariance along the axis, nugget and noise of the means included"),
        ],
    )
    .figure(
        Figure::lines(
            "variogram",
            "Variogram",
            "lag_mm",
            [Measure::new("semivariance_um2").with_symbol("readings"), Measure::new("model_um2").with_symbol("model")],
        )
        .panels(["component", "axis"]),
    )
}

/// Its columns.
#[must_use]
pub(crate) fn columns(campaign: &Campaign, solution: &Solution) -> Vec<ArrayRef> {
    let data = &solution.data;
    let count = data.places.len();
    let every = count.div_ceil(MOST);
    let chosen: Vec<usize> = (0..count).step_by(every).collect();
    let (mut component, mut axis_of, mut lag_of, mut pairs_of) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
    let (mut semivariance, mut model) = (Vec::new(), Vec::new());
    let fields = solution.measured.len();
    let left: Vec<Vec<f64>> = (0..fields)
        .map(|field| {
            let of_trend = |place: usize| -> f64 {
                (0..solution.terms.len()).map(|at| data.design[field][(place, at)] * solution.joint.trend[at]).sum()
            };
            chosen.iter().map(|place| data.observed[field].mean_um[*place] - of_trend(*place)).collect()
        })
        .collect();
    for axis in 0..3 {
        let longest = 1.4 * campaign.volume.half_mm[axis];
        let mut sums = [[0.0; 5]; CLASSES];
        for (one, first) in chosen.iter().enumerate() {
            for (other, second) in chosen.iter().enumerate().take(one) {
                let apart = [0, 1, 2].map(|at| data.places[*first][at] - data.places[*second][at]);
                let distance = apart.iter().map(|at| at * at).sum::<f64>().sqrt();
                if apart[axis].abs() < ALONG * distance || distance >= longest {
                    continue;
                }
                let sums = &mut sums[((distance / longest * CLASSES as f64) as usize).min(CLASSES - 1)];
                sums[0] += 1.0;
                sums[1] += distance;
                for field in 0..fields {
                    sums[2 + field] += 0.5 * (left[field][one] - left[field][other]).powi(2);
                }
            }
        }
        for (field, of) in solution.measured.iter().enumerate() {
            let covariance = &solution.covariances[field];
            let observed = &data.observed[field];
            let noise = (0..count).map(|place| observed.variance_um2(place)).sum::<f64>() / count as f64;
            let share = observed.share.iter().sum::<f64>() / count as f64;
            let nugget = covariance.nugget_um.powi(2) * share + noise;
            for sums in sums.iter().filter(|sums| sums[0] > 0.0) {
                let lag = sums[1] / sums[0];
                let correlation = covariance.family.correlation(lag / covariance.range_mm[axis]);
                component.push(COMPONENTS[*of]);
                axis_of.push(["x", "y", "z"][axis]);
                lag_of.push(lag);
                pairs_of.push(sums[0] as usize);
                semivariance.push(sums[2 + field] / sums[0]);
                model.push(nugget + covariance.sill_um.powi(2) * (1.0 - correlation));
            }
        }
    }
    vec![texts(component), texts(axis_of), numbers(lag_of), counts(pairs_of), numbers(semivariance), numbers(model)]
}
