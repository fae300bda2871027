//! Pipelines to start from, one a separator: `runout new` writes them.

/// Names of separators with the text of a pipeline that passes `runout check`.
pub(crate) const TEMPLATES: [(&str, &str); 26] = [
    ("as-measured", include_str!("templates/as-measured.toml")),
    ("axial-reversal", include_str!("templates/axial-reversal.toml")),
    ("donaldson-reversal", include_str!("templates/donaldson-reversal.toml")),
    ("external", include_str!("templates/external.toml")),
    ("flatness", include_str!("templates/flatness.toml")),
    ("fly-cutting", include_str!("templates/fly-cutting.toml")),
    ("four-sensor-reversal", include_str!("templates/four-sensor-reversal.toml")),
    ("harmonic-least-squares", include_str!("templates/harmonic-least-squares.toml")),
    ("least-squares-cylinder", include_str!("templates/least-squares-cylinder.toml")),
    ("multi-step", include_str!("templates/multi-step.toml")),
    ("quadrature", include_str!("templates/quadrature.toml")),
    ("positioning", include_str!("templates/positioning.toml")),
    ("probing", include_str!("templates/probing.toml")),
    ("circular", include_str!("templates/circular.toml")),
    ("diagonals", include_str!("templates/diagonals.toml")),
    ("drift", include_str!("templates/drift.toml")),
    ("r-test", include_str!("templates/r-test.toml")),
    ("rotary-axis", include_str!("templates/rotary-axis.toml")),
    ("rotary-axis-circle-fit", include_str!("templates/rotary-axis-circle-fit.toml")),
    ("rotary-axis-three-point", include_str!("templates/rotary-axis-three-point.toml")),
    ("rotary-path", include_str!("templates/rotary-path.toml")),
    ("rotor-modes", include_str!("templates/rotor-modes.toml")),
    ("spatial-error", include_str!("templates/spatial-error.toml")),
    ("structural-motion", include_str!("templates/structural-motion.toml")),
    ("three-point", include_str!("templates/three-point.toml")),
    ("touch-probe", include_str!("templates/touch-probe.toml")),
];

#[cfg(test)]
mod tests {
    use super::TEMPLATES;

    #[test]
    fn every_separator_has_a_pipeline() {
        let registry = crate::builtin::registry();
        for separator in registry.separators.iter().map(|separator| separator.name) {
            assert!(TEMPLATES.iter().any(|(name, _)| *name == separator), "{separator}");
        }
        assert_eq!(registry.separators.iter().count(), TEMPLATES.len());
    }
}
