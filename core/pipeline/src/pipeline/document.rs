//! TOML text with places: a file, the files that it includes and overrides, read as one document.

mod meaning;
mod table;

use runout_error::fault::{Diagnostic, Fault, Place};
use std::{
    io::Read,
    ops::Range,
    path::{Path, PathBuf},
};

pub(super) use meaning::inline;
pub use table::{Table, checked, read, read_besides, resolve, table, table_text};
pub(super) use table::{required, tables};
use toml::{
    Spanned,
    de::{DeTable, DeValue},
};

use runout_error::{Error, ErrorKind};
use runout_turning::input_file::open_regular;

/// Keys in a path, at most.
const DEEPEST: usize = 64;

/// The texts that a configuration is read from.
#[derive(Debug, Clone)]
pub struct Sources {
    parts: Vec<Part>,
    folder: PathBuf,
}

/// One text, behind as many blanks as the texts before it are long: a byte's place then names its text too.
#[derive(Debug, Clone)]
struct Part {
    name: String,
    role: Role,
    padded: String,
    start: usize,
}

/// What a text is there for.
#[derive(Debug, Clone, PartialEq, Eq)]
enum Role {
    Main,
    /// A file that replaces the table at a top-level key.
    Include(String),
    /// `value = …` for a path of keys.
    Override(String),
}

/// Why a configuration could not be had.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// A file cannot be read.
    #[error(transparent)]
    File(#[from] Error),
    /// The text is not what it should be.
    #[error(transparent)]
    Text(Box<Diagnostic>),
}

impl From<Diagnostic> for ConfigError {
    fn from(diagnostic: Diagnostic) -> Self {
        Self::Text(Box::new(diagnostic))
    }
}

impl Sources {
    /// Reads a file, with overrides of the form `key.path=value`. Where the top-level `include_key` holds a string, it
    /// names a file (relative to this one; of an override, else relative to the working folder) that replaces the table.
    ///
    /// # Errors
    /// When a file cannot be read, or is not TOML where it has to be looked into.
    pub fn read(path: &Path, overrides: &[String], include_key: &str) -> Result<Self, ConfigError> {
        let folder = path.parent().map(Path::to_path_buf).unwrap_or_default();
        Self::from_text(&path.display().to_string(), &read_text(path)?, folder, overrides, include_key)
    }

    /// Reads a text, with overrides of the form `key.path=value` and the file that `include_key` names; paths in it are relative to `folder`.
    ///
    /// # Errors
    /// When the text is not TOML or an included file cannot be read.
    pub fn from_text(
        name: &str,
        text: &str,
        folder: PathBuf,
        overrides: &[String],
        include_key: &str,
    ) -> Result<Self, ConfigError> {
        let mut sources = Self { parts: Vec::new(), folder };
        sources.add(name, Role::Main, text);
        for assignment in overrides {
            let (path, value) = assignment.split_once('=').unwrap_or((assignment, ""));
            let (path, value) = (path.trim(), value.trim());
            if path.is_empty() || value.is_empty() {
                let message = "expected KEY=VALUE".into();
                // What is behind `KEY=` may be an empty text whose quotes the shell took.
                let is_empty = assignment.contains('=') && !path.is_empty();
                let help = is_empty.then(|| format!("an empty text has to be quoted: --set {path}='\"\"'"));
                let (source_name, source_text) = ("--set".into(), assignment.clone());
                return Err(Diagnostic { message, help, source_name, source_text, span: 0..assignment.len() }.into());
            }
            // Quotes rarely survive a shell: what is no TOML value is meant as a string.
            let bare = DeValue::parse(value).is_err();
            let line = if bare { format!("value = {value:?}") } else { format!("value = {value}") };
            sources.add(&format!("--set {assignment}"), Role::Override(path.to_owned()), &line);
        }
        if let Some((included, is_override)) = sources.included(include_key)? {
            let beside = sources.folder.join(&included);
            // What is written on a command line may be meant from where it is typed.
            let typed = is_override && !beside.exists() && Path::new(&included).exists();
            let path = if typed { PathBuf::from(included) } else { beside };
            sources.add(&path.display().to_string(), Role::Include(include_key.to_owned()), &read_text(&path)?);
        }
        Ok(sources)
    }

    /// The folder that relative paths start from.
    #[must_use]
    pub fn folder(&self) -> &Path {
        &self.folder
    }

    /// The files among the texts.
    pub fn files(&self) -> impl Iterator<Item = &Path> {
        let files = self.parts.iter().filter(|part| !matches!(part.role, Role::Override(_)));
        files.map(|part| Path::new(&part.name))
    }

    /// Overrides one more key; `value` is a TOML value.
    pub(super) fn set(&mut self, key: &str, value: &str) {
        self.add(&format!("--set {key}"), Role::Override(key.to_owned()), &format!("value = {value}"));
    }

    fn add(&mut self, name: &str, role: Role, text: &str) {
        let start = self.parts.last().map_or(0, |part| part.padded.len() + 1);
        self.parts.push(Part { name: name.into(), role, padded: " ".repeat(start) + text, start });
    }

    /// The file that a key names, and whether an override does.
    fn included(&self, key: &str) -> Result<Option<(String, bool)>, ConfigError> {
        let string = |table: &Table, key: &str| {
            table.get_ref().get(key).and_then(|value| value.get_ref().as_str().map(str::to_owned))
        };
        let mut found = None;
        for part in &self.parts {
            match &part.role {
                Role::Main => found = string(&self.parse(part)?, key).map(|file| (file, false)),
                Role::Override(path) if path == key => {
                    found = string(&self.parse(part)?, "value").map(|file| (file, true));
                }
                _ => {}
            }
        }
        Ok(found)
    }

    fn parse<'a>(&self, part: &'a Part) -> Result<Table<'a>, Diagnostic> {
        if let Some(start) = too_deep(part.text()) {
            let span = part.start + start..part.start + start + 1;
            let message = format!("expected a path of at most {DEEPEST} keys");
            return Err(self.locate_span(Fault::span(span, message)));
        }
        DeTable::parse(&part.padded).map_err(|error| {
            self.locate_span(Fault::span(error.span().unwrap_or(part.start..part.start), error.message()))
        })
    }

    fn locate_span(&self, fault: Fault) -> Diagnostic {
        let Place::Span(span) = fault.place else {
            return self.locate_span(Fault { place: Place::Span(0..0), ..fault });
        };
        let part = self.parts.iter().rev().find(|part| part.start <= span.start);
        let (name, text, start) = part.map_or(("", "", 0), |part| (&*part.name, part.text(), part.start));
        let within = |byte: usize| byte.saturating_sub(start).min(text.len());
        Diagnostic {
            message: fault.message,
            help: fault.help,
            source_name: name.into(),
            source_text: text.into(),
            span: within(span.start)..within(span.end),
        }
    }
}

impl Part {
    fn text(&self) -> &str {
        &self.padded[self.start..]
    }
}

/// A configuration as one table, with includes and overrides in their places.
#[derive(Debug, Clone)]
pub struct Document<'a> {
    sources: &'a Sources,
    root: Table<'a>,
}

impl<'a> Document<'a> {
    /// Parses and joins all texts.
    ///
    /// # Errors
    /// When one is not TOML, or an override names a place that cannot be.
    pub fn parse(sources: &'a Sources) -> Result<Self, Diagnostic> {
        let mut root = Spanned::new(0..0, DeTable::new());
        for part in sources.parts.iter().filter(|part| part.role == Role::Main) {
            root = sources.parse(part)?;
        }
        for part in &sources.parts {
            if let Role::Include(key) = &part.role {
                let table = sources.parse(part)?;
                let span =
                    root.get_ref().get_key_value(key.as_str()).map_or(part.start..part.start, |(key, _)| key.span());
                let value = Spanned::new(table.span(), DeValue::Table(table.into_inner()));
                insert(root.get_mut(), key, span, value);
            }
        }
        for part in &sources.parts {
            if let Role::Override(path) = &part.role {
                let mut table = sources.parse(part)?;
                // The table's own span begins before the blanks.
                let span = part.start..part.start + part.text().len();
                let refuse = |message: String| sources.locate_span(Fault::span(span.clone(), message));
                let value = table.get_mut().remove("value").ok_or_else(|| refuse("expected key=value".into()))?;
                let names_included = |part: &Part| part.role == Role::Include(path.clone());
                if value.get_ref().as_str().is_some() && sources.parts.iter().any(names_included) {
                    // What the file holds stands there already.
                    continue;
                }
                let steps: Vec<&str> = path.split('.').map(str::trim).collect();
                if steps.len() > DEEPEST {
                    return Err(refuse(format!("expected a path of at most {DEEPEST} keys, found {}", steps.len())));
                }
                assign(root.get_mut(), &steps, value).map_err(refuse)?;
            }
        }
        Ok(Self { sources, root })
    }

    /// The root table.
    #[must_use]
    pub fn root(&self) -> &Table<'a> {
        &self.root
    }

    /// Gives a fault its place in the text.
    #[must_use]
    pub fn diagnose(&self, fault: Fault) -> Diagnostic {
        self.sources.locate_span(resolve(fault, &self.root))
    }
}

/// Where a dotted key begins that has more parts than a configuration has levels: each part is a table within the one before.
fn too_deep(text: &str) -> Option<usize> {
    let mut start = 0;
    for line in text.split_inclusive('\n') {
        let mut from = start;
        for segment in line.split_inclusive(['=', ',', '{', '[', '#']) {
            if segment.matches('.').count() > DEEPEST && !line.trim_start().starts_with('#') {
                return Some(from);
            }
            from += segment.len();
        }
        start += line.len();
    }
    None
}

fn insert<'a>(table: &mut DeTable<'a>, key: &str, span: Range<usize>, value: Spanned<DeValue<'a>>) {
    table.remove(key);
    table.insert(Spanned::new(span, key.to_owned().into()), value);
}

/// Puts `value` at a path of keys and array indices, making tables on the way.
fn assign<'a>(table: &mut DeTable<'a>, steps: &[&str], value: Spanned<DeValue<'a>>) -> Result<(), String> {
    let Some((step, rest)) = steps.split_first() else { return Err("expected a key before `=`".into()) };
    if step.is_empty() {
        return Err("expected a key before `=`".into());
    }
    let span = value.span();
    let Some((next, after)) = rest.split_first() else {
        insert(table, step, span, value);
        return Ok(());
    };
    if !table.contains_key(*step) {
        insert(table, step, span.clone(), Spanned::new(span, DeValue::Table(DeTable::new())));
    }
    match table.get_mut(*step).map(Spanned::get_mut) {
        Some(DeValue::Table(inner)) => assign(inner, rest, value),
        Some(DeValue::Array(items)) => {
            let count = items.len();
            let item = next.parse().ok().and_then(|index: usize| items.get_mut(index));
            let item = item.ok_or_else(|| {
                let items = if count == 1 { "item" } else { "items" };
                format!("`{step}` has {count} {items}, counted from 0; there is no `{next}`")
            })?;
            match item.get_mut() {
                _ if after.is_empty() => {
                    *item = value;
                    Ok(())
                }
                DeValue::Table(inner) => assign(inner, after, value),
                _ => Err(format!("`{step}.{next}` is not a table")),
            }
        }
        _ => Err(format!("`{step}` is not a table")),
    }
}

/// First bytes of an HDF5 file.
const HDF5: &[u8] = b"\x89HDF\r\n\x1a\n";

fn read_text(path: &Path) -> Result<String, Error> {
    let shown = path.display().to_string();
    let mut bytes = Vec::new();
    let read = open_regular(path).and_then(|mut file| file.read_to_end(&mut bytes));
    read.map_err(|error| Error::caused("read", &shown, error))?;
    if bytes.starts_with(HDF5) {
        let problem = "expected a configuration in TOML, found an HDF5 file";
        let help = "name the recording in [load] of a pipeline (`plugin = \"hdf5\"`, `path`), and give the pipeline";
        return Err(Error::new("read", &shown, problem).of(ErrorKind::Configuration).help(help));
    }
    String::from_utf8(bytes).map_err(|error| {
        Error::new("read", &shown, format!("expected UTF-8, found {}", error.utf8_error()))
            .of(ErrorKind::DamagedData)
            .help("save the file as UTF-8")
    })
}

/// The document as one TOML text that reads as it does: the file itself, or, where other files or overrides went into
/// it, all of it written anew.
///
/// # Errors
/// When a value cannot be written.
pub fn resolved_text(root: &Table, sources: &Sources) -> Result<String, Fault> {
    match &sources.parts[..] {
        [only] => Ok(only.text().to_owned()),
        parts => {
            let names: Vec<&str> = parts.iter().map(|part| part.name.as_str()).collect();
            let text = table_text(root)?;
            Ok(format!("# joined from {}; paths are relative to the first\n\n{text}", names.join(", ")))
        }
    }
}
