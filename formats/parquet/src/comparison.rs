//! The table of a comparison of separators.

use std::{iter::repeat_n, path::PathBuf};

use runout_core::{
    Result,
    atomic_file::PendingFile,
    pipeline::compare::{Comparison, Difference, MethodValue, QuantityComparison, StationComparison},
    separation::CONVENTION,
    table::{
        ArrayRef, ColumnSpec, Figure, Measure, RecordBatch, TableSpec, counts, flags, numbers, numbers_or_null, texts,
        texts_or_null,
    },
};

use crate::{about, table::TableFile};

/// One row a station, quantity, section, order and method.
pub struct ComparisonTable {
    file: TableFile,
    spec: TableSpec,
}

impl ComparisonTable {
    /// Begins a file that will appear as `path`.
    ///
    /// # Errors
    /// When it cannot be created.
    pub fn create(path: PathBuf) -> Result<Self> {
        let spec = comparison_table();
        Ok(Self { file: TableFile::create(path, &spec)?, spec })
    }

    /// Appends a station's rows.
    ///
    /// # Errors
    /// When the file system refuses them.
    pub fn append(&mut self, station: &StationComparison) -> Result<()> {
        self.file.append(&comparison_rows(&self.spec, station)?)
    }

    /// Completes the file; it appears when the result is committed.
    ///
    /// # Errors
    /// When the file system refuses the rest.
    pub fn close(self, comparison: &Comparison) -> Result<PendingFile> {
        let convention = format!("{CONVENTION} Differences are those from the method {}.", comparison.reference);
        self.file.close(&about::of_program(
            &comparison.title,
            &comparison.provenance,
            &convention,
            &comparison.warnings,
        ))
    }
}

const UNIT: &str = "um; urad for tilt";

/// A station's rows of the table of a comparison.
///
/// # Errors
/// Never in practice: the columns are of one length.
pub fn comparison_rows(spec: &TableSpec, station: &StationComparison) -> Result<RecordBatch> {
    spec.rows(rows(station))
}

/// The table of a comparison with the figure of E_n by order, of all methods but the reference.
#[must_use]
pub fn comparison_figures(methods: &[String]) -> TableSpec {
    let figure = Figure::bars("e-n", "E_n by order", "order", [Measure::new("e_n").with_symbol("E_n")]);
    let figure = figure.panels(["station", "quantity", "section"]).curves(["method"]).only("method", methods);
    comparison_table().figure(figure.level("E_n = 1", 1.0))
}

/// The table of a comparison: one row a station, quantity, section, order and method.
#[must_use]
pub fn comparison_table() -> TableSpec {
    let optional = |name: &str, unit: &str, about: &str| ColumnSpec::number(name, unit, about).or_null();
    TableSpec::new(
        "comparison",
        "coefficients by order and separator, and their differences",
        vec![
            ColumnSpec::name("station", "name of the axial station"),
            ColumnSpec::name("quantity", "form, x, y, tilt_x or tilt_y"),
            ColumnSpec::name("section", "id of the section; null for motion").or_null(),
            optional(
                "z_mm",
                "mm",
                "place of the section, or of the plane whose displacement x and y are; null for tilt",
            ),
            ColumnSpec::count("order", "1/rev", "undulations per revolution"),
            ColumnSpec::name("method", "the separator"),
            ColumnSpec::number("re", UNIT, "real part of c; NaN where the method does not separate the order"),
            ColumnSpec::number("im", UNIT, "imaginary part of c; NaN where the method does not separate the order"),
            ColumnSpec::number(
                "std",
                UNIT,
                "root of E|error of c|², both parts together, from the scatter; NaN if not known",
            ),
            ColumnSpec::flag("observable", "whether the method separates this order"),
            optional("difference", UNIT, "|c − c of the reference|; null for the reference, and where one is lost"),
            optional("difference_std", UNIT, "root of E|error of that difference|², from the joint covariance"),
            optional("e_n", "", "difference / (2 difference_std); 0 where both are equal to rounding"),
        ],
    )
}

/// One method's orders of one quantity.
struct Block<'a> {
    quantity: &'a QuantityComparison,
    value: &'a MethodValue,
    difference: Option<&'a Difference>,
}

impl Block<'_> {
    fn orders(&self) -> usize {
        self.value.harmonics.re.len()
    }

    /// A column of the difference by order, with nulls where there is none.
    fn of_difference<'a>(
        &'a self,
        column: impl Fn(&'a Difference) -> &'a Vec<Option<f64>>,
    ) -> impl Iterator<Item = Option<f64>> + 'a {
        let held = self.difference.map(column);
        (0..self.orders()).map(move |index| held.and_then(|held| held.get(index).copied().flatten()))
    }
}

fn rows(station: &StationComparison) -> Vec<ArrayRef> {
    let blocks: Vec<Block> = station
        .quantities
        .iter()
        .flat_map(|quantity| {
            quantity.values.iter().map(move |value| {
                let difference = quantity.differences.iter().find(|one| one.method == value.method);
                Block { quantity, value, difference }
            })
        })
        .collect();
    let rows: usize = blocks.iter().map(Block::orders).sum();
    let repeated = |of: fn(&Block) -> Option<String>| {
        texts_or_null(blocks.iter().flat_map(|block| repeat_n(of(block), block.orders())))
    };
    let harmonic = |of: fn(&MethodValue) -> &Vec<Option<f64>>| {
        numbers(blocks.iter().flat_map(|block| of(block.value).iter().map(|value| value.unwrap_or(f64::NAN))))
    };
    let difference = |of: fn(&Difference) -> &Vec<Option<f64>>| {
        numbers_or_null(blocks.iter().flat_map(|block| block.of_difference(of)))
    };
    let orders = blocks.iter().flat_map(|block| (1..).take(block.orders()));
    let z_mm = blocks.iter().flat_map(|block| repeat_n(block.value.z_mm, block.orders()));
    let observable = blocks.iter().flat_map(|block| block.value.harmonics.re.iter().map(Option::is_some));
    vec![
        texts(repeat_n(station.station.as_str(), rows)),
        repeated(|block| Some(block.quantity.quantity.clone())),
        repeated(|block| block.quantity.section.clone()),
        numbers_or_null(z_mm),
        counts(orders),
        repeated(|block| Some(block.value.method.clone())),
        harmonic(|value| &value.harmonics.re),
        harmonic(|value| &value.harmonics.im),
        harmonic(|value| &value.harmonics.std),
        flags(observable),
        difference(|one| &one.by_order.difference),
        difference(|one| &one.by_order.std),
        difference(|one| &one.by_order.e_n),
    ]
}

#[cfg(test)]
mod tests {
    use arrow_array::{Array, cast::AsArray, types::Float64Type};
    use runout_core::pipeline::compare::{DifferenceOrders, Harmonics};

    use super::*;

    #[test]
    fn a_lost_order_is_no_number() {
        let value = |method: &str, second: Option<f64>| {
            let column = vec![Some(0.5), second];
            let harmonics = Harmonics { re: column.clone(), im: column.clone(), std: column };
            let (method, z_mm) = (method.to_owned(), Some(200.0));
            let (ront_um, truth_rms_error_um, lost_orders) = (None, None, Vec::new());
            MethodValue { method, z_mm, rms: 0.5, std: None, ront_um, truth_rms_error_um, lost_orders, harmonics }
        };
        let column = vec![Some(0.1), None];
        let by_order = DifferenceOrders { difference: column.clone(), std: column.clone(), e_n: column };
        let quantity = QuantityComparison {
            quantity: "x".into(),
            section: None,
            unit: "um".into(),
            values: vec![value("a", Some(0.25)), value("b", None)],
            differences: vec![Difference { method: "b".into(), by_order, ..Difference::default() }],
        };
        let station =
            StationComparison { station: "s001".into(), z_mm: 0.0, quantities: vec![quantity], warnings: Vec::new() };
        let batch = comparison_table().rows(rows(&station)).unwrap();
        let numbers = |name: &str| batch.column_by_name(name).unwrap().as_primitive::<Float64Type>().clone();
        let observable = batch.column_by_name("observable").unwrap().as_boolean().clone();
        assert_eq!(observable.iter().flatten().collect::<Vec<_>>(), [true, true, true, false]);
        for name in ["re", "im", "std"] {
            assert!(numbers(name).value(3).is_nan() && (numbers(name).value(1) - 0.25).abs() < 1e-15, "{name}");
        }
        for name in ["difference", "difference_std", "e_n"] {
            let held = numbers(name);
            assert_eq!((0..4).map(|row| held.is_valid(row)).collect::<Vec<_>>(), [false, false, true, false], "{name}");
        }
    }
}
