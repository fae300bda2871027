//! A data set: the tables of many recordings, partitioned by recording as Hive does (`form/recording=NAME/0.parquet`), so that a reader
//! of data sets takes all files below `form` as one table.

use std::{
    fmt::Write,
    fs::{self, File},
    io,
    path::{Path, PathBuf},
};

use parquet::arrow::arrow_reader::ParquetRecordBatchReaderBuilder;
use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    pipeline::batch::{Gathered, RECORDING, ResultStore, recording_column},
    stage::Exporter,
    table::{ArrayRef, RecordBatch, TableSpec, stretches},
};

use crate::{Parquet, ParquetFile, table::TableFile};

/// The folder of the summaries, and the file of each.
const SUMMARIES: &str = "summaries";
const SUMMARY: &str = "summary.json";
/// The file of a table's partition.
const FILE: &str = "0.parquet";

/// A folder with the results of many recordings.
#[derive(Debug, Clone)]
pub struct DataSet {
    folder: PathBuf,
}

/// One recording's place in a data set: `recording=NAME`, a folder in that of each table, in which no other recording publishes.
#[derive(Debug, Clone)]
pub(crate) struct Partition(String);

impl DataSet {
    /// In this folder, which need not exist.
    ///
    /// # Errors
    /// When a file of that name exists.
    pub fn new(folder: PathBuf) -> Result<Self> {
        if folder.is_file() {
            return Err(Error::new("write to", folder.display().to_string(), "there is a file of that name")
                .of(ErrorKind::Io)
                .help("name a folder"));
        }
        Ok(Self { folder })
    }

    /// The folders in the data set.
    fn folders(&self) -> Result<Vec<PathBuf>> {
        Ok(entries(&self.folder)?.into_iter().filter(|path| path.is_dir()).collect())
    }
}

impl Partition {
    fn of(recording: &str) -> Self {
        Self(format!("{RECORDING}={}", encoded(recording)))
    }

    pub(crate) fn file(&self, data_set: &Path, table: &str) -> PathBuf {
        data_set.join(table).join(&self.0).join(FILE)
    }

    pub(crate) fn summary(&self, data_set: &Path) -> PathBuf {
        data_set.join(SUMMARIES).join(&self.0).join(SUMMARY)
    }
}

impl ResultStore for DataSet {
    fn exporter(&self, recording: &str) -> Box<dyn Exporter> {
        Box::new(Parquet { folder: self.folder.clone(), partition: Some(Partition::of(recording)) })
    }

    fn remove(&self, recording: &str) -> Result<()> {
        let partition = Partition::of(recording);
        let outdated = |path: &Path, outcome: io::Result<()>| match outcome {
            Err(error) if error.kind() != io::ErrorKind::NotFound => {
                Err(Error::caused("remove the outdated", path.display().to_string(), error))
            }
            _ => Ok(()),
        };
        let summary = partition.summary(&self.folder);
        outdated(&summary, fs::remove_file(&summary))?;
        for table in self.folders()? {
            let file = table.join(&partition.0).join(FILE);
            outdated(&file, fs::remove_file(&file))?;
            // A folder with something else in it stays.
            let _ = fs::remove_dir(table.join(&partition.0));
        }
        Ok(())
    }

    fn recordings(&self) -> Result<Vec<String>> {
        let prefix = format!("{RECORDING}=");
        let mut recordings = Vec::new();
        for folder in self.folders()? {
            for entry in entries(&folder)? {
                let Some(name) = entry.file_name().and_then(|name| name.to_str()) else { continue };
                let holds = [FILE, SUMMARY].iter().any(|file| entry.join(file).is_file());
                let found = name.strip_prefix(&prefix).filter(|_| holds);
                recordings.extend(found.and_then(decoded));
            }
        }
        recordings.sort_unstable();
        recordings.dedup();
        Ok(recordings)
    }

    fn gather(&self, table: &TableSpec, recordings: &[String]) -> Result<Box<dyn Gathered>> {
        let mut columns = vec![recording_column()];
        columns.extend(table.columns.iter().cloned());
        let spec = TableSpec::new(table.name.clone(), table.about.clone(), columns);
        let path = self.folder.join(format!("{}.parquet", table.name));
        let mut file = TableFile::create(path, &spec)?;
        for recording in recordings {
            let part = Partition::of(recording).file(&self.folder, &table.name);
            if !part.is_file() {
                // A table that a result may lack.
                continue;
            }
            each(&part, &mut |rows| {
                let own = table.columns.iter().map(|column| {
                    rows.column_by_name(&column.name).cloned().ok_or_else(|| {
                        Error::new("read", part.display().to_string(), format!("it has no column {}", column.name))
                    })
                });
                let names = std::iter::once(Ok(stretches([(recording.as_str(), rows.num_rows())])));
                let columns: Vec<ArrayRef> = names.chain(own).collect::<Result<_>>()?;
                file.append(&spec.rows(columns)?)
            })?;
        }
        Ok(Box::new(GatheredTable { file: file.close(&[("runout.about".to_owned(), table.about.clone())])? }))
    }

    fn exporter_of_all(&self) -> Box<dyn Exporter> {
        Box::new(Parquet { folder: self.folder.clone(), partition: None })
    }

    fn folder(&self) -> &Path {
        &self.folder
    }
}

/// A table of all recordings under its temporary name.
struct GatheredTable {
    file: PendingFile,
}

impl Gathered for GatheredTable {
    fn each(&self, take: &mut dyn FnMut(&RecordBatch) -> Result<()>) -> Result<()> {
        each(self.file.path(), take)
    }

    fn finish(self: Box<Self>) -> PendingFile {
        self.file
    }
}

/// Gives the rows of a file, some at a time.
fn each(path: &Path, take: &mut dyn FnMut(&RecordBatch) -> Result<()>) -> Result<()> {
    let shown = || path.display().to_string();
    let file = File::open(path).and_then(ParquetFile::new).map_err(|error| Error::caused("read", shown(), error))?;
    let damaged = |error: parquet::errors::ParquetError| {
        Error::caused("read", shown(), error).of(ErrorKind::DamagedData).help("delete it and run the batch again")
    };
    let rows = ParquetRecordBatchReaderBuilder::try_new(file)
        .and_then(ParquetRecordBatchReaderBuilder::build)
        .map_err(damaged)?;
    for rows in rows {
        take(&rows.map_err(|error| Error::caused("read", shown(), error).of(ErrorKind::DamagedData))?)?;
    }
    Ok(())
}

/// What is in a folder; nothing where there is none.
fn entries(folder: &Path) -> Result<Vec<PathBuf>> {
    let failure = |error: io::Error| Error::caused("read the folder", folder.display().to_string(), error);
    match fs::read_dir(folder) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => Ok(Vec::new()),
        Err(error) => Err(failure(error)),
        Ok(entries) => entries.map(|entry| entry.map(|entry| entry.path()).map_err(failure)).collect(),
    }
}

/// A name as Hive writes it in paths: everything but letters, digits, `-`, `_` and `.` is percent-encoded, and a leading dot is, too.
fn encoded(name: &str) -> String {
    let mut encoded = String::with_capacity(name.len());
    for (at, character) in name.char_indices() {
        if character.is_alphanumeric() || matches!(character, '-' | '_') || (character == '.' && at > 0) {
            encoded.push(character);
        } else {
            for byte in character.encode_utf8(&mut [0; 4]).bytes() {
                // A string takes whatever is written to it.
                let _ = write!(encoded, "%{byte:02X}");
            }
        }
    }
    encoded
}

/// The name behind [`encoded`]; nothing where it is none.
fn decoded(name: &str) -> Option<String> {
    let mut bytes = Vec::with_capacity(name.len());
    let mut rest = name.as_bytes();
    while let Some((&first, after)) = rest.split_first() {
        if first == b'%' {
            let digits = std::str::from_utf8(after.get(..2)?).ok()?;
            bytes.push(u8::from_str_radix(digits, 16).ok()?);
            rest = &after[2..];
        } else {
            bytes.push(first);
            rest = after;
        }
    }
    String::from_utf8(bytes).ok()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_encoded_and_come_back() {
        for (name, expected) in [
            ("part-01_b.2", "part-01_b.2"),
            ("a/b c=d%", "a%2Fb%20c%3Dd%25"),
            ("Welle ä\n\"x\"", "Welle%20ä%0A%22x%22"),
            ("..", "%2E."),
            (".hidden", "%2Ehidden"),
            ("日本", "日本"),
        ] {
            assert_eq!(encoded(name), expected);
            assert_eq!(decoded(expected).as_deref(), Some(name));
        }
        assert_eq!(decoded("%zz"), None);
        assert_eq!(decoded("%F"), None);
        assert_eq!(decoded("%FF"), None);
    }
}
