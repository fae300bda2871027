//! Second-order geometry: a sensor's straight line meets the displaced profile.
//!
//! With the part's axis off by (along, t) as the sensor sees it, the line meets the profile of radius ρ = R + h at
//! α* = α − asin(t/ρ(α*)), at u = along + √(ρ(α*)² − t²) − R (`docs/appendix/physics.md` section 1). What exceeds the linear reading
//! along + h(α) is h(α*) − h(α) − t²/(ρ + √(ρ² − t²)), written so that nothing cancels.

#![allow(clippy::inline_always, reason = "see runout_core::numerics::lanes")]

use std::f64::consts::TAU;

use runout_core::{
    Complex64,
    numerics::{
        fourier::Fourier,
        lanes::{NullaryFnOnce, vectorised},
    },
    separation::Quantity,
};

use super::{
    estimate::Estimate,
    interpolation::{LANES, interpolated, weighted, weights_at},
};
use crate::layout::{FirstOrder, Layout, Reading, UM_PER_MM_URAD};

/// Finer grid on which form is tabulated, per angle of the profile.
pub(crate) const OVERSAMPLING: usize = 4;
/// A further round at the radius met moves the reading by about (h(α*) − h(α))²/ρ: below this, in µm, there is none.
const SETTLED_UM: f64 = 1e-9;
/// The shift asin(t/ρ) changes by less than 1e-9 of itself after two rounds: ρ varies by 1e-3 at most.
const ROUNDS: usize = 2;

/// The highest order times eccentricity over radius, n·e/R, from which on orders may be solved together: half of it is the
/// share of form that goes to either side.
pub(super) const COUPLED: f64 = 0.2;
/// From this share of the highest order that the angles of a profile hold, coupled orders may lie beyond it.
const HIGH: f64 = 0.75;
/// So much of them, in µm rms, may be taken for lower orders. The recording's own are taken out before it is averaged.
const FOLDED_UM: f64 = 1e-4;

/// Computes what exact geometry adds to linear readings.
pub(crate) struct SecondOrder<'a> {
    layout: &'a Layout,
    radius_um: f64,
    /// Of the part's axis from the spindle's, about.
    eccentricity_um: f64,
    /// Angles here for each angle of the profile: 1, or 2 where coupled orders lie beyond those of the profile.
    finer: usize,
    turn: Fourier,
    fine: Fourier,
    /// Form on the fine grid, `[section]`, and of the readings that see it in a way of their own.
    table: Vec<Vec<f64>>,
    own: Vec<(usize, Vec<f64>)>,
    /// e^{i(α − α₀)} of the part angle at each sample.
    turned: Vec<Complex64>,
    /// Part angles where lines meet the profile, rad, `[reading][angle]`.
    met_rad: Vec<f64>,
    /// Part angles where the line of one reading meets the profile, rad, at all samples.
    met_at: Vec<f64>,
}

impl<'a> SecondOrder<'a> {
    pub(crate) fn new(layout: &'a Layout, samples_per_rev: usize, eccentricity_um: f64) -> Self {
        Self::finer(1, layout, samples_per_rev, eccentricity_um)
    }

    fn finer(finer: usize, layout: &'a Layout, samples_per_rev: usize, eccentricity_um: f64) -> Self {
        let samples_per_rev = finer * samples_per_rev;
        let turns = (0..samples_per_rev).map(|step| step as f64 / samples_per_rev as f64);
        Self {
            layout,
            radius_um: 1e3 * layout.part_radius_mm,
            eccentricity_um,
            finer,
            turn: Fourier::new(samples_per_rev),
            fine: Fourier::new(samples_per_rev * OVERSAMPLING),
            table: Vec::new(),
            own: Vec::new(),
            turned: turns.map(|turn| Complex64::from_polar(1.0, -layout.direction * TAU * turn)).collect(),
            met_rad: Vec::new(),
            met_at: Vec::new(),
        }
    }

    /// Part angles where lines meet the profile at the last estimate, in rad, `[reading][angle]`.
    pub(crate) fn met_rad(&self) -> &[f64] {
        &self.met_rad
    }

    /// Writes the excess over the linear readings, coefficients of e^{−inΦ}, to `excess` (`[order][reading]`).
    pub(crate) fn excess(&mut self, estimate: &Estimate, excess: &mut [Complex64]) {
        let layout = self.layout;
        let count = layout.readings.len();
        let max_order = excess.len() / count - 1;
        if self.finer == 1 && self.folded_um(estimate, max_order) > FOLDED_UM {
            *self = Self::finer(2, layout, self.turn.length(), self.eccentricity_um);
        }
        let samples = self.turn.length();
        self.tabulate(estimate, max_order);
        let mut motions = Vec::new();
        let mut harmonics = vec![Complex64::ZERO; max_order + 1];
        let mut curve = Vec::with_capacity(samples);
        self.met_rad.clear();
        for (index, reading) in layout.readings.iter().enumerate() {
            // Lateral motion of the face is left linear: its slope across the axis is not known.
            if reading.view.is_axial() {
                let steps = (0..samples).step_by(self.finer);
                self.met_rad.extend(steps.map(|step| layout.part_angle_rad(reading, step, samples)));
                excess.iter_mut().skip(index).step_by(count).for_each(|value| *value = Complex64::ZERO);
                continue;
            }
            if motions.get(reading.setup).is_none() {
                motions.push(self.motion(estimate, reading.setup, max_order));
            }
            let [x, y, tilt_x, tilt_y] = &motions[reading.setup];
            let eccentricity = estimate.eccentricity(layout, reading.setup, reading.section);
            let at_start = eccentricity * Complex64::from_polar(1.0, reading.part_angle_rad);
            let (sine, cosine) = reading.angle_rad.sin_cos();
            let lever = reading.lever_mm * UM_PER_MM_URAD;
            let across = |step: usize| {
                // The eccentricity Re C e^{iα} is along the sensor's line; a quarter turn on, it is across.
                let ahead = at_start * self.turned[step];
                let motion = cosine * (y[step] - lever * tilt_x[step]) - sine * (x[step] + lever * tilt_y[step]);
                reading.motion_ratio * motion - ahead.im
            };
            let met = &mut self.met_at;
            met.clear();
            met.extend((0..samples).map(|step| layout.part_angle_rad(reading, step, samples)));
            curve.clear();
            curve.extend((0..samples).map(across));
            let own = self.own.iter().find(|(own, _)| *own == index);
            let line = Line {
                table: own.map_or(&self.table[reading.section], |(_, table)| table),
                start_rad: reading.part_angle_rad,
                forwards: layout.direction < 0.0,
                radius_um: self.radius_um,
                curve: &mut curve,
                met,
            };
            vectorised(line);
            self.met_rad.extend(met.iter().step_by(self.finer));
            self.turn.analyse(curve.iter().copied(), &mut harmonics);
            for (order, harmonic) in harmonics.iter().enumerate() {
                excess[order * count + index] = harmonic.conj();
            }
        }
    }

    /// About what an eccentricity e takes of high orders n of form beyond those that the profile's angles hold: n·e/R of their
    /// amplitudes, in µm rms; 0 where orders are solved together.
    fn folded_um(&self, estimate: &Estimate, max_order: usize) -> f64 {
        let layout = self.layout;
        let share = self.eccentricity_um / self.radius_um;
        // Where orders are solved together, they are coupled on the angles of the profile.
        if share * max_order as f64 > COUPLED {
            return 0.0;
        }
        let from = (HIGH * 0.5 * self.turn.length() as f64) as usize;
        let square = |order: usize, unknown: usize| {
            estimate.likely_form(order, unknown).norm_sqr() * (order as f64 * share).powi(2)
        };
        let of_form = |unknown: usize| (from..=max_order).map(|order| square(order, unknown)).sum::<f64>();
        let forms = layout.unknowns.iter().enumerate().filter(|(_, quantity)| quantity.is_form());
        forms.map(|(unknown, _)| (0.5 * of_form(unknown)).sqrt()).fold(0.0, f64::max)
    }

    /// Form of each section on the fine grid over the part's angle, and what single readings see of it.
    fn tabulate(&mut self, estimate: &Estimate, max_order: usize) {
        let layout = self.layout;
        let sections = layout.readings.iter().map(|reading| reading.section + 1).max().unwrap_or(0);
        let unknown = |section: usize| layout.unknowns.iter().position(|known| *known == Quantity::Form(section));
        let form = |order: usize, section: usize| match unknown(section) {
            Some(unknown) if order > 1 => estimate.likely_form(order, unknown),
            // A form that is taken as 0.
            _ => Complex64::ZERO,
        };
        let fine = &mut self.fine;
        let mut table = |form: &dyn Fn(usize) -> Complex64| {
            fine.synthesise((0..=max_order).map(|order| layout.of_part(form(order)))).to_vec()
        };
        self.table = (0..sections).map(|section| table(&|order| form(order, section))).collect();
        let own = layout.readings.iter().enumerate().filter(|(_, reading)| reading.has_own_profile());
        let seen = |reading: &Reading, order: usize| {
            let patterns = reading.patterns.iter().filter(|pattern| pattern.is_form && pattern.order == order);
            let patterns = patterns.map(|pattern| pattern.value);
            form(order, reading.section) * reading.form_share(order) + patterns.sum::<Complex64>()
        };
        self.own = own.map(|(index, reading)| (index, table(&|order| seen(reading, order)))).collect();
    }

    /// x, y, tilt about x and y at the sensors' mean z over the spindle's angle, as one setup sees them.
    fn motion(&mut self, estimate: &Estimate, setup: usize, max_order: usize) -> [Vec<f64>; 4] {
        let layout = self.layout;
        let mut motion = [const { Vec::new() }; 4];
        for curve in &mut motion {
            curve.resize(self.turn.length(), 0.0);
        }
        for (unknown, quantity) in layout.unknowns.iter().enumerate().filter(|(_, quantity)| !quantity.is_form()) {
            let harmonics = (0..=max_order).map(|order| {
                if order == 0 {
                    Complex64::ZERO
                } else {
                    estimate.observable_value(order, unknown).conj() * layout.motion_sign(setup, order)
                }
            });
            let curve = self.turn.synthesise(harmonics);
            for (target, share) in motion.iter_mut().zip(quantity.cartesian()).filter(|(_, share)| *share != 0.0) {
                target.iter_mut().zip(curve).for_each(|(sum, value)| *sum += share * value);
            }
        }
        motion
    }
}

/// A sensor's line over a turn, several samples at a time.
struct Line<'a> {
    /// Form on the fine grid.
    table: &'a [f64],
    /// Part angle of the first sample, and whether it grows with the samples.
    start_rad: f64,
    forwards: bool,
    radius_um: f64,
    /// Of each sample, how far the part's axis is off across the line; then what the reading has more than the linear one.
    curve: &'a mut [f64],
    /// Part angle of each sample; then the angle that the line meets.
    met: &'a mut [f64],
}

impl NullaryFnOnce for Line<'_> {
    type Output = ();

    #[inline(always)]
    fn call(self) {
        let Self { table, start_rad, forwards, radius_um, curve, met } = self;
        let samples = curve.len();
        // Angles of the samples are a whole number of the table's steps apart: they share their weights.
        let (first, weights) = weights_at(table.len(), start_rad);
        for (chunk, (curve, met)) in curve.chunks_mut(LANES).zip(met.chunks_mut(LANES)).enumerate() {
            let (mut across, mut part_angle, mut here) = ([0.0; LANES], [0.0; LANES], [0.0; LANES]);
            across[..curve.len()].copy_from_slice(curve);
            part_angle[..met.len()].copy_from_slice(met);
            for (lane, here) in here.iter_mut().enumerate().take(curve.len()) {
                let step = chunk * LANES + lane;
                let from = first + OVERSAMPLING * if forwards { step } else { samples - step };
                *here = weighted(table, if from >= table.len() { from - table.len() } else { from }, &weights);
            }
            let (mut there, mut meets, mut sine) = (here, part_angle, [0.0; LANES]);
            for _ in 0..ROUNDS {
                for lane in 0..LANES {
                    sine[lane] = across[lane] / (radius_um + there[lane]);
                }
                let shift = arcsines(&sine);
                for lane in 0..LANES {
                    meets[lane] = part_angle[lane] - shift[lane];
                }
                there = interpolated(table, &meets);
                let moved = (0..LANES).map(|lane| (there[lane] - here[lane]).powi(2)).fold(0.0, f64::max);
                if moved < SETTLED_UM * radius_um {
                    break;
                }
            }
            for (lane, (value, met)) in curve.iter_mut().zip(met).enumerate() {
                *value = there[lane] - here[lane] - across[lane] * sagitta_of_sine(sine[lane]);
                *met = meets[lane];
            }
        }
    }
}

/// [`arcsine`] of several.
#[inline(always)]
fn arcsines(sines: &[f64; LANES]) -> [f64; LANES] {
    if sines.iter().any(|sine| sine * sine >= SERIES) {
        return sines.map(arcsine);
    }
    sines.map(arcsine_series)
}

impl Estimate {
    /// Eccentricity C of a section in a setup, reading Re C e^{+iα}, in µm.
    fn eccentricity(&self, layout: &Layout, setup: usize, section: usize) -> Complex64 {
        let wanted = FirstOrder::Eccentricity { setup, section };
        let found = layout.first_order_unknowns().iter().position(|unknown| *unknown == wanted);
        let value = found.map_or(Complex64::ZERO, |index| self.first[index]);
        if layout.direction < 0.0 { value.conj() } else { value }
    }
}

/// asin(x). Below 0.02 the series up to x⁷ leaves out less than 1e-16 of x.
fn arcsine(x: f64) -> f64 {
    if x * x < SERIES { arcsine_series(x) } else { x.asin() }
}

#[inline(always)]
fn arcsine_series(x: f64) -> f64 {
    let square = x * x;
    x * (1.0 + square * (1.0 / 6.0 + square * (3.0 / 40.0 + square * (15.0 / 336.0))))
}

/// The square below which series are taken.
const SERIES: f64 = 4e-4;

/// (1 − √(1 − x²))/x, the sagitta over the distance from the centre line. Below 0.02 the series up to x⁷ leaves out less than
/// 1e-14 of it.
#[inline(always)]
fn sagitta_of_sine(x: f64) -> f64 {
    let square = x * x;
    if square < SERIES {
        x * (0.5 + square * (0.125 + square * (0.0625 + square * (5.0 / 128.0))))
    } else {
        x / (1.0 + (1.0 - square).sqrt())
    }
}
