//! `[[export]] plugin = "controller"`.

use std::{collections::BTreeMap, path::PathBuf};

use schemars::JsonSchema;
use serde::Deserialize;

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
    /// siemens-cec, heidenhain, fanuc-pitch, fanuc-3d: where a positive value of the table moves the axis. Write one table by hand and look:
    /// manuals differ.
    pub positive_moves: Option<Moves>,
    /// siemens-cec: index of the first table.
    #[serde(default)]
    pub first_table: usize,
    /// siemens-cec, heidenhain: tables (heidenhain: dependencies of one axis on another or on itself) that the control has.
    pub most_tables: Option<usize>,
    /// isg-csv, etalon: the point of the machine from which the control counts lever arms, in mm.
    #[serde(default)]
    pub arms_from_mm: [f64; 3],
    /// heidenhain: names of the tables of compensation values, beside `path`, by the axis whose position counts: `{ X = "x.com" }`.
    #[serde(default)]
    pub com: BTreeMap<String, PathBuf>,
    /// fanuc-pitch, fanuc-3d: detection unit of each axis, in mm or °: `{ X = 0.001 }`.
    #[serde(default)]
    pub detection_unit: BTreeMap<String, f64>,
    /// fanuc-pitch, fanuc-3d: magnification of the values, parameter 3623 of pitch errors.
    #[serde(default = "one")]
    pub magnification: u32,
    /// fanuc-pitch, fanuc-3d: largest value at a point, without its sign; 7 of pitch errors and 127 of boxes without it.
    pub largest_value: Option<u32>,
    /// fanuc-pitch: number of the first compensation point that the file may use.
    #[serde(default)]
    pub first_point: usize,
    /// klipper: height of the bed at which its mesh is computed, in mm.
    pub bed_z_mm: Option<f64>,
}

fn one() -> u32 {
    1
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
    /// Heidenhain: tables of compensation values `.COM` and their assignment `.CMA` (`path`).
    Heidenhain,
    /// FANUC: stored pitch error compensation.
    FanucPitch,
    /// FANUC Series 30i: three-dimensional error compensation, values at the vertices of boxes.
    #[serde(rename = "fanuc-3d")]
    Fanuc3d,
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
            Self::Heidenhain => "heidenhain",
            Self::FanucPitch => "fanuc-pitch",
            Self::Fanuc3d => "fanuc-3d",
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
