//! Text: a point a line (`x y z`), or a matrix of heights with a row a line.
//!
//! Numbers are separated by blanks, tabs, semicolons or commas; the first three allow a decimal comma. Lines before the first number are a
//! header, which may name columns (`y [mm]; x [mm]; z [nm]; intensity`), units (`# Value units: m`), the size of a matrix (`# Width: 20.0 µm`) and the
//! height of what was not measured (`NODATA_value -9999`). Lines that begin with `#` or `%` are comments. What is no number (`NaN`, `BAD`, `No Data`,
//! `***`) or no height (1.7e38) is a point that was not measured.

use std::io::{BufRead, BufReader, Read};

use runout_core::{Error, Result, height_grid::HeightGrid, length_unit::micrometres, numerics::number::significant};

use crate::{
    input::Input,
    map::{MOST_POINTS, Map, NM_PER_UM, Wanted, checked_size, damaged, failed, places},
};

/// What separates cells that may be empty.
const SEPARATORS: [char; 3] = [';', '\t', ','];
/// Longest line: a row of a million points.
const LINE: u64 = 32 << 20;
/// Most lines before the first number.
const HEADER: usize = 200;
/// Columns of points.
const POINT: usize = 3;
/// Cells from which a line is a row where half of them are numbers, whatever the first one is.
const ROW: usize = 8;
/// How texts of two words say that there is no height; the words are one mark then.
const NO_DATA: &str = "No Data";
/// Above, a number is a mark for a missing height and none of a part.
const NO_HEIGHT: f64 = 1e30;
/// Sizes in header and configuration that differ by more than this share contradict each other.
const SAME_SIZE: f64 = 0.01;

/// What the header of a file says.
#[derive(Debug, Default)]
struct Header {
    /// Units by place: of x, y and z where three are named, else that of heights last.
    units: Vec<String>,
    /// Width and height of a matrix, in mm.
    size_mm: [Option<f64>; 2],
    value_unit: Option<String>,
    /// Names of columns with their units, where x, y and z are among them.
    columns: Vec<(String, Option<String>)>,
    not_measured: Option<f64>,
}

impl Header {
    fn line(&mut self, line: &str) {
        let line = line.trim_start_matches(['#', '%']).trim();
        if let Some((name, value)) = line.split_once([':', '=']) {
            let (number, unit) = value.trim().split_once(char::is_whitespace).unwrap_or((value.trim(), ""));
            let length = || Some(1e-3 * number.replace(',', ".").parse::<f64>().ok()? * micrometres(unit)?);
            match name.trim().to_ascii_lowercase().as_str() {
                "width" => self.size_mm[0] = length(),
                "height" => self.size_mm[1] = length(),
                "value units" | "z unit" | "units" | "unit" => self.value_unit = Some(value.trim().to_owned()),
                _ => {}
            }
        }
        if let Some((_, value)) = line.split_once(char::is_whitespace).filter(|(name, _)| is_no_data(name)) {
            self.not_measured = value.trim_start_matches([' ', ':', '=']).trim().parse().ok();
        }
        let columns = named_columns(line);
        if axes(&columns).is_some() {
            self.columns = columns;
        }
        let bracketed = line.split(['[', '(']).skip(1).filter_map(|part| part.split([']', ')']).next());
        self.units.extend(bracketed.filter(|unit| micrometres(unit).is_some()).map(str::to_owned));
    }
}

fn is_no_data(name: &str) -> bool {
    name.to_ascii_lowercase().starts_with("nodata")
}

/// Words of a line, each with the unit in brackets behind it.
fn named_columns(line: &str) -> Vec<(String, Option<String>)> {
    let mut columns: Vec<(String, Option<String>)> = Vec::new();
    for (place, part) in line.split(['[', '(']).enumerate() {
        let (unit, words) = part.split_once([']', ')']).filter(|_| place > 0).unwrap_or(("", part));
        if let Some(last) = columns.last_mut().filter(|_| !unit.is_empty()) {
            last.1 = Some(unit.trim().to_owned());
        }
        let words = words.split(|c: char| c.is_whitespace() || SEPARATORS.contains(&c)).filter(|word| !word.is_empty());
        columns.extend(words.map(|word| (word.to_lowercase(), None)));
    }
    columns
}

/// Places of x, y and z (or the height) among columns, each of which there is once.
fn axes(columns: &[(String, Option<String>)]) -> Option<[usize; 3]> {
    let place = |names: &[&str]| {
        let mut found = columns.iter().enumerate().filter(|(_, (name, _))| names.contains(&name.as_str()));
        found.next().map(|(place, _)| place).filter(|_| found.next().is_none())
    };
    Some([place(&["x"])?, place(&["y"])?, place(&["z", "height"])?])
}

/// Reads a file.
pub(crate) fn read(input: &Input, wanted: &Wanted) -> Result<Map> {
    let shown = &input.shown;
    let mut file = BufReader::new(input.open()?);
    let (mut header, mut numbers, mut width, mut lines) = (Header::default(), Vec::new(), 0, 0_usize);
    // Lines before the first number, and whether each row ends with a separator.
    let (mut before, mut ended) = (Vec::new(), true);
    // Tables that blank lines part.
    let (mut tables, mut is_parted) = (1, false);
    let mut bytes = Vec::new();
    loop {
        bytes.clear();
        let read = file.by_ref().take(LINE).read_until(b'\n', &mut bytes).map_err(|error| failed(shown, error))?;
        if read == 0 {
            break;
        }
        lines += 1;
        let line = String::from_utf8_lossy(&bytes);
        // Tabs are left: they stand beside empty cells.
        let line = line.trim_start_matches('\u{feff}').trim_matches([' ', '\n', '\r']);
        if line.is_empty() {
            is_parted = width > 0;
            continue;
        }
        if line.starts_with(['#', '%']) {
            header.line(line);
            continue;
        }
        if width == 0 && !begins_with_number(line) {
            before.push(line.to_owned());
            if lines > HEADER {
                return Err(no_map(shown));
            }
            continue;
        }
        if width == 0 {
            cells(line, |_| width += 1);
            for line in before.drain(..) {
                // A row whose first point was not measured is none of the header.
                if width > POINT && is_row(&line, width) {
                    cells(&line, |number| numbers.push(number));
                    ended &= line.ends_with(SEPARATORS);
                } else {
                    header.line(&line);
                }
            }
        }
        tables += usize::from(std::mem::take(&mut is_parted));
        let known = numbers.len();
        cells(line, |number| numbers.push(number));
        let found = numbers.len() - known;
        ended &= line.ends_with(SEPARATORS);
        if found != width {
            return Err(damaged(
                &format!("{shown}, line {lines}"),
                format!("expected {width} numbers as in the lines above, found {found}"),
            ));
        }
        if numbers.len() > 3 * MOST_POINTS {
            return Err(damaged(shown, format!("it has more than {MOST_POINTS} points")));
        }
    }
    if width == 0 || numbers.is_empty() {
        return Err(no_map(shown));
    }
    if ended && width > 1 {
        numbers = numbers.chunks(width).flat_map(|row| &row[..width - 1]).copied().collect();
        width -= 1;
    }
    if let Some(missing) = header.not_measured {
        numbers
            .iter_mut()
            .filter(|number| (**number - missing).abs() <= f64::EPSILON * missing.abs())
            .for_each(|number| *number = f64::NAN);
    }
    let named = axes(&header.columns).filter(|_| header.columns.len() == width);
    if named.is_none() {
        // Words of a sentence, or names of other columns than there are.
        header.columns.clear();
    }
    let has_size = wanted.step_mm.iter().any(Option::is_some) || header.size_mm.iter().any(Option::is_some);
    let grid = match named {
        Some(places) => points(&header, &numbers, [width, places[0], places[1], places[2]], wanted, shown),
        None if width == POINT && !has_size => points(&header, &numbers, [POINT, 0, 1, 2], wanted, shown),
        None if tables > 1 && numbers.len() / width > tables => Err(damaged(
            shown,
            format!("blank lines part its rows into {tables} tables; one is read: leave out the others"),
        )),
        None => matrix(&header, numbers, width, wanted, shown),
    }?;
    Ok(Map { format: "text", grid, layers: vec!["heights".into()], about: Vec::new(), remarks: Vec::new() })
}

fn no_map(shown: &str) -> Error {
    let help = "maps are X3P, SDF, SUR, HDF5 (runout-surface), or text with `x y z` or a row of heights a line";
    damaged(shown, "it has no table of numbers: it is of none of the formats of maps").help(help)
}

/// Whether a line is of the table: it begins with a number, or half of many cells are numbers.
fn begins_with_number(line: &str) -> bool {
    let mut all = Vec::new();
    cells(line, |number| all.push(number));
    let known = all.iter().filter(|number| number.is_finite()).count();
    all.first().is_some_and(|first| first.is_finite()) || (all.len() >= ROW && 2 * known >= all.len())
}

/// Whether a line without a number at its beginning is a row of so many cells: some are numbers, or all say the same.
fn is_row(line: &str, width: usize) -> bool {
    let mut all = Vec::new();
    cells(line, |number| all.push(number));
    let mut words = line.split([';', '\t', ',', ' ']).map(str::trim).filter(|word| !word.is_empty());
    let first = words.next();
    let alike = all.iter().all(|number| number.is_nan()) && words.all(|word| Some(word) == first);
    all.len() == width && (alike || all.iter().any(|number| number.is_finite()))
}

/// Gives the numbers of a line, NaN for what is none.
fn cells(line: &str, mut each: impl FnMut(f64)) {
    let separator = SEPARATORS[..2].iter().copied().find(|separator| line.contains(*separator));
    let blanks = separator.is_none() && line.split_whitespace().nth(1).is_some();
    let comma = separator.is_none() && line.contains(',') && (!blanks || line.contains(", "));
    let parse = |text: &str| {
        let text = text.trim();
        if comma { text.parse() } else { text.replace(',', ".").parse() }
            .ok()
            .filter(|number: &f64| number.abs() < NO_HEIGHT)
            .unwrap_or(f64::NAN)
    };
    match separator {
        Some(separator) => line.split(separator).for_each(|text| each(parse(text))),
        None if comma => line.split(',').for_each(|text| each(parse(text))),
        None if line.contains(NO_DATA) => {
            line.replace(NO_DATA, "NaN").split_whitespace().for_each(|text| each(parse(text)));
        }
        None => line.split_whitespace().for_each(|text| each(parse(text))),
    }
}

/// Points on a grid: rows of so many columns, of which these are x, y and z.
fn points(
    header: &Header,
    numbers: &[f64],
    [width, columns @ ..]: [usize; 4],
    wanted: &Wanted,
    shown: &str,
) -> Result<HeightGrid> {
    let unit = |place: usize| {
        let of_column = header.columns.get(columns[place]).and_then(|(_, unit)| unit.as_ref());
        let named = of_column.or(header.units.get(place).filter(|_| header.units.len() == POINT));
        let unit = named.or(header.value_unit.as_ref().filter(|_| place == 2)).or(wanted.unit.as_ref());
        unit.and_then(|unit| micrometres(unit)).ok_or_else(|| {
            let problem = format!("its header does not name the unit of {}", ["x", "y", "z"][place]);
            Error::new("read", shown, problem).help(
                "`unit = \"mm\"` in [load] gives that of x, y and z; a header `x [mm] y [mm] z [um]` each its own",
            )
        })
    };
    let [x_um, y_um, z_um] = [unit(0)?, unit(1)?, unit(2)?];
    let all = numbers.chunks_exact(width).map(|row| columns.map(|column| row[column]));
    let placed: Vec<[f64; POINT]> = all.filter(|point| point.iter().all(|number| number.is_finite())).collect();
    let column = |place: usize, um: f64| placed.iter().map(|point| 1e-3 * um * point[place]).collect::<Vec<f64>>();
    let (x, y) = (column(0, x_um), column(1, y_um));
    let places = places(&x, &y, shown)?;
    Ok(places.heights(placed.iter().map(|point| NM_PER_UM * z_um * point[2]), None))
}

/// A row of heights a line.
fn matrix(header: &Header, mut heights: Vec<f64>, columns: usize, wanted: &Wanted, shown: &str) -> Result<HeightGrid> {
    let rows = heights.len() / columns;
    let of_file = header.value_unit.as_deref().or(header.units.last().map(String::as_str)).unwrap_or_default();
    let nm = wanted.nanometres(of_file, shown)?;
    let step = |place: usize, count: usize| {
        let of_file = header.size_mm[place].map(|size| size / count as f64);
        match (wanted.step_mm[place], of_file) {
            (Some(wanted), Some(of_file)) if (wanted / of_file - 1.0).abs() > SAME_SIZE => {
                let problem = format!(
                    "its header has points {} mm apart, [load] {} mm",
                    significant(of_file, 6),
                    significant(wanted, 6)
                );
                Err(Error::new("read", shown, problem).help("leave out the key, or correct the header"))
            }
            (wanted, of_file) => Ok(wanted.or(of_file)),
        }
    };
    let step_x_mm = step(0, columns)?.ok_or_else(|| {
        Error::new("read", shown, format!("its header does not say what its {columns} columns are")).help(
            "a list of points names them: `x [mm] y [mm] z [um]`; of a matrix of heights `step_x_mm` and `step_y_mm` in [load] give the distances",
        )
    })?;
    let step_y_mm = step(1, rows)?.unwrap_or(step_x_mm);
    if has_labels(&heights, columns) {
        return Err(Error::new(
            "read",
            shown,
            "its first row and its first column grow by equal steps: they are places, no heights",
        )
        .help("leave them out; `step_x_mm` and `step_y_mm` in [load] give the distances"));
    }
    checked_size(shown, [rows as u64, columns as u64], [step_x_mm, step_y_mm])?;
    heights.iter_mut().for_each(|height| *height *= nm);
    Ok(HeightGrid {
        columns,
        step_x_mm,
        step_y_mm,
        origin_x_mm: 0.0,
        origin_y_mm: 0.0,
        std_nm: None,
        height_nm: heights,
    })
}

/// Whether the first row and the first column are places beside a matrix: both grow by equal steps, and no other row does.
fn has_labels(heights: &[f64], columns: usize) -> bool {
    let grows = |places: &[f64]| {
        let step = (places[places.len() - 1] - places[0]) / (places.len() - 1) as f64;
        let is_next = |pair: &[f64]| (pair[1] - pair[0] - step).abs() < 1e-3 * step.abs();
        step != 0.0 && places.windows(2).all(is_next)
    };
    let rows: Vec<&[f64]> = heights.chunks_exact(columns).collect();
    if columns < ROW || rows.len() < ROW {
        return false;
    }
    let first_column: Vec<f64> = rows[1..].iter().map(|row| row[0]).collect();
    grows(&rows[0][1..]) && grows(&first_column) && !rows[1..].iter().any(|row| grows(&row[1..]))
}
