//! Where an edge goes through a triangle.

use cloth_audit::Crossing;
use glam::DVec3;

use crate::mesh::{Surfaces, normal};

/// A crossing in space.
pub(crate) struct Place {
    /// The ends of the edge.
    pub(crate) ends: [DVec3; 2],
    /// Normal of the triangle.
    pub(crate) normal: DVec3,
    /// How far the ends are in front of it \[m\].
    pub(crate) heights: [f64; 2],
    /// The point that edge and triangle have in common.
    pub(crate) point: DVec3,
    /// Particles of cloth with their shares in that point, along the edge.
    pub(crate) edge: Vec<(u32, f64)>,
    /// The same in the triangle. What belongs to a body has none.
    pub(crate) triangle: Vec<(u32, f64)>,
}

impl Place {
    /// `None` for a triangle without area.
    pub(crate) fn new(surfaces: &Surfaces<'_>, at: &[DVec3], crossing: &Crossing) -> Option<Self> {
        let corners = surfaces.corners(at, crossing.surface, crossing.triangle);
        let normal = normal(corners);
        if normal == DVec3::ZERO {
            return None;
        }
        let ends = crossing.edge.map(|end| surfaces.point(at, crossing.edge_surface, end));
        let heights = ends.map(|end| normal.dot(end - corners[0]));
        let between = heights[0] - heights[1];
        let share = if between == 0.0 { 0.5 } else { (heights[0] / between).clamp(0.0, 1.0) };
        let point = ends[0].lerp(ends[1], share);
        let [a, b] = crossing.edge;
        let edge = match crossing.edge_surface {
            0 => vec![(a, 1.0 - share), (b, share)],
            _ => vec![],
        };
        let triangle = match crossing.surface {
            0 => {
                let of = surfaces.cloth.triangles[crossing.triangle];
                of.into_iter().zip(weights(point, corners)).collect()
            }
            _ => vec![],
        };
        Some(Self { ends, normal, heights, point, edge, triangle })
    }

    /// The way of the edge, relative to the triangle, in which the contour becomes shorter, by so much for each unit of way. `across` are the third
    /// corners of the edge's triangles: the contour goes on in each of them. With d the direction of the contour there, e that of the edge and n the
    /// normal, the point of the crossing moves by u - e (u . n) / (e . n) along the triangle when the edge moves by u, and the contour becomes shorter by d . that.
    pub(crate) fn shorter(&self, across: impl Iterator<Item = DVec3>) -> DVec3 {
        let along = (self.ends[1] - self.ends[0]).normalize_or_zero();
        let steep = along.dot(self.normal);
        let mut way = DVec3::ZERO;
        for corner in across {
            let into = corner - self.ends[0];
            let into = into - into.dot(along) * along;
            let line = self.normal.cross(along.cross(into)).normalize_or_zero();
            let line = if line.dot(into) < 0.0 { -line } else { line };
            way += line;
            if steep.abs() > LEAST_STEEP {
                way -= along.dot(line) / steep * self.normal;
            }
        }
        way
    }
}

/// Edges that are flatter on a triangle say nothing of its normal.
const LEAST_STEEP: f64 = 1e-2;

/// Shares of the corners of a triangle in a point of its plane, none negative.
fn weights(point: DVec3, [a, b, c]: [DVec3; 3]) -> [f64; 3] {
    let whole = (b - a).cross(c - a);
    let square = whole.length_squared();
    let part = |p: DVec3, q: DVec3| (p - point).cross(q - point).dot(whole) / square;
    let shares = [part(b, c), part(c, a), part(a, b)].map(|share| share.clamp(0.0, 1.0));
    let sum: f64 = shares.iter().sum();
    shares.map(|share| share / sum.max(f64::MIN_POSITIVE))
}
