//! A spindle model fitted with effects applied.
//!
//! Long because what the loop asks of a fit is one trait.

use std::sync::Arc;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    closed_loop::{
        Bias, Fit, LookedAt, OpenWithinBound, Remainder, Setting,
        diagnosis::Unexplained,
        evidence::{Group, far_worse},
    },
    consistency::{Check, Test, linear},
    numerics::threads,
    separation::{Quantity, Residual, Separation},
    stage::Station,
};

use super::{
    FEWEST_SPREAD,
    data::{self, Shared, StationData},
    drift::Part,
    projection::project_some,
    remainder::remainder,
    solved::Solved,
    strangers,
};
use crate::{
    effects::{ActsOn, Alterations, Predicted},
    layout::{Layout, View},
    solve::{apply, by_reading},
};

/// A fit, and what its partials need.
pub struct SpindleFit {
    shared: Arc<Shared>,
    alterations: Alterations,
    layout: Layout,
    stations: Vec<Solved>,
    remainder: Remainder,
    /// Other fits between which and this one the data do not decide, and the weights of this one and of them.
    others: Vec<SpindleFit>,
    weights: Vec<f64>,
}

impl SpindleFit {
    pub(super) fn new(shared: Arc<Shared>, applied: &[Setting]) -> Result<Self> {
        let alterations = data::altered(&shared.layout, &shared.kinds, &shared.places, applied)?;
        if !alterations.are_possible() {
            return Err(Error::new("apply", "effects", "their values are beyond all bounds").of(ErrorKind::Numerical));
        }
        let layout = shared.layout.altered(&alterations);
        let mut stations =
            threads::spread(&shared.data, FEWEST_SPREAD, |data| Solved::new(&shared, data, &layout, &alterations));
        // The declared model's fit is what it is; values at which no solution settles are not those of an effect.
        if !applied.is_empty() && stations.iter().any(|solved| solved.estimate.is_unsettled()) {
            return Err(Error::new("apply", "effects", "no solution settles at their values").of(ErrorKind::Numerical));
        }
        let remainder = remainder(&shared, &stations, &layout, &alterations);
        // A loop holds several fits of all stations.
        for (solved, _) in stations.iter_mut().zip(&shared.data).filter(|(_, data)| data.part != Part::All) {
            solved.propagation = None;
        }
        shared.check_effects()?;
        Ok(Self { shared, alterations, layout, stations, remainder, others: Vec::new(), weights: vec![1.0] })
    }

    /// The layout with the effects applied, of this fit and of those that are mixed with it.
    pub fn layouts(&self) -> impl Iterator<Item = &Layout> {
        std::iter::once(&self.layout).chain(self.others.iter().map(|other| &other.layout))
    }

    /// Lowest and highest order at which a reading is redundant.
    pub(super) fn redundant(&self) -> Option<[usize; 2]> {
        let of_stations = self.stations.iter().filter_map(|station| station.residual.orders);
        of_stations.reduce(|[low, high], [lowest, highest]| [low.min(lowest), high.max(highest)])
    }

    /// χ² per degree of freedom as a run states it of each station, and of what single turns show beside; `None` where nothing is
    /// redundant or the noise is not known.
    ///
    /// The loop looks for effects with each order weighed by its own noise floor; what is printed, and what the verdict is taken from, is
    /// what a run states.
    pub(super) fn stated_chi2_per_dof(&self) -> Option<f64> {
        let (mut chi2, mut dof) = (0.0, 0);
        for (solved, data) in self.stations.iter().zip(&self.shared.data) {
            let level = &solved.residual;
            if level.dof > 0 {
                chi2 += level.chi2_per_dof * level.dof as f64;
                dof += level.dof;
            }
            let beside = data.beside_averages(&self.alterations);
            dof += beside.len();
            chi2 += beside.iter().map(|left| left * left).sum::<f64>();
        }
        (dof > 0).then(|| chi2 / dof as f64).filter(|chi2| chi2.is_finite())
    }

    /// How far form and motion of another fit are, root mean square over sections and directions, in µm.
    #[must_use]
    pub(super) fn apart_um(&self, other: &Self) -> [f64; 2] {
        let width = self.layout.unknowns.len();
        let (mut squares, mut counts) = ([0.0; 2], [0_usize; 2]);
        for (unknown, quantity) in self.layout.unknowns.iter().enumerate() {
            let place = match quantity {
                Quantity::Form(_) | Quantity::FaceForm(_) => 0,
                Quantity::X | Quantity::Y | Quantity::Z => 1,
                _ => continue,
            };
            counts[place] += self.stations.len();
            let each = self.differences(other).skip(unknown).step_by(width);
            squares[place] += each.map(|difference| difference.norm_sqr()).sum::<f64>();
        }
        [0, 1].map(|place| (0.5 * squares[place] / counts[place].max(1) as f64).sqrt())
    }

    /// Estimates less those of another fit, `[station][order from 1][unknown]`.
    fn differences<'a>(&'a self, other: &'a Self) -> impl Iterator<Item = Complex64> + 'a {
        // The unknown of a form is the conjugate where the part turns clockwise.
        let mirrored = self.layout.direction * other.layout.direction < 0.0;
        self.stations.iter().zip(&other.stations).flat_map(move |(solved, there)| {
            (1..=solved.corrected.max_order.min(there.corrected.max_order)).flat_map(move |order| {
                self.layout.unknowns.iter().enumerate().map(move |(unknown, quantity)| {
                    let value = there.estimate.observable_value(order, unknown);
                    let value = if mirrored && quantity.is_form() { value.conj() } else { value };
                    solved.estimate.observable_value(order, unknown) - value
                })
            })
        })
    }

    /// Highest order fitted.
    #[must_use]
    pub fn max_order(&self) -> usize {
        self.stations.iter().map(|station| station.corrected.max_order).max().unwrap_or(0)
    }

    fn predicted<'a>(&'a self, solved: &'a Solved) -> Predicted<'a> {
        Predicted::new(&self.layout, &solved.alterations, &solved.estimate, &solved.corrected)
    }

    fn partials(&self, effect: usize, station: usize) -> Vec<Vec<Complex64>> {
        let place = &self.shared.places[effect];
        self.shared.kind(effect).partials(place.index, &self.predicted(&self.stations[station]))
    }

    /// Form and motion, one entry a station.
    #[must_use]
    pub fn separations(&self, stations: &[Station]) -> Vec<Separation> {
        let others: Vec<Vec<Separation>> = self.others.iter().map(|other| other.own_separations(stations)).collect();
        let own = self.own_separations(stations).into_iter().enumerate();
        let mixture = |(station, own): (usize, Separation)| {
            let equivalents = others.iter().filter_map(|other| other.get(station).cloned());
            let all: Vec<Separation> = std::iter::once(own.clone()).chain(equivalents).collect();
            if all.len() == 1 { own } else { Separation::mixture(&self.weights, &all).unwrap_or(own) }
        };
        own.map(mixture).collect()
    }

    /// What a form that is declared within a bound, and taken as 0, may leave of a station. At order 1 it is clamping, but on the
    /// axis, where each order has the same share of z. Each part of a harmonic is as likely anywhere within half of the bound.
    fn declared_form(&self, section: usize, bound_um: f64, station: usize) -> OpenWithinBound {
        let layout = &self.layout;
        let (std_um, readings) = (bound_um / 12_f64.sqrt(), &layout.readings);
        let on_axis = readings.iter().any(|reading| reading.section == section && reading.view == View::OnAxis);
        let solved = &self.stations[station];
        let stations = self.remainder.structure.partitions.first();
        let before = stations.and_then(|parts| parts.level.iter().position(|at| *at == station)).unwrap_or(0);
        let form = Quantity::Form(section);
        let harmonic = |order: usize| {
            let seen: Vec<Complex64> =
                readings.iter().map(|reading| layout.coefficient(reading, form, order)).collect();
            let left = apply(&solved.whitened[order - 1], &seen);
            [Complex64::ONE, Complex64::I].map(|phase| {
                let mut column = vec![0.0; self.remainder.residual.len()];
                let place = before + 2 * (order - 1) * solved.corrected.count;
                for (entry, value) in column[place..].chunks_exact_mut(2).zip(&left) {
                    let value = std_um * phase * value;
                    entry.copy_from_slice(&[value.re, value.im]);
                }
                column
            })
        };
        let lowest = if on_axis { 1 } else { 2 };
        OpenWithinBound { harmonics: (lowest..=solved.signal_orders).map(harmonic).collect() }
    }

    /// Without what is mixed with it.
    fn own_separations(&self, stations: &[Station]) -> Vec<Separation> {
        let solver = self.shared.solver(&self.layout, &self.alterations);
        let each: Vec<(&Solved, &Station)> = self.stations.iter().zip(stations).collect();
        threads::spread(&each, FEWEST_SPREAD, |(solved, station)| {
            let propagation = solved.stated.as_ref().or(solved.propagation.as_ref());
            let by_reading = by_reading(&solved.operators, &solved.corrected, &solved.linear);
            let residual = Residual { by_reading, ..solved.residual.clone() };
            solver.report(station, &solved.operators, &solved.estimate, propagation, residual)
        })
    }
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
        let stations: Vec<(&Solved, &StationData)> = self.stations.iter().zip(&self.shared.data).collect();
        let of_station = |(solved, data): &(&Solved, &StationData)| {
            let partials = kind.partials(place.index, &self.predicted(solved));
            let columns = partials.iter().enumerate().map(|(parameter, partial)| {
                let mut column = Vec::new();
                // What the model predicts more of, the residual has less of.
                project_some(solved.traced(), partial, solved.corrected.count, |value| {
                    column.extend([-value.re, -value.im]);
                });
                column.extend(data.creeps.iter().map(|(sensor, _, std)| {
                    let creep = kind.creep_partials(place.index, *sensor).get(parameter).copied();
                    -creep.unwrap_or(0.0) / std
                }));
                column.extend(data.seen.lines.found.iter().map(|_| 0.0));
                column
            });
            columns.collect::<Vec<Vec<f64>>>()
        };
        for columns in threads::spread(&stations, FEWEST_SPREAD, of_station) {
            signature.iter_mut().zip(columns).for_each(|(column, of_station)| column.extend(of_station));
        }
        signature
    }

    fn bias(&self, effect: usize) -> Vec<Bias> {
        let place = &self.shared.places[effect];
        let mut biases = Vec::new();
        let Some(solved) = self.stations.first() else { return biases };
        let negligible_um = self.shared.kind(effect).negligible_um();
        for (partial, parameter) in self.partials(effect, 0).iter().zip(&place.effect.parameters) {
            let squares = partial.iter().map(Complex64::norm_sqr).sum::<f64>() / self.layout.readings.len() as f64;
            if (0.5 * squares).sqrt() * parameter.tolerance < negligible_um {
                continue;
            }
            let (mut form, mut shift, mut forms, mut shifts) = (0.0, 0.0, 0, 0);
            // The face and z, where the rig has an axial sensor.
            let (mut face, mut along, mut faces, mut alongs) = (0.0, 0.0, 0, 0);
            for (unknown, quantity) in self.layout.unknowns.iter().enumerate() {
                let squares: f64 = solved.moved_by(partial, unknown).map(|(_, value)| value.norm_sqr()).sum();
                match quantity {
                    Quantity::Form(_) => (form, forms) = (form + squares, forms + 1),
                    Quantity::FaceForm(_) => (face, faces) = (face + squares, faces + 1),
                    // Along the axis, the fundamental is motion.
                    Quantity::Z => {
                        let first = solved.first_moved_by(partial, &self.layout).map_or(0.0, |value| value.norm_sqr());
                        (along, alongs) = (along + squares + first, alongs + 1);
                    }
                    motion if motion.is_shift() => (shift, shifts) = (shift + squares, shifts + 1),
                    _ => {}
                }
            }
            let moved = [("form", form, forms), ("motion", shift, shifts), ("face", face, faces), ("z", along, alongs)];
            for (on, squares, count) in moved {
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
        let harmonics = self.stations.iter().flat_map(|solved| {
            self.layout.forms().flat_map(move |unknown| {
                (2..=solved.corrected.max_order).flat_map(move |order| {
                    let observable = solved.operators.observable(order)[unknown];
                    let value = if observable { solved.estimate.observable_value(order, unknown) } else { LOST };
                    [value.re, value.im]
                })
            })
        });
        harmonics.collect()
    }

    fn mix(&mut self, weights: &[f64], others: Vec<Self>) {
        self.weights = weights.to_vec();
        self.others = others;
    }

    fn open_within_bounds(&self) -> Vec<OpenWithinBound> {
        let of_section = |(section, bound_um)| {
            (0..self.stations.len()).map(move |station| self.declared_form(section, bound_um, station))
        };
        self.layout.declared_forms().flat_map(of_section).collect()
    }

    /// None: values of form and motion are those that a run computes from [`separations`](Self::separations).
    fn values(&self) -> Vec<LookedAt> {
        Vec::new()
    }

    fn consistency(&self) -> Vec<Check> {
        let rig = &self.shared.selection.rig;
        let several = self.stations.len() > 1;
        let each = self.stations.iter().zip(&self.shared.data).flat_map(|(solved, data)| {
            let residual = solved.residual.checks.iter().map(|check| {
                let beside = data.beside_averages(&self.alterations);
                let tested = if check.test == Test::Residual { with_beside(check, &beside) } else { check.clone() };
                tested.among(self.stations.len())
            });
            let turns = solved.corrected.courses.iter().zip(&rig.setups);
            let turns =
                turns.flat_map(|(course, setup)| course.checks.iter().map(|check| check.clone().within(&setup.id)));
            let checks = residual.chain(turns);
            checks.map(move |check| if several { check.within(&data.name) } else { check }).collect::<Vec<_>>()
        });
        each.collect()
    }

    fn widen(&mut self, effects: &[usize], covariance: &[Vec<f64>]) {
        let width = self.layout.unknowns.len();
        for station in 0..self.stations.len() {
            let partials: Vec<Vec<Complex64>> =
                effects.iter().flat_map(|effect| self.partials(*effect, station)).collect();
            let solved = &mut self.stations[station];
            let moved: Vec<Vec<Vec<(usize, Complex64)>>> = partials
                .iter()
                .map(|partial| (0..width).map(|unknown| solved.moved_by(partial, unknown).collect()).collect())
                .collect();
            let along_axis = self.layout.unknowns.contains(&Quantity::Z);
            let first: Vec<Vec<Complex64>> =
                partials.iter().filter(|_| along_axis).map(|partial| solved.first_moved(partial)).collect();
            for propagation in [&mut solved.propagation, &mut solved.stated].into_iter().flatten() {
                for (of_i, row) in first.iter().zip(covariance) {
                    for (of_j, entry) in first.iter().zip(row) {
                        let products = of_i.iter().flat_map(|a| of_j.iter().map(move |b| a * b.conj() * *entry));
                        propagation.covariance[0].iter_mut().zip(products).for_each(|(sum, product)| *sum += product);
                    }
                }
                for (of_i, row) in moved.iter().zip(covariance) {
                    for (of_j, entry) in moved.iter().zip(row) {
                        add_products(&mut propagation.covariance, [of_i, of_j], *entry);
                    }
                }
            }
        }
    }

    fn far_worse(&self) -> Vec<Unexplained> {
        // Where the noise is known, it says what is too much.
        if self.remainder.noise_is_known() {
            return Vec::new();
        }
        let captures =
            self.stations.iter().map(|solved| strangers::captures(solved, self.shared.selection.rig.setups.len()));
        let captures: Vec<Vec<Group>> = captures.collect();
        let setups = captures.first().map_or(1, Vec::len).max(1);
        let all = captures.concat();
        let found = far_worse(&all).into_iter().map(|capture| {
            let rms = |group: &Group| (0.5 * group.squares / group.freedom).sqrt();
            let mut others: Vec<f64> = all.iter().map(rms).collect();
            others.sort_by(f64::total_cmp);
            let (rms_um, median) = (rms(&all[capture]), others[others.len() / 2]);
            Unexplained {
                station: (self.shared.data.len() > 1).then(|| self.shared.data[capture / setups].name.clone()),
                sensor: None,
                setup: self.shared.selection.rig.setups.get(capture % setups).map(|setup| setup.id.clone()),
                orders: [1, self.max_order()],
                rms_um: rms_um * (self.max_order() as f64).sqrt(),
                place: format!("{:.1} times the median of {} captures", rms_um / median, all.len()),
            }
        });
        found.collect()
    }

    fn unexplained(&self) -> Vec<Unexplained> {
        let rig = &self.shared.selection.rig;
        // Of several stations, those that are not sound; all where each of them is and they are not together.
        let doubted = |solved: &Solved| solved.residual.checks.iter().any(Check::bars_verdict);
        let any = self.stations.iter().any(doubted);
        let stations = self.stations.iter().zip(&self.shared.data).filter(|(solved, _)| !any || doubted(solved));
        let each = stations.filter_map(|(solved, data)| {
            let station = (self.stations.len() > 1).then(|| data.name.clone());
            Some(Unexplained { station, ..strangers::where_from(solved, &self.layout, rig)? })
        });
        let mut found: Vec<Unexplained> = each.collect();
        found.sort_by(|a, b| b.rms_um.total_cmp(&a.rms_um));
        found
    }

    fn distinguished_by(&self, effects: &[usize]) -> Option<String> {
        let on = |effect: &usize| self.shared.kind(*effect).about().acts_on;
        let of_sensors = [ActsOn::Sensor, ActsOn::SensorInSetup, ActsOn::SensorPair, ActsOn::SensorCopy];
        let places = || effects.iter().map(|effect| &self.shared.places[*effect]);
        let of_one_sensor = places().all(|place| {
            on(&effects[0]) == ActsOn::Sensor
                && Some(&place.effect.targets) == places().next().map(|one| &one.effect.targets)
        });
        let more = if of_one_sensor {
            // Angles keep their size, delays and filters do not.
            "a recording at another speed"
        } else if effects.iter().all(|effect| of_sensors.contains(&on(effect))) {
            "a third sensor in the section"
        } else {
            "another setup with the part at an angle that no other setup has"
        };
        Some(format!("{more}; `runout plan` tries what helps"))
    }
}

/// The test of the residual, with what single turns show beside the averages.
fn with_beside(check: &Check, beside: &[f64]) -> Check {
    let [Some(dof), noise_dof] = [0, 1].map(|place| check.dof.get(place).copied()) else { return check.clone() };
    let (count, squares) = (beside.len() as f64, beside.iter().map(|left| left * left).sum::<f64>());
    let chi2_per_dof = (check.statistic * dof + squares) / (dof + count);
    linear::residual(chi2_per_dof, dof + count, noise_dof.unwrap_or(f64::INFINITY)).widening(check.factor)
}

/// An order that is not observable.
const LOST: Complex64 = Complex64::new(f64::NAN, f64::NAN);

/// Adds factor·a·bᴴ to each order's covariance of the unknowns, `[order from 1][unknown][unknown]`, for how these move,
/// `[unknown]`, by order.
fn add_products(covariance: &mut [Vec<Complex64>], [a, b]: [&[Vec<(usize, Complex64)>]; 2], factor: f64) {
    let width = a.len();
    for (row, of_row) in a.iter().enumerate() {
        for (column, of_column) in b.iter().enumerate() {
            let mut matching = of_column.iter().peekable();
            for (order, of_a) in of_row {
                while matching.next_if(|(other, _)| other < order).is_some() {}
                if let Some((_, of_b)) = matching.next_if(|(other, _)| other == order) {
                    covariance[order - 1][row * width + column] += of_a * of_b.conj() * factor;
                }
            }
        }
    }
}
