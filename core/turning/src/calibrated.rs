//! Recorded numbers as displacements, by the rig's calibration of each sensor.

use crate::{
    measurement::{Block, Capture, SampleStream},
    rig::{Calibration, Rig},
};
use runout_error::Result;

/// A stream whose numbers are displacements in µm; the stream itself where they are already.
#[must_use]
pub fn calibrated<'a>(input: Box<dyn SampleStream + 'a>, rig: &Rig) -> Box<dyn SampleStream + 'a> {
    let of = |sensor: &usize| rig.sensors.get(*sensor).map_or(Calibration::NONE, |sensor| sensor.calibration);
    let calibrations: Vec<Calibration> = input.capture().sensors.iter().map(of).collect();
    if calibrations.iter().all(|calibration| *calibration == Calibration::NONE) {
        return input;
    }
    let mut capture = input.capture().clone();
    for (limits, calibration) in capture.converter_limits_um.iter_mut().flatten().zip(&calibrations) {
        *limits = limits.map(|limit| calibration.displacement_um(limit));
    }
    // Where a characteristic turns back before the converter's limit, that limit is no displacement.
    if capture.converter_limits_um.iter().flatten().flatten().any(|limit| !limit.is_finite()) {
        capture.converter_limits_um = None;
    }
    Box::new(Calibrated { input, capture, calibrations })
}

struct Calibrated<'a> {
    input: Box<dyn SampleStream + 'a>,
    capture: Capture,
    calibrations: Vec<Calibration>,
}

impl SampleStream for Calibrated<'_> {
    fn capture(&self) -> &Capture {
        &self.capture
    }

    fn next_block(&mut self, block: &mut Block) -> Result<bool> {
        let more = self.input.next_block(block)?;
        for frame in block.samples.chunks_exact_mut(self.calibrations.len().max(1)) {
            frame.iter_mut().zip(&self.calibrations).for_each(|(number, calibration)| {
                *number = calibration.displacement_um(*number);
            });
        }
        Ok(more)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{
        measurement::MemoryStream,
        rig::{RigConfig, Rotation, SensorConfig, SetupConfig, Unit},
    };

    fn capture() -> Capture {
        Capture {
            object: "memory".into(),
            setup: 0,
            station: "s1".into(),
            z_mm: 0.0,
            stated_speed_rpm: None,
            sample_rate_hz: None,
            samples: 2,
            sensors: vec![1, 0],
            sensor_ids: vec!["S2".into(), "S1".into()],
            converter_limits_um: Some(vec![[-10.0, 10.0]; 2]),
            marks: Vec::new(),
            marks_within_samples: 0.0,
            encoder: false,
            trimmed: Vec::new(),
            responses: Vec::new(),
        }
    }

    fn rig(volts: bool) -> Rig {
        let (unit, um_per_volt) = if volts { (Unit::Volt, Some(25.0)) } else { (Unit::Micrometre, None) };
        let gain = if volts { 1.25 } else { 1.0 };
        let sensors = vec![
            SensorConfig { id: "S1".into(), unit, um_per_volt, gain, ..SensorConfig::default() },
            SensorConfig { id: "S2".into(), angle_deg: 90.0, ..SensorConfig::default() },
        ];
        let setups = vec![SetupConfig { id: "a".into(), ..SetupConfig::default() }];
        let rotation = Rotation::Ccw;
        RigConfig { part_radius_mm: 30.0, rotation, sensors, setups, interruptions: Vec::new(), bearings: Vec::new() }
            .check()
            .unwrap()
    }

    /// The channels are in another order than the rig's sensors: S2 is in µm, S1 in volts.
    #[test]
    fn each_channel_has_the_calibration_of_its_sensor() {
        let read = |rig: &Rig| {
            let samples = vec![1.0, 2.0, 3.0, -4.0];
            let memory = MemoryStream { capture: capture(), samples, angle_rev: Vec::new(), block_samples: 8, next: 0 };
            let mut stream = calibrated(Box::new(memory), rig);
            let mut block = Block::default();
            assert!(stream.next_block(&mut block).unwrap());
            (block.samples, stream.capture().converter_limits_um.clone().unwrap())
        };
        assert_eq!(read(&rig(false)), (vec![1.0, 2.0, 3.0, -4.0], vec![[-10.0, 10.0]; 2]));
        assert_eq!(read(&rig(true)), (vec![1.0, 40.0, 3.0, -80.0], vec![[-10.0, 10.0], [-200.0, 200.0]]));
    }
}
