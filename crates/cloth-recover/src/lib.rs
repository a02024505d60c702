//! Pulls cloth apart that intersects at the start of a simulation, which contact cannot: it keeps apart what is apart.
//!
//! Each round finds the edges that go through triangles, exactly ([`cloth_audit`]), joins them to the contours along which two sheets intersect, and
//! moves the sheets of each contour against each other:
//!
//! 1. cloth goes out of a closed body;
//! 2. of two layers, if they are given, the higher one goes in front of the lower one;
//! 3. of two other pieces of cloth the smallest part that the contours cut off goes back through the other piece (the global analysis of Baraff,
//!    Witkin and Kass 2003); a contour that ends within a piece gives each of its sides what is nearer to it;
//! 4. a piece that goes through itself is moved in the direction in which the contour becomes shorter (Volino and Magnenat-Thalmann 2006, their global scheme).
//!
//! The cloth around follows, and edges are brought back to their lengths. All is of double precision and in a fixed order, so that the result
//! has the same bits on every machine.
//!
//! ```
//! use cloth_recover::{Cloth, recover};
//!
//! // A corner of the upper triangle pokes through the lower one.
//! let mut positions = [
//!     [0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0],
//!     [0.2, 0.2, -0.02], [0.2, 1.2, 0.3], [1.2, 0.2, 0.3],
//! ];
//! let cloth = Cloth { triangles: &[[0, 1, 2], [3, 4, 5]], is_held: &[], layers: &[] };
//! let found = recover(&mut positions, &cloth, &[], 0.004);
//! assert!(found.before > 0 && found.after == 0);
//! ```

mod contours;
mod mesh;
mod place;
mod push;
mod shape;
mod sides;

use cloth_audit::{Surface, crossings};
use glam::DVec3;

use mesh::Surfaces;

/// All cloths as one surface.
#[derive(Clone, Copy, Debug)]
pub struct Cloth<'a> {
    /// Their triangles, by particles. What a closed seam joins is one particle.
    pub triangles: &'a [[u32; 3]],
    /// Whether each particle stays where it is; none does beyond the end.
    pub is_held: &'a [bool],
    /// The layer of each particle, if it has one: of two layers that intersect, the higher one belongs in front of the lower one, where its
    /// triangles are seen counterclockwise.
    pub layers: &'a [Option<u32>],
}

/// A body, which does not move.
#[derive(Clone, Debug)]
pub struct Body {
    /// Its vertices \[m\].
    pub positions: Vec<[f64; 3]>,
    /// Its triangles.
    pub triangles: Vec<[u32; 3]>,
}

/// What became of the intersections.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Recovered {
    /// Edges that went through triangles, each pair once.
    pub before: usize,
    /// Those that still do.
    pub after: usize,
    /// Rounds that it took.
    pub rounds: u32,
    /// How far a particle was moved at most \[m\].
    pub moved: f64,
}

/// How cloth is pushed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Effort {
    /// Little is taken along, and short contours are left by short ways.
    Gentle,
    /// Much is taken along, in long ways.
    Strong,
    /// As gentle, and edges need not keep their lengths, which may be what is in the way.
    Loose,
}

impl Effort {
    /// One after the other.
    const fn of(turn: u32) -> Self {
        match turn % 3 {
            0 => Self::Gentle,
            1 => Self::Strong,
            _ => Self::Loose,
        }
    }
}

/// Rounds at most. A round takes some 10 ms for 10,000 triangles.
pub const ROUNDS_MAX: u32 = 1000;

/// Rounds in which nothing becomes better, after which it is given up.
const PATIENCE: u32 = 200;

/// Share of the distance of contact that is made as a gap: more would push tight clothes into bodies.
const GAP: f64 = 0.4;

/// After so many such rounds it goes on with more or less effort, from the best one if things are much worse now.
const STUCK: u32 = 25;

/// Moves particles at `positions` \[m\] until no edge goes through a triangle, with a gap of some part of `distance` \[m\] between them, or
/// until [`ROUNDS_MAX`] or no progress. What could not be parted stays as in the best round.
pub fn recover(
    positions: &mut [[f64; 3]],
    cloth: &Cloth<'_>,
    bodies: &[Body],
    distance: f64,
) -> Recovered {
    let start: Vec<DVec3> = positions.iter().copied().map(DVec3::from).collect();
    let surfaces = Surfaces::new(cloth.triangles, positions.len(), bodies);
    let shape = shape::Shape::new(&surfaces.cloth, &start, cloth.is_held);
    let mut at = start.clone();
    let mut best: Option<(usize, Vec<DVec3>)> = None;
    let mut found = Recovered::default();
    let mut since_best = 0;
    let mut memory = sides::Memory::default();
    loop {
        let crossed = {
            let places: Vec<[f64; 3]> = at.iter().map(|x| x.to_array()).collect();
            let own = Surface::cloth(&places, cloth.triangles);
            let others = bodies.iter().map(|body| Surface::body(&body.positions, &body.triangles));
            crossings(&std::iter::once(own).chain(others).collect::<Vec<_>>())
        };
        if found.rounds == 0 {
            found.before = crossed.len();
        }
        if best.as_ref().is_none_or(|(least, _)| crossed.len() < *least) {
            best = Some((crossed.len(), at.clone()));
            since_best = 0;
        } else {
            since_best += 1;
        }
        if crossed.is_empty() || found.rounds == ROUNDS_MAX || since_best == PATIENCE {
            break;
        }
        found.rounds += 1;
        let effort = Effort::of(since_best / STUCK);
        if let Some((least, best)) = &best
            && since_best.is_multiple_of(STUCK)
            && crossed.len() > least + least / 2
        {
            at.clone_from(best);
            continue;
        }
        let pushes = push::Pushes {
            surfaces: &surfaces,
            cloth,
            gap: GAP * distance,
            edge: shape.mean_edge(),
            effort,
        };
        let ways = pushes.ways(&at, &crossed, &mut memory);
        for (x, way) in at.iter_mut().zip(&ways) {
            *x += *way;
        }
        if effort != Effort::Loose {
            shape.restore(&mut at);
        }
    }
    let (after, at) = best.unwrap_or((0, start.clone()));
    found.after = after;
    for ((out, x), start) in positions.iter_mut().zip(&at).zip(&start) {
        // What was not moved keeps its bits.
        if x != start {
            *out = x.to_array();
            found.moved = found.moved.max(x.distance(*start));
        }
    }
    found
}

#[cfg(test)]
mod tests;
