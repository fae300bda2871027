//! Does command lines that come over a connection, one after another in one process: `cargo xtask fuzz` gives it as many as it can.
//!
//! `many_command_lines PORT`: of each command line the number of its words as a little-endian `u32`, then of each word its bytes behind their
//! number. The answer is the exit status as a `u32`, and the memory in kB that the work took beside what the process had, as a `u32` (0 where
//! the system does not say). It ends with the connection.

use std::{
    error::Error,
    ffi::OsString,
    fs,
    io::{Read, Write},
    net::TcpStream,
};

fn main() -> Result<(), Box<dyn Error>> {
    let port: u16 = std::env::args().nth(1).ok_or("usage: many_command_lines PORT")?.parse()?;
    let mut connection = TcpStream::connect(("127.0.0.1", port))?;
    connection.set_nodelay(true)?;
    let registry = runout_cli::builtin::registry();
    while let Some(words) = command_line(&mut connection)? {
        // Linux forgets the largest memory so far.
        let _ = fs::write("/proc/self/clear_refs", "5");
        let before_kb = memory_kb("VmRSS:");
        let status = runout_cli::status_of(words, &registry);
        let taken_kb = memory_kb("VmHWM:").saturating_sub(before_kb);
        connection.write_all(&[u32::from(status), taken_kb].map(u32::to_le_bytes).concat())?;
    }
    Ok(())
}

/// The next command line, or none at the end.
fn command_line(connection: &mut TcpStream) -> std::io::Result<Option<Vec<OsString>>> {
    let mut number = || {
        let mut bytes = [0; 4];
        connection.read_exact(&mut bytes).map(|()| u32::from_le_bytes(bytes) as usize)
    };
    let Ok(words) = number() else { return Ok(None) };
    let word = |_| {
        let mut length = [0; 4];
        connection.read_exact(&mut length)?;
        let mut word = vec![0; u32::from_le_bytes(length) as usize];
        connection.read_exact(&mut word)?;
        Ok(String::from_utf8_lossy(&word).into_owned().into())
    };
    (0..words).map(word).collect::<std::io::Result<_>>().map(Some)
}

/// A line of Linux's status of this process, in kB.
fn memory_kb(name: &str) -> u32 {
    let status = fs::read_to_string("/proc/self/status").unwrap_or_default();
    let number = |line: &str| line.strip_prefix(name)?.trim().split(' ').next()?.parse().ok();
    status.lines().find_map(number).unwrap_or(0)
}
