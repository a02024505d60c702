//! Writes formats with all frames in one file, from a frame store.

use std::path::{Path, PathBuf};

use super::{FrameError, FrameFormat, FrameSolids, FrameStore, Topology};
use super::{apng, gif, gltf, npz, point_cache};
use crate::picture::PictureStyle;

/// How a container is made.
#[derive(Clone, Debug)]
pub struct ContainerOptions {
    /// Takes every so many frames; `None` takes all that the format holds well (see
    /// [`ContainerReport::warnings`]).
    pub frame_stride: Option<usize>,
    /// How pictures look.
    pub style: PictureStyle,
    /// Pictures that are there already, with the camera, shapes and colours of `style`, at least as
    /// large and of the same shape; scaling them down is faster than rendering. Frames that have
    /// none are rendered.
    pub picture_sequence: Option<PictureSequence>,
    /// Whether glTF carries the normals of each frame. They double its size; without them, lighting
    /// keeps the folds of the first frame.
    pub gltf_normals: bool,
    /// Largest size of the frames in a glTF file before frames are left out, if `frame_stride` is
    /// `None` \[byte\].
    pub gltf_size: u64,
    /// Colliders and rigid bodies that glTF is to show beside the cloth; other containers have no place
    /// for them.
    pub solids: Option<FrameSolids>,
}

impl Default for ContainerOptions {
    fn default() -> Self {
        Self {
            frame_stride: None,
            style: PictureStyle::default(),
            picture_sequence: None,
            gltf_normals: true,
            gltf_size: 256 << 20,
            solids: None,
        }
    }
}

/// Pictures that a [`FrameSequenceWriter`](crate::FrameSequenceWriter) wrote.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PictureSequence {
    /// The folder they are in.
    pub folder: PathBuf,
    /// Start of their names.
    pub name: String,
}

impl PictureSequence {
    /// The picture of frame `index`, zero based.
    #[must_use]
    pub fn file(&self, index: usize) -> PathBuf {
        self.folder.join(FrameFormat::Png.file_name(&self.name, index as u64))
    }
}

/// What [`container_write`] did.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ContainerReport {
    /// All files written; behind each point cache the mesh that it moves.
    pub files: Vec<PathBuf>,
    /// Frames in the container.
    pub frame_count: usize,
    /// Every so many frames of the store were taken.
    pub frame_stride: usize,
    /// Sentences for the user about compromises made.
    pub warnings: Vec<String>,
    /// What the format cannot say and the user has to know.
    pub notes: Vec<String>,
}

/// The files that [`container_write`] writes for `format` and `path`: a point cache is several files, all
/// others are the one at `path`.
#[must_use]
pub fn container_files(format: FrameFormat, path: &Path, topology: &Topology) -> Vec<PathBuf> {
    match format {
        FrameFormat::Pc2 | FrameFormat::Mdd => point_cache::cache_files(path, topology)
            .into_iter()
            .flat_map(|files| [files.cache, files.mesh])
            .collect(),
        _ => vec![path.to_owned()],
    }
}

/// Writes all frames of `store` in `format` to `path`.
///
/// The point caches [`FrameFormat::Pc2`] and [`FrameFormat::Mdd`] hold only positions, so the mesh
/// that they move is written beside them, as `name_mesh.obj`. Of several cloths each has a cache and a
/// mesh of its own, with the name of the cloth behind that of the file; see [`container_files`].
///
/// # Errors
///
/// [`FrameError::Kind`] if the format has one file per frame, [`FrameError::FrameNone`] if the
/// store is empty, [`FrameError::Size`] if the frames do not fit into the format,
/// [`FrameError::Topology`], [`FrameError::ParticleCount`], [`FrameError::Read`],
/// [`FrameError::StoreDamaged`], [`FrameError::Write`] or [`FrameError::Picture`].
pub fn container_write(
    format: FrameFormat,
    path: &Path,
    topology: &Topology,
    store: &FrameStore,
    options: &ContainerOptions,
) -> Result<ContainerReport, FrameError> {
    if format.is_sequence() {
        return Err(FrameError::Kind {
            format,
            is: "one file per frame",
            instead: "a FrameSequenceWriter",
        });
    }
    topology.check()?;
    if store.is_empty() {
        let file = store.path().to_owned();
        return Err(FrameError::FrameNone { file });
    }
    if store.particle_count() != topology.particle_count {
        return Err(FrameError::ParticleCount {
            found: store.particle_count(),
            expected: topology.particle_count,
        });
    }
    let mut report = ContainerReport::default();
    let frame_stride = match options.frame_stride {
        Some(stride) => stride.max(1),
        None => automatic_stride(format, topology, store, options, &mut report.warnings),
    };
    let source = ContainerSource {
        path,
        topology,
        store,
        frames: (0..store.len()).step_by(frame_stride).collect(),
        rate: topology.frames_per_second / frame_stride as f64,
        options,
    };
    match format {
        FrameFormat::Gltf => gltf::write(&source)?,
        FrameFormat::Pc2 | FrameFormat::Mdd => {
            report.files = point_cache::write(format, &source)?;
            report.notes.push(rate_note(format, source.rate));
        }
        FrameFormat::Npz => npz::write(&source)?,
        FrameFormat::Gif => gif::write(&source)?,
        _ => apng::write(&source)?,
    }
    if report.files.is_empty() {
        report.files.push(path.to_owned());
    }
    report.frame_count = source.frames.len();
    report.frame_stride = frame_stride;
    Ok(report)
}

/// What the writers of all containers need.
pub(super) struct ContainerSource<'a> {
    pub(super) path: &'a Path,
    pub(super) topology: &'a Topology,
    pub(super) store: &'a FrameStore,
    /// The frames to write.
    pub(super) frames: Vec<usize>,
    /// Frames in a second in the container \[1/s\].
    pub(super) rate: f64,
    pub(super) options: &'a ContainerOptions,
}

impl ContainerSource<'_> {
    /// The number of frames as the format stores it, or an error.
    pub(super) fn count_i32(&self, unit: &'static str, count: usize) -> Result<i32, FrameError> {
        i32::try_from(count).map_err(|_| FrameError::Size {
            file: self.path.to_owned(),
            unit,
            needed: count as u64,
            limit: i32::MAX as u64,
        })
    }
}

fn automatic_stride(
    format: FrameFormat,
    topology: &Topology,
    store: &FrameStore,
    options: &ContainerOptions,
    warnings: &mut Vec<String>,
) -> usize {
    let stride = match format {
        FrameFormat::Gltf => gltf::automatic_stride(topology, store.len(), options),
        FrameFormat::Gif => gif::automatic_stride(topology.frames_per_second),
        _ => 1,
    };
    if stride > 1 {
        warnings.push(format!(
            "the {format} file has 1 of {stride} frames, as the format handles no more well; \
             set a frame stride to choose yourself"
        ));
    }
    stride
}

/// What a point cache does not say of its rate.
fn rate_note(format: FrameFormat, rate: f64) -> String {
    let why = match format {
        FrameFormat::Pc2 => "the pc2 format has no frame rate",
        _ => "the mdd format has the times of its frames, but Blender plays one in each of its own",
    };
    format!("{why}: set the scene that plays it to {rate} frames per second")
}
