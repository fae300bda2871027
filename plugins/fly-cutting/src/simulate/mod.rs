//! The simulator `fly-cutting`: the surface that a fly cutter leaves, by true interference of all passes.
//!
//! The tool moves in time; for each row of the map the times are found at which it crosses the row, and at each point the lowest
//! edge of all passes that can reach it remains. The nose is a circle, the edge lies in the plane through the spindle's axis. The
//! separator counts passes from the fitted phase of the scallops instead; the two share no formula.

mod config;
mod cutting;
mod motion;
mod tool;

use std::path::PathBuf;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use runout_core::{
    Result,
    fault::Fault,
    height_grid::HeightGrid,
    pipeline::{Context, StageConfig},
    stage::{Simulation, Simulator},
};

pub use config::{
    CutConfig, Direction, FlyCuttingScenario, GridConfig, HarmonicConfig, LineConfig, SimulatedEffect, SpindleConfig,
};

use motion::Synchronous;
use tool::Machine;

impl FlyCuttingScenario {
    /// The height map.
    ///
    /// # Errors
    /// When the motion of the spindle cannot be read.
    pub fn heights(&self) -> Result<HeightGrid> {
        let station = self.motion_station.as_deref();
        let synchronous = self.motion.as_ref().map(|path| Synchronous::read(path, station)).transpose()?;
        let found = self.spindle.as_ref().map(|spindle| motion::lines(&spindle.diagnosis)).transpose()?;
        let machine = Machine::new(self, synchronous, &found.unwrap_or_default());
        let mut height_nm = cutting::cut(&machine, &self.grid);
        for effect in &self.effect {
            self.put_on(effect, &mut height_nm);
        }
        if self.noise_nm > 0.0 {
            let mut random = ChaCha8Rng::seed_from_u64(self.seed);
            for height in &mut height_nm {
                let normal: f64 = random.sample(StandardNormal);
                *height += self.noise_nm * normal;
            }
        }
        let stated = self.stated_std_nm.unwrap_or(self.noise_nm);
        let GridConfig { columns, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, .. } = self.grid;
        let std_nm = (stated > 0.0).then_some(stated);
        Ok(HeightGrid { columns, step_x_mm, step_y_mm, origin_x_mm, origin_y_mm, std_nm, height_nm })
    }

    /// What is on the surface and no motion of the tool.
    fn put_on(&self, effect: &SimulatedEffect, height_nm: &mut [f64]) {
        let grid = &self.grid;
        let depth: Box<dyn Fn(f64, f64) -> f64> = match effect.clone() {
            // µrad times mm is nm.
            SimulatedEffect::WorkpieceTilt { x_urad, y_urad, .. } => Box::new(move |x, y| -(x_urad * x + y_urad * y)),
            SimulatedEffect::Scratch { from_mm, to_mm, width_mm, depth_nm } => {
                let along = [to_mm[0] - from_mm[0], to_mm[1] - from_mm[1]];
                let square = along[0] * along[0] + along[1] * along[1];
                Box::new(move |x, y| {
                    let [dx, dy] = [x - from_mm[0], y - from_mm[1]];
                    let share =
                        if square > 0.0 { ((dx * along[0] + dy * along[1]) / square).clamp(0.0, 1.0) } else { 0.0 };
                    let beside = (dx - share * along[0]).hypot(dy - share * along[1]);
                    if beside < 0.5 * width_mm { depth_nm } else { 0.0 }
                })
            }
            SimulatedEffect::Pit { at_mm, radius_mm, depth_nm } => {
                Box::new(move |x, y| if (x - at_mm[0]).hypot(y - at_mm[1]) < radius_mm { depth_nm } else { 0.0 })
            }
            _ => return,
        };
        for (index, height) in height_nm.iter_mut().enumerate() {
            let x_mm = grid.origin_x_mm + grid.step_x_mm * (index % grid.columns) as f64;
            let y_mm = grid.origin_y_mm + grid.step_y_mm * (index / grid.columns) as f64;
            *height -= depth(x_mm, y_mm);
        }
    }
}

struct FlyCuttingSimulator {
    scenario: FlyCuttingScenario,
    text: String,
}

impl Simulator for FlyCuttingSimulator {
    fn simulate(&self) -> Result<Simulation<'_>> {
        self.scenario.heights().map(Simulation::Heights)
    }

    fn scenario(&self) -> &str {
        &self.text
    }
}

impl StageConfig for FlyCuttingScenario {
    type Stage = Box<dyn Simulator>;

    const NAME: &'static str = "fly-cutting";
    const ABOUT: &'static str = "the surface that a fly cutter leaves, by interference of all passes";

    fn check(mut self, context: &Context) -> std::result::Result<Self::Stage, Fault> {
        self.checked()?;
        let text = toml::to_string(&self)
            .map_err(|error| Fault::here(format!("the scenario cannot be written as text: {error}")))?;
        let text = format!("plugin = \"{}\"\n{text}", Self::NAME);
        let resolve = |path: PathBuf| context.path(&path);
        self.motion = self.motion.map(resolve);
        self.spindle = self.spindle.map(|spindle| SpindleConfig { diagnosis: resolve(spindle.diagnosis), ..spindle });
        Ok(Box::new(FlyCuttingSimulator { scenario: self, text }))
    }
}
