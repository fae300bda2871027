//! The closed loop on spindle measurements.

mod changes;
mod data;
mod declared;
mod drift;
mod fit;
mod lines;
mod strangers;

use std::sync::Arc;

use runout_core::{
    Result,
    model::{
        Effect, Model, Setting,
        closed_loop::{self, Settings},
        diagnosis::{Estimated, LostOrders, Unexplained, Verdict},
    },
    stage::{Station, StationDiagnosis},
};

use crate::{
    effects::{ActsOn, SpindleEffect},
    layout::Layout,
    selection::Selection,
};
use changes::Change;
use data::{Seen, Shared, StationData};
pub use declared::DeclaredSpindle;
pub use fit::SpindleFit;

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
        let seen = |station| Arc::new(Seen::new(&selection, &layout, station, &creeping));
        let seen: Vec<Arc<Seen>> = stations.iter().map(seen).collect();
        let each = |data: fn(&Selection, &Layout, &Station, &Arc<Seen>) -> Result<StationData>| {
            let stations = stations.iter().zip(&seen);
            stations.map(|(station, seen)| data(&selection, &layout, station, seen)).collect::<Result<Vec<_>>>()
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
        let targets: Vec<(usize, Option<String>)> = match about.acts_on {
            ActsOn::Sensor => rig.sensors.iter().map(|sensor| Some(sensor.id.clone())).enumerate().collect(),
            ActsOn::LaterSetup => rig.setups.iter().map(|setup| Some(setup.id.clone())).enumerate().skip(1).collect(),
            ActsOn::Rig => vec![(0, None)],
        };
        places.extend(targets.into_iter().map(|(index, target)| data::Place {
            kind,
            index,
            effect: Effect { id: about.id.into(), target, parameters: about.parameters.clone() },
        }));
    }
    places
}

impl Model for SpindleModel {
    type Fit = SpindleFit;

    fn effects(&self) -> &[Effect] {
        &self.traced.effects
    }

    fn fit(&self, applied: &[Setting]) -> Result<SpindleFit> {
        SpindleFit::new(Arc::clone(&self.traced), applied)
    }

    fn present(&self, effect: usize, estimated: Vec<Estimated>) -> Vec<Estimated> {
        self.traced.kind(effect).present(estimated)
    }

    fn whole(&self) -> &Self {
        self.whole.as_deref().unwrap_or(self)
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
    let model = SpindleModel::new(selection, layout, second_order, effects, stations)?;
    let changes: Vec<&Change> = model.traced.data.iter().flat_map(|station| &station.seen.changes).collect();
    // What a sensor or its neighbour lacks in all setups cannot be told from what happened to it in one.
    let sensors = &model.traced.selection.rig.sensors;
    let section = |sensor: usize| sensors.get(sensor).map(|sensor| sensor.section);
    let slipped = |place: &data::Place| {
        model.traced.kinds[place.kind].about().acts_on == ActsOn::Sensor
            && changes.iter().any(|change| section(change.sensor) == section(place.index))
    };
    // Turns that tell how a sensor's level goes tell whether it drifts: a wander leaks into the mean as a drift does.
    let creeping = model.traced.data.first().map_or(&[][..], |station| &station.seen.creeping);
    let steady = |place: &data::Place| {
        let creeping = creeping.get(place.index).and_then(Option::as_ref);
        model.traced.kinds[place.kind].about().id == "thermal-drift"
            && creeping.is_some_and(|creeping| !creeping.certain)
    };
    let places = model.traced.places.iter().enumerate().filter(|(_, place)| slipped(place) || steady(place));
    let left_out = places.map(|(index, _)| index).chain(settings.left_out.iter().copied()).collect();
    let closed = closed_loop::diagnose(&model, &Settings { left_out, ..settings.clone() })?;
    let mut diagnosis = closed.diagnosis;
    drift::say_rates(&mut diagnosis, &model.traced);
    lines::say(&mut diagnosis, &model.traced, closed.after.lines());
    let changes: Vec<Unexplained> = changes.iter().map(|change| change.said(&model.traced.selection)).collect();
    if !changes.is_empty() {
        diagnosis.verdict = Verdict::Unexplained;
        diagnosis.unexplained.splice(..0, changes);
    }
    diagnosis.lost_orders = Some(lost_orders(&closed.after));
    diagnosis.warnings.extend(model.traced.warnings());
    Ok(StationDiagnosis {
        diagnosis,
        before: closed.before.separations(stations),
        after: closed.after.separations(stations),
    })
}

fn lost_orders(fit: &SpindleFit) -> LostOrders {
    let assessment = fit.layout().assess(TRACED_ORDERS.min(fit.max_order()));
    LostOrders { form: assessment.lost_form_orders(), motion: assessment.lost_motion_orders() }
}
