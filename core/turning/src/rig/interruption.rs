//! Interruptions of the surface, as written in a file.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::Gaps;
use runout_error::Fault;

/// Longer interruptions leave too little to bridge them by, in degrees.
const MOST_INTERRUPTED_DEG: f64 = 120.0;

/// A hundred turns: degrees above it are a mistake, and far above it they lose the digits within a turn.
const LARGEST_DEG: f64 = 36_000.0;
/// Share of a circle that has to be there.
const LEAST_LEFT: f64 = 0.5;
const ANGLES_LOOKED_AT: usize = 3600;

/// One interruption as written in a file: from one part angle on, counter-clockwise, to another.
#[derive(Debug, Clone, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[non_exhaustive]
pub struct InterruptionConfig {
    /// The part's own angle at which it begins, in degrees.
    pub from_deg: f64,
    /// The angle at which it ends, in degrees; with `from_deg` above, it passes through 0.
    pub to_deg: f64,
    /// Ids of the sections that it crosses; without it, all around the part.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub sections: Option<Vec<String>>,
}

/// Of each section, where it is interrupted.
pub(super) fn gaps_of(
    interruptions: &[InterruptionConfig],
    sections: &[String],
    faces: &[Option<f64>],
) -> Result<Vec<Gaps>, Fault> {
    let mut gaps = vec![Gaps::default(); sections.len()];
    for (index, interruption) in interruptions.iter().enumerate() {
        let fault = |key: &'static str, message: String| Fault::at(key, message).under_item("interruptions", index);
        let [from, to] = [("from_deg", interruption.from_deg), ("to_deg", interruption.to_deg)]
            .map(|(key, angle_deg)| radians(angle_deg).map(|_| angle_deg).map_err(|message| fault(key, message)));
        let length_deg = (to? - from?).rem_euclid(360.0);
        if !(length_deg > 0.0 && length_deg <= MOST_INTERRUPTED_DEG) {
            let message = format!("expected at most {MOST_INTERRUPTED_DEG}° from `from_deg` on, found {length_deg}°");
            return Err(fault("to_deg", message));
        }
        for ((section, face), gaps) in sections.iter().zip(faces).zip(&mut gaps) {
            // A keyway along the part is none of its face, unless that is named.
            if interruption.sections.as_ref().map_or(face.is_none(), |named| named.contains(section)) {
                gaps.add(interruption.from_deg.to_radians(), length_deg.to_radians());
            }
        }
        if let Some(unknown) = interruption.sections.iter().flatten().find(|named| !sections.contains(named)) {
            return Err(fault(
                "sections",
                format!("there is no section `{unknown}`; there are {}", sections.join(", ")),
            ));
        }
    }
    match gaps.iter().position(|gaps| gaps.coverage(ANGLES_LOOKED_AT) < LEAST_LEFT) {
        None => Ok(gaps),
        Some(section) => Err(Fault::at(
            "interruptions",
            format!("they leave less than half of section `{}`, too little to bridge them", sections[section]),
        )),
    }
}

/// An angle in rad, or what is wrong with its degrees.
pub(super) fn radians(angle_deg: f64) -> Result<f64, String> {
    let possible = angle_deg.abs() <= LARGEST_DEG;
    possible
        .then(|| angle_deg.to_radians())
        .ok_or_else(|| format!("expected an angle within ±{LARGEST_DEG}°, found {angle_deg:?}"))
}
