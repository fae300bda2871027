//! The layout of a rig: which combination of form and motion each sensor reads in each setup, one order at a time.

use std::{
    f64::consts::{FRAC_PI_2, TAU},
    sync::Arc,
};

pub use runout_core::separation::UM_PER_MM_URAD;
use runout_core::{Complex64, azimuth::Azimuth, numerics::least_squares::PivotedQr, rig::Rig, separation::Quantity};

mod altered;
mod first_order;
mod observable;
mod reference;
mod seen_form;
mod systems;

pub use first_order::FirstOrder;
pub use reference::ToReference;
pub(crate) use seen_form::ENOUGH;
pub use seen_form::SeenPattern;
pub use systems::System;
use systems::Systems;

/// A column adds to the rank when more than this of it (relative) lies outside the others' span. Rounding of
/// e^{inθ} at order 10 000 is 1e-12; a sensor misplaced by a nanometre on 30 mm gives 3e-8.
pub(crate) const RANK_TOLERANCE: f64 = 1e-9;
/// An unknown takes part in the null space above this share.
pub(crate) const NULL_TOLERANCE: f64 = 1e-7;
/// Sines and cosines below this are those of a sensor that looks along the other axis.
pub(crate) const ALONG_AXIS: f64 = 1e-9;

/// What each reading sees. Readings are ordered setup by setup, sensor by sensor.
///
/// Row (k, c) of Aₙ, with θ' = θ_c + σ_k: [e^{±in(θ'−β_k)} at its section, cos θ', sin θ', −z sin θ', z cos θ'] for the
/// unknowns H (conjugated where the part turns clockwise), X, Y, E_x, E_y. Motion is taken at the radial sensors' mean z, so
/// that Aₙ is well conditioned and the same at every station.
///
/// An axial sensor at the radius ρ reads z − ρ·(tilt towards it) + the face's form: its row is
/// [e^{±in(θ'−β)} at its face, 1 for Z, ρ sin θ', −ρ cos θ'], that of a lever −ρ. On the axis (ρ = 0) it looks at one point of the
/// face, whatever the angle of the part: the form's entry is 1, as that of Z, so that no order of both is separated.
#[derive(Debug, Clone)]
pub struct Layout {
    /// Readings, in order.
    pub readings: Vec<Reading>,
    /// What is solved for at orders from 2: forms, then motions that some sensor sees.
    pub unknowns: Vec<Quantity>,
    /// Mean z of the radial sensors, before the station's position is added, in mm.
    pub mean_z_mm: f64,
    /// Nominal radius of the part, in mm.
    pub part_radius_mm: f64,
    /// +1 where the part turns counter-clockwise.
    pub direction: f64,
    /// An unknown whose noise gain is above this is lost. Tilts count by what they move at the sensors' rms lever.
    pub max_noise_gain: f64,
    /// Sections that some sensor looks at.
    sections: Vec<usize>,
    /// Of each section of the rig, the declared peak-to-valley bound of its form, in µm.
    form_bounds_um: Vec<Option<f64>>,
    setups: usize,
    odd_motion: bool,
    systems: Systems,
}

/// One sensor in one setup.
#[derive(Debug, Clone)]
pub struct Reading {
    /// Index of the setup.
    pub setup: usize,
    /// Index of the sensor.
    pub sensor: usize,
    /// Index of the section.
    pub section: usize,
    /// θ' = θ + σ: where the sensor stands, in rad.
    pub angle_rad: f64,
    /// θ' − β: where on the part it looks at spindle angle 0, in rad.
    pub part_angle_rad: f64,
    /// σ: by how much all sensors are turned in the setup, in rad.
    pub turned_rad: f64,
    /// Which way the sensor looks.
    pub view: View,
    /// z minus the sensors' mean z, in mm; of an axial sensor −ρ: what a tilt towards the sensor moves it by.
    pub lever_mm: f64,
    /// Synchronous motion that it reads in this setup, over that of the spindle in the first.
    pub motion_ratio: f64,
    /// Squared width of the sensor's spot on the part, in rad².
    pub spot_rad2: f64,
    /// What it has besides the form of the section and the motion, in µm.
    pub patterns: Vec<SeenPattern>,
    /// ±1 as the rig declares it: readings are multiplied by it as they are read.
    pub declared_sign: f64,
}

/// Which way a sensor looks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum View {
    /// Across the axis.
    Radial,
    /// Along it, off the axis.
    Axial,
    /// Along it, on the axis: at one point of the face.
    OnAxis,
}

impl View {
    /// Whether the sensor looks along the axis.
    #[must_use]
    pub fn is_axial(self) -> bool {
        self != Self::Radial
    }
}

impl Layout {
    /// How far radial sensors are apart along the axis, in mm; infinite where there are none.
    #[must_use]
    pub fn span_mm(&self) -> f64 {
        let radial = self.readings.iter().filter(|reading| !reading.view.is_axial());
        let [low, high] = radial.fold([f64::INFINITY, f64::NEG_INFINITY], |[low, high], reading| {
            [low.min(reading.lever_mm), high.max(reading.lever_mm)]
        });
        if low <= high { high - low } else { f64::INFINITY }
    }

    /// The layout of a rig. `odd_motion` assumes, as the four-sensor paper's equation (7) does, that motion has odd
    /// orders only, so that it changes sign after half a turn: even orders then count with the opposite sign in every
    /// setup but the first.
    #[must_use]
    pub fn new(rig: &Rig, odd_motion: bool) -> Self {
        let radial = || rig.sensors.iter().filter(|sensor| sensor.axial_radius_mm.is_none());
        let mean_z_mm = radial().map(|sensor| sensor.z_mm).sum::<f64>() / radial().count().max(1) as f64;
        let mut readings = Vec::with_capacity(rig.setups.len() * rig.sensors.len());
        for (setup, clamping) in rig.setups.iter().enumerate() {
            for (index, sensor) in rig.sensors.iter().enumerate() {
                let angle_rad = sensor.angle_rad + clamping.sensors_rad;
                readings.push(Reading {
                    setup,
                    sensor: index,
                    section: sensor.section,
                    angle_rad,
                    part_angle_rad: angle_rad - clamping.part_rad,
                    turned_rad: clamping.sensors_rad,
                    view: match sensor.axial_radius_mm {
                        None => View::Radial,
                        Some(radius_mm) if radius_mm > 0.0 => View::Axial,
                        Some(_) => View::OnAxis,
                    },
                    lever_mm: sensor.axial_radius_mm.map_or(sensor.z_mm - mean_z_mm, |radius_mm| 0.0 - radius_mm),
                    motion_ratio: 1.0,
                    spot_rad2: 0.0,
                    patterns: Vec::new(),
                    declared_sign: sensor.sign,
                });
            }
        }
        let looks = |wanted: fn(&Reading) -> bool, part: fn(f64) -> f64| {
            readings.iter().any(|reading| wanted(reading) && part(reading.angle_rad).abs() > ALONG_AXIS)
        };
        let [across, tilted]: [fn(&Reading) -> bool; 2] =
            [|reading| !reading.view.is_axial(), |reading| reading.lever_mm != 0.0];
        let (sees_x, sees_y) = (looks(across, f64::cos), looks(across, f64::sin));
        let of_tilt = readings.iter().filter(|reading| !reading.view.is_axial() || reading.lever_mm != 0.0);
        let one_line = one_line(of_tilt, sees_x && sees_y);
        let sees_tilt = readings.iter().any(tilted);
        let looked_at = |section: &usize| rig.sensors.iter().any(|sensor| sensor.section == *section);
        let sections: Vec<usize> = (0..rig.sections.len()).filter(looked_at).collect();
        // A form that is declared within a bound is not solved for.
        let open = || sections.iter().copied().filter(|section| rig.form_bounds_um[*section].is_none());
        let mut unknowns: Vec<Quantity> = open().filter(|section| !rig.is_face(*section)).map(Quantity::Form).collect();
        unknowns.extend(open().filter(|section| rig.is_face(*section)).map(Quantity::FaceForm));
        let motions = match one_line {
            // Neither x nor y is observable, but what is along the line.
            Some(line) => vec![(Quantity::Along(line), true), (Quantity::TiltAlong(line), sees_tilt)],
            None => vec![
                (Quantity::X, sees_x),
                (Quantity::Y, sees_y),
                (Quantity::TiltX, looks(tilted, f64::sin)),
                (Quantity::TiltY, looks(tilted, f64::cos)),
            ],
        };
        let motions = motions.into_iter().chain([(Quantity::Z, rig.has_axial())]);
        unknowns.extend(motions.filter(|(_, seen)| *seen).map(|(quantity, _)| quantity));
        Self {
            readings,
            unknowns,
            mean_z_mm,
            part_radius_mm: rig.part_radius_mm,
            direction: rig.rotation.direction(),
            max_noise_gain: f64::INFINITY,
            sections,
            form_bounds_um: rig.form_bounds_um.clone(),
            setups: rig.setups.len(),
            odd_motion,
            systems: Systems::default(),
        }
    }

    /// Declared peak-to-valley bound of a section's form, in µm.
    #[must_use]
    pub fn form_bound_um(&self, section: usize) -> Option<f64> {
        self.form_bounds_um.get(section).copied().flatten()
    }

    /// Sections whose form is declared within a bound and taken as 0, with the bound, in µm peak to valley.
    pub fn declared_forms(&self) -> impl Iterator<Item = (usize, f64)> + '_ {
        self.sections.iter().filter_map(|section| Some((*section, self.form_bound_um(*section)?)))
    }

    /// The layout with a limit on the noise that an order may carry.
    #[must_use]
    pub fn limited_to(self, max_noise_gain: f64) -> Self {
        Self { max_noise_gain, systems: Systems::default(), ..self }
    }

    /// Places among the unknowns of the forms of circles around the part, and their sections.
    pub fn circles(&self) -> impl Iterator<Item = (usize, usize)> + '_ {
        self.unknowns.iter().enumerate().filter_map(|(place, unknown)| match unknown {
            Quantity::Form(section) => Some((place, *section)),
            _ => None,
        })
    }

    /// Places of the forms among the unknowns.
    pub fn forms(&self) -> impl Iterator<Item = usize> + '_ {
        self.unknowns.iter().enumerate().filter(|(_, unknown)| unknown.is_form()).map(|(place, _)| place)
    }

    /// Whether motion is taken to have odd orders only.
    #[must_use]
    pub fn assumes_odd_motion(&self) -> bool {
        self.odd_motion
    }

    /// ±1 of each sensor, as the rig declares it.
    pub(crate) fn declared_signs(&self) -> Vec<f64> {
        let first = self.readings.iter().take_while(|reading| reading.setup == 0);
        first.map(|reading| reading.declared_sign).collect()
    }

    /// +1, or −1 where motion of this order is assumed to change sign in this setup.
    #[must_use]
    pub fn motion_sign(&self, setup: usize, order: usize) -> f64 {
        if self.odd_motion && setup > 0 && order.is_multiple_of(2) { -1.0 } else { 1.0 }
    }

    /// What one reading sees of a unit of an unknown, at an order.
    #[must_use]
    pub fn coefficient(&self, reading: &Reading, quantity: Quantity, order: usize) -> Complex64 {
        match quantity {
            Quantity::Form(section) | Quantity::FaceForm(section) if section == reading.section => {
                self.form_phase(reading, order)
            }
            Quantity::Form(_) | Quantity::FaceForm(_) => Complex64::ZERO,
            motion => self.motion_sign(reading.setup, order) * Complex64::from(Self::seen(reading, motion)),
        }
    }

    /// What one reading sees of a unit of motion, 0 of form.
    fn seen(reading: &Reading, quantity: Quantity) -> f64 {
        // Both sines come from the same function, so that sensors at right angles are exactly so.
        let (cosine, sine) = (|| exact_cos(reading.angle_rad), || exact_cos(reading.angle_rad - FRAC_PI_2));
        let lever = reading.lever_mm * UM_PER_MM_URAD;
        let across = |entry: f64| if reading.view.is_axial() { 0.0 } else { entry };
        let motion = match quantity {
            Quantity::Form(_) | Quantity::FaceForm(_) | Quantity::FaceMotion(_) => return 0.0,
            Quantity::X => across(cosine()),
            Quantity::Y => across(sine()),
            Quantity::Z => f64::from(reading.view.is_axial()),
            Quantity::TiltX => -lever * sine(),
            Quantity::TiltY => lever * cosine(),
            Quantity::Along(azimuth) => across(exact_cos(reading.angle_rad - azimuth.radians())),
            Quantity::TiltAlong(azimuth) => lever * exact_cos(reading.angle_rad - azimuth.radians()),
        };
        reading.motion_ratio * motion
    }

    /// e^{±in(θ'−β)}, + where the part turns counter-clockwise.
    #[must_use]
    pub fn part_phase(&self, reading: &Reading, order: usize) -> Complex64 {
        // The angle is reduced before it is multiplied by a large order.
        let turns = fraction(reading.part_angle_rad / TAU);
        let angle = fraction(turns * order as f64) * TAU;
        Complex64::new(exact_cos(angle), self.direction * exact_cos(angle - FRAC_PI_2))
    }

    /// The part angle that a sensor's line points at, at one of so many equal angles of the spindle, in rad.
    #[must_use]
    pub fn part_angle_rad(&self, reading: &Reading, step: usize, samples: usize) -> f64 {
        reading.part_angle_rad - self.direction * TAU * step as f64 / samples as f64
    }

    /// A form's coefficient of e^{+inα} from the unknown, or the unknown from it: where the part turns clockwise, one is the
    /// conjugate of the other.
    #[must_use]
    pub fn of_part(&self, form: Complex64) -> Complex64 {
        if self.direction < 0.0 { form.conj() } else { form }
    }

    /// Aₙ, `[reading][unknown]`.
    #[must_use]
    pub fn matrix(&self, order: usize) -> Vec<Complex64> {
        self.matrix_with(&self.motions(), order)
    }

    /// What the readings see of motion, which is the same at every order but for its sign, `[reading][unknown]`.
    pub(crate) fn motions(&self) -> Vec<f64> {
        let row = |reading| self.unknowns.iter().map(move |unknown| Self::seen(reading, *unknown));
        self.readings.iter().flat_map(row).collect()
    }

    /// Aₙ, `[reading][unknown]`, from [`motions`](Self::motions).
    pub(crate) fn matrix_with(&self, motions: &[f64], order: usize) -> Vec<Complex64> {
        let rows = self.readings.iter().zip(motions.chunks(self.unknowns.len().max(1)));
        let row = |(reading, motions): (&Reading, &[f64])| -> Vec<Complex64> {
            let sign = self.motion_sign(reading.setup, order);
            let entry = |(unknown, motion): (&Quantity, &f64)| match unknown {
                Quantity::Form(_) | Quantity::FaceForm(_) => self.coefficient(reading, *unknown, order),
                _ => Complex64::from(sign * motion),
            };
            self.unknowns.iter().zip(motions).map(entry).collect()
        };
        rows.flat_map(row).collect()
    }

    /// The equations of the orders from 1 to `max_order`; worked out once.
    #[must_use]
    pub fn systems(&self, max_order: usize) -> Vec<Arc<System>> {
        self.systems.up_to(self, max_order)
    }

    /// Factors one order's matrix.
    #[must_use]
    pub fn factor(&self, order: usize) -> PivotedQr {
        PivotedQr::new(self.readings.len(), self.unknowns.len(), &self.matrix(order), RANK_TOLERANCE)
    }

    /// Factors any matrix with this layout's readings as rows.
    #[must_use]
    pub fn factor_matrix(&self, columns: usize, matrix: &[Complex64]) -> PivotedQr {
        PivotedQr::new(self.readings.len(), columns, matrix, RANK_TOLERANCE)
    }

    /// What to know of motion where all sensors look along one line.
    #[must_use]
    pub fn one_line_note(&self) -> Option<String> {
        let shifts: Vec<Quantity> = self.unknowns.iter().copied().filter(|unknown| unknown.is_shift()).collect();
        match shifts[..] {
            [Quantity::Along(line)] => Some(format!(
                "all sensors look along one line: motion is observable along {line} from x towards y only, and is given there as \
                 `along`"
            )),
            [axis] => Some(format!("all sensors look along one line: motion is observable along {} only", axis.id())),
            _ => None,
        }
    }
}

/// The line that all sensors look along, where that is neither x nor y; `off_axes` where some look across each of them.
fn one_line<'a>(mut readings: impl Iterator<Item = &'a Reading>, off_axes: bool) -> Option<Azimuth> {
    let first = readings.next().filter(|_| off_axes)?;
    let across = |reading: &Reading| (reading.angle_rad - first.angle_rad).sin().abs();
    readings.all(|reading| across(reading) <= ALONG_AXIS).then(|| Azimuth::of(first.angle_rad))
}

/// cos, with the exact 0 where the angle is a quarter turn: cos(π/2) is 6e-17 in floating point, which would make a
/// lost order look like a very noisy one.
fn exact_cos(angle_rad: f64) -> f64 {
    let cosine = angle_rad.cos();
    if cosine.abs() < 1e-15 { 0.0 } else { cosine }
}

/// What of a number of turns is beyond whole ones.
fn fraction(turns: f64) -> f64 {
    turns - turns.floor()
}
