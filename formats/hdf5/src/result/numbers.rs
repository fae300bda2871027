//! A model's table in a result file.

use std::path::PathBuf;

use hdf5_metno::{File, Result as Outcome};
use runout_core::{Result, atomic_file::PendingFile, pipeline::run::Summary, stage::TableExporter, table::Table};

use super::{ResultExporter, complete, create};
use crate::node;

impl TableExporter for ResultExporter {
    fn table_output(&self, _name: &str) -> PathBuf {
        self.path.clone()
    }

    fn write_table(&self, table: &Table, summary: &Summary) -> Result<Vec<PendingFile>> {
        let pending = PendingFile::new(&self.path)?;
        let write = || -> Outcome<()> {
            let file = create(pending.path(), &summary.title, &table.about)?;
            put(&file, table)?;
            complete(&file, summary)
        };
        write().map_err(|error| pending.failure(error))?;
        Ok(vec![pending])
    }
}

fn put(file: &File, table: &Table) -> Outcome<()> {
    let group = file.create_group(&table.name)?;
    for column in &table.columns {
        let written = group.new_dataset_builder().with_data(&column.values).create(column.name.as_str())?;
        node::put_text(&written, "unit", &column.unit)?;
        node::put_text(&written, "meaning", &column.about)?;
    }
    Ok(())
}
