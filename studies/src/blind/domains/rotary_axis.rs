//! R-tests drawn by chance.

use std::collections::BTreeMap;

use runout_core::{Error, Result};
use runout_rotary_axis::{
    Axis, Ball, RotaryAxisConfig,
    simulate::{Commands, Harmonic, Scenario, SimulatedEffect},
};

use crate::{
    blind::{
        Kind,
        points::{Campaign, Domain, Planted, True},
    },
    chance::Chance,
};

/// R-tests.
pub(crate) const DOMAIN: Domain = Domain { name: "rotary-axis", draw };

/// Places of the balls along an axis' own frame, in mm: two across, one along.
struct Layout {
    name: &'static str,
    balls: &'static [[f64; 3]],
    /// Whether the balls stand at different heights along the axis.
    heights: bool,
    /// Whether all balls are measured forward before the way back.
    ball_by_ball: bool,
}

const LAYOUTS: [Layout; 3] = [
    Layout {
        name: "three balls at three heights",
        balls: &[[120.0, 0.0, 60.0], [-50.0, 95.0, 110.0], [-70.0, -80.0, 40.0]],
        heights: true,
        ball_by_ball: true,
    },
    Layout {
        name: "four balls, each forward and back at once",
        balls: &[[150.0, 20.0, 30.0], [-60.0, 110.0, 150.0], [-90.0, -70.0, 80.0], [40.0, -130.0, 190.0]],
        heights: true,
        ball_by_ball: false,
    },
    Layout {
        name: "three balls at one height",
        balls: &[[110.0, 0.0, 70.0], [-55.0, 95.0, 70.0], [-55.0, -95.0, 70.0]],
        heights: false,
        ball_by_ball: true,
    },
];

const EFFECTS: [&str; 7] = [
    "linear-axis-scale",
    "linear-axis-squareness",
    "thermal-drift linear",
    "thermal-drift exponential",
    "backlash",
    "nest-by-direction",
    "nest-step",
];
const STRANGERS: [&str; 2] = ["slipped-ball", "bad-reading"];
const COORDINATES: [&str; 3] = ["X", "Y", "Z"];
const COMMANDS: usize = 36;
const PASSES: usize = 2;

fn draw(kind: Kind, turn: usize, chance: &mut Chance) -> Result<Campaign> {
    let layout = &LAYOUTS[chance.below(LAYOUTS.len())];
    let axis = chance.one_of(&[Axis::A, Axis::B, Axis::C]);
    let mut scenario = sound(layout, axis, chance);
    let ids = match kind {
        Kind::Clean => Vec::new(),
        Kind::Single => vec![EFFECTS[turn % EFFECTS.len()]],
        Kind::Pair => chance.some_of(&EFFECTS, 2),
        Kind::Stranger => vec![STRANGERS[turn % STRANGERS.len()]],
    };
    let large = kind == Kind::Pair;
    let planted = ids.into_iter().map(|id| plant(id, large, layout, &mut scenario, chance)).collect();
    // The noise is stated, or found from repeats.
    let std_um = (chance.below(2) == 0).then_some(scenario.noise_um);
    let config = RotaryAxisConfig {
        axis,
        balls: scenario.balls.clone(),
        std_um,
        component_errors: true,
        tool_points: Vec::new(),
        curves: None,
    };
    let separator = config.separator().map_err(|fault| Error::new("check", "the balls", fault))?;
    Ok(Campaign {
        layout: layout.name,
        points: scenario.simulate().points(),
        separator: Box::new(separator),
        planted,
        natural: Vec::new(),
        truth: scenario.location.iter().map(|(symbol, value)| True::new(row_of(symbol), symbol, *value)).collect(),
    })
}

/// Offsets begin as EX, EY and EZ.
fn row_of(symbol: &str) -> &'static str {
    if symbol.starts_with("EX") || symbol.starts_with("EY") || symbol.starts_with("EZ") { "offsets" } else { "tilts" }
}

/// From (across, across, along) to the machine's coordinates.
fn outward(axis: Axis, place: [f64; 3]) -> [f64; 3] {
    let mut machine = [0.0; 3];
    for (value, coordinate) in place.into_iter().zip(axis.order()) {
        machine[coordinate] = value;
    }
    machine
}

fn sound(layout: &Layout, axis: Axis, chance: &mut Chance) -> Scenario {
    let balls: Vec<Ball> = (1..)
        .zip(layout.balls)
        .map(|(number, place)| {
            let [x_mm, y_mm, z_mm] = outward(axis, *place);
            Ball { id: format!("P{number}"), x_mm, y_mm, z_mm }
        })
        .collect();
    let symbols = axis.location_symbols();
    let sizes = [40.0, 40.0, 80.0, 80.0];
    let location: BTreeMap<String, f64> =
        symbols.into_iter().zip(sizes).map(|(symbol, size)| (symbol, chance.between(-size, size))).collect();
    let placement = balls.iter().map(|ball| (ball.id.clone(), [0; 3].map(|_| chance.between(-60.0, 60.0))));
    let placement = placement.collect();
    Scenario {
        axis,
        balls,
        commands: Commands { from_deg: 0.0, step_deg: 360.0 / COMMANDS as f64, count: COMMANDS },
        passes: PASSES,
        back_and_forth: true,
        ball_by_ball: layout.ball_by_ball,
        seconds_per_point: 8.0,
        noise_um: chance.size(0.4, 4.0),
        seed: chance.below(usize::MAX >> 1) as u64,
        location,
        component: component(axis, chance),
        random_component: 0.0,
        placement,
        effect: Vec::new(),
    }
}

/// Component errors without anything that is location or placement: across the axis from 2/rev on, along and about it from 1/rev.
fn component(axis: Axis, chance: &mut Chance) -> Vec<Harmonic> {
    let own = axis.order()[2];
    let symbols = axis.component_symbols();
    let mut all = Vec::new();
    for (index, error) in symbols.into_iter().enumerate() {
        let size = if index < 3 { 4.0 } else { 25.0 };
        let lowest = if index % 3 == own { 1 } else { 2 };
        for order in lowest..lowest + 3 {
            let [cosine, sine] = [0; 2].map(|_| chance.between(-size, size) / f64::from(order));
            all.push(Harmonic { error: error.clone(), order, cosine, sine });
        }
    }
    all
}

fn plant(id: &'static str, large: bool, layout: &Layout, scenario: &mut Scenario, chance: &mut Chance) -> Planted {
    let [one, other, own] = scenario.axis.order();
    let noise = scenario.noise_um;
    let rows = scenario.balls.len() * PASSES * COMMANDS;
    let (effect, planted) = match id {
        "linear-axis-scale" => {
            let target = COORDINATES[chance.one_of(&[one, other])].to_owned();
            let size = chance.signed(5.0 * noise, 400.0, large);
            let planted = Planted::effect(id, &target, format!("{size:.1} µm/m"), vec![("scale", size)]);
            (SimulatedEffect::LinearAxisScale { targets: [target], scale_um_per_m: size }, planted)
        }
        "linear-axis-squareness" => {
            // Squareness along the axis shows by balls at different heights only.
            let pairs: Vec<&str> = [("XY", 2), ("XZ", 1), ("YZ", 0)]
                .into_iter()
                .filter(|(_, left)| layout.heights || *left == own)
                .map(|(pair, _)| pair)
                .collect();
            let target = chance.one_of(&pairs).to_owned();
            let size = chance.signed(5.0 * noise, 400.0, large);
            let planted = Planted::effect(id, &target, format!("{size:.1} µrad"), vec![("angle", size)]);
            (SimulatedEffect::LinearAxisSquareness { targets: [target], angle_urad: size }, planted)
        }
        "thermal-drift linear" | "thermal-drift exponential" => {
            let target = chance.one_of(&["x", "y", "z"]);
            let size = chance.signed(1.5 * noise, 80.0, large);
            let constant = (id == "thermal-drift exponential").then(|| chance.size(0.06, 0.5));
            // A small one is as well described by the other course.
            let (words, courses) = match constant {
                Some(constant) => (format!("{size:.1} µm, {constant:.2} of the campaign"), ["exponential", "linear"]),
                None => (format!("{size:.1} µm"), ["linear", "exponential"]),
            };
            let names = courses.iter().map(|course| format!("thermal-drift {target} {course}")).collect();
            let mut parameters = vec![("drift", size)];
            parameters.extend(constant.map(|constant| ("time_constant", constant)));
            let planted = Planted { id, names, size: words, parameters, visible: None };
            let targets = [target.to_owned()];
            (SimulatedEffect::ThermalDrift { targets, drift_um: size, time_constant: constant }, planted)
        }
        "backlash" => {
            let size = chance.signed(6.0 * noise, 300.0, large);
            let planted = Planted::effect(id, "", format!("{size:.1} µrad"), vec![("lost_motion", size)]);
            (SimulatedEffect::Backlash { lost_motion_urad: size }, planted)
        }
        "nest-by-direction" => {
            let target = chance.one_of(&["x", "y", "z"]);
            let size = chance.signed(noise, 60.0, large);
            let planted = Planted::effect(id, target, format!("{size:.1} µm"), vec![("shift", size)]);
            (SimulatedEffect::NestByDirection { targets: [target.to_owned()], shift_um: size }, planted)
        }
        "nest-step" => {
            let (target, at) = (chance.one_of(&["x", "y", "z"]), chance.between(0.1, 0.9));
            let size = chance.signed(1.5 * noise, 60.0, large);
            let planted = Planted::effect(id, target, format!("{size:.1} µm at {at:.2}"), vec![("step", size)]);
            (SimulatedEffect::NestStep { targets: [target.to_owned()], step_um: size, at }, planted)
        }
        "slipped-ball" => {
            let row = chance.below(rows);
            let by_um = [0; 3].map(|_| chance.signed(noise, 60.0, false));
            let words = format!("by {by_um:.1?} µm from row {row}");
            (SimulatedEffect::SlippedBall { row, by_um }, Planted::stranger(id, words))
        }
        _ => {
            let row = chance.below(rows);
            let by_um = [0; 3].map(|_| chance.signed(2.0 * noise, 200.0, false));
            let words = format!("by {by_um:.1?} µm in row {row}");
            (SimulatedEffect::BadReading { row, by_um }, Planted::stranger("bad-reading", words))
        }
    };
    scenario.effect.push(effect);
    planted
}
