//! Noise gain of form, fast enough to search with.

use std::{
    cmp::Ordering,
    ops::{ControlFlow, RangeInclusive},
};

use runout_core::{
    Complex64,
    numerics::least_squares::{cholesky, invert_lower},
    rig::Rig,
};

use crate::layout::Layout;

/// A form whose noise gain is above 1e6 counts as lost: 1 nm of noise would be 1 mm of form. Rounding reaches 1e7.
const LOST_INFORMATION: f64 = 1e-12;
/// A motion's column counts when more than this of it lies outside the others' span, as in [`Layout`].
const RANK_TOLERANCE: f64 = 1e-9;
/// Gains nearer than this are the same: which is lower is rounding.
const SAME_GAIN: f64 = 1e-9;

/// What makes one layout better than another, where both lose as many orders.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Criterion {
    /// The worst noise gain over the orders.
    Worst,
    /// The root mean square of the noise gains over the orders.
    Rms,
}

/// Noise gain of form over a range of orders, each order's worst over the sections.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Score {
    /// Orders at which some section's form is lost.
    pub lost: usize,
    /// Worst noise gain over the others; 0 where there are none.
    pub worst: f64,
    /// The first order with that noise gain.
    pub worst_order: usize,
    /// Root mean square of the noise gains over the orders that are not lost.
    pub rms: f64,
}

impl Score {
    /// `Less` where this is better: fewer lost orders, then the criterion, then the other criterion.
    #[must_use]
    pub fn compare(&self, other: &Self, criterion: Criterion) -> Ordering {
        let key = |score: &Self| {
            let gains = match criterion {
                Criterion::Worst => [score.worst, score.rms],
                Criterion::Rms => [score.rms, score.worst],
            };
            gains.map(|gain| (gain / SAME_GAIN).round())
        };
        let ([first, second], [others_first, others_second]) = (key(self), key(other));
        let by_lost = self.lost.cmp(&other.lost);
        by_lost.then(first.total_cmp(&others_first)).then(second.total_cmp(&others_second))
    }

    /// The worse of both in each respect.
    #[must_use]
    pub fn or_worse(self, other: Self) -> Self {
        let higher = if other.worst > self.worst { other } else { self };
        Self { lost: self.lost.max(other.lost), rms: self.rms.max(other.rms), ..higher }
    }
}

/// Noise gain of form for a rig whose sensors may stand at any angles.
///
/// With motion's columns B = Q·R (they do not depend on the order) and each section's phases aⱼ, the forms'
/// information is S = diag(Nⱼ) − VᴴV with vⱼ = Qᵀaⱼ and Nⱼ the readings of section j; form j's noise gain is
/// √(S⁻¹)ⱼⱼ, which is what [`Layout::assess`] finds from all of Aₙ.
///
/// Axial sensors are left out: what they say of tilt makes no order of a circle's form observable by itself.
#[derive(Debug, Clone)]
pub struct FormGain {
    readings: Vec<Reading>,
    /// Readings of each section.
    counts: Vec<f64>,
    /// Q, `[reading][column]`.
    basis: Vec<f64>,
    columns: usize,
    /// e^{inα} of each reading at the present order, and what takes it to the next.
    phases: Vec<(Complex64, Complex64)>,
    /// V, `[section][column]`.
    seen: Vec<Complex64>,
}

/// A score in the making.
#[derive(Debug, Default)]
struct Tally {
    lost: usize,
    observable: usize,
    worst: f64,
    worst_order: usize,
    squares: f64,
}

impl Tally {
    fn add(&mut self, order: usize, gain: f64) {
        if gain.is_infinite() {
            self.lost += 1;
            return;
        }
        self.observable += 1;
        self.squares += gain * gain;
        if gain > self.worst * (1.0 + SAME_GAIN) {
            (self.worst, self.worst_order) = (gain, order);
        }
    }

    fn score(&self) -> Score {
        let rms = (self.squares / self.observable.max(1) as f64).sqrt();
        Score { lost: self.lost, worst: self.worst, worst_order: self.worst_order, rms }
    }
}

#[derive(Debug, Clone)]
struct Reading {
    sensor: usize,
    /// Its place among the sections whose form is to be found; none where a bound of the form is declared.
    section: Option<usize>,
    /// σ and β of its setup.
    sensors_rad: f64,
    part_rad: f64,
    /// z from the sensors' mean, in units of the largest.
    lever: f64,
}

impl FormGain {
    /// For the sections, heights and setups of a rig.
    #[must_use]
    pub fn new(rig: &Rig) -> Self {
        let layout = Layout::new(rig, false);
        let radial = || layout.readings.iter().filter(|reading| !reading.view.is_axial());
        let longest = radial().map(|reading| reading.lever_mm.abs()).fold(0.0, f64::max);
        let places: Vec<usize> = layout.circles().map(|(_, section)| section).collect();
        let mut counts = vec![0.0; places.len()];
        let mut readings = Vec::with_capacity(layout.readings.len());
        for reading in radial() {
            let section = places.iter().position(|section| *section == reading.section);
            if let Some(section) = section {
                counts[section] += 1.0;
            }
            let setup = &rig.setups[reading.setup];
            readings.push(Reading {
                sensor: reading.sensor,
                section,
                sensors_rad: setup.sensors_rad,
                part_rad: setup.part_rad,
                lever: if longest > 0.0 { reading.lever_mm / longest } else { 0.0 },
            });
        }
        Self { readings, counts, basis: Vec::new(), columns: 0, phases: Vec::new(), seen: Vec::new() }
    }

    /// The score with the sensors at these angles (in rad, by sensor).
    pub fn score(&mut self, angles_rad: &[f64], orders: &RangeInclusive<usize>) -> Score {
        let mut tally = Tally::default();
        let _ = self.visit(angles_rad, orders, |order, gain| {
            tally.add(order, gain);
            ControlFlow::Continue(())
        });
        tally.score()
    }

    /// The score where it is better than `limit`; it stops at the first order that shows that it is not.
    pub fn better(
        &mut self,
        angles_rad: &[f64],
        orders: &RangeInclusive<usize>,
        limit: &Score,
        criterion: Criterion,
    ) -> Option<Score> {
        let count = (orders.end() + 1).saturating_sub(*orders.start());
        let squares = limit.rms * limit.rms * count.saturating_sub(limit.lost) as f64 * (1.0 + SAME_GAIN);
        let mut tally = Tally::default();
        let outcome = self.visit(angles_rad, orders, |order, gain| {
            tally.add(order, gain);
            let beyond = match criterion {
                Criterion::Worst => tally.worst > limit.worst * (1.0 + SAME_GAIN),
                Criterion::Rms => tally.squares > squares,
            };
            let no_better = tally.lost > limit.lost || (tally.lost == limit.lost && beyond);
            if no_better { ControlFlow::Break(()) } else { ControlFlow::Continue(()) }
        });
        let score = tally.score();
        (outcome.is_continue() && score.compare(limit, criterion) == Ordering::Less).then_some(score)
    }

    /// Noise gain of form, worst over the sections, at each order; infinite where some section's form is lost.
    #[must_use]
    pub fn by_order(&mut self, angles_rad: &[f64], orders: &RangeInclusive<usize>) -> Vec<f64> {
        let mut gains = Vec::new();
        let _ = self.visit(angles_rad, orders, |_, gain| {
            gains.push(gain);
            ControlFlow::Continue(())
        });
        gains
    }

    fn visit(
        &mut self,
        angles_rad: &[f64],
        orders: &RangeInclusive<usize>,
        mut each: impl FnMut(usize, f64) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        self.orthonormalise(angles_rad);
        self.phases.clear();
        for reading in &self.readings {
            let angle = angles_rad[reading.sensor] + reading.sensors_rad - reading.part_rad;
            self.phases.push((Complex64::cis(angle * *orders.start() as f64), Complex64::cis(angle)));
        }
        for order in orders.clone() {
            each(order, self.present_gain())?;
            self.phases.iter_mut().for_each(|(phase, step)| *phase *= *step);
        }
        ControlFlow::Continue(())
    }

    /// Gram-Schmidt, twice over, of cos θ', sin θ', z cos θ', z sin θ'; what lies in the others' span is left out.
    fn orthonormalise(&mut self, angles_rad: &[f64]) {
        let rows = self.readings.len();
        let mut basis: Vec<Vec<f64>> = Vec::with_capacity(4);
        for column in 0..4 {
            let entry = |reading: &Reading| {
                let (sine, cosine) = (angles_rad[reading.sensor] + reading.sensors_rad).sin_cos();
                [cosine, sine, reading.lever * cosine, reading.lever * sine][column]
            };
            let mut rest: Vec<f64> = self.readings.iter().map(entry).collect();
            for _ in 0..2 {
                for known in &basis {
                    let share: f64 = known.iter().zip(&rest).map(|(a, b)| a * b).sum();
                    rest.iter_mut().zip(known).for_each(|(rest, known)| *rest -= share * known);
                }
            }
            let norm = rest.iter().map(|entry| entry * entry).sum::<f64>().sqrt();
            if norm > RANK_TOLERANCE * (rows as f64).sqrt() {
                for entry in &mut rest {
                    *entry /= norm;
                }
                basis.push(rest);
            }
        }
        self.columns = basis.len();
        self.basis.clear();
        self.basis.extend((0..rows).flat_map(|row| basis.iter().map(move |column| column[row])));
    }

    fn present_gain(&mut self) -> f64 {
        let (sections, columns) = (self.counts.len(), self.columns);
        self.seen.clear();
        self.seen.resize(sections * columns, Complex64::ZERO);
        for (row, (reading, (phase, _))) in self.readings.iter().zip(&self.phases).enumerate() {
            let Some(section) = reading.section else { continue };
            let seen = &mut self.seen[section * columns..][..columns];
            seen.iter_mut().zip(&self.basis[row * columns..]).for_each(|(seen, basis)| *seen += *phase * *basis);
        }
        if let [count] = self.counts[..] {
            let information = count - self.seen.iter().map(Complex64::norm_sqr).sum::<f64>();
            return if information > LOST_INFORMATION { information.sqrt().recip() } else { f64::INFINITY };
        }
        let entry = |index: usize| {
            let (row, col) = (index / sections, index % sections);
            let pairs = self.seen[row * columns..][..columns].iter().zip(&self.seen[col * columns..][..columns]);
            let shared: Complex64 = pairs.map(|(a, b)| a.conj() * b).sum();
            if row == col { self.counts[row] - shared } else { -shared }
        };
        let information: Vec<Complex64> = (0..sections * sections).map(entry).collect();
        let Some(lower) = cholesky(sections, &information) else { return f64::INFINITY };
        let inverse = invert_lower(sections, &lower);
        let variance = |col: usize| inverse.iter().skip(col).step_by(sections).map(Complex64::norm_sqr).sum::<f64>();
        let worst = (0..sections).map(variance).fold(0.0, f64::max);
        if worst < LOST_INFORMATION.recip() { worst.sqrt() } else { f64::INFINITY }
    }
}
