//! An evaluator: the tables of a result out, one request each, then its summary; values in.

use runout_core::{
    Error, Result,
    stage::{Evaluation, Evaluator, OwnValues, ResultInfo},
    summary::Summary,
    table::{ColumnSpec, RecordBatch, TableSpec, texts},
};
use serde_json::Value;

use crate::{
    answer::Answer,
    frame::Frame,
    responder::Responder,
    session::Session,
    tables::encode,
    values::{Symbols, VALUES, values},
};

/// What computes values of its own.
pub(crate) struct ExternalEvaluator {
    pub responder: Responder,
    pub config: Value,
    /// Those that it may give, at least one.
    pub symbols: Symbols,
}

impl Evaluator for ExternalEvaluator {
    fn symbols(&self) -> Symbols {
        self.symbols.clone()
    }

    fn begin(&self, result: &ResultInfo) -> Result<Box<dyn Evaluation>> {
        let evaluation = ExternalEvaluation {
            session: Session::new(self.responder.clone()),
            about: [
                ("stage", "evaluate".to_owned()),
                ("config", self.config.to_string()),
                ("title", result.title.clone()),
            ],
            symbols: self.symbols.clone(),
        };
        evaluation.announce()?;
        Ok(Box::new(evaluation))
    }
}

/// An evaluation under way.
struct ExternalEvaluation {
    session: Session,
    about: [(&'static str, String); 3],
    symbols: Symbols,
}

const OBJECT: &str = "the result";

impl ExternalEvaluation {
    /// Says which values are wanted.
    fn announce(&self) -> Result<()> {
        let columns = [("symbol", "symbol of a value"), ("unit", "its unit; empty for a number without one")];
        let columns = columns.map(|(name, about)| ColumnSpec::text(name, about));
        let spec = TableSpec::new("symbols", "values that may be given", columns.into());
        let [symbols, units] = [0, 1].map(|part| texts(self.symbols.iter().map(|one| [one.0, one.1][part])));
        self.ask_table(&spec, &spec.rows(vec![symbols, units])?)
    }

    fn ask_table(&self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        let frame = encode(&table.name, rows, &self.about);
        let frame = frame.map_err(|error| Error::caused("write", format!("the table {}", table.name), error))?;
        self.session.answer(("evaluate", OBJECT), request(&frame), |answer| Answer::of(answer, &[]).map(|_| ()))
    }
}

fn request(frame: &Frame) -> Vec<u8> {
    let mut request = Vec::new();
    frame.append_to(&mut request);
    Frame::end().append_to(&mut request);
    request
}

impl Evaluation for ExternalEvaluation {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.ask_table(table, rows)
    }

    fn finish(self: Box<Self>, summary: &Summary) -> Result<OwnValues> {
        let body = serde_json::to_vec(summary).map_err(|error| Error::caused("evaluate", OBJECT, error))?;
        let request = request(&Frame { name: "summary".into(), body });
        self.session.answer(("evaluate", OBJECT), request, |answer| {
            let answer = Answer::of(answer, &[VALUES])?;
            Ok(OwnValues { values: values(&answer, &self.symbols)?, remarks: answer.warnings })
        })
    }
}
