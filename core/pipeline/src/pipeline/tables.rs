//! The tables of form and motion: their columns, and the rows of one station.

use std::{collections::BTreeSet, iter::repeat_n};

use serde_json::json;

use super::{
    station_summary::{sensor_id, setup_id},
    turn_tables,
};
use crate::{
    atomic_file::PendingFile,
    stage::{About, Completed, Export, NamedValue, ResultInfo},
    summary::Summary,
};
use runout_closed_loop::diagnosis::Correction;
use runout_error::Result;
use runout_numerics::{
    Complex64,
    fourier::{self, Fourier},
};
use runout_standards::{Value, uncertainty::Uncertainty};
use runout_table::{
    ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, counts_or_null, flags, no_numbers, numbers,
    numbers_or_null, texts, texts_or_null,
};
use runout_turning::station::StationResult;
use runout_turning::{
    azimuth::Azimuth,
    reading::{coefficients, variances},
    rig::Rig,
    separation::{ALONG_COLUMN, Assessment, CONVENTION, MotionColumn, Quantity, motion_columns},
    surface::Surface,
};

const STATION: &str = "name of the axial station";
const SECTION: &str = "id of the section";
/// Unit of coefficients, whose rows are of all quantities.
const MIXED: &str = "um; urad for tilt";

/// The table of values, and that of a domain's own values beside it.
const VALUES: &str = "values";
const NAMED_VALUES: &str = "named_values";

/// Whether the table of this name holds values.
pub(super) fn holds_values(table: &str) -> bool {
    [VALUES, NAMED_VALUES].contains(&table)
}

/// The tables of form, motion and the values that are computed from them.
#[derive(Debug, Clone)]
pub struct StationTables {
    form: TableSpec,
    motion: TableSpec,
    harmonics: TableSpec,
    reading: TableSpec,
    values: TableSpec,
    /// Those of error motion turn by turn, of each so many stations.
    turns: Vec<TableSpec>,
    every: usize,
    taken: usize,
    /// The line of the motion, where that is neither x nor y.
    line: Option<Azimuth>,
    /// Whether there is motion along the axis.
    axial: bool,
    rig: Option<Rig>,
    content: Content,
}

impl StationTables {
    /// For what a layout separates.
    #[must_use]
    pub fn new(assessment: Option<&Assessment>, rig: Option<&Rig>) -> Self {
        let unknowns = || assessment.into_iter().flat_map(|found| &found.unknowns);
        let line = unknowns().find_map(|unknown| unknown.azimuth());
        let axial = unknowns().any(|unknown| *unknown == Quantity::Z);
        Self {
            form: form(),
            motion: motion(line, axial),
            harmonics: harmonics(),
            reading: reading(),
            values: values(),
            turns: turn_tables::specs(),
            every: 1,
            taken: 0,
            line,
            axial,
            rig: rig.cloned(),
            content: Content::default(),
        }
    }

    /// The same for so many stations: of many, each second, third, … has tables of error motion turn by turn.
    #[must_use]
    pub fn of_stations(self, stations: usize) -> Self {
        Self { every: stations.div_ceil(turn_tables::STATIONS).max(1), ..self }
    }

    /// What of error motion turn by turn is left out, where something is.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        let every = self.every;
        let any = self.taken > 0 && every > 1;
        any.then(|| {
            format!(
                "plots of all turns and spectra are of 1 in {every} stations: a result holds at most {}",
                turn_tables::STATIONS
            )
        })
    }

    /// All tables, also those that a result may lack.
    #[must_use]
    pub fn specs(&self) -> Vec<TableSpec> {
        let mut all: Vec<TableSpec> =
            [&self.form, &self.motion, &self.harmonics, &self.reading].map(Clone::clone).into();
        all.extend(self.turns.iter().cloned());
        all.push(self.values.clone());
        all
    }

    /// Rows of one station, by table; none where they are not `wanted`. A layout that separates nothing gives rows of the
    /// averaged readings.
    ///
    /// # Errors
    /// When the result's columns are of different lengths.
    pub fn rows(&mut self, result: &StationResult, wanted: bool) -> Result<Vec<TableRows>> {
        self.content.note(result);
        if !wanted {
            return Ok(Vec::new());
        }
        let separation = &result.separation;
        let mut tables = vec![(&self.form, form_rows(result)), (&self.harmonics, harmonics_rows(result))];
        if separation.unknowns.iter().any(|unknown| !unknown.is_form()) {
            tables.push((&self.motion, motion_rows(result, self.line, self.axial)));
        }
        if separation.tells_no_form() {
            tables.push((&self.reading, reading_rows(result, self.rig.as_ref())));
        }
        let rows = |(table, columns): (&TableSpec, Vec<ArrayRef>)| {
            Ok(TableRows { table: table.name.clone(), rows: table.rows(columns)? })
        };
        let of_turns = turn_tables::rows(result);
        let has_turns = !of_turns.is_empty();
        let of_turns = of_turns
            .into_iter()
            .filter(|_| self.taken.is_multiple_of(self.every))
            .map(|(table, columns)| Ok(TableRows { table: table.name.clone(), rows: table.rows(columns)? }));
        let all = tables.into_iter().map(rows).chain(of_turns).collect();
        self.taken += usize::from(has_turns);
        all
    }

    /// The values of all stations and of the part.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub fn value_rows(&self, summary: &Summary) -> Result<TableRows> {
        Ok(TableRows { table: self.values.name.clone(), rows: self.values.rows(values_rows(summary))? })
    }

    /// What one exporter knows when it begins; names can be of any length.
    #[must_use]
    pub fn info(&self, title: &str) -> ResultInfo {
        ResultInfo { title: title.to_owned(), tables: self.specs(), longest_name: None }
    }

    /// Gives a station's rows to one exporter.
    ///
    /// # Errors
    /// When they cannot be written.
    pub fn write(&mut self, result: &StationResult, export: &mut dyn Export) -> Result<()> {
        let rows = self.rows(result, true)?;
        let specs = self.specs();
        let spec = |name: &str| specs.iter().find(|spec| spec.name == name);
        rows.iter().try_for_each(|rows| spec(&rows.table).map_or(Ok(()), |spec| export.rows(spec, &rows.rows)))
    }

    /// Completes one exporter's files.
    ///
    /// # Errors
    /// When they cannot be completed.
    pub fn finish(
        &self,
        mut export: Box<dyn Export>,
        summary: &Summary,
        surface: Option<&Surface>,
    ) -> Result<Vec<PendingFile>> {
        export.rows(&self.values, &self.value_rows(summary)?.rows)?;
        let about = self.about(summary);
        export.finish(&Completed { summary, about: &about, surface, heights: None, diagnosis: None, overview: None })
    }

    /// What the numbers are.
    #[must_use]
    pub fn about(&self, summary: &Summary) -> About {
        self.content.about(summary)
    }
}

fn std_of(column: &str) -> String {
    format!("standard uncertainty of {column} at any one angle; NaN where it is not known")
}

fn form() -> TableSpec {
    TableSpec::new(
        "form",
        "form of each section over the part's angle",
        vec![
            ColumnSpec::name("section", SECTION),
            ColumnSpec::name("station", STATION),
            ColumnSpec::number("z_mm", "mm", "place of the section along the axis").repeating(),
            ColumnSpec::number("angle_deg", "deg", "the part's own angle").repeating(),
            ColumnSpec::number(
                "form_um",
                "um",
                "deviation of the section's form, outward positive; lost orders are left out",
            ),
            ColumnSpec::number("std_um", "um", std_of("form_um")).repeating(),
        ],
    )
    .figure(
        Figure::polar("form", "Form", "angle_deg", [Measure::new("form_um").with_std("std_um")])
            .panels(["station"])
            .curves(["section"]),
    )
}

fn form_rows(result: &StationResult) -> Vec<ArrayRef> {
    let separation = &result.separation;
    let sections: Vec<_> = (separation.sections.iter().enumerate())
        .filter_map(|(index, at)| separation.position(Quantity::Form(index)).map(|unknown| (unknown, at)))
        .collect();
    let angles = result.angles;
    let rows = sections.len() * angles;
    vec![
        texts(sections.iter().flat_map(|(_, at)| repeat_n(at.id.as_str(), angles))),
        texts(repeat_n(result.station.as_str(), rows)),
        numbers(sections.iter().flat_map(|(_, at)| repeat_n(at.z_mm, angles))),
        numbers(sections.iter().flat_map(|_| angles_deg(angles))),
        numbers(sections.iter().flat_map(|(unknown, _)| result.over_angle(*unknown))),
        numbers(sections.iter().flat_map(|(unknown, _)| repeat_n(separation.angle_std(*unknown), angles))),
    ]
}

/// `line` is that of the motion, where that is neither x nor y; `axial` where there is motion along the axis.
fn motion(line: Option<Azimuth>, axial: bool) -> TableSpec {
    let mut columns = vec![
        ColumnSpec::name("station", STATION),
        ColumnSpec::number("angle_deg", "deg", "the spindle's angle").repeating(),
    ];
    let (name, unit, about) = ALONG_COLUMN;
    columns.extend(line.map(|_| ColumnSpec::number(name, unit, about).repeating()));
    let motions = motion_columns(line, axial);
    let value = |MotionColumn { quantity, name, about }: &MotionColumn| {
        let about = format!("{about}; lost orders are left out; null where it was not solved for");
        ColumnSpec::number(*name, quantity.unit(), about).or_null()
    };
    let std = |MotionColumn { quantity, name, .. }: &MotionColumn| {
        ColumnSpec::number(format!("std_{name}"), quantity.unit(), std_of(name)).or_null().repeating()
    };
    columns.extend(motions.iter().map(value));
    columns.extend(motions.iter().map(std));
    let mut table = TableSpec::new("motion", "error motion of the axis over the spindle's angle", columns).optional();
    for (unit, id, title) in
        [("um", "motion", "Synchronous error motion"), ("urad", "tilt", "Synchronous tilt error motion")]
    {
        let values = motions.iter().filter(|motion| motion.quantity.unit() == unit);
        let values = values.map(|motion| Measure::new(motion.name).with_std(format!("std_{}", motion.name)));
        table = table.figure(Figure::polar(id, title, "angle_deg", values).panels(["station"]));
    }
    table
}

fn motion_rows(result: &StationResult, line: Option<Azimuth>, axial: bool) -> Vec<ArrayRef> {
    let angles = result.angles;
    let separation = &result.separation;
    let motions = motion_columns(line, axial).into_iter();
    let unknowns: Vec<Option<usize>> = motions.map(|motion| separation.position(motion.quantity)).collect();
    let value = |unknown: &Option<usize>| {
        unknown.map_or_else(|| no_numbers(angles), |unknown| numbers(result.over_angle(unknown)))
    };
    let std = |unknown: &Option<usize>| {
        unknown.map_or_else(|| no_numbers(angles), |unknown| numbers(repeat_n(separation.angle_std(unknown), angles)))
    };
    let mut columns = vec![texts(repeat_n(result.station.as_str(), angles)), numbers(angles_deg(angles))];
    columns.extend(line.map(|line| numbers(repeat_n(line.degrees(), angles))));
    columns.extend(unknowns.iter().map(value));
    columns.extend(unknowns.iter().map(std));
    columns
}

fn harmonics() -> TableSpec {
    TableSpec::new(
        "harmonics",
        "coefficients c by order: form is Re Σ c e^{+inα}, motion Re Σ c e^{−inΦ}",
        vec![
            ColumnSpec::name("quantity", "form, face, x, y, tilt_x, tilt_y, along, tilt_along or z"),
            ColumnSpec::name("section", "id of the section; null for motion").or_null(),
            ColumnSpec::name("station", STATION),
            ColumnSpec::count("order", "1/rev", "undulations per revolution"),
            ColumnSpec::number("re", MIXED, "real part of c; NaN where it is not observable"),
            ColumnSpec::number("im", MIXED, "imaginary part of c; NaN where it is not observable"),
            ColumnSpec::number(
                "std",
                MIXED,
                "sqrt(E|delta|^2) of the error delta of c, both parts together; NaN where it is not known",
            ),
            ColumnSpec::flag("observable", "whether the layout separates this order"),
        ],
    )
    .figure(
        Figure::amplitudes("form-harmonics", "Harmonics of the form", "order", ["re", "im"], Some("std"))
            .panels(["station"])
            .curves(["section"])
            .only("quantity", ["form"]),
    )
    .figure(
        Figure::amplitudes("motion-harmonics", "Harmonics of the error motion", "order", ["re", "im"], Some("std"))
            .panels(["station"])
            .curves(["quantity"])
            .only("quantity", ["x", "y", "along", "z"]),
    )
}

/// Orders from 1, and 0 where a level is known.
fn harmonics_rows(result: &StationResult) -> Vec<ArrayRef> {
    let separation = &result.separation;
    let width = separation.unknowns.len();
    let orders = separation.estimate.len() / width.max(1);
    // The places of each unknown's rows in the separation.
    let rows: Vec<_> = (0..width)
        .map(|unknown| {
            let level = separation.estimate.get(unknown).is_some_and(|level| level.re != 0.0);
            (usize::from(!level)..orders).map(move |order| order * width + unknown)
        })
        .collect();
    let lengths = || rows.iter().map(ExactSizeIterator::len);
    let count = lengths().sum();
    let section = |quantity: &Quantity| separation.sections.get(quantity.section()?).map(|at| at.id.as_str());
    let observable = |place: usize| separation.observable.get(place).copied().unwrap_or(false);
    let number = |value: &dyn Fn(usize) -> f64| {
        let mut column = Vec::with_capacity(count);
        for places in &rows {
            column.extend(places.clone().map(|place| if observable(place) { value(place) } else { f64::NAN }));
        }
        numbers(column)
    };
    let each = || separation.unknowns.iter().zip(lengths());
    vec![
        texts(each().flat_map(|(quantity, length)| repeat_n(quantity.id(), length))),
        texts_or_null(each().flat_map(|(quantity, length)| repeat_n(section(quantity), length))),
        texts(repeat_n(result.station.as_str(), count)),
        counts(lengths().flat_map(|length| orders - length..orders)),
        number(&|place| separation.estimate[place].re),
        number(&|place| separation.estimate[place].im),
        number(&|place| separation.coefficient_std(place)),
        flags(rows.iter().cloned().flatten().map(observable)),
    ]
}

fn reading() -> TableSpec {
    TableSpec::new(
        "reading",
        "averaged readings, where the layout separates nothing",
        vec![
            ColumnSpec::name("station", STATION),
            ColumnSpec::name("setup", "id of the setup"),
            ColumnSpec::name("sensor", "id of the sensor"),
            ColumnSpec::number("angle_deg", "deg", "the spindle's angle").repeating(),
            ColumnSpec::number(
                "reading_um",
                "um",
                "averaged reading without its level: form, eccentricity and error motion together",
            ),
            ColumnSpec::number("std_um", "um", std_of("reading_um")).repeating(),
        ],
    )
    .optional()
    .figure(
        Figure::polar("reading", "Averaged reading", "angle_deg", [Measure::new("reading_um").with_std("std_um")])
            .panels(["station"])
            .curves(["setup", "sensor"]),
    )
}

fn reading_rows(result: &StationResult, rig: Option<&Rig>) -> Vec<ArrayRef> {
    let angles = result.angles;
    let channels = || {
        result.profiles.iter().flat_map(|profile| {
            profile.sensors.iter().enumerate().map(move |(channel, sensor)| (profile, channel, *sensor))
        })
    };
    let count = channels().count();
    let mut fourier = Fourier::new(angles);
    let mut readings = Vec::with_capacity(count * angles);
    for (profile, channel, _) in channels() {
        let mean = coefficients(profile, channel).into_iter().enumerate();
        let without_level = mean.map(|(order, value)| if order == 0 { Complex64::ZERO } else { value.conj() });
        readings.extend_from_slice(fourier.synthesise(without_level));
    }
    let std = |all: Option<Vec<f64>>| all.map_or(f64::NAN, |all| (0.5 * all.iter().skip(1).sum::<f64>()).sqrt());
    let repeated = |ids: Vec<String>| texts(ids.iter().flat_map(|id| repeat_n(id.as_str(), angles)));
    vec![
        texts(repeat_n(result.station.as_str(), count * angles)),
        repeated(channels().map(|(profile, ..)| setup_id(profile, rig)).collect()),
        repeated(channels().map(|(.., sensor)| sensor_id(sensor, rig)).collect()),
        numbers((0..count).flat_map(|_| angles_deg(angles))),
        numbers(readings),
        numbers(channels().flat_map(|(profile, channel, _)| repeat_n(std(variances(profile, channel)), angles))),
    ]
}

fn values() -> TableSpec {
    let uncertain = |name: &str, about: &str| {
        ColumnSpec::number(name, "the value's", format!("{about}; null where it is not known")).or_null()
    };
    let order = |name: &str, about: &str| ColumnSpec::count(name, "1/rev", about);
    TableSpec::new(
        VALUES,
        "the standards' values of sections, stations and the whole part",
        vec![
            ColumnSpec::name("station", "name of the axial station; null for the whole part").or_null(),
            ColumnSpec::name("section", "id of the section; null for a station or the whole part").or_null(),
            ColumnSpec::number("z_mm", "mm", "place of the section along the axis; null where there is none").or_null(),
            ColumnSpec::text("symbol", "the standard's symbol"),
            ColumnSpec::number("value", "the column unit", "the number"),
            ColumnSpec::text("unit", "its unit; empty for a number without one"),
            ColumnSpec::text("standard", "standard and clause, or paper and equation"),
            order("band_low_upr", "lowest order that it was computed over"),
            order("band_high_upr", "highest order that it was computed over; of a filter, where half passes"),
            ColumnSpec::text(
                "lost_orders",
                "orders of it that are lost and that are not in the value, as JSON; null where none is",
            )
            .or_null(),
            ColumnSpec::number(
                "weakened_above_upr",
                "1/rev",
                "a filter before the average passes less than half above, where the value's filter asks for more; null \
                 where nothing is missing",
            )
            .or_null(),
            order(
                "absent_above_upr",
                "highest order there is, where the value's filter passes 0.1 % or more above it; null where nothing is \
                 missing",
            )
            .or_null(),
            ColumnSpec::text("filter", "the filter applied"),
            ColumnSpec::text("reference", "what the profile was referred to"),
            ColumnSpec::number("coverage", "", "share of the profile or surface that was there"),
            uncertain("std", "standard uncertainty"),
            uncertain("low_95", "lower end of the 95 % interval"),
            uncertain("high_95", "upper end of the 95 % interval"),
            ColumnSpec::count("draws", "", "draws of the Monte Carlo; null without uncertainty").or_null(),
            ColumnSpec::text(
                "no_uncertainty",
                "why no uncertainty is stated; null where one is, or where the errors are not known",
            )
            .or_null(),
        ],
    )
}

fn values_rows(summary: &Summary) -> Vec<ArrayRef> {
    let rows = summary.placed_values();
    let uncertainty =
        |of: fn(&Uncertainty) -> f64| numbers_or_null(rows.iter().map(|row| row.value.uncertainty.as_ref().map(of)));
    let of_value = |of: fn(&Value) -> &str| texts(rows.iter().map(|row| of(row.value)));
    vec![
        texts_or_null(rows.iter().map(|row| row.station)),
        texts_or_null(rows.iter().map(|row| row.section)),
        numbers_or_null(rows.iter().map(|row| row.z_mm)),
        of_value(|value| &value.symbol),
        numbers(rows.iter().map(|row| row.value.value)),
        of_value(|value| &value.unit),
        of_value(|value| &value.source),
        counts(rows.iter().map(|row| row.value.band_upr[0])),
        counts(rows.iter().map(|row| row.value.band_upr[1])),
        texts_or_null(rows.iter().map(|row| {
            let lost = &row.value.lost_orders;
            (!lost.is_empty()).then(|| json!(lost).to_string())
        })),
        numbers_or_null(rows.iter().map(|row| row.value.weakened_above_upr)),
        counts_or_null(rows.iter().map(|row| row.value.absent_above_upr)),
        of_value(|value| &value.filter),
        of_value(|value| &value.reference),
        numbers(rows.iter().map(|row| row.value.coverage)),
        uncertainty(|uncertainty| uncertainty.std),
        uncertainty(|uncertainty| uncertainty.interval_95[0]),
        uncertainty(|uncertainty| uncertainty.interval_95[1]),
        counts_or_null(rows.iter().map(|row| row.value.uncertainty.as_ref().map(|uncertainty| uncertainty.draws))),
        texts_or_null(rows.iter().map(|row| row.value.no_uncertainty.as_deref())),
    ]
}

/// The table of a domain's own values; `of_form` where the result has form, whose values are in the table `values`.
#[must_use]
pub fn named_values(of_form: bool) -> TableSpec {
    TableSpec::new(
        // Beside those that are computed from form.
        if of_form { NAMED_VALUES } else { VALUES },
        "values of the result",
        vec![
            ColumnSpec::text("symbol", "the standard's symbol, or a short name"),
            ColumnSpec::name("of", "what it is of; null where the result has one only").or_null(),
            ColumnSpec::number("value", "the column unit", "the number; null where it is not observable").or_null(),
            ColumnSpec::number("std", "the column unit", "its standard uncertainty; null where it is not known")
                .or_null(),
            ColumnSpec::text("unit", "its unit; empty for a number without one"),
            ColumnSpec::text("about", "what it is, with standard and clause"),
        ],
    )
}

/// Rows of [`named_values`].
///
/// # Errors
/// Never in practice: the columns are of one length.
pub fn named_value_rows(values: &[NamedValue], of_form: bool) -> Result<TableRows> {
    let spec = named_values(of_form);
    let rows = spec.rows(vec![
        texts(values.iter().map(|value| &value.symbol)),
        texts_or_null(values.iter().map(|value| value.of.as_ref())),
        numbers_or_null(values.iter().map(|value| value.value)),
        numbers_or_null(values.iter().map(|value| value.std)),
        texts(values.iter().map(|value| &value.unit)),
        texts(values.iter().map(|value| &value.about)),
    ])?;
    Ok(TableRows { table: spec.name, rows })
}

/// The table of the effects that a result is corrected for.
#[must_use]
pub fn corrections() -> TableSpec {
    TableSpec::new(
        "corrections",
        "effects that the results are corrected for, one row a parameter",
        vec![
            ColumnSpec::text("effect", "id of the effect"),
            ColumnSpec::text("targets", "where it acts; of a confounded set, one representative"),
            ColumnSpec::text("confounded_with", "what these data cannot separate it from; empty for nothing"),
            ColumnSpec::flag("known", "whether it was declared with its size"),
            ColumnSpec::text("parameter", "name of the parameter"),
            ColumnSpec::number("value", "the column unit", "its value"),
            ColumnSpec::number("std", "the column unit", "its standard uncertainty; null where it is not known")
                .or_null(),
            ColumnSpec::text("unit", "unit of the parameter"),
        ],
    )
    .optional()
}

/// Rows of [`corrections`]; none where results are corrected for nothing.
///
/// # Errors
/// Never in practice: the columns are of one length.
pub fn correction_rows(effects: &[Correction]) -> Result<Option<TableRows>> {
    if effects.is_empty() {
        return Ok(None);
    }
    let each = || effects.iter().flat_map(|one| one.parameters.iter().map(move |parameter| (one, parameter)));
    let spec = corrections();
    let rows = spec.rows(vec![
        texts(each().map(|(one, _)| &one.effect)),
        texts(each().map(|(one, _)| one.targets.join(" "))),
        texts(each().map(|(one, _)| one.confounded_with.join("; "))),
        flags(each().map(|(one, _)| one.known)),
        texts(each().map(|(_, parameter)| &parameter.name)),
        numbers(each().map(|(_, parameter)| parameter.value)),
        numbers_or_null(each().map(|(_, parameter)| parameter.std)),
        texts(each().map(|(_, parameter)| &parameter.unit)),
    ])?;
    Ok(Some(TableRows { table: spec.name, rows }))
}

/// What the stations hold, as they come in.
#[derive(Debug, Clone, Default)]
struct Content {
    lost_form: BTreeSet<usize>,
    lost_motion: BTreeSet<usize>,
    level_known: bool,
    highest_order: usize,
    highest_on_angles: usize,
    line: Option<Azimuth>,
    form_band_upr: Option<[usize; 2]>,
}

impl Content {
    fn note(&mut self, result: &StationResult) {
        let separation = &result.separation;
        let highest = separation.max_order();
        for (unknown, quantity) in separation.unknowns.iter().enumerate() {
            let lost = if quantity.is_form() { &mut self.lost_form } else { &mut self.lost_motion };
            lost.extend(separation.lost_orders(unknown));
            self.level_known |= separation.coefficients(unknown).next().is_some_and(|level| level.re != 0.0);
            let lowest = separation.coefficients(unknown).position(|value| value.norm_sqr() > 0.0);
            if let (true, Some(lowest)) = (quantity.is_form(), lowest) {
                let [low, high] = self.form_band_upr.unwrap_or([lowest, highest]);
                self.form_band_upr = Some([low.min(lowest), high.max(highest)]);
            }
        }
        self.line = self.line.or(separation.azimuth());
        self.highest_order = self.highest_order.max(highest);
        self.highest_on_angles = self.highest_on_angles.max(highest.min(fourier::max_order(result.angles)));
    }

    fn about(&self, summary: &Summary) -> About {
        let lowest = usize::from(!self.level_known);
        let lost_form: BTreeSet<_> = self.lost_form.iter().chain(&summary.lost_orders.form).collect();
        let lost_motion: BTreeSet<_> = self.lost_motion.iter().chain(&summary.lost_orders.motion).collect();
        let notes = [
            ("lost_orders", json!({ "form": lost_form, "motion": lost_motion }).to_string()),
            ("band_upr", json!([lowest, self.highest_order]).to_string()),
            ("band_over_angle_upr", json!([lowest, self.highest_on_angles]).to_string()),
        ];
        let line = self.line.map(|line| ("motion_along_deg", json!(line.degrees()).to_string()));
        let notes = notes.into_iter().chain(line).map(|(key, value)| (key.to_owned(), value)).collect();
        About { convention: format!("{CONVENTION} {BANDS}"), notes, form_band_upr: self.form_band_upr }
    }
}

/// What `band_upr` and `band_over_angle_upr` are.
const BANDS: &str =
    "band_upr: lowest and highest order of the harmonics; band_over_angle_upr: of form and motion over angle.";

fn angles_deg(angles: usize) -> impl Iterator<Item = f64> {
    (0..angles).map(move |index| 360.0 * index as f64 / angles as f64)
}
