//! The frames of a run on their way into files.

use std::{num::NonZeroUsize, path::PathBuf};

use cloth::{
    PoseLog, State,
    io::{
        ContainerOptions, Frame, FrameFormat, FramePipeline, FrameSolids, FrameStore, PictureMaker,
        PictureSequence, PictureStyle, Topology, container_files, container_write,
    },
};
use tempfile::TempDir;

use crate::{
    failure::{Failure, WriteError},
    run_folder::{DRAWN_PREFIX, DRAWN_SUFFIX, RunFolder, RunSettings, file_remove},
    say,
};

/// Longer side of animated pictures \[pixel\]: larger ones are too slow to load and to show.
const ANIMATION_SIDE_LIMIT: u32 = 800;

/// All outputs of a run.
pub(super) struct Outputs<'a> {
    topology: &'a Topology,
    store: FrameStore,
    /// Where rigid bodies are, which nothing else tells.
    poses: Option<PoseLog>,
    /// Writes files of single frames, pictures among them, while the next frames are computed.
    pipeline: FramePipeline,
    /// Formats that are made at the end.
    containers: Vec<FrameFormat>,
    /// Folders and files that the user can look at, the best first.
    sequence_folders: Vec<PathBuf>,
    frame_stride: usize,
    /// How animated pictures look, and the pictures that they are made of.
    animation: (PictureStyle, Option<PictureSequence>),
    /// Holds the pictures of animations if nobody asked for them; it goes with the run.
    _drawn: Option<TempDir>,
    /// What draws pictures in place of the renderer of `cloth::io`.
    maker: Option<PictureMaker<'a>>,
    /// What formats that can are to show beside the cloth.
    solids: Option<FrameSolids>,
}

/// How pictures and files are made.
pub(super) struct Making<'a> {
    pub(super) style: PictureStyle,
    /// What draws pictures in place of the renderer of `cloth::io`.
    pub(super) maker: Option<PictureMaker<'a>>,
    /// Threads that draw and write; as many as the machine has if not given.
    pub(super) threads: Option<NonZeroUsize>,
    /// Whether the run goes on with an earlier part, whose pictures may have another size or look.
    pub(super) resume: bool,
}

/// The frames in the folder end before the checkpoint.
#[derive(Debug, thiserror::Error)]
#[error(
    "`{}` has {found} frames but the checkpoint needs {expected}; start again without --resume",
    file.display()
)]
struct StoreShort {
    file: PathBuf,
    found: usize,
    expected: u64,
}

/// The store of a run from its start; what an earlier run left in the folder is removed.
pub(super) fn store_create(folder: &RunFolder, topology: &Topology) -> Result<FrameStore, Failure> {
    let store = FrameStore::create(&folder.store(), topology)?;
    folder.leftovers_remove()?;
    // It would not fit the frames of the new run.
    file_remove(&folder.checkpoint())?;
    file_remove(&folder.poses())?;
    folder.outputs_remove()?;
    caches_remove(folder, topology)?;
    Ok(store)
}

/// The store of a run that goes on after `frame`; what comes after it is removed.
pub(super) fn store_resume(
    folder: &RunFolder,
    topology: &Topology,
    frame: u64,
) -> Result<FrameStore, Failure> {
    let mut store = FrameStore::open(&folder.store(), topology)?;
    folder.leftovers_remove()?;
    let expected = frame + 1;
    let found = store.len();
    if (found as u64) < expected {
        return Err(Failure::input(StoreShort { file: folder.store(), found, expected }));
    }
    store.truncate(expected as usize)?;
    folder.frames_remove(expected)?;
    caches_remove(folder, topology)?;
    Ok(store)
}

impl<'a> Outputs<'a> {
    /// All outputs that `settings` ask for.
    pub(super) fn new(
        folder: &RunFolder,
        topology: &'a Topology,
        store: FrameStore,
        making: Making<'a>,
        settings: &RunSettings,
    ) -> Result<Self, Failure> {
        let Making { style, maker, threads, resume } = making;
        let mut pipeline = FramePipeline::new(topology, threads)?;
        let mut sequence_folders = Vec::new();
        for &format in settings.formats.iter().filter(|format| format.is_sequence()) {
            let path = folder.sequence(format);
            if format == FrameFormat::Png {
                let sequence = pictures(folder, path.clone());
                pipeline.add_pictures(&sequence, &style)?;
            } else {
                pipeline.add_geometry(format, &path, folder.name(), &store)?;
            }
            sequence_folders.push(path);
        }
        let formats = settings.formats.iter().copied();
        let containers: Vec<_> = formats.filter(|format| !format.is_sequence()).collect();
        // Animations are made of the pictures of frames if these are there and have the right size;
        // those before a resumed part may have been made with another size or scene.
        let animated = animation_style(&style);
        let has_pictures = settings.formats.contains(&FrameFormat::Png) && !resume;
        let is_same_size = (animated.width, animated.height) == (style.width, style.height);
        let mut drawn = None;
        let mut sequence = None;
        if containers.iter().any(|format| format.is_picture()) {
            if has_pictures && is_same_size {
                sequence = Some(pictures(folder, folder.sequence(FrameFormat::Png)));
            } else {
                let mut builder = tempfile::Builder::new();
                let root =
                    builder.prefix(DRAWN_PREFIX).suffix(DRAWN_SUFFIX).tempdir_in(&folder.root);
                let root = root.map_err(WriteError::of(&folder.root))?;
                let own = pictures(folder, root.path().to_owned());
                pipeline.add_pictures(&own, &animated)?;
                (sequence, drawn) = (Some(own), Some(root));
            }
        }
        let is_drawing = sequence.is_some() || settings.formats.contains(&FrameFormat::Png);
        Ok(Self {
            topology,
            store,
            poses: None,
            pipeline,
            containers,
            sequence_folders,
            frame_stride: settings.frame_stride,
            animation: (animated, sequence),
            _drawn: drawn,
            maker: maker.filter(|_| is_drawing),
            solids: None,
        })
    }

    /// Shows `solids` in the formats that can.
    pub(super) fn solids_set(&mut self, solids: Option<FrameSolids>) {
        if let Some(solids) = &solids {
            self.pipeline.solids_set(solids);
        }
        self.solids = solids;
    }

    /// Takes the file that gets the poses of rigid bodies.
    pub(super) fn poses_set(&mut self, poses: Option<PoseLog>) {
        self.poses = poses;
    }

    /// Names of the formats that are made when all frames are there.
    pub(super) fn made_at_end(&self) -> String {
        self.containers.iter().map(|format| format.name()).collect::<Vec<_>>().join(", ")
    }

    /// Writes a frame into the store and the formats with one file per frame.
    pub(super) fn write(
        &mut self,
        frame: u64,
        state: &State,
        normals: &[[f64; 3]],
    ) -> Result<(), Failure> {
        self.store.append(state.time, &state.positions)?;
        if let Some(poses) = &self.poses {
            poses.push(&state.colliders)?;
        }
        if !frame.is_multiple_of(self.frame_stride as u64) {
            return Ok(());
        }
        let frame = Frame {
            velocities: Some(&state.velocities),
            normals: Some(normals),
            ..Frame::new(frame, state.time, &state.positions)
        };
        let picture = match &mut self.maker {
            Some(maker) => Some(maker(&frame).map_err(Failure::other)?),
            None => None,
        };
        Ok(self.pipeline.write(&frame, picture)?)
    }

    /// Waits until the files of all frames are written, and those in the store survive a loss of
    /// power.
    pub(super) fn sync(&mut self) -> Result<(), Failure> {
        self.pipeline.finish()?;
        self.poses.iter().try_for_each(PoseLog::sync)?;
        Ok(self.store.sync()?)
    }

    /// Draws the pictures of animations that an earlier part of the run did not leave, if it is not
    /// the renderer of `cloth::io` that draws.
    fn earlier_drawn(&mut self) -> Result<(), Failure> {
        let (Some(maker), (_, Some(sequence))) = (&mut self.maker, &self.animation) else {
            return Ok(());
        };
        for index in (0..self.store.len()).step_by(self.frame_stride) {
            let file = sequence.file(index);
            if !file.exists() {
                let stored = self.store.frame(index)?;
                let positions = stored.positions_f64();
                let frame = Frame::new(index as u64, stored.time, &positions);
                maker(&frame).and_then(|image| Ok(image.save(&file)?)).map_err(Failure::other)?;
            }
        }
        Ok(())
    }

    /// Makes the formats with all frames in one file, and says where to look.
    pub(super) fn finish(&mut self, folder: &RunFolder) -> Result<String, Failure> {
        let pipeline = self.pipeline.finish();
        let drawn = self.earlier_drawn();
        let (style, picture_sequence) = self.animation.clone();
        let options = ContainerOptions {
            frame_stride: (self.frame_stride > 1).then_some(self.frame_stride),
            style,
            picture_sequence,
            solids: self.solids.clone(),
            ..ContainerOptions::default()
        };
        let mut files = Vec::new();
        for &format in &self.containers {
            let path = folder.container(format);
            let report = container_write(format, &path, self.topology, &self.store, &options)?;
            for warning in report.warnings {
                say::warning(warning);
            }
            for note in report.notes {
                say::note(note);
            }
            for path in report.files {
                say::detail(format_args!("wrote `{}`", path.display()));
                let file = format!("`{}`", path.display());
                // Caches of several formats share their meshes.
                if !files.contains(&file) {
                    files.push(file);
                }
            }
        }
        // What there is of the frames is worth having, with an error too.
        pipeline?;
        drawn?;
        files.extend(self.sequence_folders.iter().map(|path| format!("`{}`", path.display())));
        if files.is_empty() {
            let store = folder.root.display();
            return Ok(format!(
                "all frames are kept in `{store}`; `cloth convert` makes formats of them"
            ));
        }
        Ok(format!("look at {}", files.join(", ")))
    }
}

/// Removes the point caches of an earlier run, of which each cloth has its own.
fn caches_remove(folder: &RunFolder, topology: &Topology) -> Result<(), WriteError> {
    for format in [FrameFormat::Pc2, FrameFormat::Mdd] {
        let files = container_files(format, &folder.container(format), topology);
        files.iter().try_for_each(|file| file_remove(file))?;
    }
    Ok(())
}

/// The pictures of the run in `folder` that lie in the folder `path`.
fn pictures(folder: &RunFolder, path: PathBuf) -> PictureSequence {
    PictureSequence { folder: path, name: folder.name().to_owned() }
}

/// `style` with sides of at most [`ANIMATION_SIDE_LIMIT`].
fn animation_style(style: &PictureStyle) -> PictureStyle {
    let longer = style.width.max(style.height).max(ANIMATION_SIDE_LIMIT);
    let scaled = |side: u32| (side * ANIMATION_SIDE_LIMIT).div_ceil(longer);
    PictureStyle { width: scaled(style.width), height: scaled(style.height), ..style.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn animations_are_scaled_down_and_never_up() {
        let size = |width, height| {
            let style = animation_style(&PictureStyle { width, height, ..PictureStyle::default() });
            [style.width, style.height]
        };
        assert_eq!(size(1280, 720), [800, 450]);
        assert_eq!(size(720, 1280), [450, 800]);
        assert_eq!(size(800, 450), [800, 450]);
        assert_eq!(size(32, 18), [32, 18]);
        assert_eq!(size(8192, 1), [800, 1]);
    }
}
