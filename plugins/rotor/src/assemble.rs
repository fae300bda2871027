//! From the parts of a rotor to its equations of motion.
//!
//! Degrees of freedom of a node: displacements x and y, rotations α about x and β about y. For a stiff section x′ = β and y′ = −α, so
//! the plane yz takes the element of the plane xz with the signs of its rotations changed. A spinning body with polar inertia P
//! couples the rotations: D·α″ + P·Ω·β′ = 0, D·β″ − P·Ω·α′ = 0.

use faer::Mat;
use runout_core::Result;

use crate::{
    beam::{Element, Section, Square},
    equations::{Equations, Node, Role},
    model::{Bearing, Disk, ON_SHAFT_MM, RotorModel, Segment, SupportKind},
};

/// Degrees of freedom of a node.
const DOFS: usize = 4;
/// Those of an element in the plane xz: x and β of both nodes.
const IN_XZ: [usize; 4] = [0, 3, 4, 7];
/// In the plane yz: y and α of both nodes.
const IN_YZ: [usize; 4] = [1, 2, 5, 6];
/// Sign of each in the plane yz, where θ = −α.
const SIGN_YZ: [f64; 4] = [1.0, -1.0, 1.0, -1.0];

/// The equations of motion of a checked model; `object` is its file, for messages.
///
/// # Errors
/// When no degree of freedom is left.
pub fn assemble(object: &str, model: &RotorModel) -> Result<Equations> {
    let mesh = Mesh::new(model);
    let size = DOFS * mesh.z_mm.len();
    let mut all = Assembly::new(size);
    for (index, piece) in mesh.pieces.iter().enumerate() {
        let length_mm = mesh.z_mm[index + 1] - mesh.z_mm[index];
        all.segment(model, piece, DOFS * index, 1e-3 * length_mm);
    }
    for disk in &model.disks {
        all.disk(disk, DOFS * mesh.node(disk.z_mm));
    }
    for bearing in &model.bearings {
        all.bearing(bearing, DOFS * mesh.node(bearing.z_mm));
    }
    let mut free = vec![true; size];
    for support in &model.supports {
        let first = DOFS * mesh.node(support.z_mm);
        let held = match support.kind {
            SupportKind::Pinned => 2,
            SupportKind::Clamped => DOFS,
        };
        free[first..first + held].fill(false);
    }
    let kept: Vec<usize> = (0..size).filter(|dof| free[*dof]).collect();
    let place = |dof: usize| kept.binary_search(&dof).ok();
    let nodes = mesh.z_mm.iter().enumerate();
    let nodes = nodes.map(|(node, z_mm)| Node { z_mm: *z_mm, x: place(DOFS * node), y: place(DOFS * node + 1) });
    let matrices = all.matrices.map(|(role, matrix)| {
        (role, Mat::from_fn(kept.len(), kept.len(), |row, column| matrix[(kept[row], kept[column])]))
    });
    Equations::new(object, matrices.into(), nodes.collect())
}

/// Nodes along the shaft, and the segment between each two.
struct Mesh<'a> {
    z_mm: Vec<f64>,
    pieces: Vec<&'a Segment>,
}

impl<'a> Mesh<'a> {
    /// Nodes are at the ends of all elements, and at each disk, bearing and support.
    fn new(model: &'a RotorModel) -> Self {
        let mut mesh = Self { z_mm: vec![0.0], pieces: Vec::new() };
        let parts = model.disks.iter().map(|disk| disk.z_mm);
        let parts = parts.chain(model.bearings.iter().map(|bearing| bearing.z_mm));
        let mut parts: Vec<f64> = parts.chain(model.supports.iter().map(|support| support.z_mm)).collect();
        parts.sort_by(f64::total_cmp);
        let mut start = 0.0;
        for segment in &model.segments {
            for element in 1..=segment.elements {
                let end = start + segment.length_mm * element as f64 / segment.elements as f64;
                for z_mm in &parts {
                    let last = mesh.z_mm.last().copied().unwrap_or(0.0);
                    if *z_mm > last + ON_SHAFT_MM && *z_mm < end - ON_SHAFT_MM {
                        mesh.z_mm.push(*z_mm);
                        mesh.pieces.push(segment);
                    }
                }
                mesh.z_mm.push(end);
                mesh.pieces.push(segment);
            }
            start += segment.length_mm;
        }
        mesh
    }

    /// The node at a place, which is there for every part.
    fn node(&self, z_mm: f64) -> usize {
        let distance = |node: &usize| (self.z_mm[*node] - z_mm).abs();
        (0..self.z_mm.len()).min_by(|a, b| distance(a).total_cmp(&distance(b))).unwrap_or(0)
    }
}

/// Matrices of all degrees of freedom, before supports.
struct Assembly {
    matrices: [(Role, Mat<f64>); 5],
}

impl Assembly {
    fn new(size: usize) -> Self {
        Self { matrices: Role::ALL.map(|role| (role, Mat::zeros(size, size))) }
    }

    fn matrix(&mut self, role: Role) -> &mut Mat<f64> {
        &mut self.matrices[role as usize].1
    }

    fn add(&mut self, role: Role, row: usize, column: usize, value: f64) {
        self.matrix(role)[(row, column)] += value;
    }

    fn segment(&mut self, model: &RotorModel, segment: &Segment, first: usize, length_m: f64) {
        // A checked model has the material of each segment.
        let Some(material) = model.material(&segment.material) else { return };
        let section = Section {
            outer: 1e-3 * segment.outer_mm,
            inner: 1e-3 * segment.inner_mm,
            youngs: 1e9 * material.youngs_gpa,
            shear: 1e9 * material.shear_gpa(),
            poisson: material.poisson(),
            density: material.density_kg_per_m3,
        };
        let element = Element::new(&section, length_m);
        let damping: Square = std::array::from_fn(|i| {
            std::array::from_fn(|j| {
                material.mass_damping_per_s * element.mass[i][j]
                    + material.stiffness_damping_s * element.stiffness[i][j]
            })
        });
        let planes = [(IN_XZ, [1.0; 4]), (IN_YZ, SIGN_YZ)];
        for (role, matrix) in
            [(Role::Stiffness, element.stiffness), (Role::Mass, element.mass), (Role::Damping, damping)]
        {
            for (dofs, sign) in planes {
                for (i, j) in pairs() {
                    self.add(role, first + dofs[i], first + dofs[j], sign[i] * sign[j] * matrix[i][j]);
                }
            }
        }
        // With θ of the plane yz = −α: +P·Ω·β′ in the equation of α, −P·Ω·α′ in that of β.
        for (i, j) in pairs() {
            let coupling = SIGN_YZ[i] * element.polar[i][j];
            self.add(Role::Gyroscopic, first + IN_YZ[i], first + IN_XZ[j], -coupling);
            self.add(Role::Gyroscopic, first + IN_XZ[j], first + IN_YZ[i], coupling);
        }
    }

    fn disk(&mut self, disk: &Disk, first: usize) {
        for (dof, inertia) in
            [disk.mass_kg, disk.mass_kg, disk.diametral_kg_m2, disk.diametral_kg_m2].iter().enumerate()
        {
            self.add(Role::Mass, first + dof, first + dof, *inertia);
        }
        self.add(Role::Gyroscopic, first + 2, first + 3, disk.polar_kg_m2);
        self.add(Role::Gyroscopic, first + 3, first + 2, -disk.polar_kg_m2);
    }

    fn bearing(&mut self, bearing: &Bearing, first: usize) {
        let (x, y) = (first, first + 1);
        let (kxy, kyx) = (bearing.kxy_n_per_m, bearing.kyx_n_per_m);
        self.add(Role::Stiffness, x, x, bearing.kxx_n_per_m);
        self.add(Role::Stiffness, y, y, bearing.kyy_n_per_m);
        for (row, column, other) in [(x, y, kxy - kyx), (y, x, kyx - kxy)] {
            self.add(Role::Stiffness, row, column, f64::midpoint(kxy, kyx));
            self.add(Role::Circulatory, row, column, 0.5 * other);
        }
        self.add(Role::Damping, x, x, bearing.cxx_n_s_per_m);
        self.add(Role::Damping, y, y, bearing.cyy_n_s_per_m);
        self.add(Role::Damping, x, y, bearing.cxy_n_s_per_m);
        self.add(Role::Damping, y, x, bearing.cyx_n_s_per_m);
    }
}

fn pairs() -> impl Iterator<Item = (usize, usize)> {
    (0..4).flat_map(|i| (0..4).map(move |j| (i, j)))
}
