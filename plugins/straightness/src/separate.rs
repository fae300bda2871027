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

use crate::{
    interpolate::cubic,
    positions::{coarsest_mm, common_range, positions},
    trace::AxialTrace,
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

/// Positions closer than this share of the coarsest spacing are worth a word.
const FINER: f64 = 0.75;

impl TraceSeparator for AxialReversal {
    fn separate(&self, points: &Points) -> Result<Straightness> {
        let setups = [traces_of(points, &self.0.initial)?, traces_of(points, &self.0.reversed)?];
        let all: Vec<&AxialTrace> = setups.iter().flatten().collect();
        let range = common_range(&points.input, &all)?;
        let z_mm = positions(self.0.step_mm, &points.input, &all, range)?;
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
        let own = |trace: &&AxialTrace| z_mm.iter().all(|at| trace.z_mm.binary_search_by(|z| z.total_cmp(at)).is_ok());
        if let (false, [first, second, ..], Some(end)) = (all.iter().all(own), z_mm, z_mm.last()) {
            let step = second - first;
            let finer = if step < FINER * coarsest_mm(all) { ", closer than the traces' own" } else { "" };
            let rest = range[1] - end;
            let rest = if rest > 1e-6 * step { format!("; the last {rest:.4} mm hold none") } else { String::new() };
            warnings.push(format!("readings are interpolated (cubic) on positions {step:.4} mm apart{finer}{rest}"));
            warnings.extend(all.iter().flat_map(|trace| trace.gaps(range, step)));
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

fn mean(traces: &[Vec<f64>], positions: usize) -> Vec<f64> {
    let at = |position: usize| traces.iter().map(|trace| trace[position]).sum::<f64>() / traces.len() as f64;
    (0..positions).map(at).collect()
}
