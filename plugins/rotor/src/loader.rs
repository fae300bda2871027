//! The loader `rotor-model`: a rotor from TOML, or its matrices from Matrix Market files.

use std::path::{Path, PathBuf};

use faer::Mat;
use runout_core::{
    Error, Result,
    fault::Fault,
    input_file::InputFile,
    pipeline::{
        Context, StageConfig,
        document::{ConfigError, Document, Sources, checked},
    },
    points::Points,
    stage::{Loader, Request, Source, SourceKind},
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::{
    assemble::assemble,
    equations::{Equations, Node, Role},
    matrix_market,
    model::{Bearing, Disk, Dof, Material, Matrices, RotorModel, Segment, Support},
    plausible, transfer,
};

/// `[load] plugin = "rotor-model"`: a file, or the model itself.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorModelConfig {
    /// TOML file with the keys below, relative to this one.
    #[serde(default)]
    pub path: Option<PathBuf>,
    /// Materials of the segments.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Cylindrical segments of the shaft, one after the other from z = 0.
    #[serde(default)]
    pub segments: Vec<Segment>,
    /// Rigid disks: wheels, pulleys, chucks, parts.
    #[serde(default)]
    pub disks: Vec<Disk>,
    /// Springs and dampers between shaft and ground.
    #[serde(default)]
    pub bearings: Vec<Bearing>,
    /// Places that cannot move.
    #[serde(default)]
    pub supports: Vec<Support>,
    /// Matrices of the equations of motion, instead of all the above.
    #[serde(default)]
    pub matrices: Option<Matrices>,
}

impl StageConfig for RotorModelConfig {
    type Stage = Box<dyn Loader>;

    const NAME: &'static str = "rotor-model";
    const ABOUT: &'static str = "a rotor from materials, segments, disks and bearings, or from its matrices";

    fn check(self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        let Self { path, materials, segments, disks, bearings, supports, matrices } = self;
        let model = RotorModel { materials, segments, disks, bearings, supports, matrices };
        let Some(path) = path else {
            if model.segments.is_empty() && model.matrices.is_none() {
                let help = "path = \"rotor.toml\"; or `materials` and `segments`, or `matrices`, here";
                return Err(Fault::at("path", "expected the file of a rotor").help(help));
            }
            model.check()?;
            let folder = context.folder.to_path_buf();
            return Ok(Box::new(RotorLoader { place: Place::Here { folder, model: Box::new(model) } }));
        };
        let written = [
            ("materials", !model.materials.is_empty()),
            ("segments", !model.segments.is_empty()),
            ("disks", !model.disks.is_empty()),
            ("bearings", !model.bearings.is_empty()),
            ("supports", !model.supports.is_empty()),
            ("matrices", model.matrices.is_some()),
        ];
        if let Some((key, _)) = written.into_iter().find(|(_, written)| *written) {
            let fault = Fault::at(key, format!("`path` names the file of the rotor; `{key}` belongs into it"));
            return Err(fault.help(format!("leave `path` or `{key}` out")));
        }
        if path.as_os_str().is_empty() {
            return Err(Fault::at("path", "expected the name of a file"));
        }
        Ok(Box::new(RotorLoader { place: Place::File(context.path(&path)) }))
    }
}

struct RotorLoader {
    place: Place,
}

enum Place {
    File(PathBuf),
    Here { folder: PathBuf, model: Box<RotorModel> },
}

impl Loader for RotorLoader {
    fn kind(&self) -> SourceKind {
        SourceKind::Points
    }

    fn open(&self, _wanted: &Request) -> Result<Source> {
        let (rotor, input) = match &self.place {
            Place::File(path) => {
                let file = InputFile::new(path)?;
                let mut rotor = read(path)?;
                rotor.opened.push(file);
                (rotor, path.clone())
            }
            Place::Here { folder, model } => (build("the rotor", folder, model)?, PathBuf::new()),
        };
        let points = transfer::to_points(&rotor.equations);
        Ok(Source::Points(Points {
            input,
            besides: rotor.files,
            opened: rotor.opened,
            remarks: rotor.warnings,
            ..points
        }))
    }
}

/// A rotor that was read.
#[derive(Debug, Clone)]
pub struct Rotor {
    /// Its equations of motion.
    pub equations: Equations,
    /// Files of matrices.
    pub files: Vec<PathBuf>,
    /// The files that it was read from, as they were then.
    pub opened: Vec<InputFile>,
    /// What looks like a mistake in it.
    pub warnings: Vec<String>,
}

/// Reads a rotor's file.
///
/// # Errors
/// When a file cannot be read, or is no rotor; the message has line and column.
pub fn read(path: &Path) -> Result<Rotor> {
    let sources = Sources::read(path, &[], "").map_err(failure)?;
    let model = parse(&sources).map_err(failure)?;
    let folder = path.parent().unwrap_or_else(|| Path::new(""));
    build(&path.display().to_string(), folder, &model)
}

fn parse(sources: &Sources) -> std::result::Result<RotorModel, ConfigError> {
    let document = Document::parse(sources)?;
    checked::<RotorModel, _>(document.root(), |model| model.check().map(|()| model))
        .map_err(|fault| document.diagnose(fault).into())
}

fn failure(error: ConfigError) -> Error {
    match error {
        ConfigError::File(error) => error,
        ConfigError::Text(found) => {
            let (line, column) = found.line_and_column();
            let object = format!("{}, line {line}, column {column}", found.source_name);
            let error = Error::new("read", object, &found.message);
            match found.help {
                Some(help) => error.help(help),
                None => error,
            }
        }
    }
}

fn build(object: &str, folder: &Path, model: &RotorModel) -> Result<Rotor> {
    let warnings = plausible::warnings(model);
    match &model.matrices {
        None => Ok(Rotor { equations: assemble(object, model)?, files: Vec::new(), opened: Vec::new(), warnings }),
        Some(matrices) => {
            let files: Vec<(Role, PathBuf)> =
                matrices.files().into_iter().map(|(role, file)| (role, folder.join(file))).collect();
            let opened = files.iter().map(|(_, file)| InputFile::new(file)).collect::<Result<_>>()?;
            let equations = of_matrices(object, &files, matrices)?;
            Ok(Rotor { equations, files: files.into_iter().map(|(_, file)| file).collect(), opened, warnings })
        }
    }
}

impl Matrices {
    fn files(&self) -> Vec<(Role, &PathBuf)> {
        let needed = [(Role::Stiffness, &self.stiffness), (Role::Mass, &self.mass)];
        let optional = [
            (Role::Gyroscopic, &self.gyroscopic),
            (Role::Damping, &self.damping),
            (Role::Circulatory, &self.circulatory),
        ];
        let given = optional.into_iter().filter_map(|(role, file)| file.as_ref().map(|file| (role, file)));
        needed.into_iter().chain(given).collect()
    }
}

fn of_matrices(object: &str, files: &[(Role, PathBuf)], matrices: &Matrices) -> Result<Equations> {
    let Matrices { node_z_mm, node_dofs, .. } = matrices;
    let read: Vec<(Role, Mat<f64>)> =
        files.iter().map(|(role, file)| Ok((*role, matrix_market::read(file)?))).collect::<Result<_>>()?;
    let size = read.first().map_or(0, |(_, matrix)| matrix.nrows());
    let dofs = node_z_mm.len() * node_dofs.len();
    if dofs != 0 && dofs != size {
        let expected = format!("{} nodes of {} degrees of freedom", node_z_mm.len(), node_dofs.len());
        let problem = format!("`node_z_mm` and `node_dofs` say {expected}; the stiffness has {size} rows");
        return Err(Error::new("use", format!("the matrices of {object}"), problem));
    }
    let along = |node: usize, wanted: Dof| {
        node_dofs.iter().position(|dof| *dof == wanted).map(|at| node * node_dofs.len() + at)
    };
    let nodes = node_z_mm.iter().enumerate();
    let nodes = nodes.map(|(node, z_mm)| Node { z_mm: *z_mm, x: along(node, Dof::X), y: along(node, Dof::Y) });
    Equations::new(object, read, nodes.collect())
}
