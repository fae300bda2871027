//! Which effects a rig would show, for people.

use runout_core::closed_loop::{
    diagnosis::BiasPerUnit,
    foresight::{Foresight, Visible, VisibleFrom},
};

use super::{
    number::{significant, spread},
    page::Page,
    table::Table,
};

/// Effects that would show, and from which size on.
pub(crate) fn visible(page: &mut Page, foresight: &Foresight) {
    let mut table = Table::new(3, ["effect", "at", "parameter", "visible from", "usual size"]);
    for alike in groups(&foresight.visible, |one| (&one.effect, &one.targets)) {
        let Some(first) = alike.first() else { continue };
        let each = foresight.visible.iter().map(|one| (&one.effect, &one.targets));
        let targets = targets(&first.effect, alike.iter().map(|one| &one.targets), each);
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

/// Effects that are not visible, or cannot be distinguished.
pub(crate) fn hidden(page: &mut Page, foresight: &Foresight) {
    // Face and z are of axial sensors: a table leaves out columns without entries.
    let columns = ["form", "motion", "face", "z"];
    let heads = ["effect", "at"].map(str::to_owned).into_iter();
    let mut table = Table::new(6, heads.chain(columns.map(|on| format!("moves {on} by (rms)"))));
    for alike in groups(&foresight.blind_to, |one| (&one.blind.effect, &one.blind.targets)) {
        let Some(first) = alike.first() else { continue };
        let moves = |on: &str| {
            let units = first.bias.iter().filter(|bias| bias.on == on).map(|bias| &bias.unit);
            let each = units.map(|unit| {
                let same = |bias: &&BiasPerUnit| bias.on == on && bias.unit == *unit;
                sizes(alike.iter().flat_map(|one| one.bias.iter().filter(same).map(|bias| bias.value)), unit)
            });
            each.collect::<Vec<_>>().join(", ")
        };
        let each = foresight.blind_to.iter().map(|one| (&one.blind.effect, &one.blind.targets));
        let targets = targets(&first.blind.effect, alike.iter().map(|one| &one.blind.targets), each);
        let [form, motion, face, z] = columns.map(moves);
        table.row([first.blind.effect.clone(), targets, form, motion, face, z]);
    }
    page.headed_table("Effects that are not visible, and what one unit does all the same", &table);
    let sets: Vec<String> = foresight.confounded.iter().map(|set| names(set)).collect();
    page.bullets("Effects that cannot be distinguished", &sets);
}

/// Where an effect acts without a target, beside others of it that have one: uneven speed in all setups, or in one.
pub(crate) const WHOLE: &str = "the whole rig";

/// "sensor-gain S1, S2" from "sensor-gain S1" and "sensor-gain S2".
#[must_use]
pub(crate) fn names(names: &[String]) -> String {
    let mut shown = String::new();
    let mut last = "";
    let has_targets = |effect: &str| names.iter().any(|name| name.split_once(' ').is_some_and(|(id, _)| id == effect));
    for name in names {
        let (effect, target) = name.split_once(' ').unwrap_or((name, ""));
        let whole = target.is_empty() && has_targets(effect);
        if !shown.is_empty() {
            shown.push_str(", ");
        }
        let again = effect == last;
        match (again, whole) {
            (true, true) => shown.push_str(WHOLE),
            (false, true) => shown.extend([name, " ", WHOLE]),
            (true, false) if !target.is_empty() => shown.push_str(target),
            _ => shown.push_str(name),
        }
        last = effect;
    }
    shown
}

/// Neighbours and others of one effect together; what has no target for itself.
fn groups<T>(all: &[T], of: impl Fn(&T) -> (&String, &Vec<String>)) -> Vec<Vec<&T>> {
    let mut groups: Vec<Vec<&T>> = Vec::new();
    let alike = |a: &T, b: &T| of(a).0 == of(b).0 && of(a).1.is_empty() == of(b).1.is_empty();
    for one in all {
        match groups.iter_mut().find(|group| group.first().is_some_and(|first| alike(first, one))) {
            Some(group) => group.push(one),
            None => groups.push(vec![one]),
        }
    }
    groups
}

/// Targets of one effect, among all effects that are listed with their targets.
fn targets<'a>(
    effect: &str,
    targets: impl Iterator<Item = &'a Vec<String>>,
    mut all: impl Iterator<Item = (&'a String, &'a Vec<String>)>,
) -> String {
    let names: Vec<String> = targets.map(|targets| targets.join(" ")).filter(|target| !target.is_empty()).collect();
    let names = names.join(", ");
    let beside = names.is_empty() && all.any(|(other, targets)| other == effect && !targets.is_empty());
    if beside { WHOLE.to_owned() } else { names }
}

/// "0.015 to 0.016 %"; a share is shown in per cent.
fn sizes(values: impl Iterator<Item = f64>, unit: &str) -> String {
    let (factor, unit) = if unit == "1" { (100.0, "%".to_owned()) } else { (1.0, super::unit(unit)) };
    let Some([low, _, high]) = spread(values.map(|value| value * factor)) else { return String::new() };
    let [low, high] = [low, high].map(|value| if value < 1e-12 { "0".into() } else { significant(value, 2) });
    if low == high { format!("{low} {unit}") } else { format!("{low} to {high} {unit}") }
}

#[cfg(test)]
mod tests {
    use runout_core::closed_loop::foresight::{Foresight, Visible};

    use super::{Page, names, visible};

    #[test]
    fn what_acts_on_the_rig_or_on_one_setup_has_two_rows() {
        let one = |targets: &[&str]| Visible {
            effect: "speed-ripple".into(),
            targets: targets.iter().map(|target| (*target).into()).collect(),
            parameters: Vec::new(),
        };
        let all = [one(&[]), one(&["a"]), one(&["b"])];
        let mut page = Page::default();
        visible(&mut page, &Foresight { visible: all.into(), ..Foresight::default() });
        let text = page.into_text();
        assert_eq!(text.matches("speed-ripple").count(), 2, "{text}");
        assert!(text.contains("the whole rig") && text.contains("a, b") && !text.contains(", ,"), "{text}");
        let mut page = Page::default();
        visible(&mut page, &Foresight { visible: vec![one(&[])], ..Foresight::default() });
        assert!(!page.into_text().contains("the whole rig"), "nothing to distinguish it from");
    }

    #[test]
    fn names_say_what_is_without_a_target() {
        let shown = |all: &[&str]| names(&all.iter().map(|name| (*name).to_owned()).collect::<Vec<_>>());
        assert_eq!(shown(&["sensor-gain S1", "sensor-gain S2"]), "sensor-gain S1, S2");
        assert_eq!(shown(&["speed-ripple", "speed-ripple a", "speed-ripple b"]), "speed-ripple the whole rig, a, b");
        assert_eq!(shown(&["speed-ripple", "even-order-motion"]), "speed-ripple, even-order-motion");
    }
}
