//! The sensors and setups of a rig that a method uses: a rig may hold more than one method needs.

use runout_core::{
    fault::{Fault, known_names},
    rig::Rig,
    separation::Assessment,
};

/// A part of a rig.
#[derive(Debug, Clone)]
pub struct Selection {
    /// The rig with the chosen sensors and setups only. Sections keep their indices.
    pub rig: Rig,
    /// Index of each chosen sensor in the whole rig.
    pub sensors: Vec<usize>,
    /// Index of each chosen setup in the whole rig.
    pub setups: Vec<usize>,
    /// Ids of the sensors and setups that are not used.
    pub unused: Vec<String>,
}

impl Selection {
    /// The sensors and setups at these indices of a rig.
    #[must_use]
    pub fn new(rig: &Rig, sensors: Vec<usize>, setups: Vec<usize>) -> Self {
        let mut chosen = rig.clone();
        chosen.sensors = sensors.iter().map(|index| rig.sensors[*index].clone()).collect();
        chosen.setups = setups.iter().map(|index| rig.setups[*index].clone()).collect();
        let rest = |all: usize, used: &[usize]| (0..all).filter(|index| !used.contains(index)).collect::<Vec<_>>();
        let unused = (rest(rig.sensors.len(), &sensors).into_iter())
            .map(|index| rig.sensors[index].id.clone())
            .chain(rest(rig.setups.len(), &setups).into_iter().map(|index| rig.setups[index].id.clone()))
            .collect();
        Self { rig: chosen, sensors, setups, unused }
    }

    /// Notes in an assessment what is not used.
    pub fn note_unused(&self, assessment: &mut Assessment) {
        if !self.unused.is_empty() {
            assessment.notes.push(format!("not used: {}", self.unused.join(", ")));
        }
        assessment.unused.clone_from(&self.unused);
    }

    /// The whole rig.
    #[must_use]
    pub fn whole(rig: &Rig) -> Self {
        Self::new(rig, (0..rig.sensors.len()).collect(), (0..rig.setups.len()).collect())
    }

    /// The sensors and setups of these ids, in the rig's order; `default` where none are named.
    ///
    /// # Errors
    /// When the rig has no sensor or setup of an id, or a list is empty.
    pub fn named(
        rig: &Rig,
        sensors: Option<&[String]>,
        setups: Option<&[String]>,
        default: impl FnOnce(&Rig) -> (Vec<usize>, Vec<usize>),
    ) -> Result<Self, Fault> {
        let sensors = indices("sensors", sensors, rig.sensors.iter().map(|sensor| sensor.id.as_str()))?;
        let setups = indices("setups", setups, rig.setups.iter().map(|setup| setup.id.as_str()))?;
        // What the configuration names narrows the rig before the method chooses from it.
        let narrowed = Self::new(
            rig,
            sensors.clone().unwrap_or_else(|| (0..rig.sensors.len()).collect()),
            setups.clone().unwrap_or_else(|| (0..rig.setups.len()).collect()),
        );
        let (by_method, turned) = default(&narrowed.rig);
        let back = |chosen: Vec<usize>, known: &[usize]| chosen.into_iter().map(|index| known[index]).collect();
        let sensors = sensors.unwrap_or_else(|| back(by_method, &narrowed.sensors));
        let setups = setups.unwrap_or_else(|| back(turned, &narrowed.setups));
        Ok(Self::new(rig, sensors, setups))
    }
}

fn indices<'a>(
    key: &str,
    wanted: Option<&[String]>,
    ids: impl Iterator<Item = &'a str> + Clone,
) -> Result<Option<Vec<usize>>, Fault> {
    let Some(wanted) = wanted else { return Ok(None) };
    if wanted.is_empty() {
        return Err(Fault::at(key, format!("name at least one of the rig's {key}, or leave the key out")));
    }
    if let Some(unknown) = wanted.iter().find(|id| !ids.clone().any(|known| known == id.as_str())) {
        let fault = Fault::at(key, format!("the rig has no `{unknown}` among its {key}"));
        return Err(fault.help(known_names(unknown, ids)));
    }
    let chosen = ids.enumerate().filter(|(_, id)| wanted.iter().any(|name| name == id));
    Ok(Some(chosen.map(|(index, _)| index).collect()))
}
