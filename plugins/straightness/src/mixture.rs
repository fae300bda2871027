//! Results of equivalent fits in one, and how it differs from another result.

use runout_core::{closed_loop::diagnosis::Moved, standards::straightness::strt_lsli_um};

use crate::{moves::rms, straightness::Straightness};

/// The weighted mean of results, at the positions that all of them have. Its variance is the mean one and what `spread` makes
/// of the weights of the results and their distances from it.
pub(crate) fn mean(results: &[(f64, Straightness)], spread: fn(&[(f64, f64)]) -> f64) -> Option<Straightness> {
    let mut mean = results.first()?.1.clone();
    if results.len() == 1 {
        return Some(mean);
    }
    let at = |one: &Straightness, z: &f64| one.z_mm.binary_search_by(|own| own.total_cmp(z)).ok();
    mean.z_mm.retain(|z| results.iter().all(|(_, one)| at(one, z).is_some()));
    let z_mm = mean.z_mm.clone();
    let mixed = |of: fn(&Straightness) -> [&Vec<f64>; 2]| -> [Vec<f64>; 2] {
        let both = z_mm.iter().map(|z| {
            let each = results.iter().filter_map(|(weight, one)| {
                let [value, std] = of(one).map(|values| at(one, z).and_then(|index| values.get(index)).copied());
                Some((*weight, value?, std?))
            });
            let centre: f64 = each.clone().map(|(weight, value, _)| weight * value).sum();
            let noise: f64 = each.clone().map(|(weight, _, std)| weight * std * std).sum();
            let distances: Vec<(f64, f64)> = each.map(|(weight, value, _)| (weight, value - centre)).collect();
            (centre, (noise + spread(&distances)).sqrt())
        });
        let (values, std): (Vec<f64>, Vec<f64>) = both.unzip();
        [values, std]
    };
    let kept: Vec<usize> = z_mm.iter().filter_map(|z| at(&results[0].1, z)).collect();
    mean.errors = mean.errors.each_ref().map(|errors| errors.at(&kept));
    [mean.part_um, mean.part_std_um] = mixed(|one| [&one.part_um, &one.part_std_um]);
    [mean.slide_um, mean.slide_std_um] = mixed(|one| [&one.slide_um, &one.slide_std_um]);
    // What the results differ by from their mean changes the whole profile.
    let both = [
        (&mean.part_um, (|one| &one.part_um) as fn(&Straightness) -> &Vec<f64>),
        (&mean.slide_um, |one: &Straightness| &one.slide_um),
    ];
    for (errors, (centre, of)) in mean.errors.iter_mut().zip(both) {
        let changes = results.iter().map(|(weight, one)| {
            let value = |z: &f64| at(one, z).and_then(|index| of(one).get(index)).copied();
            let change = z_mm.iter().zip(centre).map(|(z, centre)| value(z).map_or(0.0, |value| value - centre));
            (*weight, change.collect::<Vec<f64>>())
        });
        let changes: Vec<(f64, Vec<f64>)> = changes.collect();
        let distances: Vec<(f64, f64)> = changes.iter().map(|(weight, change)| (*weight, rms(change))).collect();
        let all: f64 = distances.iter().map(|(_, distance)| distance * distance).sum();
        let share = if all > 0.0 { (spread(&distances) / all).sqrt() } else { 0.0 };
        errors.common_um.extend(changes.iter().map(|(_, change)| change.iter().map(|value| share * value).collect()));
    }
    Some(mean)
}

/// Weighted mean square of distances from a mean.
pub(crate) fn mean_square(distances: &[(f64, f64)]) -> f64 {
    distances.iter().map(|(weight, distance)| weight * distance * distance).sum()
}

/// Square of the farthest distance from a mean.
pub(crate) fn farthest_square(distances: &[(f64, f64)]) -> f64 {
    distances.iter().map(|(_, distance)| distance * distance).fold(0.0, f64::max)
}

/// STRt and rms of part and slide, before and after.
pub(crate) fn moved(before: &Straightness, after: &Straightness) -> Vec<Moved> {
    let of = |result: &Straightness| {
        [&result.part_um, &result.slide_um].map(|values| [strt_lsli_um(&result.z_mm, values), rms(values)])
    };
    let std = [0, 1].map(|which| after.std_of_values(which));
    let (before, after) = (of(before), of(after));
    let both = ["part", "slide"].into_iter().zip(before.into_iter().zip(after).zip(std));
    both.flat_map(|(section, ((before, after), std))| {
        let one = |value: &str, [before, after]: [f64; 2], std: f64| Moved {
            value: value.into(),
            section: Some(section.into()),
            before,
            after,
            std: std.is_finite().then_some(std),
            unit: "um".into(),
            reference: Some("LSLI".into()),
            filter: Some("none".into()),
            lost_orders: Vec::new(),
        };
        let values = ["STRt", "straightness rms"].into_iter().enumerate();
        values.map(|(which, value)| one(value, [before[which], after[which]], std[which])).collect::<Vec<_>>()
    })
    .collect()
}
