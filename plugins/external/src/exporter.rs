//! An exporter: the tables of a result out, one request each; what answers writes its files itself.

use std::path::PathBuf;

use runout_core::{
    Error, Result,
    atomic_file::PendingFile,
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{ColumnSpec, RecordBatch, TableSpec, texts},
};
use serde_json::Value;

use crate::{answer::Answer, frame::Frame, responder::Responder, session::Session, tables::encode};

/// What writes files of a format of its own.
pub(crate) struct ExternalExporter {
    pub responder: Responder,
    pub config: Value,
    /// The folder of its files.
    pub folder: PathBuf,
    /// Their names, at least one.
    pub files: Vec<String>,
}

impl Exporter for ExternalExporter {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        self.files.iter().map(|name| self.folder.join(name)).collect()
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Export>> {
        let files = self.outputs(&[]).into_iter().map(PendingFile::new).collect::<Result<Vec<_>>>()?;
        let export = ExternalExport {
            session: Session::new(self.responder.clone()),
            about: [
                ("stage", "export".to_owned()),
                ("config", self.config.to_string()),
                ("title", result.title.clone()),
            ],
            object: self.folder.display().to_string(),
            writer: self.responder.shown(),
            files,
        };
        export.announce(&self.files)?;
        Ok(Box::new(export))
    }
}

/// An export under way. What was written under temporary names is removed with it.
struct ExternalExport {
    session: Session,
    about: [(&'static str, String); 3],
    object: String,
    /// What writes them, for messages.
    writer: String,
    files: Vec<PendingFile>,
}

impl ExternalExport {
    /// Sends the names of the files, and the paths to write them to.
    fn announce(&self, names: &[String]) -> Result<()> {
        let columns =
            [("name", "name of a file"), ("path", "where to write it: it gets its name when the run is complete")];
        let columns = columns.map(|(name, about)| ColumnSpec::text(name, about));
        let spec = TableSpec::new("files", "files to write", columns.into());
        let path = |file: &PendingFile| {
            let path = std::path::absolute(file.path()).unwrap_or_else(|_| file.path().to_owned());
            path.display().to_string()
        };
        self.ask_table(&spec, &spec.rows(vec![texts(names), texts(self.files.iter().map(path))])?)
    }

    fn ask_table(&self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        let frame = encode(&table.name, rows, &self.about);
        self.ask(&frame.map_err(|error| Error::caused("write", format!("the table {}", table.name), error))?)
    }

    fn ask(&self, frame: &Frame) -> Result<()> {
        let mut request = Vec::new();
        frame.append_to(&mut request);
        Frame::end().append_to(&mut request);
        self.session.answer(("export", &self.object), request, |answer| Answer::of(answer, &[]).map(|_| ()))
    }
}

impl Export for ExternalExport {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.ask_table(table, rows)
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let summary =
            serde_json::to_vec(result.summary).map_err(|error| Error::caused("export", &self.object, error))?;
        self.ask(&Frame { name: "summary".into(), body: summary })?;
        for file in &self.files {
            if !file.path().is_file() {
                let problem = format!("{} did not write it", self.writer);
                return Err(file
                    .failure(problem)
                    .help("it writes each of `files` to the path that the table `files` gives"));
            }
        }
        Ok(self.files)
    }
}
