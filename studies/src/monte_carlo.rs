//! Monte Carlo: how long many campaigns take to be simulated, separated and scored, on one thread and on more. Four sensors,
//! three setups, 512 × 60 turns a capture.

use std::{
    fmt::Write,
    sync::atomic::{AtomicU64, Ordering},
    thread,
    time::Instant,
};

use runout_core::{Error, Result};
use runout_spindle::{
    separators::{HarmonicLeastSquares, Weighting},
    simulate::simulator,
};

use crate::campaign::{self, reference};

/// Orders that the score uses.
const ORDERS: std::ops::RangeInclusive<usize> = 2..=100;

/// All campaigns on so many threads.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// Threads.
    pub threads: usize,
    /// Wall clock.
    pub seconds: f64,
    /// Form's rms error over orders 2 to 100, in µm: median and worst of the campaigns.
    pub form_error_um: [f64; 2],
}

/// Runs the campaigns of seeds 0, 1, … on each of these numbers of threads.
///
/// # Errors
/// When a campaign cannot be made or separated.
pub fn rows(campaigns: u64, threads: &[usize]) -> Result<Vec<Row>> {
    threads.iter().map(|threads| row(campaigns, *threads)).collect()
}

fn row(campaigns: u64, threads: usize) -> Result<Row> {
    let next = AtomicU64::new(0);
    let worker = || -> Result<Vec<f64>> {
        let mut errors = Vec::new();
        loop {
            let seed = next.fetch_add(1, Ordering::Relaxed);
            if seed >= campaigns {
                return Ok(errors);
            }
            errors.push(scored(seed)?);
        }
    };
    let start = Instant::now();
    let errors = thread::scope(|scope| {
        let workers: Vec<_> = (0..threads).map(|_| scope.spawn(worker)).collect();
        let stopped = || Err(Error::new("simulate", "campaigns", "a thread stopped"));
        workers.into_iter().map(|worker| worker.join().unwrap_or_else(|_| stopped())).collect::<Result<Vec<_>>>()
    })?;
    let seconds = start.elapsed().as_secs_f64();
    let mut errors = errors.concat();
    errors.sort_by(f64::total_cmp);
    let at = |place: usize| errors.get(place).copied().unwrap_or(f64::NAN);
    Ok(Row { threads, seconds, form_error_um: [at(errors.len() / 2), at(errors.len().saturating_sub(1))] })
}

/// One campaign's error of form.
fn scored(seed: u64) -> Result<f64> {
    let config = reference(seed, 8.0);
    let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
    let simulator = simulator(&config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let [samples, turns] = [config.recording.samples_per_rev, config.recording.revolutions];
    let (station, truth) = campaign::station(&simulator, &rig, samples, turns)?;
    let separator = HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance);
    Ok(campaign::separate(&station, &truth, &separator)?.form_error_um(ORDERS))
}

/// As Markdown.
#[must_use]
pub fn table(campaigns: u64, rows: &[Row]) -> String {
    let mut text = format!(
        "{campaigns} campaigns\n\n| threads | s | campaigns a second | times as fast | form, rms error µm: median, worst |\n\
         | --- | --- | --- | --- | --- |\n"
    );
    let first = rows.first().map_or(f64::NAN, |row| row.seconds);
    for Row { threads, seconds, form_error_um: [median, worst] } in rows {
        let (rate, scaling) = (campaigns as f64 / seconds, first / seconds);
        let _ = writeln!(text, "| {threads} | {seconds:.1} | {rate:.0} | {scaling:.2} | {median:.4}, {worst:.4} |");
    }
    text
}
