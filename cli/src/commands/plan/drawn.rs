//! The report of a plan: its tables, and noise gain by order.

use std::{path::Path, slice};

use runout_core::{
    numerics::number::{ranges, significant},
    pipeline::document::{self, Document, Sources},
    provenance::{Provenance, VERSION},
    rig::Rig,
    stage::{NoiseGain, Overview},
    table::{ColumnSpec, Figure, Measure, RecordBatch, TableSpec, counts, numbers_or_null, texts},
};

use super::{assess, map::Layout};
use crate::{
    commands::report::OverviewReport,
    failure::Failure,
    render,
    reports::plan::{PointReport, Report, form_gains},
};

/// Writes the report of a rig's plan. The first layout is the declared one.
pub(super) fn of_rig(
    path: &Path,
    sources: &Sources,
    rig: &Rig,
    report: &Report,
    layouts: &[Layout],
) -> Result<(), Failure> {
    let (_, page) = render::plan::page(report).into_overview(Some(rig.clone()));
    let worst = report.noise_gain.form.iter().filter_map(|gain| Some((gain.order, gain.gain?)));
    let worst = worst.max_by(|a, b| a.1.total_cmp(&b.1));
    let worst = worst.map_or_else(String::new, |(order, gain)| {
        format!(" The largest noise gain of the other orders is {} at order {order}.", significant(gain, 3))
    });
    let lost = ranges(&report.separability.lost_orders.form);
    let overview = Overview { headline: format!("Lost orders of form: {lost}.{worst}"), ..page };
    let unknowns = unknowns(report)?;
    write(path, sources, &overview, &[unknowns].into_iter().chain(additions(report, layouts)?).collect::<Vec<_>>())
}

/// Writes the report of a layout of measured points.
pub(super) fn of_points(path: &Path, sources: &Sources, report: &PointReport) -> Result<(), Failure> {
    let (_, overview) = render::plan_points::page(report).into_overview(None);
    write(path, sources, &overview, slice::from_ref(&point_gains(report)?))
}

type Table = (TableSpec, RecordBatch);

fn write(path: &Path, sources: &Sources, overview: &Overview, tables: &[Table]) -> Result<(), Failure> {
    let planned = sources.files().next().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    let title = format!("Plan of {}", planned.unwrap_or_else(|| "a rig".into()));
    let specs = tables.iter().map(|(spec, _)| spec.clone()).collect();
    let mut report = OverviewReport::begin(path, title, sources, specs)?;
    for (spec, rows) in tables {
        report.rows(spec, rows)?;
    }
    let document = Document::parse(sources)?;
    let configuration =
        document::resolved_text(document.root(), sources).map_err(|fault| Failure::from(document.diagnose(fault)))?;
    let provenance = Provenance { program: format!("runout {VERSION}"), configuration, inputs: Vec::new() };
    Ok(report.finish(provenance, overview)?)
}

const GAIN: &str = "standard deviation for 1 µm in every reading; null where the order is lost";

/// Noise gain of every unknown.
fn unknowns(report: &Report) -> Result<Table, Failure> {
    let columns = vec![
        ColumnSpec::name("unit", "unit of the unknown"),
        ColumnSpec::name("unknown", "the unknown"),
        ColumnSpec::count("order", "1/rev", "undulations per revolution"),
        ColumnSpec::number("gain", "", GAIN).or_null(),
    ];
    let figure = Figure::bars("noise-gain", "Noise gain", "order", [Measure::new("gain").with_symbol("noise gain")]);
    let spec = TableSpec::new("noise_gain", "noise gain of every unknown by order", columns)
        .figure(figure.panels(["unit"]).curves(["unknown"]));
    let separability = &report.separability;
    let each = || {
        let unknowns = separability.unknowns.iter().enumerate();
        unknowns.flat_map(|(index, unknown)| separability.orders.iter().map(move |order| (index, unknown, order)))
    };
    let unit = |unit: &str| format!("{} for 1 µm in every reading", if unit == "urad" { "µrad" } else { "µm" });
    let rows = spec.rows(vec![
        texts(each().map(|(_, unknown, _)| unit(unknown.unit))),
        texts(each().map(|(_, unknown, _)| unknown.name())),
        counts(each().map(|(.., order)| order.order)),
        numbers_or_null(each().map(|(index, _, order)| order.noise_gain.get(index).copied().flatten())),
    ])?;
    Ok((spec, rows))
}

/// Noise gain of form with each other layout, beside that of the declared one; nothing without another layout.
fn additions(report: &Report, layouts: &[Layout]) -> Result<Option<Table>, Failure> {
    let Some((_, others)) = layouts.split_first().filter(|(_, others)| !others.is_empty()) else { return Ok(None) };
    let columns = vec![
        ColumnSpec::name("layout", "the layout"),
        ColumnSpec::count("order", "1/rev", "undulations per revolution"),
        ColumnSpec::number("gain", "", GAIN).or_null(),
        ColumnSpec::number("declared", "", "that of the declared layout; null where the order is lost").or_null(),
    ];
    let measures = [
        Measure::new("gain").with_symbol("this layout"),
        Measure::new("declared").with_symbol("as declared, µm for 1 µm in every reading"),
    ];
    let figure = Figure::bars("layouts", "Noise gain of form, other layouts", "order", measures).panels(["layout"]);
    let spec = TableSpec::new("layouts", "noise gain of form by layout and order", columns).figure(figure);
    let declared = &report.noise_gain.form;
    let (Some(first), Some(last)) = (declared.first(), declared.last()) else { return Ok(None) };
    let orders = first.order..=last.order;
    let found: Vec<_> = others.iter().map(|(name, rig)| (name, form_gains(&assess(rig, &orders)))).collect();
    let each = || found.iter().flat_map(|(name, gains)| gains.iter().zip(declared).map(move |pair| (*name, pair)));
    let rows = spec.rows(vec![
        texts(each().map(|(name, _)| name)),
        counts(each().map(|(_, (gain, _))| gain.order)),
        numbers_or_null(each().map(|(_, (gain, _))| gain.gain)),
        numbers_or_null(each().map(|(_, (_, declared))| declared.gain)),
    ])?;
    Ok(Some((spec, rows)))
}

/// Noise gain of measured points by order, as it is and with each addition.
fn point_gains(report: &PointReport) -> Result<Table, Failure> {
    let columns = vec![
        ColumnSpec::name("group", "group of the quantities"),
        ColumnSpec::name("layout", "the layout"),
        ColumnSpec::count("order", "1/rev", "undulations per revolution"),
        ColumnSpec::number("gain", "", GAIN).or_null(),
    ];
    let measure = Measure::new("gain").with_symbol("µm for 1 µm in every reading");
    let figure = Figure::bars("noise-gain", "Noise gain", "order", [measure]).panels(["group"]).curves(["layout"]);
    let spec = TableSpec::new("noise_gain", "noise gain by layout and order", columns).figure(figure);
    let plan = &report.plan;
    let mut all: Vec<(&str, String, usize, Option<f64>)> = Vec::new();
    let mut add = |layout: &str, group: &'_ String, gains: &[NoiseGain]| {
        let group = plan.noise_gain.get_key_value(group).map_or("", |(group, _)| group.as_str());
        all.extend(gains.iter().filter_map(|gain| Some((group, layout.to_owned(), gain.order?, gain.gain))));
    };
    plan.noise_gain.iter().for_each(|(group, gains)| add("as it is", group, gains));
    for (number, addition) in (1..).zip(&plan.suggestions) {
        addition.noise_gain.iter().for_each(|(group, gains)| add(&format!("with {number}"), group, gains));
    }
    let rows = spec.rows(vec![
        texts(all.iter().map(|(group, ..)| group)),
        texts(all.iter().map(|(_, layout, ..)| layout)),
        counts(all.iter().map(|(_, _, order, _)| *order)),
        numbers_or_null(all.iter().map(|(.., gain)| *gain)),
    ])?;
    Ok((spec, rows))
}
