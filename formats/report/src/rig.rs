//! The rig as a drawing: sensors around the part, setup by setup, and sections along the axis.

use maud::{Markup, html};
use runout_core::rig::{Rig, RigConfig, Rotation};
use serde::Deserialize;

/// The part of a pipeline's configuration that is drawn.
#[derive(Deserialize)]
struct Configuration {
    rig: Option<RigConfig>,
}

/// The rig that a configuration declares, where it declares one.
pub(crate) fn declared(configuration: &str) -> Option<Rig> {
    toml::from_str::<Configuration>(configuration).ok()?.rig?.check().ok()
}

/// Radius of the part in the drawing.
const PART: f64 = 52.0;
/// Distance of the middle from the drawing's edges.
const MIDDLE: f64 = 120.0;
/// Distance of a sensor's name from the middle.
const NAMES: f64 = 100.0;
/// Setups that are drawn; further ones are like them.
const MOST_SETUPS: usize = 6;

/// The rig, seen against +z, once a setup, and from the side.
pub(crate) fn drawing(rig: &Rig) -> Markup {
    html! {
        div.rig {
            @for (index, setup) in rig.setups.iter().take(MOST_SETUPS).enumerate() {
                figure {
                    figcaption {
                        "Setup " bdi { (setup.id) }
                        small {
                            "part turned by " (degrees(setup.part_rad)) ", sensors by " (degrees(setup.sensors_rad))
                        }
                    }
                    (around(rig, index))
                }
            }
            figure {
                figcaption { "Along the axis" small { "z of the sensors, before the station's position is added" } }
                (along(rig))
            }
        }
        @if rig.setups.len() > MOST_SETUPS {
            p.note { (rig.setups.len() - MOST_SETUPS) " more setups are not drawn." }
        }
    }
}

/// One setup: the part with its mark, and the sensors that look across.
fn around(rig: &Rig, setup: usize) -> Markup {
    let (part_rad, sensors_rad) = (rig.setups[setup].part_rad, rig.setups[setup].sensors_rad);
    let at = |radius: f64, angle: f64| (MIDDLE + radius * angle.cos(), MIDDLE - radius * angle.sin());
    let turn = match rig.rotation {
        Rotation::Ccw => 1.0,
        Rotation::Cw => -1.0,
    };
    let (from, to) = (at(28.0, turn * 0.4), at(28.0, turn * 2.2));
    let sweep = u8::from(turn < 0.0);
    let mark = at(PART, part_rad);
    let inner = at(PART - 14.0, part_rad);
    html! {
        svg viewBox="0 0 240 240" role="img" aria-label=(format!("Sensors around the part in setup {}", rig.setups[setup].id)) {
            line.axis x1=(MIDDLE - 70.0) y1=(MIDDLE) x2=(MIDDLE + 70.0) y2=(MIDDLE) {}
            line.axis x1=(MIDDLE) y1=(MIDDLE - 70.0) x2=(MIDDLE) y2=(MIDDLE + 70.0) {}
            circle.part cx=(MIDDLE) cy=(MIDDLE) r=(PART) {}
            line.mark x1=(mark.0) y1=(mark.1) x2=(inner.0) y2=(inner.1) {}
            path.turn d=(format!("M{:.1} {:.1}A28 28 0 0 {sweep} {:.1} {:.1}", from.0, from.1, to.0, to.1)) {}
            circle.arrow cx=(to.0) cy=(to.1) r="3" {}
            @for (names, angle) in directions(rig, sensors_rad) {
                @let (tip, end) = (at(PART + 2.0, angle), at(PART + 26.0, angle));
                @let name = at(NAMES, angle);
                line.sensor x1=(tip.0) y1=(tip.1) x2=(end.0) y2=(end.1) {}
                circle.tip cx=(tip.0) cy=(tip.1) r="2.5" {}
                @for (line, text) in names.iter().enumerate() {
                    @let rise = 13.0 * (line as f64 - 0.5 * (names.len() - 1) as f64) + 4.0;
                    text x=(format!("{:.1}", name.0)) y=(format!("{:.1}", name.1 + rise)) text-anchor="middle" { (text) }
                }
            }
        }
    }
}

/// Sensors that look across, by their angle: names and the angle itself.
fn directions(rig: &Rig, sensors_rad: f64) -> Vec<(Vec<String>, f64)> {
    let mut all: Vec<(Vec<String>, f64)> = Vec::new();
    for sensor in rig.sensors.iter().filter(|sensor| sensor.axial_radius_mm.is_none()) {
        let angle = (sensor.angle_rad + sensors_rad).rem_euclid(std::f64::consts::TAU);
        let name = short(&sensor.id);
        match all.iter_mut().find(|(_, known)| (*known - angle).abs() < 1e-3) {
            Some((names, _)) => names.push(name),
            None => all.push((vec![name], angle)),
        }
    }
    for (names, angle) in &mut all {
        let joined = names.join(", ");
        *names = if joined.chars().count() <= 9 { vec![joined] } else { names.clone() };
        names.push(degrees(*angle));
    }
    all
}

/// The part from the side, with the sections of the sensors.
fn along(rig: &Rig) -> Markup {
    let places: Vec<f64> = rig.sensors.iter().map(|sensor| sensor.z_mm).collect();
    let (low, high) =
        places.iter().fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), z| (low.min(*z), high.max(*z)));
    let x = |z: f64| if high > low { 60.0 + 120.0 * (z - low) / (high - low) } else { MIDDLE };
    let mut sections: Vec<(f64, String, Vec<String>)> = Vec::new();
    for sensor in &rig.sensors {
        let section = rig.sections.get(sensor.section).map_or("", String::as_str);
        let known = sections.iter_mut().find(|(z, id, _)| (*z - sensor.z_mm).abs() < 1e-9 && id == section);
        match known {
            Some((.., sensors)) => sensors.push(short(&sensor.id)),
            None => sections.push((sensor.z_mm, section.to_owned(), vec![short(&sensor.id)])),
        }
    }
    html! {
        svg viewBox="0 0 240 240" role="img" aria-label="Sections along the axis" {
            rect.part x="30" y="90" width="180" height="60" rx="2" {}
            line.axis x1="15" y1=(MIDDLE) x2="225" y2=(MIDDLE) {}
            @for (index, (z, section, sensors)) in sections.iter().enumerate() {
                // Names of neighbours are on different levels.
                @let low = if index % 2 == 0 { 0.0 } else { 28.0 };
                line.section x1=(x(*z)) y1="84" x2=(x(*z)) y2="156" {}
                line.sensor x1=(x(*z)) y1=(60.0 - low) x2=(x(*z)) y2="88" {}
                text x=(x(*z)) y=(54.0 - low) text-anchor="middle" { (sensors.join(", ")) }
                text x=(x(*z)) y=(174.0 + low) text-anchor="middle" { "section " (short(section)) }
                text.small x=(x(*z)) y=(186.0 + low) text-anchor="middle" { "z " (z) " mm" }
            }
        }
    }
}

/// A name as long as there is room for.
fn short(name: &str) -> String {
    let name = crate::one_line(name);
    if name.chars().count() <= 10 { name } else { name.chars().take(9).chain(['…']).collect() }
}

fn degrees(radians: f64) -> String {
    let degrees = (1e3 * radians.to_degrees()).round() / 1e3;
    format!("{}°", if degrees == 0.0 { 0.0 } else { degrees })
}
