//! Drift from the levels of the turns (`runout_core::creep`): what it puts into averages and their noise.

use std::{ops::Range, sync::Arc};

use runout_core::{
    Complex64,
    creep::{Creep, Levels, creeps},
    level_step::level_step,
    neighbours::Neighbours,
    profile::TurnLevels,
    stage::Station,
};

use crate::selection::Selection;

/// Neighbouring levels that count as one observation.
const ALIKE: f64 = 4.0;

/// One sensor's creep in the captures of a station.
#[derive(Debug, Clone)]
pub(crate) struct Creeping {
    /// Of all stations.
    pub creep: Arc<Creep>,
    /// Place among the creep's captures of the station's first setup.
    first: usize,
    setups: Vec<Capture>,
    /// Stations that it is taken from.
    stations: usize,
    /// χ² of the levels of turns held out, about those of the turns fitted: without and with the creep.
    pub held_out: [f64; 2],
}

/// The turns of a capture.
#[derive(Debug, Clone)]
struct Capture {
    /// Turns since the first one at which each turn begins.
    starts: Vec<f64>,
    /// How many of them are fitted.
    fitted: usize,
}

impl Creeping {
    /// Places among the creep's captures of the station's setups.
    pub(crate) fn captures(&self) -> Range<usize> {
        self.first..self.first + self.setups.len()
    }

    pub(crate) fn certain(&self) -> bool {
        self.creep.certain
    }

    /// Creep over one turn of a setup, in µm.
    pub(crate) fn in_turn(&self, setup: usize, turn: usize) -> f64 {
        let start = self.setups.get(setup).and_then(|capture| capture.starts.get(turn)).copied().unwrap_or(turn as f64);
        self.creep.over(self.first + setup, start, start + 1.0)
    }

    /// Level and rise of some turns of a setup, in µm.
    fn course(&self, setup: usize, turns: Range<usize>) -> Vec<[f64; 2]> {
        let Some(capture) = self.setups.get(setup) else { return Vec::new() };
        let starts = capture.starts.get(turns).unwrap_or_default();
        let level = |start: f64| self.creep.over(self.first + setup, 0.0, start + 0.5) * (start + 0.5).max(1.0);
        let rise = |start: f64| self.creep.over(self.first + setup, start, start + 1.0);
        starts.iter().map(|start| [level(*start), rise(*start)]).collect()
    }

    fn turns(&self, setup: usize, part: Part) -> Range<usize> {
        let Some(Capture { starts, fitted }) = self.setups.get(setup) else { return 0..0 };
        match part {
            Part::Fitted => 0..*fitted,
            Part::HeldOut => *fitted..starts.len(),
            Part::All => 0..starts.len(),
        }
    }

    /// Mean creep a turn in a setup, in µm.
    fn mean(&self, setup: usize, part: Part) -> f64 {
        let course = self.course(setup, self.turns(setup, part));
        course.iter().map(|[_, rise]| rise).sum::<f64>() / course.len().max(1) as f64
    }

    /// Mean creep a turn where it is largest in any station, over all turns or those fitted, in µm.
    fn reference(&self, part: Part) -> f64 {
        let largest = self.creep.largest();
        let turns = match part {
            Part::All => self.creep.turns,
            _ => self.setups.iter().map(|capture| capture.fitted).max().unwrap_or(0) as f64,
        };
        self.creep.over(largest, 0.0, turns)
    }

    /// The reference creep and its standard uncertainty as one of the stations gives it, in µm a turn.
    pub(crate) fn observed(&self, part: Part) -> (f64, f64) {
        let creep = self.reference(part);
        let rate = self.creep.rates.get(self.creep.largest()).copied().unwrap_or(0.0);
        let share = if rate == 0.0 { 1.0 } else { creep / rate };
        (creep, (share * self.creep.rate_std).abs() * (self.stations as f64).sqrt())
    }

    /// Mean creep a turn in each setup, over the reference of the turns that are fitted to.
    pub(crate) fn shares(&self, of: Part, reference: Part) -> Vec<f64> {
        let reference = self.reference(reference);
        let share = |setup| if reference == 0.0 { 1.0 } else { self.mean(setup, of) / reference };
        (0..self.setups.len()).map(share).collect()
    }

    /// What it adds to the scatter of the mean over some turns of a setup, by order from 0: by how much the creep of its turns differs.
    pub(super) fn scatter(&self, setup: usize, part: Part, orders: usize) -> Vec<f64> {
        let mean = self.mean(setup, part);
        let course = self.course(setup, self.turns(setup, part));
        let turns = course.len().max(1) as f64;
        let spread = course.iter().map(|[_, rise]| (rise - mean).powi(2)).sum::<f64>() / (turns * turns);
        let of = |order: usize| if order < 2 { 0.0 } else { spread / (std::f64::consts::PI * order as f64).powi(2) };
        (0..orders).map(of).collect()
    }

    /// Takes it out of what stands beside whole orders in some turns of a setup, in one of their channels.
    pub(super) fn take_out_of(&self, neighbours: &mut Neighbours, setup: usize, part: Part, channel: usize) {
        neighbours.take_out_course(channel, &self.course(setup, self.turns(setup, part)));
    }
}

/// Which turns of a capture.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Part {
    /// Those that the loop fits.
    Fitted,
    /// Those that it does not.
    HeldOut,
    /// All of them.
    All,
}

/// What the levels of the turns say of each sensor's creep, `[station][sensor]`.
pub(crate) fn creeping(selection: &Selection, stations: &[Station]) -> Vec<Vec<Option<Creeping>>> {
    let of_capture = |sensor: usize, station: &Station, setup: &usize| -> Option<Levels> {
        let profile = station.profiles.iter().find(|profile| profile.setup == *setup)?;
        let channel = profile.sensors.iter().position(|known| *known == sensor)?;
        let turns = &profile.split.as_ref()?.turns;
        let mut levels = TurnLevels { numbers: turns.numbers.clone(), levels_um: turns.levels(channel).collect() };
        // A straight line through a step is no creep.
        if let Some(step) = level_step(&levels, 0, 1) {
            let after = levels.numbers.iter().zip(&mut levels.levels_um).filter(|(number, _)| **number > step.turn);
            after.for_each(|(_, level)| *level -= step.by_um);
        }
        Some(levels.of(0, 1))
    };
    let of_sensor = |sensor: &usize| -> Vec<Levels> {
        let captures = stations.iter().flat_map(|station| selection.setups.iter().map(move |setup| (station, setup)));
        let levels: Option<Vec<Levels>> =
            captures.map(|(station, setup)| of_capture(*sensor, station, setup)).collect();
        levels.unwrap_or_default()
    };
    let levels: Vec<Vec<Levels>> = selection.sensors.iter().map(of_sensor).collect();
    let creeps: Vec<Option<Arc<Creep>>> = creeps(&levels).into_iter().map(|creep| creep.map(Arc::new)).collect();
    let of_station = |(index, station): (usize, &Station)| {
        let setups = captures(selection, station);
        let each = creeps.iter().zip(&selection.sensors).map(|(creep, sensor)| {
            let mut creeping = Creeping {
                creep: Arc::clone(creep.as_ref()?),
                first: index * selection.setups.len(),
                setups: setups.clone()?,
                stations: stations.len(),
                held_out: [0.0; 2],
            };
            creeping.held_out = held_out(&creeping, selection, station, *sensor);
            Some(creeping)
        });
        each.collect()
    };
    stations.iter().enumerate().map(of_station).collect()
}

fn captures(selection: &Selection, station: &Station) -> Option<Vec<Capture>> {
    let capture = |setup: &usize| {
        let profile = station.profiles.iter().find(|profile| profile.setup == *setup)?;
        let split = profile.split.as_ref()?;
        let numbers = &split.turns.numbers;
        let starts = numbers.iter().map(|number| (number - numbers[0]) as f64).collect();
        Some(Capture { starts, fitted: split.fit.turns.len() })
    };
    selection.setups.iter().map(capture).collect()
}

/// χ² of the levels of the turns held out about those of the turns fitted, without and with the creep, in units of what the
/// creep leaves of the latter.
fn held_out(creeping: &Creeping, selection: &Selection, station: &Station, sensor: usize) -> [f64; 2] {
    let mut chi2 = [0.0; 2];
    for (index, setup) in selection.setups.iter().enumerate() {
        let Some(profile) = station.profiles.iter().find(|profile| profile.setup == *setup) else { continue };
        let Some(split) = &profile.split else { continue };
        let Some(channel) = profile.sensors.iter().position(|known| *known == sensor) else { continue };
        let levels: Vec<f64> = split.turns.levels(channel).collect();
        let course = creeping.course(index, 0..levels.len());
        let left: Vec<f64> = levels.iter().zip(&course).map(|(level, [course, _])| level - course).collect();
        let fitted = split.fit.turns.len().min(levels.len());
        let mean = |values: &[f64]| values[..fitted].iter().sum::<f64>() / fitted.max(1) as f64;
        let means = [mean(&levels), mean(&left)];
        let square = left[..fitted].iter().map(|value| (value - means[1]).powi(2)).sum::<f64>() / fitted.max(1) as f64;
        if square > 0.0 {
            for ((chi2, values), mean) in chi2.iter_mut().zip([&levels, &left]).zip(means) {
                *chi2 += values[fitted..].iter().map(|value| (value - mean).powi(2)).sum::<f64>() / (ALIKE * square);
            }
        }
    }
    chi2
}

/// Creep of a turn at an order, for what happens within turns.
pub(crate) fn in_turn(
    creeping: Option<&Creeping>,
    setup: usize,
    turn: usize,
    order: usize,
    angles: usize,
) -> Complex64 {
    let creep_um = creeping.filter(|known| known.certain()).map_or(0.0, |known| known.in_turn(setup, turn));
    creep_um * crate::effects::creep(order, angles)
}
