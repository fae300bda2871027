//! Readings in another unit than declared.

use super::{six, warned};
use crate::campaigns::averaged;

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
