//! `contact_geometry` of planes (NUMERICS §15): cloth touches a half space with its vertices.

use rayon::prelude::*;

use crate::Real;

use super::{ContactKey, ContactKind, ContactStencil, ContactSurface, cross, dot, sub};

/// Particles that a thread looks at, at least.
const TASK: usize = 2048;

/// Where a plane is, by its nodes.
#[derive(Clone, Copy)]
pub(super) struct Frame<T> {
    origin: [T; 3],
    sides: [[T; 3]; 2],
    pub(super) normal: [T; 3],
}

impl<T: Real> Frame<T> {
    pub(super) fn new(nodes: [u32; 3], at: impl Fn(u32) -> [T; 3]) -> Self {
        let [origin, first, second] = nodes.map(at);
        let sides = [sub(first, origin), sub(second, origin)];
        let normal = cross(sides[0], sides[1]);
        // Rounding has the sides a little off.
        let inverse = T::ONE / dot(normal, normal).sqrt();
        Self { origin, sides, normal: normal.map(|component| component * inverse) }
    }

    /// How far a place is outside.
    pub(super) fn height(&self, x: [T; 3]) -> T {
        dot(sub(x, self.origin), self.normal)
    }
}

impl ContactSurface {
    /// Puts the contacts of particles with planes in `out`, in any order. `at` says where particles and nodes are, `start` where they were when the
    /// substep began: what was below already is not thrown up by a force, but for `collider_response` to take out.
    pub fn plane_contacts<T: Real>(
        &self,
        at: impl Fn(u32) -> [T; 3] + Sync,
        start: impl Fn(u32) -> [T; 3] + Sync,
        out: &mut Vec<Option<ContactStencil<T>>>,
    ) {
        let reach = T::from_f64(self.reach());
        for body in self.bodies() {
            let Some(nodes) = body.plane() else { continue };
            let (now, before) = (Frame::new(nodes, &at), Frame::new(nodes, &start));
            let particles = (0..self.own_particles()).into_par_iter().with_min_len(TASK);
            let contact = |i| {
                let x = at(i);
                let gap = now.height(x);
                if !(gap < reach && before.height(start(i)) > T::ZERO) {
                    return None;
                }
                let (reach, friction) = self.coupling_with_plane(i, nodes[0]);
                let reach = T::from_f64(reach);
                let arm = sub(x, now.origin);
                let [u, v] = now.sides.map(|side| dot(arm, side));
                (gap < reach).then(|| ContactStencil {
                    key: ContactKey {
                        kind: ContactKind::VertexPlane,
                        first: i,
                        second: body.collider,
                    },
                    particles: [i, nodes[0], nodes[1], nodes[2]],
                    weights: [T::ONE, (u + v) - T::ONE, -u, -v],
                    normal: now.normal,
                    gap,
                    reach,
                    friction: T::from_f64(friction),
                })
            };
            out.par_extend(particles.filter_map(contact).map(Some));
        }
    }
}
