//! An open profile as measured.

use runout_core::{
    Error, ErrorKind, Result,
    consistency::{Check, Test},
    draws::OpenErrors,
    height_grid::GridPlaces,
    points::Points,
    stage::{Evaluable, OpenProfile, Outcome, far_below_noise},
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers},
};

use crate::{
    config::AsMeasuredConfig,
    stages::{rows, sentence, staged},
};

/// Why a profile has no ±.
const NO_NOISE: &str = "a profile that was measured once does not show its noise: what differs from point to point may be texture. A column `std_nm` states \
    it";
const NM_PER_UM: f64 = 1e3;
/// Variance of third differences of independent numbers, 1 + 9 + 9 + 1, and the share of them that is independent: 20² over the sum of the squares of
/// their covariances 20, −15, 6, −1 on both sides.
const OF_THIRD_DIFFERENCES: f64 = 20.0;
const INDEPENDENT: f64 = 400.0 / 924.0;

/// The table of the profile.
pub(crate) fn table() -> TableSpec {
    TableSpec::new(
        "profile",
        "the profile that values are computed from, point by point",
        vec![
            ColumnSpec::number("x_mm", "mm", "place along the profile").repeating(),
            ColumnSpec::number("height_nm", "nm", "height behind all stages, out of the material positive"),
        ],
    )
    .figure(Figure::lines("profile", "Profile behind the stages", "x_mm", ["height_nm"].map(Measure::new)))
}

/// The outcome of a profile.
pub(crate) fn outcome(points: &Points, config: &AsMeasuredConfig) -> Result<Outcome> {
    let object = points.input.display().to_string();
    let refuse = |problem: String| Error::new("read the profile of", &object, problem);
    let column =
        |name: &str| points.columns.iter().find(|column| column.name == name).map(|column| column.values.as_slice());
    let (x_mm, height_nm) = (points.column("x_mm")?, points.column("height_nm")?);
    if let Some(y) = column("y_mm").filter(|y| y.windows(2).any(|pair| pair[0].total_cmp(&pair[1]).is_ne())) {
        let [low, high] =
            y.iter().fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], y| [low.min(*y), high.max(*y)]);
        return Err(refuse(format!("its y goes from {low} to {high} mm: it is a map and no profile"))
            .help("leave `object` out"));
    }
    let places = GridPlaces::along(x_mm, column("y_mm").and_then(|y| y.first().copied()).unwrap_or_default());
    let places =
        places.map_err(|problem| refuse(problem).help("filters of a profile take points at equal distances"))?;
    let grid = places.heights(height_nm.iter().copied(), None);
    let std_nm = column("std_nm").map(|std| places.laid(std.iter().copied()));
    let first = grid.origin_x_mm;
    let staged = staged(grid, config, &object)?;
    let grid = &staged.grid;
    let skipped = ((grid.origin_x_mm - first) / grid.step_x_mm).round().max(0.0) as usize;
    let z_mm: Vec<f64> = (0..grid.columns).map(|place| grid.origin_x_mm + grid.step_x_mm * place as f64).collect();
    let errors = match std_nm {
        Some(std) if std.iter().any(|std| std.is_finite() && *std <= 0.0) => {
            return Err(refuse("`std_nm` is not above 0 nm everywhere".into()));
        }
        Some(std) => {
            let known: Vec<f64> = std.iter().copied().filter(|std| std.is_finite()).collect();
            let mean = known.iter().sum::<f64>() / known.len().max(1) as f64;
            let std = std
                .iter()
                .skip(skipped)
                .take(grid.columns)
                .map(|std| if std.is_finite() { *std } else { mean } / NM_PER_UM);
            Ok(OpenErrors { std_um: std.collect(), ..OpenErrors::default() })
        }
        None => Err(NO_NOISE.to_owned()),
    };
    let checks: Vec<Check> = errors.iter().filter_map(|errors| overstated(&grid.height_nm, &errors.std_um)).collect();
    let deviation_um: Vec<f64> = grid.height_nm.iter().map(|height| height / NM_PER_UM).collect();
    let known = || z_mm.iter().zip(&grid.height_nm).filter(|(_, height)| height.is_finite());
    if known().count() < 3 {
        return Err(refuse(format!("{} points are left", known().count())).of(ErrorKind::InsufficientData));
    }
    let spec = table();
    let profile = spec.rows(vec![numbers(known().map(|(x, _)| *x)), numbers(known().map(|(_, height)| *height))])?;
    let tables = vec![TableRows { table: spec.name, rows: profile }, rows(&staged.stages)?];
    let holes = grid.holes();
    let remarks = (holes > 0)
        .then(|| format!("{holes} of {} points have no height: they are left out of every value", grid.columns));
    Ok(Outcome {
        convention: "heights in nm, out of the material positive; x along the profile".into(),
        tables,
        values: staged.values,
        evaluables: vec![Evaluable::OpenProfile(OpenProfile {
            of: "profile".into(),
            z_mm: z_mm.clone(),
            deviation_um,
            errors,
        })],
        checks,
        remarks: remarks.into_iter().collect(),
        notes: vec![sentence(&staged.stages)],
        ..Outcome::default()
    })
}

/// Whether neighbouring points scatter far less than is stated: third differences have the noise and what the profile adds to it.
fn overstated(height_nm: &[f64], std_um: &[f64]) -> Option<Check> {
    let differences = height_nm.windows(4).map(|four| four[3] - 3.0 * four[2] + 3.0 * four[1] - four[0]);
    let known: Vec<f64> = differences.filter(|one| one.is_finite()).collect();
    let stated = std_um.iter().map(|std| (NM_PER_UM * std).powi(2)).sum::<f64>() / std_um.len() as f64;
    let ratio = known.iter().map(|one| one * one).sum::<f64>() / (OF_THIRD_DIFFERENCES * stated * known.len() as f64);
    let dof = (INDEPENDENT * known.len() as f64) as usize;
    far_below_noise(ratio, dof).map(|words| {
        Check::new(Test::Residual, "noise of neighbouring points", ratio, &[dof as f64], 0.0)
            .finding(|| format!("neighbouring points scatter by less than `std_nm`: {words}"))
    })
}
