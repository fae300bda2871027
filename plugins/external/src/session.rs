//! One process for all questions of a run.

use std::sync::{Mutex, MutexGuard, PoisonError};

use runout_core::Result;

use crate::{
    frame::Frame,
    process::Process,
    program::{Failure, Program},
};

/// A program that starts with the first question.
pub(crate) struct Session {
    program: Program,
    state: Mutex<State>,
}

enum State {
    Idle,
    Running(Process),
    Failed(Failure),
}

impl Session {
    pub(crate) fn new(program: Program) -> Self {
        Self { program, state: Mutex::new(State::Idle) }
    }

    /// Asks, and reads the answer; questions from several threads wait for each other. A program that failed is not asked again.
    ///
    /// # Errors
    /// When there is no answer, or it cannot be read: why, in words that go on from "the program".
    pub(crate) fn ask<T>(
        &self,
        request: Vec<u8>,
        read: impl FnOnce(&[Frame]) -> std::result::Result<T, String>,
    ) -> std::result::Result<T, Failure> {
        let mut state = self.locked();
        if matches!(*state, State::Idle) {
            *state = Process::start(&self.program).map_or_else(State::Failed, State::Running);
        }
        let answer = match &mut *state {
            State::Running(process) => process.ask(request, &self.program),
            State::Failed(failure) => return Err(failure.clone()),
            State::Idle => Err(Failure::answer("was not started")),
        };
        let found = answer.and_then(|answer| read(&answer).map_err(Failure::answer));
        // Others that wait for an answer get none either.
        found.inspect_err(|failure| *state = State::Failed(failure.clone()))
    }

    /// Lines of its stderr that nobody has taken yet.
    pub(crate) fn lines(&self) -> Vec<String> {
        match &*self.locked() {
            State::Running(process) => process.lines(),
            _ => Vec::new(),
        }
    }

    /// An answer, or the failure as an error of an operation on an object.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn answer<T>(
        &self,
        (operation, object): (&str, &str),
        request: Vec<u8>,
        read: impl FnOnce(&[Frame]) -> std::result::Result<T, String>,
    ) -> Result<T> {
        self.ask(request, read).map_err(|failure| self.program.error(operation, object, &failure))
    }

    fn locked(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
