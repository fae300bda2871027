//! What the closed loop found, for people.

use runout_core::{
    answer::Answer,
    closed_loop::diagnosis::{Added, Blind, Diagnosis, Estimated, Level, Step},
    evaluate::ValueId,
    summary::Summary,
};

use super::{
    answer, count,
    foresight::WHOLE,
    number::{lacking, ranges, significant, spread, with_std},
    page::Page,
    summary::{described, values},
    table::Table,
};

/// The text of a diagnosis and of the result of its final model, of a terminal of so many columns: the answer, then tables. With
/// `verbose` everything.
#[must_use]
pub(crate) fn text(diagnosis: &Diagnosis, summary: &Summary, width: usize, verbose: bool) -> String {
    let mut page = Page::default();
    page.line(&summary.title);
    let answer = Answer::of(summary, Some(diagnosis));
    answer::section(&mut page, &answer);
    values::limits(&mut page, summary);
    if diagnosis.added.iter().any(|one| !one.confounded_with.is_empty()) {
        page.line("The stated ± include each of them");
    }
    // A residual without degrees of freedom is 0 whatever the data are.
    if diagnosis.after.degrees_of_freedom > 0 && !diagnosis.nothing_separated {
        page.headed_table("Error before and after", &levels(diagnosis));
    }
    page.headed_table("What the declared model lacks", &added(diagnosis));
    page.bullets("Confounded sets: the data do not decide which effect is present", &confounded(&diagnosis.added));
    page.detail(format_args!("{} before and after", count(diagnosis.moved.len(), "value")), |page| {
        page.headed_table("What moved", &moved(diagnosis));
    });
    page.headed_table("Left, and not explained", &unexplained(diagnosis));
    page.bullets("Looked likely, and refused", &refused(diagnosis));
    // Where nothing is separated, no effect shows and none moves anything.
    if !diagnosis.nothing_separated {
        page.detail(count(diagnosis.blind_to.len(), "effect") + " that the data cannot show", |page| {
            let heading = "What these data cannot show, and what it would do all the same";
            page.headed_table(heading, &blind(&diagnosis.blind_to));
        });
    }
    if let Some(lost) = diagnosis.lost_orders.as_ref().filter(|lost| lost.0.values().any(|orders| !orders.is_empty())) {
        page.heading("Lost orders");
        for (quantity, orders) in &lost.0 {
            page.line(format_args!("  {quantity:<6}  {}", ranges(orders)));
        }
    }
    page.bullets("Put into the rig", &changes(&diagnosis.added));
    page.findings(&answer, &diagnosis.warnings, &diagnosis.notes);
    page.written(&diagnosis.outputs);
    page.fitted(width, verbose)
}

fn levels(diagnosis: &Diagnosis) -> Table {
    let unit = unit(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let mut table = Table::new(1, ["", "declared", if diagnosis.added.is_empty() { "" } else { "final" }]);
    let mut row = |name: String, digits, values: [Option<f64>; 2]| {
        if values.iter().any(Option::is_some) {
            let [before, after] = values.map(|value| shown(value, digits));
            table.row([name, before, if diagnosis.added.is_empty() { String::new() } else { after }]);
        }
    };
    let of = |value: fn(&Level) -> Option<f64>| [value(&diagnosis.before), value(&diagnosis.after)];
    let only = match diagnosis.before.orders.or(diagnosis.after.orders) {
        Some([1, 1]) => ", order 1 only",
        _ => "",
    };
    row(format!("left by the fit, rms {unit}{only}"), 3, of(|level| Some(level.residual_rms_um)));
    row(format!("expected from noise, rms {unit}{only}"), 3, of(|level| level.noise_floor_um));
    row(format!("chi squared per degree of freedom{only}"), 3, of(|level| level.chi2_per_dof));
    row(format!("residual on held-out data, rms {unit}"), 3, of(|level| level.held_out_rms_um));
    row(format!("  expected from noise, rms {unit}"), 3, of(|level| level.held_out_expected_rms_um));
    if let Some(truth) = &diagnosis.truth {
        let Step { before, after } = truth.form_rms_error_um;
        row("true error of form, rms µm".into(), 2, [before, after]);
    }
    table
}

fn added(diagnosis: &Diagnosis) -> Table {
    let unit = unit(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let [left, held_out, expected] = ["left", "held-out", "expected"].map(|what| format!("{what} {unit}"));
    let header = ["effect", "at", "parameter ± std", &left, &held_out, &expected, "ΔBIC", "p"];
    let mut table = Table::new(3, header);
    for one in &diagnosis.added {
        let [effect, at] = named(one);
        let alone = if one.confounded_with.is_empty() { None } else { Some(place(&one.effect, &one.targets)) };
        let mut parameters = one.parameters.iter().map(|estimated| match &alone {
            Some(alone) => format!("{} for {alone} alone", parameter(estimated)),
            None => parameter(estimated),
        });
        table.row([
            effect,
            at,
            parameters.next().unwrap_or_default(),
            step(one.residual_rms_um),
            step(one.held_out_rms_um),
            one.held_out_expected_rms_um.map_or_else(String::new, |value| significant(value, 3)),
            significant(one.delta_bic, 3),
            chance(one.p_value),
        ]);
        for further in parameters {
            table.row(["", "", &further]);
        }
    }
    table
}

/// An effect and where it acts; of a confounded set all that it may be.
fn named(one: &Added) -> [String; 2] {
    let targets = one.targets.join(", ");
    let others: Option<Vec<&str>> = one
        .confounded_with
        .iter()
        .map(|other| other.strip_prefix(one.effect.as_str()).and_then(|target| target.strip_prefix(' ')))
        .collect();
    match others {
        Some(others) => [one.effect.clone(), [&[targets.as_str()], &others[..]].concat().join(" or ")],
        None => [one.members(), String::new()],
    }
}

fn confounded(added: &[Added]) -> Vec<String> {
    let sets = added.iter().filter(|one| !one.confounded_with.is_empty());
    sets.map(|one| {
        let by = one.distinguished_by.as_ref().map(|by| format!("; to decide: {by}")).unwrap_or_default();
        format!("{}{by}", one.members())
    })
    .collect()
}

/// Keys of the rig, each with its value.
fn changes(added: &[Added]) -> Vec<String> {
    added.iter().filter_map(|one| one.change.as_ref()).flat_map(|change| change.lines()).map(str::to_owned).collect()
}

fn moved(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new(2, ["", "section", "before", "after ± std"]);
    for one in &diagnosis.moved {
        let (reference, filter) = (one.reference.as_deref(), one.filter.as_deref());
        let id = ValueId { symbol: &one.value, reference, filter, band_upr: [0; 2], of: None };
        table.row([
            format!("{} {}", described(&id), unit(&one.unit)),
            one.section.clone().unwrap_or_default(),
            significant(one.before, 6),
            with_std(one.after, one.std) + &lacking(&one.lost_orders),
        ]);
    }
    table
}

fn unexplained(diagnosis: &Diagnosis) -> Table {
    let unit = unit(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let mut table = Table::new(6, ["station", "sensor", "setup", "orders", "where", &format!("rms {unit}")]);
    for one in &diagnosis.unexplained {
        let [first, last] = one.orders;
        // Groups of measured points have neither sensors nor orders.
        let group = one.sensor.is_none() && one.setup.is_none() && one.orders == [0, 0];
        let several = |id: &Option<String>| match id {
            Some(id) => id.clone(),
            None if group => String::new(),
            None => "several".into(),
        };
        table.row([
            one.station.clone().unwrap_or_default(),
            several(&one.sensor),
            several(&one.setup),
            match one.orders {
                _ if group => String::new(),
                _ if first == last => first.to_string(),
                _ => format!("{first}-{last}"),
            },
            one.place.clone(),
            if one.rms_um > 0.0 { significant(one.rms_um, 3) } else { String::new() },
        ]);
    }
    table
}

fn refused(diagnosis: &Diagnosis) -> Vec<String> {
    diagnosis.refused.iter().map(|one| format!("{}: {}", place(&one.effect, &one.targets), one.reason)).collect()
}

/// One row an effect and result, however many targets it has.
fn blind(all: &[Blind]) -> Table {
    let mut table = Table::new(3, ["effect", "at", "moves", "by (rms for one unit)"]);
    let mut groups: Vec<Vec<&Blind>> = Vec::new();
    for one in all {
        let key =
            |blind: &Blind| (blind.effect.clone(), blind.bias_per_unit.on.clone(), blind.bias_per_unit.unit.clone());
        match groups.iter_mut().find(|group| group.first().is_some_and(|first| key(first) == key(one))) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    for group in groups {
        let (Some(first), Some([low, _, high])) =
            (group.first(), spread(group.iter().map(|one| one.bias_per_unit.value)))
        else {
            continue;
        };
        let [low, high] = [low, high].map(|value| significant(value, 2));
        let size = if low == high { low } else { format!("{low} to {high}") };
        let has_targets = all.iter().any(|one| one.effect == first.effect && !one.targets.is_empty());
        let target = |one: &&Blind| match one.targets[..] {
            [] if has_targets => WHOLE.to_owned(),
            ref targets => targets.join(", "),
        };
        let targets: Vec<String> = group.iter().map(target).collect();
        let per_unit = unit(&first.bias_per_unit.unit);
        table.row([
            first.effect.clone(),
            targets.join(", "),
            first.bias_per_unit.on.clone(),
            format!("{size} {per_unit}"),
        ]);
    }
    table
}

fn place(effect: &str, targets: &[String]) -> String {
    std::iter::once(effect).chain(targets.iter().map(String::as_str)).collect::<Vec<_>>().join(" ")
}

fn step(step: Step) -> String {
    match [step.before, step.after] {
        [None, None] => String::new(),
        values => {
            let [before, after] = values.map(|value| value.map_or_else(|| "-".into(), |value| significant(value, 3)));
            format!("{before} → {after}")
        }
    }
}

fn parameter(one: &Estimated) -> String {
    let value = one.std.map_or_else(|| significant(one.value, 3), |std| estimated(one.value, std));
    format!("{} {value} {}", one.name, unit(&one.unit)).trim_end().to_owned()
}

/// A parameter of any size with its standard uncertainty, of which two digits are given.
fn estimated(value: f64, std: f64) -> String {
    if !(std > 0.0 && std < 1e-5) {
        return with_std(value, Some(std));
    }
    let digits = 2.0 + (value.abs() / std).log10().floor();
    let digits = if digits.is_finite() { digits.clamp(2.0, 12.0) as usize } else { 2 };
    format!("{} ± {std:.1e}", significant(value, digits))
}

fn chance(p_value: f64) -> String {
    if p_value < 1e-99 {
        "<1e-99".into()
    } else if p_value < 1e-3 {
        format!("{p_value:.0e}")
    } else {
        significant(p_value, 2)
    }
}

fn shown(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(|| "-".into(), |value| significant(value, digits))
}

fn unit(id: &str) -> String {
    match id {
        "1" => String::new(),
        "deg" => "°".into(),
        _ => super::unit(id).replace("/deg", "/°"),
    }
}

#[cfg(test)]
mod tests;
