//! The table of harmonics of a run.

use runout_core::table::{Array, Float64Array, StringArray};

use crate::campaign::Ran;

/// A row of a table of harmonics.
pub(crate) struct Harmonic {
    pub(crate) quantity: String,
    pub(crate) section: Option<String>,
    pub(crate) station: String,
    pub(crate) order: usize,
    pub(crate) re: f64,
    pub(crate) im: f64,
    pub(crate) std: f64,
    pub(crate) observable: bool,
}

pub(crate) fn harmonics(ran: &Ran) -> Vec<Harmonic> {
    let mut found = Vec::new();
    for (_, rows) in ran.tables.iter().filter(|(table, _)| table.name == "harmonics") {
        let column = |name: &str| rows.column_by_name(name).unwrap().as_any();
        let text = |name: &str| column(name).downcast_ref::<StringArray>().unwrap();
        let number = |name: &str| column(name).downcast_ref::<Float64Array>().unwrap();
        let order: &arrow_array::UInt32Array = column("order").downcast_ref().unwrap();
        let observable: &arrow_array::BooleanArray = column("observable").downcast_ref().unwrap();
        found.extend((0..rows.num_rows()).map(|row| Harmonic {
            quantity: text("quantity").value(row).to_owned(),
            section: text("section").is_valid(row).then(|| text("section").value(row).to_owned()),
            station: text("station").value(row).to_owned(),
            order: order.value(row) as usize,
            re: number("re").value(row),
            im: number("im").value(row),
            std: number("std").value(row),
            observable: observable.value(row),
        }));
    }
    found
}
