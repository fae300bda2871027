//! The built-in plugins.

use runout_core::pipeline::{Registry, put_right};

/// Every plugin that is compiled in.
#[must_use]
pub fn registry() -> Registry {
    let mut registry = Registry::default();
    for register in [
        runout_hdf5::register,
        runout_maps::register,
        runout_csv::register,
        runout_channels::register,
        runout_points::register,
        runout_preprocess::register,
        runout_spindle::register,
        runout_cylinder::register,
        runout_straightness::register,
        runout_quadrature::register,
        runout_rotary_axis::register,
        runout_touch_probe::register,
        runout_machine_tests::register,
        runout_rotor::register,
        runout_spatial_error::register,
        runout_flatness::register,
        runout_fly_cutting::register,
        runout_as_measured::register,
        runout_external::register,
        runout_parquet::register,
        runout_gltf::register,
        runout_obj::register,
        runout_ply::register,
        runout_stl::register,
        runout_3mf::register,
        runout_figures::register,
        runout_report::register,
        runout_values::register,
        runout_controller::register,
    ] {
        register(&mut registry);
    }
    put_right::mistakes().into_iter().for_each(|mistake| registry.effects.add(mistake));
    registry
}
