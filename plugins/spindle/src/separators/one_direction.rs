//! One sensor a section, all along one direction: what Donaldson reversal and multi-step have in common.

use runout_core::{Complex64, rig::Rig, separation::Quantity};

use super::closed_form::{SectionMotion, add_motion, same_angle, sections_with};
use crate::layout::Layout;

/// One sensor in each of one or two sections, looking along the same direction.
#[derive(Debug, Clone)]
pub(crate) struct OneDirection {
    /// The sensor of each section.
    sensors: Vec<usize>,
    setups: usize,
}

impl OneDirection {
    /// The first sensor of the rig, and one of another section that looks along the same direction.
    pub(crate) fn choose(rig: &Rig) -> Vec<usize> {
        let mut sections = sections_with(rig, 1).into_iter();
        let first = sections.next().and_then(|sensors| sensors.first().copied());
        let along = |sensor: &usize| {
            first.is_some_and(|first| same_angle(rig.sensors[*sensor].angle_rad, rig.sensors[first].angle_rad))
        };
        let second = sections.next().and_then(|sensors| sensors.into_iter().find(along));
        let mut chosen: Vec<usize> = first.into_iter().chain(second).collect();
        chosen.sort_unstable();
        chosen
    }

    /// For a rig of one sensor in each of one or two sections.
    ///
    /// # Errors
    /// When the rig is another one.
    pub(crate) fn new(rig: &Rig) -> Result<Self, String> {
        let sensors: Vec<usize> = (0..rig.sensors.len()).collect();
        let [first, rest @ ..] = &rig.sensors[..] else { return Err("needs a sensor".into()) };
        match rest {
            [second] if second.section == first.section => {
                let message = "needs one sensor a section; `{a}` and `{b}` measure the same one";
                return Err(message.replace("{a}", &first.id).replace("{b}", &second.id));
            }
            [second] if !same_angle(second.angle_rad, first.angle_rad) => {
                return Err(format!(
                    "needs sensors along one direction; `{}` is at {:.4}°, `{}` at {:.4}°",
                    first.id,
                    first.angle_rad.to_degrees(),
                    second.id,
                    second.angle_rad.to_degrees()
                ));
            }
            [second] if (second.z_mm - first.z_mm).abs() <= f64::EPSILON => {
                return Err("needs its sections at different z".into());
            }
            [] | [_] => {}
            _ => return Err(format!("needs one sensor in each of one or two sections; {} are given", sensors.len())),
        }
        Ok(Self { sensors, setups: rig.setups.len() })
    }

    /// The operator from what each section's readings, one a setup, say of form and of motion along the sensor:
    /// `split` gets e^{±in(θ'−β)} of each setup and gives two rows over the setups.
    pub(crate) fn operator(
        &self,
        layout: &Layout,
        order: usize,
        split: impl Fn(&[Complex64]) -> Option<[Vec<Complex64>; 2]>,
    ) -> Option<Vec<Complex64>> {
        let (count, width) = (layout.readings.len(), self.sensors.len());
        let mut operator = vec![Complex64::ZERO; layout.unknowns.len() * count];
        let mut sections = Vec::with_capacity(width);
        for sensor in &self.sensors {
            let reading = |setup: usize| &layout.readings[setup * width + sensor];
            let phases: Vec<Complex64> =
                (0..self.setups).map(|setup| layout.part_phase(reading(setup), order)).collect();
            let [form, motion] = split(&phases)?;
            let wanted = Quantity::Form(reading(0).section);
            let unknown = layout.unknowns.iter().position(|known| *known == wanted)?;
            let mut row = vec![Complex64::ZERO; count];
            for setup in 0..self.setups {
                operator[unknown * count + setup * width + sensor] = form[setup];
                row[setup * width + sensor] = motion[setup];
            }
            sections.push(SectionMotion { lever_mm: reading(0).lever_mm, row });
        }
        let (sine, cosine) = layout.readings.first()?.angle_rad.sin_cos();
        add_motion(&mut operator, layout, [cosine, sine], &sections);
        Some(operator)
    }
}
