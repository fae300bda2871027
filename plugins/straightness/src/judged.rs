//! What the traces say of themselves: their contrasts, and each beside the others.

use runout_core::{
    closed_loop::{Setting, tested::Tested},
    consistency::{Check, Kind, LinearFit, Structure, Test, check::FINDING, judge},
    numerics::{least_squares::Basis, statistics::f_tail},
};

use crate::{contrasts::TraceErrors, model::TracesFit, straightness::Straightness, trace::AxialTrace};

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
            if tested.models.is_none() {
                tested.checks.extend(self.of_traces());
            }
            tested
        })
    }

    /// Traces of independent errors against each other, and their single readings.
    fn of_traces(&self) -> Vec<Check> {
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

    /// Errors of one trace, where they depend on each other along z.
    pub(crate) fn trace_errors(&self) -> Option<TraceErrors> {
        self.judged().models.as_ref().map(|models| self.contrasts.trace_errors(models))
    }
}
