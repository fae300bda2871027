//! What a file says of itself: conventions, what it leaves out, and the error that is expected after it.

use runout_core::{stage::Completed, summary::Value};

use crate::{
    chain::{Chain, free_rms_um},
    config::ControllerConfig,
    dialects::Dialect,
};

/// Lines of the header, without marks of a comment.
pub(crate) fn header(
    config: &ControllerConfig,
    dialect: &dyn Dialect,
    whole: &Chain,
    kept: &Chain,
    notes: Vec<String>,
    result: &Completed,
) -> Vec<String> {
    let summary = result.summary;
    let mut lines = vec![
        format!("{}: {}", config.dialect.name(), summary.title),
        format!(
            "{}, not tried on a real control: check the sign with one axis at low speed",
            summary.provenance.program
        ),
    ];
    lines.extend(notes);
    let (all, held) = (whole.errors(), kept.errors());
    let left: Vec<&str> = all.iter().filter(|symbol| !held.contains(symbol)).map(String::as_str).collect();
    if !left.is_empty() {
        lines.push(format!("left out: {}", left.join(" ")));
    }
    if !whole.unknown.is_empty() {
        lines.push(format!("not observable, 0 here: {}", whole.unknown.join(" ")));
    }
    lines.extend(expected(dialect, whole, kept, result));
    lines
}

/// Root mean square error over the volume of the linear axes, before and after this file.
fn expected(dialect: &dyn Dialect, whole: &Chain, kept: &Chain, result: &Completed) -> Option<String> {
    if whole.axes.iter().filter(|axis| !axis.rotary).count() < 3 {
        return None;
    }
    let places = whole.places_mm();
    let before: Vec<[f64; 3]> = places.iter().map(|place| whole.error_um(*place)).collect();
    let left: Vec<[f64; 3]> = places
        .iter()
        .zip(&before)
        .map(|(place, error)| {
            let adds = dialect.adds_um(kept, *place);
            [0, 1, 2].map(|axis| error[axis] + adds[axis])
        })
        .collect();
    let other = result.summary.values.iter().find(|value| value.symbol == "volumetric_rms_after");
    let other_um = other.and_then(Value::number).unwrap_or(0.0);
    let [before, after] = [before, left].map(|errors| free_rms_um(&places, &errors).hypot(other_um));
    Some(format!(
        "expected rms error over the volume, less the rigid motion that fits best: before {before:.3} um, after {after:.3} um; \
         {other_um:.3} um of both is not known, or no axis takes it away"
    ))
}
