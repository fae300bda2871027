//! Facts of the part and the measurement.

use maud::{Markup, html};
use runout_core::{
    numerics::number::{ranges, rounded_place, significant},
    rig::Rig,
    summary::Summary,
    surface::Surface,
};

/// Facts of the part and the measurement, where there are any.
pub(crate) fn list(summary: &Summary, rig: Option<&Rig>, surface: Option<&Surface>) -> Option<Markup> {
    let captures = || summary.stations.iter().flat_map(|station| &station.captures);
    let turns = [captures().map(|one| one.turns_used).sum::<usize>(), captures().map(|one| one.turns_recorded).sum()];
    let speeds: Vec<f64> = captures().filter_map(|capture| capture.speed_rpm).collect();
    let places =
        summary.stations.iter().flat_map(|station| &station.sections).map(|section| rounded_place(section.z_mm));
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    let lost = &summary.lost_orders;
    let mut facts: Vec<(String, String)> = Vec::new();
    let mut add = |name: &str, value: String| facts.push((name.to_owned(), value));
    if let Some(rig) = rig {
        add("Part radius", format!("{} mm", rig.part_radius_mm));
        add("Sensors, setups", format!("{}, {}", rig.sensors.len(), rig.setups.len()));
    }
    if !summary.stations.is_empty() {
        add(if rig.is_some() { "Stations" } else { "Sections" }, summary.stations.len().to_string());
    }
    if high > low {
        add("Sections along z", format!("{} to {} mm", place(low), place(high)));
    }
    if turns[1] > 0 {
        add("Turns used", format!("{} of {}", turns[0], turns[1]));
    }
    if !speeds.is_empty() {
        let mean = speeds.iter().sum::<f64>() / speeds.len() as f64;
        add("Mean speed", format!("{} rpm", significant(mean, 4)));
    }
    if let Some(surface) = surface {
        add("Surface", format!("{} angles × {} rings", surface.angles, surface.z_mm.len()));
    }
    if rig.is_some() || !lost.form.is_empty() || !lost.motion.is_empty() {
        add("Lost orders of form", ranges(&lost.form));
        add("Lost orders of motion", ranges(&lost.motion));
    }
    for (quantity, orders) in &lost.others {
        add(&format!("Lost orders of {quantity}"), ranges(orders));
    }
    (!facts.is_empty()).then(|| {
        html! { dl.facts { @for (name, value) in &facts { div { dt { (name) } dd { bdi { (value) } } } } } }
    })
}

/// A place with six digits at most.
fn place(mm: f64) -> String {
    let shown = significant(mm, 6);
    if shown.contains('.') { shown.trim_end_matches('0').trim_end_matches('.').to_owned() } else { shown }
}
