//! Finds the bytes of the buffers of a glTF file.

use std::path::{Component, Path, PathBuf};

use data_url::DataUrl;
use gltf::Gltf;
use gltf::buffer::Source;
use percent_encoding::percent_decode_str;

use super::MeshError;
use super::gltf::syntax;

/// The bytes of every buffer of `gltf`, at least as long as the file declares.
pub(super) fn gltf_buffers(
    file: &str,
    gltf: &Gltf,
    folder: Option<&Path>,
) -> Result<Vec<Vec<u8>>, MeshError> {
    let mut buffers = Vec::new();
    for buffer in gltf.buffers() {
        let bytes = match buffer.source() {
            Source::Bin => gltf
                .blob
                .clone()
                .ok_or_else(|| syntax(file, "the binary chunk is missing".to_owned()))?,
            Source::Uri(uri) if uri.starts_with("data:") => embedded(file, uri)?,
            Source::Uri(uri) => external(file, uri, folder)?,
        };
        if bytes.len() < buffer.length() {
            return Err(MeshError::Size {
                file: file.to_owned(),
                what: format!("bytes in buffer {}", buffer.index()),
                declared: buffer.length() as u64,
                limit: bytes.len() as u64,
            });
        }
        buffers.push(bytes);
    }
    Ok(buffers)
}

fn embedded(file: &str, uri: &str) -> Result<Vec<u8>, MeshError> {
    let damaged = |_| syntax(file, "an embedded buffer is damaged".to_owned());
    let url = DataUrl::process(uri)
        .map_err(|_| syntax(file, "an embedded buffer has no valid header".to_owned()))?;
    url.decode_to_vec().map(|(bytes, _)| bytes).map_err(damaged)
}

fn external(file: &str, uri: &str, folder: Option<&Path>) -> Result<Vec<u8>, MeshError> {
    let refused = || MeshError::BufferPath { file: file.to_owned(), uri: uri.to_owned() };
    let path =
        folder.zip(path_below(uri)).map(|(folder, path)| folder.join(path)).ok_or_else(refused)?;
    std::fs::read(&path)
        .map_err(|source| MeshError::Read { file: path.display().to_string(), source })
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
