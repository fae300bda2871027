//! Values with the declared model and with the final one, computed by what computes those of a run.

use runout_closed_loop::diagnosis::Moved;
use runout_evaluate::{Evaluate, EvaluatedStation, section_values};

/// RONt, as a run's first one of a section, and the root mean square of form, of every section of a station. `looked_at` gives
/// that RONt alone; the names of sections get the station's where there are `several`.
pub(super) fn moved(
    before: &EvaluatedStation,
    after: &EvaluatedStation,
    looked_at: &Evaluate,
    radius_mm: f64,
    several: bool,
) -> Vec<Moved> {
    let mut moved = Vec::new();
    for (section, at) in after.result.separation.sections.iter().enumerate() {
        let place = if several { format!("{}@{}", at.id, after.result.station) } else { at.id.clone() };
        let of = |value: &str, before, after, std: f64| Moved {
            value: value.into(),
            section: Some(place.clone()),
            before,
            after,
            std: std.is_finite().then_some(std),
            unit: "um".into(),
            reference: None,
            filter: None,
            lost_orders: Vec::new(),
        };
        let evaluated;
        let found = if let Some(found) = after.ront(section) {
            Some(found)
        } else {
            // The pipeline asks for no roundness.
            evaluated = section_values(&after.result, section, looked_at, radius_mm);
            evaluated.first()
        };
        let lost = found.map_or_else(Vec::new, |value| value.lost_orders.clone());
        if let (Some(declared), Some(value)) = (before.ront(section), found) {
            let std = value.uncertainty.as_ref().map_or(f64::NAN, |uncertainty| uncertainty.std);
            moved.push(Moved {
                reference: value.reference.clone(),
                filter: value.filter.clone(),
                lost_orders: lost.clone(),
                ..of(&value.symbol, declared.value, value.value, std)
            });
        }
        if let (Some((declared_um, _)), Some((rms_um, std_um))) =
            (before.result.form_rms_um(section), after.result.form_rms_um(section))
        {
            moved.push(Moved { lost_orders: lost, ..of("form rms", declared_um, rms_um, std_um) });
        }
    }
    moved
}
