//! Names of what a file gives no name.

use std::{collections::HashMap, path::Path};

use crate::Scene;

/// Gives the scene the name of its `file`, and cloths, colliders and the like numbered ones, where `keys`, those of the file, have none.
pub(super) fn names_fill(scene: &mut Scene, keys: &HashMap<String, (u32, u32)>, file: &str) {
    if !keys.contains_key("name") {
        let stem = Path::new(file).file_stem().and_then(|stem| stem.to_str());
        scene.name = stem.unwrap_or("scene").to_owned();
    }
    fill("cloth", keys, scene.cloths.iter_mut().map(|cloth| &mut cloth.name));
    fill("collider", keys, scene.colliders.iter_mut().map(|collider| &mut collider.name));
    fill("rigid", keys, scene.rigids.iter_mut().map(|rigid| &mut rigid.name));
    fill("seam", keys, scene.seams.iter_mut().map(|seam| &mut seam.name));
    fill("elastic", keys, scene.elastics.iter_mut().map(|elastic| &mut elastic.name));
    fill("attachment", keys, scene.attachments.iter_mut().map(|attachment| &mut attachment.name));
    fill("phase", keys, scene.phases.iter_mut().map(|phase| &mut phase.name));
}

/// Gives each of a `kind` that has no name the first that is free.
fn fill<'a>(
    kind: &str,
    keys: &HashMap<String, (u32, u32)>,
    names: impl Iterator<Item = &'a mut String>,
) {
    let (unnamed, named): (Vec<_>, Vec<_>) = names
        .enumerate()
        .partition(|(index, _)| !keys.contains_key(&format!("{kind}[{index}].name")));
    let taken: Vec<&str> = named.iter().map(|(_, name)| name.as_str()).collect();
    let free =
        (1..).map(|number| if number == 1 { kind.to_owned() } else { format!("{kind} {number}") });
    let free = free.filter(|name| !taken.contains(&name.as_str()));
    unnamed.into_iter().zip(free).for_each(|((_, place), name)| *place = name);
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_has_no_name_gets_the_first_that_is_free() {
        let grid = "geometry.grid = { columns = 2, rows = 2, spacing = 1.0 }\nmaterial.preset = \"cotton\"";
        let text = format!(
            "[[cloth]]\n{grid}\n[[cloth]]\nname = \"cloth 2\"\n{grid}\n[[cloth]]\n{grid}\n\
             [[collider]]\nshape.sphere.radius = 1.0\n\
             [[rigid]]\nshape.sphere.radius = 1.0\nmass = 1.0\n[[phase]]\nduration = 1.0\n[[phase]]\nduration = 1.0"
        );
        let scene = Scene::from_toml(&text, "folder/own.toml").unwrap();
        assert_eq!(scene.name, "own");
        let names: Vec<_> = scene.cloths.iter().map(|cloth| cloth.name.as_str()).collect();
        assert_eq!(names, ["cloth", "cloth 2", "cloth 3"]);
        assert_eq!(scene.colliders[0].name, "collider");
        assert_eq!(
            (scene.rigids[0].name.as_str(), scene.phases[1].name.as_str()),
            ("rigid", "phase 2")
        );
        let again = Scene::from_toml(&scene.to_toml().unwrap(), "other.toml").unwrap();
        assert_eq!(again.name, "own");
    }

    /// A name that is written is taken as it is, an empty one too: what asks for it says what is wrong.
    #[test]
    fn a_name_that_is_written_is_kept() {
        let text = "name = \"\"\n[[collider]]\nname = \"\"\nshape.sphere.radius = 1.0";
        let scene = Scene::from_toml(text, "own.toml").unwrap();
        assert_eq!((scene.name.as_str(), scene.colliders[0].name.as_str()), ("", ""));
    }
}
