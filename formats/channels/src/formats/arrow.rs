//! Parquet and Arrow IPC: tables of named columns in record batches (Apache Parquet; Arrow Columnar Format).

use std::{
    fs::File,
    io::{BufReader, Seek, SeekFrom},
    panic::{AssertUnwindSafe, catch_unwind},
    sync::Arc,
};

use arrow_array::{
    Array, ArrayRef, BooleanArray, PrimitiveArray, RecordBatch,
    types::{
        ArrowPrimitiveType, Date32Type, Date64Type, Decimal128Type, Decimal256Type, DecimalType,
        DurationMicrosecondType, DurationMillisecondType, DurationNanosecondType, DurationSecondType, Float16Type,
        Float32Type, Float64Type, Int8Type, Int16Type, Int32Type, Int64Type, Time32MillisecondType, Time32SecondType,
        Time64MicrosecondType, Time64NanosecondType, TimestampMicrosecondType, TimestampMillisecondType,
        TimestampNanosecondType, TimestampSecondType, UInt8Type, UInt16Type, UInt32Type, UInt64Type,
    },
};
use arrow_ipc::{reader::StreamReader, root_as_message};
use arrow_schema::{ArrowError, DataType, Field, SchemaRef, TimeUnit};
use parquet::arrow::{ProjectionMask, arrow_reader::ParquetRecordBatchReaderBuilder};
use runout_core::{Error, ErrorKind, Result, input_file::InputFile};
use runout_parquet::ParquetFile;

use super::Format;
use crate::{
    bytes::Bytes,
    channel::{Channel, ChannelFile, Kind, Samples, checked},
};

pub(super) const PARQUET: Format = Format {
    name: "parquet",
    about: "Parquet (pandas, polars)",
    recognises: |head| head.starts_with(b"PAR1"),
    open: |input| Table::open(input, Container::Parquet).map(|file| Box::new(file) as Box<dyn ChannelFile>),
};

pub(super) const FORMAT: Format = Format {
    name: "arrow",
    about: "Arrow IPC and Feather (pandas, polars)",
    recognises: |head| head.starts_with(FILE) || head.starts_with(STREAM),
    open: |input| {
        let mut bytes = Bytes::open(&input.into())?;
        let is_file = bytes.length() >= 6 && bytes.array()? == *FILE;
        let container = Container::Ipc { begin: if is_file { 8 } else { 0 } };
        Table::open(input, container).map(|file| Box::new(file) as Box<dyn ChannelFile>)
    },
};

/// What the two forms of Arrow IPC begin with.
const FILE: &[u8; 6] = b"ARROW1";
const STREAM: &[u8] = &[0xFF; 4];
/// Rows that are read at a time.
const BATCH: usize = 1 << 13;
/// Bytes that one buffer unpacks to at most, and for each packed byte.
const MOST_UNPACKED: i64 = 1 << 31;
const LARGEST_RATIO: i64 = 1 << 16;
/// Keys of a column's metadata that hold its unit.
const UNITS: [&str; 3] = ["unit", "units", "Unit"];

#[derive(Debug, Clone, Copy, PartialEq)]
enum Container {
    Parquet,
    /// A stream of messages that begins here.
    Ipc {
        begin: u64,
    },
}

/// A table as channels.
struct Table {
    input: InputFile,
    container: Container,
    schema: SchemaRef,
    channels: Vec<Channel>,
    /// The first instant of each column of instants, in its unit.
    origins: Vec<i64>,
}

type Batches = Box<dyn Iterator<Item = std::result::Result<RecordBatch, ArrowError>> + Send>;

impl Table {
    fn open(input: &InputFile, container: Container) -> Result<Self> {
        let shown = input.path().display().to_string();
        let stated = if let Container::Ipc { begin } = container { count(input, begin)? } else { 0 };
        let file = input.open()?;
        let schema = guarded(&shown, || schema(file, container))?;
        let mut table = Self {
            input: input.clone(),
            container,
            schema: Arc::clone(&schema),
            channels: Vec::new(),
            origins: Vec::new(),
        };
        let is_instant = |field: &Field| matches!(field.data_type(), DataType::Timestamp(..));
        let instants: Vec<usize> =
            (0..schema.fields().len()).filter(|column| is_instant(schema.field(*column))).collect();
        table.origins = vec![0; schema.fields().len()];
        let rows = if container == Container::Parquet {
            let file = input.open()?;
            let builder = guarded(&shown, || Ok(ParquetRecordBatchReaderBuilder::try_new(ParquetFile::new(file)?)?))?;
            builder.metadata().file_metadata().num_rows().max(0) as u64
        } else {
            stated
        };
        if !instants.is_empty()
            && rows > 0
            && let Some(batch) = next(&mut table.batches(&instants, 1)?, &shown)?
        {
            table.origins_of(&batch, &instants);
        }
        for (column, field) in schema.fields().iter().enumerate() {
            let kind = kind_of(field.data_type());
            let mut channel = Channel::new("", field.name().clone(), kind, rows);
            channel.unit = UNITS.iter().find_map(|key| field.metadata().get(key).cloned());
            if kind == Kind::Time {
                channel.unit = Some("s".into());
                let first_s = table.origins[column] as f64 * unit_s(field.data_type());
                channel.properties.push(("first_since_1970_s".into(), first_s.to_string()));
            }
            channel.limits = kind.codes();
            let metadata = field.metadata().iter().map(|(key, value)| (key.clone(), value.clone()));
            channel.properties.extend(metadata);
            channel.properties.sort();
            table.channels.push(channel);
        }
        Ok(table)
    }

    fn origins_of(&mut self, batch: &RecordBatch, columns: &[usize]) {
        for (column, array) in columns.iter().zip(batch.columns()) {
            self.origins[*column] = first_instant(array).unwrap_or(0);
        }
    }

    /// Record batches of some columns, in the order of the file.
    fn batches(&self, columns: &[usize], most: usize) -> Result<Batches> {
        let (file, shown) = (self.input.open()?, self.input.path().display().to_string());
        guarded(&shown, || {
            Ok(match self.container {
                Container::Parquet => {
                    let builder = ParquetRecordBatchReaderBuilder::try_new(ParquetFile::new(file)?)?;
                    let mask = ProjectionMask::roots(builder.parquet_schema(), columns.iter().copied());
                    Box::new(builder.with_projection(mask).with_batch_size(most).build()?) as Batches
                }
                Container::Ipc { begin } => {
                    let stream = stream(file, begin)?;
                    Box::new(StreamReader::try_new(stream, Some(columns.to_vec()))?)
                }
            })
        })
    }
}

fn next(batches: &mut Batches, shown: &str) -> Result<Option<RecordBatch>> {
    guarded(shown, || batches.next().transpose())
}

fn schema(file: File, container: Container) -> std::result::Result<SchemaRef, ArrowError> {
    Ok(match container {
        Container::Parquet => Arc::clone(ParquetRecordBatchReaderBuilder::try_new(ParquetFile::new(file)?)?.schema()),
        Container::Ipc { begin } => StreamReader::try_new(stream(file, begin)?, None)?.schema(),
    })
}

fn stream(mut file: File, begin: u64) -> std::io::Result<BufReader<File>> {
    file.seek(SeekFrom::Start(begin))?;
    Ok(BufReader::new(file))
}

/// Goes through the messages of a stream: their lengths have to be inside the file, and what packed numbers unpack to within reason.
/// Gives the number of rows.
fn count(input: &InputFile, begin: u64) -> Result<u64> {
    let mut bytes = Bytes::open(&input.into())?;
    if begin > 0 {
        bytes.seek(bytes.length() - FILE.len() as u64)?;
        if bytes.array()? != *FILE {
            return Err(bytes.damaged("expected `ARROW1` at its end: a part of the file is missing"));
        }
        bytes.seek(begin)?;
    }
    let mut rows = 0_u64;
    while bytes.rest() >= 8 {
        let mut length = bytes.u32()?;
        if length == u32::MAX {
            length = bytes.u32()?;
        }
        if length == 0 {
            return Ok(rows);
        }
        let head = bytes.take(length.into())?;
        let message =
            root_as_message(&head).map_err(|error| bytes.damaged(format!("expected a message of Arrow: {error}")))?;
        let (body, length) = (bytes.place(), message.bodyLength());
        if length < 0 || length as u64 > bytes.rest() {
            return Err(bytes.damaged(format!("a body of {length} bytes was declared, the file has {}", bytes.rest())));
        }
        let batch = message.header_as_record_batch();
        let of_dictionary = message.header_as_dictionary_batch().and_then(|dictionary| dictionary.data());
        for part in batch.iter().chain(&of_dictionary) {
            for buffer in part.buffers().iter().flatten() {
                let (offset, size) = (buffer.offset(), buffer.length());
                if offset < 0 || size < 0 || offset.saturating_add(size) > length {
                    return Err(bytes.damaged("a buffer lies outside the body of its message"));
                }
                if part.compression().is_some() && size >= 8 {
                    bytes.seek(body + offset as u64)?;
                    let unpacked = bytes.i64()?;
                    if unpacked > MOST_UNPACKED.min(size.saturating_mul(LARGEST_RATIO)) {
                        return Err(bytes.damaged(format!("{size} bytes were declared to unpack to {unpacked}")));
                    }
                }
            }
        }
        rows = rows.saturating_add(batch.map_or(0, |batch| batch.length().max(0) as u64));
        bytes.seek(body + length as u64)?;
    }
    Ok(rows)
}

/// Calls a reader of these formats, which panics at some damage of a file: that is an error as any other.
fn guarded<T>(shown: &str, call: impl FnOnce() -> std::result::Result<T, ArrowError>) -> Result<T> {
    match catch_unwind(AssertUnwindSafe(call)) {
        Ok(given) => given.map_err(|error| failed(shown, error)),
        Err(_) => Err(Error::new("read", shown, "its lengths do not fit its contents").of(ErrorKind::DamagedData)),
    }
}

fn failed(shown: &str, error: ArrowError) -> Error {
    Error::caused("read", shown, error).of(ErrorKind::DamagedData)
}

impl ChannelFile for Table {
    fn channels(&self) -> &[Channel] {
        &self.channels
    }

    fn read(&self, channels: &[usize]) -> Result<Box<dyn Samples>> {
        let shown = self.input.path().display().to_string();
        checked(&shown, &self.channels, channels)?;
        // A column is read once, whatever it is wanted for, and in the order of the file.
        let mut columns = channels.to_vec();
        columns.sort_unstable();
        columns.dedup();
        let place = |channel: &usize| columns.binary_search(channel).unwrap_or(0);
        let wanted = channels
            .iter()
            .map(|channel| (place(channel), self.origins[*channel], unit_s(self.schema.field(*channel).data_type())));
        let wanted = wanted.collect();
        Ok(Box::new(BatchSamples { batches: self.batches(&columns, BATCH)?, shown, wanted, batch: None, used: 0 }))
    }
}

struct BatchSamples {
    batches: Batches,
    shown: String,
    /// Of each channel the column in a batch, its first instant, and the seconds of its unit.
    wanted: Vec<(usize, i64, f64)>,
    batch: Option<RecordBatch>,
    used: usize,
}

impl Samples for BatchSamples {
    fn next(&mut self, most: usize, columns: &mut [Vec<f64>]) -> Result<usize> {
        loop {
            if let Some(batch) = &self.batch
                && self.used < batch.num_rows()
            {
                let count = most.min(batch.num_rows() - self.used);
                for ((column, origin, unit_s), to) in self.wanted.iter().zip(columns) {
                    append(&batch.column(*column).slice(self.used, count), *origin, *unit_s, to);
                }
                self.used += count;
                return Ok(count);
            }
            self.batch = next(&mut self.batches, &self.shown)?;
            self.used = 0;
            if self.batch.is_none() {
                return Ok(0);
            }
        }
    }
}

fn kind_of(stored: &DataType) -> Kind {
    match stored {
        DataType::Int8 => Kind::I8,
        DataType::Int16 => Kind::I16,
        DataType::Int32 => Kind::I32,
        DataType::Int64 => Kind::I64,
        DataType::UInt8 => Kind::U8,
        DataType::UInt16 => Kind::U16,
        DataType::UInt32 => Kind::U32,
        DataType::UInt64 => Kind::U64,
        DataType::Float16 => Kind::F16,
        DataType::Float32 => Kind::F32,
        DataType::Float64 => Kind::F64,
        DataType::Boolean => Kind::Bool,
        DataType::Decimal128(..) | DataType::Decimal256(..) => Kind::Decimal,
        DataType::Timestamp(..)
        | DataType::Duration(_)
        | DataType::Time32(_)
        | DataType::Time64(_)
        | DataType::Date32
        | DataType::Date64 => Kind::Time,
        DataType::Utf8 | DataType::LargeUtf8 | DataType::Utf8View => Kind::Text,
        DataType::Dictionary(_, value) if matches!(**value, DataType::Utf8 | DataType::LargeUtf8) => Kind::Text,
        _ => Kind::Other,
    }
}

/// Seconds of the unit of a type; 1 of one without.
fn unit_s(stored: &DataType) -> f64 {
    match stored {
        DataType::Timestamp(unit, _) | DataType::Duration(unit) | DataType::Time32(unit) | DataType::Time64(unit) => {
            match unit {
                TimeUnit::Second => 1.0,
                TimeUnit::Millisecond => 1e-3,
                TimeUnit::Microsecond => 1e-6,
                TimeUnit::Nanosecond => 1e-9,
            }
        }
        DataType::Date32 => 86_400.0,
        DataType::Date64 => 1e-3,
        _ => 1.0,
    }
}

/// Appends numbers as f64, NaN for what is absent; instants in seconds from their origin.
fn append(array: &ArrayRef, origin: i64, unit_s: f64, to: &mut Vec<f64>) {
    fn each<T: ArrowPrimitiveType>(array: &ArrayRef, to: &mut Vec<f64>, convert: impl Fn(T::Native) -> f64) {
        if let Some(array) = array.as_any().downcast_ref::<PrimitiveArray<T>>() {
            to.extend(array.iter().map(|value| value.map_or(f64::NAN, &convert)));
        }
    }
    /// Their text is exact; the number is the nearest to it.
    fn decimals<T: DecimalType>(array: &ArrayRef, to: &mut Vec<f64>) {
        if let Some(array) = array.as_any().downcast_ref::<PrimitiveArray<T>>() {
            let text = |row| array.is_valid(row).then(|| array.value_as_string(row));
            to.extend((0..array.len()).map(|row| text(row).and_then(|text| text.parse().ok()).unwrap_or(f64::NAN)));
        }
    }
    let before = to.len();
    let instant = |value: i64| value.wrapping_sub(origin) as f64 * unit_s;
    match array.data_type() {
        DataType::Int8 => each::<Int8Type>(array, to, f64::from),
        DataType::Int16 => each::<Int16Type>(array, to, f64::from),
        DataType::Int32 => each::<Int32Type>(array, to, f64::from),
        DataType::Int64 => each::<Int64Type>(array, to, |value| value as f64),
        DataType::UInt8 => each::<UInt8Type>(array, to, f64::from),
        DataType::UInt16 => each::<UInt16Type>(array, to, f64::from),
        DataType::UInt32 => each::<UInt32Type>(array, to, f64::from),
        DataType::UInt64 => each::<UInt64Type>(array, to, |value| value as f64),
        DataType::Float16 => each::<Float16Type>(array, to, |value| crate::strided::half(value.to_bits())),
        DataType::Float32 => each::<Float32Type>(array, to, f64::from),
        DataType::Float64 => each::<Float64Type>(array, to, |value| value),
        DataType::Timestamp(TimeUnit::Second, _) => each::<TimestampSecondType>(array, to, instant),
        DataType::Timestamp(TimeUnit::Millisecond, _) => each::<TimestampMillisecondType>(array, to, instant),
        DataType::Timestamp(TimeUnit::Microsecond, _) => each::<TimestampMicrosecondType>(array, to, instant),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => each::<TimestampNanosecondType>(array, to, instant),
        DataType::Duration(TimeUnit::Second) => each::<DurationSecondType>(array, to, instant),
        DataType::Duration(TimeUnit::Millisecond) => each::<DurationMillisecondType>(array, to, instant),
        DataType::Duration(TimeUnit::Microsecond) => each::<DurationMicrosecondType>(array, to, instant),
        DataType::Duration(TimeUnit::Nanosecond) => each::<DurationNanosecondType>(array, to, instant),
        DataType::Time32(TimeUnit::Second) => each::<Time32SecondType>(array, to, |value| instant(value.into())),
        DataType::Time32(_) => each::<Time32MillisecondType>(array, to, |value| instant(value.into())),
        DataType::Time64(TimeUnit::Microsecond) => each::<Time64MicrosecondType>(array, to, instant),
        DataType::Time64(_) => each::<Time64NanosecondType>(array, to, instant),
        DataType::Date32 => each::<Date32Type>(array, to, |value| instant(value.into())),
        DataType::Date64 => each::<Date64Type>(array, to, instant),
        DataType::Boolean => {
            if let Some(array) = array.as_any().downcast_ref::<BooleanArray>() {
                to.extend(array.iter().map(|value| value.map_or(f64::NAN, |value| f64::from(u8::from(value)))));
            }
        }
        DataType::Decimal128(..) => decimals::<Decimal128Type>(array, to),
        DataType::Decimal256(..) => decimals::<Decimal256Type>(array, to),
        _ => {}
    }
    // A column of another type than the table says has no numbers.
    to.resize(before + array.len(), f64::NAN);
}

/// The first instant of a column, in its unit.
fn first_instant(array: &ArrayRef) -> Option<i64> {
    fn first<T: ArrowPrimitiveType<Native = i64>>(array: &ArrayRef) -> Option<i64> {
        array.as_any().downcast_ref::<PrimitiveArray<T>>()?.iter().flatten().next()
    }
    match array.data_type() {
        DataType::Timestamp(TimeUnit::Second, _) => first::<TimestampSecondType>(array),
        DataType::Timestamp(TimeUnit::Millisecond, _) => first::<TimestampMillisecondType>(array),
        DataType::Timestamp(TimeUnit::Microsecond, _) => first::<TimestampMicrosecondType>(array),
        DataType::Timestamp(TimeUnit::Nanosecond, _) => first::<TimestampNanosecondType>(array),
        _ => None,
    }
}
