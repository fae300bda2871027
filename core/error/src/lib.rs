//! Why a piece of work failed: [`Error`] of data and files, [`Fault`] of a configuration.

mod error;
pub mod fault;

pub use error::{Error, ErrorKind};
pub use fault::Fault;

/// Result of work on data or files.
pub type Result<T> = std::result::Result<T, Error>;
