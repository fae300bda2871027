//! The blind benchmark of the closed loop: simulated campaigns with something wrong that the loop is not told of, from below
//! what can be seen to large; two things wrong; nothing wrong; and strangers, which it does not know.

pub mod draw;
pub mod judge;
mod plant;
pub mod report;

use std::sync::{
    Mutex,
    atomic::{AtomicU64, Ordering},
};

use runout_core::{Error, Result};

use draw::Layout;
use judge::Judged;

/// Diagnoses the first `count` campaigns of a seed, of one layout or of all, on as many threads as there are processors.
///
/// # Errors
/// When a campaign cannot be simulated or diagnosed.
pub fn campaigns(count: u64, seed: u64, only: Option<Layout>) -> Result<Vec<Judged>> {
    let workers = std::thread::available_parallelism().map_or(1, std::num::NonZeroUsize::get);
    let next = AtomicU64::new(0);
    let judged = Mutex::new(Vec::new());
    let stopped = || Error::new("diagnose", "campaigns", "a thread stopped");
    std::thread::scope(|scope| {
        let work = || -> Result<()> {
            loop {
                let index = next.fetch_add(1, Ordering::Relaxed);
                if index >= count {
                    return Ok(());
                }
                let one = judge::judge(draw::campaign(seed, index, only)).map_err(|error| {
                    next.store(count, Ordering::Relaxed);
                    Error::new("diagnose", format!("campaign {index} of seed {seed}"), error)
                })?;
                judged.lock().map_err(|_| stopped())?.push(one);
            }
        };
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles.into_iter().try_for_each(|handle| handle.join().unwrap_or_else(|_| Err(stopped())))
    })?;
    let mut judged = judged.into_inner().map_err(|_| stopped())?;
    judged.sort_by_key(|one| one.campaign.index);
    Ok(judged)
}
