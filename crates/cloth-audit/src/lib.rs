//! Counts triangles that intersect: cloth with itself, cloth with cloth, cloth with bodies.
//!
//! It proves or refutes what a simulation promises, and shares no code with it: signs are exact ([`robust`]), pairs come from an R-tree
//! ([`rstar`]), and all that goes in are the coordinates of a frame. A touch counts.
//!
//! ```
//! use cloth_audit::{Surface, intersections};
//!
//! let flat = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
//! let upright = [[0.2, 0.2, -0.5], [0.3, 0.2, 0.5], [0.2, 0.3, 0.5]];
//! let [a, b] = [Surface::cloth(&flat, &[[0, 1, 2]]), Surface::cloth(&upright, &[[0, 1, 2]])];
//! let found = intersections(&[a, b]);
//! assert_eq!((found.between, found.within, found.crossings), (1, 0, 2));
//! ```
//!
//! Triangles that share particles meet there; that is no intersection, all beyond it is: pairs that share one particle intersect if the
//! edge opposite to it of one meets the other triangle, pairs that share an edge if they are folded onto each other exactly, in one plane. This is
//! what the certificates of the solver exclude (NUMERICS of `cloth-core`, section 14). Cost: n log n for n triangles of like size, below a tenth of a second for
//! 50,000.

mod pair;
mod predicate;

use rayon::prelude::*;
use rstar::{AABB, RTree, RTreeObject};

use pair::{Corner, common};

/// Triangles that belong together.
#[derive(Clone, Copy, Debug)]
pub struct Surface<'a> {
    /// Positions of particles \[m\].
    pub positions: &'a [[f64; 3]],
    /// Indices into them. Two triangles with the same index share the particle.
    pub triangles: &'a [[u32; 3]],
    /// Whether it is a body: what bodies do among themselves does not count.
    pub is_body: bool,
}

impl<'a> Surface<'a> {
    /// A cloth.
    #[must_use]
    pub const fn cloth(positions: &'a [[f64; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self { positions, triangles, is_body: false }
    }

    /// A body.
    #[must_use]
    pub const fn body(positions: &'a [[f64; 3]], triangles: &'a [[u32; 3]]) -> Self {
        Self { positions, triangles, is_body: true }
    }
}

/// How many triangles intersect.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Intersections {
    /// Pairs of triangles of one cloth.
    pub within: u64,
    /// Pairs of triangles of two cloths.
    pub between: u64,
    /// Pairs of a triangle of a cloth and one of a body.
    pub bodies: u64,
    /// Edges that meet triangles with which they share no particle, each edge and triangle once, in all these pairs.
    pub crossings: u64,
    /// Triangles that were left out, as a position is not finite or an index has no position.
    pub unusable: u64,
    /// The first pair, by numbers of surfaces and triangles.
    pub first: Option<Intersection>,
}

impl Intersections {
    /// All pairs.
    #[must_use]
    pub const fn pairs(&self) -> u64 {
        self.within + self.between + self.bodies
    }

    /// Whether nothing intersects and everything could be looked at.
    #[must_use]
    pub const fn is_clean(&self) -> bool {
        self.pairs() == 0 && self.unusable == 0
    }
}

/// Two triangles that intersect.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Intersection {
    /// Their surfaces, ascending.
    pub surfaces: [usize; 2],
    /// Their numbers in these.
    pub triangles: [usize; 2],
    /// A place where they meet \[m\], to rounding.
    pub place: [f64; 3],
}

/// A triangle in the tree.
#[derive(Clone)]
struct Leaf {
    surface: usize,
    triangle: usize,
    corners: [Corner; 3],
}

impl Leaf {
    const fn key(&self) -> (usize, usize) {
        (self.surface, self.triangle)
    }
}

impl RTreeObject for Leaf {
    type Envelope = AABB<[f64; 3]>;

    fn envelope(&self) -> Self::Envelope {
        AABB::from_points(self.corners.iter().map(|corner| &corner.point))
    }
}

/// An edge of a triangle that meets another triangle, with which it shares no particle.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Crossing {
    /// The surface of the edge.
    pub edge_surface: usize,
    /// Its particles there, ascending.
    pub edge: [u32; 2],
    /// The surface of the triangle.
    pub surface: usize,
    /// Its number there.
    pub triangle: usize,
}

/// Counts the triangles of all surfaces that intersect, on all threads there are; the result does not depend on their number.
#[must_use]
pub fn intersections(surfaces: &[Surface<'_>]) -> Intersections {
    let (mut found, looked) = all(surfaces);
    found.within = looked.within;
    found.between = looked.between;
    found.bodies = looked.bodies;
    found.crossings = looked.crossings.len() as u64;
    found.first = looked.first;
    found
}

/// The edges that meet triangles in all these pairs, each edge and triangle once, ascending.
#[must_use]
pub fn crossings(surfaces: &[Surface<'_>]) -> Vec<Crossing> {
    all(surfaces).1.crossings
}

/// What cannot be looked at, and what is found among the rest.
fn all(surfaces: &[Surface<'_>]) -> (Intersections, Looked) {
    let mut found = Intersections::default();
    let [cloths, bodies] = [false, true].map(|is_body| {
        let of_kind = surfaces.iter().enumerate().filter(|(_, s)| s.is_body == is_body);
        of_kind.flat_map(|(index, surface)| leaves(index, surface, &mut found)).collect::<Vec<_>>()
    });
    let (tree, bodies) =
        rayon::join(|| RTree::bulk_load(cloths.clone()), || RTree::bulk_load(bodies));
    let looked = cloths.par_iter().with_min_len(TASK).fold(Looked::default, |mut looked, leaf| {
        let around = leaf.envelope();
        // The tree has every pair of cloths in both orders.
        let later = tree.locate_in_envelope_intersecting(around);
        for other in later.filter(|other| leaf.key() < other.key()) {
            if look(leaf, other, &mut looked) {
                let is_within = leaf.surface == other.surface;
                looked.within += u64::from(is_within);
                looked.between += u64::from(!is_within);
            }
        }
        for body in bodies.locate_in_envelope_intersecting(around) {
            let (first, second) = if leaf.key() < body.key() { (leaf, body) } else { (body, leaf) };
            looked.bodies += u64::from(look(first, second, &mut looked));
        }
        looked
    });
    let mut looked = looked.reduce(Looked::default, Looked::with);
    // An edge is of two triangles.
    looked.crossings.sort_unstable();
    looked.crossings.dedup();
    (found, looked)
}

/// Triangles that a thread looks at, at least.
const TASK: usize = 256;

/// What has been found among some triangles.
#[derive(Default)]
struct Looked {
    within: u64,
    between: u64,
    bodies: u64,
    crossings: Vec<Crossing>,
    first: Option<Intersection>,
}

impl Looked {
    fn with(mut self, mut other: Self) -> Self {
        self.within += other.within;
        self.between += other.between;
        self.bodies += other.bodies;
        self.crossings.append(&mut other.crossings);
        other.first.into_iter().for_each(|pair| self.first_set(pair));
        self
    }

    fn first_set(&mut self, pair: Intersection) {
        let order = |pair: &Intersection| (pair.surfaces, pair.triangles);
        if self.first.as_ref().is_none_or(|first| order(&pair) < order(first)) {
            self.first = Some(pair);
        }
    }
}

/// Whether two triangles intersect, with what is known of it noted.
fn look(first: &Leaf, second: &Leaf, looked: &mut Looked) -> bool {
    let common = common(&first.corners, &second.corners);
    let Some(place) = common.place else { return false };
    for crossing in &common.crossings {
        let other = if crossing.is_second { first } else { second };
        let mut edge = crossing.edge;
        edge.sort_unstable();
        looked.crossings.push(Crossing {
            edge_surface: (edge[0] >> 32) as usize,
            edge: edge.map(|particle| particle as u32),
            surface: other.surface,
            triangle: other.triangle,
        });
    }
    looked.first_set(Intersection {
        surfaces: [first.surface, second.surface],
        triangles: [first.triangle, second.triangle],
        place,
    });
    true
}

/// The triangles of a surface that can be looked at.
fn leaves(index: usize, surface: &Surface<'_>, found: &mut Intersections) -> Vec<Leaf> {
    let corner = |particle: u32| {
        let point = *surface.positions.get(particle as usize)?;
        // As `robust` multiplies three of them, larger ones would overflow.
        let is_usable = point.iter().all(|x| x.abs() < 1e100);
        let particle = ((index as u64) << 32) | u64::from(particle);
        is_usable.then_some(Corner { particle, point })
    };
    let mut leaves = Vec::with_capacity(surface.triangles.len());
    for (triangle, &[a, b, c]) in surface.triangles.iter().enumerate() {
        match (corner(a), corner(b), corner(c)) {
            (Some(a), Some(b), Some(c)) => {
                leaves.push(Leaf { surface: index, triangle, corners: [a, b, c] });
            }
            _ => found.unusable += 1,
        }
    }
    leaves
}

#[cfg(test)]
mod tests;
