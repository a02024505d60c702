//! Frames of a run: what they are, where they are stored and the formats they are written in.
//!
//! A run appends every frame to one [`FrameStore`]. Formats that hold one frame per file are
//! written along the way by a [`FramePipeline`] or a [`FrameSequenceWriter`]; formats that hold all frames in one file are
//! made from the store by [`container_write`], at the end of a run, after an interrupt or later.

mod animation;
mod apng;
mod clip;
mod contacts;
mod container;
mod error;
mod format;
mod gif;
mod gltf;
mod gltf_animation;
mod gltf_builder;
mod gltf_cloth;
mod gltf_solid;
mod mdd;
mod normals;
mod npz;
mod obj;
mod output;
mod pc2;
mod pipeline;
mod ply;
mod point_cache;
mod record;
mod sequence;
mod sequence_file;
mod solids;
mod store;
mod strands;
mod topology;
mod vtk_array;
mod vtu;
mod vtu_fabric;

pub use clip::ClipWriter;
pub use contacts::{ContactFrame, contacts_write};
pub use container::{
    ContainerOptions, ContainerReport, PictureSequence, container_files, container_write,
};
pub use error::FrameError;
pub use format::{FrameFormat, FrameFormatError};
pub(crate) use gltf::gltf_mesh_write;
pub use normals::vertex_normals;
pub(crate) use obj::{obj_write, points_write};
pub use pipeline::FramePipeline;
pub(crate) use ply::{Column, ply_write_with};
pub use record::StoredFrame;
pub use sequence::{FrameSequenceWriter, PictureMaker};
pub use solids::FrameSolids;
pub(crate) use solids::PlacedSolid;
pub use store::FrameStore;
pub use topology::{Topology, TopologyCloth};

/// One moment of a run, borrowed from the engine.
#[derive(Clone, Copy, Debug)]
pub struct Frame<'a> {
    /// Number of the frame in the output, zero based.
    pub index: u64,
    /// Time since the start of the simulation \[s\].
    pub time: f64,
    /// Position of every particle \[m\].
    pub positions: &'a [[f64; 3]],
    /// Velocity of every particle \[m/s\].
    pub velocities: Option<&'a [[f64; 3]]>,
    /// Unit normal of every particle; computed from the triangles where it is needed and `None`.
    pub normals: Option<&'a [[f64; 3]]>,
}

impl<'a> Frame<'a> {
    /// A frame without velocities and normals.
    #[must_use]
    pub fn new(index: u64, time: f64, positions: &'a [[f64; 3]]) -> Self {
        Self { index, time, positions, velocities: None, normals: None }
    }

    /// Checks that every array has an entry for each particle and every number is finite in single
    /// precision, which most formats have: what one of them cannot hold, none takes.
    fn check(&self, particle_count: usize) -> Result<(), FrameError> {
        if !self.time.is_finite() {
            return Err(FrameError::Time { index: self.index, time: self.time });
        }
        let arrays = [
            ("position", Some(self.positions)),
            ("velocity", self.velocities),
            ("normal", self.normals),
        ];
        for (what, array) in arrays {
            let Some(array) = array else { continue };
            if array.len() != particle_count {
                return Err(FrameError::ParticleCount {
                    found: array.len(),
                    expected: particle_count,
                });
            }
            let not_finite = |vector: &[f64; 3]| vector.iter().any(|&x| !(x as f32).is_finite());
            match array.iter().position(not_finite) {
                Some(particle) if what == "position" => {
                    return Err(FrameError::Position { particle });
                }
                Some(particle) => return Err(FrameError::Vector { what, particle }),
                None => {}
            }
        }
        Ok(())
    }

    /// The normals of the frame, computed if it has none.
    fn normals_or_computed(&self, triangles: &[[u32; 3]]) -> std::borrow::Cow<'a, [[f64; 3]]> {
        match self.normals {
            Some(normals) => normals.into(),
            None => vertex_normals(self.positions, triangles).into(),
        }
    }
}
