//! A running program: it is asked, it answers, and ends with whoever asked.

use std::{
    io::{BufReader, ErrorKind as ErrorKindOfSystem, Write},
    process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio},
    sync::{
        Arc, Mutex, PoisonError,
        mpsc::{Receiver, RecvTimeoutError, Sender, channel, sync_channel},
    },
    thread,
    time::{Duration, Instant},
};

use runout_core::ErrorKind;

use crate::{
    frame::{self, END, Frame, NoFrame},
    program::{Failure, Program},
    said::Said,
};

/// How long a program may take to end once its input is closed, and to close its stderr once it has ended.
const GRACE: Duration = Duration::from_secs(1);
const POLL: Duration = Duration::from_millis(2);

/// Process groups of the programs that run.
static RUNNING: Mutex<Vec<u32>> = Mutex::new(Vec::new());

/// Ends every program that this process has started, as a process does that is interrupted.
pub fn end_all() {
    running().drain(..).for_each(end_group);
}

fn running() -> std::sync::MutexGuard<'static, Vec<u32>> {
    RUNNING.lock().unwrap_or_else(PoisonError::into_inner)
}

/// A program that runs.
pub(crate) struct Process {
    child: Child,
    requests: Option<Sender<Vec<u8>>>,
    answers: Receiver<Result<Frame, NoFrame>>,
    said: Arc<Said>,
    program: Program,
}

impl Process {
    /// Starts a program.
    ///
    /// # Errors
    /// When the system does not.
    pub(crate) fn start(program: &Program) -> Result<Self, Failure> {
        let mut command = Command::new(program.file());
        command.args(&program.command[1..]).current_dir(&program.folder);
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        #[cfg(unix)]
        std::os::unix::process::CommandExt::process_group(&mut command, 0);
        // An interrupt that comes meanwhile waits until the program is listed.
        let mut listed = running();
        let mut child = command.spawn().map_err(|error| {
            let missing = error.kind() == ErrorKindOfSystem::NotFound;
            Failure {
                kind: if missing { ErrorKind::MissingFile } else { ErrorKind::Io },
                problem: format!("did not start: {error}"),
                help: "name a program that is installed, or a file by its path from the pipeline's folder: \
                       command = [\"./my_separator\"]"
                    .into(),
                said: String::new(),
            }
        })?;
        listed.push(child.id());
        drop(listed);
        limit(&child, program);
        let (requests, to_write) = channel();
        let (to_take, answers) = sync_channel(1);
        let said = Arc::new(Said::default());
        if let (Some(stdin), Some(stdout), Some(stderr)) =
            (child.stdin.take(), child.stdout.take(), child.stderr.take())
        {
            let (heard, output_bytes) = (Arc::clone(&said), program.output_bytes);
            thread::spawn(move || write(stdin, &to_write));
            thread::spawn(move || read(stdout, output_bytes, |frame| to_take.send(frame).is_ok()));
            thread::spawn(move || heard.gather(stderr));
        }
        Ok(Self { child, requests: Some(requests), answers, said, program: program.clone() })
    }

    /// Asks and waits for the answer, without its end.
    ///
    /// # Errors
    /// When there is none, or none in time. The program has then ended.
    pub(crate) fn ask(&mut self, request: Vec<u8>) -> Result<Vec<Frame>, Failure> {
        let deadline = Instant::now() + self.program.timeout;
        if let Some(requests) = &self.requests {
            // A program that reads no more has ended or fails to answer.
            let _ = requests.send(request);
        }
        let mut answer = Vec::new();
        loop {
            let trouble = match self.answers.recv_timeout(deadline.saturating_duration_since(Instant::now())) {
                Ok(Ok(frame)) if frame.name == END => return Ok(answer),
                Ok(Ok(frame)) => {
                    answer.push(frame);
                    continue;
                }
                Ok(Err(trouble)) => Some(trouble),
                Err(RecvTimeoutError::Disconnected) => Some(NoFrame::Ended),
                Err(RecvTimeoutError::Timeout) => None,
            };
            return Err(self.failure(trouble));
        }
    }

    /// Lines of its stderr that nobody has taken yet.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.said.lines()
    }

    /// Ends it and says why it gave no answer.
    fn failure(&mut self, trouble: Option<NoFrame>) -> Failure {
        // One whose output has ended is about to exit; any other is stopped.
        let ended = matches!(trouble, Some(NoFrame::Ended | NoFrame::CutOff { .. }));
        let status = self.end(if ended { GRACE } else { Duration::ZERO }).filter(|_| ended);
        let (said, program) = (self.said.end(GRACE), &self.program);
        let megabytes = |bytes: u64| bytes as f64 / 1e6;
        let bad = |problem: String| Failure::answer(problem);
        let mut failure = match trouble {
            None => Failure {
                kind: ErrorKind::Interrupted,
                problem: format!("gave no answer within {} s and was stopped", program.timeout.as_secs_f64()),
                help: "an answer ends with the line `end 0`, flushed; a slow program needs a larger `timeout_s`".into(),
                said: String::new(),
            },
            Some(NoFrame::Ended) => match status {
                Some(status) if !status.success() => Failure {
                    kind: ErrorKind::Interrupted,
                    problem: format!("ended with {status} and gave no answer"),
                    help: match program.memory_bytes {
                        Some(bytes) => {
                            format!("its stderr says why; `memory_mb` ({}) limits its memory", megabytes(bytes))
                        }
                        None => format!("its stderr says why; {}", program.trial()),
                    },
                    said: String::new(),
                },
                _ => Failure {
                    kind: ErrorKind::Interrupted,
                    help: format!("an answer ends with the line `end 0`, flushed; {}", program.trial()),
                    ..bad("closed its output and gave no answer".into())
                },
            },
            Some(NoFrame::CutOff { name, wanted, found }) => {
                bad(format!("announced `{name}` with {wanted} bytes and gave {found}"))
            }
            Some(NoFrame::Garbage(found)) => bad(format!(
                "wrote \"{found}\" to stdout, where a line as `harmonics 1234` was expected: the name of a table and its bytes"
            )),
            Some(NoFrame::TooLarge { name, bytes }) => Failure {
                help: "a correct answer that is so large needs a larger `output_mb`".into(),
                ..bad(format!(
                    "announced `{name}` with {bytes} bytes, which makes its answer larger than {} MB",
                    megabytes(program.output_bytes)
                ))
            },
            Some(NoFrame::Io(error)) => bad(format!("cannot be read from: {error}")),
        };
        failure.said = said;
        failure
    }

    /// Closes its input, gives it some time to end, and stops it and what it has started.
    fn end(&mut self, grace: Duration) -> Option<ExitStatus> {
        self.requests = None;
        let deadline = Instant::now() + grace;
        let mut status = self.child.try_wait().ok().flatten();
        while status.is_none() && Instant::now() < deadline {
            thread::sleep(POLL);
            status = self.child.try_wait().ok().flatten();
        }
        let group = self.child.id();
        let is_listed = running().extract_if(.., |known| *known == group).count() > 0;
        if is_listed {
            end_group(group);
        }
        let _has_ended = self.child.kill();
        status.or_else(|| self.child.wait().ok())
    }
}

impl Drop for Process {
    fn drop(&mut self) {
        self.end(GRACE);
    }
}

/// Writes requests until there are no more, and closes the input.
fn write(mut stdin: ChildStdin, requests: &Receiver<Vec<u8>>) {
    for request in requests {
        if stdin.write_all(&request).and_then(|()| stdin.flush()).is_err() {
            break;
        }
    }
}

/// Reads answers until the stream ends, something is wrong or nobody takes them; each may have so many bytes.
fn read(stdout: ChildStdout, output_bytes: u64, take: impl Fn(Result<Frame, NoFrame>) -> bool) {
    let (mut stdout, mut left) = (BufReader::with_capacity(1 << 16, stdout), output_bytes);
    loop {
        let found = frame::read(&mut stdout, &mut left);
        if found.as_ref().is_ok_and(|frame| frame.name == END) {
            left = output_bytes;
        }
        let is_last = found.is_err();
        if !take(found) || is_last {
            break;
        }
    }
}

#[cfg(target_os = "linux")]
fn limit(child: &Child, program: &Program) {
    use rustix::process::{Pid, Resource, Rlimit, prlimit};
    // What is written to counts; address space that is only reserved does not.
    if let Some(bytes) = program.memory_bytes {
        let limit = Rlimit { current: Some(bytes), maximum: Some(bytes) };
        // One that has ended needs no limit.
        let _ = prlimit(Some(Pid::from_child(child)), Resource::Data, limit);
    }
}

#[cfg(not(target_os = "linux"))]
fn limit(_child: &Child, _program: &Program) {}

#[cfg(unix)]
fn end_group(group: u32) {
    use rustix::process::{Pid, Signal, kill_process_group};
    if let Some(group) = i32::try_from(group).ok().and_then(Pid::from_raw) {
        // It may have ended by itself.
        let _ = kill_process_group(group, Signal::KILL);
    }
}

#[cfg(not(unix))]
fn end_group(_group: u32) {}
