//! Reads VTU files back.

/// An array that a VTU file has behind its XML part.
pub(crate) fn appended<'a>(bytes: &'a [u8], name: &str) -> &'a [u8] {
    let text = String::from_utf8_lossy(bytes);
    let marker = b"<AppendedData encoding=\"raw\">\n_";
    let start = bytes.windows(marker.len()).position(|part| part == marker).unwrap();
    let tag = text.split('<').find(|tag| tag.contains(&format!("Name=\"{name}\""))).unwrap();
    let offset = tag.split("offset=\"").nth(1).unwrap().split('"').next().unwrap();
    let at = start + marker.len() + offset.parse::<usize>().unwrap();
    let size = u64::from_le_bytes(bytes[at..at + 8].try_into().unwrap()) as usize;
    &bytes[at + 8..at + 8 + size]
}
