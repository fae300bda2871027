//! A height map as measured.

use runout_core::{
    Error, Result,
    height_grid::{GridPlaces, HeightGrid},
    points::Points,
    stage::{Evaluable, Outcome, PlaneMap},
    table::{ColumnSpec, Figure, TableRows, TableSpec, numbers},
};

use crate::{
    config::AsMeasuredConfig,
    stages::{rows, sentence, staged},
};

/// Why a map has no ±.
const NO_NOISE: &str = "a map that was measured once does not show its noise";

/// The table of the surface.
pub(crate) fn table() -> TableSpec {
    let place = |name: &str, about: &str| ColumnSpec::number(name, "mm", about).repeating();
    let columns = vec![
        place("x_mm", "place along the rows"),
        place("y_mm", "place from row to row"),
        ColumnSpec::number(
            "height_nm",
            "nm",
            "height behind all stages, out of the material positive; voids are left out",
        ),
    ];
    TableSpec::new("surface", "the surface that values are computed from, point by point", columns).figure(Figure::map(
        "surface",
        "Surface behind the stages",
        ["x_mm", "y_mm", "height_nm"],
    ))
}

/// The outcome of a map.
pub(crate) fn outcome(points: &Points, config: &AsMeasuredConfig) -> Result<Outcome> {
    let object = points.input.display().to_string();
    let [x_mm, y_mm, height_nm] = ["x_mm", "y_mm", "height_nm"].map(|name| points.column(name));
    let places = GridPlaces::of(x_mm?, y_mm?).map_err(|problem| {
        let error = Error::new("read the grid of", &object, problem);
        error.help("a single row is a profile: `object = \"profile\"` in [separate]")
    })?;
    let staged = staged(places.heights(height_nm?.iter().copied(), None), config, &object)?;
    let mut remarks = Vec::new();
    let (holes, all) = (staged.grid.holes(), staged.grid.height_nm.len());
    if holes > 0 {
        remarks.push(format!(
            "{holes} of {all} points have no height: they are left out of every value (`voids = \"fill\"` fills them)"
        ));
    }
    if staged.filled > 0 && staged.by_filling.is_none() {
        remarks.push("the filled voids are too many to say how uncertain values are by them".into());
    }
    if let Some(std_nm) = staged.sq_by_filling_nm {
        remarks.push(format!("the filled points alone make Sq uncertain by {std_nm:.3} nm (table `filling`)"));
    }
    let mut tables = vec![surface(&staged.grid)?, rows(&staged.stages)?];
    tables.extend(staged.by_filling);
    let mut map = PlaneMap::new("surface", staged.grid);
    (map.reference, map.filled, map.no_uncertainty) =
        (Some(staged.reference), staged.filled, Some(NO_NOISE.to_owned()));
    Ok(Outcome {
        convention: "heights in nm, out of the material positive; x along the rows, y from row to row".into(),
        tables,
        values: staged.values,
        evaluables: vec![Evaluable::HeightMap(map)],
        remarks,
        notes: vec![sentence(&staged.stages)],
        ..Outcome::default()
    })
}

fn surface(grid: &HeightGrid) -> Result<TableRows> {
    let known = || grid.height_nm.iter().enumerate().filter(|(_, height)| height.is_finite());
    let spec = table();
    let rows = spec.rows(vec![
        numbers(known().map(|(index, _)| grid.origin_x_mm + grid.step_x_mm * (index % grid.columns) as f64)),
        numbers(known().map(|(index, _)| grid.origin_y_mm + grid.step_y_mm * (index / grid.columns) as f64)),
        numbers(known().map(|(_, height)| *height)),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
