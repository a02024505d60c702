//! Closed meshes.

use std::collections::{BTreeMap, HashMap, HashSet};

use cloth_core::TriangleMesh;
use rapier3d_f64::math::Vector;

use crate::RigidError;

pub(crate) fn vector([x, y, z]: [f64; 3]) -> Vector {
    Vector::new(x, y, z)
}

/// Checks that a mesh bounds a volume; its triangles, counter-clockwise seen from outside. A mesh that
/// is inside out is turned.
pub(crate) fn closed(name: &str, mesh: &TriangleMesh) -> Result<Vec<[u32; 3]>, RigidError> {
    let vertices = mesh.positions.len();
    if let Some(&value) = mesh.positions.iter().flatten().find(|value| !value.is_finite()) {
        let name = name.into();
        return Err(RigidError::Number { name, what: "a vertex", value, positive: false });
    }
    let mut edges: HashMap<[u32; 2], i32> = HashMap::new();
    for (face, triangle) in mesh.triangles.iter().enumerate() {
        if let Some(&vertex) = triangle.iter().find(|&&vertex| vertex as usize >= vertices) {
            return Err(RigidError::FaceOutOfRange { name: name.into(), face, vertex, vertices });
        }
        let [a, b, c] = *triangle;
        for edge in [[a, b], [b, c], [c, a]] {
            *edges.entry(edge).or_default() += 1;
        }
    }
    // In the order of the faces, so that the message does not depend on hashing.
    for &[a, b, c] in &mesh.triangles {
        for edge in [[a, b], [b, c], [c, a]] {
            let [from, to] = edge;
            if from == to || edges[&edge] != 1 || edges.get(&[to, from]) != Some(&1) {
                return Err(RigidError::Open { name: name.into(), edge });
            }
        }
    }
    let volume: f64 = mesh
        .triangles
        .iter()
        .map(|triangle| {
            let [a, b, c] = triangle.map(|vertex| vector(mesh.positions[vertex as usize]));
            a.dot(b.cross(c)) / 6.0
        })
        .sum();
    if !volume.is_normal() {
        return Err(RigidError::Flat { name: name.into() });
    }
    let turned = |&[a, b, c]: &[u32; 3]| if volume < 0.0 { [a, c, b] } else { [a, b, c] };
    Ok(mesh.triangles.iter().map(turned).collect())
}

/// Faces that close the holes of a mesh.
pub(crate) struct Caps {
    /// All faces, those of the mesh first.
    pub(crate) triangles: Vec<[u32; 3]>,
    /// The vertices around each hole. The middle of each is a vertex after those of the mesh.
    rims: Vec<Vec<u32>>,
}

impl Caps {
    /// The vertices with the middles of all holes.
    pub(crate) fn positions(&self, positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut all = positions.to_vec();
        for rim in &self.rims {
            let middle = std::array::from_fn(|axis| {
                let sum: f64 = rim.iter().map(|&vertex| positions[vertex as usize][axis]).sum();
                sum / rim.len() as f64
            });
            all.push(middle);
        }
        all
    }
}

/// Closes every hole by faces from its rim to its middle. What else is wrong with a mesh stays so.
pub(crate) fn holes_close(mesh: &TriangleMesh) -> Caps {
    let mut triangles = mesh.triangles.clone();
    let count = mesh.positions.len() as u32;
    if triangles.iter().flatten().any(|&vertex| vertex >= count) {
        return Caps { triangles, rims: Vec::new() };
    }
    let sides = |&[a, b, c]: &[u32; 3]| [[a, b], [b, c], [c, a]];
    let all: HashSet<[u32; 2]> = mesh.triangles.iter().flat_map(sides).collect();
    let is_rim = |&[a, b]: &[u32; 2]| !all.contains(&[b, a]);
    let rim: Vec<_> = mesh.triangles.iter().flat_map(sides).filter(is_rim).collect();
    // Vertices that the rim joins belong to one hole: the smallest of them stands for it.
    let mut hole: BTreeMap<u32, u32> =
        rim.iter().flatten().map(|&vertex| (vertex, vertex)).collect();
    let mut changed = true;
    while changed {
        changed = false;
        for [a, b] in &rim {
            let least = hole[a].min(hole[b]);
            for vertex in [a, b] {
                changed |= hole.insert(*vertex, least) != Some(least);
            }
        }
    }
    let mut rims: BTreeMap<u32, Vec<u32>> = BTreeMap::new();
    for (&vertex, &least) in &hole {
        rims.entry(least).or_default().push(vertex);
    }
    let middle: BTreeMap<u32, u32> = rims.keys().copied().zip(count..).collect();
    triangles.extend(rim.iter().map(|[a, b]| [*b, *a, middle[&hole[a]]]));
    Caps { triangles, rims: rims.into_values().collect() }
}

/// Whether no vertex is in front of a face, to a millionth of the size.
pub(crate) fn is_convex(positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> bool {
    let size = positions.iter().flatten().fold(0.0_f64, |size, value| size.max(value.abs()));
    triangles.iter().all(|triangle| {
        let [a, b, c] = triangle.map(|vertex| vector(positions[vertex as usize]));
        let normal = (b - a).cross(c - a).normalize_or_zero();
        positions.iter().all(|&position| (vector(position) - a).dot(normal) < 1e-6 * size)
    })
}
