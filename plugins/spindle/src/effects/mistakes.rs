//! Mistakes in the rig file: the recording is sound, and channels, setups or signs are not where the file says. Each is there or
//! not, so that it has no parameters, and all are tried before any other effect.

use runout_core::{
    Complex64,
    rig::{Rig, Sensor},
};

use super::{About, ActsOn, Alterations, Predicted, SpindleEffect};
use crate::layout::Layout;

/// A mistake that people make.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Mistake {
    /// A reading has the opposite sign.
    SensorSign,
    /// A sensor stands on the other side of the part, half a turn from its angle.
    SensorOpposite,
    /// Two channels hold each other's signals.
    SensorsSwapped,
    /// The second of two channels has the signal of the first.
    SensorsIdentical,
    /// Two setups hold each other's recordings.
    SetupsSwapped,
    /// The second of two setups was recorded as the first: part and sensors were not moved between them.
    SetupRepeated,
    /// The part turns the other way.
    RotationReversed,
    /// The part's angles count the other way.
    PartAngleSign,
    /// The sensors' angles count the other way.
    SensorAnglesSign,
    /// A sensor looks at the other section.
    SensorInOtherSection,
    /// In a setup the sensors were turned with the part, and are declared to have stayed; or the other way.
    SensorsTurned,
    /// A reading has the opposite sign in one setup.
    SensorSignInSetup,
    /// Two channels hold each other's signals in one setup.
    SensorsSwappedInSetup,
    /// The part turns the other way in one setup.
    RotationReversedInSetup,
}

impl Mistake {
    /// All of them, the more frequent ones first.
    pub const ALL: [Self; 14] = [
        Self::SensorSign,
        Self::SensorOpposite,
        Self::SetupsSwapped,
        Self::SensorsSwapped,
        Self::PartAngleSign,
        Self::RotationReversed,
        Self::SensorAnglesSign,
        Self::SensorsTurned,
        Self::SensorInOtherSection,
        Self::SensorSignInSetup,
        Self::SensorsSwappedInSetup,
        Self::RotationReversedInSetup,
        Self::SetupRepeated,
        Self::SensorsIdentical,
    ];

    /// Its id.
    #[must_use]
    pub fn id(self) -> &'static str {
        match self {
            Self::SensorSign | Self::SensorSignInSetup => "sensor-sign",
            Self::SensorOpposite => "sensor-opposite",
            Self::SensorsSwapped | Self::SensorsSwappedInSetup => "sensors-swapped",
            Self::SensorsIdentical => "sensors-identical",
            Self::SetupsSwapped => "setups-swapped",
            Self::SetupRepeated => "setup-repeated",
            Self::RotationReversed | Self::RotationReversedInSetup => "rotation-reversed",
            Self::PartAngleSign => "part-angle-sign",
            Self::SensorAnglesSign => "sensor-angles-sign",
            Self::SensorInOtherSection => "sensor-in-other-section",
            Self::SensorsTurned => "sensors-turned",
        }
    }

    /// Where it acts.
    #[must_use]
    pub fn acts_on(self) -> ActsOn {
        match self {
            Self::SensorSign | Self::SensorOpposite | Self::SensorInOtherSection => ActsOn::Sensor,
            Self::SensorsTurned => ActsOn::OddSetup,
            Self::SensorSignInSetup => ActsOn::SensorInSetup,
            Self::SensorsSwappedInSetup => ActsOn::SensorPairInSetup,
            Self::RotationReversedInSetup => ActsOn::Setup,
            Self::SensorsSwapped => ActsOn::SensorPair,
            Self::SensorsIdentical => ActsOn::SensorCopy,
            Self::SetupsSwapped => ActsOn::SetupPair,
            Self::SetupRepeated => ActsOn::SetupCopy,
            Self::RotationReversed | Self::PartAngleSign | Self::SensorAnglesSign => ActsOn::Rig,
        }
    }

    /// Whether it was made in one setup, and the rig file has no key for it.
    #[must_use]
    pub fn is_of_one_setup(self) -> bool {
        matches!(self, Self::SensorSignInSetup | Self::SensorsSwappedInSetup | Self::RotationReversedInSetup)
    }

    /// Whether it changes anything at a target of a layout.
    #[must_use]
    pub fn suits(self, target: usize, layout: &Layout) -> bool {
        let mut readings = layout.readings.iter();
        match self {
            Self::SensorInOtherSection => {
                readings.find(|reading| reading.sensor == target).is_some_and(|own| layout.other_section(own).is_some())
            }
            Self::SensorsTurned => {
                let own = readings.find(|reading| reading.setup == target);
                own.is_some_and(|own| {
                    own.turned_otherwise_rad().sin().hypot(1.0 - own.turned_otherwise_rad().cos()) > 1e-6
                })
            }
            _ => !self.is_of_one_setup() || layout.readings.iter().any(|reading| reading.setup > 0),
        }
    }

    /// Corrects it.
    pub fn correct(self, target: usize, alterations: &mut Alterations) {
        let sensors = pair_of(target, alterations.sensors.len());
        let setups = pair_of(target, alterations.setups.len());
        match self {
            Self::SensorSign => alterations.sensors[target].sign *= -1.0,
            Self::SensorOpposite => alterations.sensors[target].opposite ^= true,
            Self::SensorsSwapped => {
                let [first, second] = sensors;
                alterations.places.swap(first, second);
                // Each probe keeps its polarity, and the file gave it to the other channel.
                let opposite = alterations.declared_signs[first] * alterations.declared_signs[second];
                alterations.sensors[first].sign *= opposite;
                alterations.sensors[second].sign *= opposite;
            }
            Self::SensorsIdentical => {
                let [first, second] = sensors;
                alterations.places[second] = alterations.places[first];
                alterations.sensors[second].sign *=
                    alterations.declared_signs[first] * alterations.declared_signs[second];
            }
            Self::SensorSignInSetup => {
                let count = alterations.setups.len();
                alterations.sensors[target / count].reversed_in.push(target % count);
            }
            Self::SensorsSwappedInSetup => {
                let count = alterations.setups.len();
                let (pair, setup) = (pair_of(target / count, alterations.sensors.len()), target % count);
                alterations.swapped_in.push((setup, pair));
                if pair.map(|sensor| alterations.declared_signs[sensor]).iter().product::<f64>() < 0.0 {
                    pair.into_iter().for_each(|sensor| alterations.sensors[sensor].reversed_in.push(setup));
                }
            }
            Self::RotationReversedInSetup => alterations.setups[target].backwards ^= true,
            Self::SetupsSwapped => alterations.clampings.swap(setups[0], setups[1]),
            Self::SetupRepeated => alterations.clampings[setups[1]] = alterations.clampings[setups[0]],
            Self::RotationReversed => alterations.rotation_reversed ^= true,
            Self::PartAngleSign => alterations.part_angles_reversed ^= true,
            Self::SensorAnglesSign => alterations.sensor_angles_reversed ^= true,
            Self::SensorInOtherSection => alterations.sensors[target].in_other_section ^= true,
            Self::SensorsTurned => alterations.setups[target].sensors_otherwise ^= true,
        }
    }

    /// Lines of TOML, keys and values of the rig file, that correct it where it is the file that is wrong; `sensors` and `setups` are the places in
    /// the file of those in use.
    #[must_use]
    pub fn change(self, target: usize, rig: &Rig, sensors: &[usize], setups: &[usize]) -> Vec<String> {
        let exchanged = |list: &str, [first, second]: [usize; 2], places: &[usize], ids: [&str; 2]| {
            let line = |place: usize, id: &str| format!("{list}.{}.id = \"{id}\"", places[place]);
            vec![line(first, ids[1]), line(second, ids[0])]
        };
        match self {
            Self::SensorSign => vec![format!("sensors.{}.sign = {}", sensors[target], -rig.sensors[target].sign)],
            Self::SensorOpposite => {
                let angle_deg = degrees(rig.sensors[target].angle_rad);
                let opposite_deg = if angle_deg > 0.0 { angle_deg - 180.0 } else { angle_deg + 180.0 };
                vec![format!("sensors.{}.angle_deg = {opposite_deg:?}", sensors[target])]
            }
            Self::SensorAnglesSign => {
                let turned = rig.sensors.iter().zip(sensors).filter(|(sensor, _)| sensor.angle_rad != 0.0);
                let key = |(sensor, place): (&Sensor, &usize)| {
                    format!("sensors.{place}.angle_deg = {:?}", -degrees(sensor.angle_rad))
                };
                turned.map(key).collect()
            }
            Self::SensorsSwapped => {
                let pair = pair_of(target, rig.sensors.len());
                exchanged("sensors", pair, sensors, pair.map(|sensor| rig.sensors[sensor].id.as_str()))
            }
            Self::SetupsSwapped => {
                let pair = pair_of(target, rig.setups.len());
                exchanged("setups", pair, setups, pair.map(|setup| rig.setups[setup].id.as_str()))
            }
            Self::SensorsIdentical
            | Self::SetupRepeated
            | Self::SensorSignInSetup
            | Self::SensorsSwappedInSetup
            | Self::RotationReversedInSetup => Vec::new(),
            Self::SensorInOtherSection => {
                let own = &rig.sensors[target];
                let other = rig.sensors.iter().find(|sensor| sensor.section != own.section);
                let keys = other.map(|other| {
                    let key = |rest: String| format!("sensors.{}.{rest}", sensors[target]);
                    let section = key(format!("section = \"{}\"", rig.sections[other.section]));
                    vec![section, key(format!("z_mm = {:?}", other.z_mm))]
                });
                keys.unwrap_or_default()
            }
            Self::SensorsTurned => {
                let setup = &rig.setups[target];
                let turned_rad = if setup.sensors_rad == 0.0 { setup.part_rad } else { 0.0 };
                vec![format!("setups.{}.sensors_deg = {:?}", setups[target], degrees(turned_rad))]
            }
            Self::RotationReversed => {
                vec![format!("rotation = \"{}\"", if rig.rotation.direction() > 0.0 { "cw" } else { "ccw" })]
            }
            Self::PartAngleSign => {
                let turned = rig.setups.iter().zip(setups).filter(|(setup, _)| setup.part_rad != 0.0);
                let keys =
                    turned.map(|(setup, place)| format!("setups.{place}.part_deg = {:?}", -degrees(setup.part_rad)));
                keys.collect()
            }
        }
    }

    /// What to do where the recording is wrong and not the rig file.
    #[must_use]
    pub fn advice(self, target: usize, rig: &Rig) -> Option<String> {
        match self {
            Self::SensorsIdentical => {
                let [first, second] = pair_of(target, rig.sensors.len()).map(|sensor| &rig.sensors[sensor].id);
                Some(format!("channel `{second}` has the signal of `{first}`: record it again, or leave it out"))
            }
            Self::SetupRepeated => {
                let [first, second] = pair_of(target, rig.setups.len()).map(|setup| &rig.setups[setup].id);
                Some(format!("setup `{second}` was recorded as `{first}`: record it again, or leave it out"))
            }
            _ if self.is_of_one_setup() => {
                let ids = self.acts_on().ids(target, rig);
                let (setup, sensors) = ids.split_last()?;
                let what = match (self, sensors) {
                    (Self::SensorSignInSetup, [sensor]) => format!("the readings of `{sensor}` have the opposite sign"),
                    (Self::SensorsSwappedInSetup, [one, other]) => {
                        format!("channels `{one}` and `{other}` are swapped")
                    }
                    _ => "the part turns the other way".to_owned(),
                };
                Some(format!(
                    "in setup `{setup}` {what}, and in the others as declared: record it again, or correct the recording"
                ))
            }
            _ => None,
        }
    }
}

/// Degrees that were converted to radians: nine decimals give them back.
fn degrees(angle_rad: f64) -> f64 {
    (angle_rad.to_degrees() * 1e9).round() / 1e9
}

/// The two that the target of a pair stands for: first · count + second.
#[must_use]
pub fn pair_of(target: usize, count: usize) -> [usize; 2] {
    [target / count, target % count]
}

/// Targets of a pair among `count`, the first before the second.
pub fn pairs(count: usize) -> impl Iterator<Item = usize> {
    (0..count).flat_map(move |first| (first + 1..count).map(move |second| first * count + second))
}

/// Targets of a pair among `count`, in either order.
pub(super) fn ordered_pairs(count: usize) -> impl Iterator<Item = usize> {
    (0..count * count).filter(move |pair| pair / count != pair % count)
}

impl SpindleEffect for Mistake {
    fn about(&self) -> About {
        let does = match self {
            Self::SensorSignInSetup => "a mistake in the recording: a reading has the opposite sign in one setup",
            Self::SensorsSwappedInSetup => "a mistake in the recording: two channels are swapped in one setup",
            Self::RotationReversedInSetup => "a mistake in the recording: the part turns the other way in one setup",
            Self::SensorSign => "a mistake in the rig: a reading has the opposite sign",
            Self::SensorOpposite => "a mistake in the rig: a sensor is on the other side of the part",
            Self::SensorsSwapped => "a mistake in the rig: two channels are swapped",
            Self::SensorsIdentical => "a mistake in the recording: two channels have the same signal",
            Self::SetupsSwapped => "a mistake in the rig: two setups are swapped",
            Self::SetupRepeated => "a mistake in the recording: a setup was recorded twice",
            Self::RotationReversed => "a mistake in the rig: the part turns the other way",
            Self::PartAngleSign => "a mistake in the rig: the part's angles count the other way",
            Self::SensorAnglesSign => "a mistake in the rig: the sensors' angles count the other way",
            Self::SensorInOtherSection => "a mistake in the rig: a sensor measures the other section",
            Self::SensorsTurned => {
                "a mistake in the rig: the sensors stayed or were turned with the part, in one setup"
            }
        };
        About { id: self.id(), does, acts_on: self.acts_on(), parameters: Vec::new() }
    }

    fn alter(&self, target: usize, _values: &[f64], alterations: &mut Alterations) {
        self.correct(target, alterations);
    }

    fn partials(&self, _target: usize, _predicted: &Predicted) -> Vec<Vec<Complex64>> {
        Vec::new()
    }

    fn suits(&self, target: usize, layout: &Layout) -> bool {
        Mistake::suits(*self, target, layout)
    }

    fn mistake(&self) -> Option<Mistake> {
        Some(*self)
    }
}
