//! What a simulation declares to be true: `/truth/<station>/form_um/<section>` over the part's angle, and the motion
//! over the spindle's, each on equally spaced angles from 0.

use hdf5_metno::Group;
use runout_core::{Result, measurement::StationTruth, rig::Rig};

use super::TRUTH;
use crate::{
    node::{self, Place},
    type_name::type_name,
};

/// The group of forms.
const FORM: &str = "form_um";
/// Motions in the order of [`StationTruth::motion`].
const MOTION: [&str; 4] = ["x_um", "y_um", "tilt_x_urad", "tilt_y_urad"];
/// Motion along the axis.
const Z: &str = "z_um";
/// More angles than any truth is given on.
const MOST_ANGLES: usize = 1 << 24;

/// Reads the truth of one station, where there is one. What it does not name stays empty.
pub(super) fn read(root: &Group, place: &Place, rig: &Rig, station: &str) -> Result<Option<StationTruth>> {
    if !root.link_exists(TRUTH) {
        return Ok(None);
    }
    let (truth, place) = node::group(root, place, TRUTH)?;
    if !truth.link_exists(station) {
        return Ok(None);
    }
    let (station, place) = node::group(&truth, &place, station)?;
    let form_um = if station.link_exists(FORM) {
        let (forms, place) = node::group(&station, &place, FORM)?;
        rig.sections.iter().map(|section| curve(&forms, &place, section)).collect::<Result<_>>()?
    } else {
        vec![Vec::new(); rig.sections.len()]
    };
    let motion = if MOTION.iter().any(|name| station.link_exists(name)) {
        let [x, y, tilt_x, tilt_y] = MOTION.map(|name| curve(&station, &place, name));
        Some([x?, y?, tilt_x?, tilt_y?])
    } else {
        None
    };
    let z_um = if station.link_exists(Z) { Some(curve(&station, &place, Z)?) } else { None };
    Ok(Some(StationTruth { form_um, motion, z_um }))
}

fn curve(group: &Group, place: &Place, name: &str) -> Result<Vec<f64>> {
    if !group.link_exists(name) {
        return Ok(Vec::new());
    }
    let (dataset, place) = node::dataset(group, place, name)?;
    let found = node::element_type(&dataset, &place)?;
    if !node::is_number(&found) {
        return Err(place.error(format!("expected f64, found {}", type_name(&found))));
    }
    match node::written_shape(&dataset, &place)?.as_slice() {
        [length] if *length <= MOST_ANGLES => dataset.read_raw::<f64>().map_err(|error| place.error(error)),
        other => Err(place.error(format!("expected one curve, found the shape {other:?}"))),
    }
}

/// Writes the truth of one station below `/truth`.
pub(super) fn write(root: &Group, rig: &Rig, station: &str, truth: &StationTruth) -> hdf5_metno::Result<()> {
    let group = node::create_group(root, &format!("{TRUTH}/{station}"))?;
    let forms = node::create_group(&group, FORM)?;
    for (section, form_um) in rig.sections.iter().zip(&truth.form_um) {
        forms.new_dataset_builder().with_data(form_um.as_slice()).create(section.as_str())?;
    }
    for (name, curve) in MOTION.iter().zip(truth.motion.iter().flatten()) {
        group.new_dataset_builder().with_data(curve.as_slice()).create(*name)?;
    }
    if let Some(z_um) = &truth.z_um {
        group.new_dataset_builder().with_data(z_um.as_slice()).create(Z)?;
    }
    Ok(())
}
