//! Writes binary glTF 2.0: each cloth is a mesh with one morph target per frame, and an animation
//! blends from target to target. Blender reads the targets as shape keys. Solids beside the cloth are
//! meshes that the animation moves and turns.

use std::borrow::Cow;
use std::io::{self, Write};

use ::gltf::binary::{Glb, Header};
use cloth_core::VertexAttribute;
use gltf_json::Scene;

use super::container::{ContainerOptions, ContainerSource};
use super::gltf_animation::Motion;
use super::gltf_builder::{GltfBuilder, push};
use super::gltf_cloth::cloth_add;
use super::gltf_solid::solid_add;
use super::output::output_write;
use super::{Frame, FrameError, FrameSolids, Topology, vertex_normals};

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
    let frame = |&index: &usize| {
        let frame = source.store.frame(index)?;
        let positions = frame.positions_f64();
        Ok(FrameVectors::of(&Frame::new(index as u64, frame.time, &positions), source.topology))
    };
    let frames: Vec<_> = source.frames.iter().map(frame).collect::<Result<_, FrameError>>()?;
    let document = GltfDocument {
        topology: source.topology,
        frames: &frames,
        colours: &source.options.style.cloth_colors,
        normals: source.options.gltf_normals,
        solids: source.options.solids.as_ref(),
        attributes: &[],
    };
    let glb = document.glb().map_err(FrameError::write(source.path))?;
    let size = glb.json.len() as u64 + glb.bin.as_ref().map_or(0, |bin| bin.len()) as u64 + 64;
    if size > limit {
        return Err(too_large(size));
    }
    output_write(source.path, |writer| {
        glb.to_writer(writer.by_ref()).map_err(FrameError::write(source.path))
    })
}

/// Writes one frame as a mesh that does not move, with `attributes` of its vertices.
pub(crate) fn gltf_mesh_write(
    writer: &mut impl Write,
    topology: &Topology,
    frame: &Frame<'_>,
    attributes: &[VertexAttribute],
) -> io::Result<()> {
    let frames = [FrameVectors::of(frame, topology)];
    let document = GltfDocument {
        topology,
        frames: &frames,
        colours: &[],
        normals: true,
        solids: None,
        attributes,
    };
    document.glb()?.to_writer(writer).map_err(io::Error::other)
}

/// All that a file holds.
pub(super) struct GltfDocument<'a> {
    pub(super) topology: &'a Topology,
    /// At least one; the first is the mesh itself.
    pub(super) frames: &'a [FrameVectors],
    /// Colours of the first cloths as sRGB.
    pub(super) colours: &'a [[u8; 3]],
    /// Whether all frames have normals, not only the first.
    pub(super) normals: bool,
    solids: Option<&'a FrameSolids>,
    /// Numbers of the particles.
    pub(super) attributes: &'a [VertexAttribute],
}

impl GltfDocument<'_> {
    fn glb(&self) -> io::Result<Glb<'static>> {
        let mut builder = GltfBuilder::new();
        let mut motion = Motion::default();
        let mut nodes = Vec::new();
        for (number, cloth) in self.topology.cloths.iter().enumerate() {
            let node = cloth_add(&mut builder, self, number, cloth);
            motion.targets_of(node);
            nodes.push(node);
        }
        if let Some(solids) = self.solids {
            let times: Vec<f64> = self.frames.iter().map(|frame| frame.time).collect();
            let poses: Vec<_> = times.iter().map(|&time| solids.poses_at(time)).collect();
            for (number, solid) in solids.solids().iter().enumerate() {
                let poses: Vec<_> = poses.iter().map(|poses| poses[number]).collect();
                nodes.push(solid_add(&mut builder, &mut motion, solid, &poses, &times));
            }
        }
        if self.frames.len() > 1 {
            motion.finish(&mut builder, self.frames.iter().map(|frame| frame.time));
        }
        let scene = Scene { nodes, name: None, extensions: None, extras: Default::default() };
        builder.root.scene = Some(push(&mut builder.root.scenes, scene));

        let (root, bytes) = builder.finish();
        Ok(Glb {
            // The writer of the library fills in the length.
            header: Header { magic: *b"glTF", version: 2, length: 0 },
            json: Cow::Owned(gltf_json::serialize::to_vec(&root).map_err(io::Error::other)?),
            bin: Some(Cow::Owned(bytes)),
        })
    }
}

/// Positions \[m\] and normals of a frame in the axes of glTF, which is Y-up.
pub(super) struct FrameVectors {
    /// Time \[s\].
    pub(super) time: f64,
    pub(super) positions: Vec<[f32; 3]>,
    pub(super) normals: Vec<[f32; 3]>,
}

impl FrameVectors {
    pub(super) fn of(frame: &Frame<'_>, topology: &Topology) -> Self {
        Self::of_mesh(frame.time, frame.positions, &topology.triangles)
    }

    pub(super) fn of_mesh(time: f64, positions: &[[f64; 3]], triangles: &[[u32; 3]]) -> Self {
        let unit = |normal: [f64; 3]| match normal {
            // The format wants unit vectors also where no triangle is.
            [0.0, 0.0, 0.0] => [0.0, 1.0, 0.0],
            normal => y_up(normal),
        };
        Self {
            time,
            positions: positions.iter().copied().map(y_up).collect(),
            normals: vertex_normals(positions, triangles).into_iter().map(unit).collect(),
        }
    }
}

/// Turns a Z-up vector to Y-up.
pub(super) fn y_up([x, y, z]: [f64; 3]) -> [f32; 3] {
    [x as f32, z as f32, -y as f32]
}
