//! Frames: a line with a name and a number of bytes, and so many bytes.

use std::io::{self, BufRead, Read, Write};

/// Longest line of a frame, in bytes.
const LONGEST_LINE: u64 = 64;
/// What ends a request and an answer.
pub(crate) const END: &str = "end";

/// A named piece of a request or an answer.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Frame {
    /// Name of the table, `warning` or [`END`].
    pub name: String,
    /// An Arrow IPC stream, or text.
    pub body: Vec<u8>,
}

impl Frame {
    /// A frame without a body that ends a request.
    pub(crate) fn end() -> Self {
        Self { name: END.into(), body: Vec::new() }
    }

    /// Its bytes.
    pub(crate) fn append_to(&self, out: &mut Vec<u8>) {
        // Memory takes whatever is written to it.
        let _ = writeln!(out, "{} {}", self.name, self.body.len());
        out.extend_from_slice(&self.body);
    }
}

/// Why there is no frame.
#[derive(Debug, Clone, PartialEq)]
pub(crate) enum NoFrame {
    /// The stream ends between two frames.
    Ended,
    /// The stream ends within a frame.
    CutOff { name: String, wanted: u64, found: u64 },
    /// What is there is no line of a frame; its first bytes.
    Garbage(String),
    /// It is larger than what is left of the limit.
    TooLarge { name: String, bytes: u64 },
    /// The system does not read.
    Io(String),
}

/// Reads a frame, and takes its bytes and those of its line from `left`.
///
/// # Errors
/// When there is none, or it is larger than `left`.
pub(crate) fn read(stream: &mut impl BufRead, left: &mut u64) -> Result<Frame, NoFrame> {
    let failed = |error: io::Error| NoFrame::Io(error.to_string());
    let mut line = Vec::new();
    stream.by_ref().take(LONGEST_LINE).read_until(b'\n', &mut line).map_err(failed)?;
    if line.is_empty() {
        return Err(NoFrame::Ended);
    }
    let Some((name, bytes)) = parsed(&line) else {
        return Err(NoFrame::Garbage(line.escape_ascii().to_string()));
    };
    let rest = left.checked_sub(line.len() as u64).and_then(|left| left.checked_sub(bytes));
    let Some(rest) = rest else {
        return Err(NoFrame::TooLarge { name, bytes });
    };
    *left = rest;
    let mut body = Vec::new();
    let found = stream.by_ref().take(bytes).read_to_end(&mut body).map_err(failed)? as u64;
    if found < bytes {
        return Err(NoFrame::CutOff { name, wanted: bytes, found });
    }
    Ok(Frame { name, body })
}

/// Name and bytes of a line.
fn parsed(line: &[u8]) -> Option<(String, u64)> {
    let line = str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let (name, bytes) = line.trim_end_matches('\r').split_once(' ')?;
    let is_name = !name.is_empty() && name.bytes().all(|letter| letter.is_ascii_lowercase() || letter == b'_');
    Some((name.to_owned(), bytes.parse().ok()?)).filter(|_| is_name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_frame_is_read_as_it_was_written_and_nothing_else_is_one() {
        let frame = Frame { name: "harmonics".into(), body: vec![10, 0, 255] };
        let mut bytes = Vec::new();
        frame.append_to(&mut bytes);
        Frame::end().append_to(&mut bytes);
        let mut left = 100;
        let mut stream = &bytes[..];
        assert_eq!(read(&mut stream, &mut left), Ok(frame));
        assert_eq!(read(&mut stream, &mut left), Ok(Frame::end()));
        assert_eq!((read(&mut stream, &mut left), left), (Err(NoFrame::Ended), 100 - 12 - 3 - 6));

        let of = |bytes: &[u8]| read(&mut &bytes[..], &mut 100);
        assert_eq!(of(b"harmonics 9\nabc"), Err(NoFrame::CutOff { name: "harmonics".into(), wanted: 9, found: 3 }));
        assert_eq!(of(b"profiles 1e9\n"), Err(NoFrame::Garbage("profiles 1e9\\n".into())));
        assert_eq!(of(b"harmonics 90\n"), Err(NoFrame::TooLarge { name: "harmonics".into(), bytes: 90 }));
        for bytes in [&b"no newline"[..], &[0xFF; 4000], b"\n", b"Harmonics 3\nabc", b"harmonics -3\n"] {
            assert!(matches!(of(bytes), Err(NoFrame::Garbage(_))), "{bytes:?}");
        }
    }
}
