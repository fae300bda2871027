//! Second-order sections run over frames, all channels side by side.

use runout_core::numerics::lanes::{Arithmetic, LaneWork, in_lanes_fused, load};

use crate::butterworth::Section;

/// A section in state form: y = b₀x + s₀, s₀' = p₀x − a₁s₀ + s₁, s₁' = p₁x − a₂s₀.
///
/// It is the transposed direct form II with y put in, so that from one sample to the next only a product and a sum wait
/// for each other.
#[derive(Debug, Clone, Copy)]
struct Step {
    b0: f64,
    p: [f64; 2],
    /// −a₁ and −a₂.
    back: [f64; 2],
    /// State in which a constant input of 1 passes unchanged.
    steady: [f64; 2],
}

impl From<&Section> for Step {
    fn from(section: &Section) -> Self {
        let ([b0, b1, b2], [a1, a2]) = (section.b, section.a);
        Self {
            b0,
            p: [b1 - a1 * b0, b2 - a2 * b0],
            back: [-a1, -a2],
            // From y = x = 1, as every section has gain 1 at 0 Hz.
            steady: [1.0 - b0, b2 - a2],
        }
    }
}

/// Sections with their states.
pub(crate) struct Cascade {
    steps: Vec<Step>,
    channels: usize,
    /// `[section][2][channel]`.
    state: Vec<f64>,
}

/// Which way time runs.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Direction {
    Forward,
    Backward,
}

impl Cascade {
    pub(crate) fn new(sections: &[Section], channels: usize) -> Self {
        let state = vec![0.0; sections.len() * 2 * channels];
        Self { steps: sections.iter().map(Step::from).collect(), channels, state }
    }

    /// Puts itself into the state that a long time at this frame's readings leaves.
    pub(crate) fn settle(&mut self, frame: &[f64]) {
        for (step, state) in self.steps.iter().zip(self.state.chunks_exact_mut(2 * self.channels)) {
            let (first, second) = state.split_at_mut(self.channels);
            for ((first, second), value) in first.iter_mut().zip(second).zip(frame) {
                *first = step.steady[0] * value;
                *second = step.steady[1] * value;
            }
        }
    }

    /// Filters frames in place.
    pub(crate) fn run(&mut self, frames: &mut [f64], direction: Direction) {
        let channels = self.channels;
        in_lanes_fused(channels, &mut Pass { cascade: self, frames, direction });
    }
}

struct Pass<'a> {
    cascade: &'a mut Cascade,
    frames: &'a mut [f64],
    direction: Direction,
}

#[allow(clippy::inline_always, reason = "see LaneWork")]
impl LaneWork for Pass<'_> {
    #[inline(always)]
    fn lanes<A: Arithmetic, const C: usize>(&mut self, offset: usize) {
        let count = self.cascade.steps.len();
        // Two sections at a time keep the processor busy while each waits for its own state.
        for first in (0..count).step_by(2) {
            if first + 1 < count {
                self.sections::<A, C, 2>(first, offset);
            } else {
                self.sections::<A, C, 1>(first, offset);
            }
        }
    }
}

#[allow(clippy::inline_always, reason = "see LaneWork")]
impl Pass<'_> {
    #[inline(always)]
    fn sections<A: Arithmetic, const C: usize, const S: usize>(&mut self, first: usize, offset: usize) {
        let channels = self.cascade.channels;
        let steps: [Step; S] = std::array::from_fn(|section| self.cascade.steps[first + section]);
        let place = |section: usize, term: usize| ((first + section) * 2 + term) * channels;
        let mut state: [[[f64; C]; 2]; S] = std::array::from_fn(|section| {
            std::array::from_fn(|term| load(&self.cascade.state[place(section, term)..], offset))
        });
        if channels == C {
            // A distance between frames that the compiler knows spares the checks of every access.
            let frames = self.frames.chunks_exact_mut(C);
            run::<A, C, S>(frames, self.direction, &steps, &mut state);
        } else {
            let frames = self.frames.chunks_exact_mut(channels).map(|frame| &mut frame[offset..offset + C]);
            run::<A, C, S>(frames, self.direction, &steps, &mut state);
        }
        for (section, state) in state.iter().enumerate() {
            for (term, lanes) in state.iter().enumerate() {
                let at = place(section, term) + offset;
                self.cascade.state[at..at + C].copy_from_slice(lanes);
            }
        }
    }
}

/// All instants of some channels through some sections.
#[inline(always)]
#[allow(clippy::inline_always, reason = "see LaneWork")]
fn run<'a, A: Arithmetic, const C: usize, const S: usize>(
    frames: impl DoubleEndedIterator<Item = &'a mut [f64]>,
    direction: Direction,
    steps: &[Step; S],
    state: &mut [[[f64; C]; 2]; S],
) {
    // No closure: the compiler would not inline it.
    match direction {
        Direction::Forward => {
            for frame in frames {
                filter::<A, C, S>(steps, state, frame);
            }
        }
        Direction::Backward => {
            for frame in frames.rev() {
                filter::<A, C, S>(steps, state, frame);
            }
        }
    }
}

/// One instant of some channels through some sections.
#[inline(always)]
#[allow(clippy::inline_always, reason = "see LaneWork")]
fn filter<A: Arithmetic, const C: usize, const S: usize>(
    steps: &[Step; S],
    state: &mut [[[f64; C]; 2]; S],
    lanes: &mut [f64],
) {
    let mut value: [f64; C] = load(lanes, 0);
    for (step, state) in steps.iter().zip(state) {
        let input = value;
        for lane in 0..C {
            value[lane] = A::mul_add(step.b0, input[lane], state[0][lane]);
        }
        let [first, second] = *state;
        for lane in 0..C {
            state[0][lane] = A::mul_add(step.p[0], input[lane], second[lane]);
        }
        for lane in 0..C {
            state[0][lane] = A::mul_add(step.back[0], first[lane], state[0][lane]);
        }
        for lane in 0..C {
            state[1][lane] = A::mul_add(step.back[1], first[lane], step.p[1] * input[lane]);
        }
    }
    lanes.copy_from_slice(&value);
}
