//! `runout` with what is built in.

use std::process::ExitCode;

fn main() -> ExitCode {
    runout_cli::main_with(&runout_cli::builtin::registry())
}
