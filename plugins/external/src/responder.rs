//! What answers the requests of a stage: a program, or code of this process.

use std::sync::Arc;

use runout_core::{Error, ErrorKind};

use crate::{
    frame::{self, END, Frame, NoFrame},
    process::Process,
    program::{Failure, Program},
};

/// Code of this process that answers requests as a program does.
pub trait Code: Send + Sync {
    /// What pipelines call it.
    fn name(&self) -> &str;

    /// Begins a session.
    ///
    /// # Errors
    /// Why it cannot, in words that go on from its name.
    fn begin(&self) -> Result<Answers, String>;
}

/// A session: from the bytes of a request to those of its answer, both [frames](crate::frame) with their end. An error is words that go on from
/// the name of the code.
pub type Answers = Box<dyn FnMut(&[u8]) -> Result<Vec<u8>, String> + Send>;

/// What answers.
#[derive(Clone)]
pub(crate) enum Responder {
    /// A program, which runs beside this process.
    Program(Program),
    /// Code of this process.
    Code(Arc<dyn Code>),
}

/// A session with it.
pub(crate) enum Running {
    /// Of a program.
    Process(Process),
    /// Of code.
    Code(Answers),
}

impl From<Program> for Responder {
    fn from(program: Program) -> Self {
        Self::Program(program)
    }
}

impl From<Arc<dyn Code>> for Responder {
    fn from(code: Arc<dyn Code>) -> Self {
        Self::Code(code)
    }
}

impl Responder {
    /// Begins a session.
    ///
    /// # Errors
    /// When a program does not start, or code does not begin.
    pub(crate) fn start(&self) -> Result<Running, Failure> {
        match self {
            Self::Program(program) => Process::start(program).map(Running::Process),
            Self::Code(code) => code.begin().map(Running::Code).map_err(raised),
        }
    }

    /// What messages call it.
    pub(crate) fn shown(&self) -> String {
        match self {
            Self::Program(program) => format!("the program `{}` of plugin `external`", program.shown()),
            Self::Code(code) => format!("the plugin `{}`", code.name()),
        }
    }

    /// A failure as an error of an operation on an object.
    pub(crate) fn error(&self, operation: &str, object: &str, failure: &Failure) -> Error {
        let Failure { kind, problem, help, said } = failure;
        let said = if said.is_empty() { String::new() } else { format!("; its stderr ends with: {said}") };
        let help = if matches!(self, Self::Code(_)) {
            "mend its code: docs/python-plugins.md says what it gives"
        } else {
            help
        };
        Error::new(operation, object, format!("{} {problem}{said}", self.shown())).of(*kind).help(help)
    }
}

impl Running {
    /// Asks and waits for the answer, without its end.
    ///
    /// # Errors
    /// When there is none.
    pub(crate) fn ask(&mut self, request: Vec<u8>) -> Result<Vec<Frame>, Failure> {
        match self {
            Self::Process(process) => process.ask(request),
            Self::Code(answers) => frames(&answers(&request).map_err(raised)?),
        }
    }

    /// Lines of a program's stderr that nobody has taken yet.
    pub(crate) fn lines(&self) -> Vec<String> {
        match self {
            Self::Process(process) => process.lines(),
            Self::Code(_) => Vec::new(),
        }
    }
}

fn raised(problem: String) -> Failure {
    Failure { kind: ErrorKind::Interrupted, problem, help: String::new(), said: String::new() }
}

/// The frames of an answer before its end.
fn frames(mut answer: &[u8]) -> Result<Vec<Frame>, Failure> {
    let (mut found, mut left) = (Vec::new(), u64::MAX);
    loop {
        match frame::read(&mut answer, &mut left) {
            Ok(frame) if frame.name == END => return Ok(found),
            Ok(frame) => found.push(frame),
            Err(NoFrame::Ended) => return Err(Failure::answer("gave an answer without its end")),
            Err(_) => return Err(Failure::answer("gave an answer that is no sequence of frames")),
        }
    }
}
