//! The tables of a benchmark of points.

use std::fmt::Write;

use super::judge::{Judged, Traced};
use crate::blind::{Kind, judge::VISIBLE_CHI2};

/// Everything as Markdown.
#[must_use]
pub fn report(all: &[Judged]) -> String {
    [effects(all), clean(all), strangers(all), unexplained(all), values(all), failures(all)].join("\n")
}

fn of(all: &[Judged], kind: Kind) -> Vec<&Judged> {
    all.iter().filter(|judged| judged.kind == kind).collect()
}

/// Distinct, in the order of their first appearance.
fn distinct<'a>(all: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found = Vec::new();
    for one in all {
        if !found.contains(&one) {
            found.push(one);
        }
    }
    found
}

fn effects(all: &[Judged]) -> String {
    let mut text = format!(
        "| effect | campaigns | visible (χ² > {VISIBLE_CHI2}) | named | of these alone | missed | below, of these named | \
         false alarms beside | parameters within 2 std | mean square of error/std |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    let single = of(all, Kind::Single);
    let mut ids = distinct(single.iter().flat_map(|judged| judged.planted.iter().map(|planted| planted.id)));
    ids.sort_unstable();
    for id in ids {
        let these: Vec<&Judged> =
            single.iter().filter(|judged| judged.planted.iter().any(|one| one.id == id)).copied().collect();
        row(&mut text, id, &these);
    }
    row(&mut text, "**single effects**", &single);
    let pairs = of(all, Kind::Pair);
    row(&mut text, "**effects of pairs**", &pairs);
    text
}

fn row(text: &mut String, name: &str, these: &[&Judged]) {
    let traced: Vec<&Traced> = these.iter().flat_map(|judged| &judged.effects).collect();
    let count = |which: &dyn Fn(&Traced) -> bool| traced.iter().filter(|traced| which(traced)).count();
    let visible = count(&|traced| traced.visible);
    let named = count(&|traced| traced.visible && traced.named);
    let alone = count(&|traced| traced.visible && traced.alone);
    let below = count(&|traced| !traced.visible && traced.named);
    let alarms: usize = these.iter().map(|judged| judged.false_alarms.len()).sum();
    let errors: Vec<f64> = traced.iter().flat_map(|traced| traced.parameters.iter().copied()).collect();
    let (compared, within) = (errors.len(), errors.iter().filter(|error| error.abs() <= 2.0).count());
    let square = errors.iter().map(|error| error * error).sum::<f64>() / compared as f64;
    line(
        text,
        format_args!(
            "| {name} | {} | {visible} | {}{named} | {alone} | {} | {}, {below} | {alarms} | {} | {} |",
            traced.len(),
            percent(named, visible),
            visible - named,
            traced.len() - visible,
            if compared == 0 { "-".into() } else { format!("{within} of {compared}") },
            if compared == 0 { "-".into() } else { format!("{square:.2}") },
        ),
    );
}

fn percent(some: usize, all: usize) -> String {
    if all == 0 { String::new() } else { format!("{:.0} %: ", 100.0 * some as f64 / all as f64) }
}

fn clean(all: &[Judged]) -> String {
    let mut text = String::from(
        "| clean campaigns | campaigns | with a false alarm | with an unexplained residual |\n| --- | --- | --- | --- |\n",
    );
    let clean = of(all, Kind::Clean);
    let mut count = |name: &str, which: &dyn Fn(&Judged) -> bool| {
        let these: Vec<&&Judged> = clean.iter().filter(|judged| which(judged)).collect();
        let alarms = these.iter().filter(|judged| !judged.false_alarms.is_empty()).count();
        let left = these.iter().filter(|judged| judged.is_unexplained()).count();
        line(&mut text, format_args!("| {name} | {} | {alarms} | {left} |", these.len()));
    };
    for layout in distinct(clean.iter().map(|judged| judged.layout)) {
        count(layout, &|judged| judged.layout == layout);
    }
    count("**all**", &|_| true);
    text
}

fn strangers(all: &[Judged]) -> String {
    let mut text = String::from(
        "| unmodelled disturbance | campaigns | visible | unexplained, no effect added | unexplained, an effect added | an effect added, not unexplained | \
         visible and not reported | below, of these reported |\n| --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    let strangers = of(all, Kind::Stranger);
    let mut count = |name: &str, which: &dyn Fn(&Judged) -> bool| {
        let these: Vec<&&Judged> = strangers.iter().filter(|judged| which(judged)).collect();
        let count = |which: &dyn Fn(&Judged) -> bool| these.iter().filter(|judged| which(judged)).count();
        let blamed = |judged: &Judged| !judged.diagnosis.added.is_empty();
        line(
            &mut text,
            format_args!(
                "| {name} | {} | {} | {} | {} | {} | {} | {}, {} |",
                these.len(),
                count(&Judged::is_visible),
                count(&|judged| judged.is_visible() && judged.is_unexplained() && !blamed(judged)),
                count(&|judged| judged.is_unexplained() && blamed(judged)),
                count(&|judged| !judged.is_unexplained() && blamed(judged)),
                count(&|judged| judged.is_visible() && !judged.is_unexplained() && !blamed(judged)),
                count(&|judged| !judged.is_visible()),
                count(&|judged| !judged.is_visible() && judged.is_unexplained()),
            ),
        );
    };
    let ids = distinct(strangers.iter().flat_map(|judged| judged.planted.iter().map(|planted| planted.id)));
    for id in ids {
        count(id, &|judged| judged.planted.iter().any(|planted| planted.id == id));
    }
    count("**all**", &|_| true);
    text
}

/// Errors of values over their standard uncertainties.
/// What ends unexplained, and whether effects that were added all the same moved values away from the truth.
fn unexplained(all: &[Judged]) -> String {
    let mut text = String::from(
        "| ended unexplained | with effects added | values with a truth | farther from it by more than a standard uncertainty | nearer by more |\n\
         | --- | --- | --- | --- | --- |\n",
    );
    let ended: Vec<&Judged> = all.iter().filter(|judged| judged.is_unexplained()).collect();
    let added = ended.iter().filter(|judged| !judged.diagnosis.added.is_empty());
    let farther: Vec<f64> = added
        .clone()
        .flat_map(|judged| &judged.values)
        .map(|value| value.farther)
        .filter(|by| by.is_finite())
        .collect();
    let count = |which: &dyn Fn(f64) -> bool| farther.iter().filter(|by| which(**by)).count();
    line(
        &mut text,
        format_args!(
            "| {} | {} | {} | {} | {} |",
            ended.len(),
            added.count(),
            farther.len(),
            count(&|by| by > 1.0),
            count(&|by| by < -1.0)
        ),
    );
    text
}

fn values(all: &[Judged]) -> String {
    let mut text = String::from(
        "| value, error over its std | clean: number, within 2 | effects visible, declared model: number, within 2 | final model: \
         number, within 2 | largest | lost |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for row in distinct(all.iter().flat_map(|judged| judged.values.iter().map(|value| value.row))) {
        let ratios = |which: &dyn Fn(&Judged) -> bool, last: bool| -> Vec<f64> {
            let these = all.iter().filter(|judged| which(judged)).flat_map(|judged| &judged.values);
            let own = these.filter(|value| value.row == row);
            own.map(|value| if last { value.last } else { value.declared }).collect()
        };
        let share = |ratios: &[f64]| {
            let finite = ratios.iter().filter(|ratio| ratio.is_finite()).count();
            let within = ratios.iter().filter(|ratio| ratio.abs() <= 2.0).count();
            format!("{finite}, {}{within}", percent(within, finite))
        };
        let clean = |judged: &Judged| judged.kind == Kind::Clean;
        let seen = |judged: &Judged| matches!(judged.kind, Kind::Single | Kind::Pair) && judged.is_visible();
        let last = ratios(&|judged| clean(judged) || seen(judged), true);
        let largest = last.iter().filter(|ratio| ratio.is_finite()).map(|ratio| ratio.abs()).fold(0.0, f64::max);
        line(
            &mut text,
            format_args!(
                "| {row} | {} | {} | {} | {largest:.1} | {} |",
                share(&ratios(&clean, true)),
                share(&ratios(&seen, false)),
                share(&ratios(&seen, true)),
                last.iter().filter(|ratio| !ratio.is_finite()).count(),
            ),
        );
    }
    text
}

fn failures(all: &[Judged]) -> String {
    let mut text = String::from(
        "| campaign | layout | planted | χ² declared, final | what went wrong | said |\n| --- | --- | --- | --- | --- | --- |\n",
    );
    for judged in all {
        let failures = judged.failures();
        if failures.is_empty() {
            continue;
        }
        let [before, after] =
            [&judged.diagnosis.before, &judged.diagnosis.after].map(|level| level.chi2_per_dof.unwrap_or(f64::NAN));
        line(
            &mut text,
            format_args!(
                "| {} | {} | {} | {before:.3}, {after:.3} | {} | {} |",
                judged.index,
                judged.layout,
                judged.planted(),
                failures.join("; "),
                judged.said()
            ),
        );
    }
    text
}

fn line(text: &mut String, line: std::fmt::Arguments) {
    // Writing to a string cannot fail.
    let _ = writeln!(text, "{line}");
}
