//! One session for all questions of a run: of a program, one process.

use std::sync::{Mutex, MutexGuard, PoisonError};

use runout_core::{Error, Result};

use crate::{
    frame::Frame,
    program::Failure,
    responder::{Responder, Running},
};

/// A session that begins with the first question.
pub(crate) struct Session {
    responder: Responder,
    state: Mutex<State>,
}

enum State {
    Idle,
    Running(Running),
    Failed(Failure),
}

impl Session {
    pub(crate) fn new(responder: impl Into<Responder>) -> Self {
        Self { responder: responder.into(), state: Mutex::new(State::Idle) }
    }

    /// Asks, and reads the answer; questions from several threads wait for each other. What failed is not asked again.
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
            *state = self.responder.start().map_or_else(State::Failed, State::Running);
        }
        let answer = match &mut *state {
            State::Running(running) => running.ask(request),
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
            State::Running(running) => running.lines(),
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
        self.ask(request, read).map_err(|failure| self.responder.error(operation, object, &failure))
    }

    /// Why it gave no answer, once it has not.
    pub(crate) fn failure(&self, operation: &str, object: &str) -> Option<Error> {
        match &*self.locked() {
            State::Failed(failure) => Some(self.responder.error(operation, object, failure)),
            _ => None,
        }
    }

    fn locked(&self) -> MutexGuard<'_, State> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}
