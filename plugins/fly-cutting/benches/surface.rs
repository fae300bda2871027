//! Time of a simulated surface over the number of its points: 10 × 10 mm, a line of 4 nm, one thread.

use runout_fly_cutting::simulate::{CutConfig, FlyCuttingScenario, GridConfig, LineConfig};

fn main() {
    divan::main();
}

#[divan::bench(args = [250, 500, 1000, 2000], sample_count = 3)]
fn cut(side: usize) -> usize {
    let step_mm = 10.0 / side as f64;
    let scenario = FlyCuttingScenario {
        cut: CutConfig { nose_radius_mm: 6.0, feed_um_per_rev: 8.3, cutter_radius_mm: 250.0, speed_rpm: 390.0 },
        grid: GridConfig { rows: side, columns: side, step_x_mm: step_mm, step_y_mm: step_mm, ..GridConfig::default() },
        line: vec![LineConfig {
            frequency_hz: 5.6235,
            direction: runout_fly_cutting::simulate::Direction::Axial,
            amplitude_nm: Some(4.0),
            amplitude_urad: None,
            phase_deg: 0.0,
        }],
        ..FlyCuttingScenario::default()
    };
    scenario.heights().map_or(0, |grid| grid.height_nm.len())
}
