//! What the work does not wait for: blocks are read ahead of it, results written behind it, each by a thread of its own.

use std::{
    sync::mpsc::{Receiver, Sender, channel, sync_channel},
    thread,
};

use crate::{
    Error, Result,
    measurement::{Block, Capture, SampleStream},
};

/// Blocks that were read and wait.
const AHEAD: usize = 1;
/// Results that wait to be written.
const BEHIND: usize = 1;

/// Does `work` on a stream whose blocks are read ahead.
pub(super) fn read_ahead<R>(
    mut input: Box<dyn SampleStream + '_>,
    work: impl FnOnce(Box<dyn SampleStream>) -> Result<R>,
) -> Result<R> {
    let capture = input.capture().clone();
    let (sender, blocks) = sync_channel(AHEAD);
    let (used, spare) = channel::<Block>();
    thread::scope(|scope| {
        scope.spawn(move || {
            loop {
                let mut block = spare.try_recv().unwrap_or_default();
                let next = input.next_block(&mut block).map(|more| more.then_some(block));
                let last = !matches!(next, Ok(Some(_)));
                // Nobody takes it where the work has failed.
                if sender.send(next).is_err() || last {
                    return;
                }
            }
        });
        work(Box::new(Ahead { capture, blocks, used }))
    })
}

/// A stream whose blocks another thread reads.
struct Ahead {
    capture: Capture,
    /// `None` is the end.
    blocks: Receiver<Result<Option<Block>>>,
    /// Blocks whose memory may be used again.
    used: Sender<Block>,
}

impl SampleStream for Ahead {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        // Behind the end, the thread is gone.
        let next = self.blocks.recv().unwrap_or(Ok(None))?;
        let more = next.is_some();
        let emptied = std::mem::replace(block, next.unwrap_or_default());
        // The same.
        let _ = self.used.send(emptied);
        Ok(more)
    }
}

/// Does `work`, and `take`s in the same order on another thread what it hands on.
pub(super) fn write_behind<T: Send, R>(
    mut take: impl FnMut(T) -> Result<()> + Send,
    work: impl FnOnce(&(dyn Fn(T) -> Result<()> + Sync)) -> Result<R>,
) -> Result<R> {
    let (sender, results) = sync_channel(BEHIND);
    let stopped = |operation| Error::new(operation, "the results", "the thread that writes them stopped");
    thread::scope(|scope| {
        let writer = scope.spawn(move || results.into_iter().try_for_each(&mut take));
        let outcome = work(&|result| sender.send(result).map_err(|_| stopped("hand on")));
        drop(sender);
        // Where the writer failed, that is why the work did.
        writer.join().unwrap_or_else(|_| Err(stopped("write")))?;
        outcome
    })
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use super::*;

    /// Counts to a number, and then ends or fails.
    struct Counting {
        capture: Capture,
        next: u64,
        last: u64,
        fails: bool,
    }

    impl SampleStream for Counting {
        fn capture(&self) -> &Capture {
            &self.capture
        }

        fn next_block(&mut self, block: &mut Block) -> Result<bool> {
            block.clear();
            if self.next == self.last {
                return if self.fails { Err(Error::new("read", "it", "gone")) } else { Ok(false) };
            }
            block.start = self.next;
            block.samples.push(self.next as f64);
            self.next += 1;
            Ok(true)
        }
    }

    fn counting(last: u64, fails: bool) -> Box<dyn SampleStream> {
        let capture = Capture {
            object: "it".into(),
            setup: 0,
            station: "s01".into(),
            z_mm: 0.0,
            stated_speed_rpm: None,
            sample_rate_hz: None,
            samples: last,
            sensors: vec![0],
            sensor_ids: vec!["S1".into()],
            converter_limits_um: None,
            marks: Vec::new(),
            encoder: false,
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        Box::new(Counting { capture, next: 0, last, fails })
    }

    fn count(mut stream: Box<dyn SampleStream>) -> Result<Vec<f64>> {
        let (mut found, mut block) = (Vec::new(), Block::default());
        while stream.next_block(&mut block)? {
            assert_eq!(block.start as usize, found.len());
            found.append(&mut block.samples);
        }
        assert!(block.samples.is_empty() && !stream.next_block(&mut block)?);
        Ok(found)
    }

    #[test]
    fn blocks_come_in_order_and_end_as_the_input_does() {
        assert_eq!(read_ahead(counting(100, false), count).unwrap(), (0..100).map(f64::from).collect::<Vec<_>>());
        assert!(read_ahead(counting(100, true), count).unwrap_err().to_string().contains("gone"));
    }

    #[test]
    fn work_that_stops_early_stops_the_reading() {
        let first = read_ahead(counting(u64::MAX, false), |mut stream| stream.next_block(&mut Block::default()));
        assert!(first.unwrap());
    }

    #[test]
    fn results_are_taken_in_order_and_a_writer_that_fails_says_why() {
        let mut taken = Vec::new();
        let all = |take: &(dyn Fn(u32) -> Result<()> + Sync)| (0..100).try_for_each(take);
        write_behind(
            |number| {
                taken.push(number);
                Ok(())
            },
            all,
        )
        .unwrap();
        assert_eq!(taken, (0..100).collect::<Vec<_>>());
        let full = |number| if number < 7 { Ok(()) } else { Err(Error::new("write", "it", "disk full")) };
        assert!(write_behind(full, all).unwrap_err().to_string().contains("disk full"));
    }
}
