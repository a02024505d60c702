//! Closest points of surfaces.

use cloth_core::TriangleMesh;
use rapier3d_f64::parry::{
    query::PointQueryWithLocation,
    shape::{TriMesh, TrianglePointLocation},
};

use crate::{RigidError, mesh::vector};

/// A surface of triangles that is asked for the points closest to others.
#[derive(Clone, Debug)]
pub struct ClosestPoints {
    shape: TriMesh,
}

/// The point of a surface that is closest to another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClosestPoint {
    /// The triangle that it lies in.
    pub face: u32,
    /// Weights of the corners of that triangle, 1 together.
    pub weights: [f64; 3],
    /// Distance \[m\].
    pub distance: f64,
}

impl ClosestPoints {
    /// Of the triangles of `mesh`, open or closed; `name` is the name used in errors.
    ///
    /// # Errors
    /// [`RigidError`] for vertices that are no numbers, faces that name vertices which do not exist, and a mesh without faces.
    pub fn new(name: &str, mesh: &TriangleMesh) -> Result<Self, RigidError> {
        let name = || name.to_owned();
        if let Some(&value) = mesh.positions.iter().flatten().find(|value| !value.is_finite()) {
            return Err(RigidError::Number {
                name: name(),
                what: "a vertex",
                value,
                positive: false,
            });
        }
        let vertices = mesh.positions.len();
        for (face, triangle) in mesh.triangles.iter().enumerate() {
            if let Some(&vertex) = triangle.iter().find(|&&vertex| vertex as usize >= vertices) {
                return Err(RigidError::FaceOutOfRange { name: name(), face, vertex, vertices });
            }
        }
        let positions = mesh.positions.iter().copied().map(vector).collect();
        let shape = TriMesh::new(positions, mesh.triangles.clone())
            .map_err(|error| RigidError::Shape { name: name(), problem: error.to_string() })?;
        Ok(Self { shape })
    }

    /// The closest point to `point` \[m\].
    #[must_use]
    pub fn of(&self, point: [f64; 3]) -> ClosestPoint {
        let point = vector(point);
        let (found, (face, place)) = self.shape.project_local_point_and_get_location(point, false);
        let weights = match place {
            TrianglePointLocation::OnVertex(corner) => {
                std::array::from_fn(|k| f64::from(u8::from(k == corner as usize)))
            }
            _ => place.barycentric_coordinates().unwrap_or([1.0, 0.0, 0.0]),
        };
        ClosestPoint { face, weights, distance: (found.point - point).length() }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn points_over_a_face_an_edge_and_a_corner() {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
        let mesh = TriangleMesh { positions, triangles: vec![[0, 1, 2]], ..Default::default() };
        let surface = ClosestPoints::new("it", &mesh).unwrap();
        for (point, weights, distance) in [
            ([0.25, 0.25, -0.5], [0.5, 0.25, 0.25], 0.5),
            ([0.25, -2.0, 0.0], [0.75, 0.25, 0.0], 2.0),
            ([4.0, 0.0, 4.0], [0.0, 1.0, 0.0], 5.0),
        ] {
            let found = surface.of(point);
            assert!((found.distance - distance).abs() < 1e-12, "{found:?}");
            let error = (0..3).map(|k| (found.weights[k] - weights[k]).abs());
            assert!(error.fold(0.0, f64::max) < 1e-12, "{found:?}");
        }
        let bad = TriangleMesh { triangles: vec![[0, 1, 3]], ..mesh };
        assert!(matches!(
            ClosestPoints::new("it", &bad),
            Err(RigidError::FaceOutOfRange { vertex: 3, .. })
        ));
    }
}
