//! From descriptions of cloths to a checked [`Model`].

use std::{collections::HashSet, ops::Range};

use crate::{
    ModelError, TextureMap, TriangleMesh,
    error::{finite_all, not_negative, positive},
    fabric::{RestShape, RestWarning},
};

use super::{
    Air, Cloth, ClothMaterial, ClothRange, Collider, ColliderShape, ContactMap, ContactRule,
    ContactRules, FabricElements, FabricMaterial, Field, Geometry, GridPatch, Inflation, Mass,
    Material, Meshing, Model, NetworkSpring, RestSource, Seam, SelfContact, SpringClass,
    SpringCoefficients, SpringKind, SpringNetwork, Tear, Tears,
    seams::Seamstress,
    springs::SpringsBuilder,
    winged_edge::{NONE, WingedEdges},
};

/// Most colliders: each has a place in each substep of a frame, and every particle is compared with it. Faces of one mesh are no
/// colliders of their own.
const COLLIDERS_MAX: u64 = 1 << 16;

/// Collects cloths, colliders and surroundings, and checks them all when the model is built.
#[derive(Clone, Debug, Default)]
pub struct ModelBuilder {
    pub(super) cloths: Vec<Cloth>,
    colliders: Vec<Collider>,
    gravity: [f64; 3],
    fields: Vec<Field>,
    air: Option<Air>,
    self_contact: Option<SelfContact>,
    collider_impulses: bool,
    moved_bodies: bool,
    pub(super) seams: Vec<Seam>,
    pub(super) tears: Vec<Tear>,
    pub(super) inflations: Vec<Inflation>,
    pub(super) contact_rules: Vec<ContactRule>,
    pub(super) contact_maps: Vec<ContactMap>,
}

impl ModelBuilder {
    /// An empty model with standard gravity, (0, 0, -9.81) m/s^2.
    #[must_use]
    pub fn new() -> Self {
        Self { gravity: [0.0, 0.0, -9.81], ..Self::default() }
    }

    /// Adds a cloth. Its particles follow those of the cloths before it.
    #[must_use]
    pub fn cloth(mut self, cloth: Cloth) -> Self {
        self.cloths.push(cloth);
        self
    }

    /// Adds a seam. Its cloths may be added later.
    #[must_use]
    pub fn seam(mut self, seam: Seam) -> Self {
        self.seams.push(seam);
        self
    }

    /// Fills a cloth with gas under pressure. Without other air there is then some that weighs nothing.
    #[must_use]
    pub fn inflation(mut self, inflation: Inflation) -> Self {
        self.inflations.push(inflation);
        self
    }

    /// Adds a collider.
    #[must_use]
    pub fn collider(mut self, collider: Collider) -> Self {
        self.colliders.push(collider);
        self
    }

    /// Sets the gravity \[m/s^2\].
    #[must_use]
    pub const fn gravity(mut self, gravity: [f64; 3]) -> Self {
        self.gravity = gravity;
        self
    }

    /// Adds a field.
    #[must_use]
    pub fn field(mut self, field: Field) -> Self {
        self.fields.push(field);
        self
    }

    /// Surrounds the cloths with air.
    #[must_use]
    pub const fn air(mut self, air: Air) -> Self {
        self.air = Some(air);
        self
    }

    /// Lets the cloths collide with themselves and each other.
    #[must_use]
    pub const fn self_contact(mut self, contact: SelfContact) -> Self {
        self.self_contact = Some(contact);
        self
    }

    /// Lets solvers sum up what colliders do to the cloths, for bodies that cloth moves.
    #[must_use]
    pub const fn collider_impulses(mut self, wanted: bool) -> Self {
        self.collider_impulses = wanted;
        self
    }

    /// Says that cloth moves some of the colliders, which feel it every [`EXCHANGE_INTERVAL`](crate::contact::EXCHANGE_INTERVAL): contact with colliders is as
    /// stiff and damped as suits that, and solvers sum up what they do.
    #[must_use]
    pub const fn moved_bodies(mut self) -> Self {
        self.moved_bodies = true;
        self.collider_impulses(true)
    }

    /// Checks everything and builds the model.
    ///
    /// # Errors
    /// The first [`ModelError`] found, naming the cloth, collider or field and the index in it.
    pub fn build(self) -> Result<Model, ModelError> {
        if self.cloths.is_empty() {
            return Err(ModelError::Empty);
        }
        names_unique("cloth", self.cloths.iter().map(|cloth| cloth.name.as_str()))?;
        let count = self.colliders.len() as u64;
        if count > COLLIDERS_MAX {
            return Err(ModelError::TooMany { what: "colliders", count, max: COLLIDERS_MAX });
        }
        names_unique("collider", self.colliders.iter().map(|collider| collider.name.as_str()))?;
        finite_all(|| "gravity".into(), &self.gravity)?;
        self.colliders.iter().try_for_each(Collider::validate)?;
        for (index, field) in self.fields.iter().enumerate() {
            field.validate(index)?;
        }
        self.air.as_ref().map_or(Ok(()), Air::validate)?;
        self.self_contact.as_ref().map_or(Ok(()), SelfContact::validate)?;
        for inflation in &self.inflations {
            inflation.validate()?;
            if self.cloths.iter().all(|cloth| cloth.name != inflation.cloth) {
                return Err(ModelError::InflationOfNothing { cloth: inflation.cloth.clone() });
            }
        }
        let mut parts = Parts::default();
        for cloth in self.cloths {
            parts.add(cloth)?;
        }
        if self.self_contact.as_ref().is_some_and(SelfContact::is_of_triangles)
            && let Some(cloth) = parts.cloths.iter().find(|cloth| cloth.triangles.is_empty())
        {
            return Err(ModelError::ContactWithoutSurface { cloth: cloth.name.clone() });
        }
        if !self.self_contact.as_ref().is_some_and(SelfContact::is_of_triangles)
            && let Some(collider) = (self.colliders.iter())
                .find(|collider| matches!(collider.shape, ColliderShape::Surface(_)))
        {
            return Err(ModelError::BodyWithoutContact { collider: collider.name.clone() });
        }
        names_unique("seam", self.seams.iter().map(|seam| seam.name.as_str()))?;
        let cloths = parts.cloths.iter();
        let seamstress = Seamstress {
            cloths: cloths.map(|cloth| (cloth.name.as_str(), cloth.particles.clone())).collect(),
            positions: &parts.positions,
            masses: &parts.masses,
        };
        let seams = seamstress.sew(&self.seams, &mut parts.springs)?;
        count_check("springs", 2 * parts.springs.len() as u64)?;
        let nothing = Air { density: 0.0, wind_velocity: [0.0; 3], gust: None };
        let air = self.air;
        let mut model = Model {
            seams,
            tears: Tears::default(),
            positions: parts.positions,
            masses: parts.masses,
            pins: parts.pins,
            triangles: parts.triangles,
            textures: parts.textures,
            springs: parts.springs.finish(),
            elements: parts.elements,
            cloths: parts.cloths,
            colliders: self.colliders,
            gravity: self.gravity,
            fields: self.fields,
            air: air.or_else(|| (!self.inflations.is_empty()).then_some(nothing)),
            inflations: self.inflations,
            self_contact: self.self_contact,
            contact_rules: ContactRules::default(),
            collider_impulses: self.collider_impulses,
            moved_bodies: self.moved_bodies,
        };
        model.tears = Tears::new(&model, &self.tears)?;
        model.contact_rules = ContactRules::new(&model, &self.contact_rules, &self.contact_maps)?;
        Ok(model)
    }
}

/// The composite model while it grows.
#[derive(Default)]
struct Parts {
    positions: Vec<[f64; 3]>,
    masses: Vec<f64>,
    pins: Vec<u32>,
    triangles: Vec<[u32; 3]>,
    textures: Vec<Option<TextureMap>>,
    springs: SpringsBuilder,
    elements: FabricElements,
    cloths: Vec<ClothRange>,
}

impl Parts {
    fn add(&mut self, cloth: Cloth) -> Result<(), ModelError> {
        let Cloth { name, geometry, material, pins, velocity } = cloth;
        let springs = match &material {
            ClothMaterial::Springs(material) => {
                material.validate(&name)?;
                Some(*material)
            }
            ClothMaterial::Fabric(_) => None,
        };
        finite_all(|| format!("velocity of cloth {name:?}"), &velocity)?;
        let [first_particle, first_triangle] = [self.positions.len(), self.triangles.len()];
        count_check("particles", first_particle as u64 + geometry.particle_count())?;
        let mut warnings = Vec::new();
        let texture = match (geometry, &material) {
            (Geometry::Grid(patch), ClothMaterial::Springs(material)) => {
                self.grid(&patch, material, &name)?;
                None
            }
            (Geometry::Mesh(mesh), ClothMaterial::Springs(material)) => {
                self.mesh(mesh, material, &name)?
            }
            (Geometry::Network(network), ClothMaterial::Springs(material)) => {
                self.network(&network, material, &name)?;
                None
            }
            (Geometry::Grid(patch), ClothMaterial::Fabric(material)) => {
                patch.validate(&name)?;
                let mesh = patch.mesh(Meshing::default());
                warnings = self.fabric(&mesh, material, 1.0, &name)?;
                None
            }
            (Geometry::Mesh(mesh), ClothMaterial::Fabric(material)) => {
                warnings = self.fabric(&mesh, material, material.rest.scale(), &name)?;
                mesh.texture
            }
            (Geometry::Network(_), ClothMaterial::Fabric(_)) => {
                return Err(ModelError::FabricWithoutSurface { cloth: name });
            }
        };
        let particles = first_particle..self.positions.len();
        let triangles = first_triangle..self.triangles.len();
        // Two entries for each spring when backends expand the matrix.
        count_check("springs", 2 * self.springs.len() as u64)?;
        if let Some(material) = springs {
            self.mass(&material, particles.clone(), triangles.clone(), &name)?;
        }
        self.pin(&pins, particles.clone(), &name)?;
        self.textures.push(texture);
        self.cloths.push(ClothRange {
            name,
            particles: particles.start as u32..particles.end as u32,
            triangles: triangles.start as u32..triangles.end as u32,
            aerodynamics: material.aerodynamics(),
            thickness: material.thickness(),
            warnings,
            velocity,
        });
        Ok(())
    }

    fn grid(
        &mut self,
        patch: &GridPatch,
        material: &Material,
        name: &str,
    ) -> Result<(), ModelError> {
        patch.validate(name)?;
        let first = self.positions.len() as u32;
        let offsets: Vec<_> = patch
            .stencil
            .upper_offsets()
            .iter()
            .map(|&(offset, class)| {
                let kind = spring_kind(material, class, patch.rest_length(offset));
                (offset.map(i64::from), self.springs.kind(kind))
            })
            .collect();
        let [columns, rows] = [i64::from(patch.columns), i64::from(patch.rows)];
        for row in 0..patch.rows {
            for column in 0..patch.columns {
                self.positions.push(patch.position(column, row));
                self.springs.row_begin();
                for &([across, up], kind) in &offsets {
                    let [i, j] = [i64::from(column) + across, i64::from(row) + up];
                    if (0..columns).contains(&i) && (0..rows).contains(&j) {
                        self.springs.spring(first + patch.particle(i as u32, j as u32), kind);
                    }
                }
            }
        }
        finite_all(
            || format!("far corner of cloth {name:?}"),
            self.positions.last().unwrap_or(&patch.origin),
        )?;
        self.triangles.extend(patch.triangles().map(|t| t.map(|vertex| vertex + first)));
        Ok(())
    }

    fn mesh(
        &mut self,
        mesh: TriangleMesh,
        material: &Material,
        name: &str,
    ) -> Result<Option<TextureMap>, ModelError> {
        for (i, position) in mesh.positions.iter().enumerate() {
            finite_all(|| format!("position of vertex {i} of cloth {name:?}"), position)?;
        }
        let edges = WingedEdges::build(&mesh, name)?;
        let mut springs = Vec::with_capacity(2 * edges.edges.len());
        for edge in &edges.edges {
            springs.push(NetworkSpring {
                particles: edge.vertices,
                class: SpringClass::Stretch,
                rest_length: None,
                coefficients: None,
            });
            if !edge.opposite.contains(&NONE) {
                springs.push(NetworkSpring {
                    particles: edge.opposite,
                    class: SpringClass::Bend,
                    rest_length: None,
                    coefficients: None,
                });
            }
        }
        let first = self.positions.len() as u32;
        self.springs(springs, &mesh.positions, material, name)?;
        self.positions.extend(mesh.positions);
        self.triangles.extend(mesh.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
        Ok(mesh.texture)
    }

    /// Adds a cloth of triangles, whose texture coordinates are `scale` \[m\] long.
    fn fabric(
        &mut self,
        mesh: &TriangleMesh,
        material: &FabricMaterial,
        scale: f64,
        name: &str,
    ) -> Result<Vec<RestWarning>, ModelError> {
        let FabricMaterial { fabric, rest, imperfection, .. } = material;
        fabric.validate(&format!("cloth {name:?}"))?;
        for (i, position) in mesh.positions.iter().enumerate() {
            finite_all(|| format!("position of vertex {i} of cloth {name:?}"), position)?;
        }
        let imperfection =
            not_negative(|| format!("imperfection of cloth {name:?}"), *imperfection)?;
        let mut shape = match rest {
            RestSource::Start { warp } => RestShape::from_mesh(mesh, *warp, &fabric.bending, name)?,
            RestSource::Pattern { .. } => {
                positive(|| format!("scale of the pattern of cloth {name:?}"), scale)?;
                let Some(pattern) = &mesh.texture else {
                    return Err(ModelError::PatternMissing { cloth: name.into() });
                };
                let mut pattern = pattern.clone();
                pattern.coordinates.iter_mut().flatten().for_each(|entry| *entry *= scale);
                RestShape::from_pattern(mesh, &pattern, &fabric.bending, name)?
            }
        };
        shape.imperfection_add(imperfection);
        let first = self.positions.len() as u32;
        self.elements.add(*fabric, &mesh.panels, &shape, first);
        self.positions.extend(&mesh.positions);
        self.triangles.extend(mesh.triangles.iter().map(|t| t.map(|vertex| vertex + first)));
        let density = |t: usize| mesh.panels.of(fabric, t).area_density;
        self.masses.extend(shape.masses(density, mesh.positions.len()));
        mesh.positions.iter().for_each(|_| self.springs.row_begin());
        Ok(shape.warnings)
    }

    fn network(
        &mut self,
        network: &SpringNetwork,
        material: &Material,
        name: &str,
    ) -> Result<(), ModelError> {
        for (i, position) in network.positions.iter().enumerate() {
            finite_all(|| format!("position of particle {i} of cloth {name:?}"), position)?;
        }
        if network.positions.is_empty() {
            return Err(ModelError::MeshEmpty { cloth: name.into(), vertices: 0, triangles: 0 });
        }
        self.springs(network.springs.clone(), &network.positions, material, name)?;
        self.positions.extend(&network.positions);
        Ok(())
    }

    /// Adds springs in any order; of springs between the same two particles only the one of the
    /// lowest class stays, so that an edge of a mesh is never doubled by a bend spring.
    fn springs(
        &mut self,
        mut springs: Vec<NetworkSpring>,
        positions: &[[f64; 3]],
        material: &Material,
        name: &str,
    ) -> Result<(), ModelError> {
        let first = self.positions.len() as u32;
        for spring in &mut springs {
            spring.particles.sort_unstable();
            if let Some(&particle) =
                spring.particles.iter().find(|&&index| index as usize >= positions.len())
            {
                return Err(ModelError::SpringOutOfRange {
                    cloth: name.into(),
                    particle,
                    particles: positions.len(),
                });
            }
        }
        springs.sort_by_key(|spring| (spring.particles, spring.class));
        springs.dedup_by_key(|spring| spring.particles);
        let mut next = springs.iter().peekable();
        for i in 0..positions.len() as u32 {
            self.springs.row_begin();
            while let Some(spring) = next.next_if(|spring| spring.particles[0] == i) {
                let [a, b] =
                    spring.particles.map(|index| glam::DVec3::from(positions[index as usize]));
                let rest_length = spring.rest_length.unwrap_or_else(|| a.distance(b));
                if spring.rest_length.is_some() {
                    positive(|| format!("rest length of a spring of cloth {name:?}"), rest_length)?;
                }
                if spring.particles[0] == spring.particles[1] || rest_length <= 0.0 {
                    return Err(ModelError::SpringWithoutLength {
                        cloth: name.into(),
                        vertices: spring.particles,
                    });
                }
                let mut kind = spring_kind(material, spring.class, rest_length);
                if let Some(SpringCoefficients { stiffness, damping }) = spring.coefficients {
                    let what = |what| move || format!("{what} of a spring of cloth {name:?}");
                    kind.stiffness = positive(what("stiffness"), stiffness)?;
                    kind.damping = not_negative(what("damping"), damping)?;
                }
                let kind = self.springs.kind(kind);
                self.springs.spring(first + spring.particles[1], kind);
            }
        }
        Ok(())
    }

    fn mass(
        &mut self,
        material: &Material,
        particles: Range<usize>,
        triangles: Range<usize>,
        name: &str,
    ) -> Result<(), ModelError> {
        match material.mass {
            Mass::PerParticle(mass) => self.masses.resize(particles.end, mass),
            Mass::PerArea(density) => {
                self.masses.resize(particles.end, 0.0);
                for triangle in &self.triangles[triangles] {
                    let [a, b, c] =
                        triangle.map(|vertex| glam::DVec3::from(self.positions[vertex as usize]));
                    let share = density * 0.5 * (b - a).cross(c - a).length() / 3.0;
                    for vertex in triangle {
                        self.masses[*vertex as usize] += share;
                    }
                }
            }
        }
        for (i, &mass) in self.masses[particles].iter().enumerate() {
            if mass == 0.0 {
                return Err(ModelError::VertexIsolated { cloth: name.into(), vertex: i as u32 });
            }
            positive(|| format!("mass of particle {i} of cloth {name:?}"), mass)?;
        }
        Ok(())
    }

    fn pin(&mut self, pins: &[u32], particles: Range<usize>, name: &str) -> Result<(), ModelError> {
        let mut pins = pins.to_vec();
        pins.sort_unstable();
        pins.dedup();
        if let Some(&pin) = pins.last().filter(|&&pin| pin as usize >= particles.len()) {
            return Err(ModelError::PinOutOfRange {
                owner: format!("cloth {name:?}"),
                pin,
                particles: particles.len(),
            });
        }
        self.pins.extend(pins.iter().map(|pin| pin + particles.start as u32));
        Ok(())
    }
}

fn spring_kind(material: &Material, class: SpringClass, rest_length: f64) -> SpringKind {
    let (coefficients, rigidity) = match class {
        SpringClass::Stretch | SpringClass::Seam => (material.stretch, None),
        SpringClass::Shear => (material.shear, None),
        SpringClass::Bend => (material.bend, material.bend_model.rigidity()),
    };
    SpringKind {
        class,
        rest_length,
        stiffness: coefficients.stiffness,
        damping: coefficients.damping,
        rigidity,
    }
}

fn count_check(what: &'static str, count: u64) -> Result<(), ModelError> {
    // One index stays free to mean "none".
    let max = u64::from(u32::MAX) - 1;
    if count > max { Err(ModelError::TooMany { what, count, max }) } else { Ok(()) }
}

fn names_unique<'a>(
    what: &'static str,
    names: impl Iterator<Item = &'a str>,
) -> Result<(), ModelError> {
    let mut seen = HashSet::new();
    for name in names {
        if !seen.insert(name) {
            return Err(ModelError::NameTaken { what, name: name.into() });
        }
    }
    Ok(())
}
