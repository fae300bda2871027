//! Numbers as a metrologist writes them.

/// `value` with so many significant digits; powers of ten where a plain number would be mostly zeros.
#[must_use]
pub fn significant(value: f64, digits: usize) -> String {
    if !value.is_finite() {
        return "-".into();
    }
    let magnitude = value.abs();
    if magnitude != 0.0 && !(1e-4..1e6).contains(&magnitude) {
        return format!("{value:.*e}", digits.saturating_sub(1));
    }
    let above = if magnitude == 0.0 { 0 } else { magnitude.log10().floor() as isize };
    let decimals = digits.saturating_sub(1).saturating_add_signed(-above);
    format!("{value:.decimals$}")
}

/// `value` with so many significant digits and its sign, also where that is +.
#[must_use]
pub fn signed(value: f64, digits: usize) -> String {
    let sign = if value > 0.0 { "+" } else { "" };
    format!("{sign}{}", significant(value, digits))
}

/// A value with as many decimals as its standard uncertainty (two significant digits) gives a meaning to.
#[must_use]
pub fn with_std(value: f64, std: Option<f64>) -> String {
    match std {
        Some(std) if std.is_finite() && std > ROUNDING => {
            let decimals = usize::try_from(1 - std.log10().floor() as i32).unwrap_or(0);
            if decimals > MOST_DECIMALS {
                format!("{} ± {std:.0e}", significant(value, 6))
            } else {
                format!("{value:.decimals$} ± {std:.decimals$}")
            }
        }
        _ => significant(value, 5),
    }
}

/// A picometre and less means nothing for form in µm: such uncertainties are rounding.
const MOST_DECIMALS: usize = 6;
/// A standard uncertainty that is rounding of arithmetic in any unit that is used: µm, mm, µrad, degrees.
pub const ROUNDING: f64 = 1e-15;
/// Half a nanometre, in mm: places that are nearer to 0 are 0 but for rounding.
const NO_PLACE_MM: f64 = 5e-7;

/// A place, in mm, that is 0 but for rounding as 0.
#[must_use]
pub fn rounded_place(z_mm: f64) -> f64 {
    if z_mm.abs() < NO_PLACE_MM { 0.0 } else { z_mm }
}

/// A place, in mm, in words.
#[must_use]
pub fn place(z_mm: f64) -> String {
    significant(rounded_place(z_mm), 5)
}

/// Ranges that are listed of irregular numbers: more hide what is beside them.
const MOST_RANGES: usize = 16;

/// Ascending numbers as ranges: "2-80 even", "4-80 by 4", "1, 7", "none"; of very many ranges the first ones, and the last number.
#[must_use]
pub fn ranges(numbers: &[usize]) -> String {
    let mut shown = Vec::new();
    let mut rest = numbers;
    while let Some((first, after)) = rest.split_first() {
        let step = after.first().map_or(0, |second| second - first);
        let run = 1 + rest.windows(2).take_while(|pair| pair[1] - pair[0] == step).count();
        let last = first + step * (run - 1);
        // Two numbers are no pattern yet.
        let taken = if run < 3 { 1 } else { run };
        shown.push(match (taken, step) {
            (1, _) => first.to_string(),
            (_, 1) => format!("{first}-{last}"),
            (_, 2) => format!("{first}-{last} {}", if first % 2 == 0 { "even" } else { "odd" }),
            _ => format!("{first}-{last} by {step}"),
        });
        rest = &rest[taken..];
    }
    match numbers.last() {
        None => "none".into(),
        Some(last) if shown.len() > MOST_RANGES => {
            format!("{}, … {last} ({} in all)", shown[..MOST_RANGES].join(", "), numbers.len())
        }
        Some(_) => shown.join(", "),
    }
}

/// " (orders 3, 6, 9… lost)", behind a number that lacks these orders; nothing where it lacks none.
#[must_use]
pub fn lacking(lost_orders: &[usize]) -> String {
    let shown: Vec<String> = lost_orders.iter().take(LISTED).map(ToString::to_string).collect();
    let more = if lost_orders.len() > LISTED { "…" } else { "" };
    match lost_orders.len() {
        0 => String::new(),
        1 => format!(" (order {} lost)", shown[0]),
        _ => format!(" (orders {}{more} lost)", shown.join(", ")),
    }
}

/// Lost orders that are listed behind a number: enough to see how they go on.
const LISTED: usize = 3;

/// Below so many µm or µrad numbers are given in nm or nrad.
const SMALL: f64 = 0.1;

/// The factor and the unit in which numbers of at most this size are read best: nm where µm would be mostly zeros.
#[must_use]
pub fn in_small_unit(largest: f64, unit: &str) -> (f64, &str) {
    match unit {
        "um" if largest > 0.0 && largest < SMALL => (1e3, "nm"),
        "urad" if largest > 0.0 && largest < SMALL => (1e3, "nrad"),
        _ => (1.0, unit),
    }
}

/// A unit as the field writes it: "µm/m" of `um/m`.
#[must_use]
pub fn unit_text(id: &str) -> String {
    let of_part = |part: &str| {
        let letters = part.trim_end_matches(|character: char| !character.is_ascii_alphabetic());
        if matches!(letters, "um" | "urad") { format!("µ{}", &part[1..]) } else { part.to_owned() }
    };
    id.split_inclusive(['/', '(', ' ', '·']).map(of_part).collect()
}

/// Whether two values are equal up to rounding.
#[must_use]
pub fn same(a: f64, b: f64) -> bool {
    (a - b).abs() <= 1e-9 * a.abs().max(b.abs())
}

/// Lowest, middle and highest of the finite values.
#[must_use]
pub fn spread(values: impl IntoIterator<Item = f64>) -> Option<[f64; 3]> {
    let mut sorted: Vec<f64> = values.into_iter().filter(|value| value.is_finite()).collect();
    sorted.sort_by(f64::total_cmp);
    let middle = (sorted.get((sorted.len().checked_sub(1)?) / 2)? + sorted.get(sorted.len() / 2)?) / 2.0;
    Some([*sorted.first()?, middle, *sorted.last()?])
}

#[cfg(test)]
mod tests {
    use super::{in_small_unit, lacking, place, ranges, significant, spread, unit_text, with_std};

    #[test]
    fn small_numbers_have_small_units() {
        let units = [(0.099, "um"), (0.1, "um"), (0.0, "um"), (0.01, "mm"), (0.05, "urad")];
        assert_eq!(units.map(|(largest, unit)| in_small_unit(largest, unit).1), ["nm", "um", "um", "mm", "nrad"]);
    }

    #[test]
    fn units_are_shown_as_the_field_writes_them() {
        let ids = ["um", "urad", "um/m", "um/(um/m)", "um3/um2", "mm", "1", "volume/um2"];
        assert_eq!(ids.map(unit_text), ["µm", "µrad", "µm/m", "µm/(µm/m)", "µm3/µm2", "mm", "1", "volume/µm2"]);
    }

    #[test]
    fn orders_become_ranges() {
        let even: Vec<usize> = (2..=80).step_by(2).collect();
        assert_eq!(ranges(&even), "2-80 even");
        let mut with_one = vec![1];
        with_one.extend(&even);
        assert_eq!(ranges(&with_one), "1, 2-80 even");
        assert_eq!(ranges(&(4..=80).step_by(4).collect::<Vec<_>>()), "4-80 by 4");
        assert_eq!(ranges(&[1, 2, 3, 9, 255, 257]), "1-3, 9, 255, 257");
        assert_eq!(ranges(&[3, 5, 7, 8]), "3-7 odd, 8");
        assert_eq!(ranges(&[]), "none");
        let beside: Vec<usize> = (1..=8).flat_map(|fold| [256 * fold - 1, 256 * fold + 1]).collect();
        assert!(ranges(&beside).ends_with("1793, 2047, 2049"), "{}", ranges(&beside));
        let more: Vec<usize> = beside.iter().copied().chain([2303, 2305]).collect();
        assert!(ranges(&more).ends_with("1793, 2047, 2049, … 2305 (18 in all)"), "{}", ranges(&more));
    }

    #[test]
    fn a_number_says_which_orders_it_lacks() {
        let text = [&[][..], &[5], &[2, 4], &[3, 6, 9, 12]].map(lacking);
        assert_eq!(text, ["", " (order 5 lost)", " (orders 2, 4 lost)", " (orders 3, 6, 9… lost)"]);
    }

    #[test]
    fn digits_follow_the_magnitude() {
        assert_eq!(significant(21.6412, 4), "21.64");
        assert_eq!(significant(0.006_512, 2), "0.0065");
        assert_eq!(significant(0.0, 3), "0.00");
        assert_eq!(significant(1234.56, 2), "1235");
        assert_eq!(significant(3.21e-16, 2), "3.2e-16");
        assert_eq!(significant(f64::NAN, 2), "-");
        assert_eq!([-4.422e-9, 1e-6, -120.5].map(place), ["0.0000", "1.0000e-6", "-120.50"]);
    }

    #[test]
    fn digits_follow_the_uncertainty() {
        assert_eq!(with_std(4.012_34, Some(0.0034)), "4.0123 ± 0.0034");
        assert_eq!(with_std(412.34, Some(25.0)), "412 ± 25");
        assert_eq!(with_std(4.012_34, Some(3e-12)), "4.01234 ± 3e-12");
        assert_eq!(with_std(4.012_34, Some(3e-17)), "4.0123");
        assert_eq!(with_std(0.0, Some(4e-76)), "0.0000");
        assert_eq!(with_std(4.012_34, None), "4.0123");
    }

    #[test]
    fn spread_ignores_what_is_not_known() {
        assert_eq!(spread([3.0, f64::NAN, 1.0]), Some([1.0, 2.0, 3.0]));
        assert_eq!(spread([5.0, 1.0, 2.0]), Some([1.0, 2.0, 5.0]));
        assert_eq!(spread([f64::NAN]), None);
    }
}
