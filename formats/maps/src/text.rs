//! Text: a point a line (`x y z`), or a matrix of heights with a row a line.
//!
//! Numbers are separated by blanks, tabs, semicolons or commas; the first three allow a decimal comma. Lines before the first number are a
//! header, which may name units (`x [mm]`, `# Value units: m`) and the size of a matrix (`# Width: 20.0 µm`). Lines that begin with `#` or
//! `%` are comments. What is no number (`NaN`, `BAD`, `No Data`, `***`) is a point that was not measured.

use std::io::{BufRead, BufReader, Read};

use runout_core::{Error, Result, height_grid::HeightGrid, length_unit::micrometres};

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

/// What the header of a file says.
#[derive(Debug, Default)]
struct Header {
    /// Units by place: of x, y and z where three are named, else that of heights last.
    units: Vec<String>,
    /// Width and height of a matrix, in mm.
    size_mm: [Option<f64>; 2],
    value_unit: Option<String>,
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
        let bracketed = line.split(['[', '(']).skip(1).filter_map(|part| part.split([']', ')']).next());
        self.units.extend(bracketed.filter(|unit| micrometres(unit).is_some()).map(str::to_owned));
    }
}

/// Reads a file.
pub(crate) fn read(input: &Input, wanted: &Wanted) -> Result<Map> {
    let shown = &input.shown;
    let mut file = BufReader::new(input.open()?);
    let (mut header, mut numbers, mut width, mut lines) = (Header::default(), Vec::new(), 0, 0_usize);
    // Lines before the first number, and whether each row ends with a separator.
    let (mut before, mut ended) = (Vec::new(), true);
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
    let is_matrix =
        width != POINT || wanted.step_mm.iter().any(Option::is_some) || header.size_mm.iter().any(Option::is_some);
    let grid = if is_matrix {
        matrix(&header, numbers, width, wanted, shown)
    } else {
        points(&header, &numbers, wanted, shown)
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
            .filter(|number: &f64| number.is_finite())
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

/// Points on a grid.
fn points(header: &Header, numbers: &[f64], wanted: &Wanted, shown: &str) -> Result<HeightGrid> {
    let unit = |place: usize| {
        let named = header.units.get(place).filter(|_| header.units.len() == POINT);
        let unit = named.or(header.value_unit.as_ref().filter(|_| place == 2)).or(wanted.unit.as_ref());
        unit.and_then(|unit| micrometres(unit)).ok_or_else(|| {
            let problem = format!("its header does not name the unit of {}", ["x", "y", "z"][place]);
            Error::new("read", shown, problem).help(
                "`unit = \"mm\"` in [load] gives that of x, y and z; a header `x [mm] y [mm] z [um]` each its own",
            )
        })
    };
    let [x_um, y_um, z_um] = [unit(0)?, unit(1)?, unit(2)?];
    let placed: Vec<&[f64]> =
        numbers.chunks_exact(POINT).filter(|point| point.iter().all(|number| number.is_finite())).collect();
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
    let step =
        |place: usize, count: usize| wanted.step_mm[place].or(header.size_mm[place].map(|size| size / count as f64));
    let step_x_mm = step(0, columns).ok_or_else(|| {
        Error::new("read", shown, "its header does not give the distance of its points")
            .help("`step_x_mm` and `step_y_mm` in [load] do")
    })?;
    let step_y_mm = step(1, rows).unwrap_or(step_x_mm);
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
