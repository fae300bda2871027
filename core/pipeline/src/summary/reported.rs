//! Values as they are handed on to other programs: one list for all domains, each value with the limit that names it.

use std::collections::HashMap;

use runout_evaluate::{Limit, LimitValue, PlacedValue, Value, ValueId};

use super::Summary;

/// A value with its place and, where a limit names it, what that proves.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ReportedValue<'a> {
    /// The value, and where it belongs.
    pub placed: PlacedValue<'a>,
    /// The limit that names it, and what was found.
    pub limit: Option<(&'a Limit, &'a LimitValue)>,
}

impl<'a> ReportedValue<'a> {
    /// The value.
    #[must_use]
    pub fn value(&self) -> &'a Value {
        self.placed.value
    }

    /// What the user should know of it: what refutes it, why nothing is proven, why no uncertainty is stated.
    #[must_use]
    pub fn remark(&self) -> Option<&'a str> {
        let missing = self.limit.and_then(|(_, found)| found.missing.as_deref());
        self.value().refuted_by.as_deref().or(missing).or(self.value().no_uncertainty.as_deref())
    }
}

/// Its station, and which value it is.
type Key<'a> = (Option<&'a str>, ValueId<'a>);

impl Summary {
    /// Every value: of form and motion, then a domain's own. A value that several limits name comes once for each of them.
    #[must_use]
    pub fn reported_values(&self) -> Vec<ReportedValue<'_>> {
        let mut limited: HashMap<Key, Vec<(&Limit, &LimitValue)>> = HashMap::new();
        for limit in &self.limits {
            for found in &limit.values {
                limited
                    .entry((found.station.as_deref(), found.id(&limit.limit)))
                    .or_default()
                    .push((&limit.limit, found));
            }
        }
        let mut all = Vec::new();
        for placed in self.all_values() {
            match limited.get(&(placed.station, placed.id())) {
                Some(limits) => all.extend(limits.iter().map(|limit| ReportedValue { placed, limit: Some(*limit) })),
                None => all.push(ReportedValue { placed, limit: None }),
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_evaluate::{LimitSummary, decide};

    use super::*;
    use crate::summary::{SectionSummary, StationSummary};

    fn amplitude(order: usize, value: f64) -> Value {
        let json = serde_json::json!({
            "symbol": "amplitude", "unit": "um", "value": value, "source": "", "band_upr": [order, order], "lost_orders": [],
            "filter": "none", "reference": "LSCI", "coverage": 1.0, "uncertainty": null,
        });
        serde_json::from_value(json).unwrap()
    }

    fn limit(upper: f64) -> Limit {
        serde_json::from_value(serde_json::json!({ "symbol": "amplitude", "unit": "um", "upper": upper })).unwrap()
    }

    #[test]
    fn orders_keep_their_own_limits_and_two_limits_of_a_value_are_two_rows() {
        let section = SectionSummary {
            section: "a".into(),
            z_mm: 5.0,
            form_rms_um: 1.0,
            form_std_um: None,
            values: vec![amplitude(2, 1.5), amplitude(3, 0.5)],
            truth_form_rms_error_um: None,
        };
        let station: StationSummary = serde_json::from_value(serde_json::json!({
            "station": "s", "z_mm": 5.0, "captures": [], "sections": [section], "motion_values": [], "residual_rms_um": null,
            "expected_residual_rms_um": null, "chi2_per_dof": null, "truth": null, "warnings": [],
        }))
        .unwrap();
        let mut own = Value::new("gain", f64::NAN, f64::NAN, "", "gain of the probe").of("probe");
        own.refuted_by = Some("repeats".into());
        let mut summary = Summary { stations: vec![station], values: vec![own], ..Summary::default() };
        let limits: Vec<LimitSummary> = decide(&[limit(1.0), limit(2.0)], &summary.placed_values()).unwrap().0;
        summary.limits = limits;
        let all = summary.reported_values();
        assert_eq!(all.len(), 5);
        let rows: Vec<_> = all.iter().take(4).map(|one| (one.value().value, one.limit.unwrap())).collect();
        for (value, (limit, found)) in &rows {
            assert_eq!(found.within, *value <= limit.upper.unwrap());
            assert!((found.value - value).abs() < 1e-15);
        }
        assert_eq!(rows.iter().filter(|(_, (limit, _))| limit.upper == Some(1.0)).count(), 2);
        let own = all.last().unwrap();
        let found = (own.value().number(), own.placed.id().of, own.remark(), own.placed.station);
        assert_eq!(found, (None, Some("probe"), Some("repeats"), None));
    }
}
