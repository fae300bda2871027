//! What a spindle model is fitted to: averaged readings, their weights, what noise lets expect of them.

use std::sync::Arc;

use runout_core::{Complex64, Result, model::Effect, stage::Station};

use super::{
    TRACED_ORDERS,
    changes::{self, Change},
    drift::Creeping,
    lines::{self, Line},
};
use crate::{
    effects::{Alterations, SpindleEffect},
    layout::Layout,
    selection::Selection,
    separators::{Blocks, Operators, Propagation, Readings, apply, smooth, whitening},
};

/// Orders to each side over which the noise in the residual's space is averaged, beyond what covariances are.
const FLOOR_SMOOTHING: usize = 4;

/// Everything about a measurement that no effect changes.
pub struct Shared {
    pub selection: Selection,
    /// As declared.
    pub layout: Layout,
    pub second_order: bool,
    pub kinds: Arc<[Arc<dyn SpindleEffect>]>,
    pub places: Vec<Place>,
    /// Of the places, for the loop.
    pub effects: Vec<Effect>,
    pub data: Vec<StationData>,
}

/// An effect at one of its targets.
#[derive(Debug, Clone)]
pub struct Place {
    /// Index into the kinds of effects.
    pub kind: usize,
    /// Index of the sensor or setup.
    pub index: usize,
    pub effect: Effect,
}

impl Shared {
    pub fn kind(&self, place: usize) -> &dyn SpindleEffect {
        &*self.kinds[self.places[place].kind]
    }

    /// What the user should know of the data.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.data.iter().any(|station| station.weights.is_none()) {
            warnings.push("there is no scatter over the turns to measure the noise by: record more turns".into());
        }
        if self.data.iter().any(|station| !station.creeps.is_empty() || !station.seen.lines.is_empty()) {
            let beside = "chi squared counts the drifts and lines that single turns show, beside what the fit leaves of the averages";
            warnings.push(beside.into());
        }
        if self.data.iter().any(|station| station.held_out.is_none()) {
            warnings.push("too few turns to hold any out: effects were accepted on the fitted turns alone".into());
        }
        warnings
    }
}

/// One station's readings.
pub struct StationData {
    pub name: String,
    pub z_mm: f64,
    pub readings: Readings,
    /// Turns that the fit does not see.
    pub held_out: Option<Readings>,
    /// W of each order from 1; nothing without a scatter.
    pub weights: Option<Vec<Blocks>>,
    /// Mean square of a weighted residual's degree of freedom, by order from 1: 1 for independent turns.
    pub floor: Vec<f64>,
    /// What the single turns show.
    pub seen: Arc<Seen>,
    /// Leak of each line into the readings.
    pub leaks: Vec<Vec<Complex64>>,
    /// Sensor, mean creep a turn and its standard uncertainty, where the levels tell a drift for certain: one observation
    /// more, since a creep of one sensor can look like a motion in the averaged turn.
    pub creeps: Vec<(usize, f64, f64)>,
}

/// What the single turns of a station show, and their average does not.
pub struct Seen {
    /// What their levels say of each sensor's creep.
    pub creeping: Vec<Option<Creeping>>,
    /// Changes within a setup.
    pub changes: Vec<Change>,
    /// Asynchronous lines.
    pub lines: Vec<Line>,
}

impl Seen {
    /// `creeping` is what the levels of all stations say of each sensor.
    pub fn new(selection: &Selection, layout: &Layout, station: &Station, creeping: &[Option<Creeping>]) -> Self {
        let max_order = station.profiles.iter().map(runout_core::profile::Profile::max_order).min().unwrap_or(0);
        Self {
            changes: changes::changes(selection, station, creeping),
            lines: lines::lines(selection, layout, station, max_order),
            creeping: creeping.to_vec(),
        }
    }
}

impl StationData {
    /// All turns and orders.
    pub fn whole(selection: &Selection, layout: &Layout, station: &Station, seen: &Arc<Seen>) -> Result<Self> {
        Self::new(selection, layout, station, station, None, Arc::clone(seen))
    }

    /// The turns to fit and those held out, low orders only; all turns where none are held out.
    pub fn split(selection: &Selection, layout: &Layout, station: &Station, seen: &Arc<Seen>) -> Result<Self> {
        let part = |which: fn(&runout_core::profile::Split) -> &runout_core::profile::Part| -> Option<Station> {
            let profile = |profile: &runout_core::profile::Profile| {
                let split = profile.split.as_ref()?;
                Some(split.profile(profile, which(split)))
            };
            let profiles = station.profiles.iter().map(profile).collect::<Option<_>>()?;
            Some(Station { name: station.name.clone(), z_mm: station.z_mm, profiles })
        };
        let (fit, held_out) = (part(|split| &split.fit), part(|split| &split.held_out));
        let mut data = {
            let fit = fit.as_ref().unwrap_or(station);
            Self::new(selection, layout, fit, station, held_out.as_ref(), Arc::clone(seen))?
        };
        data.readings.truncate(TRACED_ORDERS);
        if let Some(held_out) = &mut data.held_out {
            held_out.truncate(TRACED_ORDERS);
        }
        Ok(data)
    }

    fn new(
        selection: &Selection,
        layout: &Layout,
        fit: &Station,
        whole: &Station,
        held_out: Option<&Station>,
        seen: Arc<Seen>,
    ) -> Result<Self> {
        let mut readings = Readings::gather(selection, layout, fit)?;
        let all = std::ptr::eq(fit, whole);
        for (sensor, creeping) in seen.creeping.iter().enumerate() {
            if let Some(creeping) = creeping {
                creeping.take_out(&mut readings, sensor, all);
            }
        }
        let leaks = seen.lines.iter().map(|line| line.leak[if all { 2 } else { 0 }].clone()).collect();
        let creeps = seen.creeping.iter().enumerate().filter_map(|(sensor, creeping)| {
            let (creep, std) = creeping.filter(|creeping| creeping.certain)?.observed(all);
            Some((sensor, creep, std))
        });
        let creeps = creeps.collect();
        smooth(&mut readings);
        seen.changes.iter().for_each(|change| change.widen(&mut readings));
        let held_out = held_out.map(|station| Readings::gather(selection, layout, station)).transpose()?;
        let weights = whitening(&readings);
        let floor = weights.as_ref().map_or_else(Vec::new, |weights| floor(layout, &readings, weights));
        Ok(Self { name: whole.name.clone(), z_mm: whole.z_mm, seen, leaks, creeps, readings, held_out, weights, floor })
    }

    /// The station without its profiles.
    pub fn key(&self) -> Station {
        Station { name: self.name.clone(), z_mm: self.z_mm, profiles: Vec::new() }
    }

    /// W of an order from 1 for displacements: that of the readings times what they respond with.
    pub fn weights_of(&self, order: usize, layout: &Layout, alterations: &Alterations) -> Blocks {
        let response = |index: usize| alterations.sensors[layout.readings[index].sensor].response(order);
        let setups = self.readings.turns.len();
        let unweighted = || Blocks::identity(self.readings.count / setups, setups);
        let weights = self.weights.as_ref().map_or_else(unweighted, |weights| weights[order - 1].clone());
        weights.with_columns_scaled(response)
    }

    /// Noise of the residual's degrees of freedom at an order from 1, as a standard deviation of weighted residuals.
    pub fn floor_std(&self, order: usize) -> f64 {
        self.floor.get(order - 1).map_or(1.0, |square| square.sqrt())
    }
}

/// The covariance of the mean, projected to where the fit cannot reach, beside that of independent turns.
fn floor(layout: &Layout, readings: &Readings, weights: &[Blocks]) -> Vec<f64> {
    let operators = Operators::least_squares(layout, readings.max_order, Some(weights.to_vec()));
    let count = readings.count;
    let (mut sums, mut dofs) = (vec![0.0; readings.max_order], vec![0.0; readings.max_order]);
    if let Some(propagation) = Propagation::of(readings, &operators) {
        for (index, operator) in operators.orders.iter().enumerate().filter(|(_, operator)| operator.rank < count) {
            sums[index] = propagation.weighted_squares[index];
            dofs[index] = (count - operator.rank) as f64;
        }
    }
    let mean = |from: usize, to: usize| {
        let dof: f64 = dofs[from..to].iter().sum();
        if dof > 0.0 { sums[from..to].iter().sum::<f64>() / dof } else { 1.0 }
    };
    let orders = readings.max_order;
    (0..orders)
        .map(|index| {
            // What shakes the eccentricity shakes no other order.
            if index == 0 {
                return mean(0, 1);
            }
            mean(index.saturating_sub(FLOOR_SMOOTHING).max(1), (index + FLOOR_SMOOTHING + 1).min(orders))
        })
        .map(|square| if square > 0.0 { square } else { 1.0 })
        .collect()
}

/// Matrix (`[row][column]`) times each order's readings, into a harmonic array of the same shape.
pub fn project(
    matrices: &[Vec<Complex64>],
    harmonics: &[Complex64],
    count: usize,
    mut take: impl FnMut(usize, &[Complex64]),
) {
    for (index, matrix) in matrices.iter().enumerate() {
        let order = index + 1;
        take(order, &apply(matrix, &harmonics[order * count..(order + 1) * count]));
    }
}
