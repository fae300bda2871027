//! The angle corrected by what is decided, and its uncertainty by what is not.

use std::f64::consts::PI;

use runout_core::{
    Complex64, Result,
    closed_loop::{Fit, linear_terms::LinearFit},
    points::Points,
    table::{ColumnSpec, TableRows, TableSpec, counts, numbers, numbers_or_null},
};

use crate::{components::Component, samples::Samples, signal::Signal};

/// The sum P of two unknown components of one order is known, their difference Q is not. Where both are of one unknown size,
/// the chance of |Q| > k·|P| is 1/(1 + k²): two standard deviations hold 95 % where E|Q|² is this many times |P|².
const DIFFERENCE_OVER_SUM: f64 = 19.0 / 4.0;

/// What is done to the angle.
pub(crate) struct Correction {
    signal: Signal,
    /// Variance of the angle by components that are not decided, in rad².
    undecided_variance: f64,
    /// Variance of a reading across the turning vector by those that are, in counts².
    decided_variance: f64,
    /// Standard deviation of a reading, in counts.
    noise: f64,
    /// Of each sample: the corrected angle, and its change by one count, in rad.
    angles: Vec<[f64; 2]>,
    /// Orders that two components may have, and the amplitude of the angle error that either would have, in rad.
    undecided: Vec<(Component, f64)>,
}

/// A component that was found: what the radius has of it, and the variance of that.
struct FoundComponent {
    component: Component,
    waves: [f64; 2],
    variance: [f64; 2],
}

impl Correction {
    /// By a final fit.
    ///
    /// # Errors
    /// When the samples do not determine what was found.
    pub(crate) fn of(samples: &Samples, max_order: usize, fit: &LinearFit) -> Result<Self> {
        let radius = fit.declared().first().copied().unwrap_or(f64::NAN);
        let found = fit.effects().filter_map(|(effect, values, variance)| {
            let component = Component::of(&effect.id, max_order)?;
            let parameters = <[f64; 2]>::try_from(values).ok()?;
            let slopes = component.slopes(radius, parameters);
            let known = |index: usize| variance.get(index).copied().filter(|entry| entry.is_finite()).unwrap_or(0.0);
            Some(FoundComponent {
                component,
                waves: component.waves(radius, parameters),
                variance: [0, 1].map(|wave| (0..2).map(|index| known(index) * slopes[index][wave].powi(2)).sum()),
            })
        });
        let found: Vec<FoundComponent> = found.collect();
        let mut correction = Self {
            signal: Signal { radius, components: Vec::new() },
            undecided_variance: 0.0,
            decided_variance: 0.0,
            noise: fit.remainder().rms,
            angles: Vec::new(),
            undecided: Vec::new(),
        };
        if samples.true_rad.is_some() {
            for FoundComponent { component, waves, variance } in &found {
                correction.signal.components.push((*component, component.of_radius(*waves)));
                correction.decided_variance += 0.5 * variance.iter().sum::<f64>();
            }
            return Ok(correction.applied(samples));
        }
        let open = |component: Component| fit.considers(&component.id());
        let (mut known, mut decided, mut beside) = (Vec::new(), Vec::new(), Vec::new());
        for order in 1..=max_order {
            let of_order = || found.iter().filter(|found| found.component.order() == order);
            let [backward, forward] = Component::of_order(order);
            let declared = of_order().filter(|found| fit.knows(&found.component.id()));
            known.extend(declared.map(|found| (found.component, found.component.of_radius(found.waves))));
            let free = || of_order().filter(|found| !fit.knows(&found.component.id()));
            if open(backward) && open(forward) {
                let sum: Complex64 = free().map(|found| Complex64::new(found.waves[0], found.waves[1])).sum();
                beside.extend(free().next().map(|found| found.component));
                let usual = 2.0 * (backward.usual().powi(2) + forward.usual().powi(2));
                let difference = usual.max(DIFFERENCE_OVER_SUM * (sum / radius).norm_sqr());
                correction.undecided_variance += 0.5 * difference;
                if sum.norm() > 0.0 {
                    correction.undecided.push((backward, sum.norm() / radius));
                }
            } else {
                decided.extend(free().map(|found| found.component));
                let variance: f64 = free().flat_map(|found| found.variance).sum();
                correction.decided_variance += 0.5 * variance;
            }
        }
        if !(decided.is_empty() && known.is_empty()) {
            correction.signal = Signal::fit(&samples.phase_rad, &samples.radius, &known, &decided, &beside)?;
        }
        Ok(correction.applied(samples))
    }

    fn applied(mut self, samples: &Samples) -> Self {
        let readings = samples.phase_rad.iter().zip(&samples.radius);
        self.angles = readings.map(|(phase, radius)| self.signal.angle_rad(*phase, *radius)).collect();
        self
    }

    /// Standard uncertainty of a corrected angle, in rad, by its change with one count.
    fn std_rad(&self, by_count: f64) -> f64 {
        let counts = self.decided_variance + self.noise * self.noise;
        (self.undecided_variance + counts * by_count * by_count).sqrt()
    }

    /// What the user should know.
    pub(crate) fn remarks(&self) -> Vec<String> {
        let mut remarks: Vec<String> = self
            .undecided
            .iter()
            .map(|(backward, amplitude)| {
                format!(
                    "order {} of the radius is {} or {}: one adds an error of {:.4}° to the angle, the other takes as much \
                     away, and the radius does not decide; the angle is not corrected for it",
                    backward.order(),
                    backward.id(),
                    backward.partner().id(),
                    amplitude.to_degrees()
                )
            })
            .collect();
        if self.undecided.is_empty() && self.signal.components.is_empty() {
            remarks.push("nothing that was found is decided: the angle is not corrected".into());
        }
        let count = self.angles.len().max(1) as f64;
        let mean_square =
            |of: &dyn Fn(f64) -> f64| self.angles.iter().map(|[_, by]| of(*by).powi(2)).sum::<f64>() / count;
        let by_count = mean_square(&|by| by).sqrt();
        remarks.push(format!(
            "standard uncertainty of one corrected angle: {:.4}°, of which {:.4}° is the noise of the reading and {:.4}° is \
             what the fit does not decide",
            mean_square(&|by| self.std_rad(by)).sqrt().to_degrees(),
            (self.noise * by_count).to_degrees(),
            (self.undecided_variance + self.decided_variance * by_count * by_count).sqrt().to_degrees()
        ));
        remarks
    }

    /// Rows of [`angle_table`], in the order of the file.
    ///
    /// # Errors
    /// Never in practice: the columns are of one length.
    pub(crate) fn rows(&self, points: &Points, samples: &Samples) -> Result<TableRows> {
        let corrected = samples.phase_rad.iter().zip(&self.angles).map(|(phase, [angle, _])| {
            // The same turn as the phase has.
            let ahead = (angle - phase + PI).rem_euclid(2.0 * PI) - PI;
            (phase + ahead).to_degrees()
        });
        let count = samples.phase_rad.len();
        let time = points.column("time_s").ok();
        let table = angle_table();
        let rows = table.rows(vec![
            counts(0..count),
            numbers_or_null((0..count).map(|row| time.map(|time| time[row]))),
            numbers(samples.phase_rad.iter().map(|phase| phase.to_degrees())),
            numbers(corrected),
            numbers(self.angles.iter().map(|[_, by_count]| self.std_rad(*by_count).to_degrees())),
        ])?;
        Ok(TableRows { table: table.name, rows })
    }
}

/// What the numbers of the angle are.
pub(crate) const ANGLE: &str = "Angle of a quadrature signal within its period. corrected_deg is phase_deg without the errors that the \
    diagnosis decided; std_deg includes what it did not decide and the noise of the reading.";

/// The table of angles, one row a sample.
pub(crate) fn angle_table() -> TableSpec {
    TableSpec::new(
        "angle",
        ANGLE,
        vec![
            ColumnSpec::count("index", "", "row of the reading in the file, from 0"),
            ColumnSpec::number("time_s", "s", "time of the reading; null where the file has none").or_null(),
            ColumnSpec::number("phase_deg", "deg", "angle of the pair (cosine, sine) as read"),
            ColumnSpec::number("corrected_deg", "deg", "angle of the pair without the errors that were decided"),
            ColumnSpec::number("std_deg", "deg", "standard uncertainty of corrected_deg, but for a constant")
                .repeating(),
        ],
    )
}
