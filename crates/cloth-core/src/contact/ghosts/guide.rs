//! Guides ghosts between the bodies that pinched them, and lets them go once these have parted.

use std::{f64::consts::PI, ops::Range};

use super::{
    super::{BodyMotion, ContactSurface, Split, cross, dot, sub},
    Ghost, GhostAnchor,
    anchor::gap,
};
use crate::{Model, PinAction, PinControl, Pose, State};

/// The triangles of a ghost are to be this far from all bodies when it is let go \[m\].
const CLEAR: f64 = 1e-4;

/// A place is inside of a body that goes around it by this share or more, if only one of it is open.
const WINDING: f64 = 0.5;

type Triangle = [[f64; 3]; 3];

/// What is looked at once in a frame, in double precision on every backend.
#[derive(Clone, Debug)]
pub struct GhostGuide {
    cloth: Vec<[u32; 3]>,
    /// Faces of all bodies by nodes, those of one after those of another.
    faces: Vec<[u32; 3]>,
    bodies: Vec<Range<usize>>,
    motion: BodyMotion<f64>,
}

impl GhostGuide {
    /// That of a model, if its triangles touch.
    #[must_use]
    pub fn new(model: &Model) -> Option<Self> {
        let contact = model.self_contact().filter(|contact| contact.is_of_triangles())?;
        let surface = ContactSurface::new(model, contact);
        let first = model.particle_count() as u32;
        let (mut faces, mut bodies) = (Vec::new(), Vec::new());
        for body in surface.bodies() {
            let start = faces.len();
            faces.extend(body.triangles().iter().map(|face| face.map(|node| node - first)));
            bodies.push(start..faces.len());
        }
        let cloth = surface.triangles()[..surface.cloth_triangles()].to_vec();
        Some(Self { cloth, faces, bodies, motion: BodyMotion::new(model) })
    }

    /// What becomes of `ghosts` in a frame that starts at `state`, and at whose end, at time `end` \[s\], colliders are at `poses`. Those that are
    /// outside of all bodies are none any more. `controlled` are moved by somebody else in this frame.
    pub fn pins(
        &mut self,
        model: &Model,
        ghosts: &mut Vec<Ghost>,
        state: &State,
        (poses, end): (&[Pose], f64),
        controlled: &[PinControl],
    ) -> Vec<PinControl> {
        // A file may tell anything.
        let count = self.motion.end().len();
        let is_node = |node: &u32| (*node as usize) < count;
        for ghost in &mut *ghosts {
            ghost.anchors.retain(|anchor| anchor.nodes.iter().all(is_node));
        }
        self.motion.state_write(model, state);
        let now = self.motion.end().to_vec();
        let free: Vec<bool> = {
            let around = self.triangles_around(ghosts, &state.positions);
            let all = ghosts.iter().zip(&around);
            all.map(|(ghost, triangles)| {
                let place = state.positions[ghost.particle as usize];
                !self.touches(triangles, &now) && !self.surrounds(place, &now)
            })
            .collect()
        };
        let later = State { time: end, colliders: poses.to_vec(), ..State::default() };
        self.motion.state_write(model, &later);
        let nodes = self.motion.end();
        let mut pins = Vec::new();
        for (ghost, free) in ghosts.iter_mut().zip(&free) {
            let particle = ghost.particle;
            let is_held = state.held[particle as usize] != 0;
            let is_of_others = controlled.iter().any(|pin| pin.particle == particle)
                || (is_held && !ghost.is_guided);
            if is_of_others || ghost.anchors.is_empty() {
                ghost.is_guided = false;
            } else if *free {
                if ghost.is_guided {
                    pins.push(PinControl { particle, action: PinAction::Release });
                }
            } else {
                ghost.is_guided = true;
                let target = middle(&ghost.anchors, nodes);
                pins.push(PinControl { particle, action: PinAction::MoveTo(target) });
            }
        }
        let mut free = free.into_iter();
        ghosts.retain(|_| !free.next().unwrap_or_default());
        pins
    }

    /// The triangles of each ghost.
    fn triangles_around(&self, ghosts: &[Ghost], positions: &[[f64; 3]]) -> Vec<Vec<Triangle>> {
        let mut around = vec![Vec::new(); ghosts.len()];
        for triangle in &self.cloth {
            for corner in triangle {
                if let Ok(ghost) = ghosts.binary_search_by_key(corner, |ghost| ghost.particle) {
                    around[ghost].push(triangle.map(|i| positions[i as usize]));
                }
            }
        }
        around
    }

    /// Whether any of these triangles is closer to a body than [`CLEAR`], or goes through it.
    fn touches(&self, triangles: &[Triangle], nodes: &[[f64; 3]]) -> bool {
        let all = bounds(triangles.iter().flatten());
        self.faces.iter().map(|face| face.map(|node| nodes[node as usize])).any(|face| {
            let near = |box_: &[[f64; 3]; 2]| is_near(box_, &bounds(face.iter()));
            near(&all)
                && triangles.iter().any(|triangle| {
                    near(&bounds(triangle.iter()))
                        && (is_close(triangle, &face) || meet(triangle, &face))
                })
        })
    }

    /// Whether a place is inside of a body: by how often it goes around the place (Jacobson and others 2013; the angle is that of Van Oosterom and
    /// Strackee 1983).
    fn surrounds(&self, place: [f64; 3], nodes: &[[f64; 3]]) -> bool {
        self.bodies.iter().any(|body| {
            let angle = |face: &[u32; 3]| {
                let [a, b, c] = face.map(|node| sub(nodes[node as usize], place));
                let [l, m, n] = [a, b, c].map(|v| dot(v, v).sqrt());
                let volume = dot(a, cross(b, c));
                2.0 * volume.atan2(l * m * n + dot(a, b) * n + dot(b, c) * l + dot(c, a) * m)
            };
            let winding = self.faces[body.clone()].iter().map(angle).sum::<f64>() / (4.0 * PI);
            winding.abs() >= WINDING
        })
    }
}

/// The place between all anchors of a ghost \[m\].
fn middle(anchors: &[GhostAnchor], nodes: &[[f64; 3]]) -> [f64; 3] {
    let mut sum = [0.0; 3];
    for place in anchors.iter().map(|anchor| anchor.place(nodes)) {
        for axis in 0..3 {
            sum[axis] += place[axis] / anchors.len() as f64;
        }
    }
    sum
}

fn bounds<'a>(points: impl Iterator<Item = &'a [f64; 3]>) -> [[f64; 3]; 2] {
    points.fold([[f64::INFINITY; 3], [f64::NEG_INFINITY; 3]], |[low, high], x| {
        [std::array::from_fn(|k| low[k].min(x[k])), std::array::from_fn(|k| high[k].max(x[k]))]
    })
}

fn is_near(a: &[[f64; 3]; 2], b: &[[f64; 3]; 2]) -> bool {
    (0..3).all(|k| a[0][k] - b[1][k] < CLEAR && b[0][k] - a[1][k] < CLEAR)
}

const EDGES: [[usize; 2]; 3] = [[0, 1], [1, 2], [2, 0]];

/// Whether a vertex of one is closer than [`CLEAR`] to the other, or an edge to an edge.
fn is_close(a: &Triangle, b: &Triangle) -> bool {
    let of_vertices = |a: &Triangle, b: &Triangle| {
        a.iter().any(|x| gap(&[*x, b[0], b[1], b[2]], Split::VertexTriangle) < CLEAR)
    };
    let of_edges = || {
        EDGES.iter().any(|&[i, j]| {
            EDGES.iter().any(|&[k, l]| gap(&[a[i], a[j], b[k], b[l]], Split::EdgeEdge) < CLEAR)
        })
    };
    of_vertices(a, b) || of_vertices(b, a) || of_edges()
}

/// Whether an edge of one goes through the other, where neither a vertex nor an edge is near anything.
fn meet(a: &Triangle, b: &Triangle) -> bool {
    let volume = |p: [f64; 3], q: [f64; 3], r: [f64; 3], s: [f64; 3]| {
        dot(sub(q, p), cross(sub(r, p), sub(s, p)))
    };
    let goes_through = |[p, q]: [[f64; 3]; 2], &[a, b, c]: &Triangle| {
        let sides = [volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)];
        let is_inside = sides.iter().all(|v| *v > 0.0) || sides.iter().all(|v| *v < 0.0);
        is_inside && (volume(p, a, b, c) > 0.0) != (volume(q, a, b, c) > 0.0)
    };
    let any =
        |a: &Triangle, b: &Triangle| EDGES.iter().any(|&[i, j]| goes_through([a[i], a[j]], b));
    any(a, b) || any(b, a)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_edge_through_a_face_is_found_where_no_feature_is_near() {
        let face = [[-1.0, -1.0, 0.0], [1.0, -1.0, 0.0], [0.0, 2.0, 0.0]];
        let needle = |low: f64| [[0.0, 0.0, low], [0.1, 0.0, low + 2.0], [0.0, 0.1, low + 2.0]];
        assert!(!is_close(&needle(-1.0), &face) && meet(&needle(-1.0), &face));
        assert!(!is_close(&needle(0.5), &face) && !meet(&needle(0.5), &face));
        assert!(is_close(&needle(0.5 * CLEAR), &face), "a tip is near");
    }
}
