//! Which effects a rig would show, before anyone measures, and which addition would show more.

use std::sync::Arc;

use runout_core::{
    Result,
    closed_loop::foresight::{self, Foresight, NotVisible},
    rig::Rig,
};

use super::{
    nominal,
    suggest::{Addition, Suggestion},
};
use crate::{
    diagnose::SpindleModel,
    effects::{self, ActsOn, SpindleEffect},
    layout::Layout,
    selection::Selection,
};

/// Angles at which the part is clamped or a sensor stands, in degrees, round ones first.
const TRIED_DEG: [f64; 9] = [90.0, 180.0, 270.0, 45.0, 135.0, 225.0, 60.0, 120.0, 100.0];

/// An addition, and what is observable or distinguished with it and not without it.
#[derive(Debug, Clone, PartialEq)]
pub struct Change {
    /// What to add.
    pub addition: Addition,
    /// The rig with it.
    pub rig: Rig,
    /// Blind effects ("effect target") that would show.
    pub reveals: Vec<String>,
    /// Confounded sets of which every two members would be distinguished.
    pub distinguishes: Vec<Vec<String>>,
}

/// Additions that make effects visible or distinguish them.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Changes {
    /// The cheapest for each blind effect and confounded set: a clamping of the part, then one with the sensors turned
    /// too, then a sensor.
    pub found: Vec<Change>,
    /// Blind effects that stay so with every addition tried.
    pub still_blind: Vec<String>,
    /// Confounded sets that stay so.
    pub still_confounded: Vec<Vec<String>>,
}

/// What the closed loop could find of these effects in the average of a campaign of usual size ([`Foresight::assuming`]).
///
/// # Errors
/// When the model cannot be fitted.
pub fn foresee(
    selection: &Selection,
    layout: &Layout,
    second_order: bool,
    kinds: Vec<Arc<dyn SpindleEffect>>,
) -> Result<Foresight> {
    let station = nominal::station(selection);
    let (mistakes, mut kinds): (Vec<_>, Vec<_>) = kinds.into_iter().partition(|kind| kind.mistake().is_some());
    kinds.retain(|kind| {
        let about = kind.about();
        // What single turns show, they show in any rig, and an average says little of it. Pairs of channels are many and alike. What a setup has by itself shows as
        // what all have does.
        kind.turn_evidence().is_none()
            && !kind.is_one_of_many()
            && kind.first_order_like().is_none()
            && ![ActsOn::Setup, ActsOn::SensorInSetup, ActsOn::SensorCopy].contains(&about.acts_on)
    });
    let model = |kinds| {
        SpindleModel::new(selection.clone(), layout.clone(), second_order, kinds, std::slice::from_ref(&station))
    };
    let foreseen = model(kinds)?;
    let mut foresight = Foresight { assuming: nominal::words(), ..foresight::foresee(&foreseen)? };
    foreseen.check_effects()?;
    let traceless = model(mistakes)?.traceless_mistakes()?;
    foresight
        .blind_to
        .extend(traceless.into_iter().map(|blind| NotVisible { bias: vec![blind.bias_per_unit.clone()], blind }));
    Ok(foresight)
}

/// What the closed loop could find of every effect of this crate with all of a rig and the general separator.
///
/// # Errors
/// When the model cannot be fitted.
pub fn foresee_rig(rig: &Rig) -> Result<Foresight> {
    foresee(&Selection::whole(rig), &Layout::new(rig, false), true, effects::all())
}

/// The cheapest single additions that change what a rig is blind to or confounds; those `known` are tried first.
///
/// # Errors
/// When a model cannot be fitted.
pub fn changes(rig: &Rig, foresight: &Foresight, known: &[Suggestion], clearance_deg: f64) -> Result<Changes> {
    // What has no parameter is a mistake in the rig file, which a closer check of the rig prevents: no addition is needed for it.
    let mistakes: Vec<&str> =
        effects::all().iter().filter_map(|kind| kind.mistake().map(|_| kind.about().id)).collect();
    let is_mistake = |name: &String| name.split(' ').next().is_some_and(|id| mistakes.contains(&id));
    let blind = foresight.blind_names().filter(|name| !is_mistake(name)).collect();
    let mut open = Open { blind, confounded: foresight.confounded.clone() };
    let mut found = Vec::new();
    for class in classes(rig, known) {
        if open.is_empty() {
            break;
        }
        let mut candidates = Vec::new();
        for addition in class {
            if let Some(larger) = addition.to(rig, clearance_deg) {
                let after = foresee_rig(&larger)?;
                candidates.push((addition, larger, after));
            }
        }
        loop {
            let settled = candidates.iter().map(|(.., after)| open.settled_by(after));
            // The first of the best: round angles are tried first.
            let best =
                settled.enumerate().reduce(|best, next| if next.1.count() > best.1.count() { next } else { best });
            let Some((index, settled)) = best.filter(|(_, settled)| !settled.is_empty()) else { break };
            open.blind.retain(|name| !settled.blind.contains(name));
            open.confounded.retain(|set| !settled.confounded.contains(set));
            let (addition, rig, _) = candidates.remove(index);
            found.push(Change { addition, rig, reveals: settled.blind, distinguishes: settled.confounded });
        }
    }
    Ok(Changes { found, still_blind: open.blind, still_confounded: open.confounded })
}

/// What is blind or confounded and not settled.
struct Open {
    blind: Vec<String>,
    confounded: Vec<Vec<String>>,
}

impl Open {
    fn is_empty(&self) -> bool {
        self.blind.is_empty() && self.confounded.is_empty()
    }

    fn count(&self) -> usize {
        self.blind.len() + self.confounded.len()
    }

    /// What of it a rig with this foresight settles.
    fn settled_by(&self, after: &Foresight) -> Self {
        let blind: Vec<String> = after.blind_names().collect();
        let together = |set: &Vec<String>| {
            let shared = |other: &Vec<String>| other.iter().filter(|name| set.contains(name)).count();
            // A member that now looks like what was added is no better off.
            let added = |other: &Vec<String>| other.iter().any(|name| name.ends_with(ADDED));
            after.confounded.iter().any(|other| shared(other) > 1 || (shared(other) == 1 && added(other)))
        };
        Self {
            blind: self.blind.iter().filter(|name| !blind.contains(name)).cloned().collect(),
            confounded: self
                .confounded
                .iter()
                .filter(|set| !together(set) && !set.iter().any(|name| blind.contains(name)))
                .cloned()
                .collect(),
        }
    }
}

/// Ends the name of an effect at what [`Addition::to`] adds.
const ADDED: &str = " added";

/// Candidates, the cheaper ones first.
fn classes(rig: &Rig, known: &[Suggestion]) -> Vec<Vec<Addition>> {
    let setups =
        |sensors_turned| TRIED_DEG.iter().map(move |part_deg| Addition::Setup { part_deg: *part_deg, sensors_turned });
    let sensors = (0..rig.sections.len()).flat_map(|section| {
        std::iter::once(0.0).chain(TRIED_DEG).map(move |angle_deg| Addition::Sensor { section, angle_deg })
    });
    let cost = |addition: &Addition| match addition {
        Addition::Setup { sensors_turned: false, .. } => 0,
        Addition::Setup { sensors_turned: true, .. } => 1,
        Addition::Sensor { .. } => 2,
    };
    let mut classes = vec![Vec::new(); 3];
    let known = known.iter().map(|suggestion| suggestion.addition);
    for addition in known.chain(setups(false)).chain(setups(true)).chain(sensors) {
        let class: &mut Vec<Addition> = &mut classes[cost(&addition)];
        if !class.contains(&addition) {
            class.push(addition);
        }
    }
    classes
}
