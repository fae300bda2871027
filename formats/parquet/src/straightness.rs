//! The table of straightness.

use arrow_array::ArrayRef;
use arrow_schema::Schema;
use runout_core::straightness::Straightness;

use crate::columns::{number, numbers};

/// Columns of `straightness.parquet`.
pub fn schema() -> Schema {
    let uncertainty = |name: &str, of: &str| {
        number(
            name,
            "um",
            &format!("standard uncertainty of {of} at this position, from the scatter; NaN if not known"),
        )
    };
    Schema::new(vec![
        number("z_mm", "mm", "place along the axis"),
        number("part_um", "um", "the part's deviation from its least-squares line, outward positive"),
        uncertainty("part_std_um", "part_um"),
        number("slide_um", "um", "the slide's deviation from its least-squares line, towards the part positive"),
        uncertainty("slide_std_um", "slide_um"),
    ])
}

/// One row a position.
pub fn rows(result: &Straightness) -> Vec<ArrayRef> {
    let columns = [&result.z_mm, &result.part_um, &result.part_std_um, &result.slide_um, &result.slide_std_um];
    columns.map(|column| numbers(column.iter().copied())).into()
}
