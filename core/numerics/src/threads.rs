//! Work side by side, or on one thread where others have work of their own.

use std::{
    cell::Cell,
    num::NonZero,
    panic::resume_unwind,
    sync::{
        LazyLock,
        atomic::{AtomicUsize, Ordering},
    },
    thread::{ScopedJoinHandle, available_parallelism, scope},
};

static PROCESSORS: LazyLock<usize> = LazyLock::new(|| available_parallelism().map_or(1, NonZero::get));

thread_local! {
    static ALONE: Cell<bool> = const { Cell::new(false) };
}

/// Does work of which [`both`], [`each`] and [`spread`] leave all parts on this thread: the others have recordings of their own.
pub fn alone<T>(work: impl FnOnce() -> T) -> T {
    /// Also after a panic.
    struct Before(bool);
    impl Drop for Before {
        fn drop(&mut self) {
            ALONE.set(self.0);
        }
    }
    let _before = Before(ALONE.replace(true));
    work()
}

/// Whether this thread does all its work alone.
fn is_alone() -> bool {
    ALONE.get()
}

/// Does two pieces of work at once: the first on a thread of its own. A panic in it goes on here.
pub fn both<A: Send, B>(other: impl FnOnce() -> A + Send, here: impl FnOnce() -> B) -> (A, B) {
    if is_alone() {
        return (other(), here());
    }
    scope(|scope| {
        let other = scope.spawn(other);
        let here = here();
        (joined(other), here)
    })
}

/// Does the same with each item, all at once; what comes of it is in their order. A panic goes on here.
pub fn each<I: Send, T: Send>(items: impl IntoIterator<Item = I>, work: impl Fn(I) -> T + Sync) -> Vec<T> {
    if is_alone() {
        return items.into_iter().map(work).collect();
    }
    scope(|scope| {
        let work = &work;
        let begun: Vec<_> = items.into_iter().map(|item| scope.spawn(move || work(item))).collect();
        begun.into_iter().map(joined).collect()
    })
}

/// Does the same with each of many items, one after the other on a thread for each processor; what comes of it is in their order. All is done on this
/// thread where there are fewer than `fewest`: a thread takes as long to begin as a short piece of work.
pub fn spread<I: Sync, T: Send>(items: &[I], fewest: usize, work: impl Fn(&I) -> T + Sync) -> Vec<T> {
    if is_alone() || *PROCESSORS == 1 || items.len() < fewest.max(2) {
        return items.iter().map(work).collect();
    }
    let next = AtomicUsize::new(0);
    let worker = |_| {
        alone(|| {
            let mut done = Vec::new();
            loop {
                let place = next.fetch_add(1, Ordering::Relaxed);
                let Some(item) = items.get(place) else { break done };
                done.push((place, work(item)));
            }
        })
    };
    let mut done: Vec<(usize, T)> = each(0..items.len().min(*PROCESSORS), worker).into_iter().flatten().collect();
    done.sort_unstable_by_key(|(place, _)| *place);
    done.into_iter().map(|(_, one)| one).collect()
}

fn joined<T>(thread: ScopedJoinHandle<T>) -> T {
    thread.join().unwrap_or_else(|panic| resume_unwind(panic))
}

#[cfg(test)]
mod tests {
    use std::{panic::catch_unwind, thread::current};

    use super::*;

    #[test]
    fn alone_all_is_done_on_one_thread_and_elsewhere_is_not() {
        let here = current().id();
        let ids = || both(|| current().id(), || current().id());
        assert_eq!(alone(ids), (here, here));
        assert!(alone(|| each([1, 2], |item| (item, current().id()))) == [(1, here), (2, here)]);
        let panicked = catch_unwind(|| alone(|| panic!("stops")));
        assert!(panicked.is_err() && !is_alone());
        let (other, own) = ids();
        assert!(other != here && own == here);
        assert_eq!(each(0..5, |item| 2 * item), [0, 2, 4, 6, 8]);
        let many: Vec<usize> = (0..101).collect();
        assert_eq!(spread(&many, 2, |item| *item), many);
        assert!(alone(|| spread(&many, 2, |_| current().id())).iter().all(|id| *id == here));
    }
}
