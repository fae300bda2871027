//! Parts of a file that are made side by side and written in their order.

use std::{
    io::{self, Write},
    num::NonZeroUsize,
    sync::mpsc::{channel, sync_channel},
    thread,
};

/// Portions that wait for the file, a thread.
const WAITING: usize = 4;

/// Threads that the machine runs side by side.
#[must_use]
pub fn processors() -> usize {
    thread::available_parallelism().map_or(1, NonZeroUsize::get)
}

/// Writes what `make` appends for each of `count` parts, `together` of them at a time, one after the other; so many `threads`
/// make them beside the one that writes.
///
/// A portion that is written lends its memory to a later one: fresh memory costs more than what is put into it.
///
/// # Errors
/// When the file fails.
pub fn in_order(
    count: usize,
    together: usize,
    threads: usize,
    to: &mut impl Write,
    make: impl Fn(usize, &mut Vec<u8>) + Sync,
) -> io::Result<()> {
    let together = together.max(1);
    let portions = count.div_ceil(together);
    let workers = threads.clamp(1, portions.max(1));
    thread::scope(|scope| {
        let made = (0..workers).map(|first| {
            let (sender, receiver) = sync_channel::<Vec<u8>>(WAITING);
            let (used, spare) = channel::<Vec<u8>>();
            let make = &make;
            scope.spawn(move || {
                for portion in (first..portions).step_by(workers) {
                    let mut bytes = spare.try_recv().unwrap_or_default();
                    bytes.clear();
                    (portion * together..count.min((portion + 1) * together)).for_each(|part| make(part, &mut bytes));
                    // Nobody takes it where the file has failed.
                    if sender.send(bytes).is_err() {
                        return;
                    }
                }
            });
            (receiver, used)
        });
        let made: Vec<_> = made.collect();
        (0..portions).try_for_each(|portion| {
            let (receiver, used) = &made[portion % workers];
            let stopped = |_| io::Error::other("a thread that makes the mesh stopped");
            let bytes = receiver.recv().map_err(stopped)?;
            to.write_all(&bytes)?;
            // Nobody takes it behind the last portion.
            let _ = used.send(bytes);
            Ok(())
        })
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    #[test]
    fn parts_come_in_their_order_and_a_file_that_fails_says_so() {
        let make = |part: usize, bytes: &mut Vec<u8>| bytes.extend_from_slice(format!("{part} ").as_bytes());
        for (count, together) in [(0, 4), (1, 4), (1003, 1), (1003, 7), (5, 0)] {
            let mut written = Vec::new();
            in_order(count, together, 2, &mut written, make).unwrap();
            let mut expected = Vec::new();
            (0..count).for_each(|part| make(part, &mut expected));
            assert_eq!(written, expected);
        }
        let mut full = &mut [0_u8; 100][..];
        assert_eq!(in_order(1000, 3, 2, &mut full, make).unwrap_err().kind(), io::ErrorKind::WriteZero);
    }
}
