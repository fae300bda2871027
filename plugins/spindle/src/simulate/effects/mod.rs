//! What happens besides: each effect changes the simulated world where it would change the real one.
//!
//! Unmodelled disturbances are effects that no model knows.

mod channels;
mod mistakes;
mod profiles;
mod sensors;
mod setups;
mod spindle;
mod strangers;

use runout_core::fault::{Fault, known_names};
use schemars::JsonSchema;
use serde::{Deserialize, Serialize};

pub use channels::{ChannelDelay, ChannelGhost, ChannelSkew, CrossTalk, IndexOffset, SetupGain};
pub use mistakes::{
    PartAngleSign, RotationReversed, SensorSign, SensorsIdentical, SensorsSwapped, SetupRepeated, SetupsSwapped,
};
pub use profiles::{BracketMotion, ChuckForm, ClampingForm, ElectricalRunOut, Lobes, ProbeSpot};
pub use sensors::{
    FilterAttenuation, SensorAngle, SensorAxialPosition, SensorGain, SensorLine, SensorNonlinearity, ThermalDrift,
};
pub use setups::{LostSamples, PartEccentricity, ReversalAngle, SensorsAngle, SetupMotionChange, TurnRatio};
pub use spindle::{AsynchronousLine, AxialMotion, EvenOrderMotion, PartRadius, SecondOrderGeometry, SpeedRipple};
pub use strangers::{Backlash, Dent, SlippedProbe, Step};

use super::world::World;

/// `[[effect]]`: one entry, named by `plugin`. `declared = false` says that the separation does not declare it; true is refused.
#[derive(Debug, Clone, PartialEq, Deserialize, Serialize, JsonSchema)]
#[serde(tag = "plugin", rename_all = "kebab-case")]
pub enum Effect {
    /// Readings are too large or too small by a factor.
    SensorGain(SensorGain),
    /// The sensor is at another angle.
    SensorAngle(SensorAngle),
    /// The sensor sits at another z: another lever arm on tilt, and another circle of the part.
    SensorAxialPosition(SensorAxialPosition),
    /// Readings gain a part in u² and u³.
    SensorNonlinearity(SensorNonlinearity),
    /// The part was clamped at another angle.
    ReversalAngle(ReversalAngle),
    /// All sensors are at another angle in a setup.
    SensorsAngle(SensorsAngle),
    /// The part was clamped further off, at a known place.
    PartEccentricity(PartEccentricity),
    /// Says that readings follow the exact geometry, which they do unless `geometry = "linear"`.
    SecondOrderGeometry(SecondOrderGeometry),
    /// The part has another radius than stated.
    PartRadius(PartRadius),
    /// The synchronous motion is larger or smaller in a setup.
    SetupMotionChange(SetupMotionChange),
    /// Random synchronous motion of even orders in addition.
    EvenOrderMotion(EvenOrderMotion),
    /// A line in channels that is no motion: electrical pick-up.
    SensorLine(SensorLine),
    /// The reading drifts from the start of each capture, along a straight line or ever slower.
    ThermalDrift(ThermalDrift),
    /// Motion to and fro at an order that is not whole.
    AsynchronousLine(AsynchronousLine),
    /// The spindle runs unevenly within the turn.
    SpeedRipple(SpeedRipple),
    /// The part moves along z, so that sensors see it elsewhere.
    AxialMotion(AxialMotion),
    /// A low-pass in one channel.
    FilterAttenuation(FilterAttenuation),
    /// A channel records what it saw a while ago.
    ChannelDelay(ChannelDelay),
    /// Each channel records later than the one before it.
    ChannelSkew(ChannelSkew),
    /// A share of one channel's reading is in that of another.
    CrossTalk(CrossTalk),
    /// Every reading has a share of that of the channel before it.
    ChannelGhost(ChannelGhost),
    /// All readings of a setup are too large or too small by a factor.
    SetupGain(SetupGain),
    /// The mark of a setup comes at another angle of the spindle.
    IndexOffset(IndexOffset),
    /// The mark of a setup is on a shaft that turns by another angle.
    TurnRatio(TurnRatio),
    /// Samples are lost at one turn of a setup's recording.
    LostSamples(LostSamples),
    /// A sensor averages the form over an arc.
    ProbeSpot(ProbeSpot),
    /// A sensor's bracket moves by a share of the spindle's motion.
    BracketMotion(BracketMotion),
    /// A form turns with the spindle and not with the part.
    ChuckForm(ChuckForm),
    /// The part has another form as it is clamped in a setup.
    ClampingForm(ClampingForm),
    /// A sensor reads a pattern of the part's material that is no form.
    ElectricalRunOut(ElectricalRunOut),
    /// A mistake in the rig: readings have the opposite sign.
    SensorSign(SensorSign),
    /// A mistake in the rig: two channels are swapped.
    SensorsSwapped(SensorsSwapped),
    /// A mistake in the recording: a channel has the signal of another.
    SensorsIdentical(SensorsIdentical),
    /// A mistake in the rig: two setups are swapped.
    SetupsSwapped(SetupsSwapped),
    /// A mistake in the recording: a setup was recorded as another.
    SetupRepeated(SetupRepeated),
    /// A mistake in the rig: the part turns the other way.
    RotationReversed(RotationReversed),
    /// A mistake in the rig: the part's angles count the other way.
    PartAngleSign(PartAngleSign),
    /// No effect of the closed loop: a local dent that not every sensor reads, or not in every setup.
    Dent(Dent),
    /// No effect of the closed loop: play in one channel.
    Backlash(Backlash),
    /// No effect of the closed loop: a reading steps over part of the turn.
    Step(Step),
    /// No effect of the closed loop: from some turn on a probe is elsewhere.
    SlippedProbe(SlippedProbe),
}

/// What every effect can do.
trait Acts {
    /// Whether the scenario says that the separation declares it.
    fn declared(&self) -> bool;

    /// Changes the world; `index` is the effect's place in the list.
    fn apply(&self, world: &mut World, index: usize) -> Result<(), Fault>;
}

impl Effect {
    /// Changes the world; `index` is the effect's place in the list.
    pub(super) fn apply(&self, world: &mut World, index: usize) -> Result<(), Fault> {
        if self.acts().declared() {
            let fault =
                Fault::at("declared", "expected false: a scenario does not declare its effects to the separation");
            return Err(fault.help("leave it out; what the separation is to know is declared in the pipeline, in its rig or as `[diagnose] known`"));
        }
        self.acts().apply(world, index)
    }

    fn acts(&self) -> &dyn Acts {
        match self {
            Self::SensorGain(effect) => effect,
            Self::SensorAngle(effect) => effect,
            Self::SensorAxialPosition(effect) => effect,
            Self::SensorNonlinearity(effect) => effect,
            Self::ReversalAngle(effect) => effect,
            Self::SensorsAngle(effect) => effect,
            Self::SensorSign(effect) => effect,
            Self::SensorsSwapped(effect) => effect,
            Self::SensorsIdentical(effect) => effect,
            Self::SetupsSwapped(effect) => effect,
            Self::SetupRepeated(effect) => effect,
            Self::RotationReversed(effect) => effect,
            Self::PartAngleSign(effect) => effect,
            Self::PartEccentricity(effect) => effect,
            Self::SecondOrderGeometry(effect) => effect,
            Self::PartRadius(effect) => effect,
            Self::SetupMotionChange(effect) => effect,
            Self::EvenOrderMotion(effect) => effect,
            Self::SensorLine(effect) => effect,
            Self::ThermalDrift(effect) => effect,
            Self::AsynchronousLine(effect) => effect,
            Self::SpeedRipple(effect) => effect,
            Self::AxialMotion(effect) => effect,
            Self::FilterAttenuation(effect) => effect,
            Self::ChannelDelay(effect) => effect,
            Self::ChannelSkew(effect) => effect,
            Self::CrossTalk(effect) => effect,
            Self::ChannelGhost(effect) => effect,
            Self::SetupGain(effect) => effect,
            Self::IndexOffset(effect) => effect,
            Self::TurnRatio(effect) => effect,
            Self::LostSamples(effect) => effect,
            Self::ProbeSpot(effect) => effect,
            Self::BracketMotion(effect) => effect,
            Self::ChuckForm(effect) => effect,
            Self::ClampingForm(effect) => effect,
            Self::ElectricalRunOut(effect) => effect,
            Self::Dent(effect) => effect,
            Self::Backlash(effect) => effect,
            Self::Step(effect) => effect,
            Self::SlippedProbe(effect) => effect,
        }
    }
}

fn sensor_ids(world: &World) -> Vec<&str> {
    world.rig.sensors.iter().map(|sensor| sensor.id.as_str()).collect()
}

fn setup_ids(world: &World) -> Vec<&str> {
    world.rig.setups.iter().map(|setup| setup.id.as_str()).collect()
}

/// Indices of the setups that are named.
fn named_setups(world: &World, named: &[String]) -> Result<Vec<usize>, Fault> {
    if named.is_empty() { Ok(Vec::new()) } else { places("setups", named, &setup_ids(world), "setup") }
}

/// Indices of the ids under a key among the known ones.
fn places(key: &str, ids: &[String], known: &[&str], noun: &str) -> Result<Vec<usize>, Fault> {
    if ids.is_empty() {
        return Err(Fault::at(key, format!("name at least one {noun}")).help(known_names("", known.iter().copied())));
    }
    let place = |id: &String| known.iter().position(|other| other == id).ok_or_else(|| unknown(key, noun, id, known));
    ids.iter().map(place).collect()
}

fn unknown(key: &str, noun: &str, id: &str, known: &[&str]) -> Fault {
    Fault::at(key, format!("the rig has no {noun} `{id}`")).help(known_names(id, known.iter().copied()))
}
