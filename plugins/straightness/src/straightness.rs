//! Straightness along an axis: of a part, and of the slide that carried the probe.

use runout_core::{
    Result,
    consistency::Check,
    draws::OpenErrors,
    stage::{Evaluable, OpenProfile, Outcome},
    summary::Value,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, numbers},
};

use crate::{moves::rms, value_std::ProfileErrors};

/// What the numbers are, for files that explain themselves.
pub(crate) const CONVENTION: &str = "Straightness along z about the least-squares line (LSLI, ISO 12780-1). part_um is \
    positive where the part protrudes towards the probe; slide_um is the slide's displacement towards the part in the \
    initial setup. Standard uncertainties are those of one position, from the scatter of repeated traces; NaN if not \
    known.";

/// What is not observable, whatever the data.
pub(crate) const LIMIT: &str = "each trace has an offset and a slope of its own, so only the straightness about the \
    least-squares line is known: neither taper, nor parallelism, nor the angle between slide and part";

/// Why values have no uncertainty.
const NO_REPEATS: &str = "one trace in each setup: the errors are not known";

/// Straightness of part and slide on common positions.
#[derive(Debug, Clone, PartialEq)]
pub struct Straightness {
    /// Ascending positions along the axis, in mm.
    pub z_mm: Vec<f64>,
    /// Deviation of the part from its least-squares line at each position, outward positive, in µm.
    pub part_um: Vec<f64>,
    /// Its standard uncertainty from the scatter of repeated traces; NaN where not known.
    pub part_std_um: Vec<f64>,
    /// Deviation of the slide from its least-squares line, towards the part of the initial setup positive, in µm.
    pub slide_um: Vec<f64>,
    /// Its standard uncertainty; NaN where not known.
    pub slide_std_um: Vec<f64>,
    /// Standard deviation of one trace at one position (root mean square over the positions), in µm; NaN without repeats.
    pub repeatability_um: f64,
    /// Degrees of freedom behind each position's standard uncertainty.
    pub degrees_of_freedom: usize,
    /// The tests of the traces on themselves.
    pub checks: Vec<Check>,
    /// What the errors of part and slide are made of.
    pub(crate) errors: [ProfileErrors; 2],
    /// What the user should know.
    pub warnings: Vec<String>,
}

/// The table of straightness.
pub(crate) fn table() -> TableSpec {
    let std = |name: &str, of: &str| {
        let about =
            format!("standard uncertainty of {of} at this position, from the scatter; NaN where it is not known");
        ColumnSpec::number(name, "um", about)
    };
    TableSpec::new(
        "straightness",
        CONVENTION,
        vec![
            ColumnSpec::number("z_mm", "mm", "place along the axis"),
            ColumnSpec::number("part_um", "um", "the part's deviation from its least-squares line, outward positive"),
            std("part_std_um", "part_um"),
            ColumnSpec::number(
                "slide_um",
                "um",
                "the slide's deviation from its least-squares line, towards the part positive",
            ),
            std("slide_std_um", "slide_um"),
        ],
    )
    .figure(Figure::lines(
        "straightness",
        "Straightness",
        "z_mm",
        [Measure::new("part_um").with_std("part_std_um"), Measure::new("slide_um").with_std("slide_std_um")],
    ))
}

impl Straightness {
    /// As a result.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub(crate) fn outcome(self) -> Result<Outcome> {
        let columns = [&self.z_mm, &self.part_um, &self.part_std_um, &self.slide_um, &self.slide_std_um];
        let columns = columns.map(|column| numbers(column.iter().copied()));
        let table = table();
        let tables = vec![TableRows { rows: table.rows(columns.into())?, table: table.name }];
        let values = self.values();
        let evaluables = self.evaluables().into();
        let Self { checks, warnings: remarks, .. } = self;
        Ok(Outcome { convention: CONVENTION.into(), tables, values, checks, evaluables, remarks, ..Outcome::default() })
    }

    /// Both profiles with their errors, for the standards' values.
    fn evaluables(&self) -> [Evaluable; 2] {
        let [part, slide] = [0, 1].map(|which| {
            let errors = &self.errors[which];
            if errors.noise_um.iter().all(|std| std.is_finite()) {
                Ok(OpenErrors {
                    std_um: errors.noise_um.clone(),
                    freedom: errors.freedom,
                    correlation: errors.correlation.clone(),
                    common_um: errors.common_um.clone(),
                })
            } else {
                Err(NO_REPEATS.to_owned())
            }
        });
        let profile = |of: &str, deviation_um: &[f64], errors| {
            let (of, z_mm, deviation_um) = (of.to_owned(), self.z_mm.clone(), deviation_um.to_vec());
            Evaluable::OpenProfile(OpenProfile { of, z_mm, deviation_um, errors })
        };
        [profile("part", &self.part_um, part), profile("slide", &self.slide_um, slide)]
    }

    fn values(&self) -> Vec<Value> {
        let of = |name: &str, std_um: &[f64]| {
            let each = "standard uncertainty of the deviation at one position, rms over the positions";
            Value::new("std", rms(std_um), f64::NAN, "um", each).of(name)
        };
        let repeatability = "standard deviation of one trace at one position, rms over the positions";
        let mut values = vec![of("part", &self.part_std_um), of("slide", &self.slide_std_um)];
        values.push(Value::new("repeatability", self.repeatability_um, f64::NAN, "um", repeatability));
        let end = |z_mm: Option<&f64>| z_mm.copied().unwrap_or(f64::NAN);
        values.push(Value::new(
            "first-position",
            end(self.z_mm.first()),
            f64::NAN,
            "mm",
            "first position along the axis",
        ));
        values.push(Value::new("last-position", end(self.z_mm.last()), f64::NAN, "mm", "last position along the axis"));
        values.push(Value::new("positions", self.z_mm.len() as f64, f64::NAN, "", "number of positions"));
        values
    }

    /// Standard uncertainties of STRt and of the root mean square of part (0) or slide (1): of the difference of the highest and the lowest
    /// deviation, and of a mean over all positions. NaN where not known.
    pub(crate) fn std_of_values(&self, which: usize) -> [f64; 2] {
        let values = if which == 0 { &self.part_um } else { &self.slide_um };
        let ends = |sign: f64| {
            let each = values.iter().enumerate();
            each.max_by(|a, b| (sign * a.1).total_cmp(&(sign * b.1))).map(|(at, _)| at)
        };
        let mut difference = vec![0.0; values.len()];
        for (sign, at) in [1.0, -1.0].into_iter().filter_map(|sign| Some((sign, ends(sign)?))) {
            difference[at] += sign;
        }
        let size = values.len() as f64 * rms(values);
        let mean: Vec<f64> = values.iter().map(|value| value / size).collect();
        [self.errors[which].of(&difference), self.errors[which].of(&mean)]
    }

    /// Whether all its deviations are numbers.
    pub(crate) fn is_finite(&self) -> bool {
        [&self.z_mm, &self.part_um, &self.slide_um].into_iter().flatten().all(|value| value.is_finite())
    }
}
