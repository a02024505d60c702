//! Writes binary glTF 2.0: each cloth is a mesh with one morph target per frame, and an animation
//! blends from target to target. Blender reads the targets as shape keys.

use std::borrow::Cow;
use std::collections::{BTreeMap, HashMap};
use std::io::Write;

use ::gltf::binary::{Glb, Header};
use gltf_json::accessor::Type;
use gltf_json::animation::{Animation, Channel, Interpolation, Property, Sampler, Target};
use gltf_json::material::{PbrBaseColorFactor, PbrMetallicRoughness, StrengthFactor};
use gltf_json::mesh::{Mode, MorphTarget, Primitive, Semantic};
use gltf_json::validation::Checked::Valid;
use gltf_json::{Index, Material, Mesh, Node, Scene};

use super::container::{ContainerOptions, ContainerSource};
use super::gltf_builder::{GltfBuilder, push};
use super::output::output_write;
use super::{FrameError, StoredFrame, Topology, TopologyCloth, vertex_normals};
use crate::picture::picture_palette;

/// Morph targets that every web viewer can hold: WebGL promises that many texture layers.
const TARGET_LIMIT: usize = 255;

/// The least stride that keeps number and size of the morph targets within the limits.
pub(super) fn automatic_stride(
    topology: &Topology,
    frame_count: usize,
    options: &ContainerOptions,
) -> usize {
    let target_size = target_size(topology, options).max(1);
    let fitting = usize::try_from(options.gltf_size / target_size).unwrap_or(usize::MAX);
    // The first frame is the mesh itself and no target.
    let frames = fitting.clamp(1, TARGET_LIMIT) + 1;
    frame_count.div_ceil(frames).max(1)
}

/// Bytes that one frame takes, as long as texture seams split few vertices.
fn target_size(topology: &Topology, options: &ContainerOptions) -> u64 {
    let vectors = if options.gltf_normals { 2 } else { 1 };
    12 * vectors * topology.particle_count as u64
}

pub(super) fn write(source: &ContainerSource<'_>) -> Result<(), FrameError> {
    let needed = target_size(source.topology, source.options) * source.frames.len() as u64;
    let limit = u64::from(u32::MAX);
    let too_large =
        |needed| FrameError::Size { file: source.path.to_owned(), unit: "bytes", needed, limit };
    if needed > limit {
        return Err(too_large(needed));
    }
    let frames: Vec<FrameVectors> = source
        .frames
        .iter()
        .map(|&index| Ok(FrameVectors::of(source.store.frame(index)?, source.topology)))
        .collect::<Result<_, FrameError>>()?;

    let mut builder = GltfBuilder::new();
    let mut nodes = Vec::new();
    for (number, cloth) in source.topology.cloths.iter().enumerate() {
        nodes.push(add_cloth(&mut builder, source, number, cloth, &frames));
    }
    if frames.len() > 1 {
        add_animation(&mut builder, &nodes, &frames);
    }
    let scene = Scene { nodes, name: None, extensions: None, extras: Default::default() };
    builder.root.scene = Some(push(&mut builder.root.scenes, scene));

    let (root, bytes) = builder.finish();
    let json = gltf_json::serialize::to_vec(&root).map_err(FrameError::write(source.path))?;
    let size = json.len() as u64 + bytes.len() as u64 + 64;
    if size > limit {
        return Err(too_large(size));
    }
    let glb = Glb {
        // The writer of the library fills in the length.
        header: Header { magic: *b"glTF", version: 2, length: 0 },
        json: Cow::Owned(json),
        bin: Some(Cow::Owned(bytes)),
    };
    output_write(source.path, |writer| {
        glb.to_writer(writer.by_ref()).map_err(FrameError::write(source.path))
    })
}

/// Positions \[m\] and normals of a frame in the axes of glTF, which is Y-up.
struct FrameVectors {
    time: f32,
    positions: Vec<[f32; 3]>,
    normals: Vec<[f32; 3]>,
}

impl FrameVectors {
    fn of(frame: StoredFrame, topology: &Topology) -> Self {
        let normals = vertex_normals(&frame.positions_f64(), &topology.triangles);
        let unit = |normal: [f64; 3]| match normal {
            // The format wants unit vectors also where no triangle is.
            [0.0, 0.0, 0.0] => [0.0, 1.0, 0.0],
            normal => y_up(normal.map(|x| x as f32)),
        };
        Self {
            time: frame.time as f32,
            positions: frame.positions.into_iter().map(y_up).collect(),
            normals: normals.into_iter().map(unit).collect(),
        }
    }
}

/// Turns a Z-up vector to Y-up.
fn y_up([x, y, z]: [f32; 3]) -> [f32; 3] {
    [x, z, -y]
}

/// The vertices of a cloth: glTF has one index per vertex, so texture seams split particles.
struct SplitVertices {
    particles: Vec<usize>,
    coordinates: Option<Vec<[f32; 2]>>,
    triangles: Vec<[u32; 3]>,
}

impl SplitVertices {
    fn of(topology: &Topology, cloth: &TopologyCloth) -> Self {
        let Some(texture) = &topology.texture else {
            let start = cloth.particles.start as u32;
            let triangles = &topology.triangles[cloth.triangles.clone()];
            return Self {
                particles: cloth.particles.clone().collect(),
                coordinates: None,
                triangles: triangles.iter().map(|t| t.map(|i| i - start)).collect(),
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
        Self { particles, coordinates: Some(coordinates), triangles }
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

fn add_cloth(
    builder: &mut GltfBuilder,
    source: &ContainerSource<'_>,
    number: usize,
    cloth: &TopologyCloth,
    frames: &[FrameVectors],
) -> Index<Node> {
    let vertices = SplitVertices::of(source.topology, cloth);
    let first = &frames[0];
    let mut attributes = BTreeMap::new();
    let positions = builder.vectors(&vertices.gather(&first.positions), Type::Vec3);
    attributes.insert(Valid(Semantic::Positions), positions);
    let normals = builder.vectors(&vertices.gather(&first.normals), Type::Vec3);
    attributes.insert(Valid(Semantic::Normals), normals);
    if let Some(coordinates) = &vertices.coordinates {
        let coordinates = builder.vectors(coordinates, Type::Vec2);
        attributes.insert(Valid(Semantic::TexCoords(0)), coordinates);
    }
    let indices = builder.indices(&vertices.triangles);

    let mut targets = Vec::with_capacity(frames.len() - 1);
    for frame in &frames[1..] {
        let positions = vertices.gather_change(&first.positions, &frame.positions);
        let normals = source
            .options
            .gltf_normals
            .then(|| vertices.gather_change(&first.normals, &frame.normals));
        targets.push(MorphTarget {
            positions: Some(builder.vectors(&positions, Type::Vec3)),
            normals: normals.map(|normals| builder.vectors(&normals, Type::Vec3)),
            tangents: None,
        });
    }
    let color = source.options.style.cloth_colors.get(number).copied();
    let material = material(cloth, color.unwrap_or_else(|| picture_palette(number)));
    let material = push(&mut builder.root.materials, material);
    let weights = (!targets.is_empty()).then(|| vec![0.0; targets.len()]);
    let mesh = Mesh {
        name: Some(cloth.name.clone()),
        primitives: vec![Primitive {
            attributes,
            indices: Some(indices),
            material: Some(material),
            mode: Valid(Mode::Triangles),
            targets: (!targets.is_empty()).then_some(targets),
            extensions: None,
            extras: Default::default(),
        }],
        weights,
        extensions: None,
        extras: Default::default(),
    };
    let mesh = push(&mut builder.root.meshes, mesh);
    let node = Node { name: Some(cloth.name.clone()), mesh: Some(mesh), ..Node::default() };
    push(&mut builder.root.nodes, node)
}

fn material(cloth: &TopologyCloth, color: [u8; 3]) -> Material {
    let [red, green, blue] = color.map(|channel| (f32::from(channel) / 255.0).powf(2.2));
    Material {
        name: Some(cloth.name.clone()),
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

/// Blends the weight of each target up to its frame and down after it, for all cloths alike.
fn add_animation(builder: &mut GltfBuilder, nodes: &[Index<Node>], frames: &[FrameVectors]) {
    let start = frames[0].time;
    let times: Vec<f32> = frames.iter().map(|frame| frame.time - start).collect();
    let target_count = frames.len() - 1;
    let mut weights = vec![0.0; frames.len() * target_count];
    for target in 0..target_count {
        weights[(target + 1) * target_count + target] = 1.0;
    }
    let input = builder.numbers(&times);
    let output = builder.numbers(&weights);
    let sampler = Sampler {
        input,
        output,
        interpolation: Valid(Interpolation::Linear),
        extensions: None,
        extras: Default::default(),
    };
    let channel = |&node: &Index<Node>| Channel {
        sampler: Index::new(0),
        target: Target {
            node,
            path: Valid(Property::MorphTargetWeights),
            extensions: None,
            extras: Default::default(),
        },
        extensions: None,
        extras: Default::default(),
    };
    builder.root.animations.push(Animation {
        name: Some("simulation".to_owned()),
        samplers: vec![sampler],
        channels: nodes.iter().map(channel).collect(),
        extensions: None,
        extras: Default::default(),
    });
}
