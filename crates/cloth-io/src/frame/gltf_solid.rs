//! Colliders and rigid bodies in glTF files.

use std::collections::BTreeMap;

use cloth_core::Pose;
use gltf_json::accessor::Type;
use gltf_json::animation::Property;
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::scene::UnitQuaternion;
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Node};

use super::gltf::{FrameVectors, y_up};
use super::gltf_animation::{Motion, Vectors};
use super::gltf_builder::{GltfBuilder, push};
use super::gltf_cloth::{material, mesh_node};
use super::solids::Solid;

/// Colour of solids as sRGB.
const COLOUR: [u8; 3] = [176, 172, 166];

/// Adds `solid` as a node that stands where the pose of the first frame has it and moves with the others.
/// A shape that changes has morph targets like a cloth.
pub(super) fn solid_add(
    builder: &mut GltfBuilder,
    motion: &mut Motion,
    solid: &Solid,
    poses: &[Pose],
    times: &[f64],
) -> Index<Node> {
    let shape =
        |&time: &f64| FrameVectors::of_mesh(time, &solid.positions_at(time), &solid.triangles);
    let first = shape(&times[0]);
    let positions = builder.vectors(&first.positions, Type::Vec3);
    let normals = builder.vectors(&first.normals, Type::Vec3);
    let attributes = BTreeMap::from([
        (Valid(Semantic::Positions), positions),
        (Valid(Semantic::Normals), normals),
    ]);
    let mut targets = Vec::new();
    if solid.changes() {
        for later in times[1..].iter().map(shape) {
            let positions = changes(&first.positions, &later.positions);
            let normals = changes(&first.normals, &later.normals);
            targets.push(MorphTarget {
                positions: Some(builder.vectors(&positions, Type::Vec3)),
                normals: Some(builder.vectors(&normals, Type::Vec3)),
                tangents: None,
            });
        }
    }
    let material = push(&mut builder.root.materials, material(&solid.name, COLOUR));
    let target_count = targets.len();
    let primitive = Primitive {
        attributes,
        indices: Some(builder.indices(&solid.triangles)),
        material: Some(material),
        mode: Valid(Mode::Triangles),
        targets: (target_count > 0).then_some(targets),
        extensions: None,
        extras: Default::default(),
    };
    let node = mesh_node(builder, &solid.name, vec![primitive], target_count);
    if target_count > 0 {
        motion.targets_of(node);
    }
    let translations: Vec<[f32; 3]> = poses.iter().map(|pose| y_up(pose.translation)).collect();
    let rotations = rotations(poses);
    let placed = &mut builder.root.nodes[node.value()];
    placed.translation = translations.first().copied();
    placed.rotation = rotations.first().copied().map(UnitQuaternion);
    motion.vectors_of(node, Property::Translation, Vectors::Three(translations));
    motion.vectors_of(node, Property::Rotation, Vectors::Four(rotations));
    node
}

/// The rotations of `poses` as quaternions x, y, z, w in the axes of glTF.
fn rotations(poses: &[Pose]) -> Vec<[f32; 4]> {
    let mut rotations: Vec<[f32; 4]> = Vec::with_capacity(poses.len());
    for pose in poses {
        let [x, y, z, w] = pose.rotation;
        // The axis turns like any vector.
        let [x, y, z] = y_up([x, y, z]);
        let mut rotation = [x, y, z, w as f32];
        // Of the two quaternions of a rotation the one nearer to that before: players that blend the
        // numbers one by one then take the short way, too.
        let dot = rotations
            .last()
            .map(|last| last.iter().zip(&rotation).map(|(a, b)| a * b).sum::<f32>());
        if dot.is_some_and(|dot| dot < 0.0) {
            rotation = rotation.map(|number| -number);
        }
        rotations.push(rotation);
    }
    rotations
}

fn changes(from: &[[f32; 3]], to: &[[f32; 3]]) -> Vec<[f32; 3]> {
    let pairs = from.iter().zip(to);
    pairs.map(|(from, to)| std::array::from_fn(|axis| to[axis] - from[axis])).collect()
}
