//! Configuration mistakes and where they stand.

use std::ops::{Range, RangeInclusive};

/// A value that the configuration should not hold.
///
/// Checks name it by its path of keys; the pipeline turns that into a place in the file.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Fault {
    /// Where it stands.
    pub place: Place,
    /// What was expected and what was found.
    pub message: String,
    /// What the user can do.
    pub help: Option<String>,
    /// Whether a plugin refuses the rig, and the configuration may be all right.
    pub unfit: bool,
}

/// Where a fault stands.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// Bytes of the joined source text.
    Span(Range<usize>),
    /// Keys and indices below the table that is being checked.
    Path(Vec<Step>),
}

/// A step into a table or an array.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Step {
    /// The entry of a table.
    Key(String),
    /// The entry of an array.
    Index(usize),
}

impl Fault {
    /// A fault of the value at `key`; `message` says what was expected and what was found.
    pub fn at(key: impl Into<String>, message: impl Into<String>) -> Self {
        Self { place: Place::Path(vec![Step::Key(key.into())]), message: message.into(), help: None, unfit: false }
    }

    /// A fault of the table as a whole.
    pub fn here(message: impl Into<String>) -> Self {
        Self { place: Place::Path(Vec::new()), message: message.into(), help: None, unfit: false }
    }

    /// A plugin that cannot take the rig; `message` says what it needs and what the rig has.
    pub fn unfit(message: impl Into<String>) -> Self {
        Self { unfit: true, ..Self::at("plugin", message) }
    }

    /// A fault at bytes of the source text.
    pub fn span(span: Range<usize>, message: impl Into<String>) -> Self {
        Self { place: Place::Span(span), message: message.into(), help: None, unfit: false }
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// Puts `key` before the fault's path: its place in the table that holds this one under `key`.
    #[must_use]
    pub fn under(self, key: impl Into<String>) -> Self {
        self.prefixed([Step::Key(key.into())])
    }

    /// Puts `key` and `index` before the fault's path: its place in the table that holds an array `key` with this one as its item `index`.
    #[must_use]
    pub fn under_item(self, key: impl Into<String>, index: usize) -> Self {
        self.prefixed([Step::Key(key.into()), Step::Index(index)])
    }

    fn prefixed<const N: usize>(mut self, steps: [Step; N]) -> Self {
        if let Place::Path(path) = &mut self.place {
            path.splice(0..0, steps);
        }
        self
    }
}

/// Refuses a whole number outside a range; `what` names it: "an order".
///
/// # Errors
/// When it is outside.
pub fn within(key: &str, what: &str, value: usize, range: RangeInclusive<usize>) -> Result<(), Fault> {
    if range.contains(&value) {
        return Ok(());
    }
    Err(Fault::at(key, format!("expected {what} from {} to {}, found {value}", range.start(), range.end())))
}

/// A fault with the text that it points into, ready to be shown.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("{message}")]
pub struct Diagnostic {
    /// What is wrong and what was expected.
    pub message: String,
    /// What to do.
    pub help: Option<String>,
    /// File name, or "--set".
    pub source_name: String,
    /// The whole text of that source.
    pub source_text: String,
    /// Bytes of `source_text`.
    pub span: Range<usize>,
}

impl Diagnostic {
    /// Line and column of the beginning, from 1.
    #[must_use]
    pub fn line_and_column(&self) -> (usize, usize) {
        let before = &self.source_text[..self.span.start.min(self.source_text.len())];
        let line = before.matches('\n').count() + 1;
        let column = before.rsplit('\n').next().map_or(0, |last| last.chars().count()) + 1;
        (line, column)
    }
}

/// Orders `known` names by nearness to `name` and says which is nearest, for messages about unknown names.
#[must_use]
pub fn known_names<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let mut ranked: Vec<(f64, &str)> =
        known.into_iter().map(|candidate| (nearness(name, candidate), candidate)).collect();
    ranked.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(b.1)));
    let list: Vec<String> = ranked.iter().map(|(_, candidate)| format!("`{candidate}`")).collect();
    match ranked.first() {
        None => "there are none".into(),
        // Above 0.7 two names look alike to most readers; below, a guess would mislead.
        Some((nearness, nearest)) if *nearness > 0.7 => {
            format!("did you mean `{nearest}`? known, nearest first: {}", list.join(", "))
        }
        Some(_) => format!("known: {}", list.join(", ")),
    }
}

/// How much two names look alike, 1 where they differ by upper and lower case only.
fn nearness(name: &str, candidate: &str) -> f64 {
    if name.eq_ignore_ascii_case(candidate) { 1.0 } else { strsim::jaro_winkler(name, candidate) }
}

#[cfg(test)]
mod tests {
    use super::known_names;

    #[test]
    fn upper_and_lower_case_make_no_other_name() {
        assert!(known_names("RONT", ["RONp", "RONv", "RONt"]).starts_with("did you mean `RONt`?"));
        assert_eq!(known_names("zzz", ["RONp"]), "known: `RONp`");
    }
}
