//! What a reversal along an axis may lack.
//!
//! With the part's deviation p(z), the slide's s(z) and σ = +1 in the initial setup and −1 in the reversed one, a trace
//! reads at the position z of its file
//!
//! u(z) = (1 + g)·[a·p(z + δ) + σ·s(z + δ) + b·q(z) + Σ A·e^{−τ/T}] + offset + slope·z,
//!
//! with the axial shift δ, the relative gain g, q(z) = −(2(z − z₀)/L)² (z₀ the middle and L the length of the range that all
//! traces share), the time τ along the trace (0 at its first reading, 1 at its last) and a = cos ε in the reversed setup.
//! Offset and slope belong to every trace, so that a drift linear in time, and a tilt of the part in the sensitive
//! direction, are taken out of every result.

use runout_core::closed_loop::{Effect, Parameter, Setting};

/// An effect, whatever it acts on.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(crate) enum Kind {
    AxialRegistration,
    SensorGain,
    PartTilt,
    RotationOffset,
    ThermalDrift,
}

/// Every effect.
pub(crate) const KINDS: [Kind; 5] =
    [Kind::AxialRegistration, Kind::SensorGain, Kind::PartTilt, Kind::RotationOffset, Kind::ThermalDrift];

/// Time constant that a drift's search begins at, in lengths of a trace.
pub(crate) const USUAL_TIME_CONSTANT: f64 = 0.3;
/// Time constants that a trace can show: shorter ones end between its first readings, longer ones are parabolas.
const TIME_CONSTANTS: std::ops::RangeInclusive<f64> = 0.02..=3.0;

impl Kind {
    /// Its id.
    pub(crate) fn id(self) -> &'static str {
        match self {
            Self::AxialRegistration => "axial-registration",
            Self::SensorGain => "sensor-gain",
            Self::PartTilt => "part-tilt",
            Self::RotationOffset => "rotation-offset",
            Self::ThermalDrift => "thermal-drift",
        }
    }

    /// What it does, in one line.
    pub(crate) fn about(self) -> &'static str {
        match self {
            Self::AxialRegistration => "a trace along an axis is shifted: its z is too small",
            Self::SensorGain => "a trace's readings are too large by a factor",
            Self::PartTilt => {
                "a cylinder is tilted across the trace under the probe, which leaves its generatrix: a parabola"
            }
            Self::RotationOffset => "the part was not turned by exactly 180° about its axis before the reversed traces",
            Self::ThermalDrift => "readings settle along a trace: exponentially in time",
        }
    }

    /// What it is described by.
    pub(crate) fn parameters(self) -> Vec<Parameter> {
        let of = |name: &str, unit: &str, tolerance| Parameter { name: name.into(), unit: unit.into(), tolerance };
        match self {
            Self::AxialRegistration => vec![of("shift", "mm", 0.1)],
            Self::SensorGain => vec![of("gain", "1", 0.01)],
            Self::PartTilt => vec![of("bow", "um", 0.5)],
            Self::RotationOffset => vec![of("angle", "deg", 1.0)],
            Self::ThermalDrift => vec![of("drift", "um", 0.5), of("time_constant", "trace", USUAL_TIME_CONSTANT)],
        }
    }

    /// The effect at a target.
    pub(crate) fn at(self, target: Option<String>) -> Effect {
        Effect { id: self.id().into(), targets: target.into_iter().collect(), parameters: self.parameters() }
    }
}

/// What is applied to one trace.
#[derive(Debug, Clone, PartialEq, Default)]
pub(crate) struct Alteration {
    pub shift_mm: f64,
    pub gain: f64,
    pub bow_um: f64,
    /// Angle beyond 180°.
    pub turned_deg: f64,
    /// Amplitudes in µm and time constants in lengths of the trace.
    pub drifts: Vec<[f64; 2]>,
}

/// One reading's place.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Place {
    /// σ: whether the slide adds to the part or takes away from it.
    pub sign: f64,
    /// q(z).
    pub parabola: f64,
    /// τ.
    pub time: f64,
}

/// Part and slide at a reading's true place, with their derivatives by z.
#[derive(Debug, Clone, Copy, Default)]
pub(crate) struct Content {
    pub part: [f64; 2],
    pub slide: [f64; 2],
}

impl Alteration {
    /// Adds an effect's values.
    pub(crate) fn add(&mut self, kind: Kind, values: &[f64]) {
        match (kind, values) {
            (Kind::AxialRegistration, [shift]) => self.shift_mm += shift,
            (Kind::SensorGain, [gain]) => self.gain += gain,
            (Kind::PartTilt, [bow]) => self.bow_um += bow,
            (Kind::RotationOffset, [angle]) => self.turned_deg += angle,
            (Kind::ThermalDrift, [drift, time_constant]) => {
                // Known drifts may come without a time constant.
                let constant = if *time_constant == 0.0 { USUAL_TIME_CONSTANT } else { *time_constant };
                self.drifts.push([*drift, constant]);
            }
            _ => {}
        }
    }

    /// What cannot be: a shift beyond `most_mm`, a gain that leaves nothing, a time constant that no trace can show.
    pub(crate) fn beyond(&self, most_mm: f64) -> Option<String> {
        if self.shift_mm.abs() > most_mm {
            return Some(format!("a shift of {} mm is beyond `max_shift_mm` ({most_mm})", self.shift_mm));
        }
        if self.gain.abs() > 0.9 {
            return Some(format!("a gain of {} is none", self.gain));
        }
        if self.turned_deg.abs() > 60.0 {
            return Some(format!("an angle of {}° is no reversal", self.turned_deg));
        }
        let other = self.drifts.iter().find(|[_, constant]| !TIME_CONSTANTS.contains(constant));
        other.map(|[_, constant]| format!("a time constant of {constant} traces is not observable"))
    }

    /// a: the share of the part's deviation that the probe sees.
    pub(crate) fn cosine(&self) -> f64 {
        self.turned_deg.to_radians().cos()
    }

    /// What is added whatever part and slide are, before the gain.
    pub(crate) fn added(&self, place: &Place) -> f64 {
        let drift: f64 = self.drifts.iter().map(|[drift, constant]| drift * (-place.time / constant).exp()).sum();
        self.bow_um * place.parabola + drift
    }

    /// The reading but for the trace's offset and slope.
    #[cfg(test)]
    pub(crate) fn reading(&self, place: &Place, content: &Content) -> f64 {
        (1.0 + self.gain) * self.seen(place, content)
    }

    fn seen(&self, place: &Place, content: &Content) -> f64 {
        self.cosine() * content.part[0] + place.sign * content.slide[0] + self.added(place)
    }

    /// Derivatives of the reading by an effect's parameters, where it is applied at `values`; into `into`.
    pub(crate) fn partials(
        &self,
        kind: Kind,
        values: Option<&[f64]>,
        place: &Place,
        content: &Content,
        into: &mut [f64],
    ) {
        let gain = 1.0 + self.gain;
        match (kind, into) {
            (Kind::AxialRegistration, [shift]) => {
                *shift = gain * (self.cosine() * content.part[1] + place.sign * content.slide[1]);
            }
            (Kind::SensorGain, [by_gain]) => *by_gain = self.seen(place, content),
            (Kind::PartTilt, [bow]) => *bow = gain * place.parabola,
            (Kind::RotationOffset, [angle]) => {
                *angle = -gain * self.turned_deg.to_radians().sin() * content.part[0] * 1.0_f64.to_radians();
            }
            (Kind::ThermalDrift, [by_drift, by_constant]) => {
                let [drift, constant] = drift_of(values);
                let decay = (-place.time / constant).exp();
                *by_drift = gain * decay;
                *by_constant = gain * drift * decay * place.time / (constant * constant);
            }
            _ => {}
        }
    }

    /// A reading without what is applied, but for the shift.
    pub(crate) fn corrected(&self, reading_um: f64, place: &Place) -> f64 {
        reading_um / (1.0 + self.gain) - self.added(place)
    }

    /// Derivatives of a corrected reading by an effect's parameters other than a shift.
    pub(crate) fn corrected_partials(
        &self,
        kind: Kind,
        values: Option<&[f64]>,
        reading_um: f64,
        place: &Place,
    ) -> [f64; 2] {
        match kind {
            Kind::SensorGain => [-reading_um / (1.0 + self.gain).powi(2), 0.0],
            Kind::PartTilt => [-place.parabola, 0.0],
            Kind::ThermalDrift => {
                let [drift, constant] = drift_of(values);
                let decay = (-place.time / constant).exp();
                [-decay, -drift * decay * place.time / (constant * constant)]
            }
            Kind::AxialRegistration | Kind::RotationOffset => [0.0; 2],
        }
    }
}

fn drift_of(values: Option<&[f64]>) -> [f64; 2] {
    match values {
        Some([drift, constant]) if *constant != 0.0 => [*drift, *constant],
        Some([drift, ..]) => [*drift, USUAL_TIME_CONSTANT],
        _ => [0.0, USUAL_TIME_CONSTANT],
    }
}

/// An effect at a target: the traces that it acts on.
#[derive(Debug, Clone, PartialEq)]
pub(crate) struct Candidate {
    pub kind: Kind,
    pub traces: Vec<usize>,
    pub effect: Effect,
}

/// Every effect that these traces may have: of a whole setup, and of one trace where its setup has others. `setups` are the
/// setups' names, `traces` the traces' names and setups. Positions count from the initial setup, and only the reversed
/// one is turned.
pub(crate) fn candidates(setups: [&str; 2], traces: &[(String, usize)]) -> Vec<Candidate> {
    let of_setup = |setup: usize| -> Vec<usize> {
        traces.iter().enumerate().filter(|(_, (_, own))| *own == setup).map(|(index, _)| index).collect()
    };
    let mut all = Vec::new();
    for (setup, name) in setups.into_iter().enumerate() {
        let members = of_setup(setup);
        for kind in KINDS {
            let reversed_only = matches!(kind, Kind::AxialRegistration | Kind::RotationOffset);
            if setup == 1 || !reversed_only {
                all.push(Candidate { kind, traces: members.clone(), effect: kind.at(Some(name.to_owned())) });
            }
            if members.len() > 1 && kind != Kind::RotationOffset {
                all.extend(members.iter().map(|trace| Candidate {
                    kind,
                    traces: vec![*trace],
                    effect: kind.at(Some(traces[*trace].0.clone())),
                }));
            }
        }
    }
    all
}

/// What settings do to each of `count` traces.
pub(crate) fn alterations(candidates: &[Candidate], settings: &[Setting], count: usize) -> Vec<Alteration> {
    let mut all = vec![Alteration::default(); count];
    for setting in settings {
        let Some(candidate) = candidates.get(setting.effect) else { continue };
        for trace in &candidate.traces {
            if let Some(alteration) = all.get_mut(*trace) {
                alteration.add(candidate.kind, &setting.values);
            }
        }
    }
    all
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Part and slide as functions of z.
    fn content(z: f64) -> Content {
        Content {
            part: [(0.7 * z).sin() + 0.1 * z * z, 0.7 * (0.7 * z).cos() + 0.2 * z],
            slide: [(0.3 * z).cos(), -0.3 * (0.3 * z).sin()],
        }
    }

    /// Every partial derivative beside the difference of readings, where nothing is applied and where much is.
    #[test]
    fn partials_are_those_of_the_readings() {
        let much: Vec<(Kind, Vec<f64>)> = vec![
            (Kind::AxialRegistration, vec![0.21]),
            (Kind::SensorGain, vec![-0.07]),
            (Kind::PartTilt, vec![0.8]),
            (Kind::RotationOffset, vec![11.0]),
            (Kind::ThermalDrift, vec![-0.9, 0.17]),
        ];
        let nothing: Vec<(Kind, Vec<f64>)> = vec![(Kind::ThermalDrift, vec![0.0, USUAL_TIME_CONSTANT])];
        for beside in [nothing, much] {
            for kind in KINDS {
                let own = beside.iter().find(|(other, _)| *other == kind);
                let at = own.map_or_else(|| vec![0.0; kind.parameters().len()], |(_, values)| values.clone());
                let altered = |values: &[f64]| {
                    let mut alteration = Alteration::default();
                    beside
                        .iter()
                        .filter(|(other, _)| *other != kind)
                        .for_each(|(other, values)| alteration.add(*other, values));
                    alteration.add(kind, values);
                    alteration
                };
                for (z, sign, time) in [(0.4, 1.0, 0.2), (2.9, -1.0, 0.95), (5.3, -1.0, 0.0)] {
                    let place = Place { sign, parabola: -(z - 3.0_f64).powi(2) / 9.0, time };
                    let reading = |values: &[f64]| {
                        let alteration = altered(values);
                        alteration.reading(&place, &content(z + alteration.shift_mm))
                    };
                    let alteration = altered(&at);
                    let mut partials = vec![f64::NAN; at.len()];
                    let here = content(z + alteration.shift_mm);
                    alteration.partials(kind, Some(&at), &place, &here, &mut partials);
                    for (parameter, partial) in partials.iter().enumerate() {
                        let moved = |step: f64| {
                            let mut values = at.clone();
                            values[parameter] += step;
                            reading(&values)
                        };
                        let difference = (moved(1e-5) - moved(-1e-5)) / 2e-5;
                        // 1e-8: rounding of readings near 5 over 2e-5, and the step's square.
                        assert!(
                            (partial - difference).abs() < 1e-8,
                            "{kind:?} {parameter} at {z}: {partial} {difference}"
                        );
                    }
                }
            }
        }
    }

    #[test]
    fn corrections_undo_what_is_applied() {
        let mut alteration = Alteration::default();
        alteration.add(Kind::SensorGain, &[0.04]);
        alteration.add(Kind::PartTilt, &[0.6]);
        alteration.add(Kind::ThermalDrift, &[0.5, 0.2]);
        let place = Place { sign: -1.0, parabola: -0.4, time: 0.3 };
        let here = content(1.3);
        let bare = here.part[0] - here.slide[0];
        assert!((alteration.corrected(alteration.reading(&place, &here), &place) - bare).abs() < 1e-14);
    }

    #[test]
    fn targets_are_setups_and_repeated_traces() {
        let traces = [("a".to_owned(), 0), ("b".to_owned(), 0), ("c".to_owned(), 1)];
        let all = candidates(["initial", "reversed"], &traces);
        let of = |kind: Kind| -> Vec<&str> {
            all.iter()
                .filter(|one| one.kind == kind)
                .filter_map(|one| one.effect.targets.first().map(String::as_str))
                .collect()
        };
        assert_eq!(of(Kind::AxialRegistration), ["a", "b", "reversed"]);
        assert_eq!(of(Kind::RotationOffset), ["reversed"]);
        assert_eq!(of(Kind::SensorGain), ["initial", "a", "b", "reversed"]);
    }
}
