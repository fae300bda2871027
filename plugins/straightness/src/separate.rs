//! The separator `axial-reversal`.

use runout_core::{
    Error, ErrorKind, Result,
    fault::{Fault, known_names},
    numerics::number::significant,
    pipeline::{Context, StageConfig},
    points::{
        PointColumn,
        PointKind::{Flag, Number, Trace, TraceKind},
        Points,
    },
    stage::{EvaluableKind, Outcome, PointModel, PointSeparator, Separator},
    table::TableSpec,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    contrasts::TraceErrors,
    grid::{Split, smooth},
    judged::not_reversed,
    moves::{grid, rows},
    positions::{coarsest_mm, common_range, positions},
    straightness::{self, LIMIT, Straightness},
    trace::AxialTrace,
    value_std::ProfileErrors,
};

/// `[separate] plugin = "axial-reversal"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct AxialReversalConfig {
    /// Setup in which the slide's displacement counts as it is: towards the part positive.
    #[serde(default = "default_initial")]
    pub initial: String,
    /// Setup with the part turned by 180° about its axis, and the probe on the opposite side of it, at the same line.
    #[serde(default = "default_reversed")]
    pub reversed: String,
    /// Distance of the positions that straightness is given at, in mm, counted from where all traces have begun.
    /// Without it: the traces' own positions where they are the same in all, else about the median spacing of the
    /// coarsest trace, so that both ends of the common range have one.
    #[serde(default)]
    pub step_mm: Option<f64>,
    /// The slide has no waves shorter than this, in mm. Declare it where the slide's guideway and bearings bear it out: shorter
    /// waves are then the part's, the setups can contradict each other, and `diagnose` finds a shift between them.
    #[serde(default)]
    pub slide_cutoff_mm: Option<f64>,
    /// Standard deviation of one reading, in µm, where it is known from elsewhere; `diagnose` can then say whether noise only
    /// is left.
    #[serde(default)]
    pub reading_std_um: Option<f64>,
    /// Largest axial shift of a trace that is looked for, in mm.
    #[serde(default = "default_max_shift_mm")]
    pub max_shift_mm: f64,
}

impl Default for AxialReversalConfig {
    fn default() -> Self {
        Self {
            initial: default_initial(),
            reversed: default_reversed(),
            step_mm: None,
            slide_cutoff_mm: None,
            reading_std_um: None,
            max_shift_mm: default_max_shift_mm(),
        }
    }
}

fn default_max_shift_mm() -> f64 {
    1.0
}

fn default_initial() -> String {
    "initial".into()
}

fn default_reversed() -> String {
    "reversed".into()
}

impl StageConfig for AxialReversalConfig {
    type Stage = Separator;

    const NAME: &'static str = "axial-reversal";
    const ABOUT: &'static str = "straightness of part and slide along z, part turned by 180° and probe reversed";

    fn check(self, _context: &Context) -> std::result::Result<Self::Stage, Fault> {
        Ok(Separator::Points(Box::new(self.separator()?)))
    }
}

impl AxialReversalConfig {
    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn separator(self) -> std::result::Result<AxialReversal, Fault> {
        if self.initial == self.reversed {
            return Err(Fault::at("reversed", format!("both setups are named `{}`", self.reversed)));
        }
        let positive = [
            ("step_mm", "the step", "mm", self.step_mm),
            ("slide_cutoff_mm", "the slide's shortest wave", "mm", self.slide_cutoff_mm),
            ("reading_std_um", "the standard deviation", "µm", self.reading_std_um),
            ("max_shift_mm", "the largest shift", "mm", Some(self.max_shift_mm)),
        ];
        let wrong = |value: f64| !(value.is_finite() && value > 0.0);
        match positive.into_iter().find(|(.., value)| value.is_some_and(wrong)) {
            Some((key, what, unit, value)) => {
                let found = value.unwrap_or_default();
                Err(Fault::at(key, format!("{what} must be above 0 {unit}, found {found}")))
            }
            None => Ok(AxialReversal(self)),
        }
    }
}

/// Sum and difference of the two setups' mean traces: u₁ = part + slide and u₂ = part − slide, each trace with an
/// offset and a slope of its own (straightedge reversal: C. J. Evans, R. J. Hocken, W. T. Estler, "Self-calibration:
/// reversal, redundancy, error separation, and 'absolute testing'", CIRP Annals 45(2), 617-634 (1996)).
///
/// 1. Every trace is interpolated on common positions, within the range that all of them cover. In a gap it has no value.
/// 2. Its least-squares line there is removed: with common positions that is the joint least-squares alignment of all
///    traces. Gaps are filled from the other traces until the same holds.
/// 3. With the mean m of each setup, part = (m₁ + m₂)/2 and slide = (m₁ − m₂)/2. With a bound on the slide's waves, the slide
///    is the least-squares spline of that, and the part is what the traces have without it.
/// 4. With k₁ and k₂ traces, the scatter s² about the setups' means, pooled at each position over k₁ + k₂ − 2 degrees
///    of freedom, gives both the variance s²(1/k₁ + 1/k₂)/4. Where errors of a trace depend on each other along z
///    ([`runout_core::consistency::order`], on contrasts between the traces), their covariance over all z takes its place.
#[derive(Debug, Clone)]
pub struct AxialReversal(pub(crate) AxialReversalConfig);

/// Positions closer than this share of the coarsest spacing are worth a word.
const FINER: f64 = 0.75;

/// Repeatability below that of any displacement sensor along a slide, 0.1 nm; and what rounding makes of equal traces, in µm.
const FINEST_UM: f64 = 1e-4;
const ROUNDING_UM: f64 = 1e-9;

/// A position or length as warnings say it: to 0.1 µm, without zeros at the end.
fn said(mm: f64) -> f64 {
    (mm * 1e4).round() / 1e4
}

/// Traces of both setups, one after the other.
pub(crate) struct Traces {
    pub all: Vec<AxialTrace>,
    /// Setup of each: 0 or 1.
    pub setups: Vec<usize>,
}

const COLUMNS: [PointColumn; 6] = [
    PointColumn::needed(
        "trace",
        Trace,
        "",
        "name of the trace, whose points follow one another, with z rising or falling",
    ),
    PointColumn::needed("setup", TraceKind, "", "setup that the trace was measured in"),
    PointColumn::needed("z_mm", Number, "mm", "place along the axis"),
    PointColumn::needed("reading_um", Number, "um", "reading, which grows when the surface comes nearer to the probe")
        .measured(),
    PointColumn::optional(
        "time_s",
        Number,
        "s",
        "time, for drifts along a trace; without it a trace runs at constant speed in the order of its rows",
    ),
    PointColumn::optional("flag", Flag, "", "1 leaves the point out, 0 uses it"),
];

impl PointSeparator for AxialReversal {
    fn columns(&self) -> Vec<PointColumn> {
        COLUMNS.into()
    }

    fn tables(&self) -> Vec<TableSpec> {
        vec![straightness::table()]
    }

    fn evaluables(&self) -> Vec<EvaluableKind> {
        vec![EvaluableKind::OpenProfile]
    }

    fn separate(&self, points: &Points) -> Result<Outcome> {
        self.separated(points)?.outcome()
    }

    fn notes(&self) -> Vec<String> {
        vec![LIMIT.to_owned()]
    }

    fn model(&self) -> Option<&dyn PointModel> {
        Some(self)
    }
}

impl AxialReversal {
    /// Straightness of part and slide.
    ///
    /// # Errors
    /// When the traces do not hold what the method needs.
    pub fn separated(&self, points: &Points) -> Result<Straightness> {
        let traces = self.traces(points)?;
        let mut result = self.straightness(points, &traces, 1.0, None, None)?.0;
        let (checks, fit) = self.contradictions(points, &traces)?;
        if let Some(errors) = fit.trace_errors() {
            result = self.straightness(points, &traces, 1.0, None, Some(&errors))?.0;
        }
        result.checks = checks;
        result.warnings.extend(not_reversed(&result, [&self.0.initial, &self.0.reversed]));
        finite(points, &result)?;
        Ok(result)
    }
}

/// Refuses what is not a number.
pub(crate) fn finite(points: &Points, result: &Straightness) -> Result<()> {
    if result.is_finite() {
        return Ok(());
    }
    let problem = "the straightness comes out as no number";
    Err(Error::new("separate", points.input.display().to_string(), problem)
        .of(ErrorKind::Numerical)
        .help("look for absurd readings"))
}

impl AxialReversal {
    /// The traces of a file.
    pub(crate) fn traces(&self, points: &Points) -> Result<Traces> {
        let setups = [traces_of(points, &self.0.initial)?, traces_of(points, &self.0.reversed)?];
        let numbers = setups.iter().enumerate().flat_map(|(setup, traces)| vec![setup; traces.len()]).collect();
        Ok(Traces { all: setups.into_iter().flatten().collect(), setups: numbers })
    }

    /// Part and slide of traces as they are; the reversed setup sees this share of the part's deviation.
    /// Positions are given, or found as a run does.
    pub(crate) fn straightness(
        &self,
        points: &Points,
        traces: &Traces,
        cosine: f64,
        on: Option<&[f64]>,
        correlated: Option<&TraceErrors>,
    ) -> Result<(Straightness, Split)> {
        let all: Vec<&AxialTrace> = traces.all.iter().collect();
        let range = common_range(&points.input, &all)?;
        let z_mm = match on {
            Some(z_mm) => z_mm.to_vec(),
            None => positions(self.0.step_mm, &points.input, &all, range)?,
        };
        let mut grid = grid(&z_mm, None, &traces.setups, &traces.all, cosine);
        if grid.z_mm.len() < 3 {
            let problem = "a setup has no readings at nearly all positions: its traces have gaps there";
            return Err(
                Error::new("separate", points.input.display().to_string(), problem).of(ErrorKind::InsufficientData)
            );
        }
        grid.smooth = self.0.slide_cutoff_mm.map(|cutoff| smooth(&grid.z_mm, cutoff));
        let split = grid.split(&rows(&grid, &traces.all));
        let counts = [0, 1].map(|setup| traces.setups.iter().filter(|own| **own == setup).count());
        let mut warnings = self.warnings(points, &all, range, &z_mm, counts);
        if grid.z_mm.len() < z_mm.len() {
            let lacking = z_mm.len() - grid.z_mm.len();
            warnings.push(format!("{lacking} of {} positions are left out: a setup has no readings there", z_mm.len()));
        }
        let repeated = split.variance.iter().sum::<f64>() / split.variance.len() as f64;
        let repeatability_um = repeated.sqrt();
        if counts != [1, 1] && repeatability_um > ROUNDING_UM && repeatability_um < FINEST_UM {
            warnings.push(format!(
                "repeated traces differ by {} nm: no displacement sensor repeats so well; `reading_um` may be in mm, or traces are copies \
                 of one",
                significant(1e3 * repeatability_um, 2)
            ));
        }
        let errors = match correlated {
            Some(errors) => grid.correlated(&split, errors),
            None => grid.scattered(&split, (counts[0] + counts[1] - 2) as f64),
        };
        let [part_std_um, slide_std_um] = errors.each_ref().map(ProfileErrors::std_um);
        let result = Straightness {
            errors,
            z_mm: grid.z_mm.clone(),
            part_um: split.part_um.clone(),
            slide_um: split.slide_um.clone(),
            part_std_um,
            slide_std_um,
            repeatability_um: if counts == [1, 1] { f64::NAN } else { repeatability_um },
            degrees_of_freedom: counts[0] + counts[1] - 2,
            checks: Vec::new(),
            warnings,
        };
        Ok((result, split))
    }
}

impl AxialReversal {
    fn warnings(
        &self,
        points: &Points,
        all: &[&AxialTrace],
        range: [f64; 2],
        z_mm: &[f64],
        counts: [usize; 2],
    ) -> Vec<String> {
        let [initial, reversed] = [&self.0.initial, &self.0.reversed];
        let mut warnings = Vec::new();
        let others = points.traces.iter().filter(|trace| ![initial, reversed].contains(&&trace.kind));
        let others: Vec<String> = others.map(|trace| format!("{} ({})", trace.id, trace.kind)).collect();
        if !others.is_empty() {
            warnings.push(format!("traces of other setups are left out: {}", others.join(", ")));
        }
        let beyond = all.iter().filter(|trace| trace.beyond(range) > 0);
        let beyond: Vec<String> =
            beyond.map(|trace| format!("{} {} of {}", trace.id, trace.beyond(range), trace.z_mm.len())).collect();
        if !beyond.is_empty() {
            let [first, last] = range;
            let left_out = beyond.join(", ");
            warnings.push(format!(
                "all traces share z = {} to {} mm; points beyond it left out: {left_out}",
                said(first),
                said(last)
            ));
        }
        let own = |trace: &&AxialTrace| z_mm.iter().all(|at| trace.z_mm.binary_search_by(|z| z.total_cmp(at)).is_ok());
        if let (false, [first, second, ..], Some(end)) = (all.iter().all(own), z_mm, z_mm.last()) {
            let step = second - first;
            let finer = if step < FINER * coarsest_mm(all) { ", closer than the traces' own" } else { "" };
            let rest = range[1] - end;
            let rest =
                if rest > 1e-6 * step { format!("; the last {} mm hold none", said(rest)) } else { String::new() };
            warnings
                .push(format!("readings are interpolated (cubic) on positions {} mm apart{finer}{rest}", said(step)));
        }
        let mean_step = (range[1] - range[0]) / (z_mm.len().max(2) - 1) as f64;
        for trace in all {
            let gaps = trace.gaps(range, mean_step);
            warnings.extend(gaps.into_iter().map(|[from, to]| {
                let (from, to) = (said(from), said(to));
                format!("trace {} has no points from {from} to {to} mm: it is left out there", trace.id)
            }));
        }
        let flagged = all.iter().filter(|trace| trace.flagged > 0);
        let flagged: Vec<String> = flagged.map(|trace| format!("{} {}", trace.id, trace.flagged)).collect();
        if !flagged.is_empty() {
            warnings.push(format!("points left out by their flag: {}", flagged.join(", ")));
        }
        warnings.push(match counts {
            [1, 1] if self.0.slide_cutoff_mm.is_some() => {
                "one trace in each setup: uncertainty is the difference of both at waves that the slide does not have"
                    .into()
            }
            [1, 1] => "one trace in each setup: the uncertainty is not known; repeat each at least once".into(),
            [first, second] => {
                let dof = first + second - 2;
                let single = match (first, second) {
                    (1, _) => format!("; the one trace of {initial} is taken to scatter like those of {reversed}"),
                    (_, 1) => format!("; the one trace of {reversed} is taken to scatter like those of {initial}"),
                    _ => String::new(),
                };
                format!(
                    "uncertainty is the scatter of {first} and {second} aligned traces, {dof} degrees of freedom a \
                     position{single}; it does not include what the traces of a setup share"
                )
            }
        });
        warnings
    }
}

/// The traces of a setup.
fn traces_of(points: &Points, setup: &str) -> Result<Vec<AxialTrace>> {
    let of_it = points.traces.iter().filter(|trace| trace.kind == setup);
    let traces: Vec<AxialTrace> = of_it.map(|trace| AxialTrace::of(points, trace)).collect::<Result<_>>()?;
    if traces.is_empty() {
        let mut known: Vec<&str> = points.traces.iter().map(|trace| trace.kind.as_str()).collect();
        known.sort_unstable();
        known.dedup();
        let problem = format!("{} has no trace of setup `{setup}`", points.input.display());
        return Err(Error::new("separate", "part and slide", problem).help(known_names(setup, known)));
    }
    Ok(traces)
}
