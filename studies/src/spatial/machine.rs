//! Machines drawn by chance: a placement of the tracker, a field, noise.

use runout_spatial_error::simulate::{Field, Layout, Placement, Scenario, Tracker};

use crate::chance::Chance;

/// Travel of all machines.
pub const TRAVEL_MM: [f64; 3] = [600.0, 400.0, 350.0];

/// A machine at random: with grids or 90 to 160 scattered places without `places`, else with as many scattered ones.
pub fn draw(chance: &mut Chance, places: Option<usize>) -> Scenario {
    let (from_mm, to_mm) = ([0.0; 3], TRAVEL_MM);
    let layout = match places {
        Some(count) => Layout::Scattered { from_mm, to_mm, count },
        None if chance.below(5) < 3 => {
            let counts = chance.one_of(&[[6, 5, 4], [5, 5, 5], [7, 4, 4], [8, 5, 3]]);
            Layout::Grid { from_mm, to_mm, counts }
        }
        None => Layout::Scattered { from_mm, to_mm, count: 90 + chance.below(71) },
    };
    let smoothness = chance.one_of(&[Some(0.5), Some(1.5), Some(2.5), None]);
    let noise_um = chance.size(0.3, 2.0);
    let placement = Placement {
        shift_um: [0; 3].map(|_| chance.between(-300.0, 300.0)),
        turn_urad: [0; 3].map(|_| chance.between(-200.0, 200.0)),
    };
    let field = Field {
        std_um: [0; 3].map(|_| chance.size(1.0, 8.0)),
        range_mm: TRAVEL_MM.map(|length| length * chance.between(0.3, 0.9)),
        smoothness,
    };
    Scenario {
        layout,
        passes: if places.is_some() { 1 } else { 1 + chance.below(3) },
        random_order: chance.below(2) == 0,
        seconds_per_point: 10.0,
        seed: chance.below(1 << 40) as u64,
        chain: "XYZ".into(),
        tool_mm: [0.0; 3],
        tracker: Tracker { at_mm: [-1500.0, 200.0, 300.0], noise_um, angle_urad: chance.between(0.0, 0.3) * noise_um },
        placement,
        field: Some(field),
        effect: Vec::new(),
    }
}
