//! Areal values of the part's surface.

use std::collections::BTreeSet;

use super::{Evaluate, Filter, Held, Label, PartSummary, labelled};
use crate::{
    Result,
    evaluate::{
        areal,
        uncertainty::{monte_carlo_of, seed},
    },
    numerics::{filter::areal_gaussian, fourier::max_order, height_map::HeightMap},
    surface::{Section, Surface, Uncertain},
};

/// Points that all draws look at together, about: a large surface has fewer draws, a small one more.
const POINTS_DRAWN: usize = 4_000_000;
const DRAWS: std::ops::RangeInclusive<usize> = 40..=200;

const NARROW: &str = "95 % intervals of areal extremes and of values of the material ratio curve are narrower than they say: in \
    simulation they held the truth in 74 to 95 %; a limit on these proves as little. Hills and dales have no uncertainty";

/// Adds ISO 25178-2's values of the unrolled surface, without its least-squares cylinder and filtered by λs and λc; where it
/// comes from sections with lost orders, these are in no value. Angles at which something is not known of a section are left
/// out along the whole part. Uncertainties are by Monte Carlo from the sections' variances, those of orders from `lowest`.
///
/// # Errors
/// When the rings are not at equal distances.
pub fn add_areal(
    part: &mut PartSummary,
    surface: &Surface,
    uncertain: &Uncertain,
    lowest: usize,
    evaluate: &Evaluate,
) -> Result<()> {
    let sections = uncertain.sections();
    let blank = blanks(sections, surface.angles);
    let found = of_surface(surface, &blank, evaluate)?;
    let draws = (POINTS_DRAWN / surface.deviation_um.len().max(1)).clamp(*DRAWS.start(), *DRAWS.end());
    let mut next = uncertain.draws(lowest, seed(&["areal"]));
    let mut drawn = surface.clone();
    let draws_made = next.is_some();
    let values = monte_carlo_of(if draws_made { draws } else { 0 }, |disturbed, values| {
        if let (true, Some(next)) = (disturbed, &mut next) {
            next(&mut drawn);
            // What the measured surface has, a drawn one has; if not, there is no uncertainty.
            let areal = of_surface(&drawn, &blank, evaluate).map(|areal| comparable(&areal, &found));
            values.extend(areal.unwrap_or_else(|_| vec![f64::NAN; areal::PARAMETERS.len()]));
        } else {
            values.extend(found.parameters().iter().map(|parameter| parameter.value));
        }
    });
    let label = |(symbol, unit, clause): &(&'static str, &'static str, &str)| {
        Label::new(symbol, unit, format!("ISO 25178-2:2021, {clause}"), "LSCY removed, mean")
    };
    let lost: BTreeSet<usize> = sections.iter().flat_map(Section::lost_orders).collect();
    let highest = max_order(surface.angles);
    let orders = sections.iter().map(|section| section.orders.len().saturating_sub(1));
    let held = Held {
        highest,
        all_to: orders.fold(highest, usize::min),
        lost: lost.into_iter().collect(),
        half_power_upr: sections.iter().filter_map(|section| section.half_power_upr).reduce(f64::min),
    };
    let used = sections.iter().map(|section| section.used).sum::<f64>() / sections.len().max(1) as f64;
    part.values.extend(labelled(
        areal::PARAMETERS.iter().map(label).collect(),
        values,
        &Filter::between(evaluate.lambda_s_mm, evaluate.lambda_c_mm, surface.radius_mm),
        &held,
        (found.points as f64 / (found.points + found.missing) as f64).min(used),
    ));
    if draws_made {
        part.remarks.push(NARROW.into());
    }
    Ok(())
}

/// Of equal angles, whether something is not known of a section there.
fn blanks(sections: &[Section], angles: usize) -> Vec<bool> {
    let mut blank = vec![false; angles];
    for section in sections.iter().filter(|section| !section.gaps.is_empty()) {
        blank.iter_mut().zip(section.gaps.of_equal(angles)).for_each(|(blank, gap)| *blank |= gap);
    }
    blank
}

fn of_surface(surface: &Surface, blank: &[bool], evaluate: &Evaluate) -> Result<areal::Areal> {
    let whole = HeightMap::unrolled(surface)?;
    let mut there = whole.heights_um().to_vec();
    for ring in there.chunks_mut(surface.angles) {
        ring.iter_mut().zip(blank).filter(|(_, blank)| **blank).for_each(|(height, _)| *height = f64::NAN);
    }
    let mut map = areal::without_cylinder(&whole.with(there))?;
    if let Some(shortest) = evaluate.lambda_s_mm {
        map = map.with(areal_gaussian(&map, shortest));
    }
    if let Some(longest) = evaluate.lambda_c_mm {
        let mut rest = map.heights_um().to_vec();
        rest.iter_mut().zip(areal_gaussian(&map, longest)).for_each(|(height, waviness)| *height -= waviness);
        map = map.with(rest);
    }
    Ok(areal::areal(&map, &areal::Settings::default()))
}

/// Values of a drawn surface: the direction Std, which comes round again after 180°, as near to the one found as it can be.
/// Hills and dales have none: errors make and merge them, and what was drawn about the surface found would say less than what
/// they have done to it already.
fn comparable(drawn: &areal::Areal, found: &areal::Areal) -> Vec<f64> {
    let direction = found.spatial.std_deg;
    let turned = (drawn.spatial.std_deg - direction + 90.0).rem_euclid(180.0) - 90.0;
    let spatial = areal::Spatial { std_deg: direction + turned, ..drawn.spatial };
    let parameters = areal::Areal { spatial, ..*drawn }.parameters();
    let known = |parameter: &areal::Parameter| if is_feature(parameter) { f64::NAN } else { parameter.value };
    parameters.iter().map(known).collect()
}

/// Whether it is one of ISO 25178-2's clause 5, of hills and dales.
fn is_feature(parameter: &areal::Parameter) -> bool {
    parameter.clause.starts_with("5.")
}
