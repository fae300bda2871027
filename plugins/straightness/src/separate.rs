//! The separator `axial-reversal`.

use runout_core::{
    Error, Result,
    evaluate::straightness::about_lsli_um,
    pipeline::{
        error::{Fault, known_names},
        registry::{Context, StageConfig},
    },
    points::Points,
    stage::{Separator, TraceSeparator},
    straightness::Straightness,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{interpolate::cubic, trace::AxialTrace};

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
    /// Without it: the traces' own positions where they are the same in all, else the median spacing of the coarsest
    /// trace.
    #[serde(default)]
    pub step_mm: Option<f64>,
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
        Ok(Separator::Traces(Box::new(self.separator()?)))
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
        match self.step_mm {
            Some(step) if !(step.is_finite() && step > 0.0) => {
                Err(Fault::at("step_mm", format!("the step must be above 0 mm, found {step}")))
            }
            _ => Ok(AxialReversal(self)),
        }
    }
}

/// Sum and difference of the two setups' mean traces: u₁ = part + slide and u₂ = part − slide, each trace with an
/// offset and a slope of its own (straightedge reversal: C. J. Evans, R. J. Hocken, W. T. Estler, "Self-calibration:
/// reversal, redundancy, error separation, and 'absolute testing'", CIRP Annals 45(2), 617-634 (1996)).
///
/// 1. Every trace is interpolated on common positions, within the range that all of them cover.
/// 2. Its least-squares line there is removed: with common positions that is the joint least-squares alignment of all
///    traces.
/// 3. With the mean m of each setup, part = (m₁ + m₂)/2 and slide = (m₁ − m₂)/2.
/// 4. With k₁ and k₂ traces, the scatter s² about the setups' means, pooled at each position over k₁ + k₂ − 2 degrees
///    of freedom, gives both the variance s²(1/k₁ + 1/k₂)/4.
#[derive(Debug, Clone)]
pub struct AxialReversal(AxialReversalConfig);

/// More positions would be a mistaken step.
const MOST_POSITIONS: f64 = 1e6;
/// Two positions have no deviation from a line.
const FEWEST_POSITIONS: usize = 3;
/// A gap is wider than this many steps and spacings.
const GAP: f64 = 3.0;

impl TraceSeparator for AxialReversal {
    fn separate(&self, points: &Points) -> Result<Straightness> {
        let setups = [traces_of(points, &self.0.initial)?, traces_of(points, &self.0.reversed)?];
        let all: Vec<&AxialTrace> = setups.iter().flatten().collect();
        let range = common_range(points, &all)?;
        let z_mm = self.positions(points, &all, range)?;
        let aligned = setups.each_ref().map(|traces| -> Vec<Vec<f64>> {
            let on_positions = |trace: &AxialTrace| -> Vec<f64> {
                z_mm.iter().map(|at| cubic(&trace.z_mm, &trace.reading_um, *at)).collect()
            };
            traces.iter().map(|trace| about_lsli_um(&z_mm, &on_positions(trace))).collect()
        });
        let means = aligned.each_ref().map(|traces| mean(traces, z_mm.len()));
        let combined = |sign: f64| -> Vec<f64> {
            means[0].iter().zip(&means[1]).map(|(initial, reversed)| 0.5 * (initial + sign * reversed)).collect()
        };
        let counts = aligned.each_ref().map(Vec::len);
        let degrees_of_freedom = counts[0] + counts[1] - 2;
        let variance: Vec<f64> = (0..z_mm.len())
            .map(|at| {
                let about = |(traces, mean): (&Vec<Vec<f64>>, &Vec<f64>)| -> f64 {
                    traces.iter().map(|trace| (trace[at] - mean[at]).powi(2)).sum()
                };
                // 0/0 is NaN: no repeats, no scatter.
                aligned.iter().zip(&means).map(about).sum::<f64>() / degrees_of_freedom as f64
            })
            .collect();
        let share = 0.25 * counts.map(|count| (count as f64).recip()).iter().sum::<f64>();
        let std_um: Vec<f64> = variance.iter().map(|variance| (share * variance).sqrt()).collect();
        Ok(Straightness {
            part_um: combined(1.0),
            slide_um: combined(-1.0),
            part_std_um: std_um.clone(),
            slide_std_um: std_um,
            repeatability_um: (variance.iter().sum::<f64>() / variance.len() as f64).sqrt(),
            degrees_of_freedom,
            warnings: self.warnings(points, &all, range, &z_mm, counts),
            z_mm,
        })
    }
}

impl AxialReversal {
    /// Where straightness is given.
    fn positions(&self, points: &Points, all: &[&AxialTrace], range: [f64; 2]) -> Result<Vec<f64>> {
        let [first, last] = range;
        let z_mm = match (self.0.step_mm, all) {
            (None, [one, others @ ..]) if others.iter().all(|other| other.z_mm == one.z_mm) => one.z_mm.clone(),
            (step, _) => {
                let step = step.unwrap_or_else(|| coarsest_mm(all));
                // The last position is there although its own rounding may put it beyond.
                let steps = ((last - first) / step + 1e-6).floor();
                if steps > MOST_POSITIONS {
                    let problem = format!("a step of {step} mm makes {steps:.0} positions of {:.3} mm", last - first);
                    return Err(Error::new("separate", points.input.display().to_string(), problem)
                        .help("set a larger `step_mm` in [separate]"));
                }
                (0..=steps as usize).map(|index| (first + step * index as f64).min(last)).collect()
            }
        };
        if z_mm.len() < FEWEST_POSITIONS {
            let problem = format!(
                "all traces share z = {first} to {last} mm: {} positions, and {FEWEST_POSITIONS} are needed",
                z_mm.len()
            );
            return Err(Error::new("separate", points.input.display().to_string(), problem)
                .help("measure a longer common range, or set a smaller `step_mm` in [separate]"));
        }
        Ok(z_mm)
    }

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
            warnings.push(format!("all traces share z = {first} to {last} mm; points beyond it left out: {left_out}"));
        }
        let interpolated =
            all.iter().any(|trace| z_mm.iter().any(|at| trace.z_mm.binary_search_by(|z| z.total_cmp(at)).is_err()));
        if let (true, [first, second, ..]) = (interpolated, z_mm) {
            let (step, coarsest) = (second - first, coarsest_mm(all));
            let finer = if step < 0.999 * coarsest { ", finer than the traces': nothing is added between" } else { "" };
            warnings.push(format!("readings are interpolated (cubic) on positions {step:.6} mm apart{finer}"));
            warnings.extend(all.iter().flat_map(|trace| gaps(trace, range, step)));
        }
        warnings.push(match counts {
            [1, 1] => "one trace in each setup: nothing tells the uncertainty; repeat each at least once".into(),
            [first, second] => {
                let dof = first + second - 2;
                let single = match (first, second) {
                    (1, _) => format!("; the one trace of {initial} is taken to scatter like those of {reversed}"),
                    (_, 1) => format!("; the one trace of {reversed} is taken to scatter like those of {initial}"),
                    _ => String::new(),
                };
                format!(
                    "uncertainty is the scatter of {first} and {second} aligned traces, {dof} degrees of freedom a \
                     position{single}; it holds nothing that the traces of a setup share"
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

/// The range that all traces cover.
fn common_range(points: &Points, all: &[&AxialTrace]) -> Result<[f64; 2]> {
    let start = |trace: &&&AxialTrace| trace.range_mm()[0];
    let end = |trace: &&&AxialTrace| trace.range_mm()[1];
    let latest = all.iter().max_by(|a, b| start(a).total_cmp(&start(b)));
    let earliest = all.iter().min_by(|a, b| end(a).total_cmp(&end(b)));
    match (latest, earliest) {
        (Some(latest), Some(earliest)) if start(&latest) < end(&earliest) => Ok([start(&latest), end(&earliest)]),
        (Some(latest), Some(earliest)) => {
            let (begins, ends) = (start(&latest), end(&earliest));
            let problem =
                format!("trace {} begins at {begins} mm, where {} has ended ({ends} mm)", latest.id, earliest.id);
            Err(Error::new("separate", points.input.display().to_string(), problem)
                .help("all traces have to share a range of z, in the part's own coordinate"))
        }
        _ => Err(Error::new("separate", points.input.display().to_string(), "it holds no traces")),
    }
}

/// Largest of the traces' median spacings, in mm.
fn coarsest_mm(all: &[&AxialTrace]) -> f64 {
    all.iter().map(|trace| trace.spacing_mm()).fold(0.0, f64::max)
}

/// Where a trace has no points for long.
fn gaps(trace: &AxialTrace, [first, last]: [f64; 2], step_mm: f64) -> Vec<String> {
    let wide = GAP * step_mm.max(trace.spacing_mm());
    let within = |pair: &&[f64]| pair[1] > first && pair[0] < last && pair[1] - pair[0] > wide;
    let said = |pair: &[f64]| {
        format!("trace {} has no points from {} to {} mm: a straight line stands there", trace.id, pair[0], pair[1])
    };
    trace.z_mm.windows(2).filter(within).map(said).collect()
}

fn mean(traces: &[Vec<f64>], positions: usize) -> Vec<f64> {
    let at = |position: usize| traces.iter().map(|trace| trace[position]).sum::<f64>() / traces.len() as f64;
    (0..positions).map(at).collect()
}
