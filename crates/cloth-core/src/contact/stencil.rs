//! `contact_geometry` (NUMERICS §15): where two features touch.

use crate::Real;

use super::{Candidate, ContactSurface, Split, along_plane, dot, plus, sub};

/// What touches what.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum ContactKind {
    /// A vertex and the inside of a triangle.
    VertexFace,
    /// A vertex and the inside of an edge.
    VertexEdge,
    /// Two vertices.
    VertexVertex,
    /// The insides of two edges.
    EdgeEdge,
    /// A vertex and a plane.
    VertexPlane,
}

impl ContactKind {
    /// All of them; files have the place here.
    pub const ALL: [Self; 5] =
        [Self::VertexFace, Self::VertexEdge, Self::VertexVertex, Self::EdgeEdge, Self::VertexPlane];
}

/// Names a contact from one step to the next: its kind, and two numbers. A vertex has the number of its particle, a plane that of its collider; triangles and
/// edges have theirs in a [`ContactSurface`].
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct ContactKey {
    /// The kind of both features.
    pub kind: ContactKind,
    /// The first one.
    pub first: u32,
    /// The second one.
    pub second: u32,
}

impl ContactKey {
    /// A number in the order of keys.
    pub(super) const fn number(self) -> u128 {
        (self.kind as u128) << 64 | (self.first as u128) << 32 | self.second as u128
    }
}

/// Two points of features that are close.
///
/// Sum w_a x_a is the vector from the second point to the first; it has the length `gap` and the direction `normal`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ContactStencil<T> {
    /// Its name.
    pub key: ContactKey,
    /// The particles, and nodes of a body; where fewer than four take part, others have weight 0.
    pub particles: [u32; 4],
    /// Weights, positive those of the first feature, 1 together; those of the second are -1 together.
    pub weights: [T; 4],
    /// Unit vector to the first feature.
    pub normal: [T; 3],
    /// Distance \[m\].
    pub gap: T,
    /// Distance at which the force begins \[m\].
    pub reach: T,
    /// Coulomb friction coefficient.
    pub friction: T,
}

impl<T: Real> ContactStencil<T> {
    /// What does nothing.
    pub(super) const NONE: Self = Self {
        key: ContactKey { kind: ContactKind::VertexFace, first: 0, second: 0 },
        particles: [0; 4],
        weights: [T::ZERO; 4],
        normal: [T::ZERO; 3],
        gap: T::ZERO,
        reach: T::ZERO,
        friction: T::ZERO,
    };

    /// Sum w_a v_a of some vectors of the particles.
    #[inline(always)]
    pub fn relative(&self, mut at: impl FnMut(u32) -> [T; 3]) -> [T; 3] {
        let [a, b, c, d] = self.particles.map(&mut at);
        let [wa, wb, wc, wd] = self.weights;
        std::array::from_fn(|k| ((wa * a[k] + wb * b[k]) + wc * c[k]) + wd * d[k])
    }

    /// The part of such a sum along the plane of contact.
    #[inline(always)]
    pub fn tangential(&self, vector: [T; 3]) -> [T; 3] {
        along_plane(vector, self.normal)
    }
}

/// Distances below this share of a length are no distance \[m\].
const NORMAL_MIN: f64 = 1e-12;

/// Share of the distance at the start at which contact of a cloth with itself begins, if that is less than its reach: what lies
/// next to each other in a cloth does not push itself apart.
const REST_SHARE: f64 = 0.9;

/// Closest place of a triangle to a vertex.
#[derive(Clone, Copy)]
enum Region {
    Face,
    Edge(usize),
    Vertex(usize),
}

/// The closest points of two features.
struct Closest<T> {
    weights: [T; 4],
    place: Region,
    /// From that of the second feature to that of the first \[m\].
    difference: [T; 3],
    gap: T,
    /// Whether there are any: for two edges if both lie inside.
    is_any: bool,
}

#[inline(always)]
fn closest<T: Real>(x: &[[T; 3]; 4], split: Split) -> Closest<T> {
    let (weights, place, is_any) = match split {
        Split::VertexTriangle => {
            let (weights, place) = vertex_triangle(x);
            (weights, place, true)
        }
        Split::EdgeEdge => {
            let (weights, is_inside) = edge_edge(x);
            (weights, Region::Face, is_inside)
        }
    };
    // Weights add up to 0: positions count from the first particle.
    let [b, c, d] = [sub(x[1], x[0]), sub(x[2], x[0]), sub(x[3], x[0])];
    let mut difference = [T::ZERO; 3];
    for k in 0..3 {
        difference[k] = (weights[1] * b[k] + weights[2] * c[k]) + weights[3] * d[k];
    }
    let gap = dot(difference, difference).sqrt();
    Closest { weights, place, difference, gap, is_any }
}

#[inline(always)]
fn is_between<T: Real>(gap: T, reach: T) -> bool {
    (gap < reach) & (gap > T::from_f64(NORMAL_MIN))
}

/// Whether [`ContactSurface::contact`] may find one of two features at these points, for `reach` that of the surface \[m\]. Without a branch, so
/// that loops over pairs become vector code.
#[inline(always)]
#[must_use]
pub fn may_touch<T: Real>(points: &[[T; 3]; 4], split: Split, reach: T) -> bool {
    let Closest { gap, is_any, .. } = closest(points, split);
    is_any & is_between(gap, reach)
}

impl ContactSurface {
    /// The contact of a candidate, if its features are closer than their reach, and closest to each other there: each pair of a
    /// vertex with a face, an edge or a vertex, and each pair of edges, is found from one candidate alone, and only if it is in the
    /// region in which no other place of the surface around it is closer (Chen and others 2025).
    #[inline(always)]
    pub fn contact<T: Real>(
        &self,
        candidate: Candidate,
        at: impl Fn(u32) -> [T; 3],
    ) -> Option<ContactStencil<T>> {
        let particles = self.particles(candidate);
        let x = particles.map(&at);
        let Closest { weights, place, difference, gap, is_any } = closest(&x, candidate.split());
        if !(is_any && is_between(gap, T::from_f64(self.reach()))) {
            return None;
        }
        // Most of what is near along an open seam is beyond its reach.
        let seam_reach = self.seam_reach(candidate, &particles);
        if seam_reach.is_some_and(|reach| gap >= T::from_f64(reach)) {
            return None;
        }
        let key = match (candidate, place) {
            (Candidate::EdgeEdge([first, second]), _) => {
                ContactKey { kind: ContactKind::EdgeEdge, first, second }
            }
            (Candidate::VertexTriangle([first, second]), Region::Face) => {
                ContactKey { kind: ContactKind::VertexFace, first, second }
            }
            (Candidate::VertexTriangle([vertex, triangle]), Region::Edge(k)) => {
                let edge = self.triangle_edge(triangle, k);
                let foot: [T; 3] = std::array::from_fn(|k| x[0][k] - difference[k]);
                let is_closer =
                    |&o: &u32| o != vertex && dot(difference, sub(at(o), foot)) > T::ZERO;
                if !self.owns(triangle, k, true) || self.opposites(edge).iter().any(is_closer) {
                    return None;
                }
                ContactKey { kind: ContactKind::VertexEdge, first: vertex, second: edge }
            }
            (Candidate::VertexTriangle([vertex, triangle]), Region::Vertex(k)) => {
                let other = particles[1 + k];
                let leads = |from: u32, along: [T; 3]| {
                    let origin = at(from);
                    let mut row = self.neighbours(from).iter();
                    row.any(|&n| dot(along, sub(at(n), origin)) > T::ZERO)
                };
                if !self.owns(triangle, k, false)
                    || vertex > other
                    || self.neighbours(vertex).contains(&other)
                    || leads(other, difference)
                    || leads(vertex, difference.map(|c| -c))
                {
                    return None;
                }
                ContactKey { kind: ContactKind::VertexVertex, first: vertex, second: other }
            }
        };
        let (reach, friction) = self.reach_of(candidate, (particles, weights), seam_reach);
        let inverse = T::ONE / gap;
        (gap < reach).then(|| ContactStencil {
            key,
            particles,
            weights,
            normal: difference.map(|component| component * inverse),
            gap,
            reach,
            friction: T::from_f64(friction),
        })
    }

    /// The distance at which the force of two features begins, less within a cloth where they are close at the start, and their
    /// friction.
    #[inline(always)]
    fn reach_of<T: Real>(
        &self,
        candidate: Candidate,
        (particles, weights): ([u32; 4], [T; 4]),
        seam_reach: Option<f64>,
    ) -> (T, f64) {
        let (mut reach, friction) = self.coupling_at(particles, weights);
        if let Some(seam) = seam_reach {
            reach = reach.min(seam);
        }
        let reach = T::from_f64(reach);
        if !self.is_one_cloth(particles[0], particles[3]) {
            return (reach, friction);
        }
        let x = particles.map(|particle| self.start(particle));
        let weights = match candidate {
            Candidate::VertexTriangle(_) => vertex_triangle(&x).0,
            Candidate::EdgeEdge(_) => segments(&x),
        };
        let difference: [f64; 3] =
            std::array::from_fn(|k| (0..4).map(|a| weights[a] * x[a][k]).sum());
        let rest = T::from_f64(REST_SHARE * dot(difference, difference).sqrt());
        (rest.minimum(reach), friction)
    }
}

/// Weights of the vertex and of the closest point of the triangle, and where that lies (Ericson 2005, 5.1.5). All regions are looked at, from the
/// last to the first, so that there is no branch.
#[inline(always)]
fn vertex_triangle<T: Real>(&[p, a, b, c]: &[[T; 3]; 4]) -> ([T; 4], Region) {
    let (ab, ac) = (sub(b, a), sub(c, a));
    let (ap, bp, cp) = (sub(p, a), sub(p, b), sub(p, c));
    let (d1, d2) = (dot(ab, ap), dot(ac, ap));
    let (d3, d4) = (dot(ab, bp), dot(ac, bp));
    let (d5, d6) = (dot(ab, cp), dot(ac, cp));
    let (va, vb, vc) = (d3 * d6 - d5 * d4, d5 * d2 - d1 * d6, d1 * d4 - d3 * d2);
    let sum = va + vb + vc;
    let (v, w) = (vb / sum, vc / sum);
    let (zero, one) = (T::ZERO, T::ONE);
    let found = ([(v + w) - one, -v, -w], Region::Face);
    let (along_b, along_c) = (d4 - d3, d5 - d6);
    let w = along_b / (along_b + along_c);
    let is_bc = (va <= zero) & (along_b >= zero) & (along_c >= zero);
    let found = choose(is_bc, ([zero, w - one, -w], Region::Edge(1)), found);
    let w = d2 / (d2 - d6);
    let is_ca = (vb <= zero) & (d2 >= zero) & (d6 <= zero);
    let found = choose(is_ca, ([w - one, zero, -w], Region::Edge(2)), found);
    let is_c = (d6 >= zero) & (d5 <= d6);
    let found = choose(is_c, ([zero, zero, -one], Region::Vertex(2)), found);
    let v = d1 / (d1 - d3);
    let is_ab = (vc <= zero) & (d1 >= zero) & (d3 <= zero);
    let found = choose(is_ab, ([v - one, -v, zero], Region::Edge(0)), found);
    let is_b = (d3 >= zero) & (d4 <= d3);
    let found = choose(is_b, ([zero, -one, zero], Region::Vertex(1)), found);
    let is_a = (d1 <= zero) & (d2 <= zero);
    let ([a, b, c], place) = choose(is_a, ([-one, zero, zero], Region::Vertex(0)), found);
    ([one, a, b, c], place)
}

/// Weights of the corners of a triangle, and where they are.
type Place<T> = ([T; 3], Region);

#[inline(always)]
fn choose<T: Real>(is_so: bool, (a, place): Place<T>, (b, other): Place<T>) -> Place<T> {
    let mut weights = b;
    for k in 0..3 {
        weights[k] = if is_so { a[k] } else { b[k] };
    }
    (weights, if is_so { place } else { other })
}

/// Weights of the closest points of two lines, and whether both lie inside of the edges on them.
#[inline(always)]
fn edge_edge<T: Real>(&[a, b, c, d]: &[[T; 3]; 4]) -> ([T; 4], bool) {
    let (u, v, r) = (sub(b, a), sub(d, c), sub(a, c));
    let (uu, vv, uv) = (dot(u, u), dot(v, v), dot(u, v));
    let (ur, vr) = (dot(u, r), dot(v, r));
    let square = uu * vv - uv * uv;
    // Edges that are parallel meet all along: their ends touch them.
    let is_parallel = square <= T::from_f64(1e-4) * (uu * vv);
    let s = (uv * vr - vv * ur) / square;
    let t = (uu * vr - uv * ur) / square;
    let is_inside = (s > T::ZERO) & (s < T::ONE) & (t > T::ZERO) & (t < T::ONE);
    ([T::ONE - s, s, t - T::ONE, -t], is_inside & !is_parallel)
}

/// Weights of the closest points of two segments.
fn segments(x: &[[f64; 3]; 4]) -> [f64; 4] {
    if let (weights, true) = edge_edge(x) {
        return weights;
    }
    let [a, b, c, d] = *x;
    let share = |p: [f64; 3], from: [f64; 3], to: [f64; 3]| {
        let edge = sub(to, from);
        (dot(sub(p, from), edge) / dot(edge, edge).max(f64::MIN_POSITIVE)).clamp(0.0, 1.0)
    };
    let [at_a, at_b] = [share(a, c, d), share(b, c, d)];
    let [at_c, at_d] = [share(c, a, b), share(d, a, b)];
    let candidates = [
        [1.0, 0.0, at_a - 1.0, -at_a],
        [0.0, 1.0, at_b - 1.0, -at_b],
        [1.0 - at_c, at_c, -1.0, 0.0],
        [1.0 - at_d, at_d, 0.0, -1.0],
    ];
    let square = |w: &[f64; 4]| {
        let sum = (0..4).fold([0.0; 3], |sum, k| plus(sum, w[k], x[k]));
        dot(sum, sum)
    };
    let closest = candidates.into_iter().min_by(|p, q| square(p).total_cmp(&square(q)));
    closest.unwrap_or([1.0, 0.0, -1.0, 0.0])
}
