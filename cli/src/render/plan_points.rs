//! A plan of measured points, for people.

use runout_core::{
    closed_loop::foresight::{Foresight, Visible},
    stage::{LayoutScore, NoiseGain, PointPlan},
};

use super::{
    foresight,
    number::{ranges, significant},
    page::Page,
    table::Table,
};
use crate::reports::plan::PointReport;

/// A plan as lines and tables.
#[must_use]
pub(crate) fn page(report: &PointReport) -> Page {
    let plan = &report.plan;
    let mut page = Page::default();
    page.line(&report.title);
    page.line(format_args!("{}, planned for {}", report.separator, plan.foresight.assuming));
    for (group, gains) in &plan.noise_gain {
        page.headed_table(
            format_args!("Noise gain, {group}: standard deviation for 1 µm in every reading"),
            &noise_gain(plan, group, gains),
        );
    }
    if let Some(lost) = &plan.lost_orders {
        page.heading("Lost orders");
        for (quantity, orders) in &lost.0 {
            page.line(format_args!("  {quantity:<6}  {}", ranges(orders)));
        }
    }
    suggestions(&mut page, plan);
    let foresight = shortened(&plan.foresight);
    foresight::visible(&mut page, &foresight);
    let blind: Vec<String> = foresight.blind_names().collect();
    page.bullets(
        "Effects that are not visible",
        &if blind.is_empty() { blind } else { vec![foresight::names(&blind)] },
    );
    let sets: Vec<String> = foresight.confounded.iter().map(|set| foresight::names(set)).collect();
    page.bullets("Effects that cannot be distinguished", &sets);
    page.bullets("Notes", &plan.notes);
    page
}

/// Without what is taken for granted, which stands above, and with orders that would show alike as one: "lobing-order-16…27".
fn shortened(foresight: &Foresight) -> Foresight {
    let kind = |effect: &str| effect.trim_end_matches(|digit: char| digit.is_ascii_digit()).to_owned();
    let sizes = |one: &Visible| one.parameters.iter().map(|one| significant(one.visible_from, 2)).collect::<Vec<_>>();
    let mut visible: Vec<Visible> = Vec::new();
    for one in &foresight.visible {
        let own = kind(&one.effect);
        let alike = |last: &&mut Visible| {
            let first = last.effect.split('…').next().unwrap_or_default();
            own != one.effect && kind(first) == own && last.targets == one.targets && sizes(last) == sizes(one)
        };
        match visible.last_mut().filter(alike) {
            Some(last) => {
                let first = last.effect.split('…').next().unwrap_or_default();
                last.effect = format!("{first}…{}", one.effect.trim_start_matches(&own));
            }
            None => visible.push(one.clone()),
        }
    }
    Foresight { assuming: String::new(), visible, ..foresight.clone() }
}

fn shown(gain: Option<f64>) -> String {
    gain.map_or_else(|| "lost".into(), |gain| significant(gain, 3))
}

/// As it is, and with each addition.
fn noise_gain(plan: &PointPlan, group: &str, gains: &[NoiseGain]) -> Table {
    let mut header = vec![String::new(), "as it is".into()];
    header.extend(plan.suggestions.iter().zip(1..).map(|(_, number)| format!("with {number}")));
    let mut table = Table::new(1, header);
    for (place, gain) in gains.iter().enumerate() {
        let unit = super::unit(&gain.unit);
        let name = match gain.order {
            Some(order) => format!("order {order}"),
            None => format!("{}, {unit}", gain.quantity),
        };
        let with = plan.suggestions.iter().map(|addition| {
            shown(addition.noise_gain.get(group).and_then(|gains| gains.get(place)).and_then(|gain| gain.gain))
        });
        table.row([name, shown(gain.gain)].into_iter().chain(with));
    }
    table
}

fn suggestions(page: &mut Page, plan: &PointPlan) {
    let mut table =
        Table::new(2, ["", "what one addition does, best first", "lost", "worst noise gain, µm", "of", "rms, µm"]);
    let cells = |number: String, text: &str, score: &LayoutScore| {
        let worst_of = score.worst_of.clone().unwrap_or_default();
        [number, text.to_owned(), score.lost.to_string(), or_none(score.worst), worst_of, or_none(score.rms)]
    };
    if !plan.suggestions.is_empty() {
        table.row(cells(String::new(), "as it is", &plan.score));
    }
    for (number, addition) in (1..).zip(&plan.suggestions) {
        table.row(cells(number.to_string(), &addition.text, &addition.after));
    }
    page.headed_table("What to add", &table);
    let mut lines = Vec::new();
    for (number, addition) in (1..).zip(&plan.suggestions) {
        let mut does = vec![format!("{number}: {}", addition.entry)];
        if !addition.reveals.is_empty() {
            does.push(format!("shows {}", foresight::names(&addition.reveals)));
        }
        let sets: Vec<String> = addition.distinguishes.iter().map(|set| foresight::names(set)).collect();
        if !sets.is_empty() {
            does.push(format!("distinguishes {}", sets.join("; ")));
        }
        lines.push(does.join("; "));
    }
    page.bullets("In the pipeline", &lines);
}

fn or_none(gain: Option<f64>) -> String {
    gain.map_or_else(|| "-".into(), |gain| significant(gain, 3))
}
