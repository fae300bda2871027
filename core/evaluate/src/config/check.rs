//! From the keys of `[evaluate]` to what is computed.

use super::{Evaluate, EvaluateConfig, FormRemoval, Group, Groups, USUAL_UPR, once_each};
use crate::error_motion::Centre;
use crate::evaluable::EvaluableKind;
use runout_error::fault::{Fault, Place, known_names};
use runout_standards::roundness::Reference;
use runout_turning::{
    azimuth::{Azimuth, FacePlace},
    rig::Rig,
};

/// Lowest order of `harmonics`: those below are level and centre, no form.
const LOWEST_HARMONIC: usize = 2;

impl EvaluateConfig {
    /// Refuses names of the datum that are no section of the rig that measures.
    ///
    /// # Errors
    /// The first of them.
    pub fn check_datum(&self, rig: &Rig) -> Result<(), Fault> {
        let unknown = |name: &&String| !rig.sections.contains(name);
        match self.datum.iter().flatten().enumerate().find(|(_, name)| unknown(name)) {
            Some((index, name)) => {
                let fault = Fault::here(format!("the rig has no section `{name}`"));
                let fault = fault.help(known_names(name, rig.sections.iter().map(String::as_str)));
                Err(fault.under_item("datum", index))
            }
            None => Ok(()),
        }
    }

    /// Refuses groups by name that nothing gives of what a separator offers, and forms that its height maps do not have.
    ///
    /// # Errors
    /// The first of them.
    pub fn check_given(&self, given: &[EvaluableKind]) -> Result<(), Fault> {
        let names = |kinds: &[EvaluableKind]| kinds.iter().map(|kind| kind.name()).collect::<Vec<_>>().join(", ");
        if let Some(Groups::Listed(groups)) = &self.values
            && let Some((index, group)) = groups.iter().enumerate().find(|(_, group)| !group.is_given_by(given))
        {
            let message = format!("nothing here gives values of `{}`", group.name());
            let help =
                format!("they are computed from {}; the separator offers {}", names(group.sources()), names(given));
            return Err(Fault::here(message).help(help).under_item("values", index));
        }
        let asked = match &self.values {
            Some(Groups::Listed(groups)) => groups.contains(&Group::Straightness),
            Some(Groups::All) | None => true,
        };
        let lines = |references: &Vec<Reference>| references.iter().any(|one| one.line_symbol().is_some());
        let only_profiles = given == [EvaluableKind::OpenProfile];
        if asked && only_profiles && self.references.as_ref().is_some_and(|references| !lines(references)) {
            let fault = Fault::at("references", "an open profile has no reference line of these");
            return Err(fault.help("LSCI for the least-squares line LSLI, MZCI for the minimum-zone line MZLI"));
        }
        let of_maps = given.contains(&EvaluableKind::HeightMap) && !given.contains(&EvaluableKind::ClosedProfiles);
        if of_maps && matches!(self.areal.form, Some(FormRemoval::Cylinder | FormRemoval::Cone)) {
            let fault = Fault::at("form", "a height map on a plane is no wall of a cylinder");
            return Err(fault.help("none, plane or polynomial").under("areal"));
        }
        Ok(())
    }

    fn check_cutoffs(&self) -> Result<(), Fault> {
        for (key, cutoffs) in [("filter_upr", &self.filter_upr), ("robust_filter_upr", &self.robust_filter_upr)] {
            for (index, cutoff) in cutoffs.iter().flatten().enumerate() {
                if !(cutoff.is_finite() && *cutoff > 0.0) {
                    let fault = Fault::here(format!("the cut-off must be above 0 undulations a turn, found {cutoff}"));
                    return Err(fault.under_item(key, index));
                }
            }
        }
        for (key, wavelength) in [("lambda_c_mm", self.lambda_c_mm), ("lambda_s_mm", self.lambda_s_mm)] {
            match wavelength {
                Some(length) if !(length.is_finite() && length > 0.0) => {
                    return Err(Fault::at(key, format!("the wavelength must be above 0 mm, found {length}")));
                }
                _ => {}
            }
        }
        if let Some(cutoff) = self.high_pass_upr {
            if !(cutoff.is_finite() && cutoff > 0.0) {
                let message = format!("the cut-off must be above 0 undulations a turn, found {cutoff}");
                return Err(Fault::at("high_pass_upr", message));
            }
            let low_passes = self.filter_upr.as_deref().unwrap_or(&[USUAL_UPR]);
            if let Some(below) = low_passes.iter().find(|below| **below <= cutoff) {
                let message = format!("the high-pass must be below the low-pass at {below}, found {cutoff}");
                return Err(Fault::at("high_pass_upr", message));
            }
        }
        Ok(())
    }

    /// Checks the values.
    ///
    /// # Errors
    /// The first that cannot be, with its key.
    pub fn check(self) -> Result<Evaluate, Fault> {
        self.check_cutoffs()?;
        if let Some(window) = self.slope_window_deg.filter(|window| !(*window > 0.0 && *window <= 180.0)) {
            let message = format!("the window must be above 0° and at most 180°, found {window}");
            return Err(Fault::at("slope_window_deg", message));
        }
        if let Some(highest) = self.harmonics_upr.filter(|highest| *highest < LOWEST_HARMONIC) {
            let message = format!("expected an order from {LOWEST_HARMONIC} on, found {highest}");
            return Err(Fault::at("harmonics_upr", message));
        }
        if matches!(&self.datum, Some(datum) if datum.is_empty()) {
            return Err(Fault::at("datum", "expected at least one section"));
        }
        match (self.lambda_s_mm, self.lambda_c_mm) {
            (Some(shortest), Some(longest)) if shortest >= longest => {
                let message = format!("λs must be shorter than λc = {longest} mm, found {shortest}");
                return Err(Fault::at("lambda_s_mm", message));
            }
            _ => {}
        }
        if matches!(&self.references, Some(references) if references.is_empty()) {
            return Err(Fault::at("references", "expected at least one of LSCI, MZCI, MICI, MCCI"));
        }
        if matches!(&self.centres, Some(centres) if centres.is_empty()) {
            return Err(Fault::at("centres", "expected at least one of PC, LSC, MZC, MIC, MCC"));
        }
        let texture = self.texture.check(self.lambda_s_mm, self.lambda_c_mm).map_err(|fault| match fault.place {
            // What is wrong of all keys together is that of λs.
            Place::Path(ref path) if path.is_empty() => fault.under("lambda_s_mm"),
            _ => fault.under("texture"),
        })?;
        for (index, direction) in self.directions_deg.iter().flatten().enumerate() {
            // A direction and its opposite are one, but a whole turn is a slip of the pen.
            if direction.is_nan() || direction.abs() >= 360.0 {
                let message = format!("the direction must lie between -360 and 360 degrees, found {direction}");
                return Err(Fault::here(message).under_item("directions_deg", index));
            }
        }
        let directions = self.directions_deg.unwrap_or_default();
        let faces = self
            .faces
            .unwrap_or_default()
            .into_iter()
            .enumerate()
            .map(|(index, place)| place.check().map_err(|fault| fault.under_item("faces", index)));
        let faces = faces.collect::<Result<Vec<FacePlace>, Fault>>()?;
        let usual = Evaluate::default();
        Ok(Evaluate {
            all: self.values == Some(Groups::All),
            of_closed: usual.of_closed,
            of_turns: usual.of_turns,
            groups: match self.values {
                Some(Groups::All) => Group::ALL.to_vec(),
                Some(Groups::Listed(groups)) => groups,
                None => usual.groups,
            },
            references: once_each(self.references.unwrap_or(usual.references)),
            filter_upr: self.filter_upr.map(once_each),
            filter: self.filter.unwrap_or_default(),
            high_pass_upr: self.high_pass_upr,
            robust_filter_upr: once_each(self.robust_filter_upr.unwrap_or_default()),
            slope_window_deg: self.slope_window_deg,
            harmonics_upr: self.harmonics_upr.unwrap_or(usual.harmonics_upr),
            datum: once_each(self.datum.unwrap_or_default()),
            lambda_c_mm: self.lambda_c_mm,
            lambda_s_mm: self.lambda_s_mm,
            centres: self
                .centres
                .map_or(usual.centres, |centres| once_each(centres.into_iter().map(Centre::from).collect())),
            texture,
            areal: self.areal.check().map_err(|fault| fault.under("areal"))?,
            directions: once_each(
                directions.into_iter().map(|angle_deg| Azimuth::of(angle_deg.to_radians())).collect(),
            ),
            faces: once_each(faces),
            limits: Vec::new(),
        })
    }
}
