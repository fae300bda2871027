//! Heidenhain: nonlinear axis error compensation, tables `.COM` of compensation values and the table `.CMA` that assigns them.
//!
//! Technical manual MANUALplus 620, pages 716 to 718: `AXISPOS` has the positions from the machine datum, each further column the axis that is
//! compensated, in mm or °; the column of `.CMA` in which a `.COM` is named is the axis whose position counts, and `*` in `ACTIVE` switches a line on.
//! Technical manual TNC 415, 1.6.4: linear between the points, at most 256 points a table and ten dependencies. The text of a table, with `BEGIN`,
//! `[END]` and columns below their names, is that of the maker's other tables (iTNC 530 HSCI, page 671).

use std::path::PathBuf;

use super::{
    Comments, Dialect, Written,
    cross::{self, tables},
    few_enough, fixed, is_positioning, name, positioning_adds_um, positions,
};
use crate::{
    chain::Chain,
    config::{ControllerConfig, Moves},
};

/// Points of a table, and dependencies of axes, that a TNC 415 has at most.
const MOST_POINTS: usize = 256;
const MOST_TABLES: usize = 10;
const WIDTH: usize = 16;

pub(super) struct Heidenhain(pub ControllerConfig);

/// A table as text: names of the columns above their cells.
fn table(file: &str, columns: &[String], rows: &[Vec<String>]) -> Vec<String> {
    let line = |first: &str, cells: &[String]| {
        let cells: Vec<String> = cells.iter().map(|cell| format!("{cell:<WIDTH$}")).collect();
        format!("{first:<8}{}", cells.concat()).trim_end().to_owned()
    };
    let mut lines = vec![format!("BEGIN {} MM", file.to_uppercase()), line("NR", columns)];
    lines.extend(rows.iter().enumerate().map(|(number, cells)| line(&number.to_string(), cells)));
    lines.push("[END]".into());
    lines
}

impl Heidenhain {
    fn sign(&self) -> f64 {
        if self.0.positive_moves == Some(Moves::Positive) { 1.0 } else { -1.0 }
    }

    /// Of the position of one axis: the columns, and the values of each point. In mm or °, by which the axes have to move.
    fn dependencies(&self, chain: &Chain, axis: &str) -> Vec<(String, Vec<f64>)> {
        let mut all: Vec<(String, Vec<f64>)> = Vec::new();
        let own = positions(&self.0, chain, axis).unwrap_or_default();
        if own.iter().any(|[_, error]| error.abs() > 0.0) {
            all.push((name(&self.0, axis).to_owned(), own.iter().map(|[_, error]| -error).collect()));
        }
        let others = tables(chain).into_iter().filter(|table| table.input == axis);
        all.extend(others.map(|table| (name(&self.0, table.output).to_owned(), table.wanted_mm)));
        all
    }
}

impl Dialect for Heidenhain {
    fn comments(&self) -> Comments {
        Comments::Apart
    }

    fn holds(&self, symbol: &str) -> bool {
        is_positioning(symbol) || cross::holds(symbol)
    }

    fn write(&self, chain: &Chain) -> Result<Written, String> {
        let mut beside: Vec<(PathBuf, Vec<String>)> = Vec::new();
        let (mut columns, mut files) = (vec!["ACTIVE".to_owned()], vec!["*".to_owned()]);
        let mut count = 0;
        let mut without: Vec<&String> = self.0.com.keys().collect();
        for axis in &chain.axes {
            let dependencies = self.dependencies(chain, &axis.letter);
            let letter = &axis.letter;
            if dependencies.is_empty() {
                continue;
            }
            without.retain(|named| *named != letter);
            let file = self.0.com.get(letter).ok_or_else(|| {
                format!("there are errors by the position of {letter}, and `com` names no file of it: `com = {{ {letter} = \"{}.com\" }}`", letter.to_lowercase())
            })?;
            few_enough(axis.nodes.len(), self.0.most_points.unwrap_or(MOST_POINTS), &format!("the table of {letter}"))?;
            count += dependencies.len();
            let row = |point: usize| {
                let mut cells = vec![fixed(axis.nodes[point].position, 5)];
                cells.extend(dependencies.iter().map(|(_, wanted)| fixed(self.sign() * wanted[point], 5)));
                cells
            };
            let rows: Vec<Vec<String>> = (0..axis.nodes.len()).map(row).collect();
            let mut names = vec!["AXISPOS".to_owned()];
            names.extend(dependencies.iter().map(|(name, _)| name.clone()));
            let text = file.display().to_string();
            beside.push((file.clone(), table(&text, &names, &rows)));
            columns.push(name(&self.0, letter).to_owned());
            files.push(text.to_uppercase());
        }
        if let Some(letter) = without.first() {
            return Err(format!(
                "`com` names a table of {letter}, and no error of this file is by its position: leave it out"
            ));
        }
        let most = self.0.most_tables.unwrap_or(MOST_TABLES);
        if count > most {
            return Err(format!(
                "{count} dependencies are needed, and the control has {most}: name errors in `leave_out`"
            ));
        }
        let moves = if self.sign() > 0.0 { "positive" } else { "negative" };
        let notes = vec![
            format!("unit mm and °, AXISPOS from the machine datum; a positive value has to move the axis of its column in its {moves} direction: `positive_moves`"),
            "values have 5 digits, 0.01 µm; between points the control is linear; beyond the first and the last one nothing is stated".to_owned(),
            "forward and reverse are equal: the curves do not tell directions apart; there is no column BACKLASH".to_owned(),
            format!("{count} dependencies; rotations are for KinematicsComp, which this file is not"),
        ];
        let config = self.0.path.file_name().map(|name| name.to_string_lossy().into_owned()).unwrap_or_default();
        Ok(Written { lines: table(&config, &columns, &[files]), notes, beside })
    }

    fn adds_um(&self, chain: &Chain, place_mm: [f64; 3]) -> [f64; 3] {
        let (own, others) = (positioning_adds_um(chain, place_mm), cross::adds_um(chain, place_mm));
        [0, 1, 2].map(|axis| own[axis] + others[axis])
    }
}
