//! The immutable description of what is simulated.

mod body_surface;
mod buckling;
mod buckling_range;
mod builder;
mod cloth;
mod collider;
mod contact;
mod contact_rules;
mod distance_grid;
mod elements;
mod environment;
mod fabric_matrix;
mod fabric_terms;
mod features;
mod fingerprint;
mod geometry;
mod groups;
mod hierarchy;
mod inflation;
mod interactions;
mod material;
mod material_preset;
mod meshing;
mod piece_blocks;
mod range;
mod regular_patch;
mod round_surface;
mod seams;
mod springs;
mod stability;
mod strain;
mod strain_gauge;
mod tears;
mod winged_edge;

use std::{ops::Range, sync::Arc};

pub use body_surface::BodySurface;
pub use buckling::{BUCKLING_COEFFICIENTS, Buckling};
pub use builder::ModelBuilder;
pub use cloth::{Cloth, ClothMaterial, FabricMaterial, RestSource};
pub use collider::{Collider, ColliderShape, Pose};
pub use contact::{ContactResponse, SelfContact};
pub(crate) use contact_rules::ContactRules;
pub use contact_rules::{ContactMap, ContactRule};
pub use distance_grid::{DistanceGrid, GridSets};
pub use elements::{FOLD_PLACES_MAX, FabricElements, FabricFold, FabricTriangle};
pub use environment::{Air, Field, Gust};
pub use fabric_matrix::{FabricMatrix, ScalarEntry};
pub use fabric_terms::{FabricTerms, OF_FOLD, TERM_SHIFT};
pub use features::{ContactFeature, Feature, FeatureSet, ModelFeatures, ModelShape};
pub use geometry::{Geometry, GridPatch, NetworkSpring, SpringNetwork, Stencil};
pub use hierarchy::GroupHierarchy;
pub use inflation::Inflation;
pub use interactions::{
    BlockDependencies, ColourRegion, ColourRegions, Colouring, Incidence, InteractionKind,
    InteractionList, Interactions, Neighbours, SlicedRows, SpringColouring,
};
pub use material::{Aerodynamics, BendModel, Mass, Material, SpringCoefficients};
pub use material_preset::MaterialPreset;
pub use meshing::Meshing;
pub use piece_blocks::PieceBlocks;
pub use regular_patch::RegularPatch;
pub use seams::{
    BROKEN, Pulls, STITCH_LENGTH, Seam, SeamError, SeamRange, SeamTie, Seams, Stitching,
    VertexClasses, Weld, Welding,
};
pub use springs::{Spring, SpringClass, SpringKind, SpringRows, Springs};
pub use strain_gauge::{FabricAudit, StrainGauge, StrainMeasure, TriangleStrain};
pub use tears::{SplitMesh, Tear, TearEdge, Tears};
pub use winged_edge::{NONE, WingedEdge, WingedEdges};

use crate::{FieldProgram, State, TextureMap, fabric::RestWarning};

/// Where a cloth lies in the composite model, and what holds for it as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct ClothRange {
    /// Name of the cloth.
    pub name: String,
    /// Its particles.
    pub particles: Range<u32>,
    /// Its triangles.
    pub triangles: Range<u32>,
    /// Coefficients of the force of the air.
    pub aerodynamics: Aerodynamics,
    /// Thickness \[m\].
    pub thickness: f64,
    /// What looks like a slip in its rest shape.
    pub warnings: Vec<RestWarning>,
    /// Velocity of its particles at the start \[m/s\].
    pub velocity: [f64; 3],
}

/// All cloths of a scene as one system of particles, with its surroundings.
///
/// Built by [`ModelBuilder`], which checks everything, and never changed after that; any number of
/// solvers share it. Backends can rely on it: all numbers are finite, masses are positive, indices
/// are in range, springs are sorted.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    positions: Vec<[f64; 3]>,
    masses: Vec<f64>,
    pins: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    textures: Vec<Option<TextureMap>>,
    springs: Springs,
    elements: FabricElements,
    seams: Seams,
    tears: Tears,
    inflations: Vec<Inflation>,
    cloths: Vec<ClothRange>,
    colliders: Vec<Collider>,
    gravity: [f64; 3],
    fields: Vec<Field>,
    air: Option<Air>,
    self_contact: Option<SelfContact>,
    contact_rules: ContactRules,
    collider_impulses: bool,
    moved_bodies: bool,
}

impl Model {
    /// Number of particles, n.
    #[must_use]
    pub fn particle_count(&self) -> usize {
        self.positions.len()
    }

    /// Particle positions at the start \[m\], length n. What shape a cloth has without forces is kept apart from it: lengths of
    /// springs, and the rest states of the triangles of fabric.
    #[must_use]
    pub fn positions(&self) -> &[[f64; 3]] {
        &self.positions
    }

    /// Particle masses \[kg\], length n, all positive.
    #[must_use]
    pub fn masses(&self) -> &[f64] {
        &self.masses
    }

    /// Particles held in place from the start, ascending.
    #[must_use]
    pub fn pins(&self) -> &[u32] {
        &self.pins
    }

    /// Particles of each triangle.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Texture coordinates of each cloth; their indices count within the cloth.
    #[must_use]
    pub fn textures(&self) -> &[Option<TextureMap>] {
        &self.textures
    }

    /// All springs.
    #[must_use]
    pub fn springs(&self) -> &Springs {
        &self.springs
    }

    /// All triangles of fabric.
    #[must_use]
    pub fn elements(&self) -> &FabricElements {
        &self.elements
    }

    /// Whether some cloth is made of fabric rather than springs.
    #[must_use]
    pub fn has_fabric(&self) -> bool {
        !self.elements.is_empty()
    }

    /// Whether two particles are joined by a spring or by an edge of a triangle of fabric.
    #[must_use]
    pub fn joins(&self, a: u32, b: u32) -> bool {
        self.springs.joins(a, b) || self.elements.joins(a, b)
    }

    /// The cloths, in the order of their particles.
    #[must_use]
    pub fn cloths(&self) -> &[ClothRange] {
        &self.cloths
    }

    /// Index of the cloth that `particle` belongs to.
    #[must_use]
    pub fn cloth_of(&self, particle: u32) -> usize {
        self.cloths.partition_point(|cloth| cloth.particles.end <= particle)
    }

    /// The cloth called `name`.
    #[must_use]
    pub fn cloth(&self, name: &str) -> Option<&ClothRange> {
        self.cloths.iter().find(|cloth| cloth.name == name)
    }

    /// The colliders.
    #[must_use]
    pub fn colliders(&self) -> &[Collider] {
        &self.colliders
    }

    /// Whether some collider is such that a particle can come out on its other side: all but half spaces.
    #[must_use]
    pub fn has_passable_colliders(&self) -> bool {
        self.colliders.iter().any(|collider| !matches!(collider.shape, ColliderShape::Plane))
    }

    /// Gravity \[m/s^2\].
    #[must_use]
    pub fn gravity(&self) -> [f64; 3] {
        self.gravity
    }

    /// The fields.
    #[must_use]
    pub fn fields(&self) -> &[Field] {
        &self.fields
    }

    /// The air, if there is any.
    #[must_use]
    pub fn air(&self) -> Option<&Air> {
        self.air.as_ref()
    }

    /// Contact of the cloths with themselves and each other, if it is on.
    #[must_use]
    pub fn self_contact(&self) -> Option<&SelfContact> {
        self.self_contact.as_ref()
    }

    /// Where contact of triangles is not as [`Self::self_contact`] says.
    pub(crate) const fn contact_rules(&self) -> &ContactRules {
        &self.contact_rules
    }

    /// Whether the triangles of cloths touch each other ([`ContactResponse::Triangles`]).
    #[must_use]
    pub fn has_triangle_contact(&self) -> bool {
        self.self_contact.as_ref().is_some_and(SelfContact::is_of_triangles)
    }

    /// Whether a solver sums up what colliders do to the cloths.
    #[must_use]
    pub const fn collider_impulses(&self) -> bool {
        self.collider_impulses
    }

    /// Whether cloth moves some of the colliders ([`ModelBuilder::moved_bodies`]).
    #[must_use]
    pub const fn has_moved_bodies(&self) -> bool {
        self.moved_bodies
    }

    /// The same under another gravity \[m/s^2\]. It must be finite.
    #[must_use]
    pub fn with_gravity(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = gravity;
        self
    }

    /// The same with fabric that bends so many times as stiff. It must be positive and finite.
    #[must_use]
    pub fn with_bending(mut self, times: f64) -> Self {
        self.elements.bending_scale(times);
        self
    }

    /// The same from other positions at the start \[m\]; rest shapes and seams stay. Particles that `positions` lacks, or has no finite place for, stay
    /// where they are.
    #[must_use]
    pub fn with_positions(mut self, positions: &[[f64; 3]]) -> Self {
        for (own, place) in self.positions.iter_mut().zip(positions) {
            if place.iter().all(|x| x.is_finite()) {
                *own = *place;
            }
        }
        self
    }

    /// The state at time zero.
    #[must_use]
    pub fn initial_state(&self) -> State {
        let mut held = vec![0; self.particle_count()];
        let mut velocities = Vec::with_capacity(self.particle_count());
        for cloth in &self.cloths {
            velocities.resize(cloth.particles.end as usize, cloth.velocity);
        }
        for &pin in &self.pins {
            held[pin as usize] = 1;
            velocities[pin as usize] = [0.0; 3];
        }
        State {
            positions: self.positions.clone(),
            velocities,
            held,
            colliders: self.colliders.iter().map(|collider| collider.pose).collect(),
            ..State::default()
        }
    }

    /// Sum over the gravity and all uniform fields \[m/s^2\].
    #[must_use]
    pub fn uniform_acceleration(&self) -> [f64; 3] {
        self.fields.iter().fold(self.gravity, |sum, field| match field {
            Field::Uniform { acceleration } => std::array::from_fn(|k| sum[k] + acceleration[k]),
            Field::Drag { .. } | Field::Procedural { .. } => sum,
        })
    }

    /// The programs of all procedural fields, in their order.
    pub fn field_programs(&self) -> impl Iterator<Item = &Arc<FieldProgram>> {
        self.fields.iter().filter_map(|field| match field {
            Field::Procedural { program } => Some(program),
            Field::Uniform { .. } | Field::Drag { .. } => None,
        })
    }

    /// Whether there is a procedural field.
    #[must_use]
    pub fn has_procedural_fields(&self) -> bool {
        self.field_programs().next().is_some()
    }

    /// Sum over all drag fields of the rate per axis \[1/s\].
    #[must_use]
    pub fn drag_rate(&self) -> [f64; 3] {
        self.fields.iter().fold([0.0; 3], |sum, field| match field {
            Field::Drag { rate } => std::array::from_fn(|k| sum[k] + rate[k]),
            Field::Uniform { .. } | Field::Procedural { .. } => sum,
        })
    }
}
