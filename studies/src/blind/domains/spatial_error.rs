//! Machines whose error over the travel is measured, drawn by chance.

use runout_core::{Error, Result, pipeline::Context};
use runout_spatial_error::{
    Query, SpatialErrorConfig,
    simulate::{Layout, Scenario, SimulatedEffect},
};

use crate::{
    blind::{
        Kind,
        points::{Campaign, Domain, Planted, True},
    },
    chance::Chance,
    spatial::{
        known::Known,
        machine::{self, TRAVEL_MM},
    },
};

/// Readings of a tracker over the travel.
pub(crate) const DOMAIN: Domain = Domain { name: "spatial-error", draw };

const EFFECTS: [&str; 8] =
    ["scale", "squareness", "positioning", "straightness", "angular", "thermal-drift", "axis-pitch", "tracker-step"];
const STRANGERS: [&str; 3] = ["step", "displaced-box", "pass-swapped"];
/// χ², by the true covariance, from which something shows beside the field.
const VISIBLE: f64 = 60.0;
/// Coarse: predictions are not judged here.
const GRID_MM: [f64; 3] = [300.0, 200.0, 175.0];

fn draw(kind: Kind, turn: usize, chance: &mut Chance) -> Result<Campaign> {
    let mut scenario = machine::draw(chance, None);
    // The noise is found from repeats.
    scenario.passes = scenario.passes.max(2);
    let ids = match kind {
        Kind::Clean => Vec::new(),
        Kind::Single => vec![EFFECTS[turn % EFFECTS.len()]],
        Kind::Pair => chance.some_of(&EFFECTS, 2),
        Kind::Stranger => vec![STRANGERS[turn % STRANGERS.len()]],
    };
    let large = kind == Kind::Pair;
    let mut planted: Vec<Planted> = ids.into_iter().map(|id| plant(id, large, &mut scenario, chance)).collect();
    let made = scenario.simulate();
    let known =
        Known::new(&scenario, &made).ok_or_else(|| Error::new("invert", "the true covariance", "it is singular"))?;
    for (index, planted) in planted.iter_mut().enumerate() {
        planted.visible = Some(visibility(&scenario, index, &known, made.time_s.len()) > VISIBLE);
    }
    let is_grid = matches!(scenario.layout, Layout::Grid { .. });
    // Few equal distances show no period: there the screw's lead is declared.
    let pitch_mm = if is_grid { leads(&scenario) } else { [0.0; 3] };
    let query = Query { grid_mm: Some(GRID_MM), path: None };
    let config = SpatialErrorConfig { query, pitch_mm, ..SpatialErrorConfig::default() };
    let context = Context { folder: std::path::Path::new("."), rig: None };
    let separator = config.separator(&context).map_err(|fault| Error::new("check", "the kriging", fault))?;
    // The placement counts from the middle of the measured volume, which of scattered places is not that of the travel.
    let truth = if is_grid { placement(&scenario) } else { Vec::new() };
    Ok(Campaign {
        layout: if is_grid { "grid" } else { "scattered places" },
        points: made.points(),
        separator: Box::new(separator),
        planted,
        natural: Vec::new(),
        truth,
    })
}

fn leads(scenario: &Scenario) -> [f64; 3] {
    ["X", "Y", "Z"].map(|axis| {
        let of = |effect: &SimulatedEffect| match effect {
            SimulatedEffect::AxisPitch { targets: [target], period_mm, .. } if target == axis => Some(*period_mm),
            _ => None,
        };
        scenario.effect.iter().find_map(of).unwrap_or(0.0)
    })
}

fn placement(scenario: &Scenario) -> Vec<True> {
    let shifts = ["TX", "TY", "TZ"].into_iter().zip(scenario.placement.shift_um);
    let turns = ["RX", "RY", "RZ"].into_iter().zip(scenario.placement.turn_urad);
    let shifts = shifts.map(|(symbol, value)| True::new("displacements of the placement", symbol, value));
    shifts.chain(turns.map(|(symbol, value)| True::new("rotations of the placement", symbol, value))).collect()
}

/// χ² of what one of the effects adds to the readings: beside the field, or, of a drift, in the repeats.
fn visibility(scenario: &Scenario, index: usize, known: &Known, readings: usize) -> f64 {
    if let SimulatedEffect::PassSwapped { passes: [one, other] } = &scenario.effect[index] {
        // Passes in one order hold the same readings.
        return if one == other || scenario.random_order { f64::INFINITY } else { 0.0 };
    }
    let noise_um = scenario.tracker.noise_um.hypot(2.0 * scenario.tracker.angle_urad);
    let repeated = readings as f64 * (1.0 - 1.0 / scenario.passes as f64) / 2.0;
    match &scenario.effect[index] {
        SimulatedEffect::ThermalDrift { drift_um, .. } => return (drift_um / noise_um).powi(2) / 12.0 * repeated,
        SimulatedEffect::TrackerStep { at, by_um } => {
            let squares: f64 = by_um.iter().map(|by| (by / noise_um).powi(2)).sum();
            return squares * at * (1.0 - at) * repeated;
        }
        _ => {}
    }
    let quiet = Scenario { field: None, effect: vec![scenario.effect[index].clone()], ..scenario.clone() };
    let without = Scenario { effect: Vec::new(), ..quiet.clone() };
    let [with, without] = [quiet, without].map(|scenario| scenario.simulate());
    known.visibility(&|place| {
        let (with, without) = (with.truth_um(place), without.truth_um(place));
        [0, 1, 2].map(|axis| with[axis] - without[axis])
    })
}

fn plant(id: &'static str, large: bool, scenario: &mut Scenario, chance: &mut Chance) -> Planted {
    let noise_um = scenario.tracker.noise_um;
    let size = chance.signed(2.0 * noise_um, 25.0 * noise_um, large);
    // Orders count over the measured volume, which scattered places do not fill.
    let is_grid = matches!(scenario.layout, Layout::Grid { .. });
    let of_order = |target: &str, order: u32, name: &'static str, value: f64, unit: &str| {
        let mut parameters = vec![("order", f64::from(order))];
        parameters.extend(is_grid.then_some((name, value)));
        let mut planted = Planted::effect(id, target, format!("order {order}, {value:.1} {unit}"), parameters);
        // A confounded set holds it with its order.
        planted.names.push(format!("{id} {target} order {order}"));
        planted
    };
    let (effect, planted) = match id {
        "scale" => {
            let target = chance.one_of(&["X", "Y", "Z"]);
            let scale_um_per_m = 4.0 * size;
            let planted =
                Planted::effect(id, target, format!("{scale_um_per_m:.1} µm/m"), vec![("scale", scale_um_per_m)]);
            (SimulatedEffect::Scale { targets: [target.into()], scale_um_per_m }, planted)
        }
        "squareness" => {
            let target = chance.one_of(&["XY", "XZ", "YZ"]);
            let angle_urad = 4.0 * size;
            let planted = Planted::effect(id, target, format!("{angle_urad:.1} µrad"), vec![("angle", angle_urad)]);
            (SimulatedEffect::Squareness { targets: [target.into()], angle_urad }, planted)
        }
        "positioning" => {
            let target = chance.one_of(&["EXX", "EYY", "EZZ"]);
            let order = 2 + chance.below(2) as u32;
            let planted = of_order(target, order, "amplitude", size, "µm");
            (SimulatedEffect::Positioning { targets: [target.into()], order, amplitude_um: size }, planted)
        }
        "straightness" => {
            let target = chance.one_of(&["EYX", "EZX", "EXY", "EZY", "EXZ", "EYZ"]);
            let order = 2 + chance.below(2) as u32;
            let planted = of_order(target, order, "amplitude", size, "µm");
            (SimulatedEffect::Straightness { targets: [target.into()], order, amplitude_um: size }, planted)
        }
        "angular" => {
            let target = chance.one_of(&["EAX", "EBX", "ECX", "EAY", "EBY"]);
            let (order, amplitude_urad) = (1 + chance.below(2) as u32, 5.0 * size);
            let planted = of_order(target, order, "amplitude", amplitude_urad, "µrad");
            (SimulatedEffect::Angular { targets: [target.into()], order, amplitude_urad }, planted)
        }
        "thermal-drift" => {
            let target = chance.one_of(&["x", "y", "z"]);
            let planted = Planted::effect(id, target, format!("{size:.1} µm"), vec![("change", size)]);
            let targets = [target.to_owned()];
            (SimulatedEffect::ThermalDrift { targets, drift_um: size, time_constant: None }, planted)
        }
        "axis-pitch" => {
            let target = chance.one_of(&["X", "Y", "Z"]);
            let period_mm = chance.size(7.0, 45.0);
            let mut parameters = vec![("amplitude", size.abs())];
            parameters.extend((!is_grid).then_some(("period", period_mm)));
            let mut planted = Planted::effect(id, target, format!("{size:.1} µm, {period_mm:.2} mm"), parameters);
            planted.names.push(format!("{id} {target} period {period_mm:.2} mm"));
            let phase_deg = if size < 0.0 { 180.0 } else { 0.0 };
            let targets = [target.to_owned()];
            (SimulatedEffect::AxisPitch { targets, period_mm, amplitude_um: size.abs(), phase_deg }, planted)
        }
        "pass-swapped" => {
            let passes = [1, 1 + chance.below(2)];
            let words = if passes[0] == passes[1] { "pass 1 in reverse order" } else { "passes 1 and 2" };
            (SimulatedEffect::PassSwapped { passes }, Planted::stranger(id, words.into()))
        }
        "tracker-step" => {
            let at = chance.between(0.1, 0.9);
            let by_um = [size, size * chance.between(-1.0, 1.0), size * chance.between(-1.0, 1.0)];
            let parameters = ["step_x", "step_y", "step_z"].into_iter().zip(by_um).collect();
            let planted = Planted::effect(id, "", format!("by {by_um:.1?} µm at {at:.2}"), parameters);
            (SimulatedEffect::TrackerStep { at, by_um }, planted)
        }
        _ => {
            let field = scenario.field.as_ref().map_or([0.0; 3], |field| field.std_um);
            let largest = field.into_iter().fold(3.0 * noise_um, f64::max);
            let by_um = [0; 3].map(|_| 3.0 * largest * chance.signed(0.2, 1.5, false));
            let words = format!("by {by_um:.1?} µm");
            let effect = if id == "step" {
                let axis = chance.below(3);
                let at_mm = TRAVEL_MM[axis] * chance.between(0.25, 0.75);
                SimulatedEffect::Step { axis: ["X", "Y", "Z"][axis].into(), at_mm, by_um }
            } else {
                let share = chance.between(0.35, 0.55);
                SimulatedEffect::DisplacedBox {
                    from_mm: [-1.0; 3],
                    to_mm: TRAVEL_MM.map(|length| share * length),
                    by_um,
                }
            };
            (effect, Planted::stranger(id, words))
        }
    };
    scenario.effect.push(effect);
    planted
}
