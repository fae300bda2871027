//! `[[export]] plugin = "controller"`.

use std::{
    collections::BTreeMap,
    path::{Path, PathBuf},
};

use runout_core::{
    fault::Fault,
    pipeline::{Context, StageConfig},
    stage::Exporter,
};
use schemars::JsonSchema;
use serde::Deserialize;

use crate::export::Controller;

/// `[[export]] plugin = "controller"`.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ControllerConfig {
    /// The file to write.
    pub path: PathBuf,
    /// Whose file it is.
    pub dialect: DialectName,
    /// Errors that the file shall not hold: `["EAX", "EC0Y"]`. What the dialect cannot hold has to be named here.
    #[serde(default)]
    pub leave_out: Vec<String>,
    /// Names of the axes at the control: `{ X = "X1", Y = "Y1" }`; their letters without it.
    #[serde(default)]
    pub axes: BTreeMap<String, String>,
    /// Position of each axis where its positioning correction is 0, in mm or °: that of its reference point. `{ X = 0.0 }`.
    #[serde(default)]
    pub zero_at: BTreeMap<String, f64>,
    /// The axis of the file (linuxcnc: one file a joint).
    pub axis: Option<String>,
    /// Points of a table that the control has memory for; more are an error.
    pub most_points: Option<usize>,
    /// siemens-cec: where a positive value of the table moves the axis. Write one table by hand and look: manuals differ.
    pub positive_moves: Option<Moves>,
    /// siemens-cec: index of the first table.
    #[serde(default)]
    pub first_table: usize,
    /// siemens-cec: tables that the control has.
    pub most_tables: Option<usize>,
    /// isg-csv, etalon: the point of the machine from which the control counts lever arms, in mm.
    #[serde(default)]
    pub arms_from_mm: [f64; 3],
    /// klipper: height of the bed at which its mesh is computed, in mm.
    pub bed_z_mm: Option<f64>,
}

/// A dialect.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum DialectName {
    /// Siemens SINUMERIK 840D, 828D: measuring system error compensation, `$AA_ENC_COMP`.
    SiemensEncComp,
    /// Siemens SINUMERIK 840D, 828D: sag and angularity compensation, `$AN_CEC`.
    SiemensCec,
    /// ISG and Beckhoff TF5280: volumetric compensation, `ISG_CSV`.
    IsgCsv,
    /// ETALON exchange format, as ISG and Beckhoff read it.
    Etalon,
    /// LinuxCNC: `COMP_FILE` of type 0.
    Linuxcnc,
    /// Klipper: skew correction and bed mesh.
    Klipper,
}

impl DialectName {
    /// As it is written in a configuration.
    #[must_use]
    pub fn name(self) -> &'static str {
        match self {
            Self::SiemensEncComp => "siemens-enc-comp",
            Self::SiemensCec => "siemens-cec",
            Self::IsgCsv => "isg-csv",
            Self::Etalon => "etalon",
            Self::Linuxcnc => "linuxcnc",
            Self::Klipper => "klipper",
        }
    }
}

/// Direction in which a positive value of a table moves an axis.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Moves {
    /// In its positive direction.
    Positive,
    /// In its negative direction.
    Negative,
}

impl StageConfig for ControllerConfig {
    type Stage = Box<dyn Exporter>;

    const NAME: &'static str = "controller";
    const ABOUT: &'static str = "compensation file of a machine control, from component curves";

    fn check(self, context: &Context) -> Result<Self::Stage, Fault> {
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
