//! Mistakes of a file of points or of its declaration: columns that are exchanged or have the other sign, angles that count the other way.

use runout_consistency::{Check, Test};

use super::{Column, Points};

/// Share of the scatter of repeats that is left where the readings of a pass are put right, below which they stand at wrong places; and how
/// much more others may leave that are named beside.
const SHARE: f64 = 0.04;
const ALIKE: f64 = 2.0;
/// Passes up to which all pairs are tried.
const MOST_PASSES: usize = 30;

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

/// A pass with the readings of another one, or with its own in reverse order, `pass-swapped`: readings of one place then agree far better if
/// they are put right. `place` is that of each row, `passes` are the rows of each pass in the order of the file, with its name; offsets of
/// passes do not count. Two passes that are each other's reverse are exchanged unseen: all their readings are at mirrored places. `None` where
/// no place is in two passes.
#[must_use]
pub fn passes(place: &[usize], passes: &[(String, Vec<usize>)], readings: &[[f64; 3]]) -> Option<Check> {
    if !(2..=MOST_PASSES).contains(&passes.len()) {
        return None;
    }
    let declared: Vec<usize> = (0..readings.len()).collect();
    let reversed = passes.iter().map(|(name, rows)| {
        let mut order = declared.clone();
        rows.iter().zip(rows.iter().rev()).for_each(|(row, other)| order[*row] = *other);
        (format!("the readings of {name} are in reverse order"), order)
    });
    let pairs =
        passes.iter().enumerate().flat_map(|(index, one)| passes[..index].iter().map(move |other| (other, one)));
    let exchanged = pairs.filter(|(one, other)| one.1.len() == other.1.len()).map(|((one, rows), (other, others))| {
        let mut order = declared.clone();
        rows.iter().zip(others).for_each(|(row, other)| (order[*row], order[*other]) = (*other, *row));
        (format!("the readings of {one} and {other} are exchanged"), order)
    });
    let (before, freedom) = scatter(place, passes, readings, &declared);
    let mut tried: Vec<(String, f64)> =
        reversed.chain(exchanged).map(|(what, order)| (what, scatter(place, passes, readings, &order).0)).collect();
    tried.sort_by(|one, other| one.1.total_cmp(&other.1));
    let share = tried.first()?.1 / before;
    if freedom < 1.0 || !share.is_finite() {
        return None;
    }
    let alike: Vec<&str> =
        tried.iter().filter(|one| one.1 <= ALIKE * tried[0].1).map(|(what, _)| what.as_str()).collect();
    let p = if share < SHARE { 0.0 } else { 1.0 };
    Some(Check::new(Test::Repeats, "order of the passes", share, &[freedom, freedom], p).finding(|| {
        format!(
            "it looks as if {}: put right, readings of one place would scatter {:.1} times less",
            alike.join(", or "),
            share.sqrt().recip()
        )
    }))
}

/// Squares of readings less the means of their passes and places, and their number less that of the means. `order` has the row whose reading
/// each row gets.
fn scatter(place: &[usize], passes: &[(String, Vec<usize>)], readings: &[[f64; 3]], order: &[usize]) -> (f64, f64) {
    let places = place.iter().max().map_or(0, |last| last + 1);
    let (mut squares, mut freedom) = (0.0, 0.0);
    for component in 0..3 {
        let mut left: Vec<f64> = order.iter().map(|row| readings[*row][component]).collect();
        for (_, rows) in passes {
            let mean = rows.iter().map(|row| left[*row]).sum::<f64>() / rows.len() as f64;
            rows.iter().for_each(|row| left[*row] -= mean);
        }
        let mut of_place = vec![(0.0, 0.0, 0.0); places];
        for (left, place) in left.iter().zip(place).filter(|(left, _)| left.is_finite()) {
            let (count, sum, square) = &mut of_place[*place];
            (*count, *sum, *square) = (*count + 1.0, *sum + left, *square + left * left);
        }
        for (count, sum, square) in of_place.into_iter().filter(|(count, ..)| *count > 1.0) {
            squares += square - sum * sum / count;
            freedom += count - 1.0;
        }
    }
    (squares, freedom)
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

    /// Places, passes and readings.
    type Passes = (Vec<usize>, Vec<(String, Vec<usize>)>, Vec<[f64; 3]>);

    /// Passes over 13 places, the second one in an order that is not its own inverse, and what is read at each place.
    fn two_passes() -> Passes {
        let place: Vec<usize> = (0..13).chain((0..13).map(|row| row * 5 % 13)).collect();
        let read = |(row, place): (usize, &usize)| {
            let x = *place as f64;
            [x.sin() * 8.0 + 0.1 * (row as f64).cos(), x * x - 7.0 * x, f64::NAN]
        };
        let readings = place.iter().enumerate().map(read).collect();
        let passes = vec![("pass 1".to_owned(), (0..13).collect()), ("pass 2".to_owned(), (13..26).collect())];
        (place, passes, readings)
    }

    #[test]
    fn readings_of_passes_that_stand_at_wrong_places_are_named() {
        let (place, runs, sound) = two_passes();
        assert!(passes(&place, &runs, &sound).is_some_and(|check| check.finding.is_empty()));
        let exchanged: Vec<[f64; 3]> = sound[13..].iter().chain(&sound[..13]).copied().collect();
        let found = passes(&place, &runs, &exchanged).unwrap();
        assert!(found.refutes() && found.finding.contains("pass 1 and pass 2 are exchanged"), "{}", found.finding);
        let reversed: Vec<[f64; 3]> = sound[..13].iter().chain(sound[13..].iter().rev()).copied().collect();
        let found = passes(&place, &runs, &reversed).unwrap();
        assert!(found.finding.contains("pass 2 are in reverse order"), "{}", found.finding);
        // One pass, and passes that share no place, say nothing.
        assert!(passes(&place[..13], &runs[..1], &sound[..13]).is_none());
        let apart: Vec<usize> = (0..26).collect();
        assert!(passes(&apart, &runs, &sound).is_none());
    }

    #[test]
    fn a_mistake_has_to_leave_far_less() {
        let said = |left: f64| likeliest(10.0, 2.0, [("a".to_owned(), 9.0), ("b".to_owned(), left)].into_iter());
        assert!(said(1.0).is_some_and(|words| words.contains("if b: ") && words.contains("10.0 times less")));
        assert_eq!(said(3.0), None);
    }
}
