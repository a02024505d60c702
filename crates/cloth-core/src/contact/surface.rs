//! The triangles, edges and vertices of all cloths, and the pairs of them that may meet.

use rayon::prelude::*;

use crate::{
    Model, Real,
    model::{ClothRange, ContactRules, SelfContact},
};

use super::{BodyMotion, ContactBody, Split};

/// Triangles in a task.
const TASK: usize = 1024;

/// Two features that may meet.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Candidate {
    /// A vertex, by its particle, and a triangle.
    VertexTriangle([u32; 2]),
    /// Two edges, the smaller one first.
    EdgeEdge([u32; 2]),
}

impl Candidate {
    /// How its four particles are two features.
    #[inline(always)]
    #[must_use]
    pub const fn split(self) -> Split {
        match self {
            Self::VertexTriangle(_) => Split::VertexTriangle,
            Self::EdgeEdge(_) => Split::EdgeEdge,
        }
    }
}

/// Lists of particles, one behind the other.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
struct Rows {
    offsets: Vec<u32>,
    entries: Vec<u32>,
}

impl Rows {
    /// Of pairs (row, entry), each once.
    fn new(count: usize, mut pairs: Vec<[u32; 2]>) -> Self {
        pairs.par_sort_unstable();
        pairs.dedup();
        let mut offsets = vec![0_u32; count + 1];
        pairs.iter().for_each(|[row, _]| offsets[*row as usize + 1] += 1);
        for row in 0..count {
            offsets[row + 1] += offsets[row];
        }
        Self { offsets, entries: pairs.into_iter().map(|[_, entry]| entry).collect() }
    }

    #[inline(always)]
    fn row(&self, row: u32) -> &[u32] {
        let row = row as usize;
        &self.entries[self.offsets[row] as usize..self.offsets[row + 1] as usize]
    }
}

/// All triangles of a model as a surface that can touch itself: those of its cloths, and behind them those of its bodies, whose
/// vertices are nodes with numbers behind those of all particles. Two features of bodies are no pair.
///
/// Each vertex and each edge belongs to one of the triangles that have it, the first: whoever compares pairs of triangles by what
/// belongs to them finds each pair of features once (Curtis, Tamstorf and Manocha 2008).
#[derive(Clone, Debug, PartialEq)]
pub struct ContactSurface {
    triangles: Vec<[u32; 3]>,
    /// The smaller particle first, ascending.
    edges: Vec<[u32; 2]>,
    /// Edge k of a triangle joins its corners k and k + 1.
    triangle_edges: Vec<[u32; 3]>,
    /// Bits 0 to 2: corners that belong to a triangle; 3 to 5: edges that do.
    owned: Vec<u8>,
    /// The corners across of each edge.
    opposites: Rows,
    /// The particles that edges join each particle with.
    neighbours: Rows,
    /// Where particles start \[m\].
    start: Vec<[f64; 3]>,
    /// What closed stitches make one: such particles are as one that two features share.
    classes: Vec<u32>,
    /// What seams will make one; empty if all are closed.
    seam_classes: Vec<u32>,
    /// Of each of these, the distance at which contact beside open stitches begins \[m\].
    seam_reaches: Vec<f64>,
    /// The cloth of each particle; bodies count on behind the cloths.
    cloths: Vec<u32>,
    /// Of each cloth: distance at which forces between it and bodies begin \[m\].
    body_reaches: Vec<f64>,
    bodies: Vec<ContactBody>,
    /// Numbers of particles and of triangles of cloths.
    own: [u32; 2],
    /// Distance at which forces between cloths begin \[m\].
    distance: f64,
    /// The largest distance at which any forces begin \[m\].
    reach: f64,
    /// Coulomb friction coefficient between cloths.
    friction: f64,
    /// Where it is not so.
    rules: ContactRules,
}

impl ContactSurface {
    /// The surface of a model, and the reach of this contact.
    #[must_use]
    pub fn new(model: &Model, contact: &SelfContact) -> Self {
        let bodies = ContactBody::all(model);
        let mut triangles = model.triangles().to_vec();
        let own = [model.particle_count() as u32, triangles.len() as u32];
        triangles.extend(bodies.iter().flat_map(ContactBody::triangles));
        let nodes = bodies.last().map_or(own[0], |body| body.nodes.end) as usize;
        let sides = |t: &[u32; 3]| [[t[0], t[1]], [t[1], t[2]], [t[2], t[0]]].map(sorted);
        let mut edges: Vec<_> = triangles.iter().flat_map(sides).collect();
        edges.par_sort_unstable();
        edges.dedup();
        // All of them are there.
        let number = |side: [u32; 2]| edges.binary_search(&side).unwrap_or_default() as u32;
        let all = triangles.par_iter().with_min_len(TASK);
        let triangle_edges: Vec<_> = all.map(|t| sides(t).map(number)).collect();
        let mut has_vertex = vec![false; nodes];
        let mut has_edge = vec![false; edges.len()];
        let owned = triangles.iter().zip(&triangle_edges).map(|(corners, sides)| {
            let mut bits = 0;
            for k in 0..3 {
                let (corner, side) = (corners[k] as usize, sides[k] as usize);
                bits |= u8::from(!std::mem::replace(&mut has_vertex[corner], true)) << k;
                bits |= u8::from(!std::mem::replace(&mut has_edge[side], true)) << (3 + k);
            }
            bits
        });
        let owned = owned.collect();
        let mut opposites = Vec::with_capacity(3 * triangles.len());
        for (corners, sides) in triangles.iter().zip(&triangle_edges) {
            opposites.extend((0..3).map(|k| [sides[k], corners[(k + 2) % 3]]));
        }
        let neighbours = edges.iter().flat_map(|&[a, b]| [[a, b], [b, a]]).collect();
        let particles = model.cloths().iter().enumerate();
        let cloths =
            particles.flat_map(|(c, cloth)| cloth.particles.clone().map(move |_| c as u32));
        let mut cloths: Vec<u32> = cloths.collect();
        let mut start = model.positions().to_vec();
        let mut classes = model.joined_classes().all();
        let seam_reaches = model.seam_reaches();
        let seam_classes =
            if seam_reaches.is_empty() { Vec::new() } else { model.seam_classes().all() };
        start.extend(BodyMotion::<f64>::new(model).start());
        classes.extend(own[0]..nodes as u32);
        for (number, body) in (model.cloths().len() as u32..).zip(&bodies) {
            cloths.extend(body.nodes.clone().map(|_| number));
        }
        // Half of the distance of the middles of two cloths that touch, or of the thickness of one, as other colliders keep it.
        let body_reach = |cloth: &ClothRange| 0.5 * cloth.thickness.max(contact.distance);
        let body_reaches: Vec<f64> = model.cloths().iter().map(body_reach).collect();
        let rules = model.contact_rules().clone();
        let largest = body_reaches.iter().fold(contact.distance, |a, b| a.max(*b));
        Self {
            opposites: Rows::new(edges.len(), opposites),
            neighbours: Rows::new(nodes, neighbours),
            start,
            classes,
            seam_classes,
            seam_reaches,
            cloths,
            reach: rules.reach(if bodies.is_empty() { contact.distance } else { largest }),
            rules,
            distance: contact.distance,
            friction: contact.friction(),
            body_reaches,
            bodies,
            own,
            triangles,
            edges,
            triangle_edges,
            owned,
        }
    }

    /// The bodies.
    #[must_use]
    pub fn bodies(&self) -> &[ContactBody] {
        &self.bodies
    }

    /// Number of particles and nodes of bodies together.
    #[must_use]
    pub fn node_count(&self) -> usize {
        self.start.len()
    }

    /// Number of triangles of cloths; those of bodies come behind them.
    #[must_use]
    pub const fn cloth_triangles(&self) -> usize {
        self.own[1] as usize
    }

    /// Whether a number is that of a vertex of a body, not of a particle.
    #[inline(always)]
    #[must_use]
    pub const fn is_of_body(&self, node: u32) -> bool {
        node >= self.own[0]
    }

    /// Number of particles; nodes come behind them.
    pub(super) const fn own_particles(&self) -> u32 {
        self.own[0]
    }

    /// Whether there are planes.
    #[must_use]
    pub fn has_planes(&self) -> bool {
        self.bodies.iter().any(|body| body.plane().is_some())
    }

    /// Distance at which the force between a particle and the plane of a node begins, and their friction.
    pub(super) fn coupling_with_plane(&self, particle: u32, node: u32) -> (f64, f64) {
        let (distance, friction) = self.coupling(particle, node);
        let factor = |factors: &[f64]| factors.get(particle as usize).copied().unwrap_or(1.0);
        let ContactRules { distances, frictions, .. } = &self.rules;
        (factor(distances) * distance, factor(frictions) * friction)
    }

    /// Distance at which the forces of two features begin, of which these nodes are one each, and their friction.
    #[inline(always)]
    fn coupling(&self, a: u32, b: u32) -> (f64, f64) {
        let (cloth, body) = match (self.is_of_body(a), self.is_of_body(b)) {
            (false, false) => {
                let usual = (self.distance, self.friction);
                if self.rules.rules.is_empty() {
                    return usual;
                }
                let [a, b] = [a, b].map(|node| self.cloths[node as usize]);
                return self.rules.applied((a, b), usual);
            }
            (false, true) => (a, b),
            _ => (b, a),
        };
        let body = self.cloths[body as usize] as usize - self.body_reaches.len();
        let cloth = self.cloths[cloth as usize];
        let body = &self.bodies[body];
        let usual = (self.body_reaches[cloth as usize], body.friction);
        let collider = self.body_reaches.len() as u32 + body.collider;
        self.rules.applied((cloth, collider), usual)
    }

    /// The same for features whose closest points have these weights, as maps make it.
    #[inline(always)]
    pub(super) fn coupling_at<T: Real>(&self, particles: [u32; 4], weights: [T; 4]) -> (f64, f64) {
        let (distance, friction) = self.coupling(particles[0], particles[3]);
        let ContactRules { distances, frictions, .. } = &self.rules;
        if distances.is_empty() && frictions.is_empty() {
            return (distance, friction);
        }
        // Weights of the first feature are above zero, those of the second below.
        let sides = |factors: &[f64]| {
            let mut sides = [0.0; 2];
            for (particle, weight) in particles.into_iter().zip(weights.map(T::to_f64)) {
                let factor = factors.get(particle as usize).copied().unwrap_or(1.0);
                sides[usize::from(weight < 0.0)] += weight.abs() * factor;
            }
            sides
        };
        let [near, far] = sides(distances);
        let [rough, other] = sides(frictions);
        // A body has no factor: it does not come nearer for being touched by thin cloth.
        let of_distance = match self.is_of_body(particles[0]) || self.is_of_body(particles[3]) {
            true => near * far,
            false => 0.5 * (near + far),
        };
        (of_distance * distance, rough * other * friction)
    }

    /// Particles, or nodes, of the triangles.
    #[must_use]
    pub fn triangles(&self) -> &[[u32; 3]] {
        &self.triangles
    }

    /// Particles of the edges, the smaller one first, ascending.
    #[must_use]
    pub fn edges(&self) -> &[[u32; 2]] {
        &self.edges
    }

    /// The largest distance below which cloths push each other apart, or bodies push cloth away \[m\].
    #[must_use]
    pub const fn reach(&self) -> f64 {
        self.reach
    }

    /// The four particles of a candidate, in the order of its [`Split`].
    #[inline(always)]
    #[must_use]
    pub fn particles(&self, candidate: Candidate) -> [u32; 4] {
        match candidate {
            Candidate::VertexTriangle([vertex, triangle]) => {
                let [a, b, c] = self.triangles[triangle as usize];
                [vertex, a, b, c]
            }
            Candidate::EdgeEdge([first, second]) => {
                let ([a, b], [c, d]) = (self.edges[first as usize], self.edges[second as usize]);
                [a, b, c, d]
            }
        }
    }

    /// Goes on with the stitches of another model of the same particles. Returns whether the pairs stay the same.
    pub fn stitches_set(&mut self, model: &Model) -> bool {
        let joined = model.joined_classes().all();
        if self.classes[..joined.len()] != joined {
            return false;
        }
        self.seam_reaches = model.seam_reaches();
        let is_open = !self.seam_reaches.is_empty();
        self.seam_classes = if is_open { model.seam_classes().all() } else { Vec::new() };
        true
    }

    /// Whether a feature of these corners has a particle, or one that a seam makes one with it.
    #[inline(always)]
    fn has(&self, corners: &[u32], particle: u32) -> bool {
        let class = self.classes[particle as usize];
        corners.iter().any(|&corner| self.classes[corner as usize] == class)
    }

    /// Where an open stitch is to join the two features of a candidate, the distance at which their contact begins \[m\].
    pub(super) fn seam_reach(&self, candidate: Candidate, particles: &[u32; 4]) -> Option<f64> {
        let (first, second) = particles.split_at(candidate.split().first());
        let class = |particle: &u32| self.seam_classes.get(*particle as usize).copied();
        let is_shared = |own: &u32| second.iter().any(|particle| class(particle) == Some(*own));
        let shared = first.iter().filter_map(class).filter(is_shared);
        shared.map(|class| self.seam_reaches[class as usize]).reduce(f64::max)
    }

    /// Visits the pairs of what belongs to two triangles, less those that share a particle; those of bodies have none.
    #[inline(always)]
    pub fn candidates_between(&self, a: u32, b: u32, mut visit: impl FnMut(Candidate, [u32; 4])) {
        if a >= self.own[1] && b >= self.own[1] {
            return;
        }
        let (corners_a, corners_b) = (self.triangles[a as usize], self.triangles[b as usize]);
        let (owned_a, owned_b) = (self.owned[a as usize], self.owned[b as usize]);
        // Bit l of row k: corner k of the first triangle is corner l of the second.
        let class = |corner: u32| self.classes[corner as usize];
        let classes_b = [class(corners_b[0]), class(corners_b[1]), class(corners_b[2])];
        let mut shared = [0_u8; 3];
        for k in 0..3 {
            let own = class(corners_a[k]);
            for (l, other) in classes_b.iter().enumerate() {
                shared[k] |= u8::from(own == *other) << l;
            }
        }
        let of_second = shared[0] | shared[1] | shared[2];
        for k in 0..3 {
            if owned_a >> k & 1 == 1 && shared[k] == 0 {
                let [x, y, z] = corners_b;
                let candidate = Candidate::VertexTriangle([corners_a[k], b]);
                visit(candidate, [corners_a[k], x, y, z]);
            }
            if owned_b >> k & 1 == 1 && of_second >> k & 1 == 0 {
                let [x, y, z] = corners_a;
                let candidate = Candidate::VertexTriangle([corners_b[k], a]);
                visit(candidate, [corners_b[k], x, y, z]);
            }
        }
        for k in (0..3).filter(|k| owned_a >> (3 + k) & 1 == 1) {
            let of_edge = shared[k] | shared[(k + 1) % 3];
            for l in (0..3).filter(|l| owned_b >> (3 + l) & 1 == 1) {
                if of_edge & (1 << l | 1 << ((l + 1) % 3)) != 0 {
                    continue;
                }
                let (first, second) =
                    (self.triangle_edges[a as usize][k], self.triangle_edges[b as usize][l]);
                let (first, second) = (first.min(second), first.max(second));
                let [p, q] = self.edges[first as usize];
                let [r, s] = self.edges[second as usize];
                visit(Candidate::EdgeEdge([first, second]), [p, q, r, s]);
            }
        }
    }

    /// Every pair of features that share no particle, ascending: for tests, and for whoever has time.
    pub fn candidates(&self) -> impl Iterator<Item = Candidate> + '_ {
        let (vertices, triangles) = (self.start.len() as u32, self.triangles.len() as u32);
        let vertex_triangle = (0..vertices)
            .filter(|&v| !self.neighbours.row(v).is_empty())
            .flat_map(move |v| (0..triangles).map(move |t| [v, t]))
            .filter(|&[v, t]| !(self.is_of_body(v) && t >= self.own[1]))
            .filter(|&[v, t]| !self.has(&self.triangles[t as usize], v))
            .map(Candidate::VertexTriangle);
        let edges = self.edges.len() as u32;
        let edge_edge = (0..edges)
            .flat_map(move |first| (first + 1..edges).map(move |second| [first, second]))
            .filter(|pair| {
                let [p, q] = pair.map(|edge| self.edges[edge as usize]);
                let is_of_bodies = self.is_of_body(p[0]) && self.is_of_body(q[0]);
                !is_of_bodies && !self.has(&p, q[0]) && !self.has(&p, q[1])
            })
            .map(Candidate::EdgeEdge);
        vertex_triangle.chain(edge_edge)
    }

    /// Whether an edge, or a corner, belongs to a triangle: edge or corner `k` of it.
    pub(super) fn owns(&self, triangle: u32, k: usize, is_edge: bool) -> bool {
        self.owned[triangle as usize] >> (k + 3 * usize::from(is_edge)) & 1 == 1
    }

    /// What belongs to a triangle, bits 0 to 2 its corners, 3 to 5 its edges, and the numbers of its edges.
    #[must_use]
    pub fn features(&self, triangle: u32) -> (u8, [u32; 3]) {
        (self.owned[triangle as usize], self.triangle_edges[triangle as usize])
    }

    /// For each particle whom seams make it one with: such particles have the same number.
    #[must_use]
    pub fn classes(&self) -> &[u32] {
        &self.classes
    }

    /// Edge k of a triangle.
    pub(super) fn triangle_edge(&self, triangle: u32, k: usize) -> u32 {
        self.triangle_edges[triangle as usize][k]
    }

    pub(super) fn opposites(&self, edge: u32) -> &[u32] {
        self.opposites.row(edge)
    }

    pub(super) fn neighbours(&self, particle: u32) -> &[u32] {
        self.neighbours.row(particle)
    }

    /// Where a particle starts \[m\].
    pub(super) fn start(&self, particle: u32) -> [f64; 3] {
        self.start[particle as usize]
    }

    pub(super) fn is_one_cloth(&self, a: u32, b: u32) -> bool {
        self.cloths[a as usize] == self.cloths[b as usize]
    }
}

fn sorted([a, b]: [u32; 2]) -> [u32; 2] {
    [a.min(b), a.max(b)]
}
