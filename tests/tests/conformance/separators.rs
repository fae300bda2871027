//! What every separator must do, on its campaign, as a pipeline runs it.

use std::{collections::BTreeMap, sync::Arc};

use runout_core::{
    pipeline::{Pipeline, Route},
    stage::{Loader, Source},
    table::{Array, Float64Array, RecordBatch},
};
use toml::Table;

use crate::{
    campaign::{self, Campaign, Named, Ran},
    changed::{Change, Damage},
    harmonics::harmonics,
    table::{Check, Kind, TestOutcome, on_two_threads},
};

/// Factor of the scaled data.
const SCALE: f64 = 3.0;
/// Largest relative difference that is rounding, and what an iteration leaves.
const ROUNDING: f64 = 1e-6;
/// Relative difference of results that are scaled: what iterations leave, and points off their centre are not linear.
const SECOND_ORDER: f64 = 2e-3;
/// How far ± of data with twice the noise may be from twice the ±: the fit is not linear in all domains.
const NOT_LINEAR: f64 = 0.1;

const CHECKS: [Check; 9] = [
    Check("equal", "Equal data give equal tables and values, bit by bit."),
    Check("table", "Rows fit the table as it is declared before the run."),
    Check("order", "Rows and stations in reverse order give the same values."),
    Check("lost", "A lost order is no number, whatever the data; an order that is not lost is one."),
    Check(
        "scale",
        "Readings times 3 give lengths, small angles and counts times 3, and other values unchanged: to 0.2 %.",
    ),
    Check(
        "noise",
        "Noise times 2 gives ± times 2, to 10 %: of each coefficient of form and motion, or of the values of points in their median.",
    ),
    Check(
        "truth",
        "Of simulated campaigns, 95 % intervals hold the truth, or the value of the same data without noise, at that rate \
        less 3 standard deviations of the count. Turns: each coefficient of form, x and y.",
    ),
    Check("blocks", "Samples in blocks of any length give the same values, to 1e-6."),
    Check(
        "bad",
        "No point, one point, equal readings, readings without bound, one turn: an error in words or a result, no panic.",
    ),
];

pub(crate) fn test(registry: &Arc<runout_core::pipeline::Registry>) -> Kind {
    let campaigns = campaign::campaigns("separate");
    let names = registry.separators.iter().map(|plugin| plugin.name);
    Kind {
        heading: "Separators",
        about: "Each runs a pipeline on its campaign: turns of a simulated shaft at three stations, or points of a simulator, an example or a formula, with noise added.",
        checks: &CHECKS,
        plugins: on_two_threads(names, |plugin| all(&campaigns, plugin, registry)),
    }
}

fn all(campaigns: &Table, plugin: &str, registry: &Arc<runout_core::pipeline::Registry>) -> Vec<TestOutcome> {
    let campaign = campaign::campaign_of(campaigns, "separate", plugin);
    if let Some(why) = campaign.as_ref().ok().and_then(|table| table.get("elsewhere")).and_then(toml::Value::as_str) {
        return CHECKS.iter().map(|_| TestOutcome::Exempt(why.to_owned())).collect();
    }
    let campaign = campaign.and_then(|table| Campaign::new(table, plugin, Arc::clone(registry)));
    let campaign = match campaign {
        Ok(campaign) => campaign,
        Err(why) => return CHECKS.iter().map(|_| TestOutcome::Fails(why.clone())).collect(),
    };
    let usual = campaign.run(&Change::default());
    let usual = match usual {
        Ok(usual) => usual,
        Err(why) => return CHECKS.iter().map(|_| TestOutcome::Fails(why.clone())).collect(),
    };
    let unknown = campaign.exempt_checks().find(|name| CHECKS.iter().all(|check| check.0 != name.as_str()));
    assert_eq!(unknown, None, "{plugin} is exempt from a check that there is not");
    let found = CHECKS.iter().map(|check| {
        let found = one(check.0, &campaign, &usual);
        match (campaign.exempt(check.0), found) {
            (None, found) => found,
            (Some(_), TestOutcome::Holds) => TestOutcome::Fails("it holds: take away the exemption".into()),
            (Some(reason), _) => TestOutcome::Exempt(reason.clone()),
        }
    });
    found.collect()
}

fn one(check: &str, campaign: &Campaign, usual: &Ran) -> TestOutcome {
    let changed = |change: Change| campaign.run(&change);
    let usual_change = Change::default();
    match check {
        "equal" => changed(usual_change).and_then(|again| equal(usual, &again)).into(),
        // `Between` refuses rows that do not fit, and tables that are not declared: the run has not failed.
        "table" => filled(usual).into(),
        "order" => changed(Change { reversed: true, ..usual_change })
            .and_then(|reversed| same(&usual.values(), &reversed.values(), ROUNDING))
            .into(),
        "lost" => lost(campaign, usual),
        "scale" if !campaign.has_readings() => TestOutcome::Exempt("its data are a model, not readings".into()),
        "scale" => changed(Change { scale: SCALE, ..usual_change })
            .and_then(|scaled| scales(&usual.values(), &scaled.values()))
            .into(),
        "noise" | "truth" if !campaign.has_noise() => TestOutcome::Exempt("its campaign has no noise".into()),
        "noise" => match changed(Change { noise: 2.0, ..usual_change }) {
            Ok(noisy) => noise_doubles(usual, &noisy),
            Err(why) => TestOutcome::Fails(why),
        },
        "truth" if campaign.is_of_turns() => truth_of_turns(campaign, usual).into(),
        "truth" => truth_of_points(campaign),
        "blocks" if !campaign.is_of_turns() => TestOutcome::Exempt("points come as a whole".into()),
        "blocks" => [1, 7, 100_000]
            .into_iter()
            .try_for_each(|block| {
                let ran = changed(Change { block: Some(block), ..Change::default() })?;
                same(&usual.values(), &ran.values(), ROUNDING)
            })
            .into(),
        "bad" => bad(campaign).into(),
        _ => TestOutcome::Fails("there is no such check".into()),
    }
}

fn equal(one: &Ran, other: &Ran) -> Result<(), String> {
    let text = |ran: &Ran| format!("{:?}", ran.values());
    if one.tables.len() != other.tables.len() || text(one) != text(other) {
        return Err("values or the number of tables differ".into());
    }
    let differs = one.tables.iter().zip(&other.tables).find(|(a, b)| !bitwise(&a.1, &b.1));
    differs.map_or(Ok(()), |(table, _)| Err(format!("the table {} differs", table.0.name)))
}

fn bitwise(one: &RecordBatch, other: &RecordBatch) -> bool {
    one.schema() == other.schema()
        && one.columns().iter().zip(other.columns()).all(|(a, b)| {
            let numbers = |array: &dyn Array| array.as_any().downcast_ref::<Float64Array>().cloned();
            match (numbers(a), numbers(b)) {
                (Some(a), Some(b)) => {
                    a.iter().map(|cell| cell.map(f64::to_bits)).eq(b.iter().map(|cell| cell.map(f64::to_bits)))
                }
                _ => a == b,
            }
        })
}

fn filled(usual: &Ran) -> Result<(), String> {
    if usual.tables.iter().all(|(_, rows)| rows.num_rows() == 0) { Err("no table has a row".into()) } else { Ok(()) }
}

fn same(one: &[Named], other: &[Named], tolerance: f64) -> Result<(), String> {
    pairs(one, other)?.try_for_each(|(a, b)| {
        let size = a.value.abs().max(a.std.unwrap_or(0.0));
        let near = |a: f64, b: f64| (a.is_nan() && b.is_nan()) || (a - b).abs() <= tolerance * size;
        if near(a.value, b.value) { Ok(()) } else { Err(format!("{} is {} and {}", a.name, a.value, b.value)) }
    })
}

/// Values of two runs, by their names.
fn pairs<'a>(one: &'a [Named], other: &'a [Named]) -> Result<std::vec::IntoIter<(&'a Named, &'a Named)>, String> {
    if one.len() != other.len() {
        return Err(format!("{} values and {}", one.len(), other.len()));
    }
    let pair = |a: &'a Named| {
        let b = other.iter().find(|b| b.name == a.name).ok_or_else(|| format!("{} is not there", a.name))?;
        Ok((a, b))
    };
    Ok(one.iter().map(pair).collect::<Result<Vec<_>, String>>()?.into_iter())
}

fn scales(one: &[Named], scaled: &[Named]) -> Result<(), String> {
    let largest = one.iter().filter(|value| value.unit == "um").map(|value| value.value.abs()).fold(0.0, f64::max);
    pairs(one, scaled)?.try_for_each(|(a, b)| {
        let factor =
            if ["um", "nm", "urad", "counts"].iter().any(|unit| a.unit.starts_with(unit)) { SCALE } else { 1.0 };
        let off = (b.value - factor * a.value).abs();
        let floor = if a.unit == "um" { 1e-2 * largest } else { 0.0 };
        if (a.value.is_nan() && b.value.is_nan()) || off <= SECOND_ORDER * factor * a.value.abs().max(floor) {
            Ok(())
        } else {
            Err(format!("{} is {} and {}", a.name, a.value, b.value))
        }
    })
}

/// ± of coefficients of turns, each by itself; of values of points in their median, as that of a peak to valley is not proportional to
/// noise.
fn noise_doubles(usual: &Ran, noisy: &Ran) -> TestOutcome {
    let coefficients = |ran: &Ran| {
        harmonics(ran).iter().filter(|row| row.observable && row.order >= 2).map(|row| row.std).collect::<Vec<_>>()
    };
    let (one, other) = (coefficients(usual), coefficients(noisy));
    let mut ratios: Vec<f64> = if one.is_empty() {
        let (one, other) = (usual.values(), noisy.values());
        let pairs = match pairs(&one, &other) {
            Ok(pairs) => pairs,
            Err(why) => return TestOutcome::Fails(why),
        };
        let ratios: Vec<f64> = pairs.filter_map(|(a, b)| Some(b.std? / a.std?)).collect();
        let mut sorted = ratios;
        sorted.sort_by(f64::total_cmp);
        sorted.get(sorted.len() / 2).copied().into_iter().collect()
    } else {
        one.iter().zip(&other).map(|(one, other)| other / one).collect()
    };
    if ratios.is_empty() {
        return TestOutcome::Exempt("no value has a ±".into());
    }
    ratios.retain(|ratio| (ratio / 2.0 - 1.0).abs() > NOT_LINEAR || ratio.is_nan());
    ratios.first().map_or(TestOutcome::Holds, |ratio| TestOutcome::Fails(format!("a ± is {ratio:.3} times as large")))
}

/// Lost orders: those that are known before the run are null in it, and at every station, whatever the data.
fn lost(campaign: &Campaign, usual: &Ran) -> TestOutcome {
    if !campaign.is_of_turns() {
        let none = usual.summary.lost_orders.form.is_empty() && usual.summary.lost_orders.others.is_empty();
        if none {
            return TestOutcome::Exempt("no order is lost".into());
        }
        let scaled = campaign.run(&Change { noise: 2.0, seed: 7, ..Change::default() });
        return scaled
            .and_then(|ran| {
                let same = ran.summary.lost_orders.form == usual.summary.lost_orders.form
                    && ran.summary.lost_orders.others == usual.summary.lost_orders.others;
                if same { Ok(()) } else { Err("other orders are lost with other noise".to_owned()) }
            })
            .into();
    }
    lost_of_turns(campaign, usual).unwrap_or_else(TestOutcome::Fails)
}

fn lost_of_turns(campaign: &Campaign, usual: &Ran) -> Result<TestOutcome, String> {
    let pipeline = campaign.pipeline(&Change::default(), "")?;
    let (Some(assessment), Some(rig)) = (&pipeline.assessment, &pipeline.rig) else {
        return Err("nothing is said of it before a run".into());
    };
    let others = [Change { scale: 30.0, ..Change::default() }, Change { noise: 3.0, seed: 5, ..Change::default() }];
    let others = others.iter().map(|change| campaign.run(change)).collect::<Result<Vec<_>, _>>()?;
    let mut count = 0;
    for ran in others.iter().chain([usual]) {
        for row in harmonics(ran).iter().filter(|row| row.order >= 1) {
            let unknown = assessment.unknowns.iter().position(|quantity| {
                let section = quantity.section().map(|section| rig.sections[section].as_str());
                quantity.id() == row.quantity && section == row.section.as_deref()
            });
            let known = assessment.orders.iter().find(|order| order.order == row.order);
            let (Some(unknown), Some(known)) = (unknown, known) else { continue };
            let is_number = row.re.is_finite() && row.im.is_finite();
            count += usize::from(!known.observable[unknown]);
            if row.observable != is_number || is_number != known.observable[unknown] {
                let said = if known.observable[unknown] { "is observable" } else { "is lost" };
                return Err(format!(
                    "{} of order {} {said} by `check` and is {} in the result",
                    row.quantity, row.order, row.re
                ));
            }
        }
    }
    if count == 0 { Ok(TestOutcome::Exempt("no order is lost".into())) } else { Ok(TestOutcome::Holds) }
}

/// Coefficients of form and motion against those of the simulated truth.
fn truth_of_turns(campaign: &Campaign, usual: &Ran) -> Result<(), String> {
    let pipeline: Pipeline = campaign.pipeline(&Change::default(), "")?;
    let Source::Turns(recording) =
        Loader::open(&*pipeline.loader, &pipeline.request()).map_err(|error| error.to_string())?
    else {
        return Err("the campaign gives no turns".into());
    };
    let rig = pipeline.rig.as_ref().ok_or("there is no rig")?;
    if !matches!(pipeline.route, Route::Turns { .. }) {
        return Err("the separator takes points".into());
    }
    let (mut inside, mut count) = (0_usize, 0_usize);
    for (index, station) in recording.stations().iter().enumerate() {
        let truth = recording.truth(index).map_err(|error| error.to_string())?.ok_or("there is no truth")?;
        for row in harmonics(usual).iter().filter(|row| row.station == station.name && row.observable && row.order >= 2)
        {
            let curve = match (row.quantity.as_str(), &row.section, &truth.motion) {
                ("form", Some(section), _) => {
                    let section = rig.sections.iter().position(|id| id == section).ok_or("an unknown section")?;
                    &truth.form_um[section]
                }
                ("x", _, Some(motion)) => &motion[0],
                ("y", _, Some(motion)) => &motion[1],
                _ => continue,
            };
            let [re, im] = coefficient(curve, row.order, row.quantity == "form");
            if row.std > 0.0 {
                count += 1;
                // |δ|² of a complex number of variance s² is below −s²·ln 0.05 with 95 %.
                let off = (row.re - re).powi(2) + (row.im - im).powi(2);
                inside += usize::from(off <= -(0.05_f64.ln()) * row.std * row.std);
            }
        }
    }
    rate(inside, count, count as f64)
}

/// Whether so many of a count are as many as 95 %, less 3 standard deviations of so many independent ones.
fn rate(inside: usize, count: usize, independent: f64) -> Result<(), String> {
    if count == 0 {
        return Err("no value has a ±".into());
    }
    let share = inside as f64 / count as f64;
    let least = 0.95 - 3.0 * (0.95 * 0.05 / independent).sqrt();
    if share >= least {
        Ok(())
    } else {
        Err(format!("{inside} of {count} are inside, at least {least:.2} were expected"))
    }
}

/// c of Re Σ c e^{±inφ} of a curve over one turn; the plus is that of form.
fn coefficient(curve: &[f64], order: usize, is_form: bool) -> [f64; 2] {
    let sum = curve.iter().enumerate().fold([0.0, 0.0], |[re, im], (index, value)| {
        let angle = std::f64::consts::TAU * order as f64 * index as f64 / curve.len() as f64;
        [re + value * angle.cos(), im + value * angle.sin()]
    });
    let factor = 2.0 / curve.len() as f64;
    [sum[0] * factor, sum[1] * factor * if is_form { -1.0 } else { 1.0 }]
}

/// Values of campaigns with other noise against the truth, or the values of the same points without noise.
fn truth_of_points(campaign: &Campaign) -> TestOutcome {
    let quiet = match campaign.run(&Change { noise: 0.0, ..Change::default() }) {
        Ok(quiet) => quiet.values(),
        Err(why) => return TestOutcome::Fails(format!("without noise: {why}")),
    };
    let mut hits: BTreeMap<String, [usize; 2]> = BTreeMap::new();
    for seed in 1..=campaign.draws() {
        let found = match campaign.run(&Change { seed, ..Change::default() }) {
            Ok(found) => found.values(),
            Err(why) => return TestOutcome::Fails(why),
        };
        for value in &found {
            let truth = campaign.truth().get(&value.name).copied();
            let truth = truth.or_else(|| quiet.iter().find(|quiet| quiet.name == value.name).map(|quiet| quiet.value));
            if let (Some([low, high]), Some(truth)) = (value.interval_95, truth.filter(|truth| truth.is_finite())) {
                let [inside, count] = hits.entry(value.name.clone()).or_default();
                *count += 1;
                *inside += usize::from((low..=high).contains(&truth));
            }
        }
    }
    hits.retain(|name, _| !campaign.is_of_scatter(name));
    let [inside, count] = hits.values().fold([0, 0], |sum, one| [0, 1].map(|at| sum[at] + one[at]));
    if count == 0 {
        return TestOutcome::Exempt("no value has a ±".into());
    }
    let worst = || {
        hits.iter()
            .filter(|(_, [inside, count])| 10 * inside < 8 * count)
            .map(|(name, [inside, _])| format!("{name}: {inside}"))
    };
    let found = rate(inside, count, campaign.draws() as f64);
    found.map_err(|why| format!("{why}; {}", worst().collect::<Vec<_>>().join("; "))).into()
}

/// Data that cannot be used: an error in words or a result, and no panic.
fn bad(campaign: &Campaign) -> Result<(), String> {
    let damages = [Damage::Only(0), Damage::Only(1), Damage::Only(2), Damage::Constant(0.0), Damage::Constant(1e300)];
    damages.into_iter().try_for_each(|damage| {
        let change = Change { damage: Some(damage), ..Change::default() };
        let run = std::panic::AssertUnwindSafe(|| campaign.run(&change));
        match std::panic::catch_unwind(run) {
            Err(_) => Err(format!("{damage:?} ends in a panic")),
            Ok(Err(words)) if words.len() < 20 => Err(format!("{damage:?} is refused with the words `{words}`")),
            Ok(_) => Ok(()),
        }
    })
}
