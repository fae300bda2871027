//! Axial sensors: z, face form, declared forms, and what is one thing with what.

#![allow(clippy::unwrap_used, clippy::panic, reason = "tests")]

mod axial_campaigns;

use std::f64::consts::TAU;

use crate::campaigns::{averaged, campaign};
use crate::common::{Sum, profile, random_sum, value};
use runout_core::{
    Complex64,
    closed_loop::{
        Fit, Model, Setting, Settings,
        diagnosis::{Diagnosis, Verdict},
    },
    measurement::StationTruth,
    rig::{Looks, Rig, RigConfig, Rotation, SensorConfig, SetupConfig},
    separation::{Quantity, Separation},
    stage::{Station, StationSeparator},
};
use runout_spindle::{
    diagnose::{SpindleModel, diagnose},
    effects,
    layout::Layout,
    selection::Selection,
    separators::{
        ClosedFormSeparator, DonaldsonReversal, HarmonicLeastSquares, Method, MultiStep, ThreePoint, Weighting,
        four_sensor_reversal,
    },
    simulate::{FaceConfig, MotionHarmonic, SpindleConfig},
};

const SAMPLES: usize = 256;

fn radial(id: &str, angle_deg: f64, z_mm: f64, section: &str) -> SensorConfig {
    SensorConfig { id: id.into(), angle_deg, z_mm, section: section.into(), ..SensorConfig::default() }
}

fn axial(id: &str, angle_deg: f64, radius_mm: f64, section: &str) -> SensorConfig {
    SensorConfig { looks: Looks::Axial, radius_mm: Some(radius_mm), ..radial(id, angle_deg, 250.0, section) }
}

fn four() -> Vec<SensorConfig> {
    vec![
        radial("X1", 0.0, 100.0, "near"),
        radial("Y1", 90.0, 100.0, "near"),
        radial("X2", 0.0, 160.0, "far"),
        radial("Y2", 90.0, 160.0, "far"),
    ]
}

/// Two planes and one sensor at the pole, as of a spindle analyser.
fn five(form_um: Option<f64>) -> Vec<SensorConfig> {
    let mut sensors = four();
    sensors.push(SensorConfig { form_um, ..axial("Z", 0.0, 0.0, "pole") });
    sensors
}

fn config(rotation: Rotation, sensors: Vec<SensorConfig>, part_deg: &[f64]) -> RigConfig {
    let setup = |(index, part_deg): (usize, &f64)| SetupConfig {
        id: format!("k{index}"),
        part_deg: *part_deg,
        ..SetupConfig::default()
    };
    RigConfig {
        part_radius_mm: 12.7,
        rotation,
        sensors,
        setups: part_deg.iter().enumerate().map(setup).collect(),
        interruptions: Vec::new(),
        bearings: Vec::new(),
    }
}

fn rig(sensors: Vec<SensorConfig>, part_deg: &[f64]) -> Rig {
    config(Rotation::Ccw, sensors, part_deg).check().unwrap()
}

const TURNED: [f64; 3] = [0.0, 99.844, 202.5];

/// What is true: form of each section, motion x, y, z in µm and tilt about x and y in µrad over the spindle's angle.
struct Truth {
    form_um: Vec<Sum>,
    shift: [Sum; 3],
    tilt: [Sum; 2],
}

impl Truth {
    fn new(sections: usize) -> Self {
        let with_first = |seed, size: f64| {
            let mut sum = random_sum(seed, 12, size);
            sum.push((1, 0.7 * size, seed as f64));
            sum
        };
        Self {
            form_um: (0..sections).map(|section| random_sum(90 + section as u64, 20, 1.5)).collect(),
            shift: [random_sum(1, 12, 1.0), random_sum(2, 12, 1.0), with_first(3, 0.8)],
            tilt: [random_sum(4, 12, 20.0), random_sum(5, 12, 20.0)],
        }
    }

    /// Readings from vectors: a point of the part at r goes to r + d + ε × r, and the sensor reads what of that is along its line.
    fn station(&self, rig: &Rig, eccentricity_um: f64) -> Station {
        let profiles = rig.setups.iter().enumerate().map(|(setup, clamping)| {
            let reading = |sensor: &runout_core::rig::Sensor, turn: f64| {
                let stand = sensor.angle_rad + clamping.sensors_rad;
                let part = stand - rig.rotation.direction() * turn - clamping.part_rad;
                let [x, y, z] = [0, 1, 2].map(|axis| value(&self.shift[axis], turn));
                let [ex, ey] = [0, 1].map(|axis| 1e-6 * value(&self.tilt[axis], turn));
                let (at_mm, line) = match sensor.axial_radius_mm {
                    Some(radius) => ([radius * stand.cos(), radius * stand.sin(), 0.0], [0.0, 0.0, 1.0]),
                    // Of a radial sensor, only the lever along the axis counts: the rest is of second order.
                    None => ([0.0, 0.0, sensor.z_mm], [stand.cos(), stand.sin(), 0.0]),
                };
                let cross = [ey * at_mm[2], -ex * at_mm[2], ex * at_mm[1] - ey * at_mm[0]];
                let moved = [x + 1e3 * cross[0], y + 1e3 * cross[1], z + 1e3 * cross[2]];
                let along: f64 = moved.iter().zip(line).map(|(moved, line)| moved * line).sum();
                // A face is off square, a circle off centre, each setup by its own; on the axis neither shows.
                let on_axis = sensor.axial_radius_mm == Some(0.0);
                let clamped = if on_axis { 0.0 } else { eccentricity_um * (part + 1.3 * setup as f64).cos() };
                let form_at = if on_axis { -rig.rotation.direction() * turn } else { part };
                along + clamped + value(&self.form_um[sensor.section], form_at)
            };
            let channel =
                |sensor| (0..SAMPLES).map(|step| reading(sensor, TAU * step as f64 / SAMPLES as f64)).collect();
            profile(setup, &rig.sensors.iter().map(channel).collect::<Vec<_>>(), SAMPLES)
        });
        Station { name: "s1".into(), z_mm: 0.0, profiles: profiles.collect() }
    }

    /// Largest error of an unknown over the orders from `lowest`, in its unit.
    fn error(&self, separation: &Separation, quantity: Quantity, lowest: usize) -> f64 {
        let truth = match quantity {
            Quantity::X => &self.shift[0],
            Quantity::Y => &self.shift[1],
            Quantity::Z => &self.shift[2],
            Quantity::TiltX => &self.tilt[0],
            Quantity::TiltY => &self.tilt[1],
            form => &self.form_um[form.section().unwrap()],
        };
        let unknown = separation.position(quantity).unwrap();
        let of = |order| crate::common::coefficient_error(separation, unknown, order, truth);
        (lowest..=25).map(of).fold(0.0, |largest, error| if error <= largest { largest } else { error })
    }
}

fn separated(rig: &Rig, station: &Station) -> Separation {
    HarmonicLeastSquares::new(rig, false, Weighting::None).separate(station).unwrap()
}

#[test]
fn axial_sensors_at_a_radius_give_z_tilt_and_the_face() {
    for rotation in [Rotation::Ccw, Rotation::Cw] {
        let mut sensors = four();
        sensors.extend([("A1", 10.0), ("A2", 130.0), ("A3", 265.0)].map(|(id, deg)| axial(id, deg, 25.0, "face")));
        let rig = config(rotation, sensors, &TURNED).check().unwrap();
        let truth = Truth::new(rig.sections.len());
        let found = separated(&rig, &truth.station(&rig, 8.0));
        for quantity in [Quantity::Form(0), Quantity::Form(1), Quantity::FaceForm(2)] {
            assert!(truth.error(&found, quantity, 2) < 1e-9, "{rotation:?} {quantity:?}");
        }
        for quantity in [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY] {
            assert!(truth.error(&found, quantity, 2) < 1e-7, "{rotation:?} {quantity:?}");
        }
        // The fundamental is no clamping.
        assert!(truth.error(&found, Quantity::Z, 1) < 1e-9, "{rotation:?}");
    }
}

/// Three sensors on a face see tilt themselves: one radial plane is enough.
#[test]
fn tilt_from_the_face_alone() {
    let mut sensors = vec![radial("X", 0.0, 40.0, "ball"), radial("Y", 90.0, 40.0, "ball")];
    sensors.extend([("A1", 0.0), ("A2", 120.0), ("A3", 240.0)].map(|(id, deg)| axial(id, deg, 30.0, "face")));
    let rig = rig(sensors, &TURNED);
    let truth = Truth::new(2);
    let found = separated(&rig, &truth.station(&rig, 5.0));
    for quantity in [Quantity::TiltX, Quantity::TiltY, Quantity::X, Quantity::Y, Quantity::FaceForm(1)] {
        assert!(truth.error(&found, quantity, 2) < 1e-7, "{quantity:?}: {}", truth.error(&found, quantity, 2));
    }
    assert!(truth.error(&found, Quantity::Z, 1) < 1e-9);
}

/// With two sensors opposite each other, how the face was clamped and tilt cancel in their mean at 1/rev, and z is left.
#[test]
fn the_fundamental_from_two_opposite_sensors() {
    let mut sensors = four();
    sensors.extend([axial("A1", 30.0, 25.0, "face"), axial("A2", 210.0, 25.0, "face")]);
    let rig = rig(sensors, &TURNED);
    let truth = Truth::new(3);
    let found = separated(&rig, &truth.station(&rig, 8.0));
    assert!(truth.error(&found, Quantity::Z, 1) < 1e-9);
    let one = {
        let mut sensors = four();
        sensors.push(axial("A1", 30.0, 25.0, "face"));
        sensors
    };
    let rig = self::rig(one, &TURNED);
    let found = separated(&rig, &truth.station(&rig, 8.0));
    let z = found.position(Quantity::Z).unwrap();
    assert_eq!(found.lost_orders(z), [1], "one sensor off the axis cannot separate 1/rev from a face off square");
    assert!(truth.error(&found, Quantity::Z, 2) < 1e-9 && truth.error(&found, Quantity::FaceForm(2), 2) < 1e-9);
}

/// On the axis every order of z and of the face's form is lost, with the part turned as without.
#[test]
fn on_the_axis_z_and_form_are_one_thing() {
    for part_deg in [&[0.0][..], &TURNED] {
        let rig = rig(five(None), part_deg);
        let assessment = HarmonicLeastSquares::new(&rig, true, Weighting::None).assess(40).unwrap();
        let of = |quantity| assessment.unknowns.iter().position(|known| *known == quantity).unwrap();
        let every: Vec<usize> = (1..=40).collect();
        assert_eq!(assessment.lost_orders(of(Quantity::Z)), every);
        assert_eq!(assessment.lost_orders(of(Quantity::FaceForm(2))), every);
        assert_eq!((assessment.lost_form_orders(), assessment.lost_motion_orders()), (every.clone(), every.clone()));
        assert!(
            assessment.notes.iter().any(|note| note.contains("`pole`") && note.contains("form_um")),
            "{:?}",
            assessment.notes
        );
        // What is across the axis does not suffer from it.
        let lost = assessment.lost_orders(of(Quantity::X));
        assert_eq!(lost.is_empty(), part_deg.len() > 1, "{lost:?}");
        assert_eq!(assessment.has_no_observable_form(), part_deg.len() < 2);
        let truth = Truth::new(3);
        let found = separated(&rig, &truth.station(&rig, 8.0));
        assert!(found.coefficients(found.position(Quantity::Z).unwrap()).all(|value| value == Complex64::ZERO));
        let row = HarmonicLeastSquares::new(&rig, true, Weighting::None).projection(0).unwrap().rows;
        let z = row.iter().find(|(quantity, _)| *quantity == Quantity::Z).unwrap();
        assert_eq!(z.1.len(), 1, "turns differ by motion only, so that single turns give z: {row:?}");
    }
}

/// A declared form leaves z, from 1/rev on, with the bound as what it may be off by.
#[test]
fn a_declared_form_gives_z_within_its_bound() {
    let rig = rig(five(Some(0.08)), &[0.0]);
    let mut truth = Truth::new(3);
    truth.form_um[2] = vec![(1, 0.01, 0.3), (2, 0.03, 1.0)];
    let found = separated(&rig, &truth.station(&rig, 8.0));
    let z = found.position(Quantity::Z).unwrap();
    assert!(found.lost_orders(z).is_empty());
    assert!((truth.error(&found, Quantity::Z, 1) - 0.03).abs() < 1e-9);
    assert!((found.bound_of(z) - 0.08).abs() < 1e-12, "{:?}", found.form_bound);
    // Forms of both planes are open, and with them x, y and the tilts.
    assert_eq!(found.lost_orders(found.position(Quantity::X).unwrap()).len(), found.max_order());

    // Declared in all three sections: five readings, five motions.
    let mut sensors = five(Some(0.08));
    sensors.iter_mut().take(4).for_each(|sensor| sensor.form_um = Some(0.05));
    let rig = self::rig(sensors, &[0.0]);
    let mut truth = Truth::new(3);
    truth.form_um = vec![Vec::new(); 3];
    let found = separated(&rig, &truth.station(&rig, 8.0));
    for quantity in [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY] {
        assert!(truth.error(&found, quantity, 2) < 1e-7, "{quantity:?}");
    }
    assert!(truth.error(&found, Quantity::Z, 1) < 1e-9);
    // Tilt is the difference of two planes 60 mm apart, each off by 0.05 µm: 2·0.05/60 mm = 1.667 µrad.
    let tilt = found.bound_of(found.position(Quantity::TiltY).unwrap());
    assert!((tilt - 1e3 * 0.1 / 60.0).abs() < 1e-9, "{tilt}");
}

/// Axial sensors beside the axis give z, and what the one on the axis reads beyond it is the form there.
#[test]
fn off_axis_sensors_free_the_one_on_the_axis() {
    let mut sensors = five(None);
    sensors.extend([("A1", 0.0), ("A2", 120.0), ("A3", 240.0)].map(|(id, deg)| axial(id, deg, 20.0, "face")));
    let rig = rig(sensors, &TURNED);
    let mut truth = Truth::new(4);
    truth.form_um[2].push((1, 0.4, 0.2));
    let found = separated(&rig, &truth.station(&rig, 8.0));
    assert!(truth.error(&found, Quantity::Z, 1) < 1e-9);
    assert!(truth.error(&found, Quantity::FaceForm(2), 2) < 1e-9);
}

/// The other separators take what is across the axis and say what they leave; named, an axial sensor is refused.
#[test]
fn separators_across_the_axis() {
    fn refused<M: Method>(rig: &Rig) -> String {
        let Err(fault) = ClosedFormSeparator::of::<M>(Selection::whole(rig), true, f64::INFINITY) else { panic!() };
        fault.to_string()
    }
    let two = rig(vec![radial("X", 0.0, 100.0, "near"), axial("Z", 0.0, 0.0, "pole")], &[0.0, 90.0]);
    let messages = [refused::<MultiStep>(&two), refused::<DonaldsonReversal>(&two), refused::<ThreePoint>(&two)];
    for message in messages {
        assert!(message.contains("axial sensor `Z`"), "{message}");
    }
    let chosen = Selection::named(&two, None, None, MultiStep::choose).unwrap();
    assert_eq!(chosen.unused, ["Z"]);
    let found = ClosedFormSeparator::of::<MultiStep>(chosen, true, f64::INFINITY).unwrap().assess(9).unwrap();
    assert!(found.notes.iter().any(|note| note == "not used: Z"), "{:?}", found.notes);
    let reversed = rig(five(None), &[0.0, 180.0]);
    let chosen = Selection::named(&reversed, None, None, four_sensor_reversal::choose).unwrap();
    assert_eq!(chosen.unused, ["Z"]);
    assert!(four_sensor_reversal::separator(chosen, true, false).is_ok());
    let whole = four_sensor_reversal::separator(Selection::whole(&reversed), true, false);
    assert!(whole.err().unwrap().to_string().contains("axial sensor `Z`"));
    let mut declared = four();
    declared[0].form_um = Some(0.1);
    let declared = rig(declared, &[0.0, 180.0]);
    let whole = four_sensor_reversal::separator(Selection::whole(&declared), true, false);
    assert!(whole.err().unwrap().to_string().contains("form_um"));
}

/// Faces alone: no x and y, and nothing panics.
#[test]
fn only_axial_sensors() {
    for angles in [&[0.0][..], &[0.0, 120.0, 240.0]] {
        for radius_mm in [0.0, 30.0] {
            let sensors = angles.iter().enumerate();
            let sensors = sensors.map(|(index, deg)| axial(&format!("A{index}"), *deg, radius_mm, "face")).collect();
            let rig = rig(sensors, &TURNED);
            let layout = Layout::new(&rig, false);
            assert!(!layout.unknowns.contains(&Quantity::X), "{:?}", layout.unknowns);
            let truth = Truth::new(1);
            let found = HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance);
            let found = found.separate(&truth.station(&rig, 3.0)).unwrap();
            let z = found.position(Quantity::Z).unwrap();
            if radius_mm > 0.0 && angles.len() == 3 {
                assert!(truth.error(&found, Quantity::Z, 1) < 1e-9);
            } else {
                assert!(!found.lost_orders(z).is_empty());
            }
            runout_spindle::plan::foresee_rig(&rig).unwrap();
        }
    }
}

#[test]
fn what_a_rig_file_can_get_wrong() {
    let faulty = |change: fn(&mut Vec<SensorConfig>)| {
        let mut sensors = five(None);
        change(&mut sensors);
        let fault = config(Rotation::Ccw, sensors, &[0.0]).check().unwrap_err();
        (fault.to_string(), format!("{:?}", fault.place))
    };
    for (change, message, key) in [
        ((|s| s[4].radius_mm = None) as fn(&mut Vec<SensorConfig>), "needs `radius_mm`", "looks"),
        (|s| s[4].radius_mm = Some(-3.0), "of 0 to 1000000 mm, found -3", "radius_mm"),
        (|s| s[4].radius_mm = Some(f64::NAN), "of 0 to 1000000 mm", "radius_mm"),
        (|s| s[0].radius_mm = Some(12.0), "only an axial sensor", "radius_mm"),
        (|s| s[4].section = "near".into(), "both radially and axially", "looks"),
        (|s| s[4].form_um = Some(-1.0), "0 µm or more", "form_um"),
        (|s| s[4].form_um = Some(f64::INFINITY), "0 µm or more", "form_um"),
        (|s| (s[0].form_um, s[1].form_um) = (Some(0.1), Some(0.2)), "0.1 µm is declared for it already", "form_um"),
        (|s| s.push(axial("A", 0.0, 20.0, "pole")), "must share one radius", "radius_mm"),
    ] {
        let (found, place) = faulty(change);
        assert!(found.contains(message) && place.contains(key), "{found}\n{place}");
    }
}
