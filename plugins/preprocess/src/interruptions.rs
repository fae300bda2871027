//! Raw readings where the part's surface is interrupted, bridged before a filter or an interpolation spreads them.
//!
//! A sensor over a keyway reads hundreds of micrometres beside the form. What is computed from several samples (a low-pass,
//! a value between two samples) takes that to angles beside the keyway. These readings are therefore replaced, in each turn
//! of each channel, by a cubic polynomial through the readings on both sides (least squares) and a straight line over what
//! it leaves at both ends. The bridge is continuous and as smooth as eccentricity and low orders are. It carries no
//! information: the average bridges the same angles once more by its own harmonics, and every value leaves them out.

use std::{collections::VecDeque, f64::consts::TAU, ops::Range};

use runout_core::{
    Complex64, Result,
    measurement::{Block, Capture, Defect, SampleStream},
    numerics::least_squares::PivotedQr,
    rig::{Gaps, Rig},
};

/// Samples on each side of an interruption that are bridged with it: marks and edges are known to about a sample.
pub(crate) const GUARD: usize = 1;
/// Samples on each side of a bridge that it is fitted to, at least.
const FEWEST_BESIDE: usize = 8;
/// Coefficients of the polynomial.
const TERMS: usize = 4;
/// Samples at each end that the bridge meets in the mean.
const MET: usize = 2;

/// The rig, where the part's surface is interrupted somewhere.
pub(crate) fn interrupted(rig: Option<&Rig>) -> Option<Rig> {
    rig.filter(|rig| rig.gaps.iter().any(|gaps| !gaps.is_empty())).cloned()
}

/// A stream with the interruptions of the part's surface bridged; the stream itself where no sensor sees one, and where
/// nothing gives the spindle's angle.
pub(crate) fn bridged<'a>(input: Box<dyn SampleStream + 'a>, rig: Option<&Rig>) -> Box<dyn SampleStream + 'a> {
    let Some(rig) = rig else { return input };
    let capture = input.capture();
    let gaps: Vec<Gaps> = capture.sensors.iter().map(|sensor| rig.gaps_seen(capture.setup, *sensor)).collect();
    if gaps.iter().all(Gaps::is_empty) || capture.median_turn_samples().is_none() {
        return input;
    }
    let runs: Vec<VecDeque<Range<usize>>> = if capture.encoder {
        vec![VecDeque::new(); gaps.len()]
    } else {
        gaps.iter().map(|gaps| runs(gaps, &capture.marks, capture.samples)).collect()
    };
    let longest_turn = capture.marks.windows(2).map(|pair| pair[1] - pair[0]).fold(0.0, f64::max);
    let longest_gap = gaps.iter().map(Gaps::longest_rad).fold(0.0, f64::max);
    Box::new(Bridged {
        most_beside: (0.5 * longest_gap / TAU * longest_turn) as usize + FEWEST_BESIDE,
        beyond: vec![0; gaps.len()],
        open: vec![None; gaps.len()],
        crossed: vec![VecDeque::new(); gaps.len()],
        runs,
        gaps,
        input,
        raw: Block::default(),
        frames: Vec::new(),
        angle_rev: Vec::new(),
        defects: Vec::new(),
        first: 0,
        handed_on: 0,
        ended: false,
    })
}

/// The samples of one channel inside its interruptions, from the marks: ascending, none overlapping.
fn runs(gaps: &Gaps, marks: &[f64], samples: u64) -> VecDeque<Range<usize>> {
    let (Some([first, second]), Some([before, last])) = (marks.first_chunk(), marks.last_chunk()) else {
        return VecDeque::new();
    };
    // Whole turns before the first mark and behind the last one, as far as samples go.
    let ahead = (1..).map(|turn| first - f64::from(turn) * (second - first)).take_while(|mark| *mark > first - second);
    let ahead = ahead.take(1).map(|mark| [mark, mark + (second - first)]);
    let behind = [[*last, last + (last - before)]];
    let turns = ahead.chain(marks.windows(2).map(|pair| [pair[0], pair[1]])).chain(behind);
    let mut found: Vec<Range<usize>> = Vec::new();
    for [start, end] in turns {
        for [from_rad, length_rad] in gaps.stretches() {
            let place = |angle_rad: f64| start + angle_rad / TAU * (end - start);
            let from = (place(from_rad).ceil() - GUARD as f64).max(0.0);
            let to = (place(from_rad + length_rad).floor() + GUARD as f64 + 1.0).min(samples as f64);
            if to > from {
                found.push(from as usize..to as usize);
            }
            // One that passes through 0 begins in the turn before this one, or ends in the one behind.
            let to = (place(from_rad + length_rad - TAU).floor() + GUARD as f64 + 1.0).min(samples as f64);
            if from_rad + length_rad > TAU && to > start.max(0.0) {
                found.push(start.max(0.0) as usize..to as usize);
            }
        }
    }
    found.sort_by_key(|run| run.start);
    let mut joined: VecDeque<Range<usize>> = VecDeque::new();
    for run in found {
        match joined.back_mut() {
            Some(last) if run.start <= last.end => last.end = last.end.max(run.end),
            _ => joined.push_back(run),
        }
    }
    joined
}

struct Bridged<'a> {
    input: Box<dyn SampleStream + 'a>,
    /// Of each channel, by the spindle's angle.
    gaps: Vec<Gaps>,
    /// Of each channel, those that are known and not bridged.
    runs: Vec<VecDeque<Range<usize>>>,
    /// Of each channel, those that are bridged and not handed on.
    crossed: Vec<VecDeque<Range<usize>>>,
    /// Of each channel, the end of the last run that was bridged.
    beyond: Vec<usize>,
    /// With an encoder, where the run began of which the end is not read.
    open: Vec<Option<usize>>,
    /// Samples on each side of a bridge that it is fitted to, at most.
    most_beside: usize,
    raw: Block,
    /// `[sample][channel]` from the sample `first` on.
    frames: Vec<f64>,
    angle_rev: Vec<f64>,
    defects: Vec<Defect>,
    first: usize,
    /// All samples before this one.
    handed_on: usize,
    ended: bool,
}

impl Bridged<'_> {
    /// Behind the last sample that was read.
    fn end(&self) -> usize {
        self.first + self.frames.len() / self.gaps.len().max(1)
    }

    /// Takes the block in `raw`.
    fn take(&mut self) {
        if self.frames.is_empty() {
            self.first = self.raw.start as usize;
            self.handed_on = self.first;
        }
        let read = self.end();
        self.frames.append(&mut self.raw.samples);
        for (index, angle_rev) in self.raw.angle_rev.iter().enumerate() {
            for (channel, gaps) in self.gaps.iter().enumerate() {
                let inside = gaps.hold(TAU * angle_rev.rem_euclid(1.0));
                match self.open[channel] {
                    None if inside => self.open[channel] = Some((read + index).saturating_sub(GUARD)),
                    Some(start) if !inside => {
                        self.open[channel] = None;
                        add(&mut self.runs[channel], start..read + index + GUARD);
                    }
                    _ => {}
                }
            }
        }
        self.angle_rev.append(&mut self.raw.angle_rev);
        let end = self.end();
        for defect in self.raw.defects.drain(..) {
            let known = self.runs.get(defect.channel).into_iter().chain(self.crossed.get(defect.channel)).flatten();
            let open = self.open.get(defect.channel).copied().flatten().map(|start| start..end);
            let holds =
                |run: Range<usize>| run.start as u64 <= defect.samples.start && defect.samples.end <= run.end as u64;
            if !known.cloned().chain(open).any(holds) {
                self.defects.push(defect);
            }
        }
    }

    /// Closes what the end of the capture leaves open.
    fn finish(&mut self) {
        self.ended = true;
        let end = self.end();
        for (open, runs) in self.open.iter_mut().zip(&mut self.runs) {
            if let Some(start) = open.take() {
                add(runs, start..end);
            }
        }
    }

    /// Bridges every run of which enough is read.
    fn cross(&mut self) {
        let end = self.end();
        for channel in 0..self.gaps.len() {
            while let Some(run) = self.runs[channel].front().cloned() {
                let beside = (run.len() / 2 + FEWEST_BESIDE).min(self.most_beside);
                let next = self.runs[channel].get(1).map_or(usize::MAX, |next| next.start);
                let upto = (run.end + beside).min(next);
                if upto > end && !self.ended {
                    break;
                }
                self.runs[channel].pop_front();
                let within = run.start.clamp(self.first, end)..run.end.clamp(self.first, end);
                let from = run.start.saturating_sub(beside).max(self.beyond[channel]).max(self.first);
                if !within.is_empty() {
                    self.bridge(channel, &within, from.min(within.start), upto.clamp(within.end, end));
                }
                self.beyond[channel] = run.end;
                self.crossed[channel].push_back(run);
            }
        }
    }

    /// Bridges one run of a channel by the readings from `from` and up to `upto`.
    fn bridge(&mut self, channel: usize, run: &Range<usize>, from: usize, upto: usize) {
        let (channels, first) = (self.gaps.len(), self.first);
        let at = |sample: usize| (sample - first) * channels + channel;
        let middle = 0.5 * (run.start + run.end) as f64;
        let place = |sample: usize| (sample as f64 + 0.5 - middle) / (0.5 * run.len() as f64);
        let beside = [from..run.start, run.end..upto];
        let read = |samples: Range<usize>| -> Vec<[f64; 2]> {
            let each = samples.map(|sample| [place(sample), self.frames[at(sample)]]);
            each.filter(|[_, reading]| reading.is_finite()).collect()
        };
        let [left, right] = beside.map(read);
        let both: Vec<[f64; 2]> = left.iter().chain(&right).copied().collect();
        let cubic = if left.len() < TERMS || right.len() < TERMS { [0.0; TERMS] } else { polynomial(&both) };
        let leaves = |[place, reading]: &[f64; 2]| reading - value(&cubic, *place);
        // Mean place of some readings, and mean of their residual.
        let mean = |ends: &[[f64; 2]]| {
            let count = ends.len() as f64;
            let of = |each: &dyn Fn(&[f64; 2]) -> f64| ends.iter().map(each).sum::<f64>() / count;
            (!ends.is_empty()).then(|| [of(&|end| end[0]), of(&leaves)])
        };
        let ends = [mean(&left[left.len().saturating_sub(MET)..]), mean(&right[..right.len().min(MET)])];
        let line: Box<dyn Fn(f64) -> f64> = match ends {
            [Some(left), Some(right)] => {
                let slope = (right[1] - left[1]) / (right[0] - left[0]);
                Box::new(move |place| left[1] + slope * (place - left[0]))
            }
            [Some(end), None] | [None, Some(end)] => Box::new(move |_| end[1]),
            [None, None] => return,
        };
        for sample in run.clone() {
            self.frames[at(sample)] = value(&cubic, place(sample)) + line(place(sample));
        }
    }

    /// Up to where nothing changes any more.
    fn ready(&self) -> usize {
        if self.ended {
            return self.end();
        }
        // With an encoder, the next sample may be the first inside.
        let held_back = if self.input.capture().encoder { GUARD } else { 0 };
        let known = self.end().saturating_sub(held_back);
        let waiting = self.runs.iter().filter_map(|runs| runs.front()).map(|run| run.start);
        waiting.chain(self.open.iter().copied().flatten()).fold(known, usize::min)
    }

    fn hand_on(&mut self, until: usize, block: &mut Block) {
        let channels = self.gaps.len();
        let range = self.handed_on - self.first..until - self.first;
        block.clear();
        block.start = self.handed_on as u64;
        block.samples.extend_from_slice(&self.frames[range.start * channels..range.end * channels]);
        block.angle_rev.extend_from_slice(self.angle_rev.get(range).unwrap_or_default());
        block.defects.append(&mut self.defects);
        self.handed_on = until;
        for crossed in &mut self.crossed {
            while crossed.front().is_some_and(|run| run.end <= until) {
                crossed.pop_front();
            }
        }
        // What later bridges are fitted to stays.
        let surplus = until.saturating_sub(self.most_beside + GUARD).saturating_sub(self.first);
        if 2 * surplus * channels >= self.frames.len() {
            self.frames.drain(..surplus * channels);
            self.angle_rev.drain(..surplus.min(self.angle_rev.len()));
            self.first += surplus;
        }
    }
}

/// Adds a run behind the others.
fn add(runs: &mut VecDeque<Range<usize>>, run: Range<usize>) {
    match runs.back_mut() {
        Some(last) if run.start <= last.end => last.end = run.end,
        _ => runs.push_back(run),
    }
}

/// The cubic polynomial nearest to [place, value].
fn polynomial(points: &[[f64; 2]]) -> [f64; TERMS] {
    let powers = |place: f64| std::iter::successors(Some(1.0), move |power| Some(power * place)).take(TERMS);
    let matrix: Vec<Complex64> = points.iter().flat_map(|[place, _]| powers(*place)).map(Complex64::from).collect();
    let operator = PivotedQr::new(points.len(), TERMS, &matrix, 1e-12).operator();
    let mut found = [0.0; TERMS];
    for (coefficient, row) in found.iter_mut().zip(operator.chunks_exact(points.len())) {
        *coefficient = row.iter().zip(points).map(|(entry, [_, value])| entry.re * value).sum();
    }
    found
}

fn value(cubic: &[f64; TERMS], place: f64) -> f64 {
    cubic.iter().rev().fold(0.0, |sum, coefficient| sum * place + coefficient)
}

impl SampleStream for Bridged<'_> {
    fn capture(&self) -> &Capture {
        self.input.capture()
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        loop {
            self.cross();
            let until = self.ready();
            if until > self.handed_on {
                self.hand_on(until, block);
                return Ok(true);
            }
            if self.ended {
                block.clear();
                return Ok(false);
            }
            if self.input.next_block(&mut self.raw)? {
                self.take();
            } else {
                self.finish();
            }
        }
    }
}

#[cfg(test)]
mod tests;
