//! The tables of error motion turn by turn: what to draw of synchronous and asynchronous error motion.

use runout_evaluate::error_motion::{ErrorMotion, Spectrum, TurnsPlot};
use runout_table::{ArrayRef, ColumnSpec, Figure, Measure, TableSpec, counts, numbers, numbers_or_null, stretches};
use runout_turning::{rig::Bearing, station::StationResult};

/// Angles of a polar plot, and orders of a spectrum: more are not visible, and would make a result of many stations large.
const ANGLES: usize = 360;
const ORDERS: usize = 200;
/// Stations of which a result holds these tables, at most.
pub(super) const STATIONS: usize = 50;

/// What a table is of: name, unit, and words for titles.
struct Motion {
    turns: &'static str,
    spectrum: &'static str,
    unit: &'static str,
    title: &'static str,
    is_tilt: bool,
}

const MOTIONS: [Motion; 2] = [
    Motion { turns: "turns", spectrum: "spectrum", unit: "um", title: "error motion", is_tilt: false },
    Motion { turns: "tilt_turns", spectrum: "tilt_spectrum", unit: "urad", title: "tilt error motion", is_tilt: true },
];

/// All of them: polar plots of all turns and spectra, of displacement and of tilt; the lines of bearings are named in the spectra.
pub(super) fn specs(bearings: &[Bearing]) -> Vec<TableSpec> {
    MOTIONS.iter().flat_map(|motion| [turns(motion), spectrum(motion, bearings)]).collect()
}

/// Rows of one station, by table; none without a spread over its turns.
pub(super) fn rows(result: &StationResult) -> Vec<(TableSpec, Vec<ArrayRef>)> {
    let StationResult { station, z_mm, angles, separation, profiles, .. } = result;
    if profiles.iter().all(|profile| profile.spread.is_none()) {
        return Vec::new();
    }
    let motion = ErrorMotion { station, z_mm: *z_mm, angles: *angles, separation, profiles, slope: 0.0 };
    let (plots, spectra) = (motion.plots(ANGLES), motion.spectra(ORDERS));
    let mut tables = Vec::new();
    for motion in &MOTIONS {
        let plots: Vec<&TurnsPlot> = plots.iter().filter(|plot| plot.is_tilt == motion.is_tilt).collect();
        let spectra: Vec<&Spectrum> = spectra.iter().filter(|one| one.is_tilt == motion.is_tilt).collect();
        if !plots.is_empty() {
            tables.push((turns(motion), turns_rows(station, &plots)));
        }
        if !spectra.is_empty() {
            tables.push((spectrum(motion, &[]), spectrum_rows(station, &spectra)));
        }
    }
    tables
}

fn turns(motion: &Motion) -> TableSpec {
    let Motion { turns, unit, title, .. } = motion;
    let column = |name: &str, about: &str| ColumnSpec::number(format!("{name}_{unit}"), *unit, about);
    let columns = vec![
        ColumnSpec::name("station", "name of the axial station"),
        ColumnSpec::name("direction", "sensitive direction (ISO 230-7)"),
        ColumnSpec::number("angle_deg", "deg", "the spindle's angle").repeating(),
        column("synchronous", "synchronous error motion about the least-squares centre of its plot"),
        column("lowest", "the lowest of all turns around this angle, about the same centre"),
        column("highest", "the highest of all turns around this angle, about the same centre"),
    ];
    let measure = |name: &str, symbol: &str| Measure::new(format!("{name}_{unit}")).with_symbol(symbol);
    let measures = [
        measure("lowest", "innermost turn"),
        measure("highest", "outermost turn"),
        measure("synchronous", "synchronous"),
    ];
    let figure = Figure::polar(turns.replace('_', "-"), format!("All turns: {title}"), "angle_deg", measures);
    let about = format!("{title} of all turns over the spindle's angle, on at most {ANGLES} angles");
    TableSpec::new(*turns, about, columns).optional().figure(figure.panels(["station", "direction"]))
}

fn turns_rows(station: &str, plots: &[&TurnsPlot]) -> Vec<ArrayRef> {
    let length = |plot: &&TurnsPlot| plot.synchronous.len();
    let angle = |plot: &&TurnsPlot| {
        let count = length(plot);
        (0..count).map(move |step| 360.0 * step as f64 / count as f64)
    };
    vec![
        stretches([(station, plots.iter().map(length).sum())]),
        stretches(plots.iter().map(|plot| (plot.direction.as_str(), length(plot)))),
        numbers(plots.iter().flat_map(angle)),
        numbers(plots.iter().flat_map(|plot| plot.synchronous.iter().copied())),
        numbers(plots.iter().flat_map(|plot| plot.lowest.iter().copied())),
        numbers(plots.iter().flat_map(|plot| plot.highest.iter().copied())),
    ]
}

fn spectrum(motion: &Motion, bearings: &[Bearing]) -> TableSpec {
    let Motion { spectrum, unit, title, .. } = motion;
    let column = |name: &str, about: &str| ColumnSpec::number(format!("{name}_{unit}"), *unit, about);
    let columns = vec![
        ColumnSpec::name("station", "name of the axial station"),
        ColumnSpec::name("direction", "fixed sensitive direction (ISO 230-7)"),
        ColumnSpec::count("order", "1/rev", "periods per revolution"),
        ColumnSpec::number("frequency_hz", "Hz", "frequency at the mean speed; null where that is not known")
            .or_null()
            .repeating(),
        column(
            "synchronous",
            "amplitude of synchronous error motion; NaN at lost orders and at 1/rev, which contains the centring",
        ),
        column(
            "asynchronous",
            "root mean square amplitude of single turns about their mean, with the sensors' noise; at high orders the mean \
             over up to five orders",
        ),
    ];
    let measure = |name: &str| Measure::new(format!("{name}_{unit}")).with_symbol(name);
    let measures = [measure("synchronous"), measure("asynchronous")];
    let id = spectrum.replace('_', "-");
    let several = bearings.len() > 1;
    let named = bearings.iter().flat_map(Bearing::main_lines).map(|line| {
        let of = if several { format!(" {}", line.bearing) } else { String::new() };
        (line.order, line.name + &of)
    });
    let by_order =
        Figure::bars(id.clone(), format!("Spectrum of {title} by order"), "order", measures.clone()).named(named);
    let by_hz =
        Figure::lines(format!("{id}-hz"), format!("Spectrum of {title} by frequency"), "frequency_hz", measures);
    let about = format!("amplitudes of {title} by order, up to {ORDERS}/rev");
    let table = TableSpec::new(*spectrum, about, columns).optional();
    table.figure(by_order.panels(["station", "direction"])).figure(by_hz.panels(["station", "direction"]))
}

fn spectrum_rows(station: &str, spectra: &[&Spectrum]) -> Vec<ArrayRef> {
    let length = |one: &&Spectrum| one.synchronous.len();
    let frequency = |one: &&Spectrum| {
        let speed_rpm = one.speed_rpm;
        (1..=length(one)).map(move |order| speed_rpm.map(|rpm| rpm / 60.0 * order as f64))
    };
    vec![
        stretches([(station, spectra.iter().map(length).sum())]),
        stretches(spectra.iter().map(|one| (one.direction.as_str(), length(one)))),
        counts(spectra.iter().flat_map(|one| 1..=length(one))),
        numbers_or_null(spectra.iter().flat_map(frequency)),
        numbers(spectra.iter().flat_map(|one| one.synchronous.iter().copied())),
        numbers(spectra.iter().flat_map(|one| one.asynchronous.iter().copied())),
    ]
}
