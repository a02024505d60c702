//! `cloth convert`.

mod frames;
mod mesh;

use std::path::Path;

use cloth::{io::MESH_EXTENSIONS, scene::Scene};

use crate::{
    arguments::ConvertArguments,
    failure::{Failure, ReadError, WriteError},
    run_folder::text_write,
    scene_source::SCENE_EXTENSIONS,
};

pub(crate) fn convert(arguments: &ConvertArguments) -> Result<(), Failure> {
    let ConvertArguments { input, output, .. } = arguments;
    if std::fs::metadata(input).map_err(ReadError::of(input))?.is_dir() {
        return frames::convert(arguments);
    }
    let extension = extension(input);
    if SCENE_EXTENSIONS.contains(&extension.as_str()) {
        return scene_convert(input, output);
    }
    if MESH_EXTENSIONS.contains(&extension.as_str()) {
        return mesh::convert(arguments);
    }
    Err(Failure::Usage(format!(
        "`{}` cannot be converted; give a mesh ({}), the folder of a run or a scene ({})",
        input.display(),
        MESH_EXTENSIONS.join(", "),
        SCENE_EXTENSIONS.join(", ")
    )))
}

/// Writes a scene with every value that it leaves open, and without comments.
fn scene_convert(input: &Path, output: &Path) -> Result<(), Failure> {
    let scene = Scene::read(input)?;
    let text = match extension(output).as_str() {
        "toml" => scene.to_toml()?,
        "fysl" | "xml" => scene.to_fysl()?,
        _ => {
            return Err(Failure::Usage(format!(
                "a scene can only become a scene; give `{}` the extension {}",
                output.display(),
                SCENE_EXTENSIONS.join(" or ")
            )));
        }
    };
    parent_create(output)?;
    text_write(output, &text)
}

/// Makes the folders that `output` is to be in; called when all that can be wrong with the input is known.
fn parent_create(output: &Path) -> Result<(), Failure> {
    match output.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => {
            Ok(std::fs::create_dir_all(folder).map_err(WriteError::of(folder))?)
        }
        _ => Ok(()),
    }
}

/// File name extension in lower case, empty if there is none.
fn extension(path: &Path) -> String {
    path.extension().map(|extension| extension.to_string_lossy().to_lowercase()).unwrap_or_default()
}
