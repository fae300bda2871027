//! Tables that grow some rows at a time: a group with one extendable dataset a column.

use std::marker::PhantomData;

use arrow_array::{
    Array, StringArray,
    cast::AsArray,
    types::{Float64Type, UInt32Type},
};
use hdf5_metno::{
    Dataset, File, Group, H5Type, Result,
    types::{FixedUnicode, VarLenUnicode},
};
use ndarray::{ArrayView1, s};
use runout_core::table::{ArrayRef, ColumnSpec, Kind, RecordBatch, TableSpec};

use crate::node;

/// A name in a table, of at most so many bytes of UTF-8: names that repeat on every row compress to nothing only at a fixed
/// length, and in less time when it is short.
type Name<const N: usize> = FixedUnicode<N>;
/// Bytes of names where all are short, and of the longest that there may be.
pub(super) const SHORT: usize = 16;
pub(super) const LONG: usize = 64;
/// Rows of a chunk: 64 KiB of f64.
const CHUNK_ROWS: usize = 8192;
/// Rows that are compared with one another at a time.
const MOST_ALIKE: usize = 1024;
/// Higher levels take several times as long for some percent less.
const DEFLATE: u8 = 1;

/// A name as tables hold it.
fn name<const N: usize>(text: &str) -> Result<Name<N>> {
    text.parse().map_err(|_| format!("a name must be of at most {N} bytes without NUL: `{text}`").into())
}

/// Rows from this one on that have its text, at least itself: names come in stretches of the same one, which are compared as a whole.
fn alike(texts: &StringArray, row: usize) -> usize {
    if texts.null_count() > 0 {
        return 1;
    }
    let (offsets, bytes) = (&texts.value_offsets()[row..], texts.value_data());
    let length = offsets[1] - offsets[0];
    let as_long = offsets.windows(2).take(MOST_ALIKE).take_while(|ends| ends[1] - ends[0] == length);
    let (mut rows, start, length) = (as_long.count(), offsets[0] as usize, length as usize);
    // A stretch of one name is the same one row further on.
    let moved = |rows: usize| &bytes[start + length..start + rows * length];
    while bytes[start..start + (rows - 1) * length] != *moved(rows) {
        rows /= 2;
    }
    rows
}

/// A table in a file.
pub(super) struct TableGroup<const N: usize> {
    pub(super) name: String,
    columns: Vec<ColumnData<N>>,
}

impl<const N: usize> TableGroup<N> {
    pub(super) fn create(file: &File, table: &TableSpec) -> Result<Self> {
        let group = node::create_group(file, &table.name)?;
        node::put_text(&group, "about", &table.about)?;
        let columns = table.columns.iter().map(|column| ColumnData::create(&group, column)).collect::<Result<_>>()?;
        Ok(Self { name: table.name.clone(), columns })
    }

    pub(super) fn append(&mut self, rows: &RecordBatch) -> Result<()> {
        self.columns.iter_mut().zip(rows.columns()).try_for_each(|(column, values)| column.append(values))
    }
}

/// A column by what it holds.
enum ColumnData<const N: usize> {
    Name(Column<Name<N>>),
    Text(Column<VarLenUnicode>),
    Number(Column<f64>),
    Count(Column<u32>),
    Flag(Column<bool>),
}

impl<const N: usize> ColumnData<N> {
    fn create(group: &Group, spec: &ColumnSpec) -> Result<Self> {
        Ok(match spec.kind {
            Kind::Name => Self::Name(Column::create(group, spec)?),
            Kind::Text => Self::Text(Column::create(group, spec)?),
            // NaN stands for null, which whole numbers have no sign for.
            Kind::Count if spec.nullable => Self::Number(Column::create(group, spec)?),
            Kind::Number => Self::Number(Column::create(group, spec)?),
            Kind::Count => Self::Count(Column::create(group, spec)?),
            Kind::Flag => Self::Flag(Column::create(group, spec)?),
        })
    }

    fn append(&mut self, values: &ArrayRef) -> Result<()> {
        let length = values.len();
        match self {
            Self::Name(column) => {
                let texts = values.as_string::<i32>();
                let mut all: Vec<Name<N>> = Vec::with_capacity(length);
                while all.len() < length {
                    let row = all.len();
                    if texts.is_null(row) {
                        all.push(name("")?);
                    } else {
                        all.resize(row + alike(texts, row), name(texts.value(row))?);
                    }
                }
                column.append(&all)
            }
            Self::Text(column) => {
                let texts = values.as_string::<i32>().iter().map(|text| node::unicode(text.unwrap_or_default()));
                column.append(&texts.collect::<Result<Vec<_>>>()?)
            }
            Self::Number(column) => match values.as_primitive_opt::<Float64Type>() {
                Some(numbers) if numbers.null_count() == 0 => column.append(numbers.values()),
                Some(numbers) => {
                    column.append(&numbers.iter().map(|number| number.unwrap_or(f64::NAN)).collect::<Vec<_>>())
                }
                None => {
                    let counts = values.as_primitive::<UInt32Type>().iter();
                    column.append(&counts.map(|count| count.map_or(f64::NAN, f64::from)).collect::<Vec<_>>())
                }
            },
            Self::Count(column) => column.append(values.as_primitive::<UInt32Type>().values()),
            Self::Flag(column) => {
                column.append(&values.as_boolean().iter().map(|flag| flag.unwrap_or(false)).collect::<Vec<_>>())
            }
        }
    }
}

struct Column<T> {
    dataset: Dataset,
    rows: usize,
    element: PhantomData<fn(T)>,
}

impl<T: H5Type> Column<T> {
    fn create(group: &Group, spec: &ColumnSpec) -> Result<Self> {
        // Rows come in order: only the last chunk is ever written again. The library's own cache keeps megabytes of
        // each column.
        let bytes = CHUNK_ROWS * size_of::<T>();
        let builder = group.new_dataset_builder().chunk(CHUNK_ROWS).chunk_cache(1, bytes, 1.0);
        let builder = match spec.kind {
            // What packs to little: names are alike as a whole, of numbers the first bytes are alike from row to row.
            Kind::Name => builder.deflate(DEFLATE),
            Kind::Count | Kind::Flag => builder.shuffle().deflate(DEFLATE),
            Kind::Number if !spec.measured => builder.shuffle().deflate(DEFLATE),
            // Packing measured numbers takes long and saves little; texts of any length lie elsewhere in the file.
            Kind::Number | Kind::Text => builder,
        };
        let dataset = builder.empty::<T>().shape(0..).create(spec.name.as_str())?;
        node::put_text(&dataset, "unit", &spec.unit)?;
        node::put_text(&dataset, "about", &spec.about)?;
        Ok(Self { dataset, rows: 0, element: PhantomData })
    }

    fn append(&mut self, values: &[T]) -> Result<()> {
        let rows = self.rows + values.len();
        self.dataset.resize(rows)?;
        self.dataset.write_slice(ArrayView1::from(values), s![self.rows..rows])?;
        self.rows = rows;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn stretches_of_names_are_found() {
        let texts = StringArray::from(["", "", "a", "a", "a", "b", "bb", "bb", "b", "ä", "ä", "ä"].to_vec());
        let mut row = 0;
        while row < texts.len() {
            let rows = alike(&texts, row);
            assert!(rows > 0 && (row..row + rows).all(|other| texts.value(other) == texts.value(row)), "{row} {rows}");
            row += rows;
        }
        assert_eq!(row, texts.len());
        assert_eq!([alike(&texts, 0), alike(&texts, 9)], [2, 3]);
        let many = StringArray::from(vec!["S1"; 5000]);
        assert_eq!([alike(&many, 0), alike(&many, 4999)], [MOST_ALIKE, 1]);
        assert_eq!(alike(&many.slice(3000, 10), 2), 8);
        assert_eq!(alike(&StringArray::from(vec![None, Some("a"), Some("a")]), 1), 1);
    }

    #[test]
    fn a_column_caches_its_last_chunk_and_no_more() {
        let folder = tempfile::tempdir().unwrap();
        let file = File::create(folder.path().join("table.h5")).unwrap();
        let mut column = Column::<f64>::create(&file, &ColumnSpec::number("z_mm", "mm", "").repeating()).unwrap();
        let rows: Vec<f64> = (0..3 * CHUNK_ROWS + 7).map(|row| row as f64).collect();
        for some in rows.chunks(1000) {
            column.append(some).unwrap();
        }
        assert_eq!(column.dataset.access_plist().unwrap().chunk_cache().nbytes, 8 * CHUNK_ROWS);
        assert_eq!(column.dataset.read_raw::<f64>().unwrap(), rows);
    }
}
