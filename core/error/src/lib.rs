//! Why a piece of work failed: [`Error`] of data and files, [`Fault`] of a configuration.

pub mod fault;

pub use fault::Fault;

/// Result of work on data or files.
pub type Result<T> = std::result::Result<T, Error>;

/// Work that failed: what was tried, on what, what stood in the way, and what to do about it.
///
/// Configuration mistakes are [`Fault`]s, which point into the TOML; this error is for
/// everything that only the data or the file system can tell.
#[derive(Debug, Clone, PartialEq, Eq, thiserror::Error)]
#[error("cannot {operation} {object}: {problem}")]
pub struct Error {
    operation: String,
    object: String,
    problem: String,
    help: Option<String>,
}

impl Error {
    /// `operation` is a verb ("read"), `object` names the thing ("shaft.h5:/initial/s01"), `problem` says what was
    /// found and what was expected.
    #[allow(clippy::needless_pass_by_value, reason = "sources' errors and literals come alike")]
    pub fn new(operation: impl Into<String>, object: impl Into<String>, problem: impl ToString) -> Self {
        Self { operation: operation.into(), object: object.into(), problem: problem.to_string(), help: None }
    }

    /// Adds what the user can do.
    #[must_use]
    pub fn help(mut self, help: impl Into<String>) -> Self {
        self.help = Some(help.into());
        self
    }

    /// What the user can do, where there is something.
    #[must_use]
    pub fn advice(&self) -> Option<&str> {
        self.help.as_deref()
    }
}
