//! The tables of a result.

use nalgebra::Vector3;
use runout_core::{
    Result,
    stage::residual_table,
    table::{ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, texts},
};

use crate::{axis::Axis, campaign::Campaign};

pub(crate) fn component_table(axis: Axis) -> TableSpec {
    let symbols = axis.component_symbols();
    let units = ["um", "um", "um", "urad", "urad", "urad"];
    let name = |index: usize| format!("{}_{}", symbols[index].to_lowercase(), units[index]);
    let mut columns = vec![ColumnSpec::number(axis.command(), "deg", "command of the axis").repeating()];
    columns.extend((0..6).map(|index| {
        let about = format!("component error {} (ISO 230-1)", symbols[index]);
        ColumnSpec::number(name(index), units[index], about).or_null()
    }));
    columns.extend((0..6).map(|index| {
        let about = format!("standard uncertainty of {}", name(index));
        ColumnSpec::number(format!("std_{}", name(index)), units[index], about).or_null()
    }));
    let about = "component errors at each distinct command: mean 0 over these, and no part that turns with the table (1/rev); \
                 null where not observable";
    let measures = |indices: std::ops::Range<usize>| {
        let measure = |index| Measure::new(name(index)).with_std(format!("std_{}", name(index)));
        indices.map(|index| measure(index).with_symbol(symbols[index].clone())).collect::<Vec<_>>()
    };
    TableSpec::new("component_errors", about, columns)
        .figure(Figure::lines("component-errors-um", "Component errors", axis.command(), measures(0..3)))
        .figure(Figure::lines("component-errors-urad", "Component errors", axis.command(), measures(3..6)))
}

pub(crate) fn compensation_table(axis: Axis) -> TableSpec {
    let mut columns = vec![
        ColumnSpec::number(axis.command(), "deg", "command of the axis").repeating(),
        ColumnSpec::name("point", "the ball, or the point of `tool_points`"),
    ];
    for name in ["dx_mm", "dy_mm", "dz_mm"] {
        let about = "what location and component errors do to the point: add it to the command of the linear axis";
        columns.push(ColumnSpec::number(name, "mm", about).or_null());
    }
    for name in ["dx_mm", "dy_mm", "dz_mm"] {
        let about = format!("standard uncertainty of {name}");
        columns.push(ColumnSpec::number(format!("std_{name}"), "mm", about).or_null());
    }
    for name in ["dx", "dy", "dz"] {
        let about = "mean deviation that remains, the ball's placement taken out, where the fit has not seen this command and \
                     its component errors are interpolated";
        columns.push(ColumnSpec::number(format!("remains_{name}_um"), "um", about).or_null());
    }
    TableSpec::new("compensation", "compensation of the balls and of tool points at each distinct command", columns)
}

pub(crate) fn residual_rows(
    axis: Axis,
    campaign: &Campaign,
    before: &[Vector3<f64>],
    after: &[Vector3<f64>],
) -> Result<TableRows> {
    let spec = residual_table("um");
    let machine = |values: Vec<&Vector3<f64>>| -> Vec<f64> {
        values.into_iter().flat_map(|value| axis.outward(value).map(|entry| 1e3 * entry)).collect()
    };
    let readings = machine(campaign.readings.iter().map(|reading| &reading.value).collect());
    let groups = campaign.readings.iter().flat_map(|reading| {
        let at = format!(
            "{}, {} = {}°",
            campaign.balls[reading.ball],
            axis.letter(),
            campaign.commands_deg[reading.command]
        );
        ["x", "y", "z"].map(|coordinate| format!("{at}, {coordinate}"))
    });
    let groups: Vec<String> = groups.collect();
    let rows = spec.rows(vec![
        counts(0..readings.len()),
        texts(groups),
        numbers(readings),
        numbers(machine(before.iter().collect())),
        numbers(machine(after.iter().collect())),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}
