//! Errors of the sensor nest, which act as scale and squareness of the linear axes do.
//!
//! A nest with a gain error reads (1 + g) times a deviation; with cross-talk it adds a share of one coordinate to another. Both act on
//! the deviations, in which balls that stand beside their nominal places dominate: a part of g·R(φ)·b has the shape of a scale. So no
//! campaign of one kind decides between the two; what a nest of a plausible error explains as well is named beside the effect.

use nalgebra::Vector3;
use runout_core::{
    closed_loop::diagnosis::{BiasPerUnit, Blind, Diagnosis},
    numerics::least_squares::{SINGULAR, least_norm},
};

use crate::{
    axis::Axis,
    campaign::Campaign,
    solve::{Column, Fit, Redundant, fit},
};

/// Pairs of a coordinate that is read and one that goes into it: gains first, then cross-talk.
const PAIRS: [(usize, usize); 9] = [(0, 0), (1, 1), (2, 2), (0, 1), (1, 0), (0, 2), (2, 0), (1, 2), (2, 1)];
/// Largest error that is plausible of a nest, in percent.
const LARGEST: f64 = 20.0;
/// χ² by which two explanations differ, up to which the data do not decide.
const SAME_CHI2: f64 = 10.0;
/// What separates the nest from the axes.
const DISTINGUISHED_BY: &str =
    "a calibration of the nest against known displacements along each axis, or of the linear axes on their own";

/// An error of the nest instead of errors of linear axes.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Nest {
    /// Its place among [`columns`].
    pub index: usize,
    /// Places of the added effects that it replaces.
    pub replaced: Vec<usize>,
}

/// What 1 % of each error adds to the readings, in mm: of the deviations as the declared model has them.
///
/// # Errors
/// When the declared model cannot be fitted.
pub(crate) fn columns(axis: Axis, campaign: &Campaign) -> Result<Vec<Column>, String> {
    let found = fit(&campaign.layout, &campaign.readings, &[])?;
    let expected: Vec<[f64; 3]> = campaign
        .readings
        .iter()
        .zip(&found.residual)
        .map(|(reading, left)| axis.outward(&(reading.value - left)))
        .collect();
    let column = |(read, from): (usize, usize)| -> Column {
        let each = expected.iter().map(|deviation| {
            let mut adds = [0.0; 3];
            adds[read] = 0.01 * deviation[from];
            let adds: Vector3<f64> = axis.inward(adds);
            adds
        });
        each.collect()
    };
    Ok(PAIRS.into_iter().map(column).collect())
}

/// Errors of the nest that explain as much as effects of the linear axes (marked) that were added: instead of each, or of all.
pub(crate) fn instead(data: &Redundant, added: &[(bool, Vec<Vec<f64>>)], first: usize) -> Vec<Nest> {
    let of_axes: Vec<usize> = (0..added.len()).filter(|place| added[*place].0).collect();
    if of_axes.is_empty() {
        return Vec::new();
    }
    let chi2 = |replaced: &[usize], nest: Option<usize>| {
        let kept = (0..added.len()).filter(|place| !replaced.contains(place)).flat_map(|place| added[place].1.iter());
        let columns: Vec<Vec<f64>> =
            nest.iter().map(|index| &data.effects[first + index]).chain(kept).chain(&data.declared).cloned().collect();
        let found = least_norm(&columns, &data.rows, SINGULAR);
        let squares: f64 = found.residual.iter().map(|left| left * left).sum();
        (squares, found.dof, found.coefficients.first().copied().unwrap_or(0.0), found.lost.first().copied())
    };
    let (own, dof, ..) = chi2(&[], None);
    let unit = (own / dof.max(1) as f64).max(1.0);
    let mut groups: Vec<Vec<usize>> = of_axes.iter().map(|place| vec![*place]).collect();
    if of_axes.len() > 1 {
        groups.push(of_axes);
    }
    let mut all = Vec::new();
    for replaced in groups {
        for index in 0..PAIRS.len() {
            let (squares, _, percent, lost) = chi2(&replaced, Some(index));
            let fits = squares - own < SAME_CHI2 * unit * replaced.len() as f64;
            if lost == Some(false) && fits && percent.abs() <= LARGEST {
                all.push(Nest { index, replaced: replaced.clone() });
            }
        }
    }
    all
}

/// Names them in the confounded sets of the effects.
pub(crate) fn confound(diagnosis: &mut Diagnosis, instead: &[Nest]) {
    for Nest { index, replaced } in instead {
        for place in replaced {
            let Some(found) = diagnosis.added.get_mut(*place) else { continue };
            let name = name(*index);
            if !found.confounded_with.contains(&name) {
                found.confounded_with.push(name);
            }
            found.distinguished_by = Some(DISTINGUISHED_BY.into());
            // The value of one member is conditional on a choice that the data do not make.
            found.parameters.iter_mut().for_each(|parameter| parameter.std = None);
            found.change = None;
        }
    }
}

/// What errors of the nest do where nothing shows them: a share of the offsets of the axis.
pub(crate) fn blind(axis: Axis, found: &Fit) -> Vec<Blind> {
    let symbols = axis.location_symbols();
    let offsets = found.location();
    let largest = (0..2).filter(|index| offsets[*index].value.is_finite());
    let Some(largest) = largest.max_by(|a, b| offsets[*a].value.abs().total_cmp(&offsets[*b].value.abs())) else {
        return Vec::new();
    };
    let of = |effect: &str, targets: Vec<String>, on: usize| Blind {
        effect: effect.into(),
        targets,
        bias_per_unit: BiasPerUnit {
            value: 1e3 * 0.01 * offsets[largest].value.abs(),
            unit: "um/%".into(),
            on: symbols[on].clone(),
        },
    };
    let [x, y, _] = axis.order();
    vec![
        of("nest-gain", vec![LETTERS[x].into(), LETTERS[y].into()], largest),
        of(
            "nest-cross-talk",
            vec![format!("{}{}", LETTERS[x], LETTERS[y]), format!("{}{}", LETTERS[y], LETTERS[x])],
            1 - largest,
        ),
    ]
}

const LETTERS: [&str; 3] = ["X", "Y", "Z"];

fn name(index: usize) -> String {
    let (read, from) = PAIRS[index];
    if read == from {
        format!("nest-gain {}", LETTERS[read])
    } else {
        format!("nest-cross-talk {}{}", LETTERS[read], LETTERS[from])
    }
}
