//! Values by what distinguishes them: the columns of names in tables of values.

use runout_table::{Array, RecordBatch, StringArray};

/// Columns that distinguish one value from another, in the order in which they are read.
pub(super) const NAMES: [&str; 7] = ["symbol", "reference", "filter", "of", "section", "station", "unit"];
const UNIT: &str = "unit";

/// A column of texts.
pub(super) fn texts_of<'a>(rows: &'a RecordBatch, column: &str) -> Option<&'a StringArray> {
    rows.column_by_name(column).and_then(|column| column.as_any().downcast_ref::<StringArray>())
}

/// The columns that distinguish one value from another, as far as a table has them.
pub(super) fn columns_of(rows: &RecordBatch) -> [Option<&StringArray>; NAMES.len()] {
    NAMES.map(|column| texts_of(rows, column))
}

/// What they hold in a row; empty where they hold nothing.
pub(super) fn names_at(columns: &[Option<&StringArray>; NAMES.len()], row: usize) -> [String; NAMES.len()] {
    columns.map(|column| {
        column.filter(|column| column.is_valid(row)).map_or(String::new(), |column| column.value(row).to_owned())
    })
}

/// `RONt LSCI, Gaussian 15 UPR, a, s001 / um`.
///
/// A value without filter says `none` in its column.
pub(super) fn label(names: &[String; NAMES.len()], times: usize) -> String {
    let mut label = String::new();
    let said = |(column, name): &(&&str, &String)| !(name.is_empty() || **column == "filter" && *name == "none");
    for (column, name) in NAMES.iter().zip(names).filter(said) {
        match *column {
            "symbol" => {}
            "reference" => label.push(' '),
            UNIT => label.push_str(" / "),
            _ => label.push_str(", "),
        }
        label.push_str(name);
    }
    if times > 1 { format!("{label} ({times})") } else { label }
}
