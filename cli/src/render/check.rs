//! What can be said before a run, for people.

use std::collections::BTreeMap;

use runout_core::rig::Rotation;

use super::{
    count, foresight,
    number::{ranges, same, significant, spread},
    page::Page,
    table::Table,
};
use crate::reports::check::{Data, Order, Report, RigSize, Separability, Unknown};

/// The text of a report.
#[must_use]
pub(crate) fn text(report: &Report) -> String {
    let mut page = Page::default();
    page.line(&report.title);
    page.line("The configuration is valid.");
    match &report.data {
        Data::Usable { about } => page.line(format_args!("The data can be used: {about}.")),
        Data::Missing { about } => page.line(format_args!("The data are not there yet: {about}.")),
        Data::Unusable { about } => page.line(format_args!("! The data cannot be used: {about}.")),
    }
    let mut stages = Table::new(2, ["stage", "plugin"]);
    for stage in &report.stages {
        stages.row([stage.stage, &stage.plugin]);
    }
    page.headed_table("Stages", &stages);
    let mut columns = Table::new(4, ["column", "unit", "", "what it is"]);
    for column in &report.columns {
        columns.row([column.name, column.unit, if column.optional { "optional" } else { "" }, column.about]);
    }
    page.headed_table("Columns of the points", &columns);
    if let Some(size) = &report.rig {
        rig(&mut page, size);
    }
    // A separator that is a program says nothing before a run.
    let known = report.separability.as_ref().filter(|separability| !separability.orders.is_empty());
    if let Some(separability) = known {
        orders(&mut page, separability);
        lost_orders(&mut page, separability);
        noise_gain(&mut page, separability);
    }
    if let Some(found) = &report.foresight {
        foresight::hidden(&mut page, found);
    }
    page.bullets("Notes", &report.notes);
    page.into_text()
}

pub(super) fn rig(page: &mut Page, rig: &RigSize) {
    let turning = match rig.rotation {
        Rotation::Ccw => "counter-clockwise about +z",
        Rotation::Cw => "clockwise about +z",
    };
    let [sensors, sections] = [count(rig.sensors, "sensor"), count(rig.sections, "section")];
    page.heading("Rig");
    page.line(format_args!("  {sensors} looking at {sections}, {}", count(rig.setups, "setup")));
    page.line(format_args!("  part radius {} mm, turning {turning}", rig.part_radius_mm));
}

pub(super) fn orders(page: &mut Page, separability: &Separability) {
    let orders = &separability.orders;
    let names: Vec<String> = separability.unknowns.iter().map(Unknown::name).collect();
    let [first, last] = [orders.first(), orders.last()].map(|order| order.map_or(0, |order| order.order));
    page.heading(format_args!("Per order, {first} to {last}"));
    page.line(format_args!("  {}: {}", count(names.len(), "unknown"), names.join(", ")));
    let mut by_dof: BTreeMap<usize, Vec<usize>> = BTreeMap::new();
    for order in orders {
        by_dof.entry(order.residual_dof).or_default().push(order.order);
    }
    let dof: Vec<String> = by_dof.iter().map(|(dof, orders)| format!("{dof} at {}", ranges(orders))).collect();
    page.line(format_args!("  readings left over for a residual: {}", dof.join("; ")));
}

pub(super) fn lost_orders(page: &mut Page, separability: &Separability) {
    page.heading("Lost orders");
    if separability.unknowns.iter().any(|unknown| unknown.quantity == "z") {
        // Along the axis other orders are lost than across it.
        let names: Vec<String> = separability.unknowns.iter().map(Unknown::name).collect();
        let width = names.iter().map(|name| name.chars().count()).max().unwrap_or(0);
        for (index, name) in names.iter().enumerate() {
            let lost = separability.orders.iter().filter(|order| order.observable.get(index) == Some(&false));
            let lost: Vec<usize> = lost.map(|order| order.order).collect();
            page.line(format_args!("  {name:width$}  {}", ranges(&lost)));
        }
    } else {
        page.line(format_args!("  form    {}", ranges(&separability.lost_orders.form)));
        page.line(format_args!("  motion  {}", ranges(&separability.lost_orders.motion)));
    }
    let mut reasons: Vec<(String, &str, Vec<usize>)> = Vec::new();
    for order in &separability.orders {
        let Some(reason) = &order.lost_because else { continue };
        // A reason that names its own order is the same reason at every order.
        let general = reason.replace(&format!("{}/rev", order.order), "n/rev");
        match reasons.iter_mut().find(|(known, ..)| *known == general) {
            Some((.., at)) => at.push(order.order),
            None => reasons.push((general, reason, vec![order.order])),
        }
    }
    for (_, first, at) in reasons {
        let example = if at.len() > 1 { "for example, " } else { "" };
        page.line(format_args!("  at {}: {example}{first}", ranges(&at)));
    }
}

pub(super) fn noise_gain(page: &mut Page, separability: &Separability) {
    let mut table = Table::new(1, ["unknown", "median", "worst", "at order"]);
    for (index, unknown) in separability.unknowns.iter().enumerate() {
        let gain = |order: &Order| order.noise_gain.get(index).copied().flatten();
        let gains = separability.orders.iter().filter_map(|order| Some((order.order, gain(order)?)));
        let Some([lowest, median, worst]) = spread(gains.clone().map(|(_, gain)| gain)) else { continue };
        let at = gains.filter(|(_, gain)| same(*gain, worst)).map(|(order, _)| order.to_string()).next();
        let at = if same(lowest, worst) { "all".into() } else { at.unwrap_or_default() };
        let unit = if unknown.unit == "urad" { "µrad" } else { "µm" };
        let name = format!("{} ({unit})", unknown.name());
        table.row([name, significant(median, 3), significant(worst, 3), at]);
    }
    page.headed_table("Noise gain: standard deviation of each unknown for 1 µm in every reading", &table);
}
