//! A folder with files, and the program run in it.

use std::{fs, path::Path};

use assert_cmd::cargo::cargo_bin_cmd;
use tempfile::TempDir;

/// A four-sensor rig with the part reversed and the sensors reversed too.
pub(crate) const RIG: &str = r#"part_radius_mm = 30.0
sensors = [
  { id = "S1", angle_deg = 0,  z_mm = 200, section = "a" },
  { id = "S2", angle_deg = 90, z_mm = 200, section = "a" },
  { id = "S3", angle_deg = 0,  z_mm = 230, section = "b" },
  { id = "S4", angle_deg = 90, z_mm = 230, section = "b" },
]
setups = [
  { id = "initial",  part_deg = 0,   sensors_deg = 0 },
  { id = "reversed", part_deg = 180, sensors_deg = 180 },
]
"#;

/// Everything behind the rig.
pub(crate) const STAGES: &str = r#"
[load]
plugin = "hdf5"
path = "shaft.h5"

[[preprocess]]
plugin = "synchronous-average"
samples_per_rev = 128

[separate]
plugin = "four-sensor-reversal"

[[export]]
plugin = "parquet"
path = "out"
"#;

/// A pipeline with nothing wrong in it.
pub(crate) fn pipeline() -> String {
    format!("title = \"Turned shaft\"\n\n[rig]\n{RIG}{STAGES}")
}

/// What a run of the program gave.
pub(crate) struct Ran {
    pub status: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Ran {
    /// All of it, for a snapshot.
    pub(crate) fn shown(&self) -> String {
        format!("exit status: {}\n--- stdout\n{}--- stderr\n{}", self.status, self.stdout, self.stderr)
    }
}

/// A folder of its own.
pub(crate) struct Folder(TempDir);

impl Folder {
    /// With these files.
    pub(crate) fn with(files: &[(&str, &str)]) -> Self {
        let folder = Self(TempDir::new().unwrap());
        for (name, text) in files {
            fs::write(folder.path().join(name), text).unwrap();
        }
        folder
    }

    pub(crate) fn path(&self) -> &Path {
        self.0.path()
    }

    /// Runs the program here: no path of the machine can come into its words.
    pub(crate) fn run(&self, arguments: &[&str]) -> Ran {
        self.run_by(cargo_bin_cmd!("runout").env_remove("COLUMNS"), arguments)
    }

    /// Runs the program here with lines of so many columns.
    pub(crate) fn run_within(&self, columns: usize, arguments: &[&str]) -> Ran {
        self.run_by(cargo_bin_cmd!("runout").env("COLUMNS", columns.to_string()), arguments)
    }

    fn run_by(&self, command: &mut assert_cmd::Command, arguments: &[&str]) -> Ran {
        let output = command.current_dir(self.path()).args(arguments).output().unwrap();
        Ran {
            status: output.status.code().unwrap(),
            stdout: String::from_utf8(output.stdout).unwrap(),
            stderr: String::from_utf8(output.stderr).unwrap(),
        }
    }
}
