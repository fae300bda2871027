//! From a file's columns to the points that a separator takes.

use std::path::Path;

use runout_core::{
    Error, ErrorKind, Result,
    fault::known_names,
    input_file::InputFile,
    points::{Column, Labels, PointColumn, PointKind, Points, Trace},
};

use crate::{Cell, PointsConfig, RawColumn, RawTable, axis, unit};

/// What marks a number may have.
const MARKS: &str = "numbers have a decimal point, or a decimal comma where columns are separated by semicolon or tab, and no marks \
    between thousands";

/// Cells are equal to a selected number within this share of it, or this much below 1: half the last digit of most exports.
const SAME: f64 = 1e-6;
/// Two names as near as this (Jaro-Winkler) are one with a slip of the pen.
const ALIKE: f64 = 0.93;

/// Numbers of one quantity in two units differ by less than this share of the largest: one of them has few digits.
const ROUNDED: f64 = 0.01;

/// Columns that coordinates give about an axis.
const ABOUT: [&str; 3] = ["angle_deg", "radius_mm", "z_mm"];

pub(crate) fn points(
    table: RawTable,
    input: &InputFile,
    config: &PointsConfig,
    wanted: &[PointColumn],
) -> Result<Points> {
    let path = input.path();
    let table = renamed(table, path, config)?;
    let file = Raw { file: path.display().to_string(), has_commas: has_commas(&table), table };
    let coordinates = file.coordinates(wanted);
    if let (Some(_), None) = (config.axis, coordinates) {
        let problem = "`axis` turns x_mm, y_mm and z_mm into places about an axis; the file lacks one of them, or the separator takes none";
        return Err(Error::new("read", file.file, problem));
    }
    file.has_all(wanted, coordinates.is_some())?;
    let rows = file.selected(config)?;
    if rows.is_empty() {
        let problem = if file.table.rows == 0 { "it has no points" } else { "no point has the values of `where`" };
        return Err(Error::new("read", file.file, problem));
    }
    let mut points = Points { input: path.to_path_buf(), opened: vec![input.clone()], ..Points::default() };
    if let Some(places) = coordinates {
        file.about_axis(places, &rows, config, wanted, &mut points)?;
    }
    let mut traces = [None, None];
    for column in wanted.iter().filter(|column| coordinates.is_none() || !ABOUT.contains(&column.name)) {
        let Some((place, factor)) = file.found(column.name)? else { continue };
        if column.optional && rows.iter().all(|row| file.is_empty(place, *row)) {
            continue;
        }
        match column.kind {
            PointKind::Number => {
                let values = rows.iter().map(|row| Ok(factor * file.number(place, *row)?)).collect::<Result<_>>()?;
                points.columns.push(Column { name: column.name.into(), values });
            }
            PointKind::Flag => {
                let values = rows.iter().map(|row| file.flag(place, *row)).collect::<Result<_>>()?;
                points.columns.push(Column { name: column.name.into(), values });
            }
            PointKind::Label => {
                let values = rows.iter().map(|row| file.text(place, *row)).collect::<Result<_>>()?;
                points.labels.push(Labels { name: column.name.into(), values });
            }
            PointKind::Trace => traces[0] = Some(place),
            PointKind::TraceKind => traces[1] = Some(place),
        }
    }
    points.traces = match traces[0] {
        Some(id) => file.traces(&rows, id, traces[1])?,
        None => vec![Trace { id: "points".into(), kind: "points".into(), points: 0..rows.len() }],
    };
    Ok(points)
}

/// The table with the names that `columns` gives.
fn renamed(mut table: RawTable, path: &Path, config: &PointsConfig) -> Result<RawTable> {
    let refuse = |problem: String| Error::new("read", path.display().to_string(), problem);
    for (from, to) in &config.columns {
        if let Some(other) = table.names.iter().position(|name| name == to && name != from) {
            // What the separator's name is given to stands in the place of a column that has it by chance.
            table.names[other] = format!("{to} of the file");
        }
        let Some(place) = table.names.iter().position(|name| name == from) else {
            let problem = format!("`columns` names `{from}`, which the file does not have");
            return Err(refuse(problem).help(known_names(from, table.names.iter().map(String::as_str))));
        };
        table.names[place].clone_from(to);
    }
    Ok(table)
}

/// Rows that show which decimal mark a file has.
const MARKED_ROWS: usize = 1000;

/// Whether numbers of a table have decimal commas: a point in others then stands between thousands.
fn has_commas(table: &RawTable) -> bool {
    let is_marked = |text: &String| text.contains(',') && text.replace(',', ".").parse::<f64>().is_ok();
    let marked = |column: &RawColumn| match column {
        RawColumn::Texts(texts) => texts.iter().take(MARKED_ROWS).any(is_marked),
        RawColumn::Numbers(_) => false,
    };
    table.decimal_comma && table.columns.iter().any(marked)
}

/// A file with its name for messages.
struct Raw {
    file: String,
    has_commas: bool,
    table: RawTable,
}

impl Raw {
    fn place(&self, name: &str) -> Option<usize> {
        self.table.names.iter().position(|known| known == name)
    }

    /// The column of a name, or the one whose name differs by the unit alone, with the factor to the unit of the name.
    fn found(&self, name: &str) -> Result<Option<(usize, f64)>> {
        if let Some(place) = self.place(name) {
            return Ok(Some((place, 1.0)));
        }
        let names = self.table.names.iter().enumerate();
        let mut found = names.filter_map(|(place, known)| Some((place, unit::factor(known, name)?)));
        match (found.next(), found.next()) {
            (Some((one, _)), Some((other, _))) => {
                let problem =
                    format!("both `{}` and `{}` could be `{name}`", self.table.names[one], self.table.names[other]);
                Err(Error::new("read", &self.file, problem).help("`columns` in [load] says which one it is"))
            }
            (found, _) => Ok(found),
        }
    }

    /// Places of x, y and z where the separator takes places about an axis and the file has coordinates in their place.
    fn coordinates(&self, wanted: &[PointColumn]) -> Option<[usize; 3]> {
        let takes = ABOUT[..2].iter().all(|name| wanted.iter().any(|column| column.name == *name));
        let place = |name: &str| self.found(name).ok().flatten().map(|(place, _)| place);
        let lacks = place(ABOUT[0]).is_none() && place(ABOUT[1]).is_none();
        (takes && lacks).then_some(())?;
        Some([place("x_mm")?, place("y_mm")?, place("z_mm")?])
    }

    /// Adds the columns about the axis that is found from coordinates.
    fn about_axis(
        &self,
        places: [usize; 3],
        rows: &[usize],
        config: &PointsConfig,
        wanted: &[PointColumn],
        points: &mut Points,
    ) -> Result<()> {
        let factors =
            ["x_mm", "y_mm", "z_mm"].map(|name| self.found(name).ok().flatten().map_or(1.0, |(_, factor)| factor));
        let mut coordinates = Vec::with_capacity(rows.len());
        for row in rows {
            let mut point = [0.0; 3];
            for ((number, place), factor) in point.iter_mut().zip(places).zip(factors) {
                *number = factor * self.number(place, *row)?;
            }
            coordinates.push(point);
        }
        let about = axis::about(&coordinates, config.axis)
            .map_err(|problem| Error::new("find the axis of", &self.file, problem).of(ErrorKind::UnsuitableData))?;
        points.remarks.push(about.remark);
        points
            .columns
            .extend(about.columns.into_iter().filter(|one| wanted.iter().any(|column| column.name == one.name)));
        Ok(())
    }

    /// Refuses a file that lacks a column, has one twice, or has one whose name is nearly that of an optional one.
    fn has_all(&self, wanted: &[PointColumn], has_coordinates: bool) -> Result<()> {
        let names = &self.table.names;
        let refuse = |problem: String| {
            let (optional, needed): (Vec<_>, Vec<_>) = wanted.iter().partition(|column| column.optional);
            let list = |columns: Vec<&PointColumn>| {
                columns.into_iter().map(|column| column.name).collect::<Vec<_>>().join(", ")
            };
            let besides = if optional.is_empty() { String::new() } else { format!("; optional: {}", list(optional)) };
            let help = format!("the columns are {}{besides}; `columns` in [load] gives the file's names", list(needed));
            Error::new("read", format!("{}, line 1", self.file), problem).help(help)
        };
        for column in wanted.iter().filter(|column| !has_coordinates || !ABOUT.contains(&column.name)) {
            match names.iter().filter(|name| *name == column.name).count() {
                0 if self.found(column.name)?.is_some() => {}
                0 if !column.optional => {
                    let unit = if column.unit.is_empty() { String::new() } else { format!(", in {}", column.unit) };
                    let problem = format!("the column `{}` is missing ({}{unit})", column.name, column.about);
                    return Err(refuse(problem));
                }
                0 => {
                    let unknown = || names.iter().filter(|name| wanted.iter().all(|known| known.name != **name));
                    let alike = |name: &&String| strsim::jaro_winkler(name, column.name) > ALIKE;
                    if let Some(name) = unknown().find(alike) {
                        let problem = format!("unknown column `{name}`: is it `{}`?", column.name);
                        return Err(refuse(problem));
                    }
                }
                1 => self.agrees(column.name)?,
                _ => return Err(refuse(format!("the column `{}` is there twice", column.name))),
            }
        }
        Ok(())
    }

    /// Refuses a column beside which the same quantity stands in another unit, with other numbers.
    fn agrees(&self, name: &str) -> Result<()> {
        let Some(own) = self.place(name) else { return Ok(()) };
        let others = self.table.names.iter().enumerate().filter(|(other, _)| *other != own);
        for (other, alias, factor) in others.filter_map(|(at, alias)| Some((at, alias, unit::factor(alias, name)?))) {
            let pair = |row: usize| Some((row, self.number(own, row).ok()?, self.number(other, row).ok()?));
            let pairs: Vec<(usize, f64, f64)> = (0..self.table.rows).filter_map(pair).collect();
            let largest = pairs.iter().map(|(_, one, _)| one.abs()).fold(0.0, f64::max);
            let differs = |(_, one, same): &&(usize, f64, f64)| (one - factor * same).abs() > ROUNDED * largest;
            if let Some((row, one, same)) = pairs.iter().find(differs) {
                let problem = format!("`{name}` is {one} and `{alias}` is {same}: which one is meant?");
                let help =
                    format!("rename the other one by `columns` in [load]: columns = {{ \"{alias}\" = \"unused\" }}");
                return Err(self.refuse(other, *row, &problem).help(help));
            }
        }
        Ok(())
    }

    /// The rows that `where` selects.
    fn selected(&self, config: &PointsConfig) -> Result<Vec<usize>> {
        let mut rows: Vec<usize> = (0..self.table.rows).collect();
        for (name, value) in &config.selected {
            let place = self.place(name).ok_or_else(|| {
                let problem = format!("`where` names `{name}`, which the file does not have");
                let known = self.table.names.iter().map(String::as_str);
                Error::new("read", &self.file, problem).help(known_names(name, known))
            })?;
            let mut kept = Vec::with_capacity(rows.len());
            for row in rows {
                let equal = match value {
                    Cell::Number(number) => (self.number(place, row)? - number).abs() <= SAME * number.abs().max(1.0),
                    Cell::Text(text) => self.text(place, row)? == *text,
                };
                if equal {
                    kept.push(row);
                }
            }
            rows = kept;
        }
        Ok(rows)
    }

    /// Stretches of rows of one trace. A trace does not come back, and is of one kind.
    fn traces(&self, rows: &[usize], id: usize, kind: Option<usize>) -> Result<Vec<Trace>> {
        let mut traces: Vec<Trace> = Vec::new();
        for (index, row) in rows.iter().enumerate() {
            let name = self.text(id, *row)?;
            let of = kind.map_or_else(|| Ok(name.clone()), |place| self.text(place, *row))?;
            match traces.last_mut() {
                Some(last) if last.id == name && last.kind == of => last.points.end = index + 1,
                _ => {
                    if let Some(known) = traces.iter().find(|trace| trace.id == name) {
                        return Err(self.again(known, &of, *row, (id, kind)));
                    }
                    traces.push(Trace { id: name, kind: of, points: index..index + 1 });
                }
            }
        }
        Ok(traces)
    }

    /// Why a trace cannot come back.
    fn again(&self, known: &Trace, of: &str, row: usize, (id, kind): (usize, Option<usize>)) -> Error {
        let name = &known.id;
        match kind {
            Some(kind) if known.kind != of => {
                let problem = format!("trace {name} is of {} {} above, not {of}", self.table.names[kind], known.kind);
                self.refuse(kind, row, &problem).help("give each trace a name of its own")
            }
            _ => {
                let problem = format!("trace {name} has ended above; the points of a trace follow one another");
                self.refuse(id, row, &problem)
            }
        }
    }

    fn is_empty(&self, place: usize, row: usize) -> bool {
        match &self.table.columns[place] {
            RawColumn::Texts(texts) => texts[row].is_empty(),
            RawColumn::Numbers(numbers) => numbers[row].is_nan(),
        }
    }

    fn text(&self, place: usize, row: usize) -> Result<String> {
        let text = match &self.table.columns[place] {
            RawColumn::Texts(texts) => texts[row].clone(),
            RawColumn::Numbers(numbers) if numbers[row].is_nan() => String::new(),
            RawColumn::Numbers(numbers) => numbers[row].to_string(),
        };
        if text.is_empty() { Err(self.refuse(place, row, "it is empty")) } else { Ok(text) }
    }

    fn number(&self, place: usize, row: usize) -> Result<f64> {
        let text = match &self.table.columns[place] {
            RawColumn::Numbers(numbers) if numbers[row].is_finite() => return Ok(numbers[row]),
            RawColumn::Numbers(numbers) if numbers[row].is_nan() => {
                return Err(self.refuse(place, row, "expected a finite number, found null or NaN"));
            }
            RawColumn::Numbers(numbers) => numbers[row].to_string(),
            RawColumn::Texts(_) => self.text(place, row)?,
        };
        if self.has_commas && text.contains('.') {
            let problem = format!("expected a number with a decimal comma as in the other rows, found `{text}`");
            return Err(self.refuse(place, row, &problem).help(MARKS));
        }
        let parsed = if self.table.decimal_comma { text.replace(',', ".").parse() } else { text.parse() };
        match parsed {
            Ok(number) if f64::is_finite(number) => Ok(number),
            _ if text.is_empty() => Err(self.refuse(place, row, "expected a finite number, found an empty cell")),
            _ => {
                let error = self.refuse(place, row, &format!("expected a finite number, found `{text}`"));
                let marks = text.contains(',') && text.bytes().any(|byte| byte.is_ascii_digit());
                Err(if marks { error.help(MARKS) } else { error })
            }
        }
    }

    fn flag(&self, place: usize, row: usize) -> Result<f64> {
        let refuse =
            |found: &str| Err(self.refuse(place, row, &format!("expected 0 (used) or 1 (left out), found `{found}`")));
        match self.text(place, row)?.as_str() {
            "0" => Ok(0.0),
            "1" => Ok(1.0),
            other => refuse(other),
        }
    }

    fn refuse(&self, place: usize, row: usize, problem: &str) -> Error {
        let at =
            self.table.lines.get(row).map_or_else(|| format!("row {} from 1", row + 1), |line| format!("line {line}"));
        let name = &self.table.names[place];
        Error::new("read", format!("{}, {at}, column {} ({name})", self.file, place + 1), problem)
            .of(ErrorKind::DamagedData)
    }
}

#[cfg(test)]
mod tests;
