//! What a spindle model is fitted to: averaged readings, their weights, what is expected of them from noise.

use std::sync::Arc;

use runout_core::{
    Complex64, Error, ErrorKind, Result,
    closed_loop::{Effect, Setting},
    profile::{self, Profile, Split},
    stage::Station,
};

use super::{
    TRACED_ORDERS,
    drift::Part,
    steadied::steadied,
    turn_observations::TurnObservations,
    weighed::{Weighed, floor},
};
use crate::{
    effects::{Alterations, SpindleEffect, TurnEvidence},
    layout::Layout,
    selection::Selection,
    solve::{Blocks, Readings, smooth_by_order},
};

/// Everything about a measurement that no effect changes.
pub(crate) struct Shared {
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

impl Shared {
    /// What single turns show of the effect of an id.
    pub(crate) fn turn_evidence(&self, id: &str) -> Option<TurnEvidence> {
        self.kinds.iter().find(|kind| kind.about().id == id)?.turn_evidence()
    }
}

/// An effect at one of its targets.
#[derive(Debug, Clone)]
pub(crate) struct Place {
    /// Index into the kinds of effects.
    pub kind: usize,
    /// Index of the sensor or setup.
    pub index: usize,
    pub effect: Effect,
}

/// What effects at these places change together.
///
/// # Errors
/// When there is no such effect.
pub(crate) fn altered(
    layout: &Layout,
    kinds: &[Arc<dyn SpindleEffect>],
    places: &[Place],
    applied: &[Setting],
) -> Result<Alterations> {
    let mut alterations = Alterations::none(layout);
    for setting in applied {
        let place = places.get(setting.effect).ok_or_else(|| {
            Error::new("apply", format!("effect {}", setting.effect), "there is no such effect in this rig")
                .of(ErrorKind::Configuration)
        })?;
        kinds[place.kind].alter(place.index, &setting.values, &mut alterations);
    }
    Ok(alterations)
}

impl Shared {
    pub(crate) fn kind(&self, place: usize) -> &dyn SpindleEffect {
        &*self.kinds[self.places[place].kind]
    }

    /// # Errors
    /// When one of the effects cannot say what it does.
    pub(crate) fn check_effects(&self) -> Result<()> {
        self.kinds.iter().find_map(|kind| kind.failure()).map_or(Ok(()), Err)
    }

    /// What the user should know of the data.
    pub(crate) fn warnings(&self) -> Vec<String> {
        let mut warnings = Vec::new();
        if self.data.iter().any(|station| station.weights.is_none()) {
            warnings.push("there is no scatter over the turns to measure the noise by: record more turns".into());
        }
        if self.data.iter().any(StationData::is_seen_besides) {
            let beside = "chi squared counts the drifts, phases and lines that single turns show, beside what the fit leaves of the averages";
            warnings.push(beside.into());
        }
        if self.data.iter().any(|station| station.held_out.is_none()) {
            warnings.push("too few turns for held-out data: effects were accepted on the fitted turns alone".into());
        }
        warnings
    }
}

/// One station's readings.
pub(crate) struct StationData {
    pub name: String,
    /// The turns that are fitted.
    pub part: Part,
    pub readings: Readings,
    /// Turns that the fit does not see.
    pub held_out: Option<Readings>,
    /// W of each order from 1; nothing without a scatter.
    pub weights: Option<Vec<Blocks>>,
    /// Mean square of a weighted residual's degree of freedom, by order from 1: 1 for independent turns.
    floor: Vec<f64>,
    /// Share of the readings' variance that lost orders carry into an order from 1.
    carried: Vec<f64>,
    /// The highest order that says something of effects, which change what readings have: above it there is noise only, which each model fits in its own
    /// way, so that chance would decide between them.
    pub signal_orders: usize,
    /// All of it where motion is no longer assumed to be odd, and even orders are lost.
    freed: Option<Box<Weighed>>,
    /// What the single turns show.
    pub seen: Arc<TurnObservations>,
    /// Leak of each line into the readings.
    pub leaks: Vec<Vec<Complex64>>,
    /// Sensor, mean creep a turn where it is largest and its standard uncertainty, where the levels show a drift for certain: one observation
    /// more, since a creep of one sensor can look like a motion in the averaged turn.
    pub creeps: Vec<(usize, f64, f64)>,
    /// Covariance of the averages with the drifts and lines that single turns show still in it.
    recorded: Option<Vec<Vec<Complex64>>>,
}

impl StationData {
    /// All turns and orders.
    pub(crate) fn whole(
        selection: &Selection,
        layout: &Layout,
        station: &Station,
        seen: &Arc<TurnObservations>,
    ) -> Result<Self> {
        let of = |station: &Station| Self::new(selection, layout, station, None, Part::All, Arc::clone(seen));
        let mut data = if seen.is_steady() {
            of(station)?
        } else {
            let steadied = |profile: &Profile| {
                let neighbours = profile.split.as_ref().and_then(|split| split.neighbours.as_ref());
                let whole = Profile { split: None, ..profile.clone() };
                steadied(whole, neighbours, selection, seen, Part::All)
            };
            let profiles = station.profiles.iter().map(steadied).collect();
            let steadied = of(&Station { name: station.name.clone(), z_mm: station.z_mm, profiles })?;
            Self { recorded: of(station)?.readings.covariance, ..steadied }
        };
        // The weights are made of it, and nothing else is.
        data.readings.scatter = None;
        data.freed.iter_mut().for_each(|freed| freed.readings.scatter = None);
        Ok(data)
    }

    /// The turns to fit and those held out, low orders only; all turns where none are held out.
    pub(crate) fn split(
        selection: &Selection,
        layout: &Layout,
        station: &Station,
        seen: &Arc<TurnObservations>,
    ) -> Result<Self> {
        let part = |part: Part, which: fn(&Split) -> &profile::Part| -> Option<Station> {
            let profile = |profile: &Profile| {
                let split = profile.split.as_ref()?;
                let turns = which(split);
                Some(steadied(split.profile(profile, turns), turns.neighbours.as_ref(), selection, seen, part))
            };
            let profiles = station.profiles.iter().map(profile).collect::<Option<_>>()?;
            Some(Station { name: station.name.clone(), z_mm: station.z_mm, profiles })
        };
        let fit = part(Part::Fitted, |split| &split.fit);
        let held_out = part(Part::HeldOut, |split| &split.held_out);
        let fitted = if fit.is_some() { Part::Fitted } else { Part::All };
        let station = fit.as_ref().unwrap_or(station);
        let mut data = Self::new(selection, layout, station, held_out.as_ref(), fitted, Arc::clone(seen))?;
        data.truncate(TRACED_ORDERS);
        Ok(data)
    }

    fn new(
        selection: &Selection,
        layout: &Layout,
        fit: &Station,
        held_out: Option<&Station>,
        part: Part,
        seen: Arc<TurnObservations>,
    ) -> Result<Self> {
        let mut readings = Readings::gather(selection, layout, fit)?;
        let leaks = seen.lines.found.iter().map(|line| line.leak(part, readings.max_order)).collect();
        let creeps = seen.creeping.iter().enumerate().filter_map(|(sensor, creeping)| {
            let (creep, std) = creeping.as_ref().filter(|creeping| creeping.certain())?.observed(part);
            Some((sensor, creep, std))
        });
        let creeps = creeps.collect();
        smooth_by_order(&mut readings);
        seen.changes.iter().for_each(|change| change.widen(&mut readings));
        let held_out = held_out.map(|station| Readings::gather(selection, layout, station)).transpose()?;
        let held_out = held_out.map(|readings| Readings { scatter: None, ..readings });
        let freed = layout.assumes_odd_motion().then(|| {
            let freed = Alterations { even_order_motion: true, ..Alterations::none(layout) };
            Box::new(Weighed::new(&layout.altered(&freed), readings.clone()))
        });
        let Weighed { readings, weights, floor, carried } = Weighed::new(layout, readings);
        let name = fit.name.clone();
        let recorded = None;
        let signal_orders = signal_orders(&readings, weights.as_deref(), &floor);
        Ok(Self {
            name,
            part,
            readings,
            held_out,
            weights,
            floor,
            carried,
            signal_orders,
            freed,
            seen,
            leaks,
            creeps,
            recorded,
        })
    }

    /// Effects as they act on the turns fitted, or on those held out: a creep differs between setups and slows down.
    pub(crate) fn altered(&self, alterations: &Alterations, turns: Part) -> Alterations {
        let mut altered = alterations.clone();
        for (sensor, creeping) in altered.sensors.iter_mut().zip(&self.seen.creeping) {
            sensor.creep_shares = creeping.as_ref().map_or_else(Vec::new, |creeping| creeping.shares(turns, self.part));
        }
        altered
    }

    /// What effects leave of the drifts and lines that single turns show, in standard uncertainties.
    pub(crate) fn beside_averages(&self, alterations: &Alterations) -> Vec<f64> {
        let creeps =
            self.creeps.iter().map(|(sensor, creep, std)| (creep - alterations.sensors[*sensor].creep_um) / std);
        let lines = self.seen.lines.found.iter().enumerate().map(|(number, line)| {
            let (sensor, evidence) = line.row();
            if alterations.lines.contains(&(number, sensor)) { 0.0 } else { evidence.sqrt() }
        });
        creeps.chain(lines).collect()
    }

    /// Whether single turns show what the average of the turns does not.
    fn is_seen_besides(&self) -> bool {
        !self.creeps.is_empty() || !self.seen.lines.found.is_empty()
    }

    /// Leaves out the orders above `max_order`.
    fn truncate(&mut self, max_order: usize) {
        self.readings.truncate(max_order);
        self.signal_orders = self.signal_orders.min(max_order);
        self.held_out.iter_mut().for_each(|held_out| held_out.truncate(max_order));
        self.freed.iter_mut().for_each(|freed| freed.readings.truncate(max_order));
    }

    /// The readings, with the uncertainty that they have where some effects are applied.
    pub(crate) fn readings(&self, alterations: &Alterations) -> &Readings {
        self.freed(alterations).map_or(&self.readings, |freed| &freed.readings)
    }

    /// The covariance of the averages as recorded, where a drift or a line that single turns show is not taken out of them: its leak is in
    /// the averages, and belongs to their uncertainty.
    pub(crate) fn recorded_covariance(&self, alterations: &Alterations) -> Option<&Vec<Vec<Complex64>>> {
        let drifts = self.creeps.iter().any(|(sensor, ..)| alterations.sensors[*sensor].creep_um == 0.0);
        let mut lines = self.seen.lines.found.iter().enumerate();
        let stays = drifts || lines.any(|(number, line)| !alterations.lines.contains(&(number, line.row().0)));
        self.recorded.as_ref().filter(|_| stays)
    }

    /// Share of the variance at an order from 1 that lost orders carry into it.
    pub(crate) fn carried(&self, order: usize, alterations: &Alterations) -> f64 {
        let carried = self.freed(alterations).map_or(&self.carried, |freed| &freed.carried);
        carried.get(order - 1).copied().unwrap_or(0.0)
    }

    fn freed(&self, alterations: &Alterations) -> Option<&Weighed> {
        self.freed.as_deref().filter(|_| alterations.even_order_motion)
    }

    /// W of an order from 1 for displacements: that of the readings times what they respond with, and the slope of their characteristic.
    pub(crate) fn weights_of(
        &self,
        order: usize,
        layout: &Layout,
        alterations: &Alterations,
        slopes: &[f64],
    ) -> Blocks {
        let response = |index: usize| alterations.response(&layout.readings[index], order) * slopes[index];
        let setups = self.readings.turns.len();
        let unweighted = || Blocks::identity(self.readings.count / setups, setups);
        let weights = self.freed(alterations).map_or(&self.weights, |freed| &freed.weights);
        let weights = weights.as_ref().map_or_else(unweighted, |weights| weights[order - 1].clone());
        let weights = weights.with_columns_scaled(response).conjugate_in(|setup| alterations.setups[setup].backwards);
        weights.with_shares(&alterations.cross_talk)
    }

    /// Noise of the residual's degrees of freedom, by order from 1, as a standard deviation of weighted residuals: `corrected` are the
    /// readings as displacements, with their weights.
    pub(crate) fn floor_std(
        &self,
        layout: &Layout,
        alterations: &Alterations,
        corrected: &Readings,
        weights: &[Blocks],
    ) -> Vec<f64> {
        let squares = if alterations.are_mistakes() && self.weights.is_some() {
            // Beside a wrong sign or place the fit cannot reach motion that it otherwise can.
            floor(layout, corrected, weights)
        } else {
            self.freed(alterations).map_or(&self.floor, |freed| &freed.floor).clone()
        };
        let each = (0..self.readings.max_order).map(|index| squares.get(index).map_or(1.0, |square| square.sqrt()));
        each.collect()
    }
}

/// Patterns of single orders are looked for below this one, whatever readings have there.
const LOW_ORDERS: usize = 16;
/// Standard deviations by which the mean square of an order's weighted readings is above that of noise where it is no noise: noise alone is in one of
/// 10 000 orders of two readings, and more seldom of several.
const STANDING_OUT: f64 = 7.0;

/// The highest order at which readings stand out from their noise; all orders where that is not known.
fn signal_orders(readings: &Readings, weights: Option<&[Blocks]>, floor: &[f64]) -> usize {
    let Some(weights) = weights else { return readings.max_order };
    let count = readings.count as f64;
    let stands_out = |order: &usize| {
        let weighted = weights[order - 1].times(readings.order(*order), 1);
        let square = weighted.iter().map(Complex64::norm_sqr).sum::<f64>() / (count * floor[order - 1]);
        square > 1.0 + STANDING_OUT / count.sqrt()
    };
    let highest = (1..=readings.max_order).rev().find(stands_out).unwrap_or(0);
    highest.max(LOW_ORDERS).min(readings.max_order)
}
