//! From a fit to tables, values and remarks.

use runout_core::{
    Result,
    component_curves::{curves_rows, curves_table, location_rows, location_table},
    stage::Outcome,
    table::{ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, flags, numbers},
};

use crate::{
    campaign::COMPONENTS,
    checks::{checks, factors},
    compensate::{Chain, Correction},
    conclusion::{At, Conclusion},
    curves::component_fit,
    joint::{LeftOut, Predicted},
    remarks,
    residual::residual_um,
    values::of_curves,
    variogram,
};

/// A component of which the prior variance is below this share of the largest does not flag a prediction.
const SMALL: f64 = 0.1;
/// A standard deviation above this share of the prior's is an extrapolation.
const UNCERTAIN: f64 = 0.8;

const ABOUT_CURVES: &str = "component errors of the axes at nodes, linear between; positioning and rotations have mean 0, straightness the \
                            least-squares line, over the nodes; rotations act on what the axis carries, with arms from the point `at`";

/// The tables of the result.
#[must_use]
pub(crate) fn tables(chain: &Chain, curves: bool) -> Vec<TableSpec> {
    let of = |name: &str, unit: &str, about: &str| ColumnSpec::number(name, unit, about);
    let places = || ["x", "y", "z"].map(|axis| of(&format!("{axis}_mm"), "mm", "command").repeating());
    let each = |before: &str, about: &str| COMPONENTS.map(|one| of(&format!("{before}{one}_um"), "um", about));
    let extrapolated = || {
        let about =
            "outside the hull of the measured places, or a standard deviation above 0.8 of that before any reading";
        ColumnSpec::flag("extrapolated", about)
    };
    let mut prediction: Vec<ColumnSpec> = places().into();
    prediction.extend(each("", "what would be read, without noise, at the time of the first reading"));
    prediction.extend(each("std_", "its standard uncertainty, without the noise of a further reading"));
    prediction.extend(each("error_", "the error of the machine: the same without the placement of the tracker"));
    prediction.push(extrapolated());
    let mut residual = vec![ColumnSpec::count("reading", "", "number of the reading, from 0")];
    residual.extend(places());
    residual.extend(each("", "the reading"));
    residual.extend(each("residual_", "reading less the fit at its place"));
    residual.extend(each("left_out_", "mean of the readings at its place less prediction from all other places"));
    residual.extend(each("std_left_out_", "standard deviation expected of it, noise included"));
    let mut compensation: Vec<ColumnSpec> = places().into();
    for axis in chain.axes() {
        compensation.push(of(&axis.column(), axis.unit(), "what to add to the command of the axis"));
    }
    compensation.extend(each("remains_", "what is predicted to remain of the error, without the placement"));
    compensation.push(ColumnSpec::flag("limited", "whether an axis is at its limit"));
    compensation.push(extrapolated());
    let prediction = TableSpec::new("prediction", "predicted readings; NaN where nothing is predicted", prediction);
    let residual = TableSpec::new("residual", "residual of each reading", residual);
    let mut all = vec![
        prediction.figure(error_map()),
        COMPONENTS.into_iter().fold(residual, |table, one| table.figure(before_and_after(one))).figure(left_out()),
        variogram::table(),
        TableSpec::new("compensation", "corrections, without the placement of the tracker", compensation),
    ];
    if curves {
        all.extend([curves_table(false, ABOUT_CURVES), location_table()]);
    }
    all
}

/// The error of the machine at the places of the query, as vectors.
fn error_map() -> Figure {
    let place = ["x", "y", "z"].map(|axis| format!("{axis}_mm"));
    let vector = COMPONENTS.map(|one| format!("error_{one}_um"));
    Figure::vectors("error-map", "Error of the machine", place, vector)
}

/// A component of each reading, and what the fit leaves of it.
fn before_and_after(one: &str) -> Figure {
    let before = Measure::new(format!("{one}_um")).with_symbol("reading");
    let after = Measure::new(format!("residual_{one}_um")).with_symbol("residual");
    Figure::points(format!("residual-{one}"), format!("Error {one} before and after"), "reading", [before, after])
}

/// What all other places do not predict of a place, with its expected standard deviation.
fn left_out() -> Figure {
    let value = |one: &str| {
        Measure::new(format!("left_out_{one}_um")).with_std(format!("std_left_out_{one}_um")).with_symbol(one)
    };
    Figure::points("left-out", "Mean reading less prediction from all other places", "reading", COMPONENTS.map(value))
}

impl Conclusion<'_> {
    /// Tables, values and remarks.
    ///
    /// # Errors
    /// When the query cannot be read.
    pub(crate) fn outcome(&self) -> Result<Outcome> {
        let places = self.separator.query.places(self.campaign)?;
        let checks = checks(self.campaign, self.solution, &self.separator.config.kriging);
        let queries = self.queries(&places, factors(&checks));
        let left_out = self.solution.left_out();
        let mut tables = vec![
            self.rows("prediction", prediction_columns(&queries))?,
            self.rows("residual", self.residual_columns(&left_out))?,
            self.rows("variogram", variogram::columns(self.campaign, self.solution))?,
            self.rows("compensation", self.compensation_columns(&queries))?,
        ];
        let mut values = self.values(&queries, &left_out, &checks);
        let mut remarks = remarks::remarks(self, &queries, &left_out);
        let mut notes = remarks::notes(self, &queries);
        if self.separator.config.curves.is_some() {
            match component_fit(self.campaign, self.solution, &self.separator.config, factors(&checks)) {
                Ok(found) => {
                    tables.push(curves_rows(&curves_table(false, ABOUT_CURVES), &found.nodes)?);
                    tables.push(location_rows(&found.location)?);
                    values.extend(of_curves(&found));
                    notes.extend(found.notes);
                }
                Err(problem) => {
                    tables.push(curves_rows(&curves_table(false, ABOUT_CURVES), &[])?);
                    tables.push(location_rows(&[])?);
                    remarks.push(problem);
                }
            }
        }
        Ok(Outcome {
            convention: "errors are actual less commanded place along the machine's axes; rotations are right-handed; lever arms and \
                         orders count from the middle of the measured volume"
                .into(),
            tables,
            values,
            checks,
            remarks,
            notes,
            ..Outcome::default()
        })
    }

    fn rows(&self, name: &str, columns: Vec<ArrayRef>) -> Result<TableRows> {
        let spec = tables(&self.separator.chain, false).into_iter().find(|spec| spec.name == name);
        let spec = spec.unwrap_or_else(|| TableSpec::new(name, "", Vec::new()));
        Ok(TableRows { rows: spec.rows(columns)?, table: spec.name })
    }

    /// Predictions and corrections at places, with a factor on the standard uncertainty of each component.
    fn queries(&self, places: &[[f64; 3]], factors: [f64; 3]) -> Vec<At> {
        let (campaign, solution) = (self.campaign, self.solution);
        let prior = solution.prior_std_um(campaign).map(|std_um| std_um * std_um);
        let largest = prior.iter().copied().fold(0.0, f64::max);
        let mut predicted = solution.predict(campaign, places, true);
        for at in predicted.iter_mut().flat_map(|at| at.iter_mut().zip(factors)) {
            at.0.variance_um2 *= at.1 * at.1;
        }
        let rough = solution.rough_um(campaign, places, &predicted);
        let one = |((place_mm, predicted), rough_um): ((&[f64; 3], [Predicted; 3]), [f64; 3])| {
            let place_mm = *place_mm;
            let held = campaign.span.holds(place_mm);
            let predicted = if held { predicted } else { [Predicted::LOST; 3] };
            let uncertain = (0..3).any(|axis| {
                prior[axis] >= SMALL * largest && predicted[axis].variance_um2 > UNCERTAIN * UNCERTAIN * prior[axis]
            });
            let extrapolated = !held || uncertain || campaign.span.is_outside(place_mm);
            let placement = solution.placement_um(campaign, place_mm);
            let error_um = [0, 1, 2].map(|axis| predicted[axis].mean_um - placement[axis]);
            // What varies from place to place is not corrected: between places, no axis would follow it.
            let correction = solution.measured.iter().all(|axis| error_um[*axis].is_finite()).then(|| {
                let smooth_um = [0, 1, 2].map(|axis| error_um[axis] - rough_um[axis]);
                let mut correction = self.separator.chain.correct(place_mm, smooth_um);
                correction.remains_um.iter_mut().zip(rough_um).for_each(|(remains, rough)| *remains += rough);
                correction
            });
            At { place_mm, predicted, extrapolated, correction, error_um }
        };
        places.iter().zip(predicted).zip(rough).map(one).collect()
    }

    fn residual_columns(&self, left_out: &[[LeftOut; 3]]) -> Vec<ArrayRef> {
        let campaign = self.campaign;
        let place_of = || campaign.place_of.iter().copied();
        let residual = residual_um(campaign, self.solution);
        let mut columns = vec![counts(0..campaign.place_of.len())];
        columns.extend([0, 1, 2].map(|axis| numbers(place_of().map(|place| campaign.places_mm[place][axis]))));
        columns.extend([0, 1, 2].map(|axis| numbers(campaign.readings_um.iter().map(|reading| reading[axis]))));
        columns.extend([0, 1, 2].map(|axis| numbers(residual.iter().map(|residual| residual[axis]))));
        columns.extend([0, 1, 2].map(|axis| numbers(place_of().map(|place| left_out[place][axis].residual_um))));
        columns.extend([0, 1, 2].map(|axis| numbers(place_of().map(|place| left_out[place][axis].std_um))));
        columns
    }

    fn compensation_columns(&self, queries: &[At]) -> Vec<ArrayRef> {
        let mut columns: Vec<ArrayRef> =
            [0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.place_mm[axis]))).into();
        let of = |number: &dyn Fn(&Correction) -> f64| {
            numbers(
                queries.iter().map(|query| query.correction.as_ref().map_or(f64::NAN, number)).collect::<Vec<f64>>(),
            )
        };
        for index in 0..self.separator.chain.axes().len() {
            columns.push(of(&|correction| correction.add[index]));
        }
        for axis in 0..3 {
            columns.push(of(&|correction| correction.remains_um[axis]));
        }
        let limited = queries.iter().map(|query| query.correction.as_ref().is_some_and(|one| one.limited));
        columns.push(flags(limited));
        columns.push(flags(queries.iter().map(|query| query.extrapolated)));
        columns
    }
}

fn prediction_columns(queries: &[At]) -> Vec<ArrayRef> {
    let mut columns: Vec<ArrayRef> =
        [0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.place_mm[axis]))).into();
    columns.extend([0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.predicted[axis].mean_um))));
    columns
        .extend([0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.predicted[axis].variance_um2.sqrt()))));
    columns.extend([0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.error_um[axis]))));
    columns.push(flags(queries.iter().map(|query| query.extrapolated)));
    columns
}
