//! The blind benchmarks of the closed loop: simulated campaigns with something wrong that is not declared to the loop, from below
//! what can be seen to large; two things wrong; nothing wrong; and unmodelled disturbances, which it does not know.
//!
//! [`draw`], [`judge`] and [`report`] are the spindle's. Measured points share one driver, [`points`]; a domain adds one file to
//! [`domains`].

pub mod domains;
pub mod draw;
pub mod judge;
mod plant;
pub mod points;
pub mod report;

use runout_core::Result;

use crate::each::each;
use draw::Layout;
use judge::Judged;

/// What a campaign is for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// Nothing is wrong.
    Clean,
    /// One effect that the loop knows.
    Single,
    /// Two of them.
    Pair,
    /// Something that it does not know.
    Stranger,
}

/// Twenty campaigns in turn.
const KINDS: [Kind; 20] = {
    use Kind::{Clean, Pair, Single, Stranger};
    [
        Clean, Single, Stranger, Single, Clean, Pair, Single, Stranger, Clean, Single, Single, Clean, Stranger, Single,
        Clean, Pair, Single, Clean, Stranger, Single,
    ]
};

/// What a campaign is for, and how many of its kind came before: each effect and unmodelled disturbance is drawn in turn.
#[must_use]
pub fn turn(index: u64) -> (Kind, usize) {
    let length = KINDS.len() as u64;
    let place = (index % length) as usize;
    let kind = KINDS[place];
    let each = KINDS.iter().filter(|other| **other == kind).count() as u64;
    let before = KINDS[..place].iter().filter(|other| **other == kind).count() as u64;
    (kind, (index / length * each + before) as usize)
}

/// Diagnoses the first `count` campaigns of a seed, of one layout or of all, on as many threads as there are processors.
///
/// # Errors
/// When a campaign cannot be simulated or diagnosed.
pub fn campaigns(count: u64, seed: u64, only: Option<Layout>) -> Result<Vec<Judged>> {
    each(count, seed, |index| judge::judge(draw::campaign(seed, index, only)))
}
