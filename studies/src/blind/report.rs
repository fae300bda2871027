//! The benchmark's tables.

use std::fmt::Write;

use runout_core::closed_loop::diagnosis::Verdict;

use super::{
    draw::{EFFECTS, Kind, Layout, STRANGERS},
    judge::{Judged, Traced, VISIBLE_CHI2},
};

/// Everything as Markdown.
#[must_use]
pub fn report(all: &[Judged]) -> String {
    [effects(all), clean(all), strangers(all), form(all), confounded(all), failures(all)].join("\n")
}

fn of(all: &[Judged], kind: Kind) -> Vec<&Judged> {
    all.iter().filter(|judged| judged.campaign.kind == kind).collect()
}

fn effects(all: &[Judged]) -> String {
    let mut text = format!(
        "| effect | campaigns | visible (χ² > {VISIBLE_CHI2}) | named | of these alone | missed | named below | false alarms beside | parameters within 2 std |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- | --- |\n"
    );
    let single = of(all, Kind::Single);
    for id in EFFECTS {
        let these: Vec<&Judged> =
            single.iter().filter(|judged| judged.campaign.planted.iter().any(|one| one.id == id)).copied().collect();
        // A ripple of one setup counts as a ripple.
        if !these.is_empty() {
            row(&mut text, id, &these);
        }
    }
    row(&mut text, "**single effects**", &single);
    let pairs = of(all, Kind::Pair);
    row(&mut text, "**effects of pairs**", &pairs);
    let visible = |judged: &&&Judged| judged.effects.iter().all(|traced| traced.visible);
    let both = pairs.iter().filter(visible).count();
    let named = |judged: &&&Judged| judged.effects.iter().all(|traced| traced.named);
    let found = pairs.iter().filter(visible).filter(named).count();
    line(&mut text, format_args!("\nPairs of which both are visible: {both}; both named: {found}."));
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
    let within: usize = traced.iter().map(|traced| traced.parameters[0]).sum();
    let compared: usize = traced.iter().map(|traced| traced.parameters[1]).sum();
    line(
        text,
        format_args!(
            "| {name} | {} | {visible} | {}{named} | {alone} | {} | {below} | {alarms} | {} |",
            traced.len(),
            percent(named, visible),
            visible - named,
            if compared == 0 { "-".into() } else { format!("{within} of {compared}") },
        ),
    );
}

fn percent(some: usize, all: usize) -> String {
    if all == 0 { String::new() } else { format!("{:.0} %: ", 100.0 * some as f64 / all as f64) }
}

fn clean(all: &[Judged]) -> String {
    let mut text = String::from(
        "| clean campaigns | campaigns | false alarms | with an unexplained residual |\n| --- | --- | --- | --- |\n",
    );
    for rig in Layout::ALL {
        let these: Vec<&Judged> =
            of(all, Kind::Clean).into_iter().filter(|judged| judged.campaign.rig == rig).collect();
        let alarms = these.iter().filter(|judged| !judged.false_alarms.is_empty()).count();
        let left = these.iter().filter(|judged| judged.diagnosis.verdict == Verdict::Unexplained).count();
        line(&mut text, format_args!("| {} | {} | {alarms} | {left} |", rig.name(), these.len()));
    }
    text
}

fn strangers(all: &[Judged]) -> String {
    let mut text = String::from(
        "| unmodelled disturbance | campaigns | visible | unexplained, no effect added | unexplained, an effect added | an effect added, not unexplained | visible and not reported | form worse than before |\n\
         | --- | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for id in STRANGERS {
        let these: Vec<&Judged> = of(all, Kind::Stranger)
            .into_iter()
            .filter(|judged| judged.campaign.planted.iter().any(|one| one.id == id))
            .collect();
        let visible = |judged: &Judged| judged.effects.iter().any(|traced| traced.visible);
        let count = |which: &dyn Fn(&Judged) -> bool| these.iter().filter(|judged| which(judged)).count();
        let left = |judged: &Judged| judged.diagnosis.verdict == Verdict::Unexplained;
        let blamed = |judged: &Judged| !judged.false_alarms.is_empty();
        line(
            &mut text,
            format_args!(
                "| {id} | {} | {} | {} | {} | {} | {} | {} |",
                these.len(),
                count(&visible),
                count(&|judged| left(judged) && !blamed(judged)),
                count(&|judged| left(judged) && blamed(judged)),
                count(&|judged| !left(judged) && blamed(judged)),
                count(&|judged| visible(judged) && !left(judged) && judged.diagnosis.added.is_empty()),
                count(&|judged| judged.form.after > 1.05 * judged.form.before),
            ),
        );
    }
    text
}

fn form(all: &[Judged]) -> String {
    let mut text = String::from(
        "| form, campaigns with visible effects | campaigns | error before / sound: median, 95 % | after / sound: median, 95 % | after / before: largest | error / stated, all planted visible: median, 95 % |\n\
         | --- | --- | --- | --- | --- | --- |\n",
    );
    for rig in Layout::ALL {
        let these = all.iter().filter(|judged| {
            judged.campaign.rig == rig
                && matches!(judged.campaign.kind, Kind::Single | Kind::Pair)
                && judged.effects.iter().any(|traced| traced.visible)
        });
        // What a layout is blind to is in no stated uncertainty: the diagnosis says its bias per unit instead.
        let seen = |judged: &Judged| judged.effects.iter().all(|traced| traced.visible);
        let (forms, seen): (Vec<_>, Vec<bool>) = these.map(|judged| (judged.form, seen(judged))).unzip();
        if forms.is_empty() {
            continue;
        }
        let sorted = |value: &dyn Fn(usize) -> f64| {
            let mut values: Vec<f64> = (0..forms.len()).map(value).filter(|value| value.is_finite()).collect();
            values.sort_by(f64::total_cmp);
            values
        };
        let two = |values: &[f64]| format!("{:.2}, {:.2}", quantile(values, 0.5), quantile(values, 0.95));
        let before = sorted(&|index| forms[index].before / forms[index].sound);
        let after = sorted(&|index| forms[index].after / forms[index].sound);
        let gain = sorted(&|index| forms[index].after / forms[index].before);
        let stated = sorted(&|index| if seen[index] { forms[index].after / forms[index].stated } else { f64::NAN });
        line(
            &mut text,
            format_args!(
                "| {} | {} | {} | {} | {:.2} | {} |",
                rig.name(),
                forms.len(),
                two(&before),
                two(&after),
                quantile(&gain, 1.0),
                two(&stated)
            ),
        );
    }
    text
}

/// Campaigns that end with a confounded set.
fn confounded(all: &[Judged]) -> String {
    let mut text = String::from(
        "| campaigns with a confounded set | campaigns | form after / before: largest | form within 2 std | motion within 2 std | form error / stated: largest | motion error / stated: largest |\n\
         | --- | --- | --- | --- | --- | --- | --- |\n",
    );
    for rig in Layout::ALL {
        let these: Vec<&Judged> = all
            .iter()
            .filter(|judged| {
                judged.campaign.rig == rig && judged.campaign.kind != Kind::Stranger && judged.is_confounded()
            })
            .collect();
        if these.is_empty() {
            continue;
        }
        let largest =
            |value: &dyn Fn(&Judged) -> f64| these.iter().map(|judged| value(judged)).fold(f64::NAN, f64::max);
        let within = |value: &dyn Fn(&Judged) -> f64| {
            let count = these.iter().filter(|judged| value(judged) <= 2.0).count();
            format!("{}{count}", percent(count, these.len()))
        };
        let form = |judged: &Judged| judged.form.after / judged.form.stated;
        let motion = |judged: &Judged| judged.motion_ratio;
        line(
            &mut text,
            format_args!(
                "| {} | {} | {:.3} | {} | {} | {:.2} | {:.2} |",
                rig.name(),
                these.len(),
                largest(&|judged| judged.form.after / judged.form.before),
                within(&form),
                within(&motion),
                largest(&form),
                largest(&motion),
            ),
        );
    }
    text
}

/// The smallest value that no smaller share of the sorted ones stays below.
fn quantile(sorted: &[f64], share: f64) -> f64 {
    let place = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(place.saturating_sub(1)).copied().unwrap_or(f64::NAN)
}

fn failures(all: &[Judged]) -> String {
    let mut text = String::from(
        "| campaign | rig | planted | χ² declared, final | form error sound, before, after | what went wrong | said |\n| --- | --- | --- | --- | --- | --- | --- |\n",
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
                "| {} | {:?} | {} | {before:.3}, {after:.3} | {:.4}, {:.4}, {:.4} | {} | {} |",
                judged.campaign.index,
                judged.campaign.rig,
                judged.planted(),
                judged.form.sound,
                judged.form.before,
                judged.form.after,
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
