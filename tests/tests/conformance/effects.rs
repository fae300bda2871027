//! What every effect must do: its declaration, and its partials against differences of the model that has it applied.

use std::sync::Arc;

use runout_core::{
    closed_loop::{Fit, Model, Setting},
    effects::EffectEntry,
    pipeline::{Registry, Route},
    stage::{AverageRequest, Loader, Source, Station},
};
use runout_spindle::{diagnose::SpindleModel, effects, layout::Layout, selection::Selection};

use crate::{
    campaign::Campaign,
    changed::Change,
    table::{Check, Kind, TestOutcome},
};

/// Ids of effects, and whether the partials of one at a target are differences.
type Partials = Vec<(String, Result<(), String>)>;

/// Largest share of a partial that it may be off by at 0, and where the effect is applied: partials are those of the linear reading, and
/// leave out the residual's own share of the change of the projection (Kaufman).
const AT_ZERO: f64 = 0.05;
const APPLIED: f64 = 0.1;

const CHECKS: [Check; 2] = [
    Check("declared", "Its id is in kebab-case, and each parameter has a name, a unit and a usual size above 0."),
    Check(
        "partials",
        "Its partials equal differences of the model's residual, at 0 to 5 % and at half of the usual size of each parameter to 10 %, and \
        one standard deviation of the noise for a parameter of usual size.",
    ),
];

pub(crate) fn test(registry: &Arc<Registry>) -> Kind {
    let partials = differences(registry);
    let plugins = registry.effects.iter().map(|effect| {
        let partials = match &partials {
            Ok(partials) => of_effect(effect, partials),
            Err(why) => TestOutcome::Fails(why.clone()),
        };
        (effect.name.to_owned(), vec![declared(effect).into(), partials])
    });
    Kind {
        heading: "Effects",
        about: "Those of turns are applied to a simulated station: four sensors in two sections, three part angles.",
        checks: &CHECKS,
        plugins: plugins.collect(),
    }
}

fn declared(effect: &EffectEntry) -> Result<(), String> {
    let is_kebab =
        effect.name.chars().all(|letter| letter.is_ascii_lowercase() || letter.is_ascii_digit() || letter == '-');
    if !is_kebab || effect.about.is_empty() {
        return Err("its id or its description".into());
    }
    let wrong = effect.parameters.iter().find(|parameter| {
        parameter.name.is_empty()
            || parameter.unit.is_empty()
            || !(parameter.tolerance > 0.0 && parameter.tolerance.is_finite())
    });
    wrong.map_or(Ok(()), |parameter| Err(format!("the parameter {parameter:?}")))
}

fn of_effect(effect: &EffectEntry, partials: &Partials) -> TestOutcome {
    let mut own = partials.iter().filter(|(id, _)| id == effect.name).peekable();
    if own.peek().is_some() {
        return own.find_map(|(_, found)| found.clone().err()).map_or(TestOutcome::Holds, TestOutcome::Fails);
    }
    if effect.parameters.is_empty() {
        return TestOutcome::Exempt("it is there or not: there is no parameter".into());
    }
    let of_turns = effects::all().iter().any(|known| known.about().id == effect.name);
    TestOutcome::Exempt(if of_turns {
        "this station has no place for it; `plugins/spindle/tests` has".into()
    } else {
        "its partials are columns that only its domain sees: the domain's tests compare them".into()
    })
}

/// Of each effect and target that the model may lack: whether its partials are differences.
fn differences(registry: &Arc<Registry>) -> Result<Partials, String> {
    let words = |error: runout_core::Error| error.to_string();
    let table = "rig = { part_radius_mm = 30, sensors = [{ id = 'S1', angle_deg = 0, z_mm = 100, section = 'a' }, \
        { id = 'S2', angle_deg = 90, z_mm = 100, section = 'a' }, { id = 'S3', angle_deg = 0, z_mm = 130, section = 'b' }, \
        { id = 'S4', angle_deg = 90, z_mm = 130, section = 'b' }], \
        setups = [{ id = 'a' }, { id = 'b', part_deg = 99.844 }, { id = 'c', part_deg = 202.5 }] }";
    let table = table.parse().map_err(|error: toml::de::Error| error.to_string())?;
    let campaign = Campaign::new(table, "harmonic-least-squares", Arc::clone(registry))?;
    let pipeline = campaign.pipeline(&Change { noise: 0.1, ..Change::default() }, "")?;
    let (Route::Turns { averager, .. }, Some(rig)) = (&pipeline.route, &pipeline.rig) else {
        return Err("no turns".into());
    };
    let Source::Turns(recording) = Loader::open(&*pipeline.loader, &pipeline.request()).map_err(words)? else {
        return Err("no turns".into());
    };
    let wanted = AverageRequest { hold_out: Some(0.2), projection: None };
    let profiles = (0..rig.setups.len()).map(|setup| averager.average_requested(recording.open(0, setup)?, wanted));
    let profiles = profiles.collect::<runout_core::Result<Vec<_>>>().map_err(words)?;
    let station = Station { name: "s".into(), z_mm: 0.0, profiles };
    let layout = Layout::new(rig, false);
    let model = SpindleModel::new(Selection::whole(rig), layout, true, effects::all(), &[station]).map_err(words)?;
    let effects = Model::effects(&model).iter().enumerate();
    effects
        .filter(|(_, effect)| !effect.parameters.is_empty())
        .map(|(index, effect)| {
            let at_zero = vec![0.0; effect.parameters.len()];
            let usual: Vec<f64> = effect.parameters.iter().map(|parameter| 0.5 * parameter.tolerance).collect();
            let found = [(at_zero, AT_ZERO), (usual, APPLIED)];
            let found = found.into_iter().try_for_each(|(values, share)| compared(&model, index, &values, share));
            Ok((effect.id.clone(), found.map_err(|why| format!("at {}: {why}", effect.targets.join(", ")))))
        })
        .collect()
}

fn compared(model: &SpindleModel, index: usize, values: &[f64], share: f64) -> Result<(), String> {
    let norm = |vector: &[f64]| vector.iter().map(|value| value * value).sum::<f64>().sqrt();
    let fit = |values: Vec<f64>| model.fit(&[Setting { effect: index, values }]).map_err(|error| error.to_string());
    let signature = fit(values.to_vec())?.signature(index);
    let parameters = &Model::effects(model)[index].parameters;
    for (place, (parameter, analytic)) in parameters.iter().zip(&signature).enumerate() {
        let step = 0.02 * parameter.tolerance;
        let residual = |sign: f64| {
            let mut values = values.to_vec();
            values[place] += sign * step;
            Ok::<_, String>(fit(values)?.remainder().residual.clone())
        };
        let (above, below) = (residual(1.0)?, residual(-1.0)?);
        let found = above.iter().zip(&below).map(|(above, below)| (above - below) / (2.0 * step));
        let off: Vec<f64> = found.zip(analytic).map(|(found, analytic)| found - analytic).collect();
        let [size, off] = [norm(analytic), norm(&off)].map(|norm| norm * parameter.tolerance);
        if off >= share * size + 1.0 {
            return Err(format!("{} at {values:?}: {size:.2} standard deviations, off by {off:.2}", parameter.name));
        }
    }
    Ok(())
}
