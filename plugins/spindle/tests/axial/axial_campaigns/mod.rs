//! Axial sensors in simulated campaigns: uncertainties that hold, and the closed loop.

use super::*;

/// A simulated spindle with five channels and, with the `disc`, three axial sensors more; the ball is turned.
fn simulated(seed: u64, rotation: Rotation, disc: bool, effects: &str) -> SpindleConfig {
    let mut simulated = campaign(seed, effects);
    let mut sensors = five(Some(0.02));
    if disc {
        sensors.extend([("A1", 0.0), ("A2", 130.0), ("A3", 250.0)].map(|(id, deg)| axial(id, deg, 20.0, "disc")));
        simulated.face = vec![FaceConfig { section: "disc".into(), rms_um: 0.5, ..FaceConfig::default() }];
    }
    simulated.rig = config(rotation, sensors, &TURNED);
    simulated.form.rms_um = 0.5;
    simulated.eccentricity.offset_um = 3.0;
    simulated.eccentricity.tilt_urad = 30.0;
    simulated.motion.z_rms_um = 0.5;
    simulated.motion.z = vec![MotionHarmonic { order: 1, amplitude_um: 0.6, phase_deg: 40.0 }];
    simulated.asynchronous.z_rms_um = 0.05;
    simulated.noise.rms_um = 0.02;
    simulated
}

fn diagnosed(config: &SpindleConfig) -> (Diagnosis, Separation, Separation, StationTruth) {
    let rig = config.rig.clone().check().unwrap();
    let (station, truth) = averaged(config, &rig);
    let layout = Layout::new(&rig, false);
    let found =
        diagnose(Selection::whole(&rig), layout, true, effects::all(), &[station], &Settings::default()).unwrap();
    (found.diagnosis, found.before[0].clone(), found.after[0].clone(), truth)
}

/// Root mean square error of z over the orders from 1, in µm.
fn z_error_um(separation: &Separation, truth: &StationTruth) -> f64 {
    let z = separation.position(Quantity::Z).unwrap();
    let curve = truth.z_um.as_ref().unwrap();
    let mut fourier = runout_core::numerics::fourier::Fourier::new(curve.len());
    let found = fourier.synthesise(separation.coefficients(z).map(|value| value.conj())).to_vec();
    (found.iter().zip(curve).map(|(found, truth)| (found - truth).powi(2)).sum::<f64>() / curve.len() as f64).sqrt()
}

/// The simulator searches the place of the face under the sensor; signs of z, tilt and rotation are the same.
#[test]
fn simulated_axial_motion_comes_back_within_its_uncertainty() {
    for rotation in [Rotation::Ccw, Rotation::Cw] {
        for disc in [false, true] {
            let config = simulated(3, rotation, disc, "[]");
            let rig = config.rig.clone().check().unwrap();
            let (station, truth) = averaged(&config, &rig);
            let separator = HarmonicLeastSquares::new(&rig, true, Weighting::TurnCovariance);
            let found = separator.separate(&station).unwrap();
            let std = found.angle_std(found.position(Quantity::Z).unwrap());
            let error = z_error_um(&found, &truth);
            assert!(error < 2.0 * std && std < 0.05, "{rotation:?} {disc}: {error} µm, stated {std}");
            assert!(found.warnings.is_empty(), "{:?}", found.warnings);
            if disc {
                assert!((0.8..1.3).contains(&found.residual.chi2_per_dof), "{:?}", found.residual);
                let face = found.position(Quantity::FaceForm(3)).unwrap();
                let harmonics = |curve: &[f64]| {
                    let mut harmonics = vec![Complex64::ZERO; 21];
                    runout_core::numerics::fourier::Fourier::new(curve.len())
                        .analyse(curve.iter().copied(), &mut harmonics);
                    harmonics
                };
                let width = found.unknowns.len();
                for (order, truth) in harmonics(&truth.form_um[3]).iter().enumerate().skip(2) {
                    let place = order * width + face;
                    // Six standard uncertainties of a complex number, and what a face that moves laterally adds.
                    let allowed = 6.0 * found.variance[place].sqrt() + 2e-3;
                    let error = (found.estimate[place] - truth).norm();
                    assert!(error < allowed, "{rotation:?} order {order}: {error} > {allowed}");
                }
            }
        }
    }
}

#[test]
fn a_hidden_gain_of_an_axial_sensor() {
    let effect = r#"[{"plugin":"sensor-gain","targets":["Z"],"relative_gain":0.04}]"#;
    let (found, before, after, truth) = diagnosed(&simulated(5, Rotation::Ccw, true, effect));
    assert_eq!(found.verdict, Verdict::Explained, "{:?}", found.added);
    let added = found.added.iter().find(|added| added.effect == "sensor-gain").unwrap();
    let itself = added.targets == ["Z"];
    assert!(itself || added.confounded_with.contains(&"sensor-gain Z".to_owned()), "{added:?}");
    if itself && added.confounded_with.is_empty() {
        let gain = &added.parameters[0];
        // In ± is the form of the pole that the rig declares: it changes z, by which the gain is determined.
        assert!((gain.value - 0.04).abs() < 2.5 * gain.std.unwrap(), "{gain:?}");
    }
    let [before, after_error] = [&before, &after].map(|separation| z_error_um(separation, &truth));
    let std = after.angle_std(after.position(Quantity::Z).unwrap());
    assert!(after_error < before && after_error < 2.0 * std, "{before} → {after_error}, stated {std}");

    // With one axial sensor only, its gain changes nothing but z.
    for seed in 5..8 {
        let (found, ..) = diagnosed(&simulated(seed, Rotation::Ccw, false, effect));
        assert!(found.added.is_empty(), "{:?}", found.added);
    }
    let (found, ..) = diagnosed(&simulated(5, Rotation::Ccw, false, effect));
    let blind = found.blind_to.iter().find(|blind| blind.effect == "sensor-gain" && blind.targets == ["Z"]);
    let bias = &blind.unwrap_or_else(|| panic!("{:?}", found.blind_to)).bias_per_unit;
    assert!(bias.on == "z" && bias.value > 0.3, "{bias:?}");
    for effect in ["sensor-axial-position", "sensor-angle"] {
        let offered =
            |blind: &runout_core::closed_loop::diagnosis::Blind| blind.effect == effect && blind.targets == ["Z"];
        assert!(!found.blind_to.iter().any(offered), "{effect} is none of a sensor on the axis");
    }
}

#[test]
fn other_effects_on_an_axial_sensor() {
    for (effect, id, target) in [
        (r#"[{"plugin":"sensor-sign","targets":["A2"]}]"#, "sensor-sign", "A2"),
        (r#"[{"plugin":"thermal-drift","targets":["A1"],"rate_um_per_rev":0.03}]"#, "thermal-drift", "A1"),
        (r#"[{"plugin":"sensor-line","targets":["Z"],"order":3.37,"amplitude_um":0.2}]"#, "sensor-line", "Z"),
        (r#"[{"plugin":"sensor-angle","targets":["A3"],"angle_deg":2.0}]"#, "sensor-angle", "A3"),
    ] {
        let (found, _, after, truth) = diagnosed(&simulated(8, Rotation::Ccw, true, effect));
        let name = format!("{id} {target}");
        let named = |added: &runout_core::closed_loop::diagnosis::Added| {
            (added.effect == id && added.targets == [target]) || added.confounded_with.contains(&name)
        };
        assert!(found.added.iter().any(named), "{name}: {:?} {:?}", found.verdict, found.added);
        let std = after.angle_std(after.position(Quantity::Z).unwrap());
        let error = z_error_um(&after, &truth);
        assert!(error < 2.5 * std, "{name}: {error} µm, stated {std}");
    }
}

/// Partials of the effects on a rig with axial sensors against finite differences: the signature is what a small effect leaves.
#[test]
fn partials_on_axial_sensors() {
    // Little noise: what it leaves of the residual turns with the layout, which partials leave out.
    let mut config = simulated(2, Rotation::Cw, true, "[]");
    config.noise.rms_um = 1e-3;
    (config.asynchronous.rms_um, config.asynchronous.z_rms_um) = (Some(1e-3), 1e-3);
    let rig = config.rig.clone().check().unwrap();
    let (station, _) = averaged(&config, &rig);
    let model =
        SpindleModel::new(Selection::whole(&rig), Layout::new(&rig, false), true, effects::all(), &[station]).unwrap();
    let declared = model.fit(&[]).unwrap();
    let axial = ["Z", "A1"];
    for (effect, about) in model.effects().iter().enumerate() {
        let on_axial = about.targets.len() == 1 && axial.contains(&about.targets[0].as_str());
        let wanted = ["sensor-gain", "sensor-angle", "sensor-nonlinearity", "filter-attenuation"];
        if !on_axial || !wanted.contains(&about.id.as_str()) {
            continue;
        }
        for (index, signature) in declared.signature(effect).iter().enumerate() {
            let step = 1e-4 * about.parameters[index].tolerance;
            let moved = |sign: f64| {
                let mut values = vec![0.0; about.parameters.len()];
                values[index] = sign * step;
                model.fit(&[Setting { effect, values }]).unwrap().remainder().residual.clone()
            };
            let (ahead, behind) = (moved(1.0), moved(-1.0));
            let size = signature.iter().map(|value| value * value).sum::<f64>().sqrt();
            let apart = signature
                .iter()
                .zip(ahead.iter().zip(&behind))
                .map(|(signature, (ahead, behind))| ((ahead - behind) / (2.0 * step) - signature).powi(2));
            let apart = apart.sum::<f64>().sqrt();
            // The weights change a little with an effect, which partials leave out.
            assert!(apart < 0.02 * size, "{} {:?}: {apart} of {size}", about.id, about.targets);
        }
    }
}
