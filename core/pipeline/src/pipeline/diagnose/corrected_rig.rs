//! The rig that declares what a diagnosis found, as a file that can replace `[rig]`.

use std::{
    fmt::Write,
    path::{Path, PathBuf},
};

use crate::{
    atomic_file::PendingFile,
    pipeline::{
        config::Pipeline,
        document::{ConfigError, Document, Sources, checked, table_text},
    },
};
use runout_closed_loop::correction::Correction;
use runout_error::{Error, Result};
use runout_turning::{provenance::VERSION, rig::RigConfig};

/// An effect, and the lines of TOML that declare it; none where a rig has no key for it, or the data do not decide its target.
pub(super) struct Change {
    pub effect: Correction,
    pub lines: Vec<String>,
}

/// What a rig cannot declare, for the user.
pub(super) fn left_out(changes: &[Change], path: &Path) -> Option<String> {
    let left_out: Vec<String> = changes.iter().filter(|change| change.lines.is_empty()).map(Change::name).collect();
    (!left_out.is_empty()).then(|| {
        format!("{} does not declare {}: `run` with it does not correct that", path.display(), left_out.join(" and "))
    })
}

/// The corrected rig, written and waiting for its name.
///
/// # Errors
/// When there is no rig, the changes make none that can be, or the file cannot be written.
pub(super) fn pending(path: PathBuf, pipeline: &Pipeline, changes: &[Change]) -> Result<PendingFile> {
    let refuse = |problem: String| Error::new("write the rig to", path.display().to_string(), problem);
    let declared = pipeline.rig_text.as_ref().ok_or_else(|| refuse("the pipeline has no [rig]".into()))?;
    let text = corrected(declared, changes).map_err(|error| match error {
        ConfigError::File(error) => error,
        ConfigError::Text(diagnostic) => refuse(diagnostic.to_string()),
    })?;
    let file = PendingFile::new(path)?;
    std::fs::write(file.path(), head(&pipeline.title, changes) + &text).map_err(|error| file.caused(error))?;
    Ok(file)
}

/// The text of a rig with keys changed, checked as any rig.
fn corrected(declared: &str, changes: &[Change]) -> std::result::Result<String, ConfigError> {
    let lines: Vec<String> = changes.iter().flat_map(|change| change.lines.iter().cloned()).collect();
    let sources = Sources::from_text("the corrected rig", declared, PathBuf::new(), &lines, "")?;
    let document = Document::parse(&sources)?;
    let text = table_text(document.root()).and_then(|text| {
        checked::<RigConfig, _>(document.root(), RigConfig::check)?;
        Ok(text)
    });
    Ok(text.map_err(|fault| document.diagnose(fault))?)
}

/// Comments that say where the rig comes from.
fn head(title: &str, changes: &[Change]) -> String {
    let mut head = format!("# The rig of \"{title}\", corrected by `runout diagnose` (runout {VERSION})\n");
    for change in changes {
        // A string takes whatever is written to it.
        let _ = writeln!(head, "# {}", change.effect);
        for line in &change.lines {
            let _ = writeln!(head, "#   {line}");
        }
        if change.lines.is_empty() {
            head.push_str("#   not declared below\n");
        } else if change.effect.known {
            head.push_str("#   take it out of `known` in [diagnose]\n");
        }
    }
    if changes.is_empty() {
        head.push_str("# nothing was found that it lacks\n");
    }
    head.replace(|letter: char| letter.is_control() && letter != '\n', " ") + "\n"
}

impl Change {
    fn name(&self) -> String {
        let words = std::iter::once(&self.effect.effect).chain(&self.effect.targets);
        let name = words.map(String::as_str).collect::<Vec<_>>().join(" ");
        match &self.effect.confounded_with[..] {
            [] => name,
            others => format!("{name} or {}", others.join(" or ")),
        }
    }
}
