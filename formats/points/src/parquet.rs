//! Parquet: columns of numbers, texts and flags.

use arrow_array::{
    Array,
    cast::AsArray,
    types::{
        Decimal128Type, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
        UInt32Type, UInt64Type,
    },
};
use arrow_schema::DataType;
use parquet::arrow::arrow_reader::{ArrowReaderOptions, ParquetRecordBatchReaderBuilder};
use runout_core::{Error, Result, input_file::InputFile};
use runout_parquet::ParquetFile;

use crate::{RawColumn, RawTable, failed};

pub(crate) fn read(input: &InputFile) -> Result<RawTable> {
    let shown = input.path().display().to_string();
    let file = ParquetFile::new(input.open()?).map_err(|error| Error::caused("read", &shown, error))?;
    // The types of Parquet itself, so that dictionaries of another program are plain texts.
    let options = ArrowReaderOptions::new().with_skip_arrow_metadata(true);
    let builder =
        ParquetRecordBatchReaderBuilder::try_new_with_options(file, options).map_err(|error| failed(&shown, error))?;
    let names: Vec<String> = builder.schema().fields().iter().map(|field| field.name().clone()).collect();
    let mut columns: Vec<Option<RawColumn>> = names.iter().map(|_| None).collect();
    let mut rows = 0;
    for batch in builder.build().map_err(|error| failed(&shown, error))? {
        let batch = batch.map_err(|error| failed(&shown, error))?;
        rows += batch.num_rows();
        for ((column, values), name) in columns.iter_mut().zip(batch.columns()).zip(&names) {
            // Columns of other types can be there; only one that is wanted is an error, which a later look gives.
            let Some(part) = cells(&**values) else { continue };
            match (column, part) {
                (Some(RawColumn::Numbers(all)), RawColumn::Numbers(part)) => all.extend(part),
                (Some(RawColumn::Texts(all)), RawColumn::Texts(part)) => all.extend(part),
                (empty @ None, part) => *empty = Some(part),
                _ => return Err(Error::new("read", &shown, format!("the column `{name}` changes its type"))),
            }
        }
    }
    let known = names.into_iter().zip(columns).filter_map(|(name, column)| Some((name, column?)));
    let (names, columns) = known.unzip();
    Ok(RawTable { names, columns, rows, lines: Vec::new(), decimal_comma: false })
}

/// Numbers (NaN for null) or texts (empty for null); `None` for other types.
fn cells(values: &dyn Array) -> Option<RawColumn> {
    macro_rules! numbers {
        ($kind:ty) => {
            RawColumn::Numbers(
                values
                    .as_primitive::<$kind>()
                    .iter()
                    .map(|value| {
                        #[allow(clippy::cast_lossless, reason = "one expression for all types")]
                        value.map_or(f64::NAN, |value| value as f64)
                    })
                    .collect(),
            )
        };
    }
    let texts = |text: Option<&str>| text.unwrap_or_default().to_owned();
    Some(match values.data_type() {
        DataType::Float64 => numbers!(Float64Type),
        DataType::Float32 => numbers!(Float32Type),
        DataType::Int8 => numbers!(Int8Type),
        DataType::Int16 => numbers!(Int16Type),
        DataType::Int32 => numbers!(Int32Type),
        DataType::Int64 => numbers!(Int64Type),
        DataType::UInt8 => numbers!(UInt8Type),
        DataType::UInt16 => numbers!(UInt16Type),
        DataType::UInt32 => numbers!(UInt32Type),
        DataType::UInt64 => numbers!(UInt64Type),
        DataType::Decimal128(_, scale) => RawColumn::Numbers(
            values
                .as_primitive::<Decimal128Type>()
                .iter()
                .map(|value| value.map_or(f64::NAN, |value| value as f64 / 10_f64.powi(i32::from(*scale))))
                .collect(),
        ),
        DataType::Boolean => RawColumn::Numbers(
            values.as_boolean().iter().map(|flag| flag.map_or(f64::NAN, |flag| f64::from(u8::from(flag)))).collect(),
        ),
        DataType::Utf8 => RawColumn::Texts(values.as_string::<i32>().iter().map(texts).collect()),
        DataType::LargeUtf8 => RawColumn::Texts(values.as_string::<i64>().iter().map(texts).collect()),
        _ => return None,
    })
}
