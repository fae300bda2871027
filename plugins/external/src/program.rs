//! A program as it is configured, and its failures in words.

use std::{
    path::{Path, PathBuf},
    time::Duration,
};

use runout_core::{ErrorKind, fault::Fault};

/// Longest time for one answer: a day.
const LONGEST_S: f64 = 86_400.0;
const BYTES_PER_MB: u64 = 1_000_000;

/// A command with its limits.
#[derive(Debug, Clone)]
pub(crate) struct Program {
    /// The program and its arguments; at least one.
    pub command: Vec<String>,
    /// Where it runs.
    pub folder: PathBuf,
    /// Longest time for one answer.
    pub timeout: Duration,
    /// Most memory, in bytes; `None` for no limit.
    pub memory_bytes: Option<u64>,
    /// Largest answer, in bytes.
    pub output_bytes: u64,
}

/// What went wrong with a program.
#[derive(Debug, Clone)]
pub(crate) struct Failure {
    pub kind: ErrorKind,
    /// "exited with status 1", in the past tense behind the program's name.
    pub problem: String,
    pub help: String,
    /// The end of its stderr; empty where it wrote nothing.
    pub said: String,
}

impl Failure {
    /// An answer that is not what the protocol asks for.
    pub(crate) fn answer(problem: impl Into<String>) -> Self {
        let help =
            "mend the program: docs/external-programs.md has the tables, `runout plugins test -- COMMAND` tests it";
        Self { kind: ErrorKind::DamagedData, problem: problem.into(), help: help.into(), said: String::new() }
    }
}

impl Program {
    /// Checks what a file gives.
    ///
    /// # Errors
    /// The first value that cannot be.
    pub(crate) fn new(
        command: Vec<String>,
        folder: &Path,
        (timeout_s, memory_mb, output_mb): (f64, Option<u64>, u64),
    ) -> Result<Self, Fault> {
        if command.first().is_none_or(String::is_empty) {
            let fault = Fault::at("command", "expected a program and its arguments, found none");
            return Err(fault.help("command = [\"python3\", \"my_separator.py\"]"));
        }
        if command.iter().any(|word| word.contains('\0')) {
            return Err(Fault::at("command", "expected words without the character 0"));
        }
        if !(timeout_s > 0.0 && timeout_s <= LONGEST_S) {
            return Err(Fault::at("timeout_s", format!("expected above 0 and up to {LONGEST_S} s, found {timeout_s}")));
        }
        for (key, value) in [("memory_mb", memory_mb), ("output_mb", Some(output_mb))] {
            if value.is_some_and(|value| !(1..=1_000_000).contains(&value)) {
                return Err(Fault::at(key, format!("expected 1 to 1000000 MB, found {}", value.unwrap_or_default())));
            }
        }
        if memory_mb.is_some() && !cfg!(target_os = "linux") {
            return Err(Fault::at("memory_mb", "this system does not limit the memory of another process")
                .help("leave it out; it works on Linux"));
        }
        Ok(Self {
            command,
            folder: if folder.as_os_str().is_empty() { Path::new(".") } else { folder }.to_owned(),
            timeout: Duration::from_secs_f64(timeout_s),
            memory_bytes: memory_mb.map(|value| value * BYTES_PER_MB),
            output_bytes: output_mb * BYTES_PER_MB,
        })
    }

    /// The program's file: a name with a separator is a path from the pipeline's folder, another one is looked for as a shell does.
    pub(crate) fn file(&self) -> PathBuf {
        let named = Path::new(self.command.first().map_or("", String::as_str));
        if named.components().count() < 2 {
            return named.to_owned();
        }
        let file = self.folder.join(named);
        std::path::absolute(&file).unwrap_or(file)
    }

    /// The command as it would be typed, for messages.
    pub(crate) fn shown(&self) -> String {
        let word = |word: &String| if word.contains(' ') { format!("'{word}'") } else { word.clone() };
        self.command.iter().map(word).collect::<Vec<_>>().join(" ")
    }

    /// How it is tried without a pipeline, for messages.
    pub(crate) fn trial(&self) -> String {
        format!("`runout plugins test -- {}` tries a separator of turns on simulated data", self.shown())
    }
}
