//! Texture values along the axis, at chosen angles of the part.

use std::f64::consts::TAU;

use super::{Content, Evaluate, Group, Label, PartSummary, labelled, open_profile::texture_along};
use crate::Value;
use runout_draws::{OpenErrors, seed};
use runout_numerics::{Complex64, stretches::covered};
use runout_standards::texture::{self, Kind, Settings};
use runout_turning::surface::{Section, Uncertain};

/// Points that a profile along the axis needs.
const FEWEST: usize = 7;

const CENTRED: &str = "texture along the axis is of centred sections: displacement sensors do not measure the mean radius and the \
    centre of a section, so that their differences from section to section are not in it";

/// Adds texture values of the profiles through all sections at the angles asked for. Sections count where they were measured,
/// not where the surface is interpolated. `placed` says that centres and mean radii are known.
pub fn add_generatrices(
    part: &mut PartSummary,
    uncertain: &Uncertain,
    radius_mm: f64,
    placed: bool,
    evaluate: &Evaluate,
) {
    let angles_deg = &evaluate.texture.generatrices_deg;
    if !evaluate.has(Group::Texture) || angles_deg.is_empty() {
        return;
    }
    if uncertain.z_mm().len() < FEWEST {
        let rings = uncertain.z_mm().len();
        part.remarks.push(format!("texture along the axis needs {FEWEST} sections or more, found {rings}"));
        return;
    }
    let lowest = if placed { 0 } else { 2 };
    for angle_deg in angles_deg {
        let generatrix = Generatrix::new(uncertain, *angle_deg, lowest);
        for kind in &evaluate.texture.profiles {
            let centred = if placed { "" } else { " of centred sections" };
            let reference = format!("generatrix at {angle_deg}°{centred}");
            let settings = generatrix.settings(*kind, evaluate);
            let said = texture::over_gaps(generatrix.z_mm, &generatrix.profile_um, &settings);
            part.remarks.extend(said.map(|said| format!("{} profile, {reference}: {said}", kind.letter())));
            part.values.extend(generatrix.values(*kind, evaluate, radius_mm, &reference));
        }
    }
    if !placed {
        part.remarks.push(CENTRED.into());
    }
}

/// The profile along the axis at one angle.
struct Generatrix<'a> {
    z_mm: &'a [f64],
    profile_um: Vec<f64>,
    errors: OpenErrors,
    /// Highest order of the sections.
    highest: usize,
    lost: Vec<usize>,
    seed: u64,
}

impl<'a> Generatrix<'a> {
    fn new(uncertain: &'a Uncertain, angle_deg: f64, lowest: usize) -> Self {
        let angle = angle_deg.to_radians();
        let at = |harmonics: &Vec<Complex64>| -> f64 {
            let each = harmonics.iter().enumerate();
            each.map(|(order, value)| (value * Complex64::from_polar(1.0, order as f64 * angle)).re).sum()
        };
        let mut profile_um: Vec<f64> = uncertain.harmonics(lowest, false).iter().map(at).collect();
        for section in uncertain.sections().iter().filter(|section| section.gaps.hold(angle.rem_euclid(TAU))) {
            let nearest = uncertain.z_mm().iter().enumerate();
            let distance = |z_mm: f64| (z_mm - section.z_mm).abs();
            let nearest = nearest.min_by(|a, b| distance(*a.1).total_cmp(&distance(*b.1)));
            if let Some((ring, _)) = nearest {
                profile_um[ring] = f64::NAN;
            }
        }
        let mut lost: Vec<usize> = uncertain.sections().iter().flat_map(Section::lost_orders).collect();
        lost.sort_unstable();
        lost.dedup();
        Self {
            z_mm: uncertain.z_mm(),
            profile_um,
            errors: OpenErrors { std_um: uncertain.std_um(lowest), ..OpenErrors::default() },
            highest: uncertain.sections().iter().map(|section| section.orders.len()).max().unwrap_or(1) - 1,
            lost,
            seed: seed(&["generatrix", &angle_deg.to_string()]),
        }
    }

    fn settings(&self, kind: Kind, evaluate: &Evaluate) -> Settings {
        let length_mm = self.z_mm.last().copied().unwrap_or(0.0) - self.z_mm.first().copied().unwrap_or(0.0);
        Settings {
            lambda_s_mm: evaluate.lambda_s_mm,
            lambda_c_mm: evaluate.lambda_c_mm,
            lambda_f_mm: evaluate.texture.lambda_f_mm,
            ..evaluate.profile_settings(kind, length_mm)
        }
    }

    fn values(&self, kind: Kind, evaluate: &Evaluate, radius_mm: f64, reference: &str) -> Vec<Value> {
        let Some(filter) = evaluate.profile_filter(kind, radius_mm) else { return Vec::new() };
        let settings = self.settings(kind, evaluate);
        let measured = texture::along(self.z_mm, &self.profile_um, &settings);
        let labels = kind.parameters().iter().map(|(symbol, unit, clause)| {
            Label::new(symbol, unit, format!("ISO 21920-2:2021, {clause}"), reference.to_owned())
        });
        let numbers = texture_along(self.z_mm, &self.profile_um, Ok(&self.errors), self.seed, &settings);
        let there = self.z_mm.iter().zip(&self.profile_um).filter(|(_, height)| height.is_finite());
        let there: Vec<f64> = there.map(|(z_mm, _)| *z_mm).collect();
        let share = measured.points as f64 / (measured.points + measured.missing).max(1) as f64;
        let coverage = share.min(covered(&there));
        let held = Content {
            highest: self.highest,
            all_to: self.highest,
            lost: self.lost.clone(),
            half_power_upr: None,
            shows_weakened: false,
            shows_absent: false,
        };
        labelled(labels.collect(), numbers, &filter.along_axis(), &held, coverage)
    }
}
