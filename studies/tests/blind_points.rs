//! The short version of `runout-studies blind --domain …`.

use runout_studies::blind::{Kind, domains, points};

use crate::trials::trials;

#[test]
fn what_is_wrong_is_named_and_nothing_else() {
    // The first six have all kinds.
    let (full, campaigns) = (12, trials(12).max(6));
    let mut of_all = 0;
    for domain in &domains::ALL {
        let all = points::campaigns(domain, campaigns as u64, 2).unwrap();
        println!("{}\n\n{}", domain.name, points::report::report(&all));
        let mut visible = 0;
        for judged in &all {
            let place = format!("{} {}: {}; said {}", domain.name, judged.index, judged.planted(), judged.said());
            if judged.kind == Kind::Clean {
                assert!(judged.false_alarms.is_empty() && !judged.is_unexplained(), "{place}");
            }
            visible += usize::from(judged.is_visible());
        }
        // An effect may be near the limit: one miss at most.
        let missed = all.iter().filter(|judged| judged.kind != Kind::Clean && !judged.failures().is_empty()).count();
        assert!(missed <= 1 && full * visible >= 3 * campaigns, "{}: {missed} missed, {visible} visible", domain.name);
        of_all += missed;
    }
    assert!(full * of_all <= domains::ALL.len() * campaigns, "{of_all} missed");
}
