//! What the work does not wait for: captures are read ahead of it, results written behind it, each by a thread of its
//! own.

use std::{
    sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel},
    thread,
};

use crate::{
    Error, Result,
    measurement::{Block, Capture, SampleStream},
};

/// Blocks that were read and wait: what a station's captures take while the one before is separated.
const AHEAD: usize = 4;
/// Results that wait to be written.
const BEHIND: usize = 1;

/// An opened capture, and what it belongs to.
pub(super) type Opened<'a, K> = (K, Result<Box<dyn SampleStream + 'a>>);

/// Does `work` on captures that are read ahead, one after the other: also beyond the end of the one that is worked on.
pub(super) fn read_ahead<'a, K: Copy + Send, R>(
    captures: impl Iterator<Item = Opened<'a, K>> + Send,
    work: impl FnOnce(&mut Ahead<K>) -> R,
) -> R {
    let (sender, pieces) = sync_channel(AHEAD);
    let (used, spare) = channel::<Block>();
    thread::scope(|scope| {
        scope.spawn(move || {
            for (key, opened) in captures {
                // A piece that nobody takes: the work has ended.
                if hand_on(key, opened, &sender, &spare).is_none() {
                    return;
                }
            }
        });
        work(&mut Ahead { pieces, used, begun: None })
    })
}

/// Hands on all of a capture; `None` where nobody takes it.
fn hand_on<K>(
    key: K,
    opened: Result<Box<dyn SampleStream + '_>>,
    to: &SyncSender<Piece<K>>,
    spare: &Receiver<Block>,
) -> Option<()> {
    let mut stream = match opened {
        Ok(stream) => stream,
        Err(error) => return to.send(Piece::Begin(key, Err(error))).ok(),
    };
    to.send(Piece::Begin(key, Ok(stream.capture().clone()))).ok()?;
    loop {
        let mut block = spare.try_recv().unwrap_or_default();
        let next = stream.next_block(&mut block).map(|more| more.then_some(block));
        let last = !matches!(next, Ok(Some(_)));
        to.send(Piece::Next(next)).ok()?;
        if last {
            return Some(());
        }
    }
}

/// What the reading thread hands on.
enum Piece<K> {
    Begin(K, Result<Capture>),
    /// `None` is the end of a capture.
    Next(Result<Option<Block>>),
}

/// Captures that another thread reads.
pub(super) struct Ahead<K> {
    pieces: Receiver<Piece<K>>,
    /// Blocks whose memory may be used again.
    used: Sender<Block>,
    /// The capture that comes next, where it is known.
    begun: Option<(K, Result<Capture>)>,
}

impl<K: Copy> Ahead<K> {
    /// What the next capture belongs to; `None` behind the last one. What is left of the one before is passed over.
    pub(super) fn coming(&mut self) -> Option<K> {
        while self.begun.is_none() {
            if let Piece::Begin(key, capture) = self.pieces.recv().ok()? {
                self.begun = Some((key, capture));
            }
        }
        self.begun.as_ref().map(|(key, _)| *key)
    }

    /// The next block of the capture that is open.
    fn next(&mut self) -> Result<Option<Block>> {
        match self.pieces.recv() {
            Ok(Piece::Next(next)) => next,
            // The thread is gone.
            _ => Ok(None),
        }
    }

    /// Opens the next capture.
    pub(super) fn open(&mut self) -> Result<Reading<'_, K>> {
        self.coming();
        let none = || Err(Error::new("read", "the recording", "the thread that reads it stopped"));
        let capture = self.begun.take().map_or_else(none, |(_, capture)| capture)?;
        Ok(Reading { capture, ahead: self, ended: false })
    }
}

/// A capture whose blocks another thread reads.
pub(super) struct Reading<'a, K> {
    capture: Capture,
    ahead: &'a mut Ahead<K>,
    ended: bool,
}

impl<K: Copy + Send> SampleStream for Reading<'_, K> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let next = if self.ended { Ok(None) } else { self.ahead.next() };
        // Behind an error comes nothing more.
        self.ended = !matches!(next, Ok(Some(_)));
        let next = next?;
        let emptied = std::mem::replace(block, next.unwrap_or_default());
        // Nobody takes it behind the last capture.
        let _ = self.ahead.used.send(emptied);
        Ok(!self.ended)
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

    fn count(mut stream: impl SampleStream) -> Result<Vec<f64>> {
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
        let captures = [(7, Ok(counting(100, false))), (8, Ok(counting(0, false))), (9, Ok(counting(100, true)))];
        read_ahead(captures.into_iter(), |ahead| {
            assert_eq!(ahead.coming(), Some(7));
            assert_eq!(count(ahead.open().unwrap()).unwrap(), (0..100).map(f64::from).collect::<Vec<_>>());
            assert!(count(ahead.open().unwrap()).unwrap().is_empty());
            assert_eq!(ahead.coming(), Some(9));
            assert!(count(ahead.open().unwrap()).unwrap_err().to_string().contains("gone"));
            assert_eq!(ahead.coming(), None);
        });
    }

    #[test]
    fn captures_that_were_not_opened_or_not_read_to_their_end_are_passed_over() {
        let missing = Err(Error::new("open", "it", "missing"));
        let captures = [(1, Ok(counting(100, false))), (2, missing), (3, Ok(counting(20, false)))];
        read_ahead(captures.into_iter(), |ahead| {
            assert!(ahead.open().unwrap().next_block(&mut Block::default()).unwrap());
            assert!(ahead.open().err().unwrap().to_string().contains("missing"));
            assert_eq!(count(ahead.open().unwrap()).unwrap().len(), 20);
            assert!(ahead.open().is_err(), "there is none");
        });
    }

    #[test]
    fn work_that_stops_early_stops_the_reading() {
        let endless = std::iter::repeat_with(|| ((), Ok(counting(u64::MAX, false))));
        assert!(read_ahead(endless, |ahead| ahead.open()?.next_block(&mut Block::default())).unwrap());
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
