//! The tests of the data on themselves: what was tested, what it found, what was done.

use maud::{Markup, html};
use runout_core::{consistency::Check, numerics::number::significant, summary::Summary};

/// Tests that are listed; all are in the table `consistency`.
const MOST: usize = 60;

/// The section; findings first.
pub(crate) fn section(summary: &Summary) -> Markup {
    let mut checks: Vec<&Check> = summary.consistency.iter().collect();
    checks.sort_by(|a, b| a.finding.is_empty().cmp(&b.finding.is_empty()).then(a.p.total_cmp(&b.p)));
    let findings = checks.iter().filter(|check| !check.finding.is_empty()).count();
    html! {
        @if !checks.is_empty() {
            section #consistency {
                h2 { "Consistency of the data" }
                p {
                    (checks.len()) " tests of the data on themselves; "
                    @if findings == 0 { "none found anything." } @else { (findings) " found something." }
                }
                details open[findings > 0] {
                    summary { "Tests" }
                    div.scroll tabindex="0" role="region" aria-label="Tests of the data" {
                        table {
                            thead {
                                tr {
                                    th { "test" } th { "where" } th { "of" } th.number { "statistic" } th.number { "degrees of freedom" }
                                    th.number { "p" } th.number { "factor on ±" } th { "done" } th { "found" }
                                }
                            }
                            tbody {
                                @for check in checks.iter().take(MOST) {
                                    tr {
                                        td { (check.test.name()) }
                                        td { bdi { (crate::one_line(&check.part)) } }
                                        td { bdi { (crate::one_line(&check.of)) } }
                                        td.number { (significant(check.statistic, 3)) }
                                        td.number { (freedom(check)) }
                                        td.number { (significant(check.p, 2)) }
                                        td.number { (significant(check.factor, 3)) }
                                        td { (check.did.name()) }
                                        td { bdi { (crate::one_line(&check.finding)) } }
                                    }
                                }
                            }
                        }
                    }
                    @if checks.len() > MOST { p.note { (checks.len() - MOST) " more are in the table consistency." } }
                }
            }
        }
    }
}

fn freedom(check: &Check) -> String {
    check.dof.iter().map(|dof| significant(*dof, 3)).collect::<Vec<_>>().join(", ")
}
