//! From a fit to tables, values and remarks.

use runout_core::{
    Result,
    stage::Outcome,
    summary::NamedValue,
    table::{ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, flags, numbers},
};

use crate::{
    campaign::{COMPONENTS, Campaign},
    compensate::{Chain, Correction},
    conclusion::{At, Conclusion},
    joint::{LeftOut, Predicted},
    likelihood::PARAMETERS,
    noise::Noise,
    remarks,
    solve::Solution,
    terms::Term,
    variogram,
};

/// A component of which the prior variance is below this share of the largest does not flag a prediction.
const SMALL: f64 = 0.1;
/// A standard deviation above this share of the prior's is an extrapolation.
const UNCERTAIN: f64 = 0.8;

/// The tables of the result.
#[must_use]
pub(crate) fn tables(chain: &Chain) -> Vec<TableSpec> {
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
    vec![
        ["x", "y", "z"].into_iter().fold(prediction, |table, axis| table.figure(predicted_along(axis))),
        COMPONENTS.into_iter().fold(residual, |table, one| table.figure(before_and_after(one))).figure(left_out()),
        variogram::table(),
        TableSpec::new("compensation", "corrections, without the placement of the tracker", compensation),
    ]
}

/// The predicted error with its uncertainty over the command of one axis.
fn predicted_along(axis: &str) -> Figure {
    let value = |one: &str| Measure::new(format!("{one}_um")).with_std(format!("std_{one}_um")).with_symbol(one);
    let title = format!("Predicted error over {axis}");
    Figure::points(format!("prediction-{axis}"), title, format!("{axis}_mm"), COMPONENTS.map(value))
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
        let queries = self.queries(&places);
        let left_out = self.solution.left_out();
        let tables = vec![
            self.rows("prediction", prediction_columns(&queries))?,
            self.rows("residual", self.residual_columns(&left_out))?,
            self.rows("variogram", variogram::columns(self.campaign, self.solution))?,
            self.rows("compensation", self.compensation_columns(&queries))?,
        ];
        Ok(Outcome {
            convention: "errors are actual less commanded place along the machine's axes; rotations are right-handed; lever arms and \
                         orders count from the middle of the measured volume"
                .into(),
            tables,
            values: self.values(&queries, &left_out),
            remarks: remarks::remarks(self, &queries, &left_out),
            notes: remarks::notes(self, &queries),
            ..Outcome::default()
        })
    }

    fn rows(&self, name: &str, columns: Vec<ArrayRef>) -> Result<TableRows> {
        let spec = tables(&self.separator.chain).into_iter().find(|spec| spec.name == name);
        let spec = spec.unwrap_or_else(|| TableSpec::new(name, "", Vec::new()));
        Ok(TableRows { rows: spec.rows(columns)?, table: spec.name })
    }

    fn queries(&self, places: &[[f64; 3]]) -> Vec<At> {
        let (campaign, solution) = (self.campaign, self.solution);
        let prior = [0, 1, 2].map(|axis| solution.prior_std_um(campaign, axis).powi(2));
        let largest = prior.iter().copied().fold(0.0, f64::max);
        let lost = Predicted { mean_um: f64::NAN, variance_um2: f64::NAN };
        let predicted = solution.predict(campaign, places, true);
        let one = |(place_mm, predicted): (&[f64; 3], [Predicted; 3])| {
            let place_mm = *place_mm;
            let held = campaign.span.holds(place_mm);
            let predicted = if held { predicted } else { [lost; 3] };
            let uncertain = (0..3).any(|axis| {
                prior[axis] >= SMALL * largest && predicted[axis].variance_um2 > UNCERTAIN * UNCERTAIN * prior[axis]
            });
            let extrapolated = !held || uncertain || campaign.span.is_outside(place_mm);
            let placement = solution.placement_um(campaign, place_mm);
            let error_um = [0, 1, 2].map(|axis| predicted[axis].mean_um - placement[axis]);
            let known = error_um.iter().all(|error| error.is_finite());
            let correction = known.then(|| self.separator.chain.correct(place_mm, error_um));
            At { place_mm, predicted, extrapolated, correction, error_um }
        };
        places.iter().zip(predicted).map(one).collect()
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

    fn values(&self, queries: &[At], left_out: &[[LeftOut; 3]]) -> Vec<NamedValue> {
        let (campaign, solution) = (self.campaign, self.solution);
        let mut values = Vec::new();
        let trend_std = solution.trend_std(campaign);
        let fitted = |wanted: Term| {
            let column = solution.terms.iter().position(|term| *term == wanted);
            column.map_or([f64::NAN; 2], |column| [solution.joint.trend[column], trend_std[column]])
        };
        for wanted in self.separator.config.declared_terms() {
            let [number, std] = fitted(wanted);
            let (symbol, about) = match wanted {
                Term::Turn(axis) => (["RX", "RY", "RZ"][axis], "rotation of the placement about the axis"),
                Term::Shift(axis) => {
                    (["TX", "TY", "TZ"][axis], "displacement of the placement, at the middle of the volume")
                }
                _ => continue,
            };
            values.push(NamedValue::new(symbol, number, std, wanted.unit(), about));
        }
        for (id, target, term) in self.names {
            let [number, std] = fitted(*term);
            values.push(NamedValue::new(id, number, std, term.unit(), "effect that was added").of(target));
        }
        for (axis, component) in COMPONENTS.into_iter().enumerate() {
            let covariance = &solution.covariances[axis];
            let of_estimate = |parameter: usize, number: f64| {
                let index = axis * PARAMETERS + parameter;
                solution.estimate.as_ref().map_or(f64::NAN, |estimate| {
                    // d(exp θ) = exp θ · dθ.
                    number * estimate.covariance[(index, index)].sqrt()
                })
            };
            let mut add = |symbol: &str, number: f64, std: f64, unit: &str, about: &str| {
                values.push(NamedValue::new(symbol, number, std, unit, about).of(component));
            };
            let sill = covariance.sill_um;
            add("sill", sill, of_estimate(0, sill), "um", "standard deviation of the field");
            for (direction, letter) in ["x", "y", "z"].into_iter().enumerate() {
                let seen = campaign.volume.half_mm[direction] > 0.0 || solution.estimate.is_none();
                let range = if seen { covariance.range_mm[direction] } else { f64::NAN };
                let symbol = format!("range_{letter}");
                add(&symbol, range, of_estimate(1 + direction, range), "mm", "range of the covariance along the axis");
            }
            let nugget = covariance.nugget_um;
            let about = if Solution::nugget_counts(campaign) {
                "standard deviation from place to place beyond noise"
            } else {
                "standard deviation from place to place, noise included"
            };
            add("nugget", nugget, of_estimate(4, nugget), "um", about);
            let noise = campaign.noise_um(axis);
            let of_noise = match &campaign.noise {
                Noise::Repeats { dof, .. } => noise / (2.0 * *dof as f64).sqrt(),
                _ => f64::NAN,
            };
            add("noise", noise, of_noise, "um", "standard uncertainty of one reading");
            let each = || left_out.iter().map(|place| place[axis]).filter(|one| one.std_um.is_finite());
            let count = each().count() as f64;
            let rms = (each().map(|one| one.residual_um.powi(2)).sum::<f64>() / count).sqrt();
            let chi2 = each().map(|one| (one.residual_um / one.std_um).powi(2)).sum::<f64>() / count;
            add("left_out_rms", rms, f64::NAN, "um", "root mean square of what the other places do not predict");
            add("left_out_chi2", chi2, f64::NAN, "", "mean square of the same in its standard deviations");
        }
        let known = || queries.iter().filter_map(|query| Some((query, query.correction.as_ref()?)));
        let rms = |of: &dyn Fn(&At, &Correction) -> [f64; 3]| {
            let sum: f64 =
                known().map(|(query, correction)| of(query, correction).iter().map(|e| e * e).sum::<f64>()).sum();
            (sum / known().count() as f64).sqrt()
        };
        let about = "root mean square length of the predicted error without the placement, at the places of the query";
        values.push(NamedValue::new("error_rms", rms(&|query, _| query.error_um), f64::NAN, "um", about));
        let about = "the same that the corrections leave";
        values.push(NamedValue::new("remains_rms", rms(&|_, correction| correction.remains_um), f64::NAN, "um", about));
        values
    }
}

/// Reading less the fit at its place, trend and field, in µm.
#[must_use]
pub(crate) fn residual_um(campaign: &Campaign, solution: &Solution) -> Vec<[f64; 3]> {
    let terms = &solution.terms;
    let trend = &solution.joint.trend;
    // What noise is taken to be of the mean at each place.
    let of_mean: Vec<[f64; 3]> = if solution.fitted.is_none() {
        (0..campaign.places_mm.len())
            .map(|place| {
                [0, 1, 2]
                    .map(|axis| solution.noise_um2(campaign, place, axis) * solution.joint.fields[axis].alpha[place])
            })
            .collect()
    } else {
        let predicted = solution.predict(campaign, &campaign.places_mm, false);
        let mean = |place: usize, axis: usize| {
            let of_trend: f64 =
                (0..terms.len()).map(|column| solution.data.design[axis][(place, column)] * trend[column]).sum();
            let at_first: f64 = terms
                .iter()
                .zip(trend.iter())
                .map(|(term, value)| value * term.at(&campaign.volume, campaign.places_mm[place], 0.0)[axis])
                .sum();
            solution.data.observed[axis].mean_um[place] - predicted[place][axis].mean_um - of_trend + at_first
        };
        (0..campaign.places_mm.len()).map(|place| [0, 1, 2].map(|axis| mean(place, axis))).collect()
    };
    let moving: Vec<usize> = (0..terms.len()).filter(|column| terms[*column].moves_in_time()).collect();
    let one = |(row, place): (usize, &usize)| {
        [0, 1, 2].map(|axis| {
            let drift: f64 = moving
                .iter()
                .map(|column| {
                    let now = terms[*column].at(&campaign.volume, campaign.places_mm[*place], campaign.time[row])[axis];
                    trend[*column] * (now - solution.data.design[axis][(*place, *column)])
                })
                .sum();
            let from_mean = campaign.readings_um[row][axis] - solution.data.observed[axis].mean_um[*place];
            of_mean[*place][axis] + from_mean - drift
        })
    };
    campaign.place_of.iter().enumerate().map(one).collect()
}

fn prediction_columns(queries: &[At]) -> Vec<ArrayRef> {
    let mut columns: Vec<ArrayRef> =
        [0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.place_mm[axis]))).into();
    columns.extend([0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.predicted[axis].mean_um))));
    columns
        .extend([0, 1, 2].map(|axis| numbers(queries.iter().map(|query| query.predicted[axis].variance_um2.sqrt()))));
    columns.push(flags(queries.iter().map(|query| query.extrapolated)));
    columns
}
