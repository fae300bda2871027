//! What no model of a rig foresees: it happens to one sensor, at one place, at one time.

use std::f64::consts::{PI, TAU};

use runout_core::Complex64;

/// Something that changes what a sensor sees, before its electronics.
#[derive(Debug, Clone)]
pub(super) struct Stranger {
    /// In each setup of the rig, whether it happens there.
    pub setups: Vec<bool>,
    pub kind: Kind,
}

#[derive(Debug, Clone, Copy)]
pub(super) enum Kind {
    /// −depth · e^{−½ (Δα / width)²}, Δα from `part_rad` the shorter way round.
    Dent { depth_um: f64, part_rad: f64, width_rad: f64 },
    /// The reading follows only once the surface has moved through the play, half of it to either side.
    Backlash { play_um: f64 },
    /// +step between two angles of the spindle, in turns from its mark; through the mark where `to` is below `from`.
    Step { step_um: f64, from_turn: f64, to_turn: f64 },
    /// The probe has another gain and another place.
    Slip { slip: Slip },
}

/// How a probe sits once it has slipped.
#[derive(Debug, Clone, Copy)]
pub(super) struct Slip {
    /// Turns since the first mark after which it has; none where it had before the capture.
    pub after_turns: Option<f64>,
    pub shift_um: f64,
    pub gain: f64,
    /// e^{i·angle} that it has slipped along the circumference.
    pub turned: Complex64,
}

impl Slip {
    pub(crate) fn has_happened(&self, (whole, rest): (f64, f64)) -> bool {
        self.after_turns.is_none_or(|turns| whole + rest >= turns)
    }
}

/// An unmodelled disturbance in one capture: samples must come in their order.
#[derive(Debug)]
pub(super) struct Acting {
    kind: Kind,
    /// Where the play's middle is, once it is known.
    held_um: Option<f64>,
}

impl Acting {
    /// Those that happen in a setup.
    pub(crate) fn all(strangers: &[Stranger], setup: usize) -> Vec<Self> {
        let here = strangers.iter().filter(|stranger| stranger.setups.get(setup).is_some_and(|here| *here));
        here.map(|stranger| Self { kind: stranger.kind, held_um: None }).collect()
    }

    pub(crate) fn slip(&self) -> Option<Slip> {
        match self.kind {
            Kind::Slip { slip } => Some(slip),
            _ => None,
        }
    }

    /// What is seen instead of `seen_um`, the spindle at `turns` (whole and rest), the part at e^{iα} under the sensor.
    pub(crate) fn act(&mut self, seen_um: f64, turns: (f64, f64), toward: Complex64) -> f64 {
        match self.kind {
            Kind::Dent { depth_um, part_rad, width_rad } => {
                let from_middle = (toward.arg() - part_rad + PI).rem_euclid(TAU) - PI;
                seen_um - depth_um * (-0.5 * (from_middle / width_rad).powi(2)).exp()
            }
            Kind::Backlash { play_um } => {
                let half = 0.5 * play_um;
                let held = self.held_um.map_or(seen_um, |held| held.clamp(seen_um - half, seen_um + half));
                self.held_um = Some(held);
                held
            }
            Kind::Step { step_um, from_turn, to_turn } => {
                let within = (turns.1 - from_turn).rem_euclid(1.0) < (to_turn - from_turn).rem_euclid(1.0);
                if within { seen_um + step_um } else { seen_um }
            }
            Kind::Slip { slip } => {
                if slip.has_happened(turns) {
                    slip.gain * seen_um + slip.shift_um
                } else {
                    seen_um
                }
            }
        }
    }
}
