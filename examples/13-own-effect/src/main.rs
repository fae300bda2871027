//! `runout` with one effect and one stage more.

use std::process::ExitCode;

fn main() -> ExitCode {
    let mut registry = runout_cli::builtin::registry();
    own_effect::register(&mut registry);
    runout_cli::main_with(&registry)
}
