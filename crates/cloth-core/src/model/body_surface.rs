//! Colliders as triangles (NUMERICS §15).

use std::{borrow::Cow, ops::Range};

use super::{ColliderShape, DistanceGrid, GridSets, Model, round_surface::RoundSurface};
use crate::{
    ModelError,
    error::{finite, positive},
};

/// A surface of triangles, closed or open, that may change its shape. It has no inside: cloth touches it from both sides.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct BodySurface {
    /// Vertices of each triangle. Which way they go around does not matter.
    pub triangles: Vec<[u32; 3]>,
    /// Positions of the vertices in the local frame \[m\], as many in each set; at least one set. Between sets vertices go in
    /// straight lines.
    pub sets: Vec<Vec<[f64; 3]>>,
    /// Sets for a second \[1/s\]; the last one holds from its time on. Without meaning for a single set.
    pub rate: f64,
    /// When the first set ends to hold \[s\].
    pub start: f64,
}

impl BodySurface {
    /// A surface that keeps its shape.
    #[must_use]
    pub fn rigid(positions: Vec<[f64; 3]>, triangles: Vec<[u32; 3]>) -> Self {
        Self { triangles, sets: vec![positions], rate: 0.0, start: 0.0 }
    }

    /// The sets that hold at `time` \[s\].
    #[must_use]
    pub fn sets_at(&self, time: f64) -> GridSets {
        GridSets::at(self.sets.len(), self.rate, time - self.start)
    }

    /// The vertices at `time` \[s\].
    #[must_use]
    pub fn positions_at(&self, time: f64) -> Vec<[f64; 3]> {
        self.positions_of(self.sets_at(time))
    }

    fn positions_of(&self, GridSets { index, next, share }: GridSets) -> Vec<[f64; 3]> {
        let set = |number: u32| self.sets.get(number as usize).map_or(&[][..], Vec::as_slice);
        between([set(index), set(next)], share)
    }

    pub(super) fn validate(&self, name: &str) -> Result<(), ModelError> {
        let wrong = |problem: String| {
            Err(ModelError::BodySurface { collider: name.to_owned(), problem: problem.into() })
        };
        let Some(first) = self.sets.first() else {
            return wrong("has no positions: give one set at least".into());
        };
        if self.triangles.is_empty() {
            return wrong("has no triangles: give some".into());
        }
        let count = first.len();
        if let Some((face, triangle)) = (self.triangles.iter().enumerate())
            .find(|(_, triangle)| triangle.iter().any(|&vertex| vertex as usize >= count))
        {
            return wrong(format!(
                "has a triangle {face} of vertices {triangle:?}, and {count} vertices: correct the numbers"
            ));
        }
        for (number, set) in self.sets.iter().enumerate() {
            if set.len() != count {
                let found = set.len();
                return wrong(format!(
                    "has {count} vertices, and {found} in set {number}: give as many in each"
                ));
            }
            let is_odd = |at: &[f64; 3]| at.iter().any(|x| !x.is_finite());
            if let Some(vertex) = set.iter().position(is_odd) {
                let place = set[vertex];
                return wrong(format!(
                    "has vertex {vertex} of set {number} at {place:?}: correct it"
                ));
            }
        }
        finite(|| format!("start of the motion of collider {name:?}"), self.start)?;
        if self.sets.len() > 1 {
            positive(|| format!("sets of positions per second of collider {name:?}"), self.rate)?;
        }
        Ok(())
    }
}

/// A share of the way from one set of positions to another.
fn between([from, to]: [&[[f64; 3]]; 2], share: f64) -> Vec<[f64; 3]> {
    let pairs = from.iter().zip(to);
    pairs.map(|(a, b)| std::array::from_fn(|axis| a[axis] + share * (b[axis] - a[axis]))).collect()
}

/// Faces of a box, whose corner k has the sign of bit a of k along axis a.
const BOX_TRIANGLES: [[u32; 3]; 12] = [
    [0, 2, 3],
    [0, 3, 1],
    [4, 5, 7],
    [4, 7, 6],
    [0, 1, 5],
    [0, 5, 4],
    [2, 6, 7],
    [2, 7, 3],
    [0, 4, 6],
    [0, 6, 2],
    [1, 3, 7],
    [1, 7, 5],
];

/// Where a plane stops cloth that contact has not stopped, relative to its thickness or the distance of contact.
const PLANE_STOP: f64 = 1.0 / 64.0;

impl ColliderShape {
    /// The triangles that this shape is to contact of triangles, if it has a surface of finite size: all shapes but planes. Those of
    /// spheres and capsules are nowhere more than .7 mm inside, up to a radius of 2 m.
    #[must_use]
    pub fn body_triangles(&self) -> Option<Cow<'_, [[u32; 3]]>> {
        match self {
            Self::Plane => None,
            Self::Box { .. } => Some((&BOX_TRIANGLES[..]).into()),
            Self::Grid(grid) => Some((&grid.surface.triangles[..]).into()),
            Self::Surface(surface) => Some((&surface.triangles[..]).into()),
            Self::Sphere { .. } | Self::Capsule { .. } => {
                self.round_surface().map(|surface| surface.triangles().into())
            }
        }
    }

    /// The vertices of these in the local frame \[m\], where these sets hold; none for planes.
    #[must_use]
    pub fn body_positions(&self, sets: GridSets) -> Cow<'_, [[f64; 3]]> {
        match self {
            &Self::Box { half_extents } => {
                let corner = |k: usize| {
                    std::array::from_fn(|axis| {
                        if k >> axis & 1 == 1 { half_extents[axis] } else { -half_extents[axis] }
                    })
                };
                (0..8).map(corner).collect::<Vec<_>>().into()
            }
            Self::Grid(grid) if grid.set_count() <= 1 => (&grid.surface.positions[..]).into(),
            Self::Grid(grid) => grid_positions(grid, sets).into(),
            Self::Surface(surface) if surface.sets.len() == 1 => (&surface.sets[0][..]).into(),
            Self::Surface(surface) => surface.positions_of(sets).into(),
            Self::Plane => (&[][..]).into(),
            Self::Sphere { .. } | Self::Capsule { .. } => {
                self.round_surface().map(RoundSurface::positions).unwrap_or_default().into()
            }
        }
    }

    fn round_surface(&self) -> Option<RoundSurface> {
        match *self {
            Self::Sphere { radius } => Some(RoundSurface::new(0.0, radius)),
            Self::Capsule { half_length, radius } => Some(RoundSurface::new(half_length, radius)),
            _ => None,
        }
    }
}

fn grid_positions(grid: &DistanceGrid, GridSets { index, next, share }: GridSets) -> Vec<[f64; 3]> {
    between([grid.positions_of_set(index), grid.positions_of_set(next)], share)
}

impl Model {
    /// Whether a collider is triangles of infinite mass in contact of triangles, and does nothing else (NUMERICS §15): all but
    /// planes, where triangles of cloths touch each other.
    #[must_use]
    pub fn is_contact_body(&self, collider: usize) -> bool {
        let shape = self.colliders.get(collider).map(|collider| &collider.shape);
        self.has_triangle_contact()
            && shape.is_some_and(|shape| !matches!(shape, ColliderShape::Plane))
    }

    /// Whether a collider is a half space that cloth in contact of triangles touches, vertex by vertex (NUMERICS §15).
    #[must_use]
    pub fn is_contact_plane(&self, collider: usize) -> bool {
        let shape = self.colliders.get(collider).map(|collider| &collider.shape);
        self.has_triangle_contact() && matches!(shape, Some(ColliderShape::Plane))
    }

    /// Whether colliders constrain velocities in implicit steps (NUMERICS §5): not where triangles touch, as all act by contact there.
    #[must_use]
    pub fn has_collider_constraints(&self) -> bool {
        !self.colliders.is_empty() && !self.has_triangle_contact()
    }

    /// How near the middle of a cloth comes to colliders that are not triangles, of each cloth \[m\] (NUMERICS §7, §15): half of its thickness. Where
    /// triangles touch, contact keeps it off planes, and what is stopped here is only what its forces do not stop.
    pub fn collider_offsets(&self) -> impl Iterator<Item = (Range<u32>, f64)> + '_ {
        let contact = self.self_contact().filter(|contact| contact.is_of_triangles());
        self.cloths().iter().map(move |cloth| {
            let offset = match contact {
                Some(contact) => PLANE_STOP * cloth.thickness.max(contact.distance),
                None => 0.5 * cloth.thickness,
            };
            (cloth.particles.clone(), offset)
        })
    }

    /// Whether any collider acts by contact of triangles.
    #[must_use]
    pub fn has_contact_bodies(&self) -> bool {
        (0..self.colliders.len())
            .any(|collider| self.is_contact_body(collider) || self.is_contact_plane(collider))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_box_is_closed_and_its_faces_look_outwards() {
        let shape = ColliderShape::Box { half_extents: [1.0, 2.0, 3.0] };
        let x = shape.body_positions(GridSets::default());
        let mut volume = 0.0;
        let mut edges = std::collections::BTreeMap::new();
        for triangle in shape.body_triangles().unwrap().as_ref() {
            let [a, b, c] = triangle.map(|i| glam::DVec3::from(x[i as usize]));
            volume += a.dot(b.cross(c)) / 6.0;
            for k in 0..3 {
                let [from, to] = [triangle[k], triangle[(k + 1) % 3]];
                *edges.entry([from.min(to), from.max(to)]).or_insert(0) +=
                    if from < to { 1 } else { -1 };
            }
        }
        assert!((volume - 48.0).abs() < 1e-12, "{volume}");
        assert!(edges.len() == 18 && edges.values().all(|&sum| sum == 0));
    }

    #[test]
    fn a_surface_changes_its_shape_in_straight_lines() {
        let sets = vec![vec![[0.0; 3]; 3], vec![[1.0, 0.0, 2.0]; 3], vec![[1.0, 4.0, 2.0]; 3]];
        let surface = BodySurface { triangles: vec![[0, 1, 2]], sets, rate: 2.0, start: 0.0 };
        assert!(surface.validate("it").is_ok());
        assert_eq!(surface.positions_at(0.25)[1], [0.5, 0.0, 1.0]);
        assert_eq!(surface.positions_at(0.75)[2], [1.0, 2.0, 2.0]);
        assert_eq!(surface.positions_at(9.0)[0], [1.0, 4.0, 2.0]);
    }

    #[test]
    fn what_is_wrong_with_a_surface_is_named() {
        let good = BodySurface::rigid(vec![[0.0; 3]; 3], vec![[0, 1, 2]]);
        assert!(good.validate("it").is_ok());
        for (surface, words) in [
            (BodySurface::default(), "no positions"),
            (BodySurface::rigid(vec![[0.0; 3]; 3], vec![]), "no triangles"),
            (BodySurface::rigid(vec![[0.0; 3]; 3], vec![[0, 1, 3]]), "a triangle 0 of vertices"),
            (
                BodySurface::rigid(vec![[0.0; 3], [f64::NAN; 3], [0.0; 3]], vec![[0, 1, 2]]),
                "vertex 1 of set 0",
            ),
            (BodySurface { sets: vec![vec![[0.0; 3]; 3], vec![]], ..good.clone() }, "0 in set 1"),
            (BodySurface { sets: vec![vec![[0.0; 3]; 3]; 2], ..good.clone() }, "per second"),
        ] {
            let message = surface.validate("it").unwrap_err().to_string();
            assert!(message.contains(words) && message.contains("\"it\""), "{message}");
        }
    }
}
