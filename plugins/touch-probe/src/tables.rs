//! The tables of a result.

use runout_core::{
    Result,
    table::{ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, numbers, texts},
};

use crate::{config::TouchProbeConfig, touches::Touches};

/// The tables of the result.
pub(crate) fn tables() -> Vec<TableSpec> {
    let um = |name: &str, about: &str| ColumnSpec::number(name, "um", about);
    let mm = |name: &str, about: &str| ColumnSpec::number(name, "mm", about);
    let deg = |name: &str, about: &str| ColumnSpec::number(name, "deg", about);
    vec![
        TableSpec::new(
            "pretravel",
            "pre-travel by direction, without mean and order 1, of the observable orders of lobing",
            vec![
                deg("direction_deg", "direction of the touch in the probe's frame").repeating(),
                um(
                    "pretravel_um",
                    "travel after contact until the probe triggers, less its mean and order 1; outward positive",
                ),
                um("std_pretravel_um", "its standard uncertainty"),
            ],
        )
        .figure(Figure::polar(
            "pretravel",
            "Pre-travel",
            "direction_deg",
            [Measure::new("pretravel_um").with_std("std_pretravel_um")],
        )),
        TableSpec::new(
            "compensation",
            "what to add to a place that was read, by direction: mean and the orders of lobing with evidence",
            vec![
                deg(
                    "direction_deg",
                    "direction of the touch in the probe's frame, outward; the machine's at probe angle 0",
                )
                .repeating(),
                mm("dx_mm", "to add to x, in the probe's frame"),
                mm("dy_mm", "to add to y, in the probe's frame"),
            ],
        ),
        TableSpec::new(
            "lobing",
            "orders of lobing and of ring form: A cos(n angle + phase); NaN where an order is lost",
            vec![
                ColumnSpec::count("order", "", "undulations per revolution"),
                ColumnSpec::flag("lobing_lost", "whether lobing of this order is not observable"),
                ColumnSpec::flag("form_lost", "whether form of the ring of this order is not observable"),
                ColumnSpec::flag("bounded", "whether lobing contains the form of the ring, within its declared bound"),
                ColumnSpec::flag("evident", "whether lobing of this order is in the compensation"),
                um("amplitude_um", "amplitude of lobing"),
                um("std_amplitude_um", "its standard uncertainty"),
                deg("phase_deg", "phase of lobing, in the probe's frame"),
                deg("std_phase_deg", "its standard uncertainty"),
                um("form_amplitude_um", "amplitude of the form of the ring"),
                um("std_form_amplitude_um", "its standard uncertainty"),
            ],
        ),
        TableSpec::new(
            "residual",
            "residual of each touch",
            vec![
                ColumnSpec::count("reading", "", "number of the touch, from 0"),
                ColumnSpec::name("setup", "id of the setup"),
                ColumnSpec::count("repeat", "", "number of the repeat"),
                deg("direction_deg", "direction of the touch in the machine, from the centre of the ring"),
                um("value", "reading less ring radius and centring"),
                um("before", "value less the declared model"),
                um("after", "value less the final model; that of a run is the declared one"),
            ],
        ),
    ]
}

/// Rows of the table of this name.
pub(crate) fn rows(name: &str, columns: Vec<ArrayRef>) -> Result<TableRows> {
    let spec = tables().into_iter().find(|spec| spec.name == name);
    let spec = spec.unwrap_or_else(|| TableSpec::new(name, "", Vec::new()));
    Ok(TableRows { rows: spec.rows(columns)?, table: spec.name })
}

/// Rows of the table `residual`.
pub(crate) fn residual_rows(
    config: &TouchProbeConfig,
    touches: &Touches,
    before: &[f64],
    after: &[f64],
) -> Result<TableRows> {
    let all = || touches.all.iter();
    let columns = vec![
        counts(0..touches.all.len()),
        texts(all().map(|touch| &config.setups[touch.setup].id)),
        counts(all().map(|touch| touch.repeat)),
        numbers(all().map(|touch| touch.angle.to_degrees().rem_euclid(360.0))),
        numbers(all().map(|touch| touch.reading_um)),
        numbers(before.iter().copied()),
        numbers(after.iter().copied()),
    ];
    rows("residual", columns)
}
