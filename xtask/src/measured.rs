//! Time and memory of another program.

use std::{
    fs,
    process::Command,
    thread,
    time::{Duration, Instant},
};

use crate::process::Outcome;

/// What a program took. Where the system does not report the last two, they are 0.
pub(crate) struct Spent {
    pub seconds: f64,
    pub peak_kb: u64,
    /// User and system time of all threads.
    pub processor_seconds: f64,
}

/// Runs a program from start to end.
pub(crate) fn measured(command: &mut Command) -> Outcome<Spent> {
    let name = command.get_program().display().to_string();
    let start = Instant::now();
    let mut running = command.spawn().map_err(|error| format!("cannot start {name}: {error}"))?;
    let [status_of, times_of] = ["status", "stat"].map(|file| format!("/proc/{}/{file}", running.id()));
    let (mut peak_kb, mut processor_seconds) = (0, 0.0);
    loop {
        let ended = running.try_wait().map_err(|error| format!("cannot wait for {name}: {error}"))?;
        if let Some(status) = ended {
            let spent = Spent { seconds: start.elapsed().as_secs_f64(), peak_kb, processor_seconds };
            return if status.success() { Ok(spent) } else { Err(format!("{name} failed ({status})")) };
        }
        peak_kb = fs::read_to_string(&status_of).ok().and_then(|text| peak(&text)).unwrap_or(peak_kb);
        let busy = fs::read_to_string(&times_of).ok().and_then(|text| processor_time(&text));
        processor_seconds = busy.unwrap_or(processor_seconds);
        thread::sleep(Duration::from_millis(10));
    }
}

/// The largest resident size so far.
fn peak(status: &str) -> Option<u64> {
    let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
    line.trim().strip_suffix("kB")?.trim().parse().ok()
}

/// User and system time of a process, in seconds: fields 14 and 15, which Linux counts in hundredths of a second.
fn processor_time(stat: &str) -> Option<f64> {
    // The program's name, in brackets, may hold blanks.
    let (_, fields) = stat.rsplit_once(')')?;
    let ticks: Vec<f64> = fields.split_whitespace().skip(11).take(2).filter_map(|ticks| ticks.parse().ok()).collect();
    (ticks.len() == 2).then(|| ticks.iter().sum::<f64>() / 100.0)
}

#[cfg(test)]
mod tests {
    use super::processor_time;

    #[test]
    fn user_and_system_time_are_read_behind_any_name() {
        let stat = "4242 (a ) b) R 1 4242 1 0 -1 4194560 500 0 0 0 321 54 0 0 20 0 3 0 100 1 1";
        assert_eq!(processor_time(stat), Some(3.75));
        assert_eq!(processor_time("4242 (a"), None);
    }
}
