//! Values as they are handed on to other programs: one list for all domains, each value with the limit that names it.

use std::collections::HashMap;

use runout_draws::IntervalKind;
use runout_evaluate::{Limit, LimitValue, NamedValue, PlacedValue, ValueId};

use super::Summary;

/// A value of any domain with its place, its uncertainty and, where a limit names it, what that proves.
#[derive(Debug, Clone, Copy)]
#[non_exhaustive]
pub struct ReportedValue<'a> {
    /// The station; none for a value of the whole part or of measured points.
    pub station: Option<&'a str>,
    /// Place of the section, or of the carriage, along the axis, in mm.
    pub z_mm: Option<f64>,
    /// Which value it is. It is `of` a section, a part, an axis; of nothing where it is of a station or the whole.
    pub id: ValueId<'a>,
    /// The number; none where it is not observable.
    pub value: Option<f64>,
    /// Its standard uncertainty; none where it is not known.
    pub std: Option<f64>,
    /// Its interval of 95 %; none where that is not known.
    pub interval_95: Option<[f64; 2]>,
    /// What that contains.
    pub interval: Option<IntervalKind>,
    /// Its unit; empty for a number without one.
    pub unit: &'a str,
    /// What it is, with standard and clause.
    pub about: &'a str,
    /// Why no uncertainty is stated.
    pub no_uncertainty: Option<&'a str>,
    /// What of its own data refutes it.
    pub refuted_by: Option<&'a str>,
    /// The limit that names it, and what was found.
    pub limit: Option<(&'a Limit, &'a LimitValue)>,
}

impl<'a> ReportedValue<'a> {
    /// Which value it is, with its station.
    fn key(&self) -> Key<'a> {
        let ValueId { symbol, reference, filter, of, .. } = self.id;
        [self.station, of, Some(symbol), reference, filter]
    }

    /// What the user should know of it: what refutes it, why nothing is proven, why no uncertainty is stated.
    #[must_use]
    pub fn remark(&self) -> Option<&'a str> {
        let missing = self.limit.and_then(|(_, found)| found.missing.as_deref());
        self.refuted_by.or(missing).or(self.no_uncertainty)
    }
}

/// Station, what it is of, symbol, reference, filter.
type Key<'a> = [Option<&'a str>; 5];

impl<'a> From<PlacedValue<'a>> for ReportedValue<'a> {
    fn from(PlacedValue { station, section, z_mm, value }: PlacedValue<'a>) -> Self {
        Self {
            station,
            z_mm,
            id: ValueId { of: section, ..value.id() },
            value: Some(value.value).filter(|value| value.is_finite()),
            std: value.uncertainty.as_ref().map(|known| known.std),
            interval_95: value.uncertainty.as_ref().map(|known| known.interval_95),
            interval: value.uncertainty.as_ref().map(|known| known.kind),
            unit: &value.unit,
            about: &value.source,
            no_uncertainty: value.no_uncertainty.as_deref(),
            refuted_by: value.refuted_by.as_deref(),
            limit: None,
        }
    }
}

impl<'a> From<&'a NamedValue> for ReportedValue<'a> {
    fn from(value: &'a NamedValue) -> Self {
        Self {
            station: None,
            z_mm: None,
            id: value.id(),
            value: value.value,
            std: value.std,
            interval_95: value.interval_95,
            interval: value.interval_95.map(|_| IntervalKind::Coverage),
            unit: &value.unit,
            about: &value.about,
            no_uncertainty: value.no_uncertainty.as_deref(),
            refuted_by: value.refuted_by.as_deref(),
            limit: None,
        }
    }
}

impl Summary {
    /// Every value: of form and motion, then a domain's own. A value that several limits name comes once for each of them.
    #[must_use]
    pub fn reported_values(&self) -> Vec<ReportedValue<'_>> {
        let mut limited: HashMap<Key, Vec<(&Limit, &LimitValue)>> = HashMap::new();
        for limit in &self.limits {
            for found in &limit.values {
                // A domain's own values have neither.
                let [reference, filter] =
                    [&found.reference, &found.filter].map(|text| Some(text.as_str()).filter(|text| !text.is_empty()));
                let (symbol, of) = (&*limit.limit.symbol, found.section.as_deref());
                let key = [found.station.as_deref(), of, Some(symbol), reference, filter];
                limited.entry(key).or_default().push((&limit.limit, found));
            }
        }
        let placed = self.placed_values().into_iter().map(ReportedValue::from);
        let mut all = Vec::new();
        for value in placed.chain(self.values.iter().map(ReportedValue::from)) {
            // Orders of one form differ by the band alone; a domain's own values have none.
            let is_of = |found: &LimitValue| [[0; 2], found.band_upr].contains(&value.id.band_upr);
            let limits = limited.get(&value.key()).into_iter().flatten().filter(|(_, found)| is_of(found));
            let before = all.len();
            all.extend(limits.map(|limit| ReportedValue { limit: Some(*limit), ..value }));
            if all.len() == before {
                all.push(value);
            }
        }
        all
    }
}

#[cfg(test)]
mod tests {
    #![allow(clippy::unwrap_used, reason = "tests")]

    use runout_evaluate::{LimitSummary, Value, decide};

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
        let mut own = NamedValue::new("gain", f64::NAN, f64::NAN, "", "gain of the probe").of("probe");
        own.refuted_by = Some("repeats".into());
        let mut summary = Summary { stations: vec![station], values: vec![own], ..Summary::default() };
        let limits: Vec<LimitSummary> = decide(&[limit(1.0), limit(2.0)], &summary.placed_values()).unwrap().0;
        summary.limits = limits;
        let all = summary.reported_values();
        assert_eq!(all.len(), 5);
        let rows: Vec<_> = all.iter().take(4).map(|one| (one.value.unwrap(), one.limit.unwrap())).collect();
        for (value, (limit, found)) in &rows {
            assert_eq!(found.within, *value <= limit.upper.unwrap());
            assert!((found.value - value).abs() < 1e-15);
        }
        assert_eq!(rows.iter().filter(|(_, (limit, _))| limit.upper == Some(1.0)).count(), 2);
        let own = all.last().unwrap();
        assert_eq!((own.value, own.id.of, own.remark(), own.station), (None, Some("probe"), Some("repeats"), None));
    }
}
