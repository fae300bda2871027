//! [`Error`]: work on data or files that failed, with its kind and its source.

use std::{error::Error as StdError, fmt, io, sync::Arc};

use crate::Fault;

/// What kind of failure an [`Error`] is, for programs that decide by it.
///
/// ```
/// use runout_error::{Error, ErrorKind};
///
/// let missing = std::io::Error::from(std::io::ErrorKind::NotFound);
/// let error = Error::caused("read", "shaft.h5", missing);
/// let retry = match error.kind() {
///     ErrorKind::MissingFile | ErrorKind::Io => true,
///     _ => false,
/// };
/// assert!(retry);
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
#[non_exhaustive]
pub enum ErrorKind {
    /// The configuration, or an argument of a call, cannot be used with any data.
    Configuration,
    /// A file or a folder does not exist.
    MissingFile,
    /// A file exists and does not hold what its format demands: damaged, cut off, or another format.
    DamagedData,
    /// The data are readable and do not fit what the work needs: a sensor, a column or a setup is missing, a value is out of
    /// range.
    UnsuitableData,
    /// The data are suitable and too few: points, turns or angles that do not determine what is asked for.
    InsufficientData,
    /// A computation came to no result: an iteration did not settle, a value is beyond all bounds.
    Numerical,
    /// The operating system refused to read or to write.
    Io,
    /// The work was stopped before its end, or a thread of it ended.
    Interrupted,
}

impl ErrorKind {
    /// Its name in JSON: `missing-file`.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Configuration => "configuration",
            Self::MissingFile => "missing-file",
            Self::DamagedData => "damaged-data",
            Self::UnsuitableData => "unsuitable-data",
            Self::InsufficientData => "insufficient-data",
            Self::Numerical => "numerical",
            Self::Io => "io",
            Self::Interrupted => "interrupted",
        }
    }

    /// The kind of a source: that of an [`Error`], of a [`Fault`], or of what the operating system reports.
    fn of(source: &(dyn StdError + 'static)) -> Option<Self> {
        let mut next = Some(source);
        while let Some(error) = next {
            if let Some(error) = error.downcast_ref::<Error>() {
                return Some(error.kind());
            }
            if error.is::<Fault>() {
                return Some(Self::Configuration);
            }
            if let Some(error) = error.downcast_ref::<io::Error>() {
                return Some(match error.kind() {
                    io::ErrorKind::NotFound => Self::MissingFile,
                    io::ErrorKind::InvalidData | io::ErrorKind::UnexpectedEof => Self::DamagedData,
                    _ => Self::Io,
                });
            }
            next = error.source();
        }
        None
    }
}

impl fmt::Display for ErrorKind {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        formatter.write_str(self.name())
    }
}

/// Work that failed: its kind, what was tried, on what, what the problem was, and what the user can do.
///
/// Configuration mistakes are [`Fault`]s, which point into the TOML; this error is for
/// everything that depends on the data or the file system.
///
/// The text holds the text of the source too, so that one line says all; [`source`](StdError::source) gives the source
/// itself.
///
/// ```
/// use runout_error::{Error, ErrorKind};
///
/// let error = Error::new("average", "shaft.h5:/initial/s01", "it holds 2 turns, expected 3 or more")
///     .of(ErrorKind::InsufficientData)
///     .help("record more turns");
/// assert_eq!(error.to_string(), "cannot average shaft.h5:/initial/s01: it holds 2 turns, expected 3 or more");
/// assert_eq!(error.kind().name(), "insufficient-data");
/// ```
#[derive(Debug, Clone)]
pub struct Error(Box<Parts>);

#[derive(Debug, Clone)]
struct Parts {
    kind: ErrorKind,
    operation: String,
    object: String,
    problem: String,
    help: Option<String>,
    source: Option<Arc<dyn StdError + Send + Sync>>,
}

impl Error {
    /// `operation` is a verb ("read"), `object` names the thing ("shaft.h5:/initial/s01"), `problem` says what was
    /// found and what was expected. Its kind is [`ErrorKind::UnsuitableData`] unless [`of`](Self::of) gives another.
    #[allow(clippy::needless_pass_by_value, reason = "numbers, literals and texts come alike")]
    pub fn new(operation: impl Into<String>, object: impl Into<String>, problem: impl ToString) -> Self {
        Self(Box::new(Parts {
            kind: ErrorKind::UnsuitableData,
            operation: operation.into(),
            object: object.into(),
            problem: problem.to_string(),
            help: None,
            source: None,
        }))
    }

    /// An error whose problem is another error, which is kept as its source. The kind is that of the source where it has
    /// one, and its help is kept.
    pub fn caused(
        operation: impl Into<String>,
        object: impl Into<String>,
        source: impl StdError + Send + Sync + 'static,
    ) -> Self {
        let mut error = Self::new(operation, object, &source);
        let (mine, source) = (&mut error.0, Arc::new(source) as Arc<dyn StdError + Send + Sync>);
        mine.kind = ErrorKind::of(&*source).unwrap_or(mine.kind);
        let advice = source.downcast_ref::<Self>().and_then(Self::advice);
        let help = source.downcast_ref::<Fault>().and_then(|fault| fault.help.as_deref());
        mine.help = advice.or(help).map(str::to_owned);
        mine.source = Some(source);
        error
    }

    /// Gives it another kind.
    #[must_use]
    pub fn of(mut self, kind: ErrorKind) -> Self {
        self.0.kind = kind;
        self
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.0.help = Some(help.into());
        self
    }

    /// What kind of failure it is.
    #[must_use]
    pub fn kind(&self) -> ErrorKind {
        self.0.kind
    }

    /// What was tried: a verb.
    #[must_use]
    pub fn operation(&self) -> &str {
        &self.0.operation
    }

    /// The thing that it was tried on.
    #[must_use]
    pub fn object(&self) -> &str {
        &self.0.object
    }

    /// What the user can do, where there is something.
    #[must_use]
    pub fn advice(&self) -> Option<&str> {
        self.0.help.as_deref()
    }

    /// The texts of its sources, the nearest first.
    #[must_use]
    pub fn causes(&self) -> Vec<String> {
        let (mut causes, mut next) = (Vec::new(), self.source());
        while let Some(error) = next {
            causes.push(error.to_string());
            next = error.source();
        }
        causes
    }
}

impl fmt::Display for Error {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Parts { operation, object, problem, .. } = &*self.0;
        write!(formatter, "cannot {operation} {object}: {problem}")
    }
}

impl StdError for Error {
    fn source(&self) -> Option<&(dyn StdError + 'static)> {
        self.0.source.as_deref().map(|source| source as &(dyn StdError + 'static))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn kind_help_and_source_come_from_the_cause() {
        let missing = io::Error::new(io::ErrorKind::NotFound, "no such file");
        let read = Error::caused("read", "shaft.h5", missing).help("name a file");
        let run = Error::caused("run", "campaign", read);
        assert_eq!(run.kind(), ErrorKind::MissingFile);
        assert_eq!(run.advice(), Some("name a file"));
        assert_eq!(run.to_string(), "cannot run campaign: cannot read shaft.h5: no such file");
        assert_eq!(run.causes(), ["cannot read shaft.h5: no such file", "no such file"]);
        let deepest = run.source().and_then(StdError::source).and_then(|error| error.downcast_ref::<io::Error>());
        assert_eq!(deepest.map(io::Error::kind), Some(io::ErrorKind::NotFound));
    }

    #[test]
    fn a_source_without_a_kind_leaves_the_default_and_of_overrules_all() {
        let number = "x".parse::<f64>().unwrap_err();
        assert_eq!(Error::caused("read", "a", number.clone()).kind(), ErrorKind::UnsuitableData);
        assert_eq!(Error::caused("read", "a", number).of(ErrorKind::DamagedData).kind(), ErrorKind::DamagedData);
        let fault = Fault::at("gain", "expected a number above 0").help("leave it out");
        let error = Error::caused("check", "the rig", fault);
        assert_eq!((error.kind(), error.advice()), (ErrorKind::Configuration, Some("leave it out")));
        let cut = io::Error::from(io::ErrorKind::UnexpectedEof);
        assert_eq!(Error::caused("read", "a", cut).kind(), ErrorKind::DamagedData);
        let full = io::Error::from(io::ErrorKind::StorageFull);
        assert_eq!(Error::caused("write", "a", full).kind(), ErrorKind::Io);
    }
}
