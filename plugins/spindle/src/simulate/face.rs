//! Faces: deviation along the circle under the axial sensors, and how far a face is off square.

use runout_core::{
    Complex64,
    fault::{Fault, known_names},
    rig::Rig,
};

use super::{
    check,
    config::FaceConfig,
    motion::{add_harmonic, random_harmonics},
    random::Purpose,
    series,
};

/// Of each section of the rig, cₙ of Re Σ cₙ e^{inα} in µm; empty of a circle around the part.
pub(super) fn harmonics(
    faces: &[FaceConfig],
    rig: &Rig,
    seed: u64,
    orders: usize,
) -> Result<Vec<Vec<Complex64>>, Fault> {
    let mut all = vec![Vec::new(); rig.sections.len()];
    for (index, face) in faces.iter().enumerate() {
        of_face(face, rig, seed, orders, &mut all).map_err(|fault| fault.under_item("face", index))?;
    }
    Ok(all)
}

fn of_face(face: &FaceConfig, rig: &Rig, seed: u64, orders: usize, all: &mut [Vec<Complex64>]) -> Result<(), Fault> {
    let is_face = |place: &usize| rig.sections[*place] == face.section && rig.is_face(*place);
    let Some(section) = (0..rig.sections.len()).find(is_face) else {
        let ids = (0..rig.sections.len()).filter(|place| rig.is_face(*place)).map(|place| rig.sections[place].as_str());
        let fault = Fault::at("section", format!("no axial sensor of the rig measures a face `{}`", face.section));
        return Err(fault.help(known_names(&face.section, ids)));
    };
    check::not_negative("rms_um", face.rms_um)?;
    check::finite("slope", face.slope)?;
    let harmonics = &mut all[section];
    if face.rms_um > 0.0 {
        check::order("max_order", face.max_order, 2, orders)?;
        let random = random_harmonics(face.rms_um, 2..=face.max_order, face.slope, seed, Purpose::Face, section);
        for (order, value) in random.into_iter().enumerate() {
            series::add(harmonics, order, value);
        }
    }
    let on_axis = rig.faces[section] == Some(0.0);
    for (index, harmonic) in face.harmonics.iter().enumerate() {
        let lowest = if on_axis { 1 } else { 2 };
        check::order("order", harmonic.order, lowest, orders)
            .and_then(|()| {
                let size = ("amplitude_um", harmonic.amplitude_um);
                add_harmonic(harmonics, harmonic.order, size, harmonic.phase_deg, orders)
            })
            .map_err(|fault| fault.under_item("harmonics", index))?;
    }
    Ok(())
}
