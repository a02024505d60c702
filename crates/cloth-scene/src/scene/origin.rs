//! Where a scene comes from, so that errors found later can still point at a line.

use std::{collections::HashMap, path::PathBuf};

use crate::ScenePlace;

/// File and lines of a scene; empty for a scene made by code.
///
/// Keys are paths such as `cloth[0].material.thickness`.
#[derive(Clone, Debug, Default)]
pub struct SceneOrigin {
    /// Name of the file, as messages show it.
    pub file: String,
    /// Folder that mesh files are relative to.
    pub directory: PathBuf,
    /// Line and column of keys, from 1.
    pub places: HashMap<String, (u32, u32)>,
}

impl SceneOrigin {
    /// Where `key` is; where its table is if the key itself is not in the file.
    #[must_use]
    pub fn place(&self, key: &str) -> ScenePlace {
        let mut table = key;
        let found = loop {
            if let Some(&place) = self.places.get(table) {
                break Some(place);
            }
            match table.rfind(['.', '[']) {
                Some(end) => table = &table[..end],
                None => break None,
            }
        };
        ScenePlace { file: self.file.clone(), position: found }
    }
}

/// Two scenes that say the same are equal, wherever they were written.
impl PartialEq for SceneOrigin {
    fn eq(&self, _: &Self) -> bool {
        true
    }
}
