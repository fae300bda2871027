//! A process that does one command line after another, and what became of each.

use std::{
    fs::{self, File},
    io::{self, Read, Write},
    net::{TcpListener, TcpStream},
    path::Path,
    process::{Child, Command, Stdio},
    time::{Duration, Instant},
};

/// A process has to be there within this time.
const STARTED: Duration = Duration::from_secs(30);

/// A running build of the example `many_command_lines`.
pub(crate) struct Worker {
    process: Child,
    connection: TcpStream,
    /// What it prints of errors.
    said: File,
}

/// What became of a command line.
pub(crate) enum Answer {
    /// It ended with an exit status, and took this memory.
    Status { status: u32, memory_kb: u64 },
    /// The process ended.
    Ended,
    /// The process did not answer in time, and was killed.
    Late,
}

impl Worker {
    /// Starts it in a folder.
    ///
    /// # Errors
    /// When it does not start or does not connect.
    pub(crate) fn start(program: &Path, folder: &Path) -> io::Result<Self> {
        let listener = TcpListener::bind(("127.0.0.1", 0))?;
        listener.set_nonblocking(true)?;
        let path = folder.join("said");
        let errors = fs::OpenOptions::new().create(true).append(true).open(&path)?;
        let mut command = Command::new(program);
        command.arg(listener.local_addr()?.port().to_string()).current_dir(folder);
        let mut process = command.stdin(Stdio::null()).stdout(Stdio::null()).stderr(errors).spawn()?;
        let begun = Instant::now();
        loop {
            match listener.accept() {
                Ok((connection, _)) => {
                    connection.set_nonblocking(false)?;
                    connection.set_nodelay(true)?;
                    let said = fs::OpenOptions::new().read(true).write(true).open(&path)?;
                    return Ok(Self { process, connection, said });
                }
                Err(error) if error.kind() == io::ErrorKind::WouldBlock && begun.elapsed() < STARTED => {
                    std::thread::sleep(Duration::from_millis(5));
                }
                Err(error) => {
                    process.kill()?;
                    process.wait()?;
                    return Err(error);
                }
            }
        }
    }

    /// Gives it a command line, and waits for the answer.
    ///
    /// # Errors
    /// When the process cannot be waited for.
    pub(crate) fn give(&mut self, words: &[&str], longest: Duration) -> io::Result<Answer> {
        self.said.set_len(0)?;
        let number = |count: usize| u32::try_from(count).unwrap_or(u32::MAX).to_le_bytes();
        let mut line = number(words.len()).to_vec();
        for word in words {
            line.extend(number(word.len()));
            line.extend(word.as_bytes());
        }
        self.connection.set_read_timeout(Some(longest))?;
        let mut answer = [0; 8];
        let exchanged = self.connection.write_all(&line).and_then(|()| self.connection.read_exact(&mut answer));
        let [status, memory_kb] = [0, 4].map(|at| u32::from_le_bytes([0, 1, 2, 3].map(|byte| answer[at + byte])));
        match exchanged {
            Ok(()) => Ok(Answer::Status { status, memory_kb: memory_kb.into() }),
            Err(error) if matches!(error.kind(), io::ErrorKind::WouldBlock | io::ErrorKind::TimedOut) => {
                self.process.kill()?;
                self.process.wait()?;
                Ok(Answer::Late)
            }
            Err(_) => {
                self.process.wait()?;
                Ok(Answer::Ended)
            }
        }
    }

    /// What it printed since the command line was given.
    ///
    /// # Errors
    /// When that cannot be read.
    pub(crate) fn said(&mut self) -> io::Result<Vec<u8>> {
        let mut text = Vec::new();
        io::Seek::rewind(&mut self.said)?;
        self.said.read_to_end(&mut text)?;
        Ok(text)
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        let _ = self.process.kill();
        let _ = self.process.wait();
    }
}
