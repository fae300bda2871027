//! An open profile as measured.

use runout_core::{
    Error, ErrorKind, Result,
    consistency::{Check, Test},
    draws::OpenErrors,
    height_grid::GridPlaces,
    numerics::{number::significant, statistics::median},
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
/// Variance of fourth differences of independent numbers, 1 + 16 + 36 + 16 + 1; the median of sizes of a normal variable of
/// deviation 1; and deviations that noise does not reach.
const OF_FOURTH_DIFFERENCES: f64 = 70.0;
const MEDIAN_OF_NORMAL: f64 = 0.674_489_750_196_081_7;
const FAR: f64 = 8.0;

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
    let told = |errors: &OpenErrors| {
        [overstated(&grid.height_nm, &errors.std_um), alone(&grid.height_nm, &z_mm, &errors.std_um)]
    };
    let checks: Vec<Check> = errors.iter().flat_map(told).flatten().collect();
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

/// Names a point that its neighbours do not follow: dust, a burr, or a scratch narrower than the step. It is off from the cubic through the two on either
/// side by far more than its noise and than others are from theirs, and these agree with each other without it.
fn alone(height_nm: &[f64], z_mm: &[f64], std_um: &[f64]) -> Option<Check> {
    let off = |height_nm: &[f64], at: usize| {
        let five = height_nm.get(at.checked_sub(2)?..at + 3)?;
        let off_nm = five[2] - (4.0 * (five[1] + five[3]) - five[0] - five[4]) / 6.0;
        off_nm.is_finite().then_some(off_nm)
    };
    let all: Vec<(usize, f64)> = (0..height_nm.len()).filter_map(|at| Some((at, off(height_nm, at)?))).collect();
    let usual_nm = median(all.iter().map(|(_, off_nm)| off_nm.abs())) / MEDIAN_OF_NORMAL;
    let std_nm = |at: usize| NM_PER_UM * std_um[at] * OF_FOURTH_DIFFERENCES.sqrt() / 6.0;
    let share = |(at, off_nm): &(usize, f64)| off_nm.abs() / std_nm(*at).max(usual_nm);
    let farthest = all.iter().max_by(|one, other| share(one).total_cmp(&share(other)))?;
    let (at, off_nm) = *farthest;
    let mut without = height_nm.to_vec();
    without[at] -= off_nm;
    let agree = |near: usize| off(&without, near).is_none_or(|off_nm| share(&(near, off_nm)) < 0.5 * FAR);
    let is_alone = share(farthest) > FAR && (at.saturating_sub(2)..=at + 2).all(agree);
    is_alone.then(|| {
        Check::new(Test::Rows, format!("x = {:.4} mm", z_mm[at]), share(farthest), &[], 0.0).finding(|| {
            format!(
                "the point at x = {:.4} mm is off by {} µm from those beside it: dust or a burr, or a scratch that one point does not describe",
                z_mm[at],
                significant(off_nm / NM_PER_UM, 3)
            )
        })
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

#[cfg(test)]
mod tests {
    use super::*;

    /// 400 points of a wave with a noise of 40 nm, and what is added to them.
    fn said(added_nm: impl Fn(usize) -> f64) -> Option<String> {
        let mut state = 5_u64;
        let mut uniform = || {
            state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
            (state >> 11) as f64 / (1_u64 << 53) as f64 - 0.5
        };
        let mut height = |at: usize| {
            2000.0 * (at as f64 / 60.0).sin() + 40.0 * (0..12).map(|_| uniform()).sum::<f64>() + added_nm(at)
        };
        let height_nm: Vec<f64> = (0..400).map(&mut height).collect();
        let z_mm: Vec<f64> = (0..400).map(|at| 0.1 * f64::from(at)).collect();
        alone(&height_nm, &z_mm, &vec![0.04; 400]).map(|check| check.finding)
    }

    #[test]
    fn a_point_alone_is_named_and_what_the_profile_has_is_not() {
        for size_nm in [3000.0, -600.0] {
            let found = said(|at| if at == 250 { size_nm } else { 0.0 });
            assert!(found.as_ref().is_some_and(|said| said.contains("x = 25.0000 mm")), "{size_nm}: {found:?}");
        }
        assert_eq!(said(|_| 0.0), None);
        // A step, a groove of several points, a texture of two points.
        assert_eq!(said(|at| if at > 200 { 3000.0 } else { 0.0 }), None);
        assert_eq!(said(|at| if (200..206).contains(&at) { -3000.0 } else { 0.0 }), None);
        assert_eq!(said(|at| if at % 2 == 0 { 500.0 } else { 0.0 }), None);
    }
}
