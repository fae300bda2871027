//! Touches of a ring drawn by chance.

use std::f64::consts::TAU;

use runout_core::{Error, Result};
use runout_touch_probe::{
    SetupConfig, TouchProbeConfig,
    simulate::{Placed, Ring, TouchProbeScenario, Wave},
};

use crate::{
    blind::{
        Kind,
        points::{Campaign, Domain, Planted, True},
    },
    chance::Chance,
};

/// Touch-trigger probes.
pub(crate) const DOMAIN: Domain = Domain { name: "touch-probe", draw };

/// How ring and probe are turned, in degrees.
struct Layout {
    name: &'static str,
    turned: &'static [(f64, f64)],
    directions: usize,
    /// Whether the machine's errors show.
    machine: bool,
}

const LAYOUTS: [Layout; 2] = [
    Layout {
        name: "six setups, ring and probe turned",
        turned: &[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0), (0.0, 70.0), (140.0, 70.0), (40.0, 205.0)],
        directions: 60,
        machine: true,
    },
    Layout {
        name: "four setups, ring turned",
        turned: &[(0.0, 0.0), (100.0, 0.0), (217.0, 0.0), (311.0, 0.0)],
        directions: 72,
        machine: false,
    },
];

const EFFECTS: [&str; 6] =
    ["axis-scale", "thermal-drift", "axis-squareness", "lobing-order", "axis-reversal", "ring-form-order"];
/// Those that show without a turned probe.
const STILL: [&str; 3] = ["thermal-drift", "lobing-order", "ring-form-order"];
const STRANGERS: [&str; 5] = ["chip", "chip in one setup", "bent ring", "slipped ring", "ring slipped between repeats"];
const MAX_ORDER: usize = 15;
/// Directions over which truth is summed.
const DENSE: usize = 360;

fn draw(kind: Kind, turn: usize, chance: &mut Chance) -> Result<Campaign> {
    let ids = match kind {
        Kind::Clean => Vec::new(),
        Kind::Single => vec![EFFECTS[turn % EFFECTS.len()]],
        Kind::Pair => chance.some_of(&EFFECTS, 2),
        Kind::Stranger => vec![STRANGERS[turn % STRANGERS.len()]],
    };
    let still = ids.iter().all(|id| STILL.contains(id) || STRANGERS.contains(id));
    let layout = if still { &LAYOUTS[chance.below(LAYOUTS.len())] } else { &LAYOUTS[0] };
    assert!(still || layout.machine);
    let mut scenario = sound(layout, chance);
    let large = kind == Kind::Pair;
    let planted = ids.into_iter().map(|id| plant(id, large, &mut scenario, chance)).collect();
    let config = TouchProbeConfig {
        ring_radius_mm: scenario.ring_radius_mm,
        setups: (scenario.setups.iter())
            .map(|setup| SetupConfig { id: setup.id.clone(), ring_deg: setup.ring_deg, probe_deg: setup.probe_deg })
            .collect(),
        max_order: MAX_ORDER,
        ring_form_um: None,
        std_um: None,
    };
    let separator = config.separator().map_err(|fault| Error::new("check", "the setups", fault))?;
    Ok(Campaign {
        layout: layout.name,
        points: scenario.touched().points(),
        separator: Box::new(separator),
        planted,
        natural: natural(&scenario),
        truth: truth(&scenario),
    })
}

/// Lobing that is smaller does not show in any of the campaigns.
const SMALL_UM: f64 = 0.02;

/// Orders of lobing above those declared that the seats of the probe make by themselves.
fn natural(scenario: &TouchProbeScenario) -> Vec<String> {
    let orders = MAX_ORDER + 1..=2 * MAX_ORDER;
    orders
        .filter(|order| amplitude_um(scenario, *order) > SMALL_UM)
        .map(|order| format!("lobing-order-{order}"))
        .collect()
}

/// Amplitude of lobing, by sums over the circle.
fn amplitude_um(scenario: &TouchProbeScenario, order: usize) -> f64 {
    let part = |wave: fn(f64) -> f64| part_um(scenario, order, wave);
    part(f64::cos).hypot(part(f64::sin))
}

fn part_um(scenario: &TouchProbeScenario, order: usize, wave: fn(f64) -> f64) -> f64 {
    let at = |index: usize| TAU * index as f64 / DENSE as f64;
    let products = (0..DENSE).map(|index| scenario.pretravel_um(at(index)) * wave(at(order * index)));
    2.0 / DENSE as f64 * products.sum::<f64>()
}

fn sound(layout: &Layout, chance: &mut Chance) -> TouchProbeScenario {
    let mut setups = Vec::new();
    for (index, (ring_deg, probe_deg)) in layout.turned.iter().enumerate() {
        let centre_um = [0; 2].map(|_| chance.between(-40.0, 40.0));
        setups.push(Placed { id: format!("r{index}"), ring_deg: *ring_deg, probe_deg: *probe_deg, centre_um });
    }
    let mut scenario = TouchProbeScenario {
        seed: chance.below(usize::MAX >> 1) as u64,
        directions: layout.directions,
        repeats: 2 + chance.below(3),
        std_um: chance.size(0.3, 1.5),
        ring: Ring { random_rms_um: chance.size(0.3, 3.0), ..Ring::default() },
        setups,
        ..TouchProbeScenario::default()
    };
    scenario.probe.seats_deg = [90.0, 210.0, 330.0].map(|seat| seat + chance.between(-3.0, 3.0));
    scenario.probe.preload_at_mm = [0; 2].map(|_| chance.between(-0.2, 0.2));
    scenario.probe.trigger_ratio = chance.between(1.1, 1.3);
    scenario
}

/// Mean pre-travel and the amplitudes of its main lobes, by sums over the circle.
fn truth(scenario: &TouchProbeScenario) -> Vec<True> {
    vec![
        True::new("pretravel_mean", "pretravel_mean", 0.5 * part_um(scenario, 0, f64::cos)),
        True::new("lobe_3_amplitude", "lobe_3_amplitude", amplitude_um(scenario, 3)),
        True::new("lobe_6_amplitude", "lobe_6_amplitude", amplitude_um(scenario, 6)),
    ]
}

fn plant(id: &'static str, large: bool, scenario: &mut TouchProbeScenario, chance: &mut Chance) -> Planted {
    let noise = scenario.std_um;
    let later = 1 + chance.below(scenario.setups.len() - 1);
    match id {
        "axis-scale" => {
            let size = chance.signed(15.0 * noise, 800.0, large);
            // What both scales have in common is the ring's radius.
            (scenario.machine.scale_x, scenario.machine.scale_y) = (0.5 * size, -0.5 * size);
            Planted::effect(id, "", format!("{size:.1} µm/m"), vec![("scale", size)])
        }
        "axis-squareness" => {
            let size = chance.signed(15.0 * noise, 800.0, large);
            scenario.machine.squareness_urad = size;
            Planted::effect(id, "", format!("{size:.1} µrad"), vec![("squareness", size)])
        }
        "axis-reversal" => {
            let axis = chance.below(2);
            let size = chance.signed(noise, 40.0, large);
            scenario.machine.reversal_um[axis] = size;
            Planted::effect(id, ["X", "Y"][axis], format!("{size:.1} µm"), vec![("reversal", size)])
        }
        "thermal-drift" => {
            let what = chance.below(3);
            let size = chance.signed(2.0 * noise, if what == 2 { 20.0 } else { 100.0 }, large);
            if what == 2 {
                scenario.drift.radius_um = size;
            } else {
                scenario.drift.centre_um[what] = size;
            }
            let constant = if chance.below(2) == 0 { 0.0 } else { chance.size(0.2, 1.0) };
            scenario.drift.time_constant = constant;
            let words = format!("{size:.1} µm, time constant {constant:.2} of the measurement");
            Planted::effect(id, ["x", "y", "radius"][what], words, vec![("change", size)])
        }
        "lobing-order" | "ring-form-order" => {
            let order = MAX_ORDER + 1 + chance.below(6);
            let amplitude_um = chance.size(0.3 * noise, 10.0).abs();
            let wave = Wave { order: order as u32, amplitude_um, phase_deg: chance.between(0.0, 360.0) };
            let waves = if id == "lobing-order" { &mut scenario.probe.extra_lobing } else { &mut scenario.ring.waves };
            waves.push(wave);
            let (sine, cosine) = wave.phase_deg.to_radians().sin_cos();
            let parameters = vec![("cosine", amplitude_um * cosine), ("sine", -amplitude_um * sine)];
            Planted {
                id,
                names: vec![format!("{id}-{order}")],
                size: format!("{amplitude_um:.2} µm"),
                parameters,
                visible: None,
            }
        }
        "chip" | "chip in one setup" => {
            let [at, width, height] =
                [chance.between(0.0, 360.0), chance.between(7.0, 25.0), chance.size(3.0 * noise, 80.0)];
            scenario.strangers.chip = Some([at, width, height]);
            scenario.strangers.chip_in = (id != "chip").then_some(later);
            Planted::stranger(id, format!("{height:.1} µm over {width:.0}° at {at:.0}°"))
        }
        "bent ring" => {
            let order = 2 + chance.below(3) as u32;
            let amplitude_um = chance.size(noise, 20.0);
            let wave = Wave { order, amplitude_um, phase_deg: chance.between(0.0, 360.0) };
            scenario.strangers.bent = Some((later, wave));
            Planted::stranger(id, format!("{amplitude_um:.1} µm of order {order} in setup r{later}"))
        }
        _ => {
            let by_deg = chance.signed(10.0, 60.0, false);
            let from = usize::from(id != "slipped ring");
            scenario.strangers.slipped = Some((later, from, by_deg));
            Planted::stranger(id, format!("by {by_deg:.0}° in setup r{later} from pass {from}"))
        }
    }
}
