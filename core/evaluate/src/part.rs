//! Values of all sections together.

use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Evaluate, Group, Value, wall::Wall};
use runout_numerics::threads;
use runout_turning::surface;

/// Values of all sections together.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, JsonSchema)]
pub struct PartSummary {
    /// Sections that they are of.
    pub sections: usize,
    /// First and last place of a section along the axis, in mm.
    pub z_mm: [f64; 2],
    /// Equal angles at which errors of each section were drawn; itself it is looked at on more.
    pub angles: usize,
    /// The standards' values.
    pub values: Vec<Value>,
    /// What the values are not.
    pub remarks: Vec<String>,
}

/// Angles at which a wall is evaluated, at most: a surface's usual ones.
const MOST_ANGLES: usize = 720;

/// Cylindricity of sections about a nominal radius; `None` where they do not lie at two heights. `placed` says that their
/// centres and mean radii are known relative to each other, which only a measuring machine measures.
pub fn part_summary(
    sections: &[surface::Section],
    angles: usize,
    evaluate: &Evaluate,
    radius_mm: f64,
    placed: bool,
) -> Option<PartSummary> {
    let there: Vec<&surface::Section> = sections.iter().filter(|section| section.z_mm.is_finite()).collect();
    let heights = || there.iter().map(|section| section.z_mm);
    let z_mm = [heights().fold(f64::INFINITY, f64::min), heights().fold(f64::NEG_INFINITY, f64::max)];
    if z_mm[0] >= z_mm[1] {
        return None;
    }
    let wall = Wall::of(&there, angles.min(MOST_ANGLES), radius_mm, placed);
    let mut part = PartSummary { sections: there.len(), z_mm, angles: wall.count, ..PartSummary::default() };
    if evaluate.has(Group::Cylindricity) {
        part.remarks.extend(wall.missing_cylinders(&evaluate.references));
        let known = there.iter().map(|section| section.orders.len().saturating_sub(1)).min().unwrap_or(0);
        let behind = |cutoff: Option<f64>| {
            let filter = evaluate.low_pass(cutoff);
            // What a filter passes and the sections know, needs its angles.
            let wanted = filter.reach_upr().map_or(0, |reach| reach.min(known));
            let finer = (wanted > wall.held.highest).then(|| Wall::of(&there, 2 * wanted + 2, radius_mm, placed));
            finer.as_ref().unwrap_or(&wall).cylindricity(&filter, &evaluate.references)
        };
        part.values.extend(threads::each(evaluate.cutoffs_upr(wall.held.highest), behind).into_iter().flatten());
        if placed {
            part.values.extend(wall.lines());
        } else {
            part.remarks.push(CENTRED.into());
        }
        if !evaluate.datum.is_empty() {
            match wall.about_datum(evaluate) {
                Ok(values) => part.values.extend(values),
                Err(remark) => part.remarks.push(format!("{remark}; no position about the datum is given")),
            }
        }
    }
    if there.len() < sections.len() {
        part.remarks.push(format!("{} sections without a place along z are left out", sections.len() - there.len()));
    }
    Some(part)
}

const CENTRED: &str = "every section is centred, without its 1/rev, and has the nominal radius: displacement sensors do \
    not measure a section's centre and mean radius. Taper (CYLtt), straightness of generatrices and coaxiality are therefore \
    not given, and CYLt holds none of them";
