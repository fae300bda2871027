//! `runout plan`: what a rig can separate and how well, which effects it would show, what to add to it, and better angles
//! for its sensors.

mod drawn;
mod map;
pub(crate) mod points;

use std::ops::RangeInclusive;

use runout_core::{
    fault::Fault,
    pipeline::{
        Registry,
        document::{self, Document, Sources},
    },
    rig::{Rig, RigConfig},
};
use runout_spindle::{
    layout::Layout,
    plan::{self, Change, Optimum, PROGRESS_STEPS, Search, Suggestion, TooTight, optimise},
    selection::Selection,
    separators::face_notes,
};

use serde_json::Value;

use super::print;
use crate::{
    args::{Criterion, Optimise, PlanArgs},
    failure::{Failure, to_value},
    progress::Progress,
    render,
    reports::{
        check::Separability,
        plan::{Optimised, PointReport, Report, Suggested, Unresolved},
    },
};

/// Plans a rig, or the layout of a pipeline of measured points.
///
/// # Errors
/// When the rig or the pipeline is wrong, the sensors have no room, or the map cannot be written.
pub(crate) fn execute(args: &PlanArgs, json: bool, registry: &Registry) -> Result<(), Failure> {
    match planned(args, registry, &Progress::new("steps"))? {
        Planned::Rig(report) => print(&*report, json, render::plan::text),
        Planned::Points(report) => print(&*report, json, |report| render::plan_points::page(report).into_text()),
    }
}

/// Plans a rig, or the layout of a pipeline of measured points, and returns the report as a JSON document.
///
/// # Errors
/// As [`execute`].
pub(crate) fn document(args: &PlanArgs, registry: &Registry, progress: &Progress) -> Result<Value, Failure> {
    match planned(args, registry, progress)? {
        Planned::Rig(report) => to_value(&*report),
        Planned::Points(report) => to_value(&*report),
    }
}

/// What was planned.
enum Planned {
    Rig(Box<Report>),
    Points(Box<PointReport>),
}

fn planned(args: &PlanArgs, registry: &Registry, progress: &Progress) -> Result<Planned, Failure> {
    // A rig file includes no other.
    let sources = Sources::read(&args.rig, &args.overrides.set, "")?;
    if points::is_pipeline(&sources)? {
        let report = points::report(args, &sources, registry)?;
        if let Some(path) = &args.report {
            drawn::of_points(path, &sources, &report)?;
        }
        return Ok(Planned::Points(Box::new(report)));
    }
    let rig = rig(&sources)?;
    map::refuse(args.map.as_deref(), &sources)?;
    let across = across(&rig);
    let optimum = args.optimise.map(|Optimise::Angles| better_angles(&across, args, progress)).transpose()?;
    let suggestions = plan::suggest(&rig, &args.orders, args.clearance);
    let foresight = plan::foresee_rig(&rig)?;
    let changes = plan::changes(&rig, &foresight, &suggestions, args.clearance)?;
    let mut report = Report::new(&rig, assess(&rig, &args.orders), foresight);
    report.notes = notes(&rig, &args.orders);
    report.suggestions = suggested(&rig, &args.orders, &suggestions, &changes.found);
    report.unresolved = Unresolved { blind_to: changes.still_blind, confounded: changes.still_confounded };
    report.optimised = optimum.as_ref().map(|optimum| Optimised::new(optimum, &across, args));
    if let Some(path) = &args.map {
        report.map = Some(map::write(path, &rig, &args.orders, &suggestions, optimum.as_ref())?);
    }
    if let Some(path) = &args.report {
        drawn::of_rig(path, &sources, &rig, &report, &map::layouts(&rig, &suggestions, optimum.as_ref()))?;
    }
    Ok(Planned::Rig(Box::new(report)))
}

/// What helps form's noise gain and what changes which effects would show, best first.
fn suggested(
    rig: &Rig,
    orders: &RangeInclusive<usize>,
    for_form: &[Suggestion],
    for_effects: &[Change],
) -> Vec<Suggested> {
    let before = plan::score(rig, orders);
    let mut all = for_form.to_vec();
    for change in for_effects {
        if !all.iter().any(|known| known.addition == change.addition) {
            let after = plan::score(&change.rig, orders);
            all.push(Suggestion { addition: change.addition, rig: change.rig.clone(), after });
        }
    }
    all.sort_by(|a, b| a.after.compare(&b.after, plan::Criterion::Worst));
    let change = |found: &Suggestion| for_effects.iter().find(|change| change.addition == found.addition);
    all.iter().map(|found| Suggested::new(found, change(found), rig, before)).collect()
}

pub(super) fn rig(sources: &Sources) -> Result<Rig, Failure> {
    let document = Document::parse(sources)?;
    let root = document.root();
    if root.get_ref().contains_key("rig") {
        let fault = Fault::at("rig", "a rig file has the keys of [rig] at top level");
        let help = "move what is under [rig] to a file of its own, and write `rig = \"that.toml\"` in the pipeline";
        return Err(document.diagnose(fault.help(help)).into());
    }
    let checked = document::read::<RigConfig>(root).and_then(RigConfig::check);
    checked.map_err(|fault| document.diagnose(fault).into())
}

/// The rig without its axial sensors, whose angles say nothing of a circle's form.
fn across(rig: &Rig) -> Rig {
    let radial = (0..rig.sensors.len()).filter(|sensor| rig.sensors[*sensor].axial_radius_mm.is_none());
    Selection::new(rig, radial.collect(), (0..rig.setups.len()).collect()).rig
}

/// What to know of axial sensors and declared forms.
fn notes(rig: &Rig, orders: &RangeInclusive<usize>) -> Vec<String> {
    face_notes(rig, &Layout::new(rig, false).assess(*orders.end()))
}

/// What a rig can and cannot separate at these orders.
fn assess(rig: &Rig, orders: &RangeInclusive<usize>) -> Separability {
    let mut assessment = Layout::new(rig, false).assess(*orders.end());
    assessment.orders.retain(|order| orders.contains(&order.order));
    Separability::new(&assessment, Some(rig))
}

/// A tolerance that turns the highest order by more leaves open whether the layout sees it at all.
const MOST_TURNED_DEG: f64 = 45.0;

fn better_angles(rig: &Rig, args: &PlanArgs, progress: &Progress) -> Result<Optimum, Failure> {
    if rig.sensors.len() < 2 {
        return Err(Failure::Name {
            message: "one radial sensor has no angle to choose: the first sensor stays where it is".into(),
            help: "add sensors to the rig, or leave out --optimise to see which one helps most".into(),
        });
    }
    let turned_deg = args.angle_tolerance * *args.orders.end() as f64;
    if turned_deg > MOST_TURNED_DEG {
        let (tolerance, order) = (args.angle_tolerance, args.orders.end());
        return Err(Failure::Name {
            message: format!(
                "an angle tolerance of {tolerance}° turns order {order} by {turned_deg:.0}°, more than {MOST_TURNED_DEG}°: somewhere \
                 within it, any layout may be blind"
            ),
            help: format!("lower --angle-tolerance to {:.2}deg, or the highest order", MOST_TURNED_DEG / *order as f64),
        });
    }
    let search = Search {
        orders: args.orders.clone(),
        clearance_deg: args.clearance,
        angle_tolerance_deg: args.angle_tolerance,
        criterion: match args.criterion {
            Criterion::Worst => plan::Criterion::Worst,
            Criterion::Rms => plan::Criterion::Rms,
        },
        seed: args.seed,
    };
    progress.expect(PROGRESS_STEPS);
    optimise(rig, &search, &mut |best| progress.advance(best)).map_err(|tight| too_tight(&tight, args.clearance))
}

fn too_tight(tight: &TooTight, clearance_deg: f64) -> Failure {
    let TooTight { section, sensors, most_deg } = tight;
    Failure::Name {
        message: format!("{sensors} sensors of section `{section}` cannot be {clearance_deg}deg apart"),
        help: format!("--clearance {most_deg}deg leaves them room"),
    }
}
