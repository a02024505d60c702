//! What all rungs compute, as a model of the product and as constants of the kernels.

use cloth::{
    BendModel, Cloth, Collider, ColliderShape, ContactResponse, Field, Geometry, GridPatch, Mass,
    MaterialPreset, Model, ModelBuilder, Pose, Result, SelfContact, SolverConfig,
    SpringCoefficients,
};
use cudarc::driver::DeviceRepr;

/// Length of a frame \[s\].
pub const FRAME: f64 = 1.0 / 30.0;
/// Substeps of a frame.
pub const SUBSTEPS: usize = 34;
/// Particles along a side at most: every particle is compared with all others.
pub const SIDE_MAX: u32 = 1024;

/// Length of a substep \[s\].
const TIME_STEP: f64 = 1.0 / 1020.0;
/// Distance of neighbouring particles \[m\].
const SPACING: f64 = 0.02;
/// Mass of a particle \[kg\].
const MASS: f64 = 1e-4;
/// Stiffness of stretch and shear springs, and of those that bend \[N/m\].
const STIFFNESS: [f64; 2] = [10.0, 2.0];
/// Damping of a spring \[N s/m\].
const DAMPING: f64 = 0.005;
/// Rate at which the air brakes \[1/s\].
const DRAG_RATE: f64 = 0.5;
/// Distance of contact; colliders stop particles at half of it \[m\].
const CONTACT_DISTANCE: f64 = 0.8 * SPACING;
/// Stiffness \[N/m\] and damping \[N s/m\] of a contact.
const CONTACT: [f64; 2] = [10.0, 0.002];
/// Gravity along z \[m/s^2\].
const GRAVITY: f64 = -9.81;
/// Coulomb friction coefficient of the sphere.
const FRICTION: f64 = 0.3;
/// Side of a bin \[m\]: larger than the distance of contact.
const BIN: f64 = 2.0 * CONTACT_DISTANCE;
/// Layers of bins.
const BIN_LAYERS: u32 = 4;
/// Number of springs of a particle inside the patch.
pub(super) const NEIGHBOURS: usize = 12;

/// Columns and rows to the other end of each spring, in the order of the particles there.
const OFFSETS: [[i32; 2]; NEIGHBOURS] = [
    [0, -2],
    [-1, -1],
    [0, -1],
    [1, -1],
    [-2, 0],
    [-1, 0],
    [1, 0],
    [2, 0],
    [-1, 1],
    [0, 1],
    [1, 1],
    [0, 2],
];

/// Radius of the sphere below a patch, and its centre \[m\].
fn sphere(side: u32) -> (f64, [f64; 3]) {
    let width = f64::from(side.saturating_sub(1)) * SPACING;
    let radius = 0.25 * width;
    (radius, [0.5 * width, 0.5 * width, -(radius + 0.5 * SPACING)])
}

/// The patch of `side` x `side` particles, 20 mm apart, above a sphere: what the scene `bench-sphere` is with
/// self-contact.
///
/// # Errors
/// [`Error::Invalid`](cloth::Error) for a side of less than two particles; `LimitExceeded` above
/// [`SIDE_MAX`].
pub fn model(side: u32) -> Result<Model> {
    super::side_check(side)?;
    let [stretch, bend] =
        STIFFNESS.map(|stiffness| SpringCoefficients { stiffness, damping: DAMPING });
    let mut material = MaterialPreset::ALL[0].material(SPACING);
    material.mass = Mass::PerParticle(MASS);
    material.stretch = stretch;
    material.shear = stretch;
    material.bend = bend;
    material.bend_model = BendModel::default();
    material.thickness = CONTACT_DISTANCE;
    let patch = GridPatch { origin: [0.0; 3], ..GridPatch::horizontal(side, SPACING, 0.0) };
    let cloth = Cloth {
        name: "patch".into(),
        geometry: Geometry::Grid(patch),
        material: material.into(),
        pins: Vec::new(),
        velocity: [0.0; 3],
    };
    let (radius, centre) = sphere(side);
    let ball = Collider {
        name: "ball".into(),
        shape: ColliderShape::Sphere { radius },
        pose: Pose::from_translation(centre),
        friction: FRICTION,
        restitution: 0.0,
    };
    let [stiffness, damping] = CONTACT;
    let response = ContactResponse::Penalty { stiffness, damping };
    let builder = ModelBuilder::new()
        .cloth(cloth)
        .collider(ball)
        .gravity([0.0, 0.0, GRAVITY])
        .field(Field::Drag { rate: [DRAG_RATE; 3] })
        .self_contact(SelfContact { distance: CONTACT_DISTANCE, response });
    Ok(builder.build()?)
}

/// How the product does it: explicit steps in single precision.
#[must_use]
pub fn config() -> SolverConfig {
    // A small patch is stretched far on a small sphere.
    SolverConfig { time_step: TIME_STEP, strain_bound: 1000.0, ..SolverConfig::default() }
}

/// A particle, as `ladder.cuh` lays it out.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Particle {
    pub(super) position: [f32; 3],
    pub(super) mass: f32,
    pub(super) velocity: [f32; 3],
    pub(super) inverse_mass: f32,
}

#[expect(unsafe_code, reason = "the trait of what is sent to a device is unsafe")]
// SAFETY: numbers of 32 bits alone, of which all bits are values, in the layout of the kernels.
unsafe impl DeviceRepr for Particle {}

/// A spring of every particle.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Neighbour {
    pub(super) across: i32,
    pub(super) up: i32,
    pub(super) rest_length: f32,
    pub(super) stiffness: f32,
}

/// All that a step needs beside the state, as `ladder.cuh` lays it out.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub(super) struct Constants {
    pub(super) side: u32,
    pub(super) count: u32,
    pub(super) length: f32,
    pub(super) damping: f32,
    pub(super) gravity: f32,
    pub(super) drag_rate: f32,
    pub(super) contact_distance: f32,
    pub(super) contact_stiffness: f32,
    pub(super) contact_damping: f32,
    pub(super) sphere_radius: f32,
    pub(super) sphere_centre: [f32; 3],
    pub(super) sphere_friction: f32,
    pub(super) bins_across: u32,
    pub(super) bin_layers: u32,
    pub(super) bin_capacity: u32,
    pub(super) bins_per_metre: f32,
    pub(super) neighbours: [Neighbour; NEIGHBOURS],
}

#[expect(unsafe_code, reason = "the trait of what is sent to a device is unsafe")]
// SAFETY: as those of a particle.
unsafe impl DeviceRepr for Constants {}

impl Constants {
    /// Of a patch; bins have room for `bin_capacity` particles.
    pub(super) fn new(side: u32, bin_capacity: u32) -> Self {
        let (radius, centre) = sphere(side);
        // A quarter more than the flat patch is wide.
        let across = (1.25 * f64::from(side) * SPACING / BIN).ceil() as u32;
        let neighbour = |[across, up]: [i32; 2]| Neighbour {
            across,
            up,
            rest_length: (f64::from(across).hypot(f64::from(up)) * SPACING) as f32,
            stiffness: STIFFNESS[usize::from(across.abs().max(up.abs()) > 1)] as f32,
        };
        Self {
            side,
            count: side * side,
            length: TIME_STEP as f32,
            damping: DAMPING as f32,
            gravity: GRAVITY as f32,
            drag_rate: DRAG_RATE as f32,
            contact_distance: CONTACT_DISTANCE as f32,
            contact_stiffness: CONTACT[0] as f32,
            contact_damping: CONTACT[1] as f32,
            sphere_radius: radius as f32,
            sphere_centre: centre.map(|coordinate| coordinate as f32),
            sphere_friction: FRICTION as f32,
            // At least four, so that a bin is not its own neighbour's neighbour.
            bins_across: across.next_power_of_two().max(4),
            bin_layers: BIN_LAYERS,
            bin_capacity,
            bins_per_metre: BIN.recip() as f32,
            neighbours: OFFSETS.map(neighbour),
        }
    }

    /// Mass of a particle \[kg\].
    pub(super) const fn mass(&self) -> f32 {
        MASS as f32
    }

    /// Number of bins.
    pub(super) const fn bin_count(&self) -> usize {
        (self.bins_across * self.bins_across * self.bin_layers) as usize
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn springs_are_those_of_the_model() {
        let side = 7;
        let model = model(side).unwrap();
        let constants = Constants::new(side, 1);
        let rows = model.springs().gather_rows();
        let particle = 3 * side + 3;
        let range =
            rows.offsets[particle as usize] as usize..rows.offsets[particle as usize + 1] as usize;
        let found: Vec<_> = range
            .map(|at| {
                let kind = &model.springs().kinds()[rows.kinds[at] as usize];
                (rows.columns[at], kind.rest_length as f32, kind.stiffness as f32)
            })
            .collect();
        let expected: Vec<_> = constants
            .neighbours
            .iter()
            .map(|n| {
                let other = particle as i32 + n.up * side as i32 + n.across;
                (other as u32, n.rest_length, n.stiffness)
            })
            .collect();
        assert_eq!(found, expected);
    }

    #[test]
    fn the_constants_have_the_layout_of_the_kernels() {
        assert_eq!(size_of::<Constants>(), 18 * 4 + NEIGHBOURS * 16);
        assert_eq!(size_of::<Particle>(), 32);
    }
}
