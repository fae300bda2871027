//! Results that come in any order and are taken in their own.

use std::{
    collections::BTreeMap,
    sync::{Condvar, Mutex, PoisonError},
};

use runout_error::Result;

/// Results by which one may be ahead of the next that is to be taken, before its worker waits.
const LEAD: usize = 2;

/// Where workers hand on their results.
pub(super) struct OrderedCollector<T, F> {
    state: Mutex<State<T, F>>,
    moved: Condvar,
}

struct State<T, F> {
    /// The result that is taken next.
    next: usize,
    /// Those that came before their turn.
    early: BTreeMap<usize, Result<T>>,
    take: F,
    outcome: Result<()>,
}

impl<T, F: FnMut(usize, T) -> Result<()>> OrderedCollector<T, F> {
    /// Results are numbered from 0.
    pub(super) fn new(take: F) -> Self {
        let state = State { next: 0, early: BTreeMap::new(), take, outcome: Ok(()) };
        Self { state: Mutex::new(state), moved: Condvar::new() }
    }

    /// Hands on a result; waits while it is too far ahead of the others. False behind a failure, the first in order: then
    /// nothing more is taken.
    pub(super) fn pass(&self, number: usize, result: Result<T>) -> bool {
        let mut guard = self.state.lock().unwrap_or_else(PoisonError::into_inner);
        let state = &mut *guard;
        state.early.insert(number, result);
        while let Some(result) = state.early.remove(&state.next) {
            if state.outcome.is_ok() {
                state.outcome = result.and_then(|result| (state.take)(state.next, result));
            }
            state.next += 1;
        }
        self.moved.notify_all();
        let ahead = |state: &mut State<T, F>| state.outcome.is_ok() && number >= state.next + LEAD;
        let guard = self.moved.wait_while(guard, ahead).unwrap_or_else(PoisonError::into_inner);
        guard.outcome.is_ok()
    }

    /// How it ended.
    pub(super) fn outcome(self) -> Result<()> {
        self.state.into_inner().unwrap_or_else(PoisonError::into_inner).outcome
    }
}

#[cfg(test)]
mod tests {
    use std::{
        sync::atomic::{AtomicUsize, Ordering},
        thread,
        time::Duration,
    };

    use super::*;
    use runout_error::Error;

    const COUNT: usize = 60;

    /// Three workers of different speed; what was taken, the farthest lead, and the outcome.
    fn run(fails: Option<usize>) -> (Vec<usize>, usize, Result<()>) {
        let (mut taken, claimed, done) = (Vec::new(), AtomicUsize::new(0), AtomicUsize::new(0));
        let farthest = AtomicUsize::new(0);
        let ordered_collector = OrderedCollector::new(|number, result: usize| {
            assert_eq!(number, result);
            done.store(number + 1, Ordering::SeqCst);
            taken.push(result);
            Ok(())
        });
        thread::scope(|scope| {
            for worker in 0..3 {
                let (ordered_collector, claimed, done, farthest) = (&ordered_collector, &claimed, &done, &farthest);
                scope.spawn(move || {
                    loop {
                        let number = claimed.fetch_add(1, Ordering::SeqCst);
                        if number >= COUNT {
                            return;
                        }
                        farthest.fetch_max(number.saturating_sub(done.load(Ordering::SeqCst)), Ordering::SeqCst);
                        thread::sleep(Duration::from_micros(200 * worker));
                        let failed = fails.is_some_and(|first| number >= first);
                        let result =
                            if failed { Err(Error::new("work", number.to_string(), "it failed")) } else { Ok(number) };
                        if !ordered_collector.pass(number, result) {
                            return;
                        }
                    }
                });
            }
        });
        let outcome = ordered_collector.outcome();
        (taken, farthest.into_inner(), outcome)
    }

    #[test]
    fn results_are_taken_in_order_and_nobody_runs_away() {
        let (taken, farthest, outcome) = run(None);
        assert_eq!(taken, (0..COUNT).collect::<Vec<_>>());
        // Behind the lead, every worker may have one under way.
        assert!(farthest <= LEAD + 3, "{farthest}");
        assert!(outcome.is_ok());
    }

    #[test]
    fn the_first_failure_in_order_is_the_outcome() {
        let (taken, _, outcome) = run(Some(17));
        assert_eq!(taken, (0..17).collect::<Vec<_>>());
        assert!(outcome.is_err_and(|error| error.to_string().contains("17")));
    }
}
