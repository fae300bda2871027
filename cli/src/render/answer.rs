//! The answer of a result, as the terminal opens with it.

use runout_core::answer::{Answer, KeyValue, Number};

use super::{
    number::{lacking, significant, with_std},
    page::Page,
    table::Table,
    unit,
};

/// Behind a number that its own data refute.
pub(crate) const REFUTED: &str = " !";
/// Behind a number that lies outside its own interval.
pub(crate) const OUTSIDE: &str = " ^";
/// Digits of a number without a standard uncertainty.
const DIGITS: usize = 4;

/// Verdict, loop and key values.
pub(crate) fn section(page: &mut Page, answer: &Answer) {
    page.line(&answer.verdict.sentence);
    let (named, more) = answer.named_contradictions();
    for reason in named {
        page.line(format_args!("  ! {reason}"));
    }
    if more > 0 {
        page.line(format_args!("  ! and {more} more: every one is listed with --json"));
    }
    for step in &answer.steps {
        page.line(format_args!("  {step}"));
    }
    key_values(page, &answer.key_values);
}

fn key_values(page: &mut Page, values: &[KeyValue]) {
    let several = values.iter().any(|value| value.numbers.len() > 1);
    let header = if several {
        ["", "unit", "before", "lowest ± std", "median ± std", "highest ± std", ""]
    } else {
        ["", "unit", "before", "value ± std", "", "", ""]
    };
    let mut table = Table::new(2, header);
    for value in values {
        let mut cells = vec![value.name(), unit(&value.unit)];
        cells.push(value.before.map_or_else(String::new, |before| as_precise(before, value.numbers.first())));
        cells.extend(value.numbers.iter().map(|one| number(one, value.is_refuted)));
        cells.resize(6, String::new());
        cells.push(lacking(&value.lost_orders).trim_start().to_owned());
        table.row(cells);
    }
    page.headed_table("Key values", &table);
    if values.iter().any(|value| value.is_refuted) {
        page.line(format_args!(" {REFUTED} the data contradict the ±: no limit is proven by it"));
    }
    if values.iter().flat_map(|value| &value.numbers).any(Number::is_outside) {
        page.line(format_args!(
            " {OUTSIDE} outside its own 95 % interval: noise raises an extreme (docs/uncertainty.md)"
        ));
    }
}

/// A number with its own standard uncertainty, and with its marks.
fn number(one: &Number, is_refuted: bool) -> String {
    let shown = one.std.map_or_else(|| significant(one.value, DIGITS), |std| with_std(one.value, Some(std)));
    let outside = if one.is_outside() { OUTSIDE } else { "" };
    let refuted = if is_refuted { REFUTED } else { "" };
    format!("{shown}{outside}{refuted}")
}

/// A number with as many digits as the uncertainty of another one gives a meaning to.
pub(crate) fn as_precise(number: f64, beside: Option<&Number>) -> String {
    let Some(std) = beside.and_then(|beside| beside.std) else { return significant(number, DIGITS) };
    let shown = with_std(number, Some(std));
    shown.split_once(" ± ").map_or_else(|| shown.clone(), |(number, _)| number.to_owned())
}
