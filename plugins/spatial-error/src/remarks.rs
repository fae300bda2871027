//! What the user should know of a result.

use rand::{SeedableRng, seq::SliceRandom};
use rand_chacha::ChaCha8Rng;
use runout_core::numerics::number::significant;

use crate::{
    campaign::{COMPONENTS, Campaign},
    conclusion::{At, Conclusion},
    joint::{Covariance, Joint, LeftOut, Predictor, Query},
    neighbours::{NEAREST, Neighbours},
    noise::Noise,
    solve::{Solution, estimated_from},
    suspects::{drift, groups},
    terms::Term,
};

/// Places on which predictions from neighbours are compared with the full solution, and how many are predicted.
const COMPARED: [usize; 2] = [1200, 200];
/// A left-out residual of more than this many standard deviations is worth a word.
const FAR: f64 = 5.5;

/// What may be wrong.
pub(crate) fn remarks(conclusion: &Conclusion, queries: &[At], left_out: &[[LeftOut; 3]]) -> Vec<String> {
    let Conclusion { campaign, solution, .. } = conclusion;
    let mut all = campaign.remarks.clone();
    all.extend(of_span(campaign, solution, queries));
    let limited = queries.iter().filter(|query| query.correction.as_ref().is_some_and(|one| one.limited)).count();
    if limited > 0 {
        all.push(format!(
            "{limited} of {} corrections are at the limit of an axis: an error remains there",
            queries.len()
        ));
    }
    all.extend(far_readings(campaign, left_out));
    all.extend(groups(campaign, solution).iter().map(|group| {
        format!(
            "neighbouring places are far from what all others predict: {}; displaced points or bad readings, or an error that is not smooth",
            group.named(campaign)
        )
    }));
    all.extend(drift(campaign, solution));
    all
}

/// What the result contains, and how it was computed.
pub(crate) fn notes(conclusion: &Conclusion, queries: &[At]) -> Vec<String> {
    let Conclusion { separator, campaign, solution, .. } = conclusion;
    let mut all = vec![of_field(campaign, solution)];
    all.extend(campaign.notes.iter().cloned());
    all.extend(of_noise(campaign));
    if campaign.place_of.len() == campaign.places_mm.len() {
        all.push(
            "each place was read once: a drift in time is confounded with the errors of the axis that moves slowest"
                .into(),
        );
    }
    all.extend(of_numbers(campaign, solution));
    let extrapolated = queries.iter().filter(|query| query.extrapolated).count();
    if extrapolated > 0 {
        all.push(format!("{extrapolated} of {} predictions are extrapolations, which the table flags", queries.len()));
    }
    if separator.config.kriging.fixed().is_some() {
        all.push("the covariance is given, not estimated: standard uncertainties are right if it is".into());
    }
    if !campaign.timed {
        all.push("no column `time_s`: rows count as evenly spaced in time".into());
    }
    all
}

/// Places that the others do not predict by far.
fn far_readings(campaign: &Campaign, left_out: &[[LeftOut; 3]]) -> Option<String> {
    let size = |one: &[LeftOut; 3]| {
        one.iter().map(|one| (one.residual_um / one.std_um).abs()).filter(|size| size.is_finite()).fold(0.0, f64::max)
    };
    let far: Vec<usize> = (0..left_out.len()).filter(|place| size(&left_out[*place]) > FAR).collect();
    let worst = far.iter().copied().max_by(|a, b| size(&left_out[*a]).total_cmp(&size(&left_out[*b])))?;
    let rows = campaign.place_of.iter().zip(1..).filter(|(place, _)| **place == worst);
    let rows: Vec<String> = rows.map(|(_, row): (_, usize)| row.to_string()).collect();
    let [x, y, z] = campaign.places_mm[worst];
    Some(format!(
        "{} places are more than {FAR} standard deviations from what the others predict, the worst by {:.0} at ({x}, {y}, {z}) mm, row \
         {}: a bad reading, or an error that is not smooth",
        far.len(),
        size(&left_out[worst]),
        rows.join(" or ")
    ))
}

fn of_span(campaign: &Campaign, solution: &Solution, queries: &[At]) -> Vec<String> {
    let mut all = Vec::new();
    let what = match campaign.span.dimensions() {
        0 => Some("at one point"),
        1 => Some("on one line"),
        2 => Some("in one plane"),
        _ => None,
    };
    if let Some(what) = what {
        let lost = queries.iter().filter(|query| query.correction.is_none()).count();
        all.push(format!(
            "all places are {what}: nothing is predicted off it, and ranges across it are not observable ({lost} predictions are lost)"
        ));
    }
    if !solution.lost.is_empty() {
        let names: Vec<String> = solution.lost.iter().map(|term| name(*term)).collect();
        all.push(format!("the readings do not determine {}", names.join(", ")));
    }
    all
}

fn name(term: Term) -> String {
    let letters = ["x", "y", "z"];
    match term {
        Term::Shift(axis) => format!("the displacement of the placement along {}", letters[axis]),
        Term::Turn(axis) => format!("the rotation of the placement about {}", letters[axis]),
        _ => "an effect".into(),
    }
}

pub(crate) fn of_field(campaign: &Campaign, solution: &Solution) -> String {
    let each = |of: &dyn Fn(&Covariance) -> String| {
        let fields = solution.measured.iter().zip(&solution.covariances);
        fields
            .map(|(axis, covariance)| format!("{} {}", COMPONENTS[*axis], of(covariance)))
            .collect::<Vec<_>>()
            .join(", ")
    };
    let what =
        if Solution::nugget_counts(campaign) { "from place to place beyond noise" } else { "nugget, noise included" };
    format!(
        "smooth field beside the trend: standard deviation {} µm; {what}: {} µm",
        each(&|covariance| format!("{:.2} ({})", covariance.sill_um, covariance.family.name())),
        each(&|covariance| format!("{:.2}", covariance.nugget_um))
    )
}

fn of_noise(campaign: &Campaign) -> Option<String> {
    match &campaign.noise {
        Noise::Repeats { std_um, dof } => {
            let each = campaign.measured.iter().map(|axis| format!("{} {:.2}", COMPONENTS[*axis], std_um[*axis]));
            Some(format!(
                "noise of one reading from repeats, after a common smooth drift: {} µm ({dof} degrees of freedom each)",
                each.collect::<Vec<_>>().join(", ")
            ))
        }
        Noise::Unknown => Some(
            "the noise is not known, without repeats, `std_um` or a column `std_um`: noise and what varies from place to place are one, \
             the nugget, which predictions do not include"
                .into(),
        ),
        Noise::Column(_) | Noise::Stated(_) => None,
    }
}

fn of_numbers(campaign: &Campaign, solution: &Solution) -> Vec<String> {
    let mut all = Vec::new();
    let count = campaign.places_mm.len();
    if let (Some(some), Some(_)) = (estimated_from(campaign), &solution.estimate) {
        all.push(format!(
            "the covariance is estimated from {} of {count} places: half at random, half in dense clusters",
            some.len()
        ));
    }
    if let Some(fitted) = &solution.fitted {
        all.push(format!(
            "{count} places: predictions use the {} nearest ones, and the trend {} places",
            NEAREST[0],
            fitted.len()
        ));
        all.extend(against_full(campaign, solution));
    }
    all
}

/// Predictions from neighbours beside the full solution, both of the same places.
fn against_full(campaign: &Campaign, solution: &Solution) -> Option<String> {
    let mut order: Vec<usize> = (0..campaign.places_mm.len()).collect();
    order.shuffle(&mut ChaCha8Rng::seed_from_u64(2));
    let [known, asked] = COMPARED;
    let some = order.get(..known.min(order.len() / 2))?;
    let queries: Vec<[f64; 3]> =
        order[some.len()..].iter().take(asked).map(|place| campaign.places_mm[*place]).collect();
    let data = campaign.data(&solution.terms, Some(some));
    let joint = Joint::new(&data, &solution.covariances)?;
    let near = Neighbours::new(&data, &solution.covariances);
    let predictor = Predictor::new(&joint, &data.places, true);
    let (mut squares, mut worst, mut ratio) = (0.0, 0.0_f64, 1.0_f64);
    for (field, axis) in solution.measured.iter().enumerate() {
        let design = solution.design(campaign, &queries, *axis);
        let nugget_counts = Solution::nugget_counts(campaign);
        let query = Query { places: &queries, design: design.as_ref(), nugget_counts };
        for (full, part) in predictor.predict(field, &query).iter().zip(near.predict(&data, &joint, field, &query)) {
            let difference = (full.mean_um - part.mean_um).abs();
            squares += difference * difference;
            worst = worst.max(difference);
            ratio = ratio.max((part.variance_um2 / full.variance_um2).sqrt());
        }
    }
    let rms = (squares / (solution.measured.len() * queries.len()) as f64).sqrt();
    Some(format!(
        "beside the full solution of {} of these places, predictions from neighbours differ by {} µm rms and {} µm at \
         most, and their standard uncertainty is up to {:.2} % larger",
        some.len(),
        significant(rms, 2),
        significant(worst, 2),
        100.0 * (ratio - 1.0)
    ))
}
