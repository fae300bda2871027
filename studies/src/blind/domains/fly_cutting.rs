//! Fly-cut surfaces drawn by chance.

use runout_core::{Error, Result, points::Points};
use runout_fly_cutting::{
    FlyCuttingConfig,
    simulate::{CutConfig, Direction, FlyCuttingScenario, GridConfig, SimulatedEffect},
};

use crate::{
    blind::{
        Kind,
        points::{Campaign, Domain, Planted},
    },
    chance::Chance,
};

/// Height maps.
pub(crate) const DOMAIN: Domain = Domain { name: "fly-cutting", draw };

/// Where a surface is measured.
struct Layout {
    name: &'static str,
    rows: usize,
    columns: usize,
    step_mm: [f64; 2],
    /// y of the first row, in mm.
    origin_y_mm: f64,
}

const LAYOUTS: [Layout; 3] = [
    Layout { name: "4 mm square", rows: 100, columns: 100, step_mm: [0.0397, 0.0397], origin_y_mm: 0.0 },
    Layout {
        name: "6 mm along the feed, 3 mm across",
        rows: 70,
        columns: 150,
        step_mm: [0.0401, 0.0437],
        origin_y_mm: -1.5,
    },
    Layout { name: "1 mm square", rows: 100, columns: 100, step_mm: [0.0103, 0.0103], origin_y_mm: 12.0 },
];

const EFFECTS: [&str; 7] = [
    "spindle-line",
    "spindle-line",
    "spindle-line tilt-x",
    "workpiece-tilt",
    "table-straightness",
    "feed-scale",
    "nose-radius",
];
const STRANGERS: [&str; 2] = ["scratch", "pit"];
const SPEEDS_RPM: [f64; 5] = [120.0, 200.0, 390.0, 500.0, 800.0];
/// Ratios that lines have at most.
const HIGHEST_RATIO: f64 = 4.0;
/// Periods of a line over the map, at least: with fewer it is a bend.
const FEWEST_PERIODS: f64 = 2.5;

fn draw(kind: Kind, turn: usize, chance: &mut Chance) -> Result<Campaign> {
    let layout = &LAYOUTS[chance.below(LAYOUTS.len())];
    let mut scenario = sound(layout, chance);
    let declared = scenario.cut.clone();
    let ids = match kind {
        Kind::Clean => Vec::new(),
        Kind::Single => vec![EFFECTS[turn % EFFECTS.len()]],
        Kind::Pair => chance.some_of(&EFFECTS[1..], 2),
        Kind::Stranger => vec![STRANGERS[turn % STRANGERS.len()]],
    };
    let large = kind == Kind::Pair;
    let planted = ids.into_iter().map(|id| plant(id, large, &mut scenario, chance)).collect();
    let config = FlyCuttingConfig {
        nose_radius_mm: declared.nose_radius_mm,
        feed_um_per_rev: declared.feed_um_per_rev,
        cutter_radius_mm: declared.cutter_radius_mm,
        speed_rpm: declared.speed_rpm,
        std_nm: None,
        max_frequency_ratio: 10,
    };
    let separator = config.separator().map_err(|fault| Error::new("check", "the cut", fault))?;
    let points = Points::of_grid(scenario.heights()?, "drawn".into());
    Ok(Campaign {
        layout: layout.name,
        points,
        separator: Box::new(separator),
        planted,
        natural: Vec::new(),
        truth: Vec::new(),
    })
}

fn sound(layout: &Layout, chance: &mut Chance) -> FlyCuttingScenario {
    let Layout { rows, columns, step_mm: [step_x_mm, step_y_mm], origin_y_mm, .. } = *layout;
    FlyCuttingScenario {
        noise_nm: chance.size(0.05, 1.0),
        seed: chance.below(usize::MAX >> 1) as u64,
        cut: CutConfig {
            nose_radius_mm: chance.between(3.0, 10.0),
            feed_um_per_rev: chance.between(5.0, 25.0),
            cutter_radius_mm: chance.between(120.0, 300.0),
            speed_rpm: chance.one_of(&SPEEDS_RPM),
        },
        grid: GridConfig { rows, columns, step_x_mm, step_y_mm, origin_x_mm: chance.between(-20.0, 20.0), origin_y_mm },
        ..FlyCuttingScenario::default()
    }
}

fn plant(id: &'static str, large: bool, scenario: &mut FlyCuttingScenario, chance: &mut Chance) -> Planted {
    let grid = scenario.grid.clone();
    let [length_x_mm, length_y_mm] =
        [grid.step_x_mm * (grid.columns - 1) as f64, grid.step_y_mm * (grid.rows - 1) as f64];
    let noise = scenario.noise_nm;
    let passes = 1e3 * length_x_mm / scenario.cut.feed_um_per_rev;
    let (effect, planted) = match id {
        "spindle-line" | "spindle-line tilt-x" => {
            let slip = FEWEST_PERIODS / passes;
            let ratio = loop {
                let ratio = chance.between(0.02, HIGHEST_RATIO);
                if (ratio - ratio.round()).abs() > slip {
                    break ratio;
                }
            };
            let amplitude_nm = chance.size(if large { 1.7 } else { 0.3 }, 10.0);
            let phase_deg = chance.between(-180.0, 180.0);
            let tilts = id == "spindle-line tilt-x";
            let farthest_mm = grid.origin_y_mm.abs().max((grid.origin_y_mm + length_y_mm).abs());
            let amplitude = if tilts { amplitude_nm / farthest_mm } else { amplitude_nm };
            let (target, direction) = if tilts { ("tilt-x", Direction::TiltX) } else { ("", Direction::Axial) };
            let parameters = vec![("frequency_ratio", ratio), ("amplitude", amplitude)];
            let words = format!("{amplitude_nm:.2} nm at {ratio:.4} per turn");
            let mut planted = Planted::effect("spindle-line", target, words, parameters);
            planted.id = id;
            let effect = SimulatedEffect::SpindleLine {
                frequency_hz: None,
                frequency_ratio: Some(ratio),
                direction,
                amplitude_nm: (!tilts).then_some(amplitude),
                amplitude_urad: tilts.then_some(amplitude),
                phase_deg,
                declared: false,
            };
            (effect, planted)
        }
        "workpiece-tilt" => {
            let [x_urad, y_urad] = [length_x_mm, length_y_mm]
                .map(|length_mm| chance.signed(noise, 300.0 * noise, large) / length_mm * 3.5);
            let planted =
                Planted::effect(id, "", format!("{x_urad:.3}, {y_urad:.3} µrad"), vec![("x", x_urad), ("y", y_urad)]);
            (SimulatedEffect::WorkpieceTilt { x_urad, y_urad, declared: false }, planted)
        }
        "table-straightness" => {
            let order = 2 + chance.below(4);
            let amplitude_nm = chance.signed(2.0 * noise, 200.0 * noise, large);
            let parameter = ["order_2", "order_3", "order_4", "order_5"][order - 2];
            let planted = Planted::effect(
                id,
                "",
                format!("order {order}, {amplitude_nm:.2} nm"),
                vec![(parameter, amplitude_nm)],
            );
            (SimulatedEffect::TableStraightness { order, amplitude_nm, declared: false }, planted)
        }
        "feed-scale" => {
            let scale_um_per_m = (1e6 * chance.signed(0.2, 10.0, large) / passes).clamp(-2e4, 2e4);
            let planted = Planted::effect(id, "", format!("{scale_um_per_m:.0} µm/m"), vec![("scale", scale_um_per_m)]);
            (SimulatedEffect::FeedScale { scale_um_per_m, declared: false }, planted)
        }
        "nose-radius" => {
            let change_mm = scenario.cut.nose_radius_mm * chance.signed(0.05, 0.4, large);
            let planted = Planted::effect(id, "", format!("{change_mm:.3} mm"), vec![("change", change_mm)]);
            (SimulatedEffect::NoseRadius { change_mm, declared: false }, planted)
        }
        "scratch" => {
            let depth_nm = noise * chance.size(5.0, 100.0);
            let mut end = || {
                [
                    grid.origin_x_mm + length_x_mm * chance.between(0.05, 0.95),
                    grid.origin_y_mm + length_y_mm * chance.between(0.05, 0.95),
                ]
            };
            let [from_mm, to_mm] = [end(), end()];
            let width_mm = grid.step_x_mm * chance.between(1.5, 5.0);
            let words = format!("{depth_nm:.1} nm deep");
            (SimulatedEffect::Scratch { from_mm, to_mm, width_mm, depth_nm }, Planted::stranger(id, words))
        }
        _ => {
            let depth_nm = noise * chance.size(6.0, 300.0);
            let at_mm = [
                grid.origin_x_mm + length_x_mm * chance.between(0.05, 0.95),
                grid.origin_y_mm + length_y_mm * chance.between(0.05, 0.95),
            ];
            let radius_mm = grid.step_x_mm * chance.between(1.5, 8.0);
            let words = format!("{depth_nm:.1} nm deep, {radius_mm:.3} mm");
            (SimulatedEffect::Pit { at_mm, radius_mm, depth_nm }, Planted::stranger("pit", words))
        }
    };
    scenario.effect.push(effect);
    planted
}
