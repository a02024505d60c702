//! Meshes in, frames and pictures out.
//!
//! - [`mesh_read`] reads triangle meshes from OBJ, PLY and glTF files, [`mesh_write`] writes them.
//! - [`FrameStore`] keeps all frames of a run; [`FrameSequenceWriter`] and [`container_write`] turn
//!   frames into [formats](FrameFormat) of other programs; a [`FramePipeline`] does so while the next
//!   frames are computed.
//! - [`ClipWriter`] makes one animated file of pictures of any renderer.
//! - [`Picture`] and [`PictureRenderer`] render cloth and colliders without a graphics card.
//! - [`file_open`] and [`file_read`] read regular files alone, so that no pipe is waited for.
//! - [`file_replace`] writes any file so that it is either complete or as it was.

mod file;
mod frame;
mod mesh;
mod picture;

pub use file::{
    file_open, file_open_with, file_read, file_replace, output_check, parts_abandon, parts_remove,
};
pub use frame::{
    ClipWriter, ContactFrame, ContainerOptions, ContainerReport, Frame, FrameError, FrameFormat,
    FrameFormatError, FramePipeline, FrameSequenceWriter, FrameSolids, FrameStore, PictureMaker,
    PictureSequence, StoredFrame, Topology, TopologyCloth, contacts_write, container_files,
    container_write, vertex_normals,
};
pub use mesh::{
    MESH_EXTENSIONS, MESH_WRITE_EXTENSIONS, MeshError, MeshPlace, PointCache, mesh_read,
    mesh_read_gltf, mesh_read_obj, mesh_read_ply, mesh_write, mesh_write_gltf, mesh_write_obj,
    mesh_write_ply, point_cache_read, point_cache_read_bytes,
};
pub use picture::{
    Bounds, Camera, PICTURE_SIDE_LIMIT, Picture, PictureCloth, PictureDust, PictureError,
    PictureGrain, PictureLegend, PictureOverlays, PictureRenderer, PictureScene, PictureShape,
    PictureShapes, PictureSolid, PictureStrain, PictureStyle, StrainMap, ThreadDirection,
    ThreadMap, ThreadSegment, picture_palette,
};
