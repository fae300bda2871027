//! What all orders share: a phase over n, or a relative size, that runs or steps.

use runout_numerics::statistics::{f_tail, student_95};

use super::{
    ORDERS, PhaseCourse, TurnCourse, TurnTable,
    parts::{ALIKE_STEPS, LOOKS, Parts, Shared, over_turns},
    start,
};
use crate::check::{Check, Test};

/// Least standard uncertainty of where a phase steps, in rows.
const WITHIN_A_TURN: f64 = 0.5;
/// Rows on either side of those in which it may step at least: of fewer, place and size are one guess.
const FEWEST_BESIDE: usize = 3;
/// Root mean square over the turns of a phase below which it is that of interpolation between samples, in rad.
const LEAST_RAD: f64 = 1e-7;
/// Rounds in which a phase is taken out and what is left of it is looked for: each leaves the cube of what the one before left.
const ROUNDS: usize = 6;
/// The test of the phase.
const PHASE: &str = "phase of all orders";

/// Evaluates phase and size.
pub(super) fn look(table: &TurnTable, course: &mut TurnCourse) {
    let [phase, size] = Parts::of(table).map(|parts| parts.and_then(|parts| parts.shared(table.rows())));
    if let Some(size) = size {
        let check = Check::new(Test::Turns, "size of all orders", size.t, &[], (LOOKS * size.p).min(1.0));
        let check = check.finding(|| words(table, false, size));
        if check.refutes() {
            course.size_std = size.by.abs() * size.share(table.rows());
        }
        course.checks.push(check);
    }
    // Marks once in several turns, or several times a turn, are said already.
    if course.phase.is_none_or(|phase| phase.std_rad.is_nan()) {
        look_at_phase(table, phase, course);
    }
}

/// Takes the phase that the linear fit, the products of turns or order 1 alone begin with, and that leaves nothing of its shape.
fn look_at_phase(table: &TurnTable, linear: Option<Shared>, course: &mut TurnCourse) {
    let (rows, together) = (table.rows() as f64, table.together.max(1) as f64);
    let run = |by_row: f64| PhaseCourse { by_rad: by_row / together, std_rad: f64::NAN, step_at: None };
    let step = |by_rad: f64, first: usize| PhaseCourse {
        by_rad,
        std_rad: f64::NAN,
        step_at: Some([table.turns[first] as f64, f64::NAN]),
    };
    let (by_rad, first) = start::step(table);
    let all = rows * ORDERS as f64;
    let tried = [
        Some((run(0.0), 1.0)),
        Some((run(start::run(table)), all)),
        Some((step(by_rad, first), all)),
        linear.and_then(|linear| Some((step(linear.by, linear.step?), rows / ALIKE_STEPS))),
        course.phase.take().map(|phase| (phase, 1.0)),
    ];
    let settled = tried.map(|tried| tried.and_then(|(phase, count)| settled(phase, count, table)));
    course.run = settled[0].map(|(phase, _)| phase);
    let is_there = |shared: &Shared| shared.by.abs() * shared.share(table.rows()) > LEAST_RAD;
    let linear = linear.filter(is_there);
    let settled = settled.into_iter().flatten().filter(|(_, shared)| is_there(shared));
    let settled = settled.min_by(|a, b| a.1.p.total_cmp(&b.1.p));
    // What turns against the mark by order 1 is said already.
    let is_said = course.phase_std_rad > 0.0;
    let shared = settled.map(|(_, shared)| shared).filter(Shared::refutes).or(linear);
    if let Some(shared) = shared.filter(|_| !is_said) {
        let check = Check::new(Test::Turns, PHASE, shared.t, &[], (LOOKS * shared.p).min(1.0));
        let check = check.finding(|| words(table, true, shared));
        if check.refutes() {
            course.phase_std_rad = shared.by.abs() * shared.share(table.rows());
        }
        course.checks.push(check);
    }
    course.phase = settled.filter(|(_, shared)| shared.refutes()).map(|(phase, _)| phase);
}

/// The phase that leaves nothing of its shape when it is taken out of all orders, tried among `count`; `None` where too few orders show it.
fn settled(mut phase: PhaseCourse, count: f64, table: &TurnTable) -> Option<(PhaseCourse, Shared)> {
    let table = &table.beside(&phase);
    let (rows, together) = (table.rows() as f64, table.together.max(1) as f64);
    let row = |turns: f64| table.turns.partition_point(|turn| (*turn as f64) < turns);
    let step = phase.step_at.map(|[turns, _]| row(turns));
    if step.is_some_and(|row| row.min(table.rows() - row) < FEWEST_BESIDE) {
        return None;
    }
    let mut found = None;
    for _ in 0..ROUNDS {
        let shape = PhaseCourse { by_rad: 1.0, ..phase }.at(table);
        let middle = shape.iter().sum::<f64>() / rows;
        let shape: Vec<f64> = shape.into_iter().map(|value| value - middle).collect();
        let [parts, _] = Parts::of(&table.turned_back(&phase.at(table)));
        let parts = parts?;
        let (left_rad, of_orders_rad, freedom) = parts.over_orders(&shape)?;
        let common = parts.common();
        phase.by_rad += left_rad;
        let whole: Vec<f64> = common.iter().zip(&shape).map(|(left, shape)| left + phase.by_rad * shape).collect();
        let (of_turns_rad, p_of_turns) = over_turns(&whole, &shape);
        phase.std_rad = (of_orders_rad * student_95(freedom) / student_95(f64::INFINITY)).max(of_turns_rad);
        // Where it steps, rows show as well as they scatter beside it, and to a part of a turn at best.
        if let Some([_, std]) = &mut phase.step_at {
            let scatter = common.iter().map(|value| value * value).sum::<f64>() / rows;
            *std = together * (scatter / (phase.by_rad * phase.by_rad)).max(WITHIN_A_TURN);
        }
        let t = phase.by_rad / of_orders_rad;
        let p = f_tail(t * t, 1.0, freedom).max(count.max(1.0) * p_of_turns);
        let by = if step.is_some() { phase.by_rad } else { phase.by_rad * together };
        found = Some((phase, Shared { by, step, t, p }));
    }
    found
}

fn words(table: &TurnTable, is_phase: bool, shared: Shared) -> String {
    let together = table.together.max(1) as f64;
    let size = |by: f64| if is_phase { format!("{:.3}°", by.to_degrees()) } else { format!("{:.2} %", 100.0 * by) };
    match (shared.step, is_phase) {
        (Some(row), true) => format!("phase of all orders steps by {} at turn {}", size(shared.by), table.turns[row]),
        (Some(row), false) => format!("size of all orders steps by {} at turn {}", size(shared.by), table.turns[row]),
        (None, true) => turning(shared.by / together, "all orders turn"),
        (None, false) => {
            format!("size of all orders changes by {} during the recording", size(shared.by * table.rows() as f64))
        }
    }
}

/// Says that orders turn against the mark, by so many radians a turn.
pub(super) fn turning(by_rad: f64, who: &str) -> String {
    let ratio = 1.0 - by_rad / std::f64::consts::TAU;
    let digits = if (ratio - 1.0).abs() < 1e-3 { 6 } else { 3 };
    format!(
        "{who} against the mark by {:.3}° a turn: the mark is on another shaft, or slips; ratio {ratio:.digits$}",
        by_rad.to_degrees()
    )
}
