//! Readings in another unit than declared.

use super::{six, warned};
use crate::{
    campaigns::{averaged, campaign, two_sections},
    diagnose::diagnosed,
};

/// One channel a thousand times smaller or larger than the others, or all of them.
#[test]
fn readings_in_another_unit_are_said_by_run() {
    let config = six(1, "[]");
    let rig = config.rig.clone().check().unwrap();
    let (station, _) = averaged(&config, &rig);
    let channels = rig.sensors.len();
    let said = |of_channel: &dyn Fn(usize) -> f64| {
        let mut station = station.clone();
        for profile in &mut station.profiles {
            profile.mean.iter_mut().enumerate().for_each(|(place, mean)| *mean *= of_channel(place % channels));
        }
        warned(&config.rig, &station).join("\n")
    };
    let smaller = said(&|channel| if channel == 1 { 1e-3 } else { 1.0 });
    assert!(smaller.contains("sensor `S2`") && smaller.contains("times smaller"), "{smaller}");
    let larger = said(&|channel| if channel == 1 { 10.0 } else { 0.01 });
    assert!(larger.contains("sensor `S2`") && larger.contains("times larger"), "{larger}");
    let all = said(&|_| 300.0);
    assert!(all.contains("all sensors across the axis read more than") && !all.contains("than those of"), "{all}");
    assert!(said(&|_| 1e3).contains("the unit of the readings"));
    let all = said(&|_| 1e-4);
    assert!(
        all.contains("the readings of all sensors vary by no more than") && !all.contains("than those of"),
        "{all}"
    );
    // Ten times the eccentricity is no unit, nor is a tenth.
    assert!(!said(&|_| 10.0).contains("unit"));
    assert!(!said(&|_| 0.1).contains("unit"));
}

/// The diameter that is declared for the radius: what exact geometry adds at order 2 is half of it, (0.2 mm)²/4R = 0.33 µm, and carries orders of form into
/// those beside them. 8 µm off centre it is next to nothing, and nothing else is named.
#[test]
fn a_diameter_for_the_radius_is_found_off_centre() {
    let of_radius = |eccentricity_um: f64| {
        let mut config = campaign(4, r#"[{"plugin":"part-radius","relative_error":-0.5}]"#);
        config.rig.part_radius_mm = 60.0;
        config.eccentricity.offset_um = eccentricity_um;
        config
    };
    let three_angles = of_radius(200.0);
    let mut reversal = of_radius(200.0);
    reversal.rig.setups.truncate(2);
    (reversal.rig.setups[1].part_deg, reversal.rig.setups[1].sensors_deg) = (180.0, 180.0);
    let mut one_setup = of_radius(200.0);
    one_setup.rig.setups.truncate(1);
    one_setup.rig.sensors = two_sections(&[0.0, 99.844, 202.5, 310.0]);
    for config in [three_angles, reversal, one_setup] {
        let (found, [before, after]) = diagnosed(&config);
        println!("simulated: form error {before:.4} → {after:.4} µm, {:?}", found.diagnosis.added);
        let [added] = &found.diagnosis.added[..] else { panic!("{:?}", found.diagnosis.added) };
        let curvature = &added.parameters[0];
        assert_eq!((added.effect.as_str(), added.confounded_with.len()), ("part-radius", 0), "{added:?}");
        assert!((curvature.value - 1.0).abs() < 4.0 * curvature.std.unwrap() && curvature.std.unwrap() < 0.2);
        let key = added.change.as_deref().unwrap().strip_prefix("part_radius_mm = ").unwrap();
        assert!((key.parse::<f64>().unwrap() - 30.0).abs() < 5.0 && after < 0.5 * before, "{key}: {before} → {after}");
    }
    let centred = diagnosed(&of_radius(8.0)).0.diagnosis.added;
    assert!(centred.iter().all(|added| added.effect == "part-radius"), "{centred:?}");
}
