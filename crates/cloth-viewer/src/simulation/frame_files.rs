//! Frames in files that tell nothing of the scene: sequences of meshes, and point caches.

use std::{
    fs::File,
    io::{self, Read, Seek, SeekFrom},
    path::{Path, PathBuf},
};

use cloth::{
    TriangleMesh,
    io::{file_open, mesh_read},
};

use crate::ViewerError;

/// Rate of sequences, which do not say theirs \[Hz\].
pub(super) const FRAMES_PER_SECOND: f64 = 30.0;
/// Extensions of meshes of which a frame can be a file.
const MESH_EXTENSIONS: [&str; 2] = ["obj", "ply"];
/// Bytes before the positions of a Point Cache 2.
const PC2_HEADER: usize = 32;

/// Frames in files.
#[derive(Clone, Debug)]
pub struct FrameFiles {
    name: String,
    kind: Kind,
}

#[derive(Clone, Debug)]
enum Kind {
    /// A mesh for each frame.
    Meshes(Vec<PathBuf>),
    /// The first mesh, and where its particles are in all frames.
    Cache { mesh: PathBuf, cache: PathBuf, layout: CacheLayout },
}

/// How a point cache lies in its file.
#[derive(Clone, Debug, PartialEq)]
struct CacheLayout {
    big_endian: bool,
    /// Bytes before the positions of the first frame.
    header: u64,
    points: usize,
    frames: usize,
}

impl FrameFiles {
    /// Whether a file is of a kind that this opens.
    pub(super) fn knows(path: &Path) -> bool {
        let extension = extension(path);
        MESH_EXTENSIONS.contains(&&*extension) || ["pc2", "mdd"].contains(&&*extension)
    }

    /// A point cache, a mesh, or the sequence of meshes that it is part of.
    ///
    /// # Errors
    /// [`ViewerError::Source`].
    pub(super) fn of_file(path: &Path) -> Result<Self, ViewerError> {
        match &*extension(path) {
            "pc2" => Self::cache(path, pc2_layout),
            "mdd" => Self::cache(path, mdd_layout),
            _ => Ok(Self::meshes(path, sequence_of(path)?)),
        }
    }

    /// The longest sequence of meshes in a folder, if there is one.
    ///
    /// # Errors
    /// [`ViewerError::Source`].
    pub(super) fn of_folder(folder: &Path) -> Result<Option<Self>, ViewerError> {
        let mut longest: Vec<PathBuf> = Vec::new();
        for path in files(folder)?.into_iter().filter(|path| number(path).is_some()) {
            if !longest.contains(&path) && MESH_EXTENSIONS.contains(&&*extension(&path)) {
                let sequence = sequence_of(&path)?;
                if sequence.len() > longest.len() {
                    longest = sequence;
                }
            }
        }
        Ok(longest.first().cloned().map(|first| Self::meshes(&first, longest)))
    }

    fn meshes(first: &Path, paths: Vec<PathBuf>) -> Self {
        let stem = first.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let name = number(first).map_or(stem.clone(), |(prefix, _)| prefix);
        Self { name: name.trim_end_matches(['_', '-', '.']).to_owned(), kind: Kind::Meshes(paths) }
    }

    fn cache(
        path: &Path,
        layout: fn(&mut File) -> io::Result<Option<CacheLayout>>,
    ) -> Result<Self, ViewerError> {
        let name = path.file_stem().unwrap_or_default().to_string_lossy().into_owned();
        let mesh = path.with_file_name(format!("{name}_mesh.obj"));
        if !mesh.is_file() {
            let problem = format!("the mesh that it moves is missing, `{}`", mesh.display());
            return Err(ViewerError::Source { path: path.to_owned(), problem });
        }
        let read = file_open(path).and_then(|mut file| layout(&mut file));
        let layout = read
            .map_err(|error| fail(path, error))?
            .ok_or_else(|| fail(path, "it is damaged, or no point cache"))?;
        let kind = Kind::Cache { mesh, cache: path.to_owned(), layout };
        Ok(Self { name, kind })
    }

    /// Name of what is seen.
    #[must_use]
    pub fn name(&self) -> &str {
        &self.name
    }

    /// Number of frames, at least 1.
    #[must_use]
    pub const fn len(&self) -> usize {
        match &self.kind {
            Kind::Meshes(paths) => paths.len(),
            Kind::Cache { layout, .. } => layout.frames,
        }
    }

    /// Whether there are none; never, as that cannot be opened.
    #[must_use]
    pub const fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The mesh of all frames.
    pub(super) fn mesh(&self) -> Result<TriangleMesh, ViewerError> {
        let path = match &self.kind {
            Kind::Meshes(paths) => &paths[0],
            Kind::Cache { mesh, .. } => mesh,
        };
        read_mesh(path)
    }

    /// Positions \[m\] of the `count` particles in a frame.
    ///
    /// # Errors
    /// [`ViewerError::Source`], also if the frame has another number of particles.
    pub(super) fn frame(&self, index: usize, count: usize) -> Result<Vec<[f64; 3]>, ViewerError> {
        let (path, positions) = match &self.kind {
            Kind::Meshes(paths) => (&paths[index], read_mesh(&paths[index])?.positions),
            Kind::Cache { cache, layout, .. } => {
                let read = layout.frame(cache, index);
                (cache, read.map_err(|error| fail(cache, error))?)
            }
        };
        if positions.len() != count {
            let found = positions.len();
            return Err(fail(path, format!("it has {found} points, its mesh has {count}")));
        }
        if positions.iter().flatten().any(|x| !x.is_finite()) {
            return Err(fail(path, format!("frame {index} has positions that are no numbers")));
        }
        Ok(positions)
    }
}

impl CacheLayout {
    fn frame(&self, path: &Path, index: usize) -> io::Result<Vec<[f64; 3]>> {
        let size = 12 * self.points;
        let mut bytes = vec![0; size];
        let mut file = file_open(path)?;
        file.seek(SeekFrom::Start(self.header + (index * size) as u64))?;
        file.read_exact(&mut bytes)?;
        let value = |bytes: &[u8]| {
            let bytes = [bytes[0], bytes[1], bytes[2], bytes[3]];
            let value = if self.big_endian { f32::from_be_bytes } else { f32::from_le_bytes };
            f64::from(value(bytes))
        };
        let point = |bytes: &[u8]| [value(&bytes[..4]), value(&bytes[4..8]), value(&bytes[8..])];
        Ok(bytes.chunks_exact(12).map(point).collect())
    }

    /// Unless the file is shorter than it says.
    fn checked(self, file: &File) -> io::Result<Option<Self>> {
        let needed = (12 * self.points as u64)
            .checked_mul(self.frames as u64)
            .and_then(|size| size.checked_add(self.header));
        let length = file.metadata()?.len();
        let is_whole = needed.is_some_and(|needed| needed <= length);
        Ok((is_whole && self.points > 0 && self.frames > 0).then_some(self))
    }
}

/// Point Cache 2, see `cloth_io`: 32 bytes, then all positions, little endian.
fn pc2_layout(file: &mut File) -> io::Result<Option<CacheLayout>> {
    let mut header = [0; PC2_HEADER];
    file.read_exact(&mut header)?;
    let word = |at: usize| {
        let word = [header[at], header[at + 1], header[at + 2], header[at + 3]];
        usize::try_from(i32::from_le_bytes(word)).ok()
    };
    if !header.starts_with(b"POINTCACHE2\0") {
        return Ok(None);
    }
    let (Some(points), Some(frames)) = (word(16), word(28)) else { return Ok(None) };
    CacheLayout { big_endian: false, header: PC2_HEADER as u64, points, frames }.checked(file)
}

/// Motion Designer: two counts and the times of all frames, then all positions, big endian.
fn mdd_layout(file: &mut File) -> io::Result<Option<CacheLayout>> {
    let mut counts = [[0; 4]; 2];
    for count in &mut counts {
        file.read_exact(count)?;
    }
    let [frames, points] = counts.map(|count| usize::try_from(i32::from_be_bytes(count)).ok());
    let (Some(points), Some(frames)) = (points, frames) else { return Ok(None) };
    let header = 8 + 4 * frames as u64;
    CacheLayout { big_endian: true, header, points, frames }.checked(file)
}

fn read_mesh(path: &Path) -> Result<TriangleMesh, ViewerError> {
    mesh_read(path).map_err(|error| fail(path, error))
}

fn fail(path: &Path, problem: impl ToString) -> ViewerError {
    ViewerError::Source { path: path.to_owned(), problem: problem.to_string() }
}

fn extension(path: &Path) -> String {
    path.extension().unwrap_or_default().to_string_lossy().to_ascii_lowercase()
}

/// What stands before the number at the end of a name, and the number.
fn number(path: &Path) -> Option<(String, u64)> {
    let stem = path.file_stem()?.to_str()?;
    let prefix = stem.trim_end_matches(|c: char| c.is_ascii_digit());
    let number = stem[prefix.len()..].parse().ok()?;
    Some((prefix.to_owned(), number))
}

/// All files that are called as this one but for the number, in its order; the file alone if it has
/// none.
fn sequence_of(path: &Path) -> Result<Vec<PathBuf>, ViewerError> {
    let Some((prefix, _)) = number(path) else { return Ok(vec![path.to_owned()]) };
    let folder = match path.parent() {
        Some(folder) if !folder.as_os_str().is_empty() => folder,
        _ => Path::new("."),
    };
    let mut found: Vec<(u64, PathBuf)> = files(folder)?
        .into_iter()
        .filter(|other| extension(other) == extension(path))
        .filter_map(|other| {
            let (other_prefix, number) = number(&other)?;
            (other_prefix == prefix).then_some((number, other))
        })
        .collect();
    found.sort();
    Ok(found.into_iter().map(|(_, path)| path).collect())
}

fn files(folder: &Path) -> Result<Vec<PathBuf>, ViewerError> {
    let entries = std::fs::read_dir(folder).map_err(|error| fail(folder, error))?;
    let paths = entries.filter_map(|entry| Some(entry.ok()?.path()));
    Ok(paths.filter(|path| path.is_file()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    const TRIANGLE: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

    fn file(folder: &Path, name: &str, bytes: impl AsRef<[u8]>) -> PathBuf {
        let path = folder.join(name);
        std::fs::write(&path, bytes).unwrap();
        path
    }

    #[test]
    fn sequences_are_in_the_order_of_their_numbers() {
        let folder = tempfile::tempdir().unwrap();
        for number in [10, 9, 100] {
            let text = TRIANGLE.replace("v 1 0 0", &format!("v {number} 0 0"));
            file(folder.path(), &format!("flag_{number}.obj"), text);
        }
        file(folder.path(), "other_1.obj", TRIANGLE);
        file(folder.path(), "flag_7.txt", "");
        let frames = FrameFiles::of_folder(folder.path()).unwrap().unwrap();
        assert_eq!((frames.name(), frames.len()), ("flag", 3));
        let places = [0, 1, 2].map(|index| frames.frame(index, 3).unwrap()[1][0]);
        assert_eq!(places, [9.0, 10.0, 100.0]);
        let same = FrameFiles::of_file(&folder.path().join("flag_10.obj")).unwrap();
        assert_eq!(same.len(), 3);
        assert!(frames.frame(0, 4).is_err(), "another number of points");
        let empty = tempfile::tempdir().unwrap();
        assert!(FrameFiles::of_folder(empty.path()).unwrap().is_none());
    }

    #[test]
    fn caches_move_the_mesh_beside_them() {
        let folder = tempfile::tempdir().unwrap();
        let point = |x: f32| [x, 2.0, 3.0];
        let frames = [[1.0, 4.0, 5.0], [6.0, 7.0, 8.0]].map(|frame: [f32; 3]| frame.map(point));
        let values: Vec<f32> = frames.into_iter().flatten().flatten().collect();
        let mut pc2 = b"POINTCACHE2\0".to_vec();
        for word in [1_i32.to_le_bytes(), 3_i32.to_le_bytes(), [0; 4], 1_f32.to_le_bytes()] {
            pc2.extend(word);
        }
        pc2.extend(2_i32.to_le_bytes());
        pc2.extend(values.iter().flat_map(|x| x.to_le_bytes()));
        let mut mdd = [2_i32.to_be_bytes(), 3_i32.to_be_bytes()].concat();
        mdd.extend([0_f32, 1.0].iter().flat_map(|x| x.to_be_bytes()));
        mdd.extend(values.iter().flat_map(|x| x.to_be_bytes()));
        let pc2 = file(folder.path(), "a.pc2", pc2);
        let mdd = file(folder.path(), "a.mdd", mdd);
        let error = FrameFiles::of_file(&pc2).unwrap_err().to_string();
        assert!(error.contains("a_mesh.obj"), "{error}");
        file(folder.path(), "a_mesh.obj", TRIANGLE);
        for path in [&pc2, &mdd] {
            let cache = FrameFiles::of_file(path).unwrap();
            assert_eq!((cache.name(), cache.len()), ("a", 2));
            assert_eq!(cache.mesh().unwrap().triangles, [[0, 1, 2]]);
            let places = cache.frame(1, 3).unwrap();
            assert_eq!(places, [6.0, 7.0, 8.0].map(|x| [x, 2.0, 3.0]));
            // Half a cache is none.
            let bytes = std::fs::read(path).unwrap();
            std::fs::write(path, &bytes[..bytes.len() - 1]).unwrap();
            let error = FrameFiles::of_file(path).unwrap_err().to_string();
            assert!(error.contains("damaged"), "{error}");
        }
    }
}
