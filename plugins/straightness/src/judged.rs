//! What the traces say of themselves: their contrasts, and each beside the others.

use runout_core::{
    closed_loop::{Setting, tested::Tested},
    consistency::{Check, Kind, LinearFit, Structure, Test, check::FINDING, judge},
    numerics::{
        least_squares::{Basis, dot},
        number::significant,
        statistics::f_tail,
    },
};

use crate::{contrasts::TraceErrors, model::TracesFit, straightness::Straightness, trace::AxialTrace};

/// Share of a trace's mean square that the others have at least: theirs is a difference of nearly equal numbers beside a much larger one.
const LEAST_OF_OTHERS: f64 = 1e-3;

/// Says that the setups, of these names, read the same: nothing shows the slide. `None` where something does, and where the noise is not known.
pub(crate) fn not_reversed(found: &Straightness, [initial, reversed]: [&str; 2]) -> Option<String> {
    let power = |values: &[f64]| values.iter().map(|value| value * value).sum::<f64>();
    // Of each profile the line is taken out.
    let places = found.slide_um.len() as f64 - 2.0;
    let ratio = power(&found.slide_um) / power(&found.slide_std_um);
    let below = found.degrees_of_freedom as f64 * places;
    (found.degrees_of_freedom > 0 && f_tail(ratio, places, below) > FINDING).then(|| {
        format!(
            "the setups `{initial}` and `{reversed}` read the same within their noise: nothing shows a slide. If the part was not turned or the probe not \
             reversed, or traces have the wrong sign, what is called part is part and slide together"
        )
    })
}

impl TracesFit {
    /// What the tests of contrasts and of traces say.
    pub(crate) fn judged(&self) -> &Tested {
        self.judged.get_or_init(|| {
            let scale = self.design.data.std_um.unwrap_or(1.0);
            let known = &self.design.data.known;
            let free: Vec<&Setting> = self.applied.iter().filter(|setting| !known.contains(&setting.effect)).collect();
            let mut tested = Tested::of(self, &free, &self.design.data.effects, scale, "µm");
            // Single readings are named in their traces.
            tested.checks.retain(|check| check.test != Test::Rows);
            let of_traces = self.of_traces(tested.models.is_some());
            tested.checks.extend(of_traces);
            tested
        })
    }

    /// Traces against each other, and their single readings where their errors are independent.
    fn of_traces(&self, is_correlated: bool) -> Vec<Check> {
        let data = &self.design.data;
        let left = self.design.left_by_splines().map(f64::sqrt);
        let scale = data.std_um.unwrap_or(1.0);
        let of = |((trace, _), value): (&(usize, usize), &f64)| scale * value / left[data.setups[*trace]];
        let mut residual: Vec<f64> = self.design.readings.of.iter().zip(&self.remainder.residual).map(of).collect();
        if residual.iter().any(|value| !value.is_finite()) {
            return Vec::new();
        }
        let lines = Basis::of(self.design.lines());
        lines.remove_from(&mut residual);
        if is_correlated {
            return self.unlike(&residual).into_iter().collect();
        }
        let traces = self.design.readings.of.iter().map(|(trace, _)| *trace).collect();
        let names = data.traces.iter().map(|trace| format!("trace {}", trace.id)).collect();
        let row = |(trace, point): &(usize, usize)| {
            let AxialTrace { id, z_mm, .. } = &data.traces[*trace];
            format!("the reading of {id} at z = {:.3} mm", z_mm[*point])
        };
        let structure = Structure::default()
            .divided("traces", Kind::Alike, traces, names)
            .naming(self.design.readings.of.iter().map(row).collect());
        let fit = LinearFit {
            residual: &residual,
            basis: lines.columns(),
            names: &[],
            weights: &[],
            noise: None,
            unit: "µm",
        };
        judge(fit, &structure).checks
    }

    /// The trace that is least like the others of its setup, whose scatter is that without it. Of its readings so many are independent as its own
    /// correlation along z leaves. `residual` has the variance of single readings.
    fn unlike(&self, residual: &[f64]) -> Option<Check> {
        let data = &self.design.data;
        let traces: Vec<Vec<f64>> = (0..data.traces.len())
            .map(|trace| {
                let own = self.design.readings.of.iter().zip(residual).filter(|((of, _), _)| *of == trace);
                own.map(|(_, value)| *value).collect()
            })
            .collect();
        let size = |setup: usize| data.setups.iter().filter(|of| **of == setup).count() as f64;
        let squares: Vec<f64> = traces.iter().map(|trace| dot(trace, trace) / trace.len().max(1) as f64).collect();
        let all: f64 =
            squares.iter().zip(&data.setups).map(|(square, setup)| square * (1.0 - 1.0 / size(*setup))).sum();
        let others = [0, 1].iter().map(|setup| (size(*setup) - 1.0).max(0.0)).sum::<f64>() - 1.0;
        let judged = (0..traces.len()).filter(|trace| size(data.setups[*trace]) > 2.0).map(|trace| {
            let ratio = squares[trace] * others / (all - squares[trace]).max(LEAST_OF_OTHERS * squares[trace]);
            let independent = (traces[trace].len() as f64 - 2.0) * independent_share(&traces[trace]);
            let dof = [independent, others * independent];
            (trace, ratio, dof, (f_tail(ratio, dof[0], dof[1]) * traces.len() as f64).min(1.0))
        });
        let (trace, ratio, dof, p) = judged.min_by(|one, other| one.3.total_cmp(&other.3))?;
        let name = format!("trace {}", data.traces[trace].id);
        Some(Check::new(Test::Alike, &name, ratio, &dof, p).finding(|| {
            let times = significant(ratio.sqrt(), 2);
            format!("{name} is off the others of its setup by {times} times what these are off each other: look at its sign, its setup and the direction of z")
        }))
    }

    /// Errors of one trace, where they depend on each other along z.
    pub(crate) fn trace_errors(&self) -> Option<TraceErrors> {
        self.judged().models.as_ref().map(|models| self.contrasts.trace_errors(models))
    }
}

/// Share of the readings of a series that is independent, for its variance: 1/Σρ² over the lags to half of it, of its own autocorrelation.
fn independent_share(series: &[f64]) -> f64 {
    let power = dot(series, series);
    let correlation = |lag: usize| dot(&series[lag..], &series[..series.len() - lag]) / power;
    let squares: f64 = (1..series.len() / 2).map(|lag| correlation(lag).powi(2)).sum();
    if power > 0.0 { 1.0 / (1.0 + 2.0 * squares) } else { 1.0 }
}
