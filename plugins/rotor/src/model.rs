//! The model of a rotor as it is written: materials, segments, disks, bearings and supports, or matrices.

use std::path::PathBuf;

use runout_core::fault::{Fault, known_names};
use schemars::JsonSchema;
use serde::Deserialize;

/// Most degrees of freedom of a model; eigenvalues of larger ones take minutes.
pub(crate) const MOST_DEGREES_OF_FREEDOM: usize = 800;

/// A rotor: either its parts, or `matrices` alone.
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct RotorModel {
    /// Materials of the segments.
    #[serde(default)]
    pub materials: Vec<Material>,
    /// Cylindrical segments of the shaft, one after the other from z = 0.
    #[serde(default)]
    pub segments: Vec<Segment>,
    /// Rigid disks: wheels, pulleys, chucks, parts.
    #[serde(default)]
    pub disks: Vec<Disk>,
    /// Springs and dampers between shaft and ground.
    #[serde(default)]
    pub bearings: Vec<Bearing>,
    /// Places that cannot move.
    #[serde(default)]
    pub supports: Vec<Support>,
    /// Matrices of the equations of motion, instead of all the above.
    #[serde(default)]
    pub matrices: Option<Matrices>,
}

/// A material.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Material {
    /// Its name in `segments`.
    pub id: String,
    /// Young's modulus, in GPa.
    pub youngs_gpa: f64,
    /// Shear modulus, in GPa; without it E/(2(1 + ν)).
    #[serde(default)]
    pub shear_gpa: Option<f64>,
    /// Poisson's ratio, for the shear coefficient; without it E/(2G) − 1.
    #[serde(default)]
    pub poisson: Option<f64>,
    /// Density, in kg/m³.
    pub density_kg_per_m3: f64,
    /// Damping in proportion to the mass, in 1/s: C = α·M of the segments.
    #[serde(default)]
    pub mass_damping_per_s: f64,
    /// Damping in proportion to the stiffness, in s: C = β·K of the segments.
    #[serde(default)]
    pub stiffness_damping_s: f64,
}

/// A cylindrical segment.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Segment {
    /// Its length, in mm.
    pub length_mm: f64,
    /// Outer diameter, in mm.
    pub outer_mm: f64,
    /// Inner diameter, in mm.
    #[serde(default)]
    pub inner_mm: f64,
    /// Id of its material.
    pub material: String,
    /// Number of equal elements that it is divided into.
    #[serde(default = "usual_elements")]
    pub elements: usize,
}

fn usual_elements() -> usize {
    4
}

/// A rigid disk.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Disk {
    /// Place of its centre of mass, in mm.
    pub z_mm: f64,
    /// Mass, in kg.
    pub mass_kg: f64,
    /// Moment of inertia about the axis, in kg·m².
    pub polar_kg_m2: f64,
    /// Moment of inertia about a diameter through the centre of mass, in kg·m².
    pub diametral_kg_m2: f64,
}

/// A spring and damper between shaft and ground: force = −k·(displacement) − c·(velocity).
#[derive(Debug, Clone, Default, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Bearing {
    /// Its place, in mm.
    pub z_mm: f64,
    /// Stiffness in x, in N/m.
    pub kxx_n_per_m: f64,
    /// Stiffness in y, in N/m.
    pub kyy_n_per_m: f64,
    /// Force in x by displacement in y, in N/m.
    #[serde(default)]
    pub kxy_n_per_m: f64,
    /// Force in y by displacement in x, in N/m.
    #[serde(default)]
    pub kyx_n_per_m: f64,
    /// Damping in x, in N·s/m.
    #[serde(default)]
    pub cxx_n_s_per_m: f64,
    /// Damping in y, in N·s/m.
    #[serde(default)]
    pub cyy_n_s_per_m: f64,
    /// Force in x by velocity in y, in N·s/m.
    #[serde(default)]
    pub cxy_n_s_per_m: f64,
    /// Force in y by velocity in x, in N·s/m.
    #[serde(default)]
    pub cyx_n_s_per_m: f64,
}

/// A place that cannot move, in both planes.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Support {
    /// Its place, in mm.
    pub z_mm: f64,
    /// What it holds.
    pub kind: SupportKind,
}

/// What a support holds.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum SupportKind {
    /// No displacement; tilt is free.
    Pinned,
    /// Neither displacement nor tilt.
    Clamped,
}

/// Matrices of M·q″ + (C + Ω·G)·q′ + K·q = 0, as Matrix Market files relative to this one; SI units, Ω in rad/s.
#[derive(Debug, Clone, Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
pub struct Matrices {
    /// K: symmetric, positive semidefinite.
    pub stiffness: PathBuf,
    /// M: symmetric, positive definite.
    pub mass: PathBuf,
    /// G: skew-symmetric, for a rotation of 1 rad/s.
    #[serde(default)]
    pub gyroscopic: Option<PathBuf>,
    /// C: damping.
    #[serde(default)]
    pub damping: Option<PathBuf>,
    /// The skew-symmetric part of a stiffness that is not symmetric, such as that of a fluid-film bearing.
    #[serde(default)]
    pub circulatory: Option<PathBuf>,
    /// Place of each node, in mm, for mode shapes; with `node_dofs`.
    #[serde(default)]
    pub node_z_mm: Vec<f64>,
    /// What the degrees of freedom of each node are, in their order. "x" and "y" are displacements in m.
    #[serde(default)]
    pub node_dofs: Vec<Dof>,
}

/// A degree of freedom of a node.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize, JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Dof {
    /// Displacement along x.
    X,
    /// Displacement along y.
    Y,
    /// Anything else: rotations, displacement along z.
    Other,
}

impl RotorModel {
    /// Refuses what cannot be a rotor.
    ///
    /// # Errors
    /// The first value that cannot be, with its key.
    pub fn check(&self) -> Result<(), Fault> {
        if let Some(matrices) = &self.matrices {
            let parts = [
                ("materials", self.materials.is_empty()),
                ("segments", self.segments.is_empty()),
                ("disks", self.disks.is_empty()),
                ("bearings", self.bearings.is_empty()),
                ("supports", self.supports.is_empty()),
            ];
            if let Some((key, _)) = parts.iter().find(|(_, empty)| !empty) {
                return Err(Fault::at(*key, "`matrices` describes the whole rotor; nothing can be added to it")
                    .help(format!("leave `{key}` or `matrices` out")));
            }
            return matrices.check().map_err(|fault| fault.under("matrices"));
        }
        if self.segments.is_empty() {
            return Err(Fault::at("segments", "a rotor needs at least one segment").help("add segments, or `matrices`"));
        }
        each("materials", &self.materials, |material, index| self.check_material(material, index))?;
        each("segments", &self.segments, |segment, _| self.check_segment(segment))?;
        let length_mm = self.length_mm();
        let on_shaft = |z_mm: f64| {
            if z_mm >= -ON_SHAFT_MM && z_mm <= length_mm + ON_SHAFT_MM {
                return Ok(());
            }
            Err(Fault::at("z_mm", format!("expected a place on the shaft, from 0 to {length_mm} mm, found {z_mm}")))
        };
        each("disks", &self.disks, |disk, _| on_shaft(disk.z_mm).and_then(|()| disk.check()))?;
        each("bearings", &self.bearings, |bearing, _| on_shaft(bearing.z_mm).and_then(|()| bearing.check()))?;
        each("supports", &self.supports, |support, index| {
            on_shaft(support.z_mm)?;
            let same = |other: &Support| (other.z_mm - support.z_mm).abs() < ON_SHAFT_MM;
            if self.supports[..index].iter().any(same) {
                return Err(Fault::at("z_mm", format!("there is a support at {} mm already", support.z_mm)));
            }
            Ok(())
        })?;
        let elements: usize = self.segments.iter().map(|segment| segment.elements).sum();
        if 4 * (elements + 1) > MOST_DEGREES_OF_FREEDOM {
            let most = MOST_DEGREES_OF_FREEDOM / 4 - 1;
            return Err(Fault::at("segments", format!("expected at most {most} elements in all, found {elements}")));
        }
        Ok(())
    }

    /// Length of the shaft, in mm.
    #[must_use]
    pub fn length_mm(&self) -> f64 {
        self.segments.iter().map(|segment| segment.length_mm).sum()
    }

    /// The material of a segment.
    #[must_use]
    pub fn material(&self, id: &str) -> Option<&Material> {
        self.materials.iter().find(|material| material.id == id)
    }

    fn check_material(&self, material: &Material, index: usize) -> Result<(), Fault> {
        if self.materials[..index].iter().any(|other| other.id == material.id) {
            return Err(Fault::at("id", format!("two materials are named `{}`", material.id)));
        }
        above_zero("youngs_gpa", "Young's modulus", "GPa", material.youngs_gpa)?;
        above_zero("density_kg_per_m3", "the density", "kg/m³", material.density_kg_per_m3)?;
        not_below_zero("mass_damping_per_s", "damping", "1/s", material.mass_damping_per_s)?;
        not_below_zero("stiffness_damping_s", "damping", "s", material.stiffness_damping_s)?;
        if let Some(shear_gpa) = material.shear_gpa {
            above_zero("shear_gpa", "the shear modulus", "GPa", shear_gpa)?;
        }
        match (material.shear_gpa, material.poisson) {
            (None, None) => Err(Fault::here("expected `poisson` or `shear_gpa`, found neither")),
            (_, Some(poisson)) if !(-1.0..=0.5).contains(&poisson) || poisson <= -1.0 => {
                Err(Fault::at("poisson", format!("expected Poisson's ratio above −1 and up to 0.5, found {poisson}")))
            }
            (Some(shear_gpa), None) if !(-1.0..=0.5).contains(&material.poisson()) => Err(Fault::at(
                "shear_gpa",
                format!(
                    "with E = {} GPa and G = {shear_gpa} GPa Poisson's ratio E/(2G) − 1 would be {:.2}",
                    material.youngs_gpa,
                    material.poisson()
                ),
            )
            .help("an isotropic material has E/3 ≤ G; give `poisson` where the material is not isotropic")),
            _ => Ok(()),
        }
    }

    fn check_segment(&self, segment: &Segment) -> Result<(), Fault> {
        above_zero("length_mm", "a length", "mm", segment.length_mm)?;
        above_zero("outer_mm", "a diameter", "mm", segment.outer_mm)?;
        not_below_zero("inner_mm", "a diameter", "mm", segment.inner_mm)?;
        let Segment { outer_mm, inner_mm, .. } = segment;
        if inner_mm >= outer_mm {
            let message = format!("expected less than the outer diameter, {outer_mm} mm, found {inner_mm}");
            return Err(Fault::at("inner_mm", message));
        }
        if segment.elements == 0 {
            return Err(Fault::at("elements", "expected at least one element, found 0"));
        }
        if self.material(&segment.material).is_none() {
            let known = known_names(&segment.material, self.materials.iter().map(|material| material.id.as_str()));
            return Err(Fault::at("material", format!("unknown material `{}`", segment.material)).help(known));
        }
        Ok(())
    }
}

/// Places nearer to each other than this are one, in mm.
pub(crate) const ON_SHAFT_MM: f64 = 1e-6;

impl Material {
    /// Poisson's ratio.
    #[must_use]
    pub fn poisson(&self) -> f64 {
        match (self.poisson, self.shear_gpa) {
            (Some(poisson), _) => poisson,
            (None, Some(shear_gpa)) => self.youngs_gpa / (2.0 * shear_gpa) - 1.0,
            (None, None) => f64::NAN,
        }
    }

    /// Shear modulus, in GPa.
    #[must_use]
    pub fn shear_gpa(&self) -> f64 {
        self.shear_gpa.unwrap_or_else(|| self.youngs_gpa / (2.0 * (1.0 + self.poisson())))
    }
}

impl Disk {
    fn check(&self) -> Result<(), Fault> {
        above_zero("mass_kg", "a mass", "kg", self.mass_kg)?;
        not_below_zero("polar_kg_m2", "a moment of inertia", "kg·m²", self.polar_kg_m2)?;
        not_below_zero("diametral_kg_m2", "a moment of inertia", "kg·m²", self.diametral_kg_m2)?;
        // Iz = Ix + Iy − 2∫z²dm for every body.
        if self.polar_kg_m2 > 2.0 * self.diametral_kg_m2 * (1.0 + 1e-9) {
            let (polar, diametral) = (self.polar_kg_m2, self.diametral_kg_m2);
            let message = format!("expected at most twice the diametral one, {diametral} kg·m², found {polar}");
            return Err(Fault::at("polar_kg_m2", message).help("no body has a larger one; a thin disk has twice"));
        }
        Ok(())
    }
}

impl Bearing {
    fn check(&self) -> Result<(), Fault> {
        let numbers = [
            ("kxx_n_per_m", self.kxx_n_per_m),
            ("kyy_n_per_m", self.kyy_n_per_m),
            ("kxy_n_per_m", self.kxy_n_per_m),
            ("kyx_n_per_m", self.kyx_n_per_m),
            ("cxx_n_s_per_m", self.cxx_n_s_per_m),
            ("cyy_n_s_per_m", self.cyy_n_s_per_m),
            ("cxy_n_s_per_m", self.cxy_n_s_per_m),
            ("cyx_n_s_per_m", self.cyx_n_s_per_m),
        ];
        for (key, number) in numbers {
            finite(key, number)?;
        }
        not_below_zero("kxx_n_per_m", "a stiffness", "N/m", self.kxx_n_per_m)?;
        not_below_zero("kyy_n_per_m", "a stiffness", "N/m", self.kyy_n_per_m)?;
        not_below_zero("cxx_n_s_per_m", "a damping", "N·s/m", self.cxx_n_s_per_m)?;
        not_below_zero("cyy_n_s_per_m", "a damping", "N·s/m", self.cyy_n_s_per_m)
    }
}

impl Matrices {
    fn check(&self) -> Result<(), Fault> {
        if let Some(index) = self.node_z_mm.iter().position(|z_mm| !z_mm.is_finite()) {
            return Err(Fault::at("node_z_mm", format!("expected finite numbers, item {index} is not")));
        }
        match (self.node_z_mm.is_empty(), self.node_dofs.is_empty()) {
            (true, false) => Err(Fault::at("node_dofs", "expected `node_z_mm` beside it")),
            (false, true) => Err(Fault::at("node_z_mm", "expected `node_dofs` beside it")
                .help("such as node_dofs = [\"x\", \"y\", \"other\", \"other\"]")),
            _ => Ok(()),
        }
    }
}

fn each<T>(key: &str, items: &[T], check: impl Fn(&T, usize) -> Result<(), Fault>) -> Result<(), Fault> {
    for (index, item) in items.iter().enumerate() {
        check(item, index).map_err(|fault| fault.under_item(key, index))?;
    }
    Ok(())
}

fn finite(key: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() { Ok(()) } else { Err(Fault::at(key, format!("expected a finite number, found {value}"))) }
}

fn above_zero(key: &str, what: &str, unit: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value > 0.0 {
        return Ok(());
    }
    Err(Fault::at(key, format!("expected {what} above 0 {unit}, found {value}")))
}

fn not_below_zero(key: &str, what: &str, unit: &str, value: f64) -> Result<(), Fault> {
    if value.is_finite() && value >= 0.0 {
        return Ok(());
    }
    Err(Fault::at(key, format!("expected {what} of at least 0 {unit}, found {value}")))
}
