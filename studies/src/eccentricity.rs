//! Form error against clamping eccentricity, with exact geometry and with the linear equations.

use std::fmt::Write;

use runout_core::{Error, Result};
use runout_spindle::{
    separators::{HarmonicLeastSquares, Weighting},
    simulate::simulator,
};

use crate::campaign;

/// Offsets of the clamped part's axis, in µm.
pub const ECCENTRICITIES_UM: [f64; 6] = [0.0, 8.0, 150.0, 250.0, 400.0, 1000.0];
/// Form error that every campaign must stay below, in µm rms over orders 2 to 60.
pub const LIMIT_UM: f64 = 0.009;

/// One eccentricity's campaigns.
pub struct Row {
    /// In µm.
    pub eccentricity_um: f64,
    /// Form errors with exact geometry, one a seed, in µm rms.
    pub exact_um: Vec<f64>,
    /// With the linear equations.
    pub linear_um: Vec<f64>,
    /// Weighted residual per degree of freedom with exact geometry.
    pub chi2: Vec<f64>,
    /// And with the linear equations.
    pub linear_chi2: Vec<f64>,
}

/// Simulates and separates `seeds` campaigns at each eccentricity.
///
/// # Errors
/// When a stage fails.
pub fn rows(seeds: u64) -> Result<Vec<Row>> {
    let mut rows = Vec::new();
    for eccentricity_um in ECCENTRICITIES_UM {
        let mut row = Row { eccentricity_um, exact_um: vec![], linear_um: vec![], chi2: vec![], linear_chi2: vec![] };
        for seed in 0..seeds {
            let config = campaign::reference(seed, eccentricity_um);
            let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
            let simulator = simulator(&config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
            let (station, truth) =
                campaign::station(&simulator, &rig, config.recording.samples_per_rev, config.recording.revolutions)?;
            for (second_order, errors, chi2) in
                [(true, &mut row.exact_um, &mut row.chi2), (false, &mut row.linear_um, &mut row.linear_chi2)]
            {
                let separator = HarmonicLeastSquares::new(&rig, second_order, Weighting::TurnCovariance);
                let outcome = campaign::separate(&station, &truth, &separator)?;
                errors.push(outcome.form_error_um(2..=60));
                chi2.push(outcome.separation.residual.chi2_per_dof);
            }
        }
        rows.push(row);
    }
    Ok(rows)
}

/// The table as Markdown.
#[must_use]
pub fn table(rows: &[Row]) -> String {
    let mut text = String::from(
        "| eccentricity | form error, exact geometry: median, worst | below 0.009 | χ² | linear equations: median, worst | χ² |\n\
         | --- | --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let below = row.exact_um.iter().filter(|error| **error <= LIMIT_UM).count();
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {:.0} µm | {:.4}, {:.4} µm rms | {below} of {} | {:.2} | {:.4}, {:.4} µm rms | {:.1} |",
            row.eccentricity_um,
            median(&row.exact_um),
            worst(&row.exact_um),
            row.exact_um.len(),
            median(&row.chi2),
            median(&row.linear_um),
            worst(&row.linear_um),
            median(&row.linear_chi2),
        );
    }
    text
}

fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted.get(sorted.len() / 2).copied().unwrap_or(f64::NAN)
}

fn worst(values: &[f64]) -> f64 {
    values.iter().copied().fold(0.0, f64::max)
}
