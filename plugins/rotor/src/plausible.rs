//! Numbers that look like another unit's: warned of, and used as they are.

use crate::model::{Bearing, Disk, Material, RotorModel, Segment};

/// What looks like a mistake in a unit.
#[must_use]
pub(crate) fn warnings(model: &RotorModel) -> Vec<String> {
    let mut found = Vec::new();
    for material in &model.materials {
        of_material(material, &mut found);
    }
    for (index, segment) in model.segments.iter().enumerate() {
        of_segment(index, segment, &mut found);
    }
    for (index, disk) in model.disks.iter().enumerate() {
        of_disk(index, disk, &mut found);
    }
    for (index, bearing) in model.bearings.iter().enumerate() {
        of_bearing(index, bearing, &mut found);
    }
    let (length_mm, widest_mm) = (model.length_mm(), model.segments.iter().map(|one| one.outer_mm).fold(0.0, f64::max));
    if !model.segments.is_empty() && length_mm < widest_mm {
        found.push(format!(
            "the shaft is shorter ({length_mm} mm) than it is wide ({widest_mm} mm): beam elements do not describe it well"
        ));
    }
    found
}

fn of_material(material: &Material, found: &mut Vec<String>) {
    let id = &material.id;
    // From plastics to diamond.
    if !(0.5..=1300.0).contains(&material.youngs_gpa) {
        let hint = if material.youngs_gpa > 1300.0 { "is it in MPa or Pa?" } else { "is it in another unit?" };
        found.push(format!("material {id}: youngs_gpa = {:e} GPa is unusual; {hint}", material.youngs_gpa));
    }
    // From foams to tungsten.
    if !(50.0..=25_000.0).contains(&material.density_kg_per_m3) {
        let density = material.density_kg_per_m3;
        let hint = if density < 50.0 { "is it in g/cm³ or t/m³?" } else { "is it in another unit?" };
        found.push(format!("material {id}: density_kg_per_m3 = {density} kg/m³ is unusual; {hint}"));
    }
    if let (Some(shear_gpa), Some(poisson)) = (material.shear_gpa, material.poisson) {
        let isotropic = material.youngs_gpa / (2.0 * (1.0 + poisson));
        if (shear_gpa / isotropic - 1.0).abs() > 0.1 {
            found.push(format!(
                "material {id}: shear_gpa = {shear_gpa} GPa differs from E/(2(1 + ν)) = {isotropic:.3} GPa; shear_gpa is used"
            ));
        }
    }
}

fn of_segment(index: usize, segment: &Segment, found: &mut Vec<String>) {
    let lengths = [("length_mm", segment.length_mm, 0.5, 2e4), ("outer_mm", segment.outer_mm, 0.5, 3e3)];
    for (key, value, least, most) in lengths {
        if value < least {
            found.push(format!("segments.{index}: {key} = {value} mm is unusual; is it in m?"));
        } else if value > most {
            found.push(format!("segments.{index}: {key} = {value} mm is unusual; is it in µm?"));
        }
    }
}

fn of_disk(index: usize, disk: &Disk, found: &mut Vec<String>) {
    // Radius of gyration of the polar moment, in m.
    let gyration = (disk.polar_kg_m2.max(disk.diametral_kg_m2) / disk.mass_kg).sqrt();
    if gyration > 5.0 {
        found.push(format!(
            "disks.{index}: a mass of {} kg with these moments of inertia has a radius of gyration of {gyration:.1} m; are the \
             moments in kg·mm² or the mass in t?",
            disk.mass_kg
        ));
    }
}

fn of_bearing(index: usize, bearing: &Bearing, found: &mut Vec<String>) {
    for (key, value) in [("kxx_n_per_m", bearing.kxx_n_per_m), ("kyy_n_per_m", bearing.kyy_n_per_m)] {
        if value > 0.0 && value < 5e3 {
            found.push(format!("bearings.{index}: {key} = {value:e} N/m is unusual; is it in N/µm or N/mm?"));
        } else if value > 1e12 {
            found.push(format!("bearings.{index}: {key} = {value:e} N/m is unusual; is it in another unit?"));
        }
    }
}
