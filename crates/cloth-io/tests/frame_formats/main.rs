//! Output files hold the frames that were given.

#![allow(clippy::unwrap_used, reason = "helpers of tests may panic")]

#[path = "../appended/mod.rs"]
mod appended;
mod arrays;
#[path = "../common/mod.rs"]
mod common;
mod meshes;
mod pictures;
mod pipeline;
mod refusals;

use std::path::Path;

use cloth_io::PictureStyle;

fn small_style() -> PictureStyle {
    PictureStyle { width: 64, height: 36, ..PictureStyle::default() }
}

/// Names of the files in `folder`.
fn files(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<_> =
        entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}
