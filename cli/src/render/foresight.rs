//! Which effects a rig would show, for people.

use runout_core::model::{
    diagnosis::BiasPerUnit,
    foresight::{Foresight, Visible, VisibleFrom},
};

use super::{
    number::{significant, spread},
    page::Page,
    table::Table,
};

/// Effects that would show, and from which size on.
pub fn visible(page: &mut Page, foresight: &Foresight) {
    let mut table = Table::new(3, ["effect", "at", "parameter", "visible from", "usual size"]);
    for alike in groups(&foresight.visible, |one| &one.effect) {
        let Some(first) = alike.first() else { continue };
        let targets = targets(alike.iter().map(|one| &one.targets));
        if first.parameters.is_empty() {
            table.row([first.effect.as_str(), &targets, "", "as it is", ""]);
        }
        for (index, parameter) in first.parameters.iter().enumerate() {
            let from = alike.iter().filter_map(|one: &&Visible| Some(one.parameters.get(index)?.visible_from));
            let [name, at] = if index == 0 { [first.effect.as_str(), &targets] } else { [""; 2] };
            let VisibleFrom { name: of, tolerance, unit, .. } = parameter;
            table.row([name, at, of, &sizes(from, unit), &sizes(std::iter::once(*tolerance), unit)]);
        }
    }
    page.headed_table("Effects that would show", &table);
    if !foresight.assuming.is_empty() {
        page.line(format_args!("  taken for granted: {}", foresight.assuming));
    }
}

/// Effects that would not show, or not be told apart.
pub fn hidden(page: &mut Page, foresight: &Foresight) {
    let mut table = Table::new(4, ["effect", "at", "moves form by (rms)", "moves motion by (rms)"]);
    for alike in groups(&foresight.blind_to, |one| &one.blind.effect) {
        let Some(first) = alike.first() else { continue };
        let moves = |on: &str| {
            let units = first.bias.iter().filter(|bias| bias.on == on).map(|bias| &bias.unit);
            let each = units.map(|unit| {
                let same = |bias: &&BiasPerUnit| bias.on == on && bias.unit == *unit;
                sizes(alike.iter().flat_map(|one| one.bias.iter().filter(same).map(|bias| bias.value)), unit)
            });
            each.collect::<Vec<_>>().join(", ")
        };
        let targets = targets(alike.iter().map(|one| &one.blind.targets));
        table.row([first.blind.effect.clone(), targets, moves("form"), moves("motion")]);
    }
    page.headed_table("Effects that would not show, and what one unit does all the same", &table);
    let sets: Vec<String> = foresight.confounded.iter().map(|set| names(set)).collect();
    page.bullets("Effects that cannot be told apart", &sets);
}

/// "sensor-gain S1, S2" from "sensor-gain S1" and "sensor-gain S2".
#[must_use]
pub fn names(names: &[String]) -> String {
    let mut shown = String::new();
    let mut last = "";
    for name in names {
        let (effect, target) = name.split_once(' ').unwrap_or((name, ""));
        if !shown.is_empty() {
            shown.push_str(", ");
        }
        shown.push_str(if effect == last && !target.is_empty() { target } else { name });
        last = effect;
    }
    shown
}

/// Neighbours and others of one effect together.
fn groups<T>(all: &[T], effect: impl Fn(&T) -> &String) -> Vec<Vec<&T>> {
    let mut groups: Vec<Vec<&T>> = Vec::new();
    for one in all {
        match groups.iter_mut().find(|group| group.first().is_some_and(|first| effect(first) == effect(one))) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

fn targets<'a>(targets: impl Iterator<Item = &'a Vec<String>>) -> String {
    targets.flatten().map(String::as_str).collect::<Vec<_>>().join(", ")
}

/// "0.015 to 0.016 %"; a share is shown in per cent.
fn sizes(values: impl Iterator<Item = f64>, unit: &str) -> String {
    let (factor, unit) = if unit == "1" { (100.0, "%".to_owned()) } else { (1.0, unit.replace("um", "µm")) };
    let Some([low, _, high]) = spread(values.map(|value| value * factor)) else { return String::new() };
    let [low, high] = [low, high].map(|value| if value < 1e-12 { "0".into() } else { significant(value, 2) });
    if low == high { format!("{low} {unit}") } else { format!("{low} to {high} {unit}") }
}
