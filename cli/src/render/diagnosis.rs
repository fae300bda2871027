//! What the closed loop found, for people.

use runout_core::model::diagnosis::{Added, Blind, Diagnosis, Estimated, Level, Step, Verdict};

use super::{
    number::{ranges, significant, spread, with_std},
    page::Page,
    table::Table,
};

/// The text of a diagnosis.
#[must_use]
pub fn text(diagnosis: &Diagnosis) -> String {
    let mut page = Page::default();
    page.line(match (diagnosis.verdict, diagnosis.after.chi2_per_dof) {
        (Verdict::AtNoiseFloor, Some(_)) => "At the noise floor: the declared model leaves noise only",
        (Verdict::AtNoiseFloor, None) => "Nothing found: no effect earns its place (what noise there is, is not known)",
        (Verdict::Explained, Some(_)) => "Explained: with what was added, noise only is left",
        (Verdict::Explained, None) => "Explained: nothing else earns its place (what noise there is, is not known)",
        (Verdict::Unexplained, _) => "Unexplained: something is left that no known effect explains",
    });
    page.headed_table("Error before and after", &levels(diagnosis));
    page.headed_table("What the declared model lacks", &added(diagnosis));
    page.bullets("Cannot be told from", &confounded(&diagnosis.added));
    page.headed_table("What moved", &moved(diagnosis));
    page.headed_table("Left, and not explained", &unexplained(diagnosis));
    page.bullets("Looked likely, and refused", &refused(diagnosis));
    page.headed_table("What these data cannot show, and what it would do all the same", &blind(&diagnosis.blind_to));
    if let Some(lost) = &diagnosis.lost_orders {
        page.heading("Lost orders");
        page.line(format_args!("  form    {}", ranges(&lost.form)));
        page.line(format_args!("  motion  {}", ranges(&lost.motion)));
    }
    page.bullets("Warnings and notes", &diagnosis.warnings);
    page.into_text()
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
    row(format!("left by the fit, rms {unit}"), 3, of(|level| Some(level.residual_rms_um)));
    row(format!("noise lets expect, rms {unit}"), 3, of(|level| level.noise_floor_um));
    row("chi squared per degree of freedom".into(), 3, of(|level| level.chi2_per_dof));
    row(format!("left of data not used, rms {unit}"), 3, of(|level| level.held_out_rms_um));
    if let Some(truth) = &diagnosis.truth {
        let Step { before, after } = truth.form_rms_error_um;
        row("true error of form, rms µm".into(), 2, [before, after]);
    }
    table
}

fn added(diagnosis: &Diagnosis) -> Table {
    let unit = unit(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let [left, unused] = [format!("left {unit}"), format!("of data not used {unit}")];
    let mut table = Table::new(3, ["effect", "at", "parameter ± std", &left, &unused, "ΔBIC", "p"]);
    for one in &diagnosis.added {
        let mut parameters = one.parameters.iter().map(parameter);
        table.row([
            one.effect.clone(),
            one.targets.join(", "),
            parameters.next().unwrap_or_default(),
            step(one.residual_rms_um),
            step(one.held_out_rms_um),
            significant(one.delta_bic, 3),
            chance(one.p_value),
        ]);
        for further in parameters {
            table.row(["", "", &further]);
        }
    }
    table
}

fn confounded(added: &[Added]) -> Vec<String> {
    let sets = added.iter().filter(|one| !one.confounded_with.is_empty());
    sets.map(|one| {
        let by = one.told_apart_by.as_ref().map(|by| format!("; told apart by {by}")).unwrap_or_default();
        format!("{}: {}{by}", place(&one.effect, &one.targets), one.confounded_with.join(", "))
    })
    .collect()
}

fn moved(diagnosis: &Diagnosis) -> Table {
    let mut table = Table::new(2, ["", "section", "before", "after ± std"]);
    for one in &diagnosis.moved {
        table.row([
            format!("{} {}", one.value, unit(&one.unit)),
            one.section.clone().unwrap_or_default(),
            significant(one.before, 5),
            with_std(one.after, one.std),
        ]);
    }
    table
}

fn unexplained(diagnosis: &Diagnosis) -> Table {
    let unit = unit(diagnosis.before.unit.as_deref().unwrap_or("um"));
    let mut table = Table::new(5, ["sensor", "setup", "orders", "where", &format!("rms {unit}")]);
    for one in &diagnosis.unexplained {
        let [first, last] = one.orders;
        table.row([
            one.sensor.clone().unwrap_or_else(|| "several".into()),
            one.setup.clone().unwrap_or_else(|| "several".into()),
            if first == last { first.to_string() } else { format!("{first}-{last}") },
            one.place.clone(),
            significant(one.rms_um, 3),
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
        let targets: Vec<String> = group.iter().map(|one| one.targets.join(", ")).collect();
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
    let value = estimated(one.value, one.std);
    format!("{} {value} {}", one.name, unit(&one.unit)).trim().to_owned()
}

/// A parameter of any size with its standard uncertainty, of which two digits are told.
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

fn unit(unit: &str) -> String {
    unit.replace("um", "µm").replace("urad", "µrad")
}

#[cfg(test)]
mod tests;
