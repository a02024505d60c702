//! Cloths and other meshes in glTF files.

use std::collections::{BTreeMap, HashMap};

use gltf_json::accessor::Type;
use gltf_json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Mesh, Node};

use super::gltf::GltfDocument;
use super::gltf_builder::{GltfBuilder, push};
use super::{Topology, TopologyCloth};
use crate::picture::picture_palette;

/// The vertices of a cloth: glTF has one index per vertex, so texture seams split particles.
struct SplitVertices {
    particles: Vec<usize>,
    coordinates: Option<Vec<[f32; 2]>>,
    triangles: Vec<[u32; 3]>,
    lines: Vec<[u32; 2]>,
    points: Vec<[u32; 1]>,
}

impl SplitVertices {
    fn of(topology: &Topology, cloth: &TopologyCloth) -> Self {
        let start = cloth.particles.start as u32;
        // A cloth without triangles has no seams.
        let texture = topology.texture.as_ref().filter(|_| !cloth.triangles.is_empty());
        let Some(texture) = texture else {
            let lines = &topology.lines[cloth.lines.clone()];
            let points = topology.points(cloth);
            let triangles = &topology.triangles[cloth.triangles.clone()];
            return Self {
                particles: cloth.particles.clone().collect(),
                coordinates: None,
                triangles: triangles.iter().map(|t| t.map(|i| i - start)).collect(),
                lines: lines.iter().map(|line| line.map(|i| i - start)).collect(),
                points: points.into_iter().map(|point| [point - start]).collect(),
            };
        };
        let mut numbers = HashMap::new();
        let mut particles = Vec::new();
        let mut coordinates = Vec::new();
        let mut triangles = Vec::new();
        for number in cloth.triangles.clone() {
            let mut triangle = [0; 3];
            for (slot, vertex) in triangle.iter_mut().enumerate() {
                let particle = topology.triangles[number][slot];
                let coordinate = texture.triangles[number][slot];
                *vertex = *numbers.entry((particle, coordinate)).or_insert_with(|| {
                    particles.push(particle as usize);
                    let [u, v] = texture.coordinates[coordinate as usize];
                    // The format has the origin of texture space at the top.
                    coordinates.push([u as f32, (1.0 - v) as f32]);
                    particles.len() as u32 - 1
                });
            }
            triangles.push(triangle);
        }
        // Particles outside all triangles have no coordinate: they are left out.
        let (lines, points) = (Vec::new(), Vec::new());
        Self { particles, coordinates: Some(coordinates), triangles, lines, points }
    }

    fn gather(&self, vectors: &[[f32; 3]]) -> Vec<[f32; 3]> {
        self.particles.iter().map(|&particle| vectors[particle]).collect()
    }

    fn gather_change(&self, from: &[[f32; 3]], to: &[[f32; 3]]) -> Vec<[f32; 3]> {
        let change = |&particle: &usize| {
            let (from, to) = (from[particle], to[particle]);
            [to[0] - from[0], to[1] - from[1], to[2] - from[2]]
        };
        self.particles.iter().map(change).collect()
    }
}

/// Adds the cloth with that `number` as a node with a mesh.
pub(super) fn cloth_add(
    builder: &mut GltfBuilder,
    document: &GltfDocument<'_>,
    number: usize,
    cloth: &TopologyCloth,
) -> Index<Node> {
    let vertices = SplitVertices::of(document.topology, cloth);
    let first = &document.frames[0];
    let mut attributes = BTreeMap::new();
    let positions = builder.vectors(&vertices.gather(&first.positions), Type::Vec3);
    attributes.insert(Valid(Semantic::Positions), positions);
    let has_faces = !vertices.triangles.is_empty();
    if has_faces {
        let normals = builder.vectors(&vertices.gather(&first.normals), Type::Vec3);
        attributes.insert(Valid(Semantic::Normals), normals);
    }
    if let Some(coordinates) = &vertices.coordinates {
        let coordinates = builder.vectors(coordinates, Type::Vec2);
        attributes.insert(Valid(Semantic::TexCoords(0)), coordinates);
    }
    for attribute in document.attributes {
        let value = |&particle: &usize| attribute.values.get(particle).copied().unwrap_or_default();
        let values: Vec<[f32; 1]> = vertices.particles.iter().map(|p| [value(p)]).collect();
        let values = builder.vectors(&values, Type::Scalar);
        attributes.insert(Valid(Semantic::Extras(attribute.name.to_ascii_uppercase())), values);
    }

    let mut targets = Vec::with_capacity(document.frames.len() - 1);
    for frame in &document.frames[1..] {
        let positions = vertices.gather_change(&first.positions, &frame.positions);
        let normals = (document.normals && has_faces)
            .then(|| vertices.gather_change(&first.normals, &frame.normals));
        targets.push(MorphTarget {
            positions: Some(builder.vectors(&positions, Type::Vec3)),
            normals: normals.map(|normals| builder.vectors(&normals, Type::Vec3)),
            tangents: None,
        });
    }
    let colour = document.colours.get(number).copied();
    let material = material(&cloth.name, colour.unwrap_or_else(|| picture_palette(number)));
    let material = push(&mut builder.root.materials, material);
    let mut primitives = Vec::new();
    let mut primitive = |mode, indices| {
        primitives.push(Primitive {
            attributes: attributes.clone(),
            indices: Some(indices),
            material: Some(material),
            mode: Valid(mode),
            targets: (!targets.is_empty()).then(|| targets.clone()),
            extensions: None,
            extras: Default::default(),
        });
    };
    if has_faces {
        primitive(Mode::Triangles, builder.indices(&vertices.triangles));
    }
    if !vertices.lines.is_empty() {
        primitive(Mode::Lines, builder.indices(&vertices.lines));
    }
    if !vertices.points.is_empty() {
        primitive(Mode::Points, builder.indices(&vertices.points));
    }
    mesh_node(builder, &cloth.name, primitives, targets.len())
}

/// Adds `primitives` with `target_count` morph targets as a mesh and its node.
pub(super) fn mesh_node(
    builder: &mut GltfBuilder,
    name: &str,
    primitives: Vec<Primitive>,
    target_count: usize,
) -> Index<Node> {
    let mesh = Mesh {
        name: Some(name.to_owned()),
        primitives,
        weights: (target_count > 0).then(|| vec![0.0; target_count]),
        extensions: None,
        extras: Default::default(),
    };
    let mesh = push(&mut builder.root.meshes, mesh);
    let node = Node { name: Some(name.to_owned()), mesh: Some(mesh), ..Node::default() };
    push(&mut builder.root.nodes, node)
}

/// A rough material of a colour in sRGB.
pub(super) fn material(name: &str, color: [u8; 3]) -> Material {
    let [red, green, blue] = color.map(|channel| (f32::from(channel) / 255.0).powf(2.2));
    Material {
        name: Some(name.to_owned()),
        double_sided: true,
        pbr_metallic_roughness: PbrMetallicRoughness {
            base_color_factor: PbrBaseColorFactor([red, green, blue, 1.0]),
            metallic_factor: StrengthFactor(0.0),
            roughness_factor: StrengthFactor(0.9),
            ..PbrMetallicRoughness::default()
        },
        ..Material::default()
    }
}
