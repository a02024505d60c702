//! From one mesh format to another.

use std::fs;

use cloth::io::{Frame, FrameFormat, FrameSequenceWriter, Topology, mesh_read};

use crate::{
    arguments::ConvertArguments,
    failure::{Failure, WriteError},
};

use super::extension;

pub(super) fn convert(arguments: &ConvertArguments) -> Result<(), Failure> {
    let ConvertArguments { input, output, .. } = arguments;
    let format = match (arguments.format, extension(output).as_str()) {
        (Some(format @ (FrameFormat::Obj | FrameFormat::Ply)), _) => format,
        (None, "obj") => FrameFormat::Obj,
        (None, "ply") => FrameFormat::Ply,
        _ => {
            return Err(Failure::Usage(format!(
                "a mesh can become obj or ply; give `{}` one of these extensions or use --format",
                output.display()
            )));
        }
    };
    let mesh = mesh_read(input)?;
    let name = input.file_stem().unwrap_or_default().to_string_lossy();
    // A mesh is a run of one frame, whose rate does not matter.
    let topology = Topology::single(&name, mesh.positions.len(), mesh.triangles, mesh.texture, 1.0);
    let folder = match output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => ".".as_ref(),
    };
    let temporary = tempfile::tempdir_in(folder).map_err(WriteError::of(folder))?;
    let mut writer = FrameSequenceWriter::new(format, temporary.path(), "mesh", &topology)?;
    let written = writer.write(&Frame::new(0, 0.0, &mesh.positions))?;
    Ok(fs::rename(written, output).map_err(WriteError::of(output))?)
}
