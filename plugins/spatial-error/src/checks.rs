//! Tests of the readings on themselves: regions left out of the fit, passes and halves of the campaign, repeats of single places, and what
//! varies from place to place.

use nalgebra::Cholesky;
use runout_core::{
    consistency::{
        Check, Kind, LinearFit, Structure, Test,
        groups::{Group, Level, alike},
        judge,
        left_out::{LeftOut, left_out},
        rows,
    },
    numerics::least_squares::Basis,
};

use crate::{
    campaign::{COMPONENTS, Campaign},
    config::Kriging,
    noise::{Noise, Repeats},
    projections::Projections,
    residual::residual_um,
    rough::Rough,
    solve::{Solution, families},
};

/// Halvings of the places: 8 regions.
const HALVINGS: usize = 3;
/// Places of a region at least.
const FEWEST_PLACES: usize = 3;
/// Places of a fit up to which regions are left out.
const MOST_PLACES: usize = 1500;
/// Places that passes are compared at.
const COMPARED: usize = 200;
/// Readings of a place from which its scatter is compared with that of other places.
const FEWEST_READINGS: usize = 6;

/// All tests of a fit.
#[must_use]
pub(crate) fn checks(campaign: &Campaign, solution: &Solution, kriging: &Kriging) -> Vec<Check> {
    let mut all = campaign.checks.clone();
    all.extend(Rough::of(campaign, solution, &families(kriging)).iter().map(Rough::check));
    all.extend(of_stated_noise(campaign));
    all.extend(left_out(&regions_left_out(campaign, solution)));
    let residual = residual_um(campaign, solution);
    all.extend(campaign.measured.iter().flat_map(|axis| of_repeated(campaign, &residual, *axis)));
    all
}

/// Factor on the standard uncertainty of each component's predictions.
#[must_use]
pub(crate) fn factors(checks: &[Check]) -> [f64; 3] {
    COMPONENTS.map(|component| {
        let own = checks.iter().filter(|check| check.test == Test::LeftOut && check.of == component);
        own.map(|check| check.factor).fold(1.0, f64::max)
    })
}

/// Repeats against the stated noise.
fn of_stated_noise(campaign: &Campaign) -> Vec<Check> {
    if !matches!(campaign.noise, Noise::Column(_) | Noise::Stated(_)) {
        return Vec::new();
    }
    let (places, readings) = (&campaign.place_of, &campaign.readings_um);
    let repeats = Repeats::of(places, campaign.places_mm.len(), readings, &campaign.measured, &campaign.time);
    let known = repeats.map(|repeats| repeats.noise(&campaign.measured));
    let Some(Noise::Repeats { std_um, dof }) = known else { return Vec::new() };
    let group = |axis: &usize| {
        let squares = dof as f64 * (std_um[*axis] / campaign.noise_um(*axis)).powi(2);
        Group { name: format!("{}, scatter of repeats", COMPONENTS[*axis]), squares, freedom: dof as f64 }
    };
    let groups: Vec<Group> = campaign.measured.iter().map(group).collect();
    alike("components", &groups, Level::Known { variance: 1.0, dof: f64::INFINITY }, "`std_um` is too large")
}

/// Errors of regions that all other places predict, of each component.
fn regions_left_out(campaign: &Campaign, solution: &Solution) -> Vec<LeftOut> {
    let places = |index: usize| solution.fitted.as_ref().map_or(index, |fitted| fitted[index]);
    let projections = Projections::of(&solution.joint);
    let count = projections.places();
    if !((FEWEST_PLACES << HALVINGS)..=MOST_PLACES).contains(&count) {
        return Vec::new();
    }
    let nothing = |axis: &usize| LeftOut { name: COMPONENTS[*axis].into(), chi2: 0.0, count: 0 };
    let mut all: Vec<LeftOut> = solution.measured.iter().map(nothing).collect();
    for region in halved((0..count).collect(), HALVINGS, &|index| campaign.places_mm[places(index)]) {
        // What alone determines a parameter of the trend is not predicted by the others.
        let Some(block) = Cholesky::new(projections.block(&region)) else { continue };
        let (residual, covariance) = (block.solve(&projections.pull(&region)), block.inverse());
        let size = region.len();
        for (field, sum) in all.iter_mut().enumerate() {
            let first = field * size;
            let own = covariance.view((first, first), (size, size)).into_owned();
            let Some(of_region) = LeftOut::of("", &residual.as_slice()[first..first + size], own) else { continue };
            sum.chi2 += of_region.chi2;
            sum.count += of_region.count;
        }
    }
    all.retain(|one| one.count > 0);
    all
}

/// Places halved again and again across their longest extent.
fn halved(mut some: Vec<usize>, times: usize, place: &dyn Fn(usize) -> [f64; 3]) -> Vec<Vec<usize>> {
    if times == 0 {
        return vec![some];
    }
    let extent = |axis: usize| {
        let each = || some.iter().map(|index| place(*index)[axis]);
        each().fold(f64::NEG_INFINITY, f64::max) - each().fold(f64::INFINITY, f64::min)
    };
    let longest = (0..3).max_by(|one, other| extent(*one).total_cmp(&extent(*other))).unwrap_or(0);
    some.sort_by(|one, other| place(*one)[longest].total_cmp(&place(*other)[longest]));
    let other = some.split_off(some.len() / 2);
    [some, other].into_iter().flat_map(|half| halved(half, times - 1, place)).collect()
}

/// Passes and halves of the campaign against each other, and the scatter of places that were read often: by repeated readings.
fn of_repeated(campaign: &Campaign, residual: &[[f64; 3]], axis: usize) -> Vec<Check> {
    let mut members = vec![Vec::new(); campaign.places_mm.len()];
    campaign.place_of.iter().enumerate().for_each(|(row, place)| members[*place].push(row));
    members.retain(|rows| rows.len() > 1);
    let single = single(&members, residual, axis);
    // Errors that depend on each other are compared with their covariance: of fewer places.
    let correlated = campaign.correlated[axis].is_some();
    let compared = if correlated { COMPARED / 2 } else { COMPARED };
    let members: Vec<&Vec<usize>> = members.iter().step_by(members.len().div_ceil(compared).max(1)).collect();
    let rows: Vec<usize> = members.iter().flat_map(|rows| rows.iter().copied()).collect();
    // What a place reads in the mean is fitted.
    let (mut means, mut left) = (Vec::new(), Vec::with_capacity(rows.len()));
    for rows_of_place in &members {
        let size = rows_of_place.len() as f64;
        let mut column = vec![0.0; rows.len()];
        column[left.len()..left.len() + rows_of_place.len()].fill(size.sqrt().recip());
        means.push(column);
        let mean = rows_of_place.iter().map(|row| residual[*row][axis]).sum::<f64>() / size;
        left.extend(rows_of_place.iter().map(|row| residual[*row][axis] - mean));
    }
    let structure = structure(campaign, &members, &rows);
    let basis = Basis::of(means);
    let fit = LinearFit { residual: &left, basis: basis.columns(), names: &[], weights: &[], noise: None, unit: "µm" };
    let structure = if correlated {
        structure.along("time", vec![0; rows.len()], rows.iter().map(|row| campaign.time[*row]).collect())
    } else {
        structure
    };
    // Deviations from a mean have no single reading.
    let of_means =
        judge(fit, &structure).checks.into_iter().filter(|check| !matches!(check.test, Test::Rows | Test::Order));
    let single = single.filter(|_| !correlated);
    of_means.chain(single).map(|check| check.among(campaign.measured.len()).within(COMPONENTS[axis])).collect()
}

/// Readings that are unlike the others of their place; of two, either may be the bad one.
fn single(members: &[Vec<usize>], residual: &[[f64; 3]], axis: usize) -> Option<Check> {
    let readings: Vec<Vec<f64>> =
        members.iter().map(|rows| rows.iter().map(|row| residual[*row][axis]).collect()).collect();
    let names = members.iter().flat_map(|rows| match rows[..] {
        [one, other] => vec![format!("row {} or row {}", one + 1, other + 1); 2],
        _ => rows.iter().map(|row| format!("row {}", row + 1)).collect(),
    });
    Some(rows::unlike_repeats(&readings)?.check(&Structure::default().naming(names.collect()), "µm"))
}

fn structure(campaign: &Campaign, members: &[&Vec<usize>], rows: &[usize]) -> Structure {
    let last = rows.iter().map(|row| campaign.repeat[*row]).max().unwrap_or(0);
    let passes: Vec<usize> = rows.iter().map(|row| campaign.repeat[*row]).collect();
    let halves: Vec<usize> = rows.iter().map(|row| usize::from(campaign.time[*row] > 0.5)).collect();
    let first = passes.iter().copied().min().unwrap_or(0);
    let same = passes.iter().zip(&halves).all(|(pass, half)| pass - first == *half);
    let names: Vec<String> = (0..=last).map(|pass| format!("pass {pass}")).collect();
    let mut structure = Structure::default().shifting("passes", &passes, &names);
    if !same {
        let names = ["the first half of the campaign", "the second half"].map(str::to_owned);
        structure = structure.shifting("halves of the campaign", &halves, &names);
    }
    if members.iter().filter(|rows| rows.len() >= FEWEST_READINGS).count() > 1 {
        // Places with few readings are in none of the groups.
        let group = |(index, rows): (usize, &&Vec<usize>)| {
            let level = if rows.len() >= FEWEST_READINGS { index } else { usize::MAX };
            vec![level; rows.len()]
        };
        let level = members.iter().enumerate().flat_map(group).collect();
        let name = |rows: &&Vec<usize>| {
            let [x, y, z] = campaign.places_mm[campaign.place_of[rows[0]]];
            format!("the place ({x}, {y}, {z}) mm")
        };
        structure = structure.divided("places", Kind::Alike, level, members.iter().map(name).collect());
    }
    structure
}
