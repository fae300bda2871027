//! What the loop says of a campaign, beside what was planted.

use runout_core::{
    Complex64, Error, Result,
    closed_loop::{
        Settings,
        diagnosis::{Added, Diagnosis, Verdict},
    },
    measurement::StationTruth,
    numerics::fourier::Fourier,
    pipeline::put_right,
    separation::{Quantity, Separation},
    stage::StationDiagnosis,
};
use runout_spindle::{
    diagnose::diagnose,
    effects, layout,
    selection::Selection,
    separators::{HarmonicLeastSquares, Weighting},
    simulate::{Effect, SpindleConfig, simulator},
};

use super::draw::{Campaign, Kind, Layout, Planted};
use crate::campaign;

/// χ² per degree of freedom of the declared model from which something is there to be found.
pub const VISIBLE_CHI2: f64 = 1.5;
/// Share of the turns, at the end, that no fit sees.
const HOLD_OUT: f64 = 0.25;
/// Orders over which forms are compared.
const BAND: std::ops::RangeInclusive<usize> = 2..=80;

/// A campaign with its diagnosis.
#[derive(Debug, Clone)]
pub struct Judged {
    /// The campaign.
    pub campaign: Campaign,
    /// What the loop says.
    pub diagnosis: Diagnosis,
    /// Of each effect planted, in their order.
    pub effects: Vec<Traced>,
    /// What was named and is not there.
    pub false_alarms: Vec<String>,
    /// Errors of the form.
    pub form: FormErrors,
    /// The largest error of a motion (x, y, a tilt) over what is stated of it, root mean squares over the angles.
    pub motion_ratio: f64,
}

/// What became of a planted effect.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Traced {
    /// Whether it raises the residual of the declared model by itself.
    pub visible: bool,
    /// Whether it was named: itself, or a set that holds it.
    pub named: bool,
    /// Whether it was named alone.
    pub alone: bool,
    /// Parameters within two standard uncertainties, and all that were compared: of effects named alone.
    pub parameters: [usize; 2],
}

/// Root mean square errors of form over orders 2 to 80, as far as they are observable, in µm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FormErrors {
    /// Of the same campaign with nothing wrong.
    pub sound: f64,
    /// Of the declared model.
    pub before: f64,
    /// Of the final one.
    pub after: f64,
    /// What the final one states.
    pub stated: f64,
}

/// The loop on a simulated campaign: the one place that knows how it is called.
fn run(config: &SpindleConfig, campaign: &Campaign, effects: Option<Vec<String>>) -> Result<Run> {
    let rig = config.rig.clone().check().map_err(|fault| Error::caused("check", "the rig", fault))?;
    let simulator = simulator(config).map_err(|fault| Error::caused("check", "the scenario", fault))?;
    let recording = &config.recording;
    let size = [recording.samples_per_rev, recording.revolutions];
    let (station, truth) = campaign::station_holding_out(&simulator, &rig, 0, size, Some(HOLD_OUT))?;
    let layout = layout::Layout::new(&rig, campaign.rig == Layout::Paper);
    let settings = Settings { effects, ..Settings::default() };
    let mut stations = [station];
    let separator = HarmonicLeastSquares::new(&rig, campaign.second_order, Weighting::TurnCovariance);
    let put_right = put_right::put_right(&mut stations, &settings, &rig, &separator)?;
    let mut said =
        diagnose(Selection::whole(&rig), layout, campaign.second_order, effects::all(), &stations, &settings)?;
    put_right.say(&mut said);
    Ok(Run { said, truth })
}

struct Run {
    said: StationDiagnosis,
    truth: StationTruth,
}

/// Diagnoses a campaign and compares.
///
/// # Errors
/// When the simulation or the loop fails.
pub fn judge(campaign: Campaign) -> Result<Judged> {
    let Run { said, truth } = run(&campaign.config, &campaign, None)?;
    let sound = match campaign.kind {
        Kind::Clean => None,
        _ => Some(run(&campaign.sound, &campaign, Some(Vec::new()))?),
    };
    let alone = |planted: usize| -> Result<bool> {
        let effect = campaign.config.effect.get(planted).cloned();
        let config = SpindleConfig { effect: effect.into_iter().collect(), ..campaign.config.clone() };
        Ok(visible(&run(&config, &campaign, Some(Vec::new()))?.said.diagnosis))
    };
    let mut effects = Vec::new();
    for (index, planted) in campaign.planted.iter().enumerate() {
        let shows = match (campaign.kind, campaign.config.effect.get(index)) {
            // A line is not in the averaged turns: it shows where it stands out of other asynchronous motion.
            (_, Some(Effect::AsynchronousLine(line))) => {
                line.amplitude_um > campaign.config.asynchronous.rms_um.unwrap_or_default()
            }
            // It shows in one of the channels.
            (_, Some(Effect::SensorLine(line))) => {
                let channels = campaign.config.rig.sensors.len() as f64;
                line.amplitude_um > channels.sqrt() * campaign.config.asynchronous.rms_um.unwrap_or_default()
            }
            (Kind::Pair, _) => alone(index)?,
            _ => visible(&said.diagnosis),
        };
        let found = said.diagnosis.added.iter().find(|added| holds(added, planted));
        let alone = found.filter(|added| added.confounded_with.is_empty());
        effects.push(Traced {
            visible: shows,
            named: found.is_some(),
            alone: alone.is_some(),
            parameters: alone.map_or([0; 2], |added| within(added, planted)),
        });
    }
    let there = |added: &&Added| !campaign.planted.iter().any(|planted| holds(added, planted));
    let false_alarms = said.diagnosis.added.iter().filter(there).map(name).collect();
    let form = form_errors(&said, &sound.as_ref().map_or(&said, |run| &run.said).after, &truth);
    let motion_ratio = motion_ratio(&said, &truth);
    Ok(Judged { campaign, diagnosis: said.diagnosis, effects, false_alarms, form, motion_ratio })
}

/// Whether the declared model leaves more than noise; without a measure of noise, whatever is planted should show.
fn visible(diagnosis: &Diagnosis) -> bool {
    diagnosis.before.chi2_per_dof.is_none_or(|chi2| chi2 > VISIBLE_CHI2)
}

/// Effect and target as in `confounded_with`.
fn name(added: &Added) -> String {
    std::iter::once(&added.effect).chain(&added.targets).cloned().collect::<Vec<_>>().join(" ")
}

/// Whether what was named is, or could as well be, what was planted.
fn holds(added: &Added, planted: &Planted) -> bool {
    let wanted = match &planted.target {
        Some(target) => format!("{} {target}", planted.id),
        None => planted.id.to_owned(),
    };
    let found_order = added.parameters.iter().find(|one| one.name == "order").map(|one| one.value);
    let true_order = planted.parameters.iter().find(|(name, _)| *name == "order").map(|(_, order)| *order);
    // Of effects with an order, another order is another effect.
    let same_order = found_order.zip(true_order).is_none_or(|(found, order)| (found - order).abs() < 0.1);
    let also = planted.is_also.iter().any(|other| name(added) == *other || added.confounded_with.contains(other));
    (name(added) == wanted && same_order) || added.confounded_with.contains(&wanted) || also
}

/// Parameters within two standard uncertainties of the truth, of those that can be compared.
fn within(added: &Added, planted: &Planted) -> [usize; 2] {
    let mut counts = [0; 2];
    if added.effect != planted.id {
        return counts;
    }
    for (name, truth) in &planted.parameters {
        let Some(found) = added.parameters.iter().find(|one| one.name == *name) else { continue };
        let Some(std) = found.std.filter(|std| *std > 0.0) else { continue };
        counts[0] += usize::from((found.value - truth).abs() <= 2.0 * std);
        counts[1] += 1;
    }
    counts
}

fn form_errors(said: &StationDiagnosis, sound: &[Separation], truth: &StationTruth) -> FormErrors {
    let all = [sound, &said.before, &said.after].map(|separations| separations.first());
    let [Some(sound), Some(before), Some(after)] = all else {
        return FormErrors { sound: f64::NAN, before: f64::NAN, after: f64::NAN, stated: f64::NAN };
    };
    let mut squares = [0.0; 4];
    for (section, curve) in truth.form_um.iter().enumerate() {
        let mut fourier = Fourier::new(curve.len());
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(curve.iter().copied(), &mut harmonics);
        for order in BAND {
            let index = |one: &Separation| {
                let unknown = one.position(Quantity::Form(section))?;
                let index = order * one.unknowns.len() + unknown;
                one.observable.get(index).is_some_and(|observable| *observable).then_some(index)
            };
            // Orders that are not observable in one of them are no errors.
            let (Some(a), Some(b), Some(c)) = (index(sound), index(before), index(after)) else { continue };
            let found = [sound.estimate[a], before.estimate[b], after.estimate[c]];
            let errors = found.map(|value| (value - harmonics.get(order).copied().unwrap_or_default()).norm_sqr());
            let variance = after.variance_of(c);
            for (sum, square) in squares.iter_mut().zip(errors.into_iter().chain([variance])) {
                *sum += 0.5 * square / truth.form_um.len() as f64;
            }
        }
    }
    let [sound, before, after, stated] = squares.map(f64::sqrt);
    FormErrors { sound, before, after, stated }
}

/// The largest error over stated uncertainty of x, y and the tilts; NaN where no truth is known.
fn motion_ratio(said: &StationDiagnosis, truth: &StationTruth) -> f64 {
    let (Some(after), Some(curves)) = (said.after.first(), &truth.motion) else { return f64::NAN };
    let width = after.unknowns.len();
    let quantities = [Quantity::X, Quantity::Y, Quantity::TiltX, Quantity::TiltY];
    let ratios = quantities.iter().zip(curves).filter_map(|(quantity, curve)| {
        let unknown = after.position(*quantity)?;
        let mut fourier = Fourier::new(curve.len());
        let mut harmonics = vec![Complex64::ZERO; fourier.max_order() + 1];
        fourier.analyse(curve.iter().copied(), &mut harmonics);
        let (mut error, mut stated) = (0.0, 0.0);
        for order in BAND {
            let index = order * width + unknown;
            if after.observable.get(index).is_some_and(|observable| *observable) {
                let truth = harmonics.get(order).copied().unwrap_or_default().conj();
                error += (after.estimate[index] - truth).norm_sqr();
                stated += after.variance_of(index);
            }
        }
        (stated > 0.0).then(|| (error / stated).sqrt())
    });
    ratios.fold(f64::NAN, f64::max)
}

impl Judged {
    /// Whether the data do not decide between effects.
    #[must_use]
    pub fn is_confounded(&self) -> bool {
        self.diagnosis.added.iter().any(|added| !added.confounded_with.is_empty())
    }

    /// What is not as it should be, in words; nothing where all is well.
    #[must_use]
    pub fn failures(&self) -> Vec<String> {
        let mut failures = Vec::new();
        for (planted, traced) in self.campaign.planted.iter().zip(&self.effects) {
            if self.campaign.kind != Kind::Stranger && traced.visible && !traced.named {
                failures.push(format!("{} missed", planted.id));
            }
        }
        let alarm = if self.campaign.kind == Kind::Stranger { "effect added" } else { "false alarm" };
        failures.extend(self.false_alarms.iter().map(|name| format!("{alarm}: {name}")));
        let [farther, stated] = [self.form.sound, self.form.stated].map(|other| self.form.after / other);
        if self.is_distinguishable() && self.effects.iter().any(|traced| traced.visible) && farther > 1.5 {
            failures.push(format!("form {farther:.1} times as far off as the sound one"));
        }
        let seen = self.campaign.kind != Kind::Stranger && self.effects.iter().all(|traced| traced.visible);
        if seen && stated > 2.0 {
            failures.push(format!("form {stated:.1} times as far off as is stated"));
        }
        let left = self.diagnosis.verdict == Verdict::Unexplained;
        if self.diagnosis.before.chi2_per_dof.is_none() {
            failures.push("the noise is not known".into());
        }
        match self.campaign.kind {
            Kind::Stranger if !left && self.effects.iter().any(|traced| traced.visible && !traced.named) => {
                failures.push("not reported as unexplained".into());
            }
            Kind::Stranger => {}
            _ if left => failures.push("something reported as unexplained".into()),
            _ => {}
        }
        failures
    }

    /// Whether the loop knows what was planted and the layout distinguishes it from all else: between members of a set form may be half-way.
    fn is_distinguishable(&self) -> bool {
        let is_known = matches!(self.campaign.kind, Kind::Single | Kind::Pair);
        self.campaign.rig == Layout::Six && is_known && !self.is_confounded()
    }

    /// What was planted, in words.
    #[must_use]
    pub fn planted(&self) -> String {
        let words = self.campaign.planted.iter().map(|planted| {
            let target = planted.target.as_ref().map(|target| format!(" {target}")).unwrap_or_default();
            format!("{}{target} {}", planted.id, planted.size)
        });
        words.collect::<Vec<_>>().join(" and ")
    }

    /// What was said, in words.
    #[must_use]
    pub fn said(&self) -> String {
        let added = self.diagnosis.added.iter().map(|added| {
            let values: Vec<String> = added
                .parameters
                .iter()
                .map(|one| {
                    let std = one.std.map(|std| format!(" ± {std:.1e}")).unwrap_or_default();
                    format!("{} {:.3e}{std}", one.name, one.value)
                })
                .collect();
            let set = match added.confounded_with.len() {
                0 => String::new(),
                others => format!(" or {others} others"),
            };
            format!("{}{set} ({})", name(added), values.join(", "))
        });
        let mut words: Vec<String> = added.collect();
        let refused = self.diagnosis.refused.iter();
        words.extend(refused.map(|one| format!("refused {} {}: {}", one.effect, one.targets.join(" "), one.reason)));
        if words.is_empty() { "nothing added".into() } else { words.join("; ") }
    }
}
