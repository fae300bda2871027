//! What a program writes to stderr: kept in part, however much it is.

use std::{
    collections::VecDeque,
    io::{ErrorKind, Read},
    sync::{Condvar, Mutex, PoisonError},
    time::Duration,
};

/// Bytes of the end that errors quote.
const QUOTED: usize = 2000;
/// Lines that wait to be shown, and bytes of each.
const LINES: usize = 32;
const LINE: usize = 200;

/// What was written so far.
#[derive(Debug, Default)]
pub(crate) struct Said {
    inner: Mutex<Inner>,
    closed: Condvar,
}

#[derive(Debug, Default)]
struct Inner {
    tail: VecDeque<u8>,
    lines: VecDeque<String>,
    line: Vec<u8>,
    closed: bool,
}

impl Said {
    /// Reads a stream to its end. A program that writes much is never held up.
    pub(crate) fn gather(&self, mut stream: impl Read) {
        let mut bytes = vec![0; 1 << 16];
        loop {
            match stream.read(&mut bytes) {
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Ok(0) | Err(_) => break,
                Ok(count) => self.take(&bytes[..count]),
            }
        }
        self.locked().closed = true;
        self.closed.notify_all();
    }

    fn take(&self, bytes: &[u8]) {
        let mut inner = self.locked();
        inner.tail.extend(&bytes[bytes.len().saturating_sub(QUOTED)..]);
        let beyond = inner.tail.len().saturating_sub(QUOTED);
        inner.tail.drain(..beyond);
        // Of a flood only the last lines can be shown.
        for byte in &bytes[bytes.len().saturating_sub(LINES * LINE)..] {
            if *byte != b'\n' {
                if inner.line.len() < LINE {
                    inner.line.push(*byte);
                }
                continue;
            }
            let line = std::mem::take(&mut inner.line);
            let line = plain(&String::from_utf8_lossy(&line));
            if !line.trim().is_empty() {
                inner.lines.push_back(line);
            }
            let beyond = inner.lines.len().saturating_sub(LINES);
            inner.lines.drain(..beyond);
        }
    }

    /// Whole lines that nobody has taken yet: the last of them.
    pub(crate) fn lines(&self) -> Vec<String> {
        self.locked().lines.drain(..).collect()
    }

    /// The last lines of what was written, in one, once the program has closed it or so much time is over.
    pub(crate) fn end(&self, wait: Duration) -> String {
        let inner = self.closed.wait_timeout_while(self.locked(), wait, |inner| !inner.closed);
        let (inner, _) = inner.unwrap_or_else(PoisonError::into_inner);
        let bytes: Vec<u8> = inner.tail.iter().copied().collect();
        let text = String::from_utf8_lossy(&bytes);
        let lines = text.lines().map(|line| plain(line.trim())).filter(|line| !line.is_empty());
        lines.collect::<Vec<_>>().join(" | ")
    }

    fn locked(&self) -> std::sync::MutexGuard<'_, Inner> {
        self.inner.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// Without what a terminal would take for a command.
fn plain(text: &str) -> String {
    text.chars().filter(|letter| !letter.is_control()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_flood_is_kept_in_part() {
        let said = Said::default();
        let flood = "x".repeat(10_000_000) + "\nthe\x1b[31m end\r\n";
        said.gather(flood.as_bytes());
        let end = said.end(Duration::ZERO);
        assert!(end.len() < QUOTED && end.ends_with("x | the[31m end"), "{}", end.len());
        let lines = said.lines();
        assert_eq!(lines.last().map(String::as_str), Some("the[31m end"));
        assert!(lines.iter().all(|line| line.len() <= LINE) && lines.len() == 2);
        assert!(said.lines().is_empty(), "each line once");
    }
}
