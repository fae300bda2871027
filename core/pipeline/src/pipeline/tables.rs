//! The tables of form and motion: their columns, and the rows of one station.

mod circles;
mod content;
mod reading;
mod residual;
mod values;

use std::iter::repeat_n;

use super::turn_tables;
use crate::{
    atomic_file::PendingFile,
    stage::{About, Completed, Export, ResultInfo},
    summary::Summary,
};
use circles::{circle_rows, circles};
use content::Content;
use reading::{reading, reading_rows};
use residual::{residual, residual_rows};
use runout_error::Result;
use runout_evaluate::EvaluatedStation;
use runout_table::{
    ArrayRef, ColumnSpec, Figure, Measure, TableRows, TableSpec, counts, flags, no_numbers, numbers, stretches,
    texts_or_null,
};
use runout_turning::station::StationResult;
use runout_turning::{
    azimuth::Azimuth,
    rig::Rig,
    separation::{ALONG_COLUMN, Assessment, MotionColumn, Quantity, motion_columns},
    surface::Surface,
};
pub(super) use values::holds_values;
pub(crate) use values::{consistency, consistency_rows, correction_rows, corrections, named_value_rows, named_values};
use values::{values, values_rows};

const STATION: &str = "name of the axial station";
const SECTION: &str = "id of the section";
/// Name of the table of reference circles.
const CIRCLES: &str = "circles";
/// Id of the figure of the form's harmonics.
pub(super) const FORM_HARMONICS: &str = "form-harmonics";
/// Unit of coefficients, whose rows are of all quantities.
const MIXED: &str = "um; urad for tilt";

/// The tables of form, motion and the values that are computed from them.
#[derive(Debug, Clone)]
pub struct StationTables {
    form: TableSpec,
    circles: TableSpec,
    motion: TableSpec,
    harmonics: TableSpec,
    reading: TableSpec,
    residual: TableSpec,
    values: TableSpec,
    /// Whether residuals of readings are wanted: they are most of a result's rows.
    with_residuals: bool,
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
            circles: circles(),
            motion: motion(line, axial),
            harmonics: harmonics(),
            reading: reading(),
            residual: residual(),
            values: values(),
            with_residuals: false,
            turns: turn_tables::specs(rig.map_or(&[], |rig| &rig.bearings)),
            every: 1,
            taken: 0,
            line,
            axial,
            rig: rig.cloned(),
            content: Content::default(),
        }
    }

    /// The tables for so many stations: of many, each second, third, … has tables of error motion turn by turn.
    #[must_use]
    pub fn of_stations(self, stations: usize) -> Self {
        Self { every: stations.div_ceil(turn_tables::STATIONS).max(1), ..self }
    }

    /// Adds the residual of each averaged reading.
    pub(super) fn with_residuals(&mut self) {
        self.with_residuals = true;
    }

    /// What of error motion turn by turn is left out, where something is.
    #[must_use]
    pub fn remark(&self) -> Option<String> {
        let every = self.every;
        let any = self.taken > 0 && every > 1;
        any.then(|| {
            format!(
                "plots of all turns and spectra are of 1 in {every} stations: a result has at most {}",
                turn_tables::STATIONS
            )
        })
    }

    /// All tables, also those that a result may lack.
    #[must_use]
    pub fn specs(&self) -> Vec<TableSpec> {
        let mut all: Vec<TableSpec> =
            [&self.form, &self.circles, &self.motion, &self.harmonics, &self.reading, &self.residual]
                .map(Clone::clone)
                .into();
        all.extend(self.turns.iter().cloned());
        all.push(self.values.clone());
        all
    }

    /// Rows of one station with its reference circles.
    ///
    /// # Errors
    /// As [`rows`](Self::rows).
    pub fn rows_of(&mut self, station: &EvaluatedStation, wanted: bool) -> Result<Vec<TableRows>> {
        let mut all = self.rows(&station.result, wanted)?;
        if wanted && station.circles.iter().any(|circles| !circles.is_empty()) {
            all.push(TableRows { table: self.circles.name.clone(), rows: self.circles.rows(circle_rows(station))? });
        }
        Ok(all)
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
        if separation.has_no_observable_form() {
            tables.push((&self.reading, reading_rows(result, self.rig.as_ref())));
        }
        if self.with_residuals && !separation.residual.by_reading.is_empty() {
            tables.push((&self.residual, residual_rows(result, self.rig.as_ref())));
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
            .curves(["section"])
            .circles(CIRCLES),
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
        stretches(sections.iter().map(|(_, at)| (at.id.as_str(), angles))),
        stretches([(result.station.as_str(), rows)]),
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
    let mut columns = vec![stretches([(result.station.as_str(), angles)]), numbers(angles_deg(angles))];
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
        Figure::amplitudes(FORM_HARMONICS, "Harmonics of the form", "order", ["re", "im"], Some("std"))
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
        stretches(each().map(|(quantity, length)| (quantity.id(), length))),
        texts_or_null(each().flat_map(|(quantity, length)| repeat_n(section(quantity), length))),
        stretches([(result.station.as_str(), count)]),
        counts(lengths().flat_map(|length| orders - length..orders)),
        number(&|place| separation.estimate[place].re),
        number(&|place| separation.estimate[place].im),
        number(&|place| separation.coefficient_std(place)),
        flags(rows.iter().cloned().flatten().map(observable)),
    ]
}

fn angles_deg(angles: usize) -> impl Iterator<Item = f64> {
    (0..angles).map(move |index| 360.0 * index as f64 / angles as f64)
}
