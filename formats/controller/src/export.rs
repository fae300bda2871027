//! From tables to a file.

use std::path::{Path, PathBuf};

use runout_core::{
    Error, ErrorKind, Result,
    atomic_file::PendingFile,
    component_curves::{CURVES, ComponentCurves},
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::{Completed, Export, Exporter, ResultInfo, Takes},
    table::{RecordBatch, TableSpec},
};

use crate::{
    chain::Chain,
    config::{ControllerConfig, DialectName},
    dialects::dialect,
    header::header,
};

/// The exporter `controller`.
pub(crate) struct Controller {
    pub path: PathBuf,
    pub config: ControllerConfig,
}

impl StageConfig for ControllerConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "controller";
    const ABOUT: &'static str = "compensation file of a machine control, from component curves";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let needs = |key: &str, missing: bool, dialect: DialectName, what: &str| {
            let message = format!("the dialect `{}` needs `{key}`, {what}", dialect.name());
            if missing && self.dialect == dialect { Err(Fault::at("dialect", message)) } else { Ok(()) }
        };
        needs("axis", self.axis.is_none(), DialectName::Linuxcnc, "the axis of the file: `axis = \"X\"`")?;
        needs(
            "positive_moves",
            self.positive_moves.is_none(),
            DialectName::SiemensCec,
            "where a positive value moves the axis: \"positive\" or \"negative\"",
        )?;
        needs(
            "bed_z_mm",
            self.bed_z_mm.is_none(),
            DialectName::Klipper,
            "the height of the bed in machine coordinates",
        )?;
        if let Some(points) = self.most_points.filter(|points| *points < 2) {
            return Err(Fault::at("most_points", format!("a table has at least 2 points, found {points}")));
        }
        let is_file = Path::new(&self.path).file_name().is_some();
        if !is_file {
            return Err(Fault::at("path", "expected a file"));
        }
        Ok(Box::new(Controller { path: context.path(&self.path), config: self }))
    }
}

struct Pending {
    place: PendingFile,
    object: String,
    config: ControllerConfig,
    curves: ComponentCurves,
}

impl Exporter for Controller {
    fn takes(&self) -> Takes {
        Takes::Tables
    }

    fn needs(&self) -> Option<(&'static str, &'static str)> {
        Some((CURVES, "add `curves = { pitch_mm = [...] }` (rotary-axis: `{ pitch_deg = ... }`) to `[separate]`"))
    }

    fn outputs(&self, _tables: &[TableSpec]) -> Vec<PathBuf> {
        vec![self.path.clone()]
    }

    fn begin(&self, _result: &ResultInfo) -> Result<Box<dyn Export>> {
        let place = PendingFile::new(&self.path)?;
        let object = self.path.display().to_string();
        Ok(Box::new(Pending { place, object, config: self.config.clone(), curves: ComponentCurves::default() }))
    }
}

impl Pending {
    fn refuse(&self, problem: String) -> Error {
        Error::new("write", self.object.clone(), problem).of(ErrorKind::UnsuitableData)
    }

    fn text(&self, result: &Completed) -> Result<String> {
        if self.curves.nodes.is_empty() {
            return Err(self.refuse("the result has no component curves; its warnings say why".into()));
        }
        let whole = Chain::new(&self.curves).map_err(|problem| self.refuse(problem))?;
        let all = whole.errors();
        let is_known = |symbol: &String| all.contains(symbol) || whole.unknown.contains(symbol);
        if let Some(unknown) = self.config.leave_out.iter().find(|symbol| !is_known(symbol)) {
            let problem = format!("`leave_out` names {unknown}, and the result has {}", all.join(", "));
            return Err(self.refuse(problem));
        }
        let dialect = dialect(&self.config);
        let too_much: Vec<&str> = (all.iter())
            .filter(|symbol| !self.config.leave_out.contains(symbol) && !dialect.holds(symbol))
            .map(String::as_str)
            .collect();
        if !too_much.is_empty() {
            let problem = format!("a file of {} cannot hold {}", self.config.dialect.name(), too_much.join(", "));
            let names: Vec<String> = too_much.iter().map(|symbol| format!("\"{symbol}\"")).collect();
            let help = format!("name what it shall leave: `leave_out = [{}]`", names.join(", "));
            return Err(self.refuse(problem).help(help));
        }
        let kept = whole.without(&self.config.leave_out);
        let written = dialect.write(&kept).map_err(|problem| self.refuse(problem))?;
        let said = header(&self.config, &*dialect, &whole, &kept, written.notes, result);
        let said: Vec<String> = said.iter().map(|line| format!("{} {line}", dialect.comment())).collect();
        let lines = written.lines;
        let all = if dialect.comments_last() { [lines, said] } else { interleaved(lines, said) };
        Ok(all.concat().join("\n") + "\n")
    }
}

/// The header goes first, but below a line that names the file (`%…`).
fn interleaved(mut lines: Vec<String>, mut said: Vec<String>) -> [Vec<String>; 2] {
    if lines.first().is_some_and(|line| line.starts_with('%')) {
        said.insert(0, lines.remove(0));
    }
    [said, lines]
}

impl Export for Pending {
    fn rows(&mut self, table: &TableSpec, rows: &RecordBatch) -> Result<()> {
        self.curves.take(&table.name, rows)
    }

    fn finish(self: Box<Self>, result: &Completed) -> Result<Vec<PendingFile>> {
        let text = self.text(result)?;
        self.place.write(text.as_bytes())?;
        Ok(vec![self.place])
    }
}
