//! Files of contacts, if they are asked for.

use std::{fs, path::PathBuf};

use cloth::{
    Model,
    io::{ContactFrame, contacts_write},
};

use crate::{
    arguments::ContactFormat,
    failure::{Failure, WriteError},
    run_folder::{RunFolder, file_remove},
};

/// What all these files are called, before the number of the frame.
const PREFIX: &str = "contacts_";

/// The folder of the contacts of a run.
pub(super) struct ContactFiles {
    folder: PathBuf,
    format: ContactFormat,
}

/// Contacts were asked for where there are none to tell of.
#[derive(Debug, thiserror::Error)]
#[error(
    "--contacts writes contacts between triangles, and this scene has no contact of triangles: give it `[contact]` without \
     `response`, or remove the option"
)]
struct NoContacts;

impl ContactFiles {
    /// Makes the folder, and removes what an earlier run has left in it from `frame` on.
    pub(super) fn new(
        folder: &RunFolder,
        format: ContactFormat,
        model: &Model,
        frame: u64,
    ) -> Result<Self, Failure> {
        if !model.has_triangle_contact() {
            return Err(Failure::input(NoContacts));
        }
        let folder = folder.root.join("contacts");
        fs::create_dir_all(&folder).map_err(WriteError::of(&folder))?;
        let entries = fs::read_dir(&folder).map_err(WriteError::of(&folder))?;
        for path in entries.filter_map(|entry| Some(entry.ok()?.path())) {
            let stem = path.file_stem().unwrap_or_default().to_string_lossy();
            let number = stem.strip_prefix(PREFIX).and_then(|digits| digits.parse::<u64>().ok());
            if number.is_some_and(|number| number >= frame) {
                file_remove(&path)?;
            }
        }
        Ok(Self { folder, format })
    }

    /// Writes those of a frame.
    pub(super) fn write(&self, frame: u64, contacts: &ContactFrame) -> Result<(), Failure> {
        let name = format!("{PREFIX}{frame:06}.{}", self.format.extension());
        Ok(contacts_write(&self.folder.join(name), contacts)?)
    }
}
