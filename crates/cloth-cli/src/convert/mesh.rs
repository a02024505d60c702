//! From one mesh format to another.

use cloth::io::{
    FrameFormat, MESH_WRITE_EXTENSIONS, mesh_read, mesh_write_gltf, mesh_write_obj, mesh_write_ply,
};

use crate::{arguments::ConvertArguments, failure::Failure};

use super::{extension, parent_create};

pub(super) fn convert(arguments: &ConvertArguments) -> Result<(), Failure> {
    let ConvertArguments { input, output, .. } = arguments;
    let write = match (arguments.format, extension(output).as_str()) {
        (Some(FrameFormat::Obj), _) | (None, "obj") => mesh_write_obj,
        (Some(FrameFormat::Ply), _) | (None, "ply") => mesh_write_ply,
        (Some(FrameFormat::Gltf), _) | (None, "glb") => mesh_write_gltf,
        _ => {
            return Err(Failure::Usage(format!(
                "a mesh can become {}; give `{}` one of these extensions or use --format",
                MESH_WRITE_EXTENSIONS.join(", "),
                output.display()
            )));
        }
    };
    let mesh = mesh_read(input)?;
    parent_create(output)?;
    Ok(write(output, &mesh)?)
}
