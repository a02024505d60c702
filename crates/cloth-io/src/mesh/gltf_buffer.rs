//! Finds the bytes of the buffers of a glTF file.

use std::borrow::Cow;
use std::collections::HashSet;
use std::path::{Component, Path, PathBuf};

use data_url::DataUrl;
use gltf::buffer::Source;
use gltf::{Gltf, Mesh, Semantic};
use percent_encoding::percent_decode_str;

use super::gltf::syntax;
use super::gltf_attribute::chooses;
use super::{MESH_FILE_MAX, MeshError};
use crate::file::file_read;

/// The bytes of every buffer of `gltf` that `meshes` read, as far as they read them. The others stay empty: files
/// hold pictures and animations too, and nothing keeps a buffer from being longer than it is used.
pub(super) fn gltf_buffers<'gltf>(
    file: &str,
    gltf: &'gltf Gltf,
    meshes: impl Iterator<Item = Mesh<'gltf>>,
    folder: Option<&Path>,
) -> Result<Vec<Cow<'gltf, [u8]>>, MeshError> {
    let ends = view_ends(gltf, meshes);
    let mut left = MESH_FILE_MAX;
    let mut buffers = Vec::new();
    for (buffer, end) in gltf.buffers().zip(ends) {
        let declared = buffer.length() as u64;
        let needed = end.min(declared);
        if needed == 0 {
            buffers.push(Cow::Borrowed(&[][..]));
            continue;
        }
        let (bytes, available) = match buffer.source() {
            Source::Bin => {
                let blob = gltf.blob.as_deref();
                let blob =
                    blob.ok_or_else(|| syntax(file, "the binary chunk is missing".to_owned()))?;
                (Cow::Borrowed(blob), blob.len() as u64)
            }
            Source::Uri(uri) if uri.starts_with("data:") => {
                let bytes = embedded(file, uri)?;
                let length = bytes.len() as u64;
                (Cow::Owned(bytes), length)
            }
            Source::Uri(uri) => {
                let (bytes, length) = external(file, uri, folder, needed, &mut left)?;
                (Cow::Owned(bytes), length)
            }
        };
        if available < declared {
            return Err(MeshError::Size {
                file: file.to_owned(),
                what: format!("bytes in buffer {}", buffer.index()),
                declared,
                limit: available,
            });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

/// How far into each buffer the views reach that `meshes` read.
fn view_ends<'gltf>(gltf: &'gltf Gltf, meshes: impl Iterator<Item = Mesh<'gltf>>) -> Vec<u64> {
    let mut ends = vec![0_u64; gltf.buffers().len()];
    let mut seen = HashSet::new();
    for mesh in meshes.filter(|mesh| seen.insert(mesh.index())) {
        for primitive in mesh.primitives() {
            let read = |semantic: &Semantic| {
                matches!(semantic, Semantic::Positions | Semantic::TexCoords(0))
                    || chooses(semantic)
            };
            let attributes = primitive.attributes().filter(|(semantic, _)| read(semantic));
            let accessors = attributes.map(|(_, accessor)| accessor).chain(primitive.indices());
            for view in accessors.filter_map(|accessor| accessor.view()) {
                let end = (view.offset() as u64).saturating_add(view.length() as u64);
                if let Some(known) = ends.get_mut(view.buffer().index()) {
                    *known = end.max(*known);
                }
            }
        }
    }
    ends
}

fn embedded(file: &str, uri: &str) -> Result<Vec<u8>, MeshError> {
    let damaged = |_| syntax(file, "an embedded buffer is damaged".to_owned());
    let url = DataUrl::process(uri)
        .map_err(|_| syntax(file, "an embedded buffer has no valid header".to_owned()))?;
    url.decode_to_vec().map(|(bytes, _)| bytes).map_err(damaged)
}

/// The first `needed` bytes of the file that `uri` names, and how many it has; `left` is what all such files
/// together may still hold.
fn external(
    file: &str,
    uri: &str,
    folder: Option<&Path>,
    needed: u64,
    left: &mut u64,
) -> Result<(Vec<u8>, u64), MeshError> {
    let refused = || MeshError::BufferPath { file: file.to_owned(), uri: uri.to_owned() };
    let path =
        folder.zip(path_below(uri)).map(|(folder, path)| folder.join(path)).ok_or_else(refused)?;
    let failed = |source| MeshError::Read { file: path.display().to_string(), source };
    let length = path.metadata().map_err(failed)?.len();
    let taken = needed.min(length);
    let Some(rest) = left.checked_sub(taken) else {
        let (what, limit) = ("bytes of external buffers", MESH_FILE_MAX);
        let declared = taken.saturating_add(MESH_FILE_MAX - *left);
        return Err(MeshError::TooLarge { file: file.to_owned(), what, declared, limit });
    };
    *left = rest;
    Ok((file_read(&path, taken).map_err(failed)?, length))
}

/// The relative path that `uri` stands for, unless it has a scheme, is absolute or climbs up: a
/// mesh from a stranger must not make the engine read other files.
fn path_below(uri: &str) -> Option<PathBuf> {
    let decoded = percent_decode_str(uri).decode_utf8().ok()?;
    // A backslash or a colon may be a separator or a drive, depending on the system.
    if decoded.is_empty() || decoded.contains(['\\', ':', '\0']) {
        return None;
    }
    let path = PathBuf::from(decoded.as_ref());
    let plain = |component| matches!(component, Component::Normal(_) | Component::CurDir);
    path.components().all(plain).then_some(path)
}

#[cfg(test)]
mod tests {
    use super::path_below;

    #[test]
    fn only_paths_below_the_folder_pass() {
        for refused in [
            "",
            "/etc/passwd",
            "../a.bin",
            "a/../../b.bin",
            "%2e%2e/a.bin",
            "%2Fa.bin",
            "file:a.bin",
            "http://host/a.bin",
            "c:\\a.bin",
            "..\\a.bin",
            "a%00.bin",
        ] {
            assert_eq!(path_below(refused), None, "{refused}");
        }
        assert_eq!(path_below("a.bin"), Some("a.bin".into()));
        assert_eq!(path_below("./sub/a%20b.bin"), Some("./sub/a b.bin".into()));
    }
}
