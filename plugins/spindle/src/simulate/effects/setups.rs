//! Effects of a setup: how the part was clamped, what the spindle did then.

use runout_core::{
    Complex64,
    fault::{Fault, known_names},
};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

use super::{Acts, places, setup_ids};
use crate::simulate::{
    check,
    world::{Clamping, TrueSetup, World},
};

/// True part angle = stated part angle + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct ReversalAngle {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// In degrees.
    pub angle_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for ReversalAngle {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("angle_deg", self.angle_deg)?;
        on_setups(world, &self.targets, |setup| setup.part_rad += self.angle_deg.to_radians())
    }
}

/// True angle of all sensors = stated angle + this.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SensorsAngle {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// In degrees.
    pub angle_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SensorsAngle {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("angle_deg", self.angle_deg)?;
        on_setups(world, &self.targets, |setup| setup.sensors_rad += self.angle_deg.to_radians())
    }
}

/// The mark is on a shaft that turns by another angle: the part turns against it by the same angle every turn.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct TurnRatio {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// By how much each turn is behind the one before, in degrees.
    pub turning_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for TurnRatio {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("turning_deg", self.turning_deg)?;
        on_setups(world, &self.targets, |setup| setup.marks.run_turns += self.turning_deg / 360.0)
    }
}

/// Samples are lost at one turn of a recording whose marks are of another clock: from there on, all readings are those of later angles.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct LostSamples {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// Turns since the first mark after which they are.
    pub after_turns: f64,
    /// How many, in degrees.
    pub angle_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for LostSamples {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("angle_deg", self.angle_deg)?;
        check::positive("after_turns", self.after_turns)?;
        on_setups(world, &self.targets, |setup| setup.lost_turns = Some((self.after_turns, self.angle_deg / 360.0)))
    }
}

/// Synchronous motion × ratio.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct SetupMotionChange {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// 1 leaves the motion as it is.
    pub ratio: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for SetupMotionChange {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("ratio", self.ratio)?;
        on_setups(world, &self.targets, |setup| setup.motion_ratio *= self.ratio)
    }
}

/// Added to the random clamping of the setups named, in the part's own coordinates.
#[derive(Debug, Clone, Default, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct PartEccentricity {
    /// Ids of setups.
    pub targets: Vec<String>,
    /// Id of a section, where only that one is off.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub section: Option<String>,
    /// At the first section of the first station, in µm.
    pub offset_um: f64,
    /// Towards this angle of the part, in degrees.
    #[serde(default)]
    pub direction_deg: f64,
    /// Growth of the offset along z, in µrad.
    #[serde(default)]
    pub tilt_urad: f64,
    /// Towards this angle of the part, in degrees.
    #[serde(default)]
    pub tilt_direction_deg: f64,
    /// Always false: what the separation is to know is declared in the pipeline.
    #[serde(default)]
    pub declared: bool,
}

impl Acts for PartEccentricity {
    fn declared(&self) -> bool {
        self.declared
    }

    fn apply(&self, world: &mut World, _index: usize) -> Result<(), Fault> {
        check::finite("offset_um", self.offset_um)?;
        check::finite("direction_deg", self.direction_deg)?;
        check::finite("tilt_urad", self.tilt_urad)?;
        check::finite("tilt_direction_deg", self.tilt_direction_deg)?;
        let clamping = Clamping {
            offset_um: Complex64::from_polar(self.offset_um, self.direction_deg.to_radians()),
            tilt_urad: Complex64::from_polar(self.tilt_urad, self.tilt_direction_deg.to_radians()),
        };
        let section = match &self.section {
            None => None,
            Some(id) => {
                let known = &world.rig.sections;
                let found = known.iter().position(|section| section == id).ok_or_else(|| {
                    Fault::at("section", format!("the rig has no section `{id}`"))
                        .help(known_names(id, known.iter().map(String::as_str)))
                })?;
                Some(found)
            }
        };
        on_setups(world, &self.targets, |setup| {
            let clampings = setup.clamping.iter_mut().enumerate();
            for (_, of_section) in clampings.filter(|(index, _)| section.is_none_or(|section| section == *index)) {
                of_section.offset_um += clamping.offset_um;
                of_section.tilt_urad += clamping.tilt_urad;
            }
        })
    }
}

pub(super) fn on_setups(world: &mut World, targets: &[String], change: impl Fn(&mut TrueSetup)) -> Result<(), Fault> {
    for index in places("targets", targets, &setup_ids(world), "setup")? {
        change(&mut world.setups[index]);
    }
    Ok(())
}
