//! An exporter that keeps a result in memory.

use std::{
    path::PathBuf,
    sync::{Arc, Mutex, PoisonError},
};

use runout_core::{
    Result,
    atomic_file::PendingFile,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    surface::Surface,
    table::{RecordBatch, TableSpec},
};

use crate::{interruptible::interrupted, work::Stop};

/// What is kept of a result.
#[derive(Debug, Default)]
pub(crate) struct Kept {
    /// Tables with their rows, piece by piece.
    pub tables: Vec<(TableSpec, Vec<RecordBatch>)>,
    /// Form over angle and z, where it was made.
    pub surface: Option<Surface>,
}

/// Keeps what a run gives, and refuses to complete an interrupted one: the files of all exporters appear together or not at all.
#[derive(Debug, Clone, Default)]
pub(crate) struct Collector {
    /// What was kept.
    pub kept: Arc<Mutex<Kept>>,
    /// Whether the surface is asked for.
    pub with_surface: bool,
    /// Whether to stop.
    pub stop: Stop,
}

impl Collector {
    /// What was kept, once the run is over.
    pub(crate) fn take(&self) -> Kept {
        std::mem::take(&mut *self.kept.lock().unwrap_or_else(PoisonError::into_inner))
    }

    fn go_on(&self) -> Result<()> {
        if self.stop.is_set() { Err(interrupted("the result")) } else { Ok(()) }
    }
}

impl Exporter for Collector {
    fn takes(&self) -> Takes {
        if self.with_surface { Takes::TablesAndSurface } else { Takes::Tables }
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        Vec::new()
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        // An optional table is there where it has rows.
        let certain = result.tables.iter().filter(|table| !table.optional);
        kept.tables = certain.map(|table| (table.clone(), Vec::new())).collect();
        drop(kept);
        Ok(Box::new(self.clone()))
    }
}

impl Export for Collector {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.go_on()?;
        let mut kept = self.kept.lock().unwrap_or_else(PoisonError::into_inner);
        match kept.tables.iter_mut().find(|(known, _)| known.name == table.name) {
            Some((_, batches)) => batches.push(rows.clone()),
            None => kept.tables.push((table.clone(), vec![rows.clone()])),
        }
        Ok(())
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        self.go_on()?;
        self.kept.lock().unwrap_or_else(PoisonError::into_inner).surface = result.surface.cloned();
        Ok(Vec::new())
    }
}
