//! Predictions of the spatial error at places that were not measured, beside the truth: for few places and for many.

pub mod known;
pub mod machine;
pub mod placement;

use std::fmt::Write as _;

use nalgebra::{DMatrix, DVector, Vector3};
use runout_core::{
    Error, Result,
    pipeline::Context,
    stage::{Outcome, PointSeparator},
    table::{Array, Float64Array, RecordBatch},
};
use runout_spatial_error::{
    Query, SpatialErrorConfig,
    simulate::{Scenario, Simulated},
};

use crate::chance::Chance;
use known::Known;
use machine::TRAVEL_MM;

/// Unseen places of each machine.
const UNSEEN: usize = 60;
/// Places up to which the best predictor is computed: of more, its matrices are too large.
const MOST_KNOWN: usize = 1000;
/// Half of the 95 % interval, in standard deviations.
const INTERVAL: f64 = 1.959_964;

/// What predictions of some machines add up to.
#[derive(Debug, Clone, Default)]
pub struct Coverage {
    /// Distinct places of each machine.
    pub places: [usize; 2],
    /// Machines.
    pub machines: usize,
    /// Predictions within the measured volume.
    pub predictions: usize,
    /// Sum of squares of error over standard uncertainty.
    pub squares: f64,
    /// Predictions whose 95 % interval covers the true value.
    pub inside: usize,
    /// Sums of squares of the errors and of the standard uncertainties, in µm².
    pub sums_um2: [f64; 2],
    /// Mean square of error over standard uncertainty of each machine.
    pub of_machine: Vec<f64>,
    /// Share of the error that compensation removes, of each machine.
    pub removed: Vec<f64>,
    /// What compensation leaves, over what the best predictor leaves; of machines of which it is known.
    pub beside_best: Vec<f64>,
    /// Machines of which compensation removes 70 %, or leaves at most 1.15 times what the best predictor leaves.
    pub compensated: usize,
}

impl Coverage {
    /// Mean square of error over standard uncertainty.
    #[must_use]
    pub fn chi2(&self) -> f64 {
        self.squares / self.predictions as f64
    }

    /// Share of the 95 % intervals that cover the true value.
    #[must_use]
    pub fn share_inside(&self) -> f64 {
        self.inside as f64 / self.predictions as f64
    }
}

/// Predictions of simulated machines: of 90 to 160 places without `places`, else of as many at random.
///
/// # Errors
/// When a machine cannot be fitted.
pub fn coverage(machines: usize, seed: u64, places: Option<usize>) -> Result<Coverage> {
    let mut sum = Coverage { places: [usize::MAX, 0], ..Coverage::default() };
    let folder = tempfile::tempdir().map_err(|error| Error::caused("make", "a folder for places", error))?;
    for machine in 0..machines {
        let mut chance = Chance::new(seed, machine as u64);
        let scenario = machine::draw(&mut chance, places);
        let made = scenario.simulate();
        let unseen: Vec<[f64; 3]> =
            (0..UNSEEN).map(|_| TRAVEL_MM.map(|length| length * chance.between(0.02, 0.98))).collect();
        let path = folder.path().join("unseen.csv");
        let lines: Vec<String> = unseen.iter().map(|[x, y, z]| format!("{x},{y},{z}")).collect();
        std::fs::write(&path, format!("x_mm,y_mm,z_mm\n{}\n", lines.join("\n")))
            .map_err(|error| Error::caused("write", path.display().to_string(), error))?;
        let config = SpatialErrorConfig {
            query: Query { path: Some(path), ..Query::default() },
            ..SpatialErrorConfig::default()
        };
        let context = Context { folder: folder.path(), rig: None };
        let separator = config.separator(&context).map_err(|fault| Error::new("check", "the kriging", fault))?;
        let outcome = separator.separate(&made.points())?;
        sum.predictions(&made, &unseen, &outcome)?;
        sum.compensation(&scenario, &made, &unseen, &outcome)?;
        let count = made.commands_mm.len() / scenario.passes;
        sum.places = [sum.places[0].min(count), sum.places[1].max(count)];
        sum.machines += 1;
    }
    Ok(sum)
}

impl Coverage {
    fn predictions(&mut self, made: &Simulated, unseen: &[[f64; 3]], outcome: &Outcome) -> Result<()> {
        let (mut squares, mut count) = (0.0, 0);
        // What is outside the hull of the measured places is no prediction within the volume.
        let reach = column(outcome, "prediction", "extrapolated")?;
        for (axis, name) in ["dx_um", "dy_um", "dz_um"].into_iter().enumerate() {
            let mean = column(outcome, "prediction", name)?;
            let std = column(outcome, "prediction", &format!("std_{name}"))?;
            for (row, place) in unseen.iter().enumerate().filter(|(row, _)| reach[*row] < 0.5) {
                let error = mean[row] - made.truth_um(*place)[axis];
                squares += (error / std[row]).powi(2);
                self.sums_um2[0] += error * error;
                self.sums_um2[1] += std[row] * std[row];
                self.inside += usize::from(error.abs() <= INTERVAL * std[row]);
                count += 1;
            }
        }
        self.squares += squares;
        self.predictions += count;
        if count > 0 {
            self.of_machine.push(squares / count as f64);
        }
        Ok(())
    }

    /// Error before and after compensation, each without the best rigid motion, beside what the best predictor leaves.
    fn compensation(
        &mut self,
        scenario: &Scenario,
        made: &Simulated,
        unseen: &[[f64; 3]],
        outcome: &Outcome,
    ) -> Result<()> {
        let add = ["correct_x_um", "correct_y_um", "correct_z_um"].map(|name| column(outcome, "compensation", name));
        let [x, y, z] = add;
        let add = [x?, y?, z?];
        let error: Vec<Vector3<f64>> = unseen.iter().map(|place| Vector3::from(made.error_um(*place))).collect();
        let left: Vec<Vector3<f64>> =
            error.iter().enumerate().map(|(row, error)| error + Vector3::from_fn(|axis, _| add[axis][row])).collect();
        let [before, after] = [&error, &left].map(|all| without_rigid(unseen, all));
        self.removed.push(1.0 - after / before);
        let mut right = after <= 0.3 * before;
        if made.commands_mm.len() <= MOST_KNOWN * scenario.passes
            && let Some(known) = Known::new(scenario, made)
        {
            let truth = unseen.iter().map(|place| Vector3::from(made.truth_um(*place)));
            let of_best: Vec<Vector3<f64>> =
                truth.zip(known.predict(unseen)).map(|(truth, best)| truth - best).collect();
            let best = without_rigid(unseen, &of_best);
            self.beside_best.push(after / best);
            right |= after <= 1.15 * best;
        }
        self.compensated += usize::from(right);
        Ok(())
    }
}

pub(crate) fn column(outcome: &Outcome, table: &str, name: &str) -> Result<Vec<f64>> {
    let lacks = || Error::new("read", table, format!("there is no column `{name}` of numbers or flags"));
    let rows: &RecordBatch = &outcome.tables.iter().find(|rows| rows.table == table).ok_or_else(lacks)?.rows;
    let array = rows.column_by_name(name).ok_or_else(lacks)?;
    if let Some(numbers) = array.as_any().downcast_ref::<Float64Array>() {
        return Ok((0..numbers.len()).map(|row| numbers.value(row)).collect());
    }
    let flags = array.as_any().downcast_ref::<arrow_array::BooleanArray>().ok_or_else(lacks)?;
    Ok((0..flags.len()).map(|row| f64::from(u8::from(flags.value(row)))).collect())
}

/// Root mean square of what the best rigid motion leaves.
fn without_rigid(places: &[[f64; 3]], values: &[Vector3<f64>]) -> f64 {
    let design = DMatrix::from_fn(3 * places.len(), 6, |row, column| known::rigid(places[row / 3], row % 3, column));
    let right = DVector::from_fn(3 * places.len(), |row, _| values[row / 3][row % 3]);
    let solved = design.clone().svd(true, true).solve(&right, 1e-9).unwrap_or_else(|_| DVector::zeros(6));
    (right - design * solved).norm() / (places.len() as f64).sqrt()
}

/// A row each as Markdown.
#[must_use]
pub fn table(rows: &[Coverage]) -> String {
    let mut text = String::from(
        "| places | machines | predictions | mean square of error/std | of single machines: 10 %, median, 90 % | rms error, µm | \
         rms std, µm | 95 % intervals hold | compensation removes | leaves, × the best predictor |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for row in rows {
        let mut sorted = row.of_machine.clone();
        sorted.sort_by(f64::total_cmp);
        let quantile = |share: f64| {
            let place = (sorted.len().saturating_sub(1) as f64 * share) as usize;
            sorted.get(place).copied().unwrap_or(f64::NAN)
        };
        let mean = |all: &[f64]| all.iter().sum::<f64>() / all.len() as f64;
        let places = if row.places[0] == row.places[1] {
            row.places[0].to_string()
        } else {
            format!("{} to {}", row.places[0], row.places[1])
        };
        let best = if row.beside_best.is_empty() { "-".into() } else { format!("{:.2}", mean(&row.beside_best)) };
        let [error, std] = row.sums_um2.map(|sum| (sum / row.predictions as f64).sqrt());
        // Writing to a string cannot fail.
        let _ = writeln!(
            text,
            "| {places} | {} | {} | {:.2} | {:.2}, {:.2}, {:.2} | {error:.3} | {std:.3} | {:.1} % | {:.0} % | {best} |",
            row.machines,
            row.predictions,
            row.chi2(),
            quantile(0.1),
            quantile(0.5),
            quantile(0.9),
            100.0 * row.share_inside(),
            100.0 * mean(&row.removed),
        );
    }
    text
}
