//! A spindle model fitted with effects applied.

use std::sync::Arc;

use runout_core::{
    Complex64, Error, Result,
    evaluate::{roundness::ront_lsci_um, uncertainty},
    model::{Bias, Fit, Outcome, Remainder, Setting, diagnosis::Unexplained},
    numerics::fourier::Fourier,
    separation::{Quantity, Residual, Separation},
    stage::Station,
};

use super::{
    data::{Shared, StationData, project},
    strangers,
};
use crate::{
    effects::{ActsOn, Alterations, Predicted},
    layout::Layout,
    separators::{Estimate, Operators, Propagation, Readings, Solver, apply, leftover, residual},
};

/// A fit, and what its partials need.
pub struct SpindleFit {
    shared: Arc<Shared>,
    alterations: Alterations,
    layout: Layout,
    stations: Vec<Solved>,
    remainder: Remainder,
}

/// One station's solution.
pub(super) struct Solved {
    pub operators: Operators,
    propagation: Option<Propagation>,
    pub estimate: Estimate,
    /// Readings taken back to displacements.
    pub corrected: Readings,
    /// The same without what exact geometry adds.
    pub linear: Vec<Complex64>,
    /// W (I − A P) of each order from 1, over the noise of a real degree of freedom.
    pub whitened: Vec<Vec<Complex64>>,
    /// What is not known of effects, `[order][unknown]`, added to the variances.
    widened: Vec<f64>,
}

impl SpindleFit {
    pub(super) fn new(shared: Arc<Shared>, applied: &[Setting]) -> Result<Self> {
        let mut alterations = Alterations::none(&shared.layout);
        for setting in applied {
            let place = shared.places.get(setting.effect).ok_or_else(|| {
                Error::new("apply", format!("effect {}", setting.effect), "there is no such effect in this rig")
            })?;
            shared.kind(setting.effect).alter(place.index, &setting.values, &mut alterations);
        }
        if !alterations.are_possible() {
            return Err(Error::new("apply", "effects", "their values are beyond all bounds"));
        }
        let layout = shared.layout.altered(&alterations);
        let stations: Vec<Solved> =
            shared.data.iter().map(|data| Solved::new(&shared, data, &layout, &alterations)).collect();
        let remainder = remainder(&shared, &stations, &layout, &alterations);
        Ok(Self { shared, alterations, layout, stations, remainder })
    }

    /// The layout with the effects applied.
    #[must_use]
    pub fn layout(&self) -> &Layout {
        &self.layout
    }

    /// Numbers of the asynchronous lines that are taken out.
    #[must_use]
    pub(super) fn lines(&self) -> &[usize] {
        &self.alterations.lines
    }

    /// Highest order fitted.
    #[must_use]
    pub fn max_order(&self) -> usize {
        self.stations.iter().map(|station| station.corrected.max_order).max().unwrap_or(0)
    }

    fn predicted(&self, station: usize) -> Predicted<'_> {
        let solved = &self.stations[station];
        let readings = &solved.corrected;
        Predicted::new(&self.layout, &self.alterations, &solved.estimate, readings)
    }

    fn partials(&self, effect: usize, station: usize) -> Vec<Vec<Complex64>> {
        let place = &self.shared.places[effect];
        self.shared.kind(effect).partials(place.index, &self.predicted(station))
    }

    /// Form and motion, one entry a station.
    #[must_use]
    pub fn separations(&self, stations: &[Station]) -> Vec<Separation> {
        let solver = self.shared.solver(&self.layout, &self.alterations);
        let each = self.stations.iter().zip(stations).map(|(solved, station)| {
            let propagation = solved.propagation.as_ref();
            let residual = solved.residual();
            let mut separation = solver.report(station, &solved.operators, &solved.estimate, propagation, residual);
            separation.variance.iter_mut().zip(&solved.widened).for_each(|(variance, more)| *variance += more);
            separation
        });
        each.collect()
    }
}

impl Shared {
    pub(super) fn solver<'a>(&'a self, layout: &'a Layout, alterations: &Alterations) -> Solver<'a> {
        Solver { selection: &self.selection, layout, second_order: self.second_order || alterations.exact_geometry }
    }
}

impl Solved {
    fn new(shared: &Shared, data: &StationData, layout: &Layout, alterations: &Alterations) -> Self {
        let mut corrected = data.readings.clone();
        for leak in alterations.lines.iter().filter_map(|line| data.leaks.get(*line)) {
            corrected.mean.iter_mut().zip(leak).for_each(|(mean, leak)| *mean -= leak);
        }
        alterations.correct(layout, &mut corrected);
        let max_order = corrected.max_order;
        // Displacements are weighed by the noise of the readings that they were.
        let weights: Vec<_> = (1..=max_order).map(|order| data.weights_of(order, layout, alterations)).collect();
        let mut operators = Operators::least_squares(layout, max_order, Some(weights.clone()));
        if data.weights.is_none() {
            operators.weights = None;
        }
        let solver = shared.solver(layout, alterations);
        let (estimate, linear) = solver.iterate(&corrected, &operators, |estimate, excess| {
            axial(layout, alterations, &corrected, estimate, excess);
        });
        let count = corrected.count;
        let whitened = (1..=max_order)
            .map(|order| {
                let system = &operators.systems[order - 1];
                let left = leftover(&system.matrix, &operators.orders[order - 1].operator, count);
                let mut left = weights[order - 1].times(&left, count);
                // A real degree of freedom has half of a complex one's square.
                let scale = std::f64::consts::SQRT_2 / data.floor_std(order);
                for entry in &mut left {
                    *entry *= scale;
                }
                left
            })
            .collect();
        let widened = vec![0.0; (max_order + 1) * layout.unknowns.len()];
        let propagation = Propagation::of(&corrected, &operators);
        Self { operators, propagation, estimate, corrected, linear, whitened, widened }
    }

    fn residual(&self) -> Residual {
        residual(&self.operators, &self.corrected, &self.linear, self.propagation.as_ref())
    }
}

/// Adds what places along z other than the declared ones do to the readings.
fn axial(
    layout: &Layout,
    alterations: &Alterations,
    readings: &Readings,
    estimate: &Estimate,
    excess: &mut [Complex64],
) {
    let moved = alterations.sensors.iter().any(|sensor| sensor.circle_mm != 0.0);
    if alterations.axial_um.is_empty() && !moved {
        return;
    }
    let predicted = Predicted::new(layout, alterations, estimate, readings);
    if !alterations.axial_um.is_empty() {
        let along = predicted.curves(
            &predicted.along_z,
            |_| true,
            |angle, slope| -1e-3 * slope * alterations.axial_um.iter().map(|harmonic| harmonic.at(angle)).sum::<f64>(),
        );
        excess.iter_mut().zip(along).for_each(|(excess, along)| *excess += along);
    }
    for (index, slope) in predicted.along_z.iter().enumerate() {
        let reading = &layout.readings[index % readings.count];
        excess[index] += slope * alterations.sensors[reading.sensor].circle_mm;
    }
}

fn remainder(shared: &Shared, stations: &[Solved], layout: &Layout, alterations: &Alterations) -> Remainder {
    let (mut residual, mut stretches) = (Vec::new(), Vec::with_capacity(stations.len()));
    let (mut dof, mut squares, mut expected, mut readings) = (0, 0.0, 0.0, 0);
    let (mut held_squares, mut held_chi2, mut held_readings) = (0.0, 0.0, 0);
    for (solved, data) in stations.iter().zip(&shared.data) {
        let count = solved.corrected.count;
        project(&solved.whitened, &solved.linear, count, |_, values| {
            residual.extend(values.iter().flat_map(|value| [value.re, value.im]));
        });
        for (sensor, creep, std) in &data.creeps {
            residual.push((creep - alterations.sensors[*sensor].creep_um) / std);
            dof += 1;
        }
        for (number, line) in data.seen.lines.iter().enumerate() {
            residual.push(if alterations.lines.contains(&number) { 0.0 } else { line.evidence.sqrt() });
            dof += 1;
        }
        stretches.push(residual.len() - stretches.iter().sum::<usize>());
        let level = solved.residual();
        if level.dof > 0 {
            dof += level.dof;
            squares += level.rms_um.powi(2) * count as f64;
            expected += level.expected_rms_um.powi(2) * count as f64;
        }
        readings += count;
        if let Some((chi2, sum)) = held_out(data, solved, layout, alterations) {
            held_chi2 += chi2;
            held_squares += sum;
            held_readings += count;
        }
    }
    let known = shared.data.iter().all(|data| data.weights.is_some());
    let share = |sum: f64, count: usize| if count > 0 { (sum / count as f64).sqrt() } else { f64::NAN };
    Remainder {
        residual,
        stretches,
        dof,
        rms: share(squares, readings),
        noise_floor: if known { share(expected, readings) } else { f64::NAN },
        held_out_rms: share(0.5 * held_squares, held_readings),
        held_out_chi2: if held_readings > 0 { held_chi2 } else { f64::NAN },
        unit: "um".into(),
    }
}

/// χ² and sum of squares (µm²) of what the fit leaves of the turns held out.
fn held_out(data: &StationData, solved: &Solved, layout: &Layout, alterations: &Alterations) -> Option<(f64, f64)> {
    let mut held = data.held_out.clone()?;
    let mut later = alterations.clone();
    for (sensor, creeping) in later.sensors.iter_mut().zip(&data.seen.creeping) {
        sensor.creep_share = creeping.map_or(1.0, |creeping| creeping.held_out_share());
    }
    let (mut chi2, mut squares) = (0.0, 0.0);
    for (number, line) in data.seen.lines.iter().enumerate() {
        let taken_out = alterations.lines.contains(&number);
        chi2 += line.held_out[usize::from(taken_out)];
        if taken_out {
            held.mean.iter_mut().zip(&line.leak[1]).for_each(|(mean, leak)| *mean -= leak);
        }
    }
    later.correct(layout, &mut held);
    let count = held.count;
    for order in 1..=held.max_order.min(solved.corrected.max_order) {
        let at = order * count..(order + 1) * count;
        let operator = &solved.operators.orders[order - 1].operator;
        let system = &solved.operators.systems[order - 1];
        let solution = apply(operator, &solved.linear[at.clone()]);
        let predicted = apply(&system.matrix, &solution);
        let beyond = solved.corrected.mean[at.clone()].iter().zip(&solved.linear[at.clone()]).map(|(a, b)| a - b);
        let left: Vec<Complex64> = held.mean[at]
            .iter()
            .zip(beyond)
            .zip(predicted)
            .map(|((held, beyond), predicted)| held - beyond - predicted)
            .collect();
        // Readings were recorded, not displacements.
        let response = |index: usize| alterations.sensors[layout.readings[index].sensor].response(order).norm_sqr();
        squares += left.iter().enumerate().map(|(index, value)| value.norm_sqr() * response(index)).sum::<f64>();
        let weighted = data.weights_of(order, layout, alterations).times(&left, 1);
        chi2 += weighted.iter().map(Complex64::norm_sqr).sum::<f64>() / data.floor_std(order).powi(2);
    }
    Some((chi2, squares))
}

impl Fit for SpindleFit {
    fn remainder(&self) -> &Remainder {
        &self.remainder
    }

    fn signature(&self, effect: usize) -> Vec<Vec<f64>> {
        let count = self.shared.places[effect].effect.parameters.len();
        let mut signature = vec![Vec::with_capacity(self.remainder.residual.len()); count];
        let place = &self.shared.places[effect];
        let kind = self.shared.kind(effect);
        for (index, solved) in self.stations.iter().enumerate() {
            for (parameter, (partial, column)) in self.partials(effect, index).iter().zip(&mut signature).enumerate() {
                // What the model predicts more of, the residual has less of.
                project(&solved.whitened, partial, solved.corrected.count, |_, values| {
                    column.extend(values.iter().flat_map(|value| [-value.re, -value.im]));
                });
                let creeps = self.shared.data[index].creeps.iter();
                column.extend(creeps.map(|(sensor, _, std)| {
                    let creep = kind.creep_partials(place.index, *sensor).get(parameter).copied();
                    -creep.unwrap_or(0.0) / std
                }));
                column.extend(self.shared.data[index].seen.lines.iter().map(|_| 0.0));
            }
        }
        signature
    }

    fn bias(&self, effect: usize) -> Vec<Bias> {
        let place = &self.shared.places[effect];
        let mut biases = Vec::new();
        let Some(solved) = self.stations.first() else { return biases };
        for (partial, parameter) in self.partials(effect, 0).iter().zip(&place.effect.parameters) {
            let (mut form, mut shift, mut forms, mut shifts) = (0.0, 0.0, 0, 0);
            for (unknown, quantity) in self.layout.unknowns.iter().enumerate() {
                let squares: f64 = solved.moved_by(partial, unknown).map(|(_, value)| value.norm_sqr()).sum();
                match quantity {
                    Quantity::Form(_) => (form, forms) = (form + squares, forms + 1),
                    Quantity::X | Quantity::Y => (shift, shifts) = (shift + squares, shifts + 1),
                    _ => {}
                }
            }
            for (on, squares, count) in [("form", form, forms), ("motion", shift, shifts)] {
                if count > 0 {
                    let value = (0.5 * squares / f64::from(count)).sqrt();
                    let unit = match parameter.unit.as_str() {
                        "1" => "um".into(),
                        plain if !plain.contains('/') => format!("um/{plain}"),
                        divided => format!("um/({divided})"),
                    };
                    biases.push(Bias { on: on.into(), value, unit });
                }
            }
        }
        biases
    }

    fn results(&self) -> Vec<f64> {
        let told = self.stations.iter().flat_map(|solved| {
            self.layout.forms().flat_map(move |unknown| {
                solved.told_orders(unknown).flat_map(move |order| {
                    let value = solved.estimate.told(order, unknown);
                    [value.re, value.im]
                })
            })
        });
        told.collect()
    }

    fn moves(&self, effect: usize) -> Vec<Vec<f64>> {
        let parameters = self.shared.places[effect].effect.parameters.len();
        let mut moves = vec![Vec::new(); parameters];
        for (station, solved) in self.stations.iter().enumerate() {
            for (partial, column) in self.partials(effect, station).iter().zip(&mut moves) {
                for unknown in self.layout.forms() {
                    // What an effect explains of the readings is no form.
                    column.extend(solved.moved_by(partial, unknown).flat_map(|(_, value)| [-value.re, -value.im]));
                }
            }
        }
        moves
    }

    fn values(&self) -> Vec<Outcome> {
        let mut values = Vec::new();
        let stations: Vec<Station> = self.shared.data.iter().map(StationData::key).collect();
        let several = stations.len() > 1;
        for (separation, station) in self.separations(&stations).iter().zip(&stations) {
            for (unknown, quantity) in separation.unknowns.iter().enumerate() {
                let Quantity::Form(section) = quantity else { continue };
                let Some(at) = separation.sections.get(*section) else { continue };
                let place = if several { format!("{}@{}", at.id, station.name) } else { at.id.clone() };
                values.extend(form_values(separation, unknown, &place));
            }
        }
        values
    }

    fn widen(&mut self, effects: &[usize], covariance: &[Vec<f64>]) {
        let width = self.layout.unknowns.len();
        for station in 0..self.stations.len() {
            let partials: Vec<Vec<Complex64>> =
                effects.iter().flat_map(|effect| self.partials(*effect, station)).collect();
            let solved = &mut self.stations[station];
            for unknown in 0..width {
                let moved: Vec<Vec<(usize, Complex64)>> =
                    partials.iter().map(|partial| solved.moved_by(partial, unknown).collect()).collect();
                for (i, of_i) in moved.iter().enumerate() {
                    for (j, of_j) in moved.iter().enumerate() {
                        for ((order, a), (_, b)) in of_i.iter().zip(of_j) {
                            solved.widened[order * width + unknown] += (a * b.conj()).re * covariance[i][j];
                        }
                    }
                }
            }
        }
    }

    fn unexplained(&self) -> Vec<Unexplained> {
        let rig = &self.shared.selection.rig;
        let each = self.stations.iter().filter_map(|solved| strangers::where_from(solved, &self.layout, rig));
        let mut found: Vec<Unexplained> = each.collect();
        found.sort_by(|a, b| b.rms_um.total_cmp(&a.rms_um));
        found
    }

    fn told_apart_by(&self, effects: &[usize]) -> Option<String> {
        let on = |effect: &usize| self.shared.kind(*effect).about().acts_on;
        let more = if effects.iter().all(|effect| on(effect) == ActsOn::Sensor) {
            "a third sensor in the section"
        } else {
            "another setup with the part at an angle that no other setup has"
        };
        Some(format!("{more}; `runout plan` tries what helps"))
    }
}

impl Solved {
    /// How an unknown moves with a parameter, by order from 2: its operator on the readings' partials.
    fn moved_by<'a>(
        &'a self,
        partial: &'a [Complex64],
        unknown: usize,
    ) -> impl Iterator<Item = (usize, Complex64)> + 'a {
        let count = self.corrected.count;
        self.told_orders(unknown).map(move |order| {
            let row = &self.operators.orders[order - 1].operator[unknown * count..(unknown + 1) * count];
            let readings = &partial[order * count..(order + 1) * count];
            (order, row.iter().zip(readings).map(|(a, b)| a * b).sum())
        })
    }

    /// Orders from 2 at which an unknown can be told.
    fn told_orders(&self, unknown: usize) -> impl Iterator<Item = usize> + '_ {
        (2..=self.corrected.max_order).filter(move |order| self.operators.observable(*order)[unknown])
    }
}

/// RONt and root mean square of a form.
fn form_values(separation: &Separation, unknown: usize, place: &str) -> [Outcome; 2] {
    let width = separation.unknowns.len();
    let from_two = |(order, value)| if order < 2 { Complex64::ZERO } else { value };
    let harmonics = separation.coefficients(unknown).enumerate().map(from_two);
    let angles = (2 * separation.max_order() + 2).next_power_of_two();
    let form_um = Fourier::new(angles).synthesise(harmonics).to_vec();
    let rms = |profile: &[f64]| (profile.iter().map(|value| value * value).sum::<f64>() / angles as f64).sqrt();
    let variance: Vec<f64> = separation.variance.iter().skip(unknown).step_by(width).copied().collect();
    let values = |profile: &[f64]| [ront_lsci_um(profile), rms(profile)];
    let stds = uncertainty::monte_carlo(&form_um, &variance, uncertainty::seed(&[place]), values)
        .map_or([f64::NAN; 2], |found| found.map(|each| each.std));
    let [ront, form_rms] = values(&form_um);
    let outcome = |value: &str, number: f64, std: f64| Outcome {
        value: value.into(),
        section: Some(place.into()),
        number,
        std,
        unit: "um".into(),
    };
    [outcome("RONt", ront, stds[0]), outcome("form rms", form_rms, stds[1])]
}
