//! What changed in a scene since a run of it began.

use std::{fs, path::Path};

use cloth::scene::{CompileOptions, Scene};
use toml::{Table, Value};

use super::{RunFolder, meshes, text_read};
use crate::failure::{Failure, ReadError};

/// The one thing that a run may do longer or shorter than it began.
const FREE: &str = "simulation.frames";
/// Changes that a message names.
const NAMED: usize = 4;
/// Letters of a value that a message shows.
const VALUE_LETTERS: usize = 40;

/// A scene that is not the one of the run.
#[derive(Debug, thiserror::Error)]
#[error(
    "the scene changed since the run in `{folder}` began: {changes}; undo that, add --accept-changes to go on with it all the same, or \
     leave --resume out to begin anew"
)]
struct SceneChanged {
    folder: String,
    changes: String,
}

impl RunFolder {
    /// Refuses to continue the run in this folder with a scene that is another one, but for its number of frames; with
    /// `accepted` it says what changed, if anything did.
    pub(crate) fn changes_check(
        &self,
        scene: &Scene,
        options: &CompileOptions,
        accepted: bool,
    ) -> Result<Option<String>, Failure> {
        let path = self.scene();
        let before = text_read(&path).map_err(ReadError::of(&path))?;
        let (now, _) = meshes::rewritten(scene, options)?;
        // A folder of a version that named meshes where they were is not told apart from a change of their names.
        let Some(changes) = changes(&before, &now).map_err(|problem| {
            let problem = format!("`scene.toml` is damaged: {problem}");
            Failure::input(super::FolderError { folder: self.root.clone(), problem })
        })?
        else {
            return Ok(None);
        };
        if accepted {
            return Ok(Some(changes));
        }
        let folder = self.root.display().to_string();
        Err(Failure::input(SceneChanged { folder, changes }))
    }

    /// Writes the scene of a run that continues the one in this folder, whose meshes are there.
    pub(crate) fn scene_rewrite(
        &self,
        scene: &Scene,
        options: &CompileOptions,
    ) -> Result<(), Failure> {
        let (text, _) = meshes::rewritten(scene, options)?;
        meshes::scene_text_write(&self.scene(), &text)
    }
}

/// The changes from one scene to another in words, or `None` if there are none that matter.
fn changes(before: &str, now: &str) -> Result<Option<String>, String> {
    let read = |text: &str| text.parse::<Table>().map_err(|error| error.message().to_owned());
    let mut found = Vec::new();
    tables(&read(before)?, &read(now)?, "", &mut found);
    if found.is_empty() {
        return Ok(None);
    }
    let others = found.len().saturating_sub(NAMED);
    found.truncate(NAMED);
    let mut text = found.join(", ");
    if others > 0 {
        text = format!("{text}, and {others} more");
    }
    Ok(Some(text))
}

fn tables(before: &Table, now: &Table, path: &str, found: &mut Vec<String>) {
    let later = now.keys().filter(|key| !before.contains_key(*key));
    for key in before.keys().chain(later) {
        let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
        if path != FREE {
            values(before.get(key), now.get(key), &path, found);
        }
    }
}

fn values(before: Option<&Value>, now: Option<&Value>, path: &str, found: &mut Vec<String>) {
    match (before, now) {
        (Some(before), Some(now)) if before == now => {}
        (Some(Value::Table(before)), Some(Value::Table(now))) => tables(before, now, path, found),
        (Some(Value::Array(before)), Some(Value::Array(now)))
            if before.iter().chain(now).all(Value::is_table) =>
        {
            for index in 0..before.len().max(now.len()) {
                let [before, now] = [before, now].map(|values| values.get(index));
                values(before, now, &format!("{path}{}", element(before.or(now), index)), found);
            }
        }
        (Some(before), Some(now)) => {
            found.push(format!("`{path}` was {} and is {}", shown(before), shown(now)));
        }
        (Some(_), None) => found.push(format!("`{path}` is gone")),
        (None, Some(_)) => found.push(format!("`{path}` is new")),
        (None, None) => {}
    }
}

/// An element of an array, by its name if it has one.
fn element(value: Option<&Value>, index: usize) -> String {
    match value.and_then(|value| value.get("name")).and_then(Value::as_str) {
        Some(name) => format!(".{name}"),
        None => format!("[{index}]"),
    }
}

fn shown(value: &Value) -> String {
    let text = value.to_string();
    if text.chars().count() <= VALUE_LETTERS {
        return text;
    }
    let start: String = text.chars().take(VALUE_LETTERS).collect();
    format!("{start}...")
}

/// Whether two paths are one file.
pub(crate) fn is_same_file(path: &Path, other: &Path) -> bool {
    matches!((fs::canonicalize(path), fs::canonicalize(other)), (Ok(a), Ok(b)) if a == b)
        || is_same_inode(path, other)
}

/// Two names of one file that no path tells: hard links.
#[cfg(unix)]
fn is_same_inode(path: &Path, other: &Path) -> bool {
    use std::os::unix::fs::MetadataExt;

    let id = |path: &Path| fs::metadata(path).map(|metadata| (metadata.dev(), metadata.ino()));
    matches!((id(path), id(other)), (Ok(a), Ok(b)) if a == b)
}

#[cfg(not(unix))]
fn is_same_inode(_: &Path, _: &Path) -> bool {
    false
}

#[cfg(test)]
mod tests {
    use super::*;

    const BEFORE: &str = r#"
        name = "a"
        simulation = { frames = 3, time_step = 0.001 }
        [[collider]]
        name = "ball"
        shape.sphere.radius = 0.1
        [[collider]]
        name = "floor"
        shape.plane.normal = [0.0, 0.0, 1.0]
    "#;

    #[track_caller]
    fn changed(from: &str, to: &str) -> Option<String> {
        assert!(BEFORE.contains(from), "{from}");
        changes(BEFORE, &BEFORE.replace(from, to)).unwrap()
    }

    #[test]
    fn changes_are_named_by_key_and_value() {
        assert_eq!(changed("frames = 3", "frames = 30"), None);
        for (from, to, words) in [
            (
                "radius = 0.1",
                "radius = 0.2",
                "`collider.ball.shape.sphere.radius` was 0.1 and is 0.2",
            ),
            (
                "sphere",
                "ball",
                "`collider.ball.shape.sphere` is gone, `collider.ball.shape.ball` is new",
            ),
            (
                "0.0, 1.0]",
                "1.0, 0.0]",
                "`collider.floor.shape.plane.normal` was [0.0, 0.0, 1.0] and is [0.0, 1.0, 0.0]",
            ),
            ("name = \"a\"", "name = \"b\"", "`name` was \"a\" and is \"b\""),
        ] {
            assert_eq!(changed(from, to).as_deref(), Some(words));
        }
        let fewer = &BEFORE[..BEFORE.rfind("[[").unwrap()];
        assert_eq!(changes(BEFORE, fewer).unwrap().unwrap(), "`collider.floor` is gone");
        assert_eq!(changes(fewer, BEFORE).unwrap().unwrap(), "`collider.floor` is new");
        let many = |value: i32| (0..9).map(|k| format!("key{k} = {value}\n")).collect::<String>();
        assert!(changes(&many(1), &many(2)).unwrap().unwrap().ends_with(", and 5 more"));
        assert!(changes("x = [", "").is_err());
    }
}
