//! What the averaging of turns does not wait for: captures are read ahead of it, stations worked on behind it and results written behind that, each
//! by a thread of its own.

use std::{
    collections::VecDeque,
    sync::mpsc::{Receiver, Sender, SyncSender, channel, sync_channel},
    thread,
};

use runout_error::{Error, ErrorKind, Result};
use runout_turning::measurement::{Block, Capture, SampleStream};

/// Batches that were read and wait: what a station's captures take while the one before is separated.
const AHEAD: usize = 6;
/// Samples in a batch, at least: blocks are small, so that a core's own cache holds them, and threads are to meet seldom.
const BATCH: usize = 1 << 17;
/// Stations that wait to be worked on, and results that wait to be written.
const BEHIND: usize = 1;

/// An opened capture, and what it belongs to.
pub(super) type Opened<'a, K> = (K, Result<Box<dyn SampleStream + 'a>>);

/// Captures to be worked on, one after the other.
pub(super) trait Captures<K> {
    /// What the next capture belongs to; `None` behind the last one. What is left of the one before is passed over.
    fn coming(&mut self) -> Option<K>;

    /// Opens the next capture.
    fn open(&mut self) -> Result<Box<dyn SampleStream + '_>>;
}

/// Does `work` on captures that are read ahead, one after the other: also beyond the end of the one that is worked on.
pub(super) fn read_ahead<'a, K: Copy + Send, R>(
    captures: impl Iterator<Item = Opened<'a, K>> + Send,
    work: impl FnOnce(&mut dyn Captures<K>) -> R,
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

/// Does `work` on captures that it reads itself: where every processor has work of its own, a thread that reads would only
/// carry samples from one to the other.
pub(super) fn read_along<'a, K: Copy, R>(
    captures: impl Iterator<Item = Opened<'a, K>>,
    work: impl FnOnce(&mut dyn Captures<K>) -> R,
) -> R {
    work(&mut Along { captures, begun: None })
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
    let (mut batch, mut samples) = (VecDeque::new(), 0);
    loop {
        let mut block = spare.try_recv().unwrap_or_default();
        let more = stream.next_block(&mut block);
        let last = !matches!(more, Ok(true));
        if !last {
            samples += block.samples.len();
            batch.push_back(block);
        }
        if samples >= BATCH || (last && !batch.is_empty()) {
            to.send(Piece::Blocks(std::mem::take(&mut batch))).ok()?;
            samples = 0;
        }
        if last {
            return to.send(Piece::End(more.map(|_| ()))).ok();
        }
    }
}

/// What the reading thread hands on.
#[allow(clippy::large_enum_variant, reason = "one capture stands among many blocks")]
enum Piece<K> {
    Begin(K, Result<Capture>),
    /// Some blocks of the capture.
    Blocks(VecDeque<Block>),
    /// Its end, or why there is no more of it.
    End(Result<()>),
}

/// Captures that are read as they are wanted.
struct Along<'a, K, I> {
    captures: I,
    /// The capture that comes next, where it is known.
    begun: Option<Opened<'a, K>>,
}

impl<'a, K: Copy, I: Iterator<Item = Opened<'a, K>>> Captures<K> for Along<'a, K, I> {
    fn coming(&mut self) -> Option<K> {
        if self.begun.is_none() {
            self.begun = self.captures.next();
        }
        self.begun.as_ref().map(|(key, _)| *key)
    }

    fn open(&mut self) -> Result<Box<dyn SampleStream + '_>> {
        self.coming();
        let none = || Err(Error::new("read", "the recording", "it has no further capture"));
        self.begun.take().map_or_else(none, |(_, opened)| opened)
    }
}

/// Captures that another thread reads.
struct Ahead<K> {
    pieces: Receiver<Piece<K>>,
    /// Blocks whose memory may be used again.
    used: Sender<Block>,
    /// The capture that comes next, where it is known.
    begun: Option<(K, Result<Capture>)>,
}

impl<K: Copy + Send> Captures<K> for Ahead<K> {
    fn coming(&mut self) -> Option<K> {
        while self.begun.is_none() {
            if let Piece::Begin(key, capture) = self.pieces.recv().ok()? {
                self.begun = Some((key, capture));
            }
        }
        self.begun.as_ref().map(|(key, _)| *key)
    }

    fn open(&mut self) -> Result<Box<dyn SampleStream + '_>> {
        self.coming();
        let none =
            || Err(Error::new("read", "the recording", "the thread that reads it stopped").of(ErrorKind::Interrupted));
        let capture = self.begun.take().map_or_else(none, |(_, capture)| capture)?;
        Ok(Box::new(Reading { capture, ahead: self, blocks: VecDeque::new(), ended: false }))
    }
}

/// A capture whose blocks another thread reads.
struct Reading<'a, K> {
    capture: Capture,
    ahead: &'a mut Ahead<K>,
    /// Those that came and were not asked for yet.
    blocks: VecDeque<Block>,
    ended: bool,
}

impl<K> Reading<'_, K> {
    /// The next block; `None` at the capture's end, and behind an error.
    fn next(&mut self) -> Result<Option<Block>> {
        while self.blocks.is_empty() && !self.ended {
            match self.ahead.pieces.recv() {
                Ok(Piece::Blocks(blocks)) => self.blocks = blocks,
                Ok(Piece::End(end)) => {
                    self.ended = true;
                    end?;
                }
                // The thread is gone.
                _ => self.ended = true,
            }
        }
        Ok(self.blocks.pop_front())
    }
}

impl<K: Copy + Send> SampleStream for Reading<'_, K> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let next = self.next()?;
        let more = next.is_some();
        let emptied = std::mem::replace(block, next.unwrap_or_default());
        // Nobody takes it behind the last capture.
        let _ = self.ahead.used.send(emptied);
        Ok(more)
    }
}

/// Does `work`, and `then` on another thread with each item that it hands on, in the same order. Handing on is false where that thread has
/// stopped, by a panic that goes on here.
pub(super) fn work_behind<T: Send>(then: impl FnMut(T) + Send, work: impl FnOnce(&mut dyn FnMut(T) -> bool)) {
    let (sender, items) = sync_channel(BEHIND);
    thread::scope(|scope| {
        scope.spawn(move || items.into_iter().for_each(then));
        work(&mut |item| sender.send(item).is_ok());
        // The thread waits for more.
        drop(sender);
    });
}

/// Does `work`, and `take`s in the same order on another thread what it hands on.
pub(super) fn write_behind<T: Send, R>(
    mut take: impl FnMut(T) -> Result<()> + Send,
    work: impl FnOnce(&(dyn Fn(T) -> Result<()> + Sync)) -> Result<R>,
) -> Result<R> {
    let (sender, results) = sync_channel(BEHIND);
    let stopped = |operation| {
        Error::new(operation, "the results", "the thread that writes them stopped").of(ErrorKind::Interrupted)
    };
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
            marks_within_samples: 0.0,
            encoder: false,
            trimmed: Vec::new(),
            responses: Vec::new(),
        };
        Box::new(Counting { capture, next: 0, last, fails })
    }

    fn count(mut stream: Box<dyn SampleStream + '_>) -> Result<Vec<f64>> {
        let (mut found, mut block) = (Vec::new(), Block::default());
        while stream.next_block(&mut block)? {
            assert_eq!(block.start as usize, found.len());
            found.append(&mut block.samples);
        }
        assert!(block.samples.is_empty() && !stream.next_block(&mut block)?);
        Ok(found)
    }

    /// Captures that are read ahead, and the same that are read along.
    fn both_ways<'a>(captures: impl Fn() -> Vec<Opened<'a, i32>>, work: impl Fn(&mut dyn Captures<i32>)) {
        read_ahead(captures().into_iter(), &work);
        read_along(captures().into_iter(), &work);
    }

    #[test]
    fn blocks_come_in_order_and_end_as_the_input_does() {
        let captures =
            || vec![(7, Ok(counting(100, false))), (8, Ok(counting(0, false))), (9, Ok(counting(100, true)))];
        both_ways(captures, |captures| {
            assert_eq!(captures.coming(), Some(7));
            assert_eq!(count(captures.open().unwrap()).unwrap(), (0..100).map(f64::from).collect::<Vec<_>>());
            assert!(count(captures.open().unwrap()).unwrap().is_empty());
            assert_eq!(captures.coming(), Some(9));
            assert!(count(captures.open().unwrap()).unwrap_err().to_string().contains("gone"));
            assert_eq!(captures.coming(), None);
        });
    }

    #[test]
    fn captures_that_were_not_opened_or_not_read_to_their_end_are_passed_over() {
        let missing = || Err(Error::new("open", "it", "missing"));
        let captures = || vec![(1, Ok(counting(100, false))), (2, missing()), (3, Ok(counting(20, false)))];
        both_ways(captures, |captures| {
            assert!(captures.open().unwrap().next_block(&mut Block::default()).unwrap());
            assert!(captures.open().err().unwrap().to_string().contains("missing"));
            assert_eq!(count(captures.open().unwrap()).unwrap().len(), 20);
            assert!(captures.open().is_err(), "there is none");
        });
    }

    #[test]
    fn work_that_stops_early_stops_the_reading() {
        let endless = std::iter::repeat_with(|| ((), Ok(counting(u64::MAX, false))));
        assert!(read_ahead(endless, |captures| captures.open()?.next_block(&mut Block::default())).unwrap());
    }

    #[test]
    fn stations_are_worked_on_in_order_and_a_panic_stops_the_averaging() {
        let mut done = Vec::new();
        work_behind(|number| done.push(number), |hand_on| assert!((0..100).all(hand_on)));
        assert_eq!(done, (0..100).collect::<Vec<_>>());
        let endless =
            |hand_on: &mut dyn FnMut(u64) -> bool| assert!((0..u64::MAX).position(|number| !hand_on(number)).is_some());
        let panicked = std::panic::catch_unwind(|| work_behind(|number| assert!(number < 7), endless));
        assert!(panicked.is_err());
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
