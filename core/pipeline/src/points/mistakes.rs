//! Mistakes of a file of points or of its declaration: columns that are exchanged or have the other sign, angles that count the other way.

use super::{Column, Points};

/// The points with two columns exchanged, with columns negated, and with two exchanged of which one is negated (turned by 90°), each with what
/// is wrong in words. Columns that the points lack are left out.
pub fn columns<'a>(
    points: &'a Points,
    exchanged: &'a [[&'a str; 2]],
    negated: &'a [&'a [&'a str]],
) -> impl Iterator<Item = (String, Points)> + 'a {
    let has = |name: &&str| points.columns.iter().any(|column| column.name == *name);
    let negations = negated.iter().filter(move |names| names.iter().all(has)).map(move |names| {
        let verb = if names.len() > 1 { "have" } else { "has" };
        (format!("{} {verb} the other sign", listed(names)), negate(points.clone(), names))
    });
    let pairs = exchanged.iter().filter(move |pair| pair.iter().all(has)).flat_map(move |pair| {
        let [one, other] = *pair;
        let both = exchange(points.clone(), *pair);
        let turned = [one, other].map(|name| {
            (
                format!("`{one}` and `{other}` are exchanged, `{name}` with the other sign"),
                negate(both.clone(), &[name]),
            )
        });
        std::iter::once((format!("`{one}` and `{other}` are exchanged"), both.clone())).chain(turned)
    });
    negations.chain(pairs)
}

fn listed(names: &[&str]) -> String {
    names.iter().map(|name| format!("`{name}`")).collect::<Vec<_>>().join(", ")
}

fn negate(mut points: Points, names: &[&str]) -> Points {
    for column in points.columns.iter_mut().filter(|column| names.contains(&column.name.as_str())) {
        column.values.iter_mut().for_each(|value| *value = -*value);
    }
    points
}

fn exchange(mut points: Points, [one, other]: [&str; 2]) -> Points {
    for Column { name, .. } in &mut points.columns {
        if name == one {
            other.clone_into(name);
        } else if name == other {
            one.clone_into(name);
        }
    }
    points
}

/// The correction that leaves least, in words, where that is less than a limit: what the data leave as declared, and corrected, are root mean
/// squares in one unit.
#[must_use]
pub fn likeliest(declared: f64, limit: f64, corrected: impl Iterator<Item = (String, f64)>) -> Option<String> {
    let (what, left) = corrected.filter(|(_, left)| left.is_finite()).min_by(|a, b| a.1.total_cmp(&b.1))?;
    let times = declared / left.max(f64::MIN_POSITIVE);
    (left < limit)
        .then(|| format!("it looks as if {what}: corrected for it, the fit would leave {times:.1} times less"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_alternative_changes_what_it_says() {
        let column = |name: &str, value: f64| Column { name: name.into(), values: vec![value] };
        let points = Points { columns: vec![column("dx_mm", 1.0), column("dy_mm", 2.0)], ..Points::default() };
        let all: Vec<(String, Points)> =
            columns(&points, &[["dx_mm", "dy_mm"], ["dx_mm", "dz_mm"]], &[&["dx_mm"], &["c_deg"]]).collect();
        let values: Vec<(&str, f64, f64)> = all
            .iter()
            .map(|(what, points)| {
                let of = |name: &str| points.column(name).map_or(f64::NAN, |values| values[0]);
                (what.as_str(), of("dx_mm"), of("dy_mm"))
            })
            .collect();
        assert_eq!(
            values,
            [
                ("`dx_mm` has the other sign", -1.0, 2.0),
                ("`dx_mm` and `dy_mm` are exchanged", 2.0, 1.0),
                ("`dx_mm` and `dy_mm` are exchanged, `dx_mm` with the other sign", -2.0, 1.0),
                ("`dx_mm` and `dy_mm` are exchanged, `dy_mm` with the other sign", 2.0, -1.0),
            ]
        );
    }

    #[test]
    fn a_mistake_has_to_leave_far_less() {
        let said = |left: f64| likeliest(10.0, 2.0, [("a".to_owned(), 9.0), ("b".to_owned(), left)].into_iter());
        assert!(said(1.0).is_some_and(|words| words.contains("if b: ") && words.contains("10.0 times less")));
        assert_eq!(said(3.0), None);
    }
}
