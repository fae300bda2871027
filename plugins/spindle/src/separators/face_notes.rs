//! What a layout with axial sensors, or with forms that are declared, can and cannot observe, in words.

use runout_core::{
    rig::Rig,
    separation::{Assessment, Quantity},
};

use crate::layout::Layout;

/// Orders by which it is seen whether a layout separates a form without a bound.
const LOOKED_AT: usize = 12;

/// Notes on z, the faces and the declared forms of a rig.
#[must_use]
pub fn face_notes(rig: &Rig, assessment: &Assessment) -> Vec<String> {
    let mut notes = along_the_axis(rig, assessment);
    notes.extend(declared(rig));
    notes
}

fn along_the_axis(rig: &Rig, assessment: &Assessment) -> Vec<String> {
    let Some(z) = assessment.unknowns.iter().position(|unknown| *unknown == Quantity::Z) else { return Vec::new() };
    let mut notes = Vec::new();
    let open = |section: &usize| rig.is_face(*section) && rig.form_bounds_um[*section].is_none();
    let looked_at = |section: &usize| rig.sensors.iter().any(|sensor| sensor.section == *section);
    let faces: Vec<usize> = (0..rig.sections.len()).filter(looked_at).filter(open).collect();
    let lost = assessment.lost_orders(z);
    let all = !lost.is_empty() && lost.len() == assessment.orders.len();
    let help = "declare the largest form deviation there (`form_um` of the sensor, peak to valley) and z is given with that \
                bound in its uncertainty; asynchronous axial motion needs no bound";
    for section in faces {
        let id = &rig.sections[section];
        if rig.faces[section] == Some(0.0) && all {
            notes.push(format!(
                "on the axis, axial motion z and the form of face `{id}` are one thing at every order, 1/rev included: turning \
                 the part against the spindle does not separate them, and both are lost; {help}"
            ));
        } else if rig.faces[section] == Some(0.0) {
            notes.push(format!(
                "on the axis, the form of face `{id}` is what its sensor reads beyond z, which the other axial sensors give"
            ));
        } else if all {
            notes.push(format!(
                "axial motion z, tilt and the form of face `{id}` are one thing at every order of this layout: both are lost. Three \
                 axial sensors at one radius, or the part turned against the spindle, separate them; or {help}"
            ));
        }
    }
    notes
}

fn declared(rig: &Rig) -> Vec<String> {
    let bounded = (0..rig.sections.len()).filter_map(|section| Some((section, rig.form_bounds_um[section]?)));
    let bounded: Vec<(usize, f64)> = bounded.collect();
    if bounded.is_empty() {
        return Vec::new();
    }
    let free = Rig { form_bounds_um: vec![None; rig.sections.len()], ..rig.clone() };
    let without = Layout::new(&free, false).assess(LOOKED_AT);
    let separable = |section: usize| {
        let of = |unknown: &Quantity| unknown.section() == Some(section);
        let unknown = without.unknowns.iter().position(of);
        unknown.is_some_and(|unknown| without.lost_orders(unknown).len() + 1 < without.orders.len())
    };
    let note = |(section, bound_um): (usize, f64)| {
        let id = &rig.sections[section];
        let more = if separable(section) {
            "; this layout separates the form without it: leave `form_um` out, and the residual is not burdened with the form"
        } else {
            ""
        };
        format!(
            "the form of section `{id}` is taken as 0: up to {bound_um} µm peak to valley, as declared (`form_um`), is part of the \
             uncertainty of the motion{more}"
        )
    };
    bounded.into_iter().map(note).collect()
}
