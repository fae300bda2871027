//! One Parquet file, written row group by row group.

use std::{fs::File, path::PathBuf};

use parquet::{
    arrow::ArrowWriter,
    basic::{Compression, Encoding, ZstdLevel},
    file::{
        metadata::KeyValue,
        properties::{WriterProperties, WriterPropertiesBuilder},
    },
    schema::types::ColumnPath,
};
use runout_core::{
    Result,
    atomic_file::PendingFile,
    table::{Kind, RecordBatch, TableSpec},
};

/// Rows in a row group. What is buffered, some 0.5 MB a table, does not depend on the number of stations, and a reader that
/// wants one station skips all other groups by their statistics.
const ROWS_PER_GROUP: usize = 16_384;

/// A table under a temporary name.
pub(crate) struct TableFile {
    writer: ArrowWriter<File>,
    // Last, so that the file is closed before its temporary name is removed.
    pending: PendingFile,
}

impl TableFile {
    /// Begins a file that will appear as `path`.
    ///
    /// # Errors
    /// When it cannot be created.
    pub(crate) fn create(path: PathBuf, table: &TableSpec) -> Result<Self> {
        let pending = PendingFile::new(path)?;
        let schema = table.schema();
        let properties = properties(table).build();
        let writer =
            ArrowWriter::try_new(pending.create()?, schema, Some(properties)).map_err(|error| pending.caused(error))?;
        Ok(Self { writer, pending })
    }

    /// Appends rows.
    ///
    /// # Errors
    /// When the file system refuses them.
    pub(crate) fn append(&mut self, rows: &RecordBatch) -> Result<()> {
        self.writer.write(rows).map_err(|error| self.pending.caused(error))
    }

    /// Completes the file with metadata; it appears when the result is committed.
    ///
    /// # Errors
    /// When the file system refuses the rest.
    pub(crate) fn close(mut self, entries: &[(String, String)]) -> Result<PendingFile> {
        for (key, value) in entries {
            self.writer.append_key_value_metadata(KeyValue::new(key.clone(), value.clone()));
        }
        self.writer.close().map_err(|error| self.pending.caused(error))?;
        Ok(self.pending)
    }
}

/// Dictionaries for names, which repeat; numbers as they are where they are measured, since packing them takes long and saves
/// a tenth; BYTE_STREAM_SPLIT for others, which packs high bytes that are alike; differences for orders, which go up by one.
fn properties(table: &TableSpec) -> WriterPropertiesBuilder {
    let mut properties = WriterProperties::builder()
        .set_compression(Compression::ZSTD(ZstdLevel::default()))
        .set_max_row_group_row_count(Some(ROWS_PER_GROUP))
        .set_created_by(format!("runout {}", runout_core::provenance::VERSION));
    for spec in &table.columns {
        let column = ColumnPath::from(spec.name.as_str());
        let encoding = match spec.kind {
            Kind::Number if spec.measured => {
                properties = properties.set_column_compression(column.clone(), Compression::UNCOMPRESSED);
                Encoding::PLAIN
            }
            Kind::Number => Encoding::BYTE_STREAM_SPLIT,
            Kind::Count => Encoding::DELTA_BINARY_PACKED,
            Kind::Name | Kind::Text | Kind::Flag => continue,
        };
        properties =
            properties.set_column_dictionary_enabled(column.clone(), false).set_column_encoding(column, encoding);
    }
    properties
}

#[cfg(test)]
mod tests {
    use runout_core::table::{ColumnSpec, numbers};

    use super::*;

    #[test]
    fn what_is_buffered_does_not_grow_and_nothing_appears_before_its_time() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("numbers.parquet");
        let spec = TableSpec::new("numbers", "", vec![ColumnSpec::number("number", "", "")]);
        let mut table = TableFile::create(path.clone(), &spec).unwrap();
        let mut seed = 1_u64;
        for _ in 0..200 {
            let column = numbers((0..5120).map(|_| {
                seed = seed.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                seed as f64
            }));
            table.append(&spec.rows(vec![column]).unwrap()).unwrap();
            assert!(table.writer.in_progress_rows() < ROWS_PER_GROUP);
            // A row group of one incompressible column takes 8 bytes a row; twice that leaves room for buffers.
            assert!(table.writer.memory_size() < 16 * ROWS_PER_GROUP);
        }
        assert!(!path.exists());
        let pending = table.close(&[]).unwrap();
        assert!(!path.exists());
        pending.commit().unwrap();
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }
}
