//! The standards' values of what a domain of points offers beside closed profiles: open profiles and height maps.

use super::{Evaluate, Group, open_profile, plane_map};
use crate::{
    stage::{Evaluable, EvaluableKind},
    summary::{NamedValue, PlacedValue},
};
use runout_error::Result;
use runout_standards::Value;

/// Values, each with what it is of, and what they are not.
#[derive(Debug, Clone, Default, PartialEq)]
pub(in crate::pipeline) struct Evaluated {
    pub values: Vec<(String, Value)>,
    pub remarks: Vec<String>,
}

impl Evaluated {
    /// Of each of these; closed profiles are evaluated section by section and count for nothing here.
    ///
    /// # Errors
    /// When a height map cannot be evaluated as it is asked for.
    pub(crate) fn of(evaluables: &[Evaluable], evaluate: &Evaluate) -> Result<Self> {
        let mut all = Self::default();
        for one in evaluables {
            match one {
                Evaluable::ClosedProfiles(_) => {}
                Evaluable::OpenProfile(profile) => all.add(&profile.of, open_profile::values(profile, evaluate)),
                Evaluable::HeightMap(map) => all.add(&map.of, plane_map::values(map, evaluate)?),
            }
        }
        Ok(all)
    }

    fn add(&mut self, of: &str, (values, remarks): (Vec<Value>, Vec<String>)) {
        self.remarks.extend(remarks.into_iter().map(|remark| format!("{of}: {remark}")));
        self.remarks.extend(unknown(of, &values));
        self.values.extend(values.into_iter().map(|value| (of.to_owned(), value)));
    }

    /// As values of a result.
    pub(crate) fn named(&self) -> impl Iterator<Item = NamedValue> + '_ {
        self.values.iter().map(|(of, value)| NamedValue::standard(of, value))
    }

    /// With their places, for limits: what a value is of stands for its section.
    pub(crate) fn placed(&self) -> impl Iterator<Item = PlacedValue<'_>> {
        self.values.iter().map(|(of, value)| PlacedValue { station: None, section: Some(of), z_mm: None, value })
    }
}

/// Values that one sentence names, at most.
const MOST_NAMED: usize = 8;

/// Says of which values no uncertainty is stated, and why: a sentence for each reason.
fn unknown(of: &str, values: &[Value]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for value in values {
        let Some(reason) = value.no_uncertainty.as_deref() else { continue };
        let name = format!("{} about {}", value.symbol, value.reference);
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, names)) => names.push(name),
            None => reasons.push((reason, vec![name])),
        }
    }
    let sentence = |(reason, names): (&str, Vec<String>)| {
        let which = if names.len() > MOST_NAMED { format!("{} values", names.len()) } else { names.join(", ") };
        format!("{of}: no uncertainty of {which}: {reason}")
    };
    reasons.into_iter().map(sentence).collect()
}

impl Group {
    /// What its values are computed from.
    pub(super) fn sources(self) -> &'static [EvaluableKind] {
        match self {
            Self::Roundness | Self::Harmonics | Self::Cylindricity | Self::Twist => &[EvaluableKind::ClosedProfiles],
            Self::Straightness => &[EvaluableKind::OpenProfile],
            Self::Texture => &[EvaluableKind::ClosedProfiles, EvaluableKind::OpenProfile],
            Self::Areal => &[EvaluableKind::ClosedProfiles, EvaluableKind::HeightMap],
            Self::ErrorMotion => &[EvaluableKind::AxisMotion],
        }
    }

    /// Whether one of these gives it.
    pub(super) fn is_given_by(self, given: &[EvaluableKind]) -> bool {
        self.sources().iter().any(|source| given.contains(source))
    }
}
