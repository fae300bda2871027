//! The short version of `runout-studies blind`.

use runout_core::closed_loop::diagnosis::Verdict;
use runout_studies::blind::{self, draw::Kind};

use crate::trials::trials;

#[test]
fn what_is_wrong_is_named_and_nothing_else() {
    // The first six have all kinds.
    let all = blind::campaigns(trials(12).max(6) as u64, 2, None).unwrap();
    println!("{}", blind::report::report(&all));
    for judged in &all {
        let place = format!("campaign {}: {}; said {}", judged.campaign.index, judged.planted(), judged.said());
        match judged.campaign.kind {
            Kind::Clean => {
                assert_eq!(judged.diagnosis.verdict, Verdict::AtNoiseFloor, "{place}");
                assert!(judged.diagnosis.added.is_empty(), "{place}");
            }
            Kind::Single | Kind::Pair => {
                assert!(judged.effects.iter().all(|traced| traced.named || !traced.visible), "{place}");
            }
            Kind::Stranger => {
                let shows = judged.effects.iter().any(|traced| traced.visible);
                assert!(!shows || judged.diagnosis.verdict == Verdict::Unexplained, "{place}");
            }
        }
    }
    assert!(all.iter().any(|judged| judged.effects.iter().any(|traced| traced.named)));
}
