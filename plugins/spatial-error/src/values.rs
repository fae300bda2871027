//! Values of a result: the trend, each component's covariance, and the error before and after compensation.

use runout_core::{
    consistency::{Check, Test, refuted_by},
    summary::Value,
};

use crate::{
    campaign::COMPONENTS,
    checks::factors,
    conclusion::{At, Conclusion},
    curves::ComponentFit,
    joint::LeftOut,
    likelihood::PARAMETERS,
    noise::Noise,
    solve::Solution,
    terms::Term,
};

impl Conclusion<'_> {
    pub(crate) fn values(&self, queries: &[At], left_out: &[[LeftOut; 3]], checks: &[Check]) -> Vec<Value> {
        let mut values = self.of_trend();
        for (axis, component) in COMPONENTS.into_iter().enumerate() {
            // A nugget above the noise refutes no number: it is one of them.
            let is_own = |check: &&Check| {
                check.test != Test::Residual && (check.part == component || check.of.starts_with(component))
            };
            let refuted = refuted_by(&checks.iter().filter(is_own).cloned().collect::<Vec<_>>());
            values.extend(self.of_covariance(axis).into_iter().map(|value| value.refuted_by(refuted.clone())));
            values.extend(of_left_out(axis, left_out));
        }
        values.extend(self.of_compensation(queries, factors(checks)));
        values
    }

    fn of_trend(&self) -> Vec<Value> {
        let solution = self.solution;
        let mut values = Vec::new();
        let trend_std = solution.trend_std(self.campaign);
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
            values.push(Value::new(symbol, number, std, wanted.unit(), about));
        }
        for (id, target, term) in self.names {
            let [number, std] = fitted(*term);
            values.push(Value::new(id, number, std, term.unit(), "effect that was added").of(target));
        }
        values
    }

    /// Covariance and noise of a component; null where it was not measured.
    fn of_covariance(&self, axis: usize) -> Vec<Value> {
        let (campaign, solution) = (self.campaign, self.solution);
        let field = solution.measured.iter().position(|measured| *measured == axis);
        // d(exp θ) = exp θ · dθ.
        let relative_std = |parameter: usize| match (&solution.estimate, field) {
            (Some(estimate), Some(field)) => {
                let index = field * PARAMETERS + parameter;
                estimate.covariance[(index, index)].sqrt()
            }
            _ => f64::NAN,
        };
        let covariance = field.map(|field| &solution.covariances[field]);
        let mut values = Vec::new();
        let mut add = |symbol: &str, number: f64, std: f64, unit: &str, about: &str| {
            values.push(Value::new(symbol, number, std, unit, about).of(COMPONENTS[axis]).not_negative());
        };
        let sill = covariance.map_or(f64::NAN, |covariance| covariance.sill_um);
        add("sill", sill, sill * relative_std(0), "um", "standard deviation of the field");
        for (direction, letter) in ["x", "y", "z"].into_iter().enumerate() {
            let seen = campaign.volume.half_mm[direction] > 0.0 || solution.estimate.is_none();
            let range = covariance.filter(|_| seen).map_or(f64::NAN, |covariance| covariance.range_mm[direction]);
            let std = range * relative_std(1 + direction);
            add(&format!("range_{letter}"), range, std, "mm", "range of the covariance along the axis");
        }
        let nugget = covariance.map_or(f64::NAN, |covariance| covariance.nugget_um);
        let about = if Solution::nugget_counts(campaign) {
            "standard deviation from place to place beyond noise"
        } else {
            "standard deviation from place to place, noise included"
        };
        add("nugget", nugget, nugget * relative_std(4), "um", about);
        let noise = field.map_or(f64::NAN, |_| campaign.noise_um(axis));
        let of_noise = match &campaign.noise {
            Noise::Repeats { dof, .. } => noise / (2.0 * *dof as f64).sqrt(),
            _ => f64::NAN,
        };
        add("noise", noise, of_noise, "um", "standard uncertainty of one reading");
        values
    }
}

fn of_left_out(axis: usize, left_out: &[[LeftOut; 3]]) -> [Value; 2] {
    let each = || left_out.iter().map(|place| place[axis]).filter(|one| one.std_um.is_finite());
    let count = each().count() as f64;
    let rms = (each().map(|one| one.residual_um.powi(2)).sum::<f64>() / count).sqrt();
    let chi2 = each().map(|one| (one.residual_um / one.std_um).powi(2)).sum::<f64>() / count;
    let value = |symbol: &str, number: f64, unit: &str, about: &str| {
        Value::new(symbol, number, f64::NAN, unit, about).of(COMPONENTS[axis])
    };
    [
        value("left_out_rms", rms, "um", "root mean square of what the other places do not predict"),
        value("left_out_chi2", chi2, "", "mean square of the same in its standard deviations"),
    ]
}

/// Squareness errors, and the error over the measured volume before and after compensation by the curves.
pub(crate) fn of_curves(found: &ComponentFit) -> Vec<Value> {
    let of_location = found.location.iter().map(|error| {
        let about = "squareness error between the least-squares lines of two axes (ISO 230-1)";
        Value::new(&error.symbol, error.value, error.std, "urad", about)
    });
    let volumetric = [
        (
            "volumetric_rms",
            found.volumetric.before,
            "root mean square length of the error over the measured volume, less the rigid motion that fits best",
        ),
        (
            "volumetric_rms_after",
            found.volumetric.after,
            "the same expected after compensation by the component curves: what no axis can take away, and what is not known",
        ),
        (
            "volumetric_rms_beyond_axes",
            found.volumetric.beyond,
            "of these what no axis can take away: no chain of rigid bodies has this error",
        ),
    ];
    let volumetric = volumetric
        .into_iter()
        .map(|(symbol, [value, std], about)| Value::new(symbol, value, std, "um", about).not_negative().key());
    of_location.chain(volumetric).collect()
}
