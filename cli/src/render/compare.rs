//! Several separators on the same data, for people.

mod points;

use runout_core::pipeline::compare::{Comparison, Difference, MethodValue, QuantityComparison};

use super::{
    count,
    number::{lacking, place, ranges, rounded_place, significant, spread},
    page::Page,
    table::Table,
};

/// The text of a comparison.
#[must_use]
pub(crate) fn text(comparison: &Comparison) -> String {
    let mut page = page(comparison);
    let outputs: Vec<String> = comparison.outputs.iter().map(|path| path.display().to_string()).collect();
    page.bullets("Written", &outputs);
    page.into_text()
}

/// A comparison as lines and tables.
#[must_use]
pub(crate) fn page(comparison: &Comparison) -> Page {
    let mut page = Page::default();
    page.line(&comparison.title);
    if comparison.stations.is_empty() && !comparison.values.is_empty() {
        return points::page(page, comparison);
    }
    page.line(format_args!("{}, compared with {}", count(comparison.stations.len(), "station"), comparison.reference));
    methods(&mut page, comparison);
    let several = if comparison.stations.len() > 1 { ", medians over the stations" } else { "" };
    page.headed_table(
        format_args!(
            "Values: form from 2/rev, motion from 1/rev (± is the standard uncertainty at any one angle){several}"
        ),
        &values(comparison),
    );
    let differences = differences(comparison);
    if !differences.is_empty() {
        page.headed_table(format_args!("Differences from {}{several}", comparison.reference), &differences);
        let quantities = || comparison.stations.iter().flat_map(|station| &station.quantities);
        let has = |shown: fn(&Difference) -> bool| quantities().flat_map(|one| &one.differences).any(shown);
        if has(|one| one.expected_rms.is_some()) {
            page.line("  expected: from the noise measured over the turns, with what both methods have in common");
        }
        if has(|one| one.share_within.is_some() || one.worst.is_some()) {
            page.line("  E_n = |difference| / (2 × its standard uncertainty), order by order: scatter alone keeps it");
            page.line("  at or below 1 at 98.2 % of the orders");
        }
    }
    page.bullets("Not compared", &not_compared(comparison));
    let refused: Vec<String> =
        comparison.refused.iter().map(|refusal| format!("{}: {}", refusal.method, refusal.reason)).collect();
    page.bullets("Refused", &refused);
    page.warnings("Warnings and notes", &notes(comparison));
    page
}

fn methods(page: &mut Page, comparison: &Comparison) {
    let mut table = Table::new(4, ["method", "not used", "lost orders of form", "of motion"]);
    for method in &comparison.methods {
        let [form, motion] = [&method.lost_orders.form, &method.lost_orders.motion].map(|orders| ranges(orders));
        table.row([method.method.clone(), method.unused.join(", "), form, motion]);
    }
    page.headed_table("Methods", &table);
}

/// What a row is about: the quantity with its section.
type Key = (String, Option<String>);

fn key(quantity: &QuantityComparison) -> Key {
    (quantity.quantity.clone(), quantity.section.clone())
}

/// Every quantity with its unit, in the order of the first station.
fn quantities(comparison: &Comparison) -> Vec<(Key, String)> {
    let mut found: Vec<(Key, String)> = Vec::new();
    for quantity in comparison.stations.iter().flat_map(|station| &station.quantities) {
        if !found.iter().any(|(known, _)| *known == key(quantity)) {
            let unit = if quantity.unit == "urad" { "µrad" } else { "µm" };
            found.push((key(quantity), unit.to_owned()));
        }
    }
    found
}

/// One quantity at every station, with the station's name.
fn at_stations<'a>(
    comparison: &'a Comparison,
    wanted: &'a Key,
) -> impl Iterator<Item = (&'a str, &'a QuantityComparison)> {
    comparison.stations.iter().flat_map(move |station| {
        let of = station.quantities.iter().filter(move |quantity| key(quantity) == *wanted);
        of.map(|quantity| (station.station.as_str(), quantity))
    })
}

fn median(values: impl IntoIterator<Item = f64>) -> Option<f64> {
    spread(values).map(|[_, middle, _]| middle)
}

fn shown(value: Option<f64>, digits: usize) -> String {
    value.map_or_else(String::new, |value| significant(value, digits))
}

fn name((quantity, section): &Key, unit: &str) -> String {
    let section = section.as_ref().map(|id| format!(" {id}")).unwrap_or_default();
    format!("{}{section}, {unit}", quantity.replace('_', " "))
}

fn values(comparison: &Comparison) -> Table {
    let mut table = Table::new(2, ["", "method", "rms", "±", "RONt LSCI, unfiltered", "true error"]);
    for (wanted, unit) in quantities(comparison) {
        let mut label = name(&wanted, &unit);
        for method in &comparison.methods {
            let of = |value: &dyn Fn(&MethodValue) -> Option<f64>| {
                median(at_stations(comparison, &wanted).filter_map(|(_, quantity)| {
                    value(quantity.values.iter().find(|value| value.method == method.method)?)
                }))
            };
            let Some(rms) = of(&|value| Some(value.rms)) else { continue };
            let ront_um = of(&|value| value.ront_um);
            let first = at_stations(comparison, &wanted)
                .find_map(|(_, quantity)| quantity.values.iter().find(|value| value.method == method.method));
            // Order 1 is centring.
            let lost = first.map_or_else(Vec::new, |value| without_centring(&value.lost_orders));
            table.row([
                std::mem::take(&mut label),
                method.method.clone(),
                significant(rms, 5),
                shown(of(&|value| value.std), 2),
                shown(ront_um, 5) + &ront_um.map_or_else(String::new, |_| lacking(&lost)),
                shown(of(&|value| value.truth_rms_error_um), 2),
            ]);
        }
    }
    table
}

fn without_centring(orders: &[usize]) -> Vec<usize> {
    orders.iter().copied().filter(|order| *order > 1).collect()
}

fn differences(comparison: &Comparison) -> Table {
    let several = comparison.stations.len() > 1;
    let header = ["", "method", "orders", "rms", "expected", "E_n ≤ 1", "worst E_n", "at order", "station"];
    let mut table = Table::new(2, header);
    for (wanted, unit) in quantities(comparison) {
        let mut label = name(&wanted, &unit);
        for method in comparison.methods.iter().skip(1) {
            let found: Vec<(&str, &Difference)> = at_stations(comparison, &wanted)
                .filter_map(|(station, quantity)| {
                    let difference = quantity.differences.iter().find(|one| one.method == method.method)?;
                    (difference.orders_compared > 0).then_some((station, difference))
                })
                .collect();
            if found.is_empty() {
                continue;
            }
            let orders: usize = found.iter().map(|(_, one)| one.orders_compared).sum();
            let within = found.iter().filter_map(|(_, one)| Some(one.share_within? * one.orders_compared as f64));
            let share = within.clone().next().map(|_| 100.0 * within.sum::<f64>() / orders as f64);
            let worst = found
                .iter()
                .filter_map(|(station, one)| Some((station, one.worst?)))
                .max_by(|(_, a), (_, b)| a.e_n.total_cmp(&b.e_n));
            let place = worst.filter(|(_, worst)| worst.e_n > 0.0);
            table.row([
                std::mem::take(&mut label),
                method.method.clone(),
                orders.to_string(),
                shown(median(found.iter().filter_map(|(_, one)| one.rms)), 2),
                shown(median(found.iter().filter_map(|(_, one)| one.expected_rms)), 2),
                share.map_or_else(String::new, |share| format!("{share:.1} %")),
                worst.map_or_else(String::new, |(_, worst)| normalised(worst.e_n)),
                place.map_or_else(String::new, |(_, worst)| worst.order.to_string()),
                place.filter(|_| several).map_or_else(String::new, |(station, _)| (*station).to_owned()),
            ]);
        }
    }
    table
}

/// Beyond 1000 scatter has no part in the difference, and the figure is rounding's.
fn normalised(e_n: f64) -> String {
    if e_n > 1000.0 { ">1000".into() } else { significant(e_n, 3) }
}

fn not_compared(comparison: &Comparison) -> Vec<String> {
    let quantities = comparison.stations.iter().flat_map(|station| &station.quantities);
    quantities
        .flat_map(|quantity| {
            let reasons = quantity.differences.iter().filter_map(|one| Some((&one.method, one.not_compared.as_ref()?)));
            reasons.map(|(method, reason)| format!("{} of {method}: {reason}", quantity.quantity))
        })
        .collect()
}

fn notes(comparison: &Comparison) -> Vec<String> {
    let mut notes = comparison.warnings.clone();
    for method in &comparison.methods {
        // The table says what is not used.
        let unused = format!("not used: {}", method.unused.join(", "));
        let own = method.notes.iter().filter(|note| **note != unused);
        notes.extend(own.map(|note| format!("{}: {note}", method.method)));
    }
    notes.extend(plane(comparison));
    notes
}

/// Where x and y are compared, where that is not the spindle's reference.
fn plane(comparison: &Comparison) -> Option<String> {
    let motions = comparison.stations.iter().flat_map(|station| &station.quantities);
    let planes = motions.filter(|quantity| quantity.quantity == "x" || quantity.quantity == "y");
    let places = planes.flat_map(|quantity| quantity.values.iter().filter_map(|value| value.z_mm));
    let [low, _, high] = spread(places)?;
    let [first, last] = [low, high].map(place);
    let at = if last == first { format!("{last} mm") } else { format!("{first} to {last} mm, station by station") };
    (rounded_place(high) != 0.0).then(|| {
        format!(
            "x and y are the axis's displacement at z = {at}: tilt, which moves it to z = 0, is not observable by every method"
        )
    })
}
