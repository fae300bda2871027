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
    dialects::{Comments, dialect},
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
        for dialect in [DialectName::SiemensCec, DialectName::Heidenhain, DialectName::FanucPitch, DialectName::Fanuc3d]
        {
            needs(
                "positive_moves",
                self.positive_moves.is_none(),
                dialect,
                "where a positive value moves the axis: \"positive\" or \"negative\"",
            )?;
        }
        needs(
            "com",
            self.com.is_empty(),
            DialectName::Heidenhain,
            "the files of the axes whose positions count: `com = { X = \"x.com\" }`",
        )?;
        for dialect in [DialectName::FanucPitch, DialectName::Fanuc3d] {
            needs(
                "detection_unit",
                self.detection_unit.is_empty(),
                dialect,
                "that of each axis in mm or °: `detection_unit = { X = 0.001 }`",
            )?;
        }
        if let Some((axis, unit)) = self.detection_unit.iter().find(|(_, unit)| !(unit.is_finite() && **unit > 0.0)) {
            return Err(Fault::at("detection_unit", format!("expected a unit above 0 for {axis}, found {unit}")));
        }
        if self.magnification == 0 {
            return Err(Fault::at("magnification", "expected at least 1, found 0"));
        }
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
        if let Some(file) = self.com.values().find(|file| file.file_name() != Some(file.as_os_str())) {
            let message = format!("expected the name of a file beside `path`, found {}", file.display());
            return Err(Fault::at("com", message));
        }
        let controller = Controller { path: context.path(&self.path), config: self };
        let mut files = controller.files();
        files.sort();
        if let Some(pair) = files.windows(2).find(|pair| pair[0] == pair[1]) {
            let key = if controller.config.dialect == DialectName::Heidenhain { "com" } else { "path" };
            return Err(Fault::at(key, format!("two files of this export have the name {}", pair[0].display())));
        }
        Ok(Box::new(controller))
    }
}

impl Controller {
    /// The files that it writes: its own, those beside it, and the text about them.
    fn files(&self) -> Vec<PathBuf> {
        let mut all = vec![self.path.clone()];
        if self.config.dialect == DialectName::Heidenhain {
            all.extend(self.config.com.values().map(|file| self.path.with_file_name(file)));
        }
        if dialect(&self.config).comments() == Comments::Apart {
            all.push(self.path.with_extension("txt"));
        }
        all
    }
}

struct Pending {
    places: Vec<(PendingFile, PathBuf)>,
    path: PathBuf,
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
        self.files()
    }

    fn begin(&self, _result: &ResultInfo) -> Result<Box<dyn Export>> {
        let places = self.files().into_iter().map(|file| Ok((PendingFile::new(&file)?, file)));
        Ok(Box::new(Pending {
            places: places.collect::<Result<_>>()?,
            path: self.path.clone(),
            config: self.config.clone(),
            curves: ComponentCurves::default(),
        }))
    }
}

impl Pending {
    fn refuse(&self, problem: String) -> Error {
        Error::new("write", self.path.display().to_string(), problem).of(ErrorKind::UnsuitableData)
    }

    /// The files with their lines.
    fn texts(&self, result: &Completed) -> Result<Vec<(PathBuf, Vec<String>)>> {
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
        let marked = |[before, after]: [&str; 2]| -> Vec<String> {
            said.iter().map(|line| format!("{before}{line}{after}")).collect()
        };
        let mut files: Vec<(PathBuf, Vec<String>)> =
            written.beside.into_iter().map(|(file, lines)| (self.path.with_file_name(file), lines)).collect();
        let lines = match dialect.comments() {
            Comments::First(mark) => interleaved(written.lines, marked([&format!("{mark} "), ""])).concat(),
            Comments::Last(before, after) => [written.lines, marked([before, after])].concat(),
            Comments::Apart => {
                files.push((self.path.with_extension("txt"), said));
                written.lines
            }
        };
        files.push((self.path.clone(), lines));
        Ok(files)
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
        let texts = self.texts(result)?;
        for (place, file) in &self.places {
            let lines = texts.iter().find(|(known, _)| known == file).map(|(_, lines)| lines.join("\n") + "\n");
            place.write(lines.unwrap_or_default().as_bytes())?;
        }
        Ok(self.places.into_iter().map(|(place, _)| place).collect())
    }
}
