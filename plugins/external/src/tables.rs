//! Tables as Arrow IPC streams: those that are sent, and those that come, with every cell checked.

use std::{
    collections::HashMap,
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use arrow_array::{
    Array, LargeStringArray, PrimitiveArray, RecordBatch, StringArray, StringViewArray,
    types::{
        ArrowPrimitiveType, Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, UInt8Type, UInt16Type,
        UInt32Type, UInt64Type,
    },
};
use arrow_ipc::{reader::StreamReader, root_as_message, writer::StreamWriter};
use arrow_schema::{ArrowError, DataType, Schema, SchemaRef};
use runout_core::fault::known_names;

use crate::frame::Frame;

/// The version of the protocol, in the metadata of each table.
pub(crate) const VERSION: &str = "1";
const VERSION_KEY: &str = "runout.protocol";
/// What precedes each message of a stream.
const MARK: [u8; 4] = [0xFF; 4];

/// A frame with rows of a table; `about` is metadata of its schema besides the version.
///
/// # Errors
/// When Arrow refuses the rows.
pub(crate) fn encode(table: &str, rows: &RecordBatch, about: &[(&'static str, String)]) -> Result<Frame, ArrowError> {
    let about = about.iter().map(|(key, value)| (format!("runout.{key}"), value.clone()));
    let metadata: HashMap<String, String> = about.chain([(VERSION_KEY.to_owned(), VERSION.to_owned())]).collect();
    let schema = Arc::new(Schema::new_with_metadata(rows.schema().fields().clone(), metadata));
    let mut body = Vec::new();
    let mut writer = StreamWriter::try_new(&mut body, &schema)?;
    writer.write(&rows.clone().with_schema(schema)?)?;
    writer.finish()?;
    drop(writer);
    Ok(Frame { name: table.to_owned(), body })
}

/// A table that came.
pub(crate) struct Table {
    name: String,
    schema: SchemaRef,
    rows: Vec<RecordBatch>,
}

impl Table {
    /// Reads a frame as a table with these columns, all or some of them.
    ///
    /// # Errors
    /// What is wrong, in words that go on from "the program".
    pub(crate) fn decode(frame: &Frame, columns: &[&str]) -> Result<Self, String> {
        let name = &frame.name;
        let no_stream = |error: String| format!("gave a table `{name}` that is no Arrow IPC stream: {error}");
        uncompressed(&frame.body).map_err(no_stream)?;
        // A library that reads what another program wrote may panic.
        let read = catch_unwind(AssertUnwindSafe(|| -> Result<_, ArrowError> {
            let reader = StreamReader::try_new(&frame.body[..], None)?;
            let schema = reader.schema();
            Ok((schema, reader.collect::<Result<Vec<_>, _>>()?))
        }));
        let (schema, rows) = match read {
            Ok(read) => read.map_err(|error| no_stream(error.to_string()))?,
            Err(_) => return Err(no_stream("its messages contradict each other".into())),
        };
        let version = schema.metadata().get(VERSION_KEY).map_or(VERSION, String::as_str);
        if version != VERSION {
            return Err(format!("speaks version {version} of the protocol, and this is runout with version {VERSION}"));
        }
        for field in schema.fields() {
            if !columns.contains(&field.name().as_str()) {
                let known = known_names(field.name(), columns.iter().copied());
                return Err(format!("gave a table `{name}` with an unknown column `{}`: {known}", field.name()));
            }
            if schema.fields().iter().filter(|other| other.name() == field.name()).count() > 1 {
                return Err(format!("gave a table `{name}` with two columns `{}`", field.name()));
            }
        }
        Ok(Self { name: name.clone(), schema, rows })
    }

    /// Number of rows.
    pub(crate) fn count(&self) -> usize {
        self.rows.iter().map(RecordBatch::num_rows).sum()
    }

    /// A column of texts, where there is one.
    ///
    /// # Errors
    /// When it is of another type.
    pub(crate) fn texts(&self, column: &str) -> Result<Option<Vec<Option<String>>>, String> {
        self.column(column, "text", |array| {
            fn all<'a>(values: impl Iterator<Item = Option<&'a str>>) -> Vec<Option<String>> {
                values.map(|value| value.map(str::to_owned)).collect()
            }
            let any = array.as_any();
            any.downcast_ref::<StringArray>()
                .map(|array| all(array.iter()))
                .or_else(|| any.downcast_ref::<LargeStringArray>().map(|array| all(array.iter())))
                .or_else(|| any.downcast_ref::<StringViewArray>().map(|array| all(array.iter())))
        })
    }

    /// A column of finite numbers, where there is one.
    ///
    /// # Errors
    /// When it is of another type, or a cell is NaN or infinite.
    pub(crate) fn numbers(&self, column: &str) -> Result<Option<Vec<Option<f64>>>, String> {
        let found = self.column(column, "float64", |array| {
            cells::<Float64Type, _>(array, Some)
                .or_else(|| cells::<Float32Type, _>(array, |value| Some(f64::from(value))))
                .or_else(|| cells::<Int64Type, _>(array, |value| Some(value as f64)))
                .or_else(|| cells::<Int32Type, _>(array, |value| Some(f64::from(value))))
        })?;
        let wrong = found.iter().flatten().position(|value| value.is_some_and(|value| !value.is_finite()));
        match wrong {
            Some(row) => Err(format!(
                "gave {} in row {} of the column `{column}` of `{}`: what is not known is null",
                found.iter().flatten().nth(row).copied().flatten().unwrap_or(f64::NAN),
                row + 1,
                self.name
            )),
            None => Ok(found),
        }
    }

    /// A column of whole numbers from 0, where there is one.
    ///
    /// # Errors
    /// When it is of another type, or a cell is negative.
    pub(crate) fn counts(&self, column: &str) -> Result<Option<Vec<Option<usize>>>, String> {
        fn whole<T: ArrowPrimitiveType>(array: &dyn Array) -> Option<Vec<Option<usize>>>
        where
            usize: TryFrom<T::Native>,
        {
            // A negative number becomes one that no table has.
            cells::<T, _>(array, |value| Some(usize::try_from(value).unwrap_or(usize::MAX)))
        }
        self.column(column, "integer", |array| {
            whole::<UInt32Type>(array)
                .or_else(|| whole::<Int64Type>(array))
                .or_else(|| whole::<Int32Type>(array))
                .or_else(|| whole::<UInt64Type>(array))
                .or_else(|| whole::<UInt16Type>(array))
                .or_else(|| whole::<Int16Type>(array))
                .or_else(|| whole::<UInt8Type>(array))
                .or_else(|| whole::<Int8Type>(array))
        })
    }

    /// What a table cannot do without.
    ///
    /// # Errors
    /// When the column is not there.
    pub(crate) fn needed<T>(&self, column: &str, found: Result<Option<T>, String>) -> Result<T, String> {
        found?.ok_or_else(|| {
            let names: Vec<&str> = self.schema.fields().iter().map(|field| field.name().as_str()).collect();
            format!("gave a table `{}` without the column `{column}`: it has {}", self.name, names.join(", "))
        })
    }

    fn column<T>(
        &self,
        column: &str,
        expected: &str,
        read: impl Fn(&dyn Array) -> Option<Vec<Option<T>>>,
    ) -> Result<Option<Vec<Option<T>>>, String> {
        let Ok(index) = self.schema.index_of(column) else { return Ok(None) };
        let mut found = Vec::with_capacity(self.count());
        for rows in &self.rows {
            let array = rows.column(index);
            if *array.data_type() == DataType::Null {
                found.extend((0..array.len()).map(|_| None));
                continue;
            }
            let read = read(&**array);
            found.extend(read.ok_or_else(|| {
                let kind = array.data_type();
                format!("gave a table `{}` whose column `{column}` is of type {kind}: expected {expected}", self.name)
            })?);
        }
        Ok(Some(found))
    }
}

fn cells<T: ArrowPrimitiveType, R>(
    array: &dyn Array,
    value: impl Fn(T::Native) -> Option<R>,
) -> Option<Vec<Option<R>>> {
    let array = array.as_any().downcast_ref::<PrimitiveArray<T>>()?;
    Some(array.iter().map(|cell| cell.and_then(&value)).collect())
}

/// Walks the messages of a stream: buffers that unpack to more than was sent are refused.
fn uncompressed(mut stream: &[u8]) -> Result<(), String> {
    while let Some((mark, rest)) = stream.split_first_chunk::<4>() {
        let (length, rest) = match *mark {
            MARK => rest.split_first_chunk::<4>().ok_or("it is cut off")?,
            _ => (mark, rest),
        };
        let length = usize::try_from(i32::from_le_bytes(*length)).map_err(|_| "a message has a negative length")?;
        if length == 0 {
            return Ok(());
        }
        let (header, rest) = rest.split_at_checked(length).ok_or("it is cut off")?;
        let message = root_as_message(header).map_err(|error| error.to_string())?;
        let of_dictionary = message.header_as_dictionary_batch().and_then(|batch| batch.data());
        if message.header_as_record_batch().or(of_dictionary).is_some_and(|batch| batch.compression().is_some()) {
            return Err("its buffers are compressed, which the protocol does not have".into());
        }
        let body = usize::try_from(message.bodyLength()).map_err(|_| "a body has a negative length")?;
        stream = rest.get(body..).ok_or("it is cut off")?;
    }
    Ok(())
}
