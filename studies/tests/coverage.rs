//! The short version of `runout-studies coverage`.

use runout_studies::coverage::{Setting, rows, table};

#[test]
fn stated_intervals_cover_the_true_value() {
    let rows = rows(&Setting::Reference.campaigns(0, 40)).unwrap();
    println!("{}", table(&rows));
    let linear = rows.iter().filter(|row| !["RONt", "Ra"].contains(&&*row.name));
    assert_eq!(linear.clone().count(), 3 * 5, "form, x, y and two tilts; two bands of orders and angles each");
    for row in linear {
        // The fewest intervals are 1200 (x to order 15); their share of 95 % is known to 0.6 %. A campaign's angles
        // depend on each other, but its errors have some hundred orders. 3 % is four to five of these deviations; a
        // standard uncertainty that is wrong by a fifth would give 88 or 98.1 %.
        assert!((92.0..=98.0).contains(&row.percent()), "{}: {:.1} %", row.name, row.percent());
    }
}
