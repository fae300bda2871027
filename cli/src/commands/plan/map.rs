//! Noise gain by order and layout, as a table to plot.

use std::{
    fmt::Write,
    ops::RangeInclusive,
    path::{Path, PathBuf},
};

use runout_core::{
    Error,
    atomic_file::{self, resolved},
    pipeline::document::Sources,
    rig::Rig,
};
use runout_spindle::plan::{Optimum, Suggestion};

use super::assess;
use crate::{
    failure::Failure,
    reports::plan::{degrees, form_gains, words},
};

/// Refuses a file that is no CSV or is read.
pub(super) fn refuse(path: Option<&Path>, sources: &Sources) -> Result<(), Failure> {
    let Some(path) = path else { return Ok(()) };
    if !path.extension().is_some_and(|extension| extension.eq_ignore_ascii_case("csv")) {
        let message = format!("the map is a CSV file, not {}", path.display());
        return Err(Failure::Name { message, help: "name it --map FILE.csv".into() });
    }
    if sources.files().any(|file| resolved(file) == resolved(path)) {
        let message = format!("{} is the rig itself", path.display());
        return Err(Failure::Name { message, help: "name another file by --map".into() });
    }
    Ok(())
}

/// A rig and what it is: declared, found, or with an addition.
pub(super) type Layout = (String, Rig);

/// The declared rig, those found and those with one addition.
pub(super) fn layouts(rig: &Rig, suggestions: &[Suggestion], optimum: Option<&Optimum>) -> Vec<Layout> {
    let mut layouts = vec![("declared".to_owned(), rig.clone())];
    for (place, found) in (1..).zip(optimum.into_iter().flat_map(|optimum| &optimum.found)) {
        let mut placed = rig.clone();
        let radial = placed.sensors.iter_mut().filter(|sensor| sensor.axial_radius_mm.is_none());
        for (sensor, angle_deg) in radial.zip(&found.angles_deg) {
            sensor.angle_rad = angle_deg.to_radians();
        }
        layouts.push((format!("found {place}"), placed));
    }
    let with = |one: &Suggestion| (format!("with {}", words(&one.addition, rig)), one.rig.clone());
    layouts.extend(suggestions.iter().map(with));
    layouts
}

/// Writes one row a layout and order.
pub(super) fn write(
    path: &Path,
    rig: &Rig,
    orders: &RangeInclusive<usize>,
    suggestions: &[Suggestion],
    optimum: Option<&Optimum>,
) -> Result<PathBuf, Error> {
    let mut text = String::from("layout,angles_deg,order,gain,lost\n");
    for (name, rig) in layouts(rig, suggestions, optimum) {
        add(&mut text, &name, &rig, orders);
    }
    atomic_file::write(path, text.as_bytes())
}

fn add(text: &mut String, name: &str, rig: &Rig, orders: &RangeInclusive<usize>) {
    let angles: Vec<String> = rig.sensors.iter().map(|sensor| degrees(sensor.angle_rad).to_string()).collect();
    // A section's id may hold anything.
    let (name, angles) = (name.replace('"', "\"\""), angles.join(" "));
    for entry in form_gains(&assess(rig, orders)) {
        let shown = entry.gain.map(|gain| format!("{gain:.6}")).unwrap_or_default();
        // A string takes whatever is written to it.
        let _ = writeln!(text, "\"{name}\",{angles},{},{shown},{}", entry.order, entry.gain.is_none());
    }
}
