//! The exporters of a batch: what `[[export]]` names, below the folder of the data set.

use runout_error::fault::Fault;
use std::path::PathBuf;

use toml::{Spanned, de::DeValue};

use super::ResultStore;
use crate::{
    atomic_file::resolved,
    pipeline::{
        document::{self, Sources, Table},
        registry::{Context, Registry},
    },
    stage::{Exporter, Takes},
};
use runout_table::TableSpec;
use runout_turning::rig::Rig;

/// Those that take tables, each with its files in the folder of the data set; the data set's own comes first, and one that would
/// write its files again is left out.
pub(super) fn of_batch(
    root: &Table,
    sources: &Sources,
    registry: &Registry,
    rig: Option<&Rig>,
    store: &dyn ResultStore,
    tables: &[TableSpec],
) -> Result<Vec<Box<dyn Exporter>>, Fault> {
    let folder = std::path::absolute(store.folder()).unwrap_or_else(|_| store.folder().to_owned());
    let context = Context { folder: sources.folder(), rig };
    let mut exporters = vec![store.exporter_of_all()];
    let written = |exporter: &dyn Exporter| -> Vec<PathBuf> {
        exporter.outputs(tables).iter().map(|path| resolved(path)).collect()
    };
    let mut taken = written(&*exporters[0]);
    for table in document::tables(root, "export")? {
        let configured = registry.exporters.build(&table, &context)?;
        if configured.takes() == Takes::Surface {
            continue;
        }
        let mut keys = table.get_ref().clone();
        if let Some(value) = keys.get_mut("path")
            && let Some(path) = value.get_ref().as_str().map(PathBuf::from)
        {
            let is_file = configured.outputs(tables).contains(&context.path(&path));
            let name = path.file_name().filter(|_| is_file);
            let moved = name.map_or_else(|| folder.clone(), |name| folder.join(name));
            *value.get_mut() = DeValue::String(moved.to_string_lossy().into_owned().into());
        }
        let exporter = registry.exporters.build(&Spanned::new(table.span(), keys), &context)?;
        let outputs = written(&*exporter);
        if outputs.iter().all(|output| !taken.contains(output)) {
            taken.extend(outputs);
            exporters.push(exporter);
        }
    }
    Ok(exporters)
}
