//! The closed loop on spindle measurements.

mod beyond;
mod changes;
mod data;
mod declared;
mod drift;
mod fit;
mod lines;
mod mistakes;
mod projection;
mod remainder;
mod rig_keys;
mod said;
mod solved;
mod steadied;
mod strangers;
mod turn_observations;
mod weighed;

use std::sync::Arc;

use runout_core::{
    Complex64, Result,
    closed_loop::{
        self, Effect, Fit, Model, Setting, Settings,
        diagnosis::{Blind, Estimated, LostOrders, Unexplained, Verdict},
    },
    numerics::threads,
    separation::NOTHING_SEPARATED,
    stage::{Station, StationDiagnosis},
};

use crate::{
    effects::{ActsOn, Alterations, SpindleEffect, TurnEvidence},
    layout::Layout,
    selection::Selection,
    sizes, wiring,
};
use changes::Change;
use data::{Shared, StationData};
pub use declared::DeclaredSpindle;
pub use fit::SpindleFit;
use turn_observations::TurnObservations;

/// Orders that take part in tracing: form lives in the low ones, and time grows with their number.
const TRACED_ORDERS: usize = 255;

/// A spindle measurement as a model that the loop can run on.
pub struct SpindleModel {
    /// The turns that are fitted, and those held out.
    traced: Arc<Shared>,
    /// All turns, all orders.
    whole: Option<Box<SpindleModel>>,
}

impl SpindleModel {
    /// From averaged stations; profiles with a [`split`](runout_core::profile::Profile::split) hold turns out.
    ///
    /// # Errors
    /// When the profiles do not fit the rig.
    pub fn new(
        selection: Selection,
        layout: Layout,
        second_order: bool,
        effects: Vec<Arc<dyn SpindleEffect>>,
        stations: &[Station],
    ) -> Result<Self> {
        let effects: Arc<[Arc<dyn SpindleEffect>]> = effects.into();
        let places = places(&effects, &selection, &layout, second_order);
        let creeping = drift::creeping(&selection, stations);
        let seen = stations.iter().zip(creeping);
        let seen = seen.map(|(station, creeping)| {
            let seen = TurnObservations::new(&selection, &layout, station, creeping);
            (station, Arc::new(seen))
        });
        let seen: Vec<(&Station, Arc<TurnObservations>)> = seen.collect();
        let each = |data: fn(&Selection, &Layout, &Station, &Arc<TurnObservations>) -> Result<StationData>| {
            let all = threads::spread(&seen, FEWEST_SPREAD, |(station, seen)| data(&selection, &layout, station, seen));
            all.into_iter().collect::<Result<Vec<_>>>()
        };
        let (all, split) = (each(StationData::whole)?, each(StationData::split)?);
        let whole = Shared {
            effects: places.iter().map(|place| place.effect.clone()).collect(),
            data: all,
            selection: selection.clone(),
            layout: layout.clone(),
            second_order,
            places,
            kinds: Arc::clone(&effects),
        };
        let traced = Shared {
            data: split,
            places: whole.places.clone(),
            effects: whole.effects.clone(),
            selection,
            layout,
            second_order,
            kinds: effects,
        };
        let whole = Self { traced: Arc::new(whole), whole: None };
        Ok(Self { traced: Arc::new(traced), whole: Some(Box::new(whole)) })
    }

    /// Whether all effects could say what they do.
    ///
    /// # Errors
    /// When one of them failed.
    pub(crate) fn check_effects(&self) -> Result<()> {
        self.traced.check_effects()
    }

    /// Mistakes in the rig file that leave no trace in these data, and what they do to form or motion, in µm rms.
    ///
    /// # Errors
    /// When the model cannot be fitted.
    pub fn traceless_mistakes(&self) -> Result<Vec<Blind>> {
        self.unobservable(&[])
    }
}

/// Stations from which on a fit spreads them over all processors.
const FEWEST_SPREAD: usize = 8;
/// Fits that a loop holds at a time, and one more: that of a trial beside the best so far, and what a final one is mixed with.
const FITS: usize = 4;

impl SpindleModel {
    /// Memory that a loop takes a station, about, in bytes: `[readings, sensors, unknowns]` of a layout.
    fn bytes(orders: usize, [readings, sensors, unknowns]: [usize; 3]) -> u64 {
        // Matrices of a setup: covariance, scatter and weights of the turns fitted, covariance of those held out; covariance and
        // weights of all turns.
        let data = 6 * readings * sensors + 3 * readings;
        // Operator, its covariance, whitened residual; readings and estimate.
        let fit = unknowns * readings + unknowns * unknowns + readings * readings + 3 * readings + unknowns;
        // Form and motion before and after, with their covariance.
        let results = 2 * (unknowns * unknowns + 2 * unknowns);
        (orders * (data + FITS * fit + results) * size_of::<Complex64>()) as u64
    }
}

/// Each effect at each of its targets. The first setup is what the others are counted from.
fn places(
    kinds: &[Arc<dyn SpindleEffect>],
    selection: &Selection,
    layout: &Layout,
    second_order: bool,
) -> Vec<data::Place> {
    let rig = &selection.rig;
    let mut places = Vec::new();
    for (kind, effect) in kinds.iter().enumerate() {
        let about = effect.about();
        // Nothing can lack what it has.
        if effect.is_declared(layout, second_order) {
            continue;
        }
        let targets = about.acts_on.targets(rig.sensors.len(), rig.setups.len());
        let suited = targets.into_iter().filter(|index| effect.suits(*index, layout));
        places.extend(suited.map(|index| {
            let targets = about.acts_on.ids(index, rig);
            data::Place {
                kind,
                index,
                effect: Effect { id: about.id.into(), targets, parameters: about.parameters.clone() },
            }
        }));
    }
    places
}

/// Lines of TOML that declare an effect in the rig, at the values that are applied.
fn declared_by(
    selection: &Selection,
    layout: &Layout,
    kinds: &[Arc<dyn SpindleEffect>],
    places: &[data::Place],
    effect: usize,
    applied: &[Setting],
) -> Vec<String> {
    let of = |place: &data::Place| {
        if let Some(mistake) = kinds[place.kind].mistake() {
            return Some(mistake.change(place.index, &selection.rig, &selection.sensors, &selection.setups));
        }
        let key = kinds[place.kind].rig_key()?;
        let alterations = data::altered(layout, kinds, places, applied).ok()?;
        Some(rig_keys::lines(selection, &alterations, key, place.index))
    };
    places.get(effect).and_then(of).unwrap_or_default()
}

impl Model for SpindleModel {
    type Fit = SpindleFit;

    fn effects(&self) -> &[Effect] {
        &self.traced.effects
    }

    fn fit(&self, applied: &[Setting]) -> Result<SpindleFit> {
        SpindleFit::new(Arc::clone(&self.traced), applied)
    }

    fn is_possible(&self, effect: usize, values: &[f64]) -> bool {
        let (kind, layout) = (self.traced.kind(effect), &self.traced.layout);
        let mut alterations = Alterations::none(layout);
        kind.alter(self.traced.places[effect].index, values, &mut alterations);
        // A sensor that is farther off than sensors are apart is in another section, or on no part.
        let span_mm = layout.span_mm();
        let are_on_the_part = alterations.sensors.iter().all(|sensor| sensor.z_mm.abs() <= span_mm);
        kind.is_possible(values) && alterations.are_possible() && are_on_the_part
    }

    fn size(&self, effect: usize, values: &[f64]) -> f64 {
        self.traced.kind(effect).size(values)
    }

    fn start(&self, effect: usize, _fit: &SpindleFit, applied: &[Setting]) -> Option<Vec<f64>> {
        let (kind, place) = (self.traced.kind(effect), &self.traced.places[effect]);
        let values = kind.far_values();
        let data = self.traced.data.first().filter(|_| !values.is_empty())?;
        let (alterations, alter) = (self.alterations(applied), |value: f64, alterations: &mut Alterations| {
            kind.alter(place.index, &[value], alterations);
        });
        let weights = data.weights.as_deref();
        let far = wiring::far_value(&self.traced.layout, &alterations, &data.readings, weights, &values, alter)?;
        Some(vec![far])
    }

    fn is_seen_besides(&self, effect: usize) -> bool {
        of_turns(self, &self.traced.places[effect])
    }

    fn is_one_of_many(&self, effect: usize) -> bool {
        self.traced.kind(effect).is_one_of_many()
    }

    fn is_mistake(&self, effect: usize) -> bool {
        self.traced.kind(effect).mistake().is_some()
    }

    fn suspected_mistakes(&self, applied: &[Setting]) -> Vec<Vec<usize>> {
        self.suspects(applied)
    }

    fn parts(&self, effect: usize) -> Vec<usize> {
        let (whole, about) = (self.traced.kind(effect), self.traced.kind(effect).about());
        if about.acts_on != ActsOn::Rig || whole.order().is_none() {
            return Vec::new();
        }
        let of_a_setup = |place: &usize| {
            let kind = self.traced.kind(*place);
            kind.about().acts_on == ActsOn::Setup && kind.about().id == about.id && kind.order() == whole.order()
        };
        (0..self.traced.places.len()).filter(of_a_setup).collect()
    }

    fn present(&self, effect: usize, estimated: Vec<Estimated>) -> Vec<Estimated> {
        self.traced.kind(effect).present(estimated)
    }

    fn last_of_list(&self, effect: usize) -> Option<String> {
        self.traced.kind(effect).last_of_list()
    }

    fn changes(&self, effect: usize, applied: &[Setting]) -> Vec<String> {
        let Shared { selection, layout, kinds, places, .. } = &*self.traced;
        declared_by(selection, layout, kinds, places, effect, applied)
    }

    fn whole(&self) -> &Self {
        self.whole.as_deref().unwrap_or(self)
    }

    fn is_spread(&self) -> bool {
        self.traced.data.len() >= FEWEST_SPREAD
    }
}

/// Runs the loop on averaged stations; `settings` count the effects as [`DeclaredSpindle`] does.
///
/// # Errors
/// When the profiles do not fit the rig.
pub fn diagnose(
    selection: Selection,
    layout: Layout,
    second_order: bool,
    effects: Vec<Arc<dyn SpindleEffect>>,
    stations: &[Station],
    settings: &Settings,
) -> Result<StationDiagnosis> {
    run(&SpindleModel::new(selection, layout, second_order, effects, stations)?, stations, settings)
}

/// Runs the loop on a model; of the stations, their splits are not needed any more.
fn run(model: &SpindleModel, stations: &[Station], settings: &Settings) -> Result<StationDiagnosis> {
    let changes: Vec<&Change> = model.traced.data.iter().flat_map(|station| &station.seen.changes).collect();
    // What a sensor or its neighbour lacks in all setups cannot be distinguished from what happened to it in one.
    let sensors = &model.traced.selection.rig.sensors;
    let section = |sensor: usize| sensors.get(sensor).map(|sensor| sensor.section);
    let slipped = |place: &data::Place| {
        model.traced.kinds[place.kind].about().acts_on == ActsOn::Sensor
            && changes.iter().any(|change| section(change.sensor) == section(place.index))
    };
    // Turns that show how a sensor's level goes show whether it drifts: a wander leaks into the mean as a drift does.
    let creeping = model.traced.data.first().map_or(&[][..], |station| &station.seen.creeping);
    let steady = |place: &data::Place| {
        let creeping = creeping.get(place.index).and_then(Option::as_ref);
        model.traced.kinds[place.kind].turn_evidence() == Some(TurnEvidence::Levels)
            && creeping.is_some_and(|creeping| !creeping.certain())
    };
    // Lines are there or not, and of one kind: what no station has is no candidate.
    let no_line = |place: &data::Place| {
        let kind = &*model.traced.kinds[place.kind];
        let sensor = (kind.about().acts_on == ActsOn::Sensor).then_some(place.index);
        kind.line().is_some_and(|number| {
            let has = |station: &StationData| {
                let line = station.seen.lines.found.get(number);
                line.is_some_and(|line| line.row().0 == sensor)
            };
            !model.traced.data.iter().any(has)
        })
    };
    let not_shown = |place: &data::Place| no_line(place) || steady(place);
    let left_out = |place: &data::Place| not_shown(place) || (slipped(place) && !of_turns(model, place));
    let places = model.traced.places.iter().enumerate().filter(|(_, place)| left_out(place));
    let left_out = places.map(|(index, _)| index).chain(settings.left_out.iter().copied()).collect();
    // What single turns show for certain leaves room for what only averages show.
    let shown = model.traced.places.iter().filter(|place| of_turns(model, place) && !not_shown(place));
    let max_added = settings.max_added + shown.count();
    let closed = closed_loop::diagnose(model, &Settings { left_out, max_added, ..settings.clone() })?;
    model.check_effects()?;
    let mut diagnosis = closed.diagnosis;
    said::say_drifts(&mut diagnosis, &model.traced);
    said::say_lines(&mut diagnosis, &model.traced, stations);
    // The values of one member of a confounded set are conditional on a choice that the data do not make.
    for added in diagnosis.added.iter_mut().filter(|added| !added.confounded_with.is_empty()) {
        added.parameters.iter_mut().for_each(|parameter| parameter.std = None);
    }
    let selection = &model.traced.selection;
    let within = model.traced.data.iter().zip(stations).flat_map(|(data, station)| {
        let changes = &data.seen.changes;
        let said = changes.iter().map(|change| change.said(selection));
        let name = (stations.len() > 1).then(|| station.name.clone());
        let all = said.chain(changes::level_steps(selection, station, changes));
        all.map(move |one| Unexplained { station: name.clone(), ..one })
    });
    let changes: Vec<Unexplained> = within.collect();
    if !changes.is_empty() {
        if closed.after.remainder().noise_is_known() {
            diagnosis.verdict = Verdict::Unexplained;
        }
        diagnosis.unexplained.splice(..0, changes);
    }
    diagnosis.warnings.extend(model.advice(&closed.settings));
    model.join_swaps(&mut diagnosis, &closed.settings);
    diagnosis.blind_to.extend(model.unobservable(&closed.settings)?);
    diagnosis.blind_to.extend(model.beyond_the_layout(&closed.after));
    diagnosis.lost_orders = Some(lost_orders(&closed.after));
    for (level, fit) in [(&mut diagnosis.before, &closed.before), (&mut diagnosis.after, &closed.after)] {
        level.orders = fit.redundant();
        level.chi2_per_dof = level.chi2_per_dof.and(fit.stated_chi2_per_dof());
    }
    let rig = &model.traced.selection.rig;
    for data in &model.traced.data {
        let said = wiring::copies(rig, &data.readings).into_iter().chain(sizes::mistaken_units(rig, &data.readings));
        diagnosis.warnings.extend(said.map(|check| check.finding));
        diagnosis.warnings.extend(sizes::unusual_sizes(rig, &data.readings));
    }
    let highest = TRACED_ORDERS.min(closed.after.max_order());
    if model.traced.layout.assess(highest).has_no_observable_form() {
        // Single turns may show a drift or a line all the same; the averaged turn shows nothing.
        diagnosis.nothing_separated = true;
        diagnosis.verdict = if diagnosis.added.is_empty() { Verdict::NothingFound } else { Verdict::Improved };
        diagnosis.warnings.insert(0, NOTHING_SEPARATED.into());
    }
    diagnosis.warnings.extend(model.traced.warnings());
    Ok(StationDiagnosis {
        diagnosis,
        before: closed.before.separations(stations),
        after: closed.after.separations(stations),
    })
}

/// Whether single turns show an effect.
fn of_turns(model: &SpindleModel, place: &data::Place) -> bool {
    model.traced.kinds[place.kind].turn_evidence().is_some()
}

fn lost_orders(fit: &SpindleFit) -> LostOrders {
    let (mut form, mut motion) = (Vec::new(), Vec::new());
    for layout in fit.layouts() {
        let assessment = layout.assess(TRACED_ORDERS.min(fit.max_order()));
        form.extend(assessment.lost_form_orders());
        motion.extend(assessment.lost_motion_orders());
    }
    for orders in [&mut form, &mut motion] {
        orders.sort_unstable();
        orders.dedup();
    }
    LostOrders::of([("form", form), ("motion", motion)])
}
