//! Faults on demand, for tests of what a kill or a failing disk leaves: `RUNOUT_TEST_FAULT=kill:N` ends this process at the N-th step
//! that writes, syncs or renames, `fail:N` has that step fail.

use std::{
    io,
    sync::{
        OnceLock,
        atomic::{AtomicU64, Ordering},
    },
};

#[derive(Clone, Copy)]
enum Fault {
    Kill(u64),
    Fail(u64),
}

fn wanted() -> Option<Fault> {
    static WANTED: OnceLock<Option<Fault>> = OnceLock::new();
    *WANTED.get_or_init(|| {
        let text = std::env::var("RUNOUT_TEST_FAULT").ok()?;
        let (kind, step) = text.split_once(':')?;
        let step = step.parse().ok()?;
        match kind {
            "kill" => Some(Fault::Kill(step)),
            "fail" => Some(Fault::Fail(step)),
            _ => None,
        }
    })
}

/// A step that changes the file system; in a test it may be the last one, or fail.
pub(super) fn step() -> io::Result<()> {
    static STEPS: AtomicU64 = AtomicU64::new(0);
    let Some(fault) = wanted() else { return Ok(()) };
    let now = STEPS.fetch_add(1, Ordering::SeqCst) + 1;
    match fault {
        // Nothing is cleaned up and no destructor runs, as after SIGKILL.
        Fault::Kill(step) if step == now => std::process::abort(),
        Fault::Fail(step) if step == now => Err(io::Error::other("a fault that a test asked for")),
        _ => Ok(()),
    }
}
