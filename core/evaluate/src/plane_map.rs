//! Areal values of heights on a plane.

use super::{
    Evaluate, FormRemoval, Group, Label,
    areal::{filter, filtered},
};
use crate::Value;
use crate::evaluable::PlaneMap;
use runout_error::Result;
use runout_numerics::height_map::HeightMap;
use runout_standards::areal::{self, MaterialRatio};

/// Why values of a map have no uncertainty.
const POINT_BY_POINT: &str = "errors of a height map are stated point by point; their part in a value depends on how they are correlated, \
    which the map does not say";

/// Its values, and what they are not.
///
/// # Errors
/// When the map cannot be evaluated.
pub(super) fn values(plane: &PlaneMap, evaluate: &Evaluate) -> Result<(Vec<Value>, Vec<String>)> {
    if !evaluate.has(Group::Areal) {
        return Ok((Vec::new(), Vec::new()));
    }
    let (map, remark) = prepared(plane, evaluate)?;
    let filled = plane.filled as f64 / plane.grid.height_nm.len() as f64;
    let there = 1.0 - filled - map.missing() as f64 / map.heights_um().len() as f64;
    let options = &evaluate.areal;
    let before = plane.reference.as_deref().map_or(String::new(), |removed| format!("{removed}, "));
    let reference = match options.form {
        FormRemoval::Polynomial => format!("{before}polynomial of degree {} removed, mean", options.degree),
        FormRemoval::None => format!("{before}mean"),
        _ if plane.reference.is_some() => format!("{before}mean"),
        _ => "least-squares plane removed, mean".to_owned(),
    };
    let standard = |clause: &str| format!("ISO 25178-2:2021, {clause}");
    let found = areal::areal(&map, &areal::Settings::default());
    let mut labelled: Vec<(Label, f64)> = found
        .parameters()
        .iter()
        .map(|one| (Label::new(one.symbol, one.unit, standard(one.clause), reference.clone()), one.value))
        .collect();
    if !(options.heights_um.is_empty() && options.ratios_percent.is_empty()) {
        let curve = MaterialRatio::about_mean(&map);
        labelled.extend(options.heights_um.iter().map(|height_um| {
            let above = format!("{reference}, {height_um} µm above it");
            (Label::new("Smr(c)", "%", standard("4.5.1"), above), curve.smr_percent(*height_um))
        }));
        labelled.extend(options.ratios_percent.iter().map(|ratio| {
            let at = format!("{reference}, at {ratio} %");
            (Label::new("Smc(p)", "µm", standard("4.5.2"), at), curve.smc_um(*ratio))
        }));
    }
    // On a plane a filter has no orders, its name alone is of use.
    let filter = filter(evaluate, 1.0).name;
    let known = labelled.into_iter().filter(|(_, value)| value.is_finite());
    let values = known.map(|(label, value)| Value {
        filter: Some(filter.clone()),
        coverage: there,
        no_uncertainty: Some(plane.no_uncertainty.clone().unwrap_or_else(|| POINT_BY_POINT.into())),
        ..label.of(value)
    });
    Ok((values.collect(), remark.into_iter().chain(found.features.problem()).collect()))
}

/// The map without form, filtered, without the edges at which λc lacks a part of its Gaussian; and what is said of these.
fn prepared(plane: &PlaneMap, evaluate: &Evaluate) -> Result<(HeightMap<'static>, Option<String>)> {
    let map = plane.grid.height_map()?;
    let options = &evaluate.areal;
    let map = match options.form {
        FormRemoval::None => map,
        FormRemoval::Polynomial => areal::without_polynomial(&map, options.degree)?,
        _ if plane.reference.is_some() => map,
        _ => areal::without_polynomial(&map, 1)?,
    };
    let map = filtered(map, evaluate);
    let Some(longest) = evaluate.lambda_c_mm else { return Ok((map, None)) };
    without_edges(&map, longest)
}

/// The map without half a cut-off at each edge (ISO 16610-28), where it is as long as two cut-offs that way.
fn without_edges(map: &HeightMap, longest_mm: f64) -> Result<(HeightMap<'static>, Option<String>)> {
    let edge = |count: usize, step_mm: f64| {
        let long = (count - 1) as f64 * step_mm >= 2.0 * longest_mm;
        if long { (0.5 * longest_mm / step_mm * (1.0 - 1e-9)).ceil() as usize } else { 0 }
    };
    let (columns, rows) = (map.columns(), map.rows());
    let (left, lower) = (edge(columns, map.dx_mm()), edge(rows, map.dy_mm()));
    let heights: Vec<f64> = (lower..rows - lower)
        .flat_map(|row| &map.heights_um()[row * columns + left..(row + 1) * columns - left])
        .copied()
        .collect();
    let cropped = HeightMap::new(heights, columns - 2 * left, map.dx_mm(), map.dy_mm(), false)?;
    let remark = if left > 0 && lower > 0 {
        format!(
            "areal values leave out {left} columns and {lower} rows at each edge, where λc = {longest_mm} mm lacks a part of its Gaussian \
             (ISO 16610-28)"
        )
    } else {
        format!(
            "the map is shorter than two cut-offs λc = {longest_mm} mm along {}: areal values keep the edges there, where the filter lacks up \
             to half of its Gaussian (ISO 16610-28)",
            match (left > 0, lower > 0) {
                (true, false) => "y",
                (false, true) => "x",
                _ => "x and y",
            }
        )
    };
    Ok((cropped, Some(remark)))
}
