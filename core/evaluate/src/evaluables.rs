//! The standards' values of what a domain of points offers beside closed profiles: open profiles, height maps and motion
//! of an axis.

use super::{Evaluate, Group, axis_motion, open_profile, plane_map};
use crate::{
    evaluable::{Evaluable, EvaluableKind},
    value::{Value, ValueId},
};
use runout_error::Result;

/// Values, and what they are not.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Evaluated {
    /// The values.
    pub values: Vec<Value>,
    /// What they are not.
    pub remarks: Vec<String>,
}

impl Evaluated {
    /// Of each of these; closed profiles are evaluated section by section and count for nothing here. What refutes the separation refutes
    /// what comes from it; a height map is what was measured.
    ///
    /// # Errors
    /// When a height map cannot be evaluated as it is asked for.
    pub fn of(evaluables: &[Evaluable], evaluate: &Evaluate, refuted_by: Option<&str>) -> Result<Self> {
        let (mut all, mut remarks) = (Self::default(), Remarks::default());
        for one in evaluables {
            let (of, (values, said)) = match one {
                Evaluable::ClosedProfiles(_) => continue,
                Evaluable::OpenProfile(profile) => (&profile.of, open_profile::values(profile, evaluate)),
                Evaluable::HeightMap(map) => (&map.of, plane_map::values(map, evaluate)?),
                Evaluable::AxisMotion(motion) => (&motion.of, axis_motion::values(motion, evaluate)),
            };
            said.into_iter().chain(unknown(&values)).for_each(|sentence| remarks.add(of, sentence));
            let refuted_by = refuted_by.filter(|_| one.kind() != EvaluableKind::HeightMap).map(str::to_owned);
            all.values.extend(values.into_iter().map(|value| value.of(of).refuted_by(refuted_by.clone())));
        }
        all.remarks = remarks.sentences();
        Ok(all)
    }
}

/// Sentences, each with what it is said of.
#[derive(Default)]
struct Remarks(Vec<(Vec<String>, String)>);

impl Remarks {
    fn add(&mut self, of: &str, sentence: String) {
        match self.0.iter_mut().find(|(_, known)| *known == sentence) {
            Some((all, _)) => all.push(of.to_owned()),
            None => self.0.push((vec![of.to_owned()], sentence)),
        }
    }

    fn sentences(self) -> Vec<String> {
        self.0.into_iter().map(|(all, sentence)| format!("{}: {sentence}", all.join(", "))).collect()
    }
}

/// Values that one sentence names, at most.
const MOST_NAMED: usize = 8;

/// Says of which values no uncertainty is stated, and why: a sentence for each reason.
fn unknown(values: &[Value]) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<String>)> = Vec::new();
    for value in values {
        let Some(reason) = value.no_uncertainty.as_deref() else { continue };
        let name = ValueId { filter: None, of: None, ..value.id() }.to_string();
        match reasons.iter_mut().find(|(known, _)| *known == reason) {
            Some((_, names)) => names.push(name),
            None => reasons.push((reason, vec![name])),
        }
    }
    let sentence = |(reason, names): (&str, Vec<String>)| {
        let which = if names.len() > MOST_NAMED { format!("{} values", names.len()) } else { names.join(", ") };
        format!("no uncertainty of {which}: {reason}")
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
            Self::RunOut => &[EvaluableKind::TurnSpread],
        }
    }

    /// Whether one of these gives it.
    pub(super) fn is_given_by(self, given: &[EvaluableKind]) -> bool {
        self.sources().iter().any(|source| given.contains(source))
    }
}
