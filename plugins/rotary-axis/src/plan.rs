//! What is observable with balls before they are measured, and which one more helps most.
//!
//! Noise gains are the standard uncertainties of the full fit at the nominal places, for 1 µm in every coordinate of every row.

use std::collections::BTreeMap;

use nalgebra::Vector3;
use runout_core::{
    Error, Result,
    closed_loop::foresight::{Foresight, foresee},
    points::Points,
    stage::{LayoutScore, NoiseGain, PointAddition, PointPlan, PointSeparator},
};

use crate::{
    campaign::Campaign,
    config::RotaryAxis,
    noise::Noise,
    separate::machine_order,
    solve::{Layout, Reading, fit},
};

/// Commands of the full turn that are taken for granted without data.
const COMMANDS: usize = 36;
/// Commands by which added balls are ranked: noise gains of any number of commands rank them alike.
const RANKING: usize = 12;
/// Added balls are tried at these angles.
const ANGLES: usize = 12;
/// Balls nearer than this share of the largest radius have no room.
const ROOM: f64 = 0.25;
/// 1 µm, in mm.
const NOISE_MM: f64 = 1e-3;

/// Noise gains: location errors, and the worst of each component error over the commands.
struct Gains {
    location: [f64; 4],
    component: Option<[f64; 6]>,
}

impl RotaryAxis {
    /// Plans the balls at the commands of points, or around the turn.
    pub(crate) fn planned(&self, points: Option<&Points>) -> Result<PointPlan> {
        let failure = |problem: String| Error::new("plan", "the balls", problem);
        let campaign = match points {
            Some(points) => as_measured(Campaign::of(&self.0, points)?),
            None => self.around_the_turn(),
        };
        let whole = self.gains(&campaign.layout, &campaign.readings).map_err(failure)?;
        let foresight = self.foreseen(&campaign);
        let mut plan = PointPlan {
            noise_gain: self.named(&whole),
            score: self.score(&whole),
            notes: self.notes(),
            ..PointPlan::default()
        };
        for (place, height) in self.best_balls(&campaign.layout)? {
            let with = with_ball(&campaign, place);
            let gains = self.gains(&with.layout, &with.readings).map_err(failure)?;
            let addition = self.addition(place, height, &gains);
            plan.suggestions.push(addition.changing(&foresight, &self.foreseen(&with)));
        }
        plan.suggestions.sort_by(|a, b| a.after.compare(&b.after));
        plan.notes.push(format!(
            "noise gains of component errors are the worst over the commands; scores count angles at {:.0} mm from the axis, and an \
             added ball is measured once at each command",
            self.reach()
        ));
        let rows = campaign.readings.len();
        plan.foresight = Foresight {
            assuming: match points {
                Some(_) => format!("the {rows} rows of the data, 1 µm in every coordinate of each"),
                None => format!(
                    "{COMMANDS} commands around the turn, each ball once at each, one ball after the other, 1 µm in every coordinate"
                ),
            },
            ..foresight
        };
        Ok(plan)
    }

    fn around_the_turn(&self) -> Campaign {
        let balls = self.0.balls.len();
        let layout = Layout {
            balls: (0..balls).map(|ball| self.0.ball(ball)).collect(),
            phi: turn_of(COMMANDS),
            component_errors: self.0.component_errors,
        };
        let readings: Vec<Reading> =
            (0..balls).flat_map(|ball| (0..COMMANDS).map(move |command| reading(ball, command))).collect();
        let count = readings.len();
        Campaign {
            commands_deg: layout.phi.iter().map(|phi| phi.to_degrees()).collect(),
            balls: self.0.balls.iter().map(|ball| ball.id.clone()).collect(),
            time: (0..count).map(|row| row as f64 / (count - 1) as f64).collect(),
            direction: vec![1.0; count],
            turn: vec![0; count],
            pass: vec![0; count],
            duration_s: f64::NAN,
            noise: Noise::Stated(1e3 * NOISE_MM),
            warnings: Vec::new(),
            layout,
            readings,
        }
    }

    fn gains(&self, layout: &Layout, readings: &[Reading]) -> std::result::Result<Gains, String> {
        let found = fit(layout, readings, &[])?;
        let mut component = [0.0_f64; 6];
        for command in 0..layout.phi.len() {
            let at = machine_order(self.0.axis, found.component(command));
            for (index, (worst, one)) in component.iter_mut().zip(at).enumerate() {
                let std = if index < 3 { 1e3 } else { 1e6 } * one.std;
                // Once lost, it stays so.
                *worst = if worst.is_nan() || std.is_nan() { f64::NAN } else { worst.max(std) };
            }
        }
        let scale = |index: usize| if index < 2 { 1e3 } else { 1e6 };
        let location = found.location();
        Ok(Gains {
            location: [0, 1, 2, 3].map(|index| scale(index) * location[index].std),
            component: layout.component_errors.then_some(component),
        })
    }

    /// Distance from the axis at which angles count as lengths, mm: that of the ball farthest out.
    fn reach(&self) -> f64 {
        let radius = |ball: usize| {
            let place = self.0.ball(ball);
            place.x.hypot(place.y)
        };
        let farthest = (0..self.0.balls.len()).map(radius).fold(0.0, f64::max);
        let lever = (0..self.0.balls.len()).map(|ball| self.0.ball(ball).norm()).fold(0.0, f64::max);
        // Balls on the axis have no radius.
        if farthest > 0.05 * lever { farthest } else { lever.max(1.0) }
    }

    fn named(&self, gains: &Gains) -> BTreeMap<String, Vec<NoiseGain>> {
        let of = |symbols: &[String], values: &[f64], lengths: usize| {
            let all = symbols.iter().zip(values).enumerate();
            all.map(|(index, (symbol, gain))| NoiseGain::of(symbol, *gain, if index < lengths { "um" } else { "urad" }))
                .collect()
        };
        let mut named = BTreeMap::new();
        named.insert("location".to_owned(), of(&self.0.axis.location_symbols(), &gains.location, 2));
        if let Some(component) = &gains.component {
            named.insert("component".to_owned(), of(&self.0.axis.component_symbols(), component, 3));
        }
        named
    }

    fn score(&self, gains: &Gains) -> LayoutScore {
        // µrad at a reach in mm, in µm.
        let arm = 1e-3 * self.reach();
        let sized = |symbols: &[String], values: &[f64], lengths: usize| -> Vec<(String, f64)> {
            let all = symbols.iter().zip(values).enumerate();
            all.map(|(index, (symbol, gain))| (symbol.clone(), gain * if index < lengths { 1.0 } else { arm }))
                .collect()
        };
        let mut all = sized(&self.0.axis.location_symbols(), &gains.location, 2);
        if let Some(component) = &gains.component {
            all.extend(sized(&self.0.axis.component_symbols(), component, 3));
        }
        LayoutScore::of(&all)
    }

    /// The best place for one more ball at each of some heights, about an axis along z; with its height in words.
    fn best_balls(&self, layout: &Layout) -> Result<Vec<(Vector3<f64>, &'static str)>> {
        let radius = self.reach();
        let heights = layout.balls.iter().map(|ball| ball.z);
        let lowest = heights.clone().fold(f64::INFINITY, f64::min);
        let highest = heights.fold(f64::NEG_INFINITY, f64::max);
        let mut tried = vec![(lowest, "at the height of the lowest ball")];
        if highest - lowest > ROOM * radius {
            tried.push((highest, "at the height of the highest ball"));
        }
        tried.push((highest + 0.5 * radius, "half the largest radius above the highest ball"));
        let phi = turn_of(RANKING);
        let mut best = Vec::new();
        for (z, words) in tried {
            let mut found: Option<(LayoutScore, Vector3<f64>)> = None;
            for index in 0..ANGLES {
                let (sine, cosine) = (std::f64::consts::TAU * index as f64 / ANGLES as f64).sin_cos();
                let place = Vector3::new(radius * cosine, radius * sine, z);
                if layout.balls.iter().any(|ball| (ball - place).norm() < ROOM * radius) {
                    continue;
                }
                let mut balls = layout.balls.clone();
                balls.push(place);
                let count = balls.len();
                let with = Layout { balls, phi: phi.clone(), ..layout.clone() };
                let readings: Vec<Reading> =
                    (0..count).flat_map(|ball| (0..RANKING).map(move |command| reading(ball, command))).collect();
                let gains =
                    self.gains(&with, &readings).map_err(|problem| Error::new("plan", "an added ball", problem))?;
                let score = self.score(&gains);
                if found.as_ref().is_none_or(|(known, _)| score.compare(known).is_lt()) {
                    found = Some((score, place));
                }
            }
            best.extend(found.map(|(_, place)| (place, words)));
        }
        Ok(best)
    }

    fn addition(&self, place: Vector3<f64>, height: &str, gains: &Gains) -> PointAddition {
        let machine = self.0.axis.outward(&place).map(|value| (10.0 * value).round() / 10.0);
        let [x, y, z] = machine.map(|value| if value == 0.0 { 0.0 } else { value });
        let taken = |id: &str| self.0.balls.iter().any(|ball| ball.id == id);
        let free = (self.0.balls.len() + 1..).map(|number| format!("P{number}")).find(|id| !taken(id));
        let id = free.unwrap_or_else(|| "new".into());
        PointAddition {
            add: "ball".into(),
            text: format!("a ball at x {x}, y {y}, z {z} mm, {height}"),
            entry: format!("{{ id = \"{id}\", x_mm = {x:?}, y_mm = {y:?}, z_mm = {z:?} }}"),
            after: self.score(gains),
            noise_gain: self.named(gains),
            reveals: Vec::new(),
            distinguishes: Vec::new(),
        }
    }

    /// Which effects would show; nothing where no reading is redundant.
    fn foreseen(&self, campaign: &Campaign) -> Foresight {
        let known = self.linear_terms(campaign).and_then(|terms| foresee(&terms).map_err(|error| error.to_string()));
        known.unwrap_or_default()
    }
}

fn turn_of(commands: usize) -> Vec<f64> {
    (0..commands).map(|command| std::f64::consts::TAU * command as f64 / commands as f64).collect()
}

fn reading(ball: usize, command: usize) -> Reading {
    Reading { ball, command, value: Vector3::zeros(), std: NOISE_MM }
}

/// The layout of what was measured: nothing deviates, and every coordinate has the same noise.
fn as_measured(campaign: Campaign) -> Campaign {
    let readings = campaign.readings.iter().map(|one| reading(one.ball, one.command)).collect();
    Campaign { readings, noise: Noise::Stated(1e3 * NOISE_MM), ..campaign }
}

/// With one more ball, measured once at each command after all others.
fn with_ball(campaign: &Campaign, place: Vector3<f64>) -> Campaign {
    let ball = campaign.layout.balls.len();
    let commands = campaign.layout.phi.len();
    let mut layout = campaign.layout.clone();
    layout.balls.push(place);
    let mut readings = campaign.readings.clone();
    readings.extend((0..commands).map(|command| reading(ball, command)));
    let (before, count) = (campaign.readings.len() as f64, readings.len());
    let all = count as f64;
    let mut time: Vec<f64> = campaign.time.iter().map(|time| time * before / all).collect();
    time.extend((1..=commands).map(|row| (before + row as f64) / all));
    let mut direction = campaign.direction.clone();
    direction.extend(vec![1.0; commands]);
    let mut balls = campaign.balls.clone();
    balls.push("added".into());
    Campaign {
        layout,
        readings,
        balls,
        commands_deg: campaign.commands_deg.clone(),
        time,
        duration_s: campaign.duration_s,
        direction,
        turn: vec![0; count],
        pass: vec![0; count],
        noise: campaign.noise,
        warnings: Vec::new(),
    }
}
