//! Lines and points as thin solids, for pictures, which show triangles alone.

use std::borrow::Cow;
use std::ops::Range;

use cloth_core::TextureMap;
use glam::DVec3;

use super::Topology;

/// Radius of a line as a share of the mean length of all lines.
const RADIUS_SHARE: f64 = 0.1;
/// Radius of points where there is no line, as a share of the diagonal of the box around all particles.
const POINT_SHARE: f64 = 0.005;
/// Sides of a tube.
const SIDES: u32 = 6;

/// What a picture shows of the cloths.
pub(super) struct PictureMesh<'a> {
    pub(super) positions: Cow<'a, [[f64; 3]]>,
    pub(super) triangles: Cow<'a, [[u32; 3]]>,
    pub(super) texture: Option<Cow<'a, TextureMap>>,
    /// Ranges of triangles with the number of their cloth.
    pub(super) cloths: Vec<(usize, Range<usize>)>,
}

impl<'a> PictureMesh<'a> {
    /// The triangles of `topology` as they are, its lines as tubes and its points as octahedra.
    pub(super) fn of(topology: &'a Topology, positions: &'a [[f64; 3]]) -> Self {
        let triangles = topology.cloths.iter().map(|cloth| cloth.triangles.clone());
        let mut mesh = Self {
            positions: positions.into(),
            triangles: topology.triangles.as_slice().into(),
            texture: topology.texture.as_ref().map(Cow::Borrowed),
            cloths: triangles.enumerate().filter(|(_, range)| !range.is_empty()).collect(),
        };
        let radius = radius(topology, positions);
        for (number, cloth) in topology.cloths.iter().enumerate() {
            if !cloth.triangles.is_empty() {
                continue;
            }
            let start = mesh.triangles.len();
            let place = |particle: u32| DVec3::from(positions[particle as usize]);
            for line in &topology.lines[cloth.lines.clone()] {
                mesh.tube(line.map(place), radius);
            }
            for point in topology.points(cloth) {
                mesh.octahedron(place(point), 2.0 * radius);
            }
            mesh.cloths.push((number, start..mesh.triangles.len()));
        }
        // Pictures put the pattern of the texture on the first triangles alone, and want all of them.
        if let Some(texture) =
            mesh.texture.as_mut().filter(|t| t.triangles.len() < mesh.triangles.len())
        {
            texture.to_mut().triangles.resize(mesh.triangles.len(), [0; 3]);
        }
        mesh
    }

    fn tube(&mut self, [a, b]: [DVec3; 2], radius: f64) {
        let axis = (b - a).try_normalize().unwrap_or(DVec3::Z);
        let (side, other) = axis.any_orthonormal_pair();
        let start = self.positions.len() as u32;
        for end in [a, b] {
            for step in 0..SIDES {
                let angle = std::f64::consts::TAU * f64::from(step) / f64::from(SIDES);
                let outward = angle.cos() * side + angle.sin() * other;
                self.positions.to_mut().push((end + radius * outward).to_array());
            }
        }
        for step in 0..SIDES {
            let next = (step + 1) % SIDES;
            let [a, b] = [start + step, start + next];
            let triangles = self.triangles.to_mut();
            triangles.push([a, b, b + SIDES]);
            triangles.push([a, b + SIDES, a + SIDES]);
        }
    }

    fn octahedron(&mut self, middle: DVec3, radius: f64) {
        let start = self.positions.len() as u32;
        for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
            for sign in [-radius, radius] {
                self.positions.to_mut().push((middle + sign * axis).to_array());
            }
        }
        for eighth in 0..8_u32 {
            let corner = |axis: u32| start + 2 * axis + (eighth >> axis & 1);
            let [x, y, z] = [0, 1, 2].map(corner);
            // An odd number of negative sides turns the triangle over.
            let triangle = if eighth.count_ones() % 2 == 1 { [x, y, z] } else { [x, z, y] };
            self.triangles.to_mut().push(triangle);
        }
    }
}

/// Radius of lines \[m\]: thin beside their length, so that the knots of a net stay apart.
fn radius(topology: &Topology, positions: &[[f64; 3]]) -> f64 {
    let place = |particle: u32| DVec3::from(positions[particle as usize]);
    let lengths = topology.lines.iter().map(|line| place(line[0]).distance(place(line[1])));
    let total: f64 = lengths.sum();
    if total > 0.0 {
        return RADIUS_SHARE * total / topology.lines.len() as f64;
    }
    let places = positions.iter().map(|&position| DVec3::from(position));
    let (min, max) = places.fold((DVec3::INFINITY, DVec3::NEG_INFINITY), |(min, max), place| {
        (min.min(place), max.max(place))
    });
    POINT_SHARE * (max - min).length().clamp(0.1, 1e6)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::TopologyCloth;

    #[test]
    fn a_line_is_a_tube_and_a_point_an_octahedron_that_face_outward() {
        let positions = [[0.0; 3], [0.0, 0.0, 2.0], [5.0, 0.0, 0.0]];
        let topology = Topology {
            lines: vec![[0, 1]],
            particle_count: 3,
            cloths: vec![TopologyCloth {
                name: "rope".to_owned(),
                particles: 0..3,
                triangles: 0..0,
                lines: 0..1,
            }],
            frames_per_second: 25.0,
            ..Topology::default()
        };
        topology.check().unwrap();
        let mesh = PictureMesh::of(&topology, &positions);
        assert_eq!(mesh.cloths, [(0, 0..20)]);
        let corner = |index: u32| DVec3::from(mesh.positions[index as usize]);
        for (number, triangle) in mesh.triangles.iter().enumerate() {
            let [a, b, c] = triangle.map(corner);
            let mut outward = (a + b + c) / 3.0;
            if number < 12 {
                outward.z = 0.0;
                assert!(a.truncate().length() < 0.21 && a.z.abs() <= 2.0);
            } else {
                outward.x -= 5.0;
            }
            assert!((b - a).cross(c - a).dot(outward) > 0.0, "triangle {number}");
        }
    }
}
