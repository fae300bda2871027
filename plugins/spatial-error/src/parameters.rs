//! Parameters of effects: those that are known are taken out of the readings, those that were fitted are stated.

use runout_core::{
    Error, Result,
    closed_loop::{Effect, Settings, diagnosis::Estimated},
};

use crate::{
    campaign::Campaign,
    config::SpatialError,
    effects::{Candidate, missing},
    shapes::Shape,
    solve::{Solution, solve},
    terms::Term,
};

/// Fits in which periods settle, and the share of its standard uncertainty to which a period does.
const MOST_FITS: usize = 3;
const SETTLED: f64 = 0.2;

/// Takes effects that are declared with their values out of the readings.
pub(crate) fn subtract_known(campaign: &mut Campaign, settings: &Settings) -> Result<()> {
    let kinds = missing();
    for setting in &settings.known {
        let kind = kinds[setting.effect];
        let refuse = |problem: String| Error::new("take out the known effect", kind.effect().name(), problem);
        let (shape, values) = match (kind.has_shape(), setting.values.split_first()) {
            (true, Some((shape, rest))) => (kind.shape(*shape).map_err(refuse)?, rest.to_vec()),
            _ => (Shape::None, setting.values.clone()),
        };
        let values = match (shape, &values[..]) {
            (Shape::Period { .. }, [amplitude_um, phase_deg]) => {
                let (sine, cosine) = phase_deg.to_radians().sin_cos();
                vec![amplitude_um * cosine, amplitude_um * sine]
            }
            _ => values,
        };
        for (term, value) in kind.terms(shape).into_iter().zip(values) {
            for row in 0..campaign.place_of.len() {
                let place = campaign.places_mm[campaign.place_of[row]];
                let adds = term.at(&campaign.volume, place, campaign.time[row]);
                campaign.readings_um[row].iter_mut().zip(adds).for_each(|(reading, adds)| *reading -= value * adds);
            }
        }
    }
    Ok(())
}

/// A period that is fitted together with its amplitude has a column of its own.
fn slope(candidate: &Candidate, solution: &Solution) -> Option<Term> {
    let Shape::Period { declared: false, .. } = candidate.shape else { return None };
    let [sine, cosine] = candidate.terms[..] else { return None };
    let Term::Pitch { axis, period_mm, .. } = sine else { return None };
    let [sine_um, cosine_um] = [sine, cosine].map(|term| solution.column(term).map(|at| solution.joint.trend[at]));
    Some(Term::PitchSlope { axis, period_mm, sine_um: sine_um?, cosine_um: cosine_um? })
}

/// The fit with effects, of which periods are moved to where the fit has them.
pub(crate) fn settled(campaign: &Campaign, separator: &SpatialError, added: &mut [Candidate]) -> Result<Solution> {
    let kinds = missing();
    let all = |added: &[Candidate]| added.iter().flat_map(|one| one.terms.clone()).collect::<Vec<Term>>();
    let mut solution = solve(campaign, &separator.config, &all(added))?;
    for fits in 1..=MOST_FITS {
        let slopes: Vec<Option<Term>> = added.iter().map(|one| slope(one, &solution)).collect();
        if slopes.iter().all(Option::is_none) {
            break;
        }
        let terms: Vec<Term> = all(added).into_iter().chain(slopes.iter().copied().flatten()).collect();
        solution = solve(campaign, &separator.config, &terms)?;
        let mut settled = true;
        for (candidate, slope) in added.iter_mut().zip(slopes) {
            let Some(column) = slope.and_then(|slope| solution.column(slope)) else { continue };
            let change = solution.joint.trend[column];
            let std = solution.joint.trend_covariance[(column, column)].sqrt();
            if let (true, Shape::Period { mm, declared }) = (change.abs() > SETTLED * std, candidate.shape)
                && fits < MOST_FITS
            {
                settled = false;
                candidate.shape = Shape::Period { mm: mm * (1.0 + change), declared };
                candidate.terms = kinds[candidate.effect].terms(candidate.shape);
            }
        }
        if settled {
            break;
        }
        solution = solve(campaign, &separator.config, &all(added))?;
    }
    Ok(solution)
}

/// Parameters of an effect that was added, with their standard uncertainties where it is alone.
pub(crate) fn parameters(
    candidate: &Candidate,
    effect: &Effect,
    solution: &Solution,
    trend_std: Option<&Vec<f64>>,
) -> Vec<Estimated> {
    let mut all = Vec::new();
    let mut add = |index: usize, value: f64, std: Option<f64>| {
        let parameter = &effect.parameters[index];
        all.push(Estimated { name: parameter.name.clone(), value, std, unit: parameter.unit.clone() });
    };
    let fitted =
        |term: Term| solution.column(term).map(|at| (at, solution.joint.trend[at], trend_std.map(|std| std[at])));
    if let Shape::Period { mm, .. } = candidate.shape {
        let period_std = solution.terms.iter().position(|term| term.is_slope_of(candidate.terms[0])).zip(trend_std);
        add(0, mm, period_std.map(|(at, std)| mm * std[at]));
        if let [Some((one, sine, sine_std)), Some((other, cosine, cosine_std))] =
            [fitted(candidate.terms[0]), fitted(candidate.terms[1])]
        {
            let covariance = &solution.joint.trend_covariance;
            let correlation = covariance[(one, other)] / (covariance[(one, one)] * covariance[(other, other)]).sqrt();
            let amplitude = sine.hypot(cosine);
            // Of a sine·u + b cosine·v.
            let std = |u: f64, v: f64| {
                let [u, v] = [u * sine_std?, v * cosine_std?];
                Some((u * u + v * v + 2.0 * correlation * u * v).max(0.0).sqrt() / amplitude)
            };
            add(1, amplitude, std(sine, cosine));
            let of_phase = std(-cosine, sine).map(|std| (std / amplitude).to_degrees());
            add(2, cosine.atan2(sine).to_degrees(), of_phase);
        }
        return all;
    }
    let first = usize::from(candidate.shape.value().is_some());
    if let Some(shape) = candidate.shape.value() {
        add(0, shape, None);
    }
    // Axes that were not measured have no column.
    for (index, term) in missing()[candidate.effect].terms(candidate.shape).into_iter().enumerate() {
        if let Some((_, value, std)) = fitted(term) {
            add(first + index, value, std);
        }
    }
    all
}
