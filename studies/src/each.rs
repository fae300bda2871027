//! Many campaigns on all processors.

use std::sync::{
    Mutex,
    atomic::{AtomicU64, Ordering},
};

use runout_core::{Error, Result};

/// Judges campaigns in their order, on as many threads as there are processors.
///
/// # Errors
/// The first of a campaign.
pub fn each<T: Send>(count: u64, seed: u64, judge: impl Fn(u64) -> Result<T> + Sync) -> Result<Vec<T>> {
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
                let one = judge(index).map_err(|error| {
                    next.store(count, Ordering::Relaxed);
                    Error::caused("diagnose", format!("campaign {index} of seed {seed}"), error)
                })?;
                judged.lock().map_err(|_| stopped())?.push((index, one));
            }
        };
        let handles: Vec<_> = (0..workers).map(|_| scope.spawn(work)).collect();
        handles.into_iter().try_for_each(|handle| handle.join().unwrap_or_else(|_| Err(stopped())))
    })?;
    let mut judged = judged.into_inner().map_err(|_| stopped())?;
    judged.sort_by_key(|(index, _)| *index);
    Ok(judged.into_iter().map(|(_, one)| one).collect())
}
