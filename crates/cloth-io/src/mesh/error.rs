//! What can be wrong with a mesh file.

use std::fmt;
use std::io;

use crate::mesh::{MESH_EXTENSIONS, MESH_WRITE_EXTENSIONS};

/// A mesh file that cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum MeshError {
    /// The operating system could not read the file.
    #[error("cannot read mesh file `{file}` ({source}); check the path and the permissions")]
    Read {
        /// The file.
        file: String,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The file name extension stands for no known format.
    #[error(
        "mesh file `{file}` has an unknown extension; use one of: {}",
        MESH_EXTENSIONS.join(", ")
    )]
    Extension {
        /// The file.
        file: String,
    },
    /// The operating system could not write the file.
    #[error(
        "cannot write mesh file `{file}` ({source}); check free space and permissions or choose \
         another folder"
    )]
    Write {
        /// The file.
        file: String,
        /// Reason given by the operating system.
        source: io::Error,
    },
    /// The file name extension stands for no format that can be written.
    #[error(
        "mesh file `{file}` has an extension that cannot be written; use one of: {}",
        MESH_WRITE_EXTENSIONS.join(", ")
    )]
    WriteExtension {
        /// The file.
        file: String,
    },
    /// The text or bytes do not follow the format.
    #[error("mesh file `{file}`, {place}: {problem}; correct the file or export it again")]
    Syntax {
        /// The file.
        file: String,
        /// Where in the file.
        place: MeshPlace,
        /// What is wrong there.
        problem: String,
    },
    /// The format allows the content but this reader cannot use it.
    #[error("mesh file `{file}` uses {feature}, which is not supported; export it without")]
    Unsupported {
        /// The file.
        file: String,
        /// The unsupported feature.
        feature: String,
    },
    /// A vertex position is infinite or not a number.
    #[error(
        "mesh file `{file}`: the position of vertex {vertex} (counted from 0) is not finite; \
         correct or remove that vertex"
    )]
    Position {
        /// The file.
        file: String,
        /// Index of the vertex, zero based.
        vertex: usize,
    },
    /// A texture coordinate is infinite or not a number.
    #[error(
        "mesh file `{file}`: texture coordinate {coordinate} (counted from 0) is not finite; \
         correct it or export without texture coordinates"
    )]
    TextureCoordinate {
        /// The file.
        file: String,
        /// Index of the texture coordinate, zero based.
        coordinate: usize,
    },
    /// A face refers to a vertex or texture coordinate that the file does not have.
    #[error(
        "mesh file `{file}`, {place}: {what} {index} does not exist, the file has {count}; \
         correct the index or export the mesh again"
    )]
    Index {
        /// The file.
        file: String,
        /// The line or the face.
        place: MeshPlace,
        /// `vertex` or `texture coordinate`.
        what: &'static str,
        /// The index as the file gives it.
        index: i64,
        /// How many there are.
        count: usize,
    },
    /// A face has the same vertex twice.
    #[error(
        "mesh file `{file}`, {place}: the face uses vertex {vertex} (counted from 0) twice; \
         remove the degenerate face"
    )]
    Repeated {
        /// The file.
        file: String,
        /// The line or the face.
        place: MeshPlace,
        /// Index of the vertex, zero based.
        vertex: u32,
    },
    /// The file has no vertices or no faces.
    #[error("mesh file `{file}` has no {what}; export a mesh with {what}")]
    Empty {
        /// The file.
        file: String,
        /// `vertices` or `triangles`.
        what: &'static str,
    },
    /// The header declares more data than the file holds or the engine can index.
    #[error(
        "mesh file `{file}` declares {declared} {what} but can hold at most {limit}; \
         the file is cut off or damaged, export it again"
    )]
    Size {
        /// The file.
        file: String,
        /// The elements counted.
        what: String,
        /// How many the header declares.
        declared: u64,
        /// How many there can be.
        limit: u64,
    },
    /// The mesh is larger than the engine can use, whatever the file holds it in.
    #[error(
        "mesh file `{file}` asks for {declared} {what}, and at most {limit} are read; reduce the mesh, or \
         export it without copies of the same parts"
    )]
    TooLarge {
        /// The file.
        file: String,
        /// What there is too much of.
        what: &'static str,
        /// How many of them the file asks for.
        declared: u64,
        /// How many are read at most.
        limit: u64,
    },
    /// An external buffer of a glTF file is not inside the folder of that file.
    #[error(
        "mesh file `{file}` refers to the buffer `{uri}`, which is not a plain path below the \
         folder of the file; keep its buffers beside it or export a .glb"
    )]
    BufferPath {
        /// The file.
        file: String,
        /// The refused reference.
        uri: String,
    },
}

/// Where in a mesh file a problem is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum MeshPlace {
    /// Line of a text file, counted from 1.
    Line(usize),
    /// Face of the file, counted from 0.
    Face(usize),
    /// The header of the file.
    Header,
    /// The file as a whole.
    File,
}

impl fmt::Display for MeshPlace {
    fn fmt(&self, formatter: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Line(line) => write!(formatter, "line {line}"),
            Self::Face(face) => write!(formatter, "face {face} (counted from 0)"),
            Self::Header => formatter.write_str("header"),
            Self::File => formatter.write_str("content"),
        }
    }
}
