//! `runout`: separates the form of a turning part from the error motion of its spindle.
//!
//! The program is [`main_with`] on the [built-in](builtin) list. A program of your own adds to that list:
//!
//! ```no_run
//! fn main() -> std::process::ExitCode {
//!     let mut registry = runout_cli::builtin::registry();
//!     // my_crate::register(&mut registry);
//!     runout_cli::main_with(&registry)
//! }
//! ```

mod args;
pub mod builtin;
mod commands;
pub mod documents;
mod failure;
mod progress;
mod render;
mod reports;
mod templates;

use std::{
    ffi::OsString,
    io::{self, Write},
    panic::{self, AssertUnwindSafe},
    process::ExitCode,
    sync::{
        Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
    },
};

use clap::Parser;
use runout_core::{atomic_file::abandon_all, pipeline::Registry};

use args::CommandLine;
pub use failure::Failure;

/// Does what the command line asks for with what is registered.
#[must_use]
pub fn main_with(registry: &Registry) -> ExitCode {
    ExitCode::from(status_of(std::env::args_os().skip(1).collect(), registry))
}

/// Does what these words after the program's name ask for, and gives the exit status. What interrupts the process ends it.
#[must_use]
pub fn status_of(words: Vec<OsString>, registry: &Registry) -> u8 {
    leave_nothing_half();
    let json = words.iter().any(|word| word == "--json");
    let (json, outcome) = match CommandLine::try_parse_from(std::iter::once("runout".into()).chain(words)) {
        Ok(line) => (line.json, guarded(|| commands::execute(line.command, line.json, registry))),
        Err(error) if error.use_stderr() => (json, Err(error.into())),
        // `--help` and `--version` come this way, and clap knows best how to print them.
        Err(error) => (false, error.print().map_err(Failure::Output)),
    };
    match outcome {
        Ok(()) => 0,
        Err(failure) => {
            // Work that fails because it was abandoned leaves the exit status to the handler.
            while ENDS.load(Ordering::SeqCst) {
                std::thread::park();
            }
            failure.report(json)
        }
    }
}

/// Does work; a panic in it is a failure with words, as a document too.
fn guarded(work: impl FnOnce() -> Result<(), Failure>) -> Result<(), Failure> {
    static PLACE: Mutex<String> = Mutex::new(String::new());
    panic::set_hook(Box::new(|found| {
        let place = found.location().map(|place| format!(" ({}:{})", place.file(), place.line())).unwrap_or_default();
        *PLACE.lock().unwrap_or_else(PoisonError::into_inner) = place;
    }));
    panic::catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|payload| {
        let text = payload.downcast_ref::<String>().map(String::as_str);
        let text = text.or_else(|| payload.downcast_ref::<&str>().copied()).unwrap_or("without words");
        let place = PLACE.lock().unwrap_or_else(PoisonError::into_inner);
        Err(Failure::Program(format!("{text}{place}")))
    })
}

/// Whether the program was interrupted and ends.
static ENDS: AtomicBool = AtomicBool::new(false);

/// Has an interrupted program take away what it has begun.
fn leave_nothing_half() {
    /// As shells count: 128 and the signal.
    const INTERRUPTED: i32 = 130;
    // Where no handler can be set, a later run takes it away.
    let _ = ctrlc::set_handler(|| {
        ENDS.store(true, Ordering::SeqCst);
        runout_external::end_all();
        let _nothing_is_begun = abandon_all();
        let _ = writeln!(io::stderr(), "\ninterrupted: unfinished output files were removed");
        std::process::exit(INTERRUPTED);
    });
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_panic_is_a_failure_with_words() {
        let failure = guarded(|| panic!("index {} out of range", 7));
        assert!(matches!(failure, Err(Failure::Program(text)) if text.starts_with("index 7 out of range (cli")));
        assert!(guarded(|| Ok(())).is_ok());
    }
}
