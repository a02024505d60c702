//! Scenes under changed settings, written down.

use std::{
    fs::File,
    io::{ErrorKind, Write},
    path::Path,
};

use cloth::{
    io::file_replace,
    scene::{Scene, SceneGeometry, SceneShape},
};

use super::Message;
use crate::ViewerError;

/// Writes a scene as TOML; an existing file only if it is to be replaced. Says what was written, and what is missing beside it.
///
/// # Errors
/// [`ViewerError::Output`] if the file exists and is not to be replaced, has another extension than `toml`, or cannot be written;
/// [`ViewerError::Scene`] for a value that TOML cannot hold.
pub fn scene_save(scene: &Scene, path: &Path, replace: bool) -> Result<Message, ViewerError> {
    let fail = |problem: String, mend| ViewerError::Output { path: path.to_owned(), problem, mend };
    if path.extension().is_none_or(|extension| !extension.eq_ignore_ascii_case("toml")) {
        return Err(fail("scenes are saved as TOML".into(), "give it a name that ends with .toml"));
    }
    let text = scene.to_toml()?;
    let mend = "check the folder, free space and permissions";
    if replace {
        file_replace(path, |file| file.write_all(text.as_bytes()))
            .map_err(|error| fail(error.to_string(), mend))?;
    } else {
        // Nobody can put a file there between a question and this.
        let mut file = File::create_new(path).map_err(|error| match error.kind() {
            ErrorKind::AlreadyExists => {
                fail("there is a file of that name".into(), "replace it, or choose another name")
            }
            _ => fail(error.to_string(), mend),
        })?;
        let written = file.write_all(text.as_bytes()).and_then(|()| file.sync_data());
        written.map_err(|error| fail(error.to_string(), mend))?;
    }
    let saved = format!("saved `{}`", path.display());
    let folder = path.parent().unwrap_or(Path::new(""));
    Ok(Message::info(match files(scene).find(|file| !folder.join(file).exists()) {
        Some(file) => format!(
            "{saved}; copy `{file}` and what it needs beside it, or run it with --mesh-root {}",
            scene.origin.directory.display()
        ),
        None => saved,
    }))
}

/// The files that a scene needs.
fn files(scene: &Scene) -> impl Iterator<Item = String> {
    let cloths = scene.cloths.iter().filter_map(|cloth| match &cloth.geometry {
        SceneGeometry::Mesh(mesh) => Some(mesh.file.clone()),
        SceneGeometry::Panels(panels) => Some(panels.file.clone()),
        _ => None,
    });
    let colliders = scene.colliders.iter().filter_map(|collider| match &collider.shape {
        SceneShape::Animation(animation) => {
            Some(animation.file.replace("{}", &animation.first.to_string()))
        }
        _ => None,
    });
    cloths.chain(colliders)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::Severity;

    #[test]
    fn a_scene_is_saved_and_nothing_is_replaced_unasked() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("flag.toml");
        let mut scene = Scene::builtin("flag").unwrap();
        let said = scene_save(&scene, &path, false).unwrap();
        assert_eq!(said.severity, Severity::Info);
        assert!(
            said.text.starts_with("saved") && !said.text.contains("mesh-root"),
            "{}",
            said.text
        );
        assert_eq!(Scene::read(&path).unwrap(), scene);
        scene.gravity = [0.0; 3];
        let refused = scene_save(&scene, &path, false).unwrap_err();
        assert!(refused.to_string().contains("there is a file of that name"), "{refused}");
        assert_ne!(Scene::read(&path).unwrap(), scene);
        scene_save(&scene, &path, true).unwrap();
        assert_eq!(Scene::read(&path).unwrap(), scene);
    }

    #[test]
    fn names_that_are_read_as_something_else_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let scene = Scene::builtin("tornado").unwrap();
        for name in ["tornado.fysl", "tornado", "none/tornado.toml"] {
            let path = folder.path().join(name);
            let error = scene_save(&scene, &path, true).unwrap_err();
            assert!(matches!(error, ViewerError::Output { .. }), "{error}");
            assert!(!path.exists());
        }
        // A scene that came as FYSL is TOML then.
        let path = folder.path().join("tornado.toml");
        scene_save(&scene, &path, false).unwrap();
        assert_eq!(Scene::read(&path).unwrap(), scene);
    }

    #[test]
    fn a_mesh_that_is_not_beside_the_file_is_said() {
        let folder = tempfile::tempdir().unwrap();
        let mut scene = Scene::builtin("flag").unwrap();
        scene.cloths[0].geometry = SceneGeometry::Mesh(cloth::scene::SceneMesh {
            file: "sail.obj".into(),
            scale: 1.0,
            rotation: None,
            translation: [0.0; 3],
        });
        let said = scene_save(&scene, &folder.path().join("a.toml"), false).unwrap();
        assert!(
            said.text.contains("sail.obj") && said.text.contains("--mesh-root"),
            "{}",
            said.text
        );
        std::fs::write(folder.path().join("sail.obj"), "").unwrap();
        let said = scene_save(&scene, &folder.path().join("b.toml"), false).unwrap();
        assert!(!said.text.contains("sail.obj"), "{}", said.text);
    }
}
