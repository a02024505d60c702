//! Meshes in, frames and pictures out.
//!
//! - [`mesh_read`] reads triangle meshes from OBJ, PLY and glTF files.
//! - [`FrameStore`] keeps all frames of a run; [`FrameSequenceWriter`] and [`container_write`] turn
//!   frames into [formats](FrameFormat) of other programs.
//! - [`Picture`] renders cloth and colliders without a graphics card.

mod frame;
mod mesh;
mod picture;

pub use frame::{
    ContainerOptions, ContainerReport, Frame, FrameError, FrameFormat, FrameFormatError,
    FrameSequenceWriter, FrameStore, StoredFrame, Topology, TopologyCloth, container_write,
    vertex_normals,
};
pub use mesh::{
    MESH_EXTENSIONS, MeshError, MeshPlace, mesh_read, mesh_read_gltf, mesh_read_obj, mesh_read_ply,
};
pub use picture::{
    Bounds, Camera, PICTURE_SIDE_LIMIT, Picture, PictureCloth, PictureError, PictureScene,
    PictureShape, PictureShapes, PictureStyle, picture_palette,
};
