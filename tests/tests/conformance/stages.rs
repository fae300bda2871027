//! What every preprocessor does with samples, and every simulator with a scenario.

use std::{
    fmt::Write,
    panic::{AssertUnwindSafe, catch_unwind},
    path::Path,
    sync::Arc,
};

use runout_core::{
    Complex64,
    measurement::{Block, Recording, SampleStream},
    pipeline::{Context, Registry},
    stage::{Preprocessor, Simulation},
};
use toml::{Spanned, Table, Value, de::DeTable};

use crate::{
    campaign,
    changed::{Change, Damage, changed_stream},
    table::{Check, Kind, TestOutcome, on_two_threads},
};

const PREPROCESSORS: [Check; 4] = [
    Check("equal", "Equal samples give equal samples or averages, bit by bit."),
    Check("blocks", "Samples in blocks of 1, 7 and 100000 give the same, to 1e-9."),
    Check("scale", "Samples times 3 give samples, averages and their standard deviations times 3, to 1e-9."),
    Check("bad", "No mark, one mark, equal samples, samples without bound: an error in words or a result, no panic."),
];
const SIMULATORS: [Check; 2] = [
    Check("equal", "An equal scenario gives equal data, bit by bit; another seed gives other data."),
    Check("unknown", "An unknown key is refused."),
];
/// Turns of two sensors with form, motion and noise.
const TURNS: &str = "plugin = 'spindle'\nseed = 5\nrig = { part_radius_mm = 30, sensors = [{ id = 'A', angle_deg = 0 }, \
    { id = 'B', angle_deg = 90 }], setups = [{ id = 'only' }] }\nrecording = { revolutions = 12, samples_per_rev = 64, speed_rpm = 300 }\n\
    form = { rms_um = 2, max_order = 9 }\nmotion = { x_rms_um = 0.5 }\nnoise = { rms_um = 0.05 }";

fn here() -> Context<'static> {
    Context { folder: Path::new("."), rig: None }
}

fn all(checks: &[Check], one: impl Fn(&str) -> Result<(), String>) -> Vec<TestOutcome> {
    checks.iter().map(|check| one(check.0).into()).collect()
}

pub(crate) fn preprocessors(registry: &Arc<Registry>) -> Kind {
    let campaigns = campaign::campaigns("preprocess");
    let names = registry.preprocessors.iter().map(|plugin| plugin.name);
    Kind {
        heading: "Preprocessors",
        about: "Each gets 12 simulated turns of two sensors.",
        checks: &PREPROCESSORS,
        plugins: on_two_threads(names, |plugin| {
            let elsewhere = campaigns.get(plugin).and_then(|table| table.get("elsewhere")).and_then(Value::as_str);
            elsewhere.map_or_else(
                || all(&PREPROCESSORS, |check| preprocessed(&campaigns, plugin, registry, check)),
                |why| PREPROCESSORS.iter().map(|_| TestOutcome::Exempt(why.to_owned())).collect(),
            )
        }),
    }
}

fn preprocessed(campaigns: &Table, plugin: &str, registry: &Registry, check: &str) -> Result<(), String> {
    let mut keys = campaign::campaign_of(campaigns, "preprocess", plugin)?;
    keys.insert("plugin".into(), plugin.into());
    let text = keys.to_string();
    let table: Spanned<DeTable> = DeTable::parse(&text).map_err(|error| error.to_string())?;
    let stage = registry.preprocessors.build(&table, &here()).map_err(|fault| fault.to_string())?;
    let simulator = campaign::simulator(TURNS, &here()).map_err(|fault| fault.to_string())?;
    let Simulation::Turns { recording, .. } = simulator.simulate().map_err(|error| error.to_string())? else {
        return Err("the scenario gives no turns".into());
    };
    let of = |change: Change| numbers(&stage, &*recording, &change);
    let usual = Change::default;
    match check {
        "equal" => {
            let [one, other] = [of(usual())?, of(usual())?].map(|numbers| format!("{numbers:?}"));
            if one == other { Ok(()) } else { Err("the results differ".into()) }
        }
        "blocks" => [1, 7, 100_000]
            .into_iter()
            .try_for_each(|block| near(&of(usual())?, &of(Change { block: Some(block), ..usual() })?, 1.0)),
        "scale" => near(&of(usual())?, &of(Change { scale: 3.0, ..usual() })?, 3.0),
        _ => [Damage::Only(0), Damage::Only(1), Damage::Constant(0.0), Damage::Constant(1e300)]
            .into_iter()
            .try_for_each(|damage| {
                let change = Change { damage: Some(damage), ..usual() };
                catch_unwind(AssertUnwindSafe(|| drop(of(change)))).map_err(|_| format!("{damage:?} ends in a panic"))
            }),
    }
}

/// What comes out: samples, or averages and their standard deviations.
fn numbers(stage: &Preprocessor, recording: &dyn Recording, change: &Change) -> Result<Vec<f64>, String> {
    let words = |error: runout_core::Error| error.to_string();
    let input = changed_stream(recording.open(0, 0).map_err(words)?, change);
    match stage {
        Preprocessor::Conditioner(conditioner) => samples(conditioner.attach(input).map_err(words)?),
        Preprocessor::Averager(averager) => {
            let profile = averager.average(input).map_err(words)?;
            let each = |numbers: &[Complex64]| numbers.iter().flat_map(|c| [c.re, c.im]).collect::<Vec<f64>>();
            let mut found = each(&profile.mean);
            let channels = profile.sensors.len();
            let entries = profile.covariance.iter().flatten().enumerate();
            found.extend(
                entries
                    .filter(|(at, _)| (at % (channels * channels)).is_multiple_of(channels + 1))
                    .map(|(_, c)| c.re.sqrt()),
            );
            Ok(found)
        }
        Preprocessor::Corrector(_) => Err("it changes averages, and gets samples here".into()),
    }
}

fn samples(mut stream: Box<dyn SampleStream + '_>) -> Result<Vec<f64>, String> {
    let (mut block, mut found) = (Block::default(), Vec::new());
    while stream.next_block(&mut block).map_err(|error| error.to_string())? {
        found.extend_from_slice(&block.samples);
    }
    Ok(found)
}

fn near(one: &[f64], other: &[f64], factor: f64) -> Result<(), String> {
    if one.len() != other.len() || one.is_empty() {
        return Err(format!("{} numbers and {}", one.len(), other.len()));
    }
    let largest = one.iter().fold(0.0_f64, |largest, number| largest.max(number.abs()));
    let far = one.iter().zip(other).find(|(a, b)| (*b - factor * *a).abs() > 1e-9 * factor * largest);
    far.map_or(Ok(()), |(a, b)| Err(format!("{a} and {b}")))
}

pub(crate) fn simulators(registry: &Arc<Registry>) -> Kind {
    let campaigns = campaign::campaigns("simulate");
    let names = registry.simulators.iter().map(|plugin| plugin.name);
    Kind {
        heading: "Simulators",
        about: "Each computes a small scenario.",
        checks: &SIMULATORS,
        plugins: on_two_threads(names, |plugin| all(&SIMULATORS, |check| simulated(&campaigns, plugin, check))),
    }
}

fn simulated(campaigns: &Table, plugin: &str, check: &str) -> Result<(), String> {
    let mut keys = campaign::campaign_of(campaigns, "simulate", plugin)?;
    keys.insert("plugin".into(), plugin.into());
    let data = |seed: i64| {
        let mut keys = keys.clone();
        keys.insert("seed".into(), seed.into());
        made(&keys.to_string())
    };
    if check == "equal" {
        if data(1)? != data(1)? {
            return Err("two data of one scenario differ".into());
        }
        return if data(1)? == data(2)? { Err("another seed gives the same data".into()) } else { Ok(()) };
    }
    let mut wrong = keys.clone();
    wrong.insert("no-such-key".into(), 1.into());
    match campaign::simulator(&wrong.to_string(), &here()) {
        Err(fault) if fault.to_string().contains("no-such-key") => Ok(()),
        Err(fault) => Err(format!("the error does not name the key: {fault}")),
        Ok(_) => Err("it is taken".into()),
    }
}

/// The data of a scenario, as text.
fn made(scenario: &str) -> Result<String, String> {
    let words = |error: runout_core::Error| error.to_string();
    let simulator = campaign::simulator(scenario, &here()).map_err(|fault| fault.to_string())?;
    match simulator.simulate().map_err(words)? {
        Simulation::Points { rows, .. } => Ok(format!("{:?}", rows.columns())),
        Simulation::Heights(grid) => Ok(format!("{:?}", grid.height_nm)),
        Simulation::Turns { recording, .. } => {
            let mut text = String::new();
            for station in 0..recording.stations().len() {
                let _ = write!(text, "{:?}", samples(recording.open(station, 0).map_err(words)?)?);
            }
            Ok(text)
        }
    }
}
