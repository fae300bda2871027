//! Facts of the part and the measurement.

use maud::{Markup, html};
use runout_core::{
    rig::Rig,
    summary::Summary,
    surface::Surface,
    table::number::{ranges, rounded_place, significant},
};

/// Facts of the part and the measurement.
pub(crate) fn list(summary: &Summary, rig: Option<&Rig>, surface: Option<&Surface>) -> Markup {
    let captures = || summary.stations.iter().flat_map(|station| &station.captures);
    let turns = [captures().map(|one| one.turns_used).sum::<usize>(), captures().map(|one| one.turns_recorded).sum()];
    let speeds: Vec<f64> = captures().filter_map(|capture| capture.speed_rpm).collect();
    let speed = (!speeds.is_empty()).then(|| speeds.iter().sum::<f64>() / speeds.len() as f64);
    let places =
        summary.stations.iter().flat_map(|station| &station.sections).map(|section| rounded_place(section.z_mm));
    let (low, high) = places.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(z), high.max(z)));
    let lost = &summary.lost_orders;
    let has_orders = rig.is_some() || !lost.form.is_empty() || !lost.motion.is_empty();
    html! {
        dl.facts {
            @if let Some(rig) = rig {
                (fact("Part radius", &format!("{} mm", rig.part_radius_mm)))
                (fact("Sensors, setups", &format!("{}, {}", rig.sensors.len(), rig.setups.len())))
            }
            @if !summary.stations.is_empty() {
                (fact(if rig.is_some() { "Stations" } else { "Sections" }, &summary.stations.len().to_string()))
            }
            @if high > low { (fact("Sections along z", &format!("{low} to {high} mm"))) }
            @if turns[1] > 0 { (fact("Turns used", &format!("{} of {}", turns[0], turns[1]))) }
            @if let Some(speed) = speed { (fact("Mean speed", &format!("{} rpm", significant(speed, 4)))) }
            @if let Some(surface) = surface {
                (fact("Surface", &format!("{} angles × {} rings", surface.angles, surface.z_mm.len())))
            }
            @if has_orders {
                (fact("Lost orders of form", &ranges(&lost.form)))
                (fact("Lost orders of motion", &ranges(&lost.motion)))
            }
            @for (quantity, orders) in &lost.others { (fact(&format!("Lost orders of {quantity}"), &ranges(orders))) }
        }
    }
}

fn fact(name: &str, value: &str) -> Markup {
    html! { div { dt { (name) } dd { bdi { (value) } } } }
}
