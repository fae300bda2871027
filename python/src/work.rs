//! Work beside the interpreter: without its lock, with progress, and stopped by Ctrl-C.

use std::{
    panic::{AssertUnwindSafe, catch_unwind},
    sync::{
        Arc, Mutex, PoisonError,
        atomic::{AtomicBool, Ordering},
        mpsc::{Receiver, RecvTimeoutError, Sender, channel},
    },
    time::{Duration, Instant},
};

use pyo3::prelude::*;
use runout_cli::Failure;
use runout_core::pipeline::run::Observer;

use crate::failure::{exception, fault};

/// How often signals are asked for.
const SIGNALS: Duration = Duration::from_millis(50);
/// How long interrupted work may take to end. What takes longer goes on unseen, and writes nothing.
const GRACE: Duration = Duration::from_secs(2);
/// The stack of a program's first thread.
const STACK_BYTES: usize = 8 << 20;

/// Whether work is to stop, and what Python code in it raised.
#[derive(Debug, Clone, Default)]
pub(crate) struct Stop(Arc<State>);

#[derive(Debug, Default)]
struct State {
    is_set: AtomicBool,
    raised: Mutex<Option<PyErr>>,
}

impl Stop {
    /// Whether it is.
    pub(crate) fn is_set(&self) -> bool {
        self.0.is_set.load(Ordering::Relaxed)
    }

    fn set(&self) {
        self.0.is_set.store(true, Ordering::Relaxed);
    }

    /// Stops because of an exception; the first of several is the one that the call raises.
    pub(crate) fn raise(&self, error: PyErr) {
        self.0.raised.lock().unwrap_or_else(PoisonError::into_inner).get_or_insert(error);
        self.set();
    }

    fn take_raised(&self) -> Option<PyErr> {
        self.0.raised.lock().unwrap_or_else(PoisonError::into_inner).take()
    }
}

enum Event<T> {
    Begin(usize),
    Done(String),
    End(Result<T, Failure>),
}

/// Watches work, for the callback.
pub(crate) struct Watch<T> {
    events: Sender<Event<T>>,
}

impl<T: Send> Observer for Watch<T> {
    // Where nobody listens any more, the work was given up.
    fn begin(&self, stations: usize) {
        let _ = self.events.send(Event::Begin(stations));
    }

    fn station(&self, name: &str) {
        let _ = self.events.send(Event::Done(name.to_owned()));
    }
}

/// Does work on a thread of its own, and calls `progress(done, of, name)` on this one.
///
/// # Errors
/// When the work fails, the callback or a plugin raises, or Python was interrupted.
pub(crate) fn watched<T: Send + 'static>(
    py: Python<'_>,
    progress: Option<&Bound<'_, PyAny>>,
    stop: &Stop,
    work: impl FnOnce(&Watch<T>) -> Result<T, Failure> + Send + 'static,
) -> PyResult<T> {
    let (events, receiver) = channel();
    // Nobody else takes it: only a Mutex may be looked at without the interpreter's lock.
    let receiver = Mutex::new(receiver);
    let worker = move || {
        let watch = Watch { events };
        if let Ok(outcome) = catch_unwind(AssertUnwindSafe(|| work(&watch))) {
            let _ = watch.events.send(Event::End(outcome));
        }
    };
    std::thread::Builder::new().name("runout".into()).stack_size(STACK_BYTES).spawn(worker)?;
    let (mut done, mut of) = (0, 0);
    loop {
        let event = next(py, &receiver, SIGNALS);
        // What a plugin raised explains any failure of the work.
        let ended = matches!(event, Ok(Some(Event::End(_))) | Err(_));
        let outcome = match (stop.take_raised(), event) {
            (Some(error), _) if ended => return Err(error),
            (Some(error), _) => Err(error),
            (None, event) => match event? {
                Some(Event::End(outcome)) => return outcome.map_err(|failure| exception(py, &failure)),
                Some(Event::Begin(count)) => {
                    of = count;
                    Ok(())
                }
                Some(Event::Done(name)) => {
                    done += 1;
                    progress.map_or(Ok(()), |progress| progress.call1((done, of, name)).map(drop))
                }
                None => Ok(()),
            },
        };
        if let Err(error) = outcome.and_then(|()| py.check_signals()) {
            stop.set();
            let until = Instant::now() + GRACE;
            while Instant::now() < until {
                if let Ok(Some(Event::End(_))) | Err(_) = next(py, &receiver, SIGNALS) {
                    break;
                }
            }
            return Err(error);
        }
    }
}

/// The next event; `None` where there is none for a while.
fn next<T: Send>(py: Python<'_>, receiver: &Mutex<Receiver<Event<T>>>, wait: Duration) -> PyResult<Option<Event<T>>> {
    let received = py.detach(|| receiver.lock().unwrap_or_else(PoisonError::into_inner).recv_timeout(wait));
    match received {
        Ok(event) => Ok(Some(event)),
        Err(RecvTimeoutError::Timeout) => Ok(None),
        Err(RecvTimeoutError::Disconnected) => Err(fault("the work ended without a result")),
    }
}
