//! Cloth that tears at edges of its triangles (NUMERICS §16).
//!
//! A model never changes. So each triangle of a cloth that may tear has vertices of its own, its corners, and what is simulated is a [`Weld`](super::Weld)
//! in which those of one place are one vertex. Where an edge is torn, another weld follows that does not join them across it.

mod cracks;
mod opening;
mod split;

#[cfg(test)]
mod tests;

pub(super) use opening::part;
pub use split::SplitMesh;

use cracks::Cracks;
use glam::DVec3;

use super::{Model, ModelBuilder, VertexClasses};
use crate::{
    ModelError, State,
    error::positive,
    fabric::membrane::{self, RestState},
};

/// Cosine between a thread and the normal of an edge from which on the thread crosses the edge rather than runs along it. Each triangle has a side whose
/// normal is nearer to any direction.
const CROSSING_MIN: f64 = 0.5;

/// Where a cloth tears, before it becomes part of a model. [`TriangleMesh::split`](crate::TriangleMesh::split) makes it.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tear {
    /// Name of the cloth.
    pub cloth: String,
    /// How much longer a thread of warp or weft is than at rest when it breaks, dimensionless: its breaking elongation.
    pub strain: f64,
    /// The edges between two triangles, by numbers within the cloth.
    pub edges: Vec<TearEdge>,
    /// Corners that stay one: where a vertex has triangles that no edges join.
    pub bonds: Vec<[u32; 2]>,
}

/// An edge at which two triangles are joined.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct TearEdge {
    /// The triangles.
    pub triangles: [u32; 2],
    /// The side of each that the edge is: k joins its corners k and k + 1.
    pub sides: [u8; 2],
    /// The corners of both at one end, and at the other end.
    pub joints: [[u32; 2]; 2],
}

/// The edges of a model that may tear.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Tears {
    edges: Vec<TearEdge>,
    /// Strain at which each tears.
    strains: Vec<f64>,
    bonds: Vec<[u32; 2]>,
    /// Those that are torn, ascending.
    torn: Vec<u32>,
}

impl ModelBuilder {
    /// Lets a cloth tear whose mesh is split.
    #[must_use]
    pub fn tear(mut self, tear: Tear) -> Self {
        self.tears.push(tear);
        self
    }
}

impl Tears {
    /// Those of a model with these cloths.
    ///
    /// # Errors
    /// A strain that is not above zero, or a cloth that is not what was split.
    pub(super) fn new(model: &Model, tears: &[Tear]) -> Result<Self, ModelError> {
        let mut all = Self::default();
        // In the order of the cloths, whatever that of the tears.
        for cloth in model.cloths() {
            let Some(tear) = tears.iter().find(|tear| tear.cloth == cloth.name) else { continue };
            positive(|| format!("strain at which cloth {:?} tears", tear.cloth), tear.strain)?;
            let refused = || ModelError::TearOfAnother { cloth: tear.cloth.clone() };
            let particle = |corner: u32| {
                let particle = cloth.particles.start + corner;
                cloth.particles.contains(&particle).then_some(particle).ok_or_else(refused)
            };
            let both = |[a, b]: [u32; 2]| Ok::<_, ModelError>([particle(a)?, particle(b)?]);
            for edge in &tear.edges {
                let triangles = edge.triangles.map(|t| cloth.triangles.start + t);
                if triangles.iter().any(|t| !cloth.triangles.contains(t))
                    || edge.sides.iter().any(|side| *side > 2)
                {
                    return Err(refused());
                }
                let [start, end] = edge.joints;
                let joints = [both(start)?, both(end)?];
                all.edges.push(TearEdge { triangles, joints, ..*edge });
                all.strains.push(tear.strain);
            }
            for &bond in &tear.bonds {
                all.bonds.push(both(bond)?);
            }
        }
        match tears.iter().find(|tear| model.cloth(&tear.cloth).is_none()) {
            Some(tear) => Err(ModelError::TearOfAnother { cloth: tear.cloth.clone() }),
            None => Ok(all),
        }
    }

    /// Those of one cloth, by its own numbers.
    pub(super) fn of_cloth(tear: &Tear, torn: &[u32]) -> Self {
        let Tear { cloth: _, strain, edges, bonds } = tear;
        let (edges, bonds, torn) = (edges.clone(), bonds.clone(), torn.to_vec());
        Self { strains: vec![*strain; edges.len()], edges, bonds, torn }
    }

    /// The largest number of a corner.
    pub(super) fn corner_max(&self) -> Option<u32> {
        let joints = self.edges.iter().flat_map(|edge| edge.joints);
        joints.chain(self.bonds.iter().copied()).flatten().max()
    }

    /// The edges, by numbers of triangles and particles of the model.
    #[must_use]
    pub fn edges(&self) -> &[TearEdge] {
        &self.edges
    }

    /// The edges whose sides lie apart at these positions \[m\], ascending. Others may be torn as well: those that have opened at neither end.
    #[must_use]
    pub fn open_in(&self, positions: &[[f64; 3]]) -> Vec<u32> {
        let bits = |i: u32| positions.get(i as usize).map(|place| place.map(f64::to_bits));
        let is_open = |edge: &TearEdge| edge.joints.iter().any(|&[a, b]| bits(a) != bits(b));
        let numbered = (0..).zip(&self.edges);
        numbered.filter(|(_, edge)| is_open(edge)).map(|(number, _)| number).collect()
    }

    /// Whether nothing tears.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.edges.is_empty() && self.bonds.is_empty()
    }

    pub(super) fn torn_set(&mut self, torn: &[u32]) {
        torn.clone_into(&mut self.torn);
    }

    /// Joins what is one place.
    pub(super) fn join(&self, classes: &mut VertexClasses, counts_torn: bool) {
        self.bonds.iter().for_each(|&[a, b]| classes.join(a, b));
        for (number, edge) in (0..).zip(&self.edges) {
            if counts_torn || self.torn.binary_search(&number).is_err() {
                edge.joints.iter().for_each(|&[a, b]| classes.join(a, b));
            }
        }
    }
}

impl Model {
    /// The edges that may tear.
    #[must_use]
    pub const fn tears(&self) -> &Tears {
        &self.tears
    }

    /// The edges that tear at the positions of a state, ascending, where `torn` are torn already: at which a thread of warp or weft that crosses the edge
    /// is longer than it bears, in either of the two triangles. What is held does not tear: two particles cannot be held at one place. Of all of
    /// these, those tear that a crack reaches, and those that bear twice what they can (NUMERICS §16).
    #[must_use]
    pub fn edges_that_tear(&self, state: &State, torn: &[u32]) -> Vec<u32> {
        let (tears, positions, count) = (&self.tears, &state.positions, self.particle_count());
        if tears.edges.is_empty() || positions.len() < count || state.held.len() < count {
            return Vec::new();
        }
        let is_held = |edge: &TearEdge| {
            edge.joints.as_flattened().iter().any(|&corner| state.held[corner as usize] != 0)
        };
        // Of each triangle how much longer its threads are, and the gradients of its corners, in the directions of warp and weft.
        let mut known = vec![None; self.triangles.len()];
        let mut elements = self.elements.triangles().iter().peekable();
        for (known, particles) in known.iter_mut().zip(&self.triangles) {
            if let Some(element) = elements.next_if(|element| element.particles == *particles) {
                let corners = particles.map(|particle| positions[particle as usize]);
                let threads = membrane::deformation(corners, &element.rest);
                let strains = threads.map(|thread| DVec3::from(thread).length() - 1.0);
                *known = Some((strains, gradients(&element.rest)));
            }
        }
        let load = |triangle: u32, side: usize| {
            let (strains, gradients) = known[triangle as usize]?;
            // What grows at the corner across of a side does so at right angles to it.
            let [u, v] = gradients[(side + 2) % 3];
            let length = u.hypot(v);
            let crossing = [u / length, v / length].map(f64::abs);
            let loads = [0, 1].map(|d| match crossing[d] >= CROSSING_MIN {
                true => (strains[d], crossing[d] * strains[d]),
                false => (0.0, 0.0),
            });
            Some(if loads[0].1 > loads[1].1 { loads[0] } else { loads[1] })
        };
        let mut loads: Vec<(f64, u32)> = Vec::new();
        for (number, (edge, &limit)) in (0..).zip(tears.edges.iter().zip(&tears.strains)) {
            if torn.binary_search(&number).is_ok() || is_held(edge) {
                continue;
            }
            let both = [0, 1].map(|k| load(edge.triangles[k], usize::from(edge.sides[k])));
            let beyond = both.into_iter().flatten().filter(|(strain, _)| *strain > limit);
            let rank = beyond.map(|(_, rank)| rank / limit).reduce(f64::max);
            loads.extend(rank.map(|rank| (rank, number)));
        }
        if loads.is_empty() {
            return Vec::new();
        }
        loads.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        Cracks::new(self, torn).run(&loads)
    }
}

/// The gradients of a triangle's corners \[1/m\].
fn gradients(rest: &RestState<f64>) -> [[f64; 2]; 3] {
    let [p, q] = rest.inverse;
    [[-p[0] - q[0], -p[1] - q[1]], p, q]
}
