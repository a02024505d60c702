//! The frames of a run on their way into files.

use std::{cell::RefCell, fs::File, io::Write, path::PathBuf, rc::Rc};

use cloth::{
    PoseLog, State,
    io::{
        ContainerOptions, Frame, FrameFormat, FrameSequenceWriter, FrameSolids, FrameStore,
        PictureMaker, PictureSequence, PictureStyle, Topology, container_files, container_write,
    },
    pose_line,
};
use tempfile::TempDir;

use crate::{
    arguments::RunArguments,
    failure::{Failure, WriteError},
    run_folder::{RunFolder, file_remove},
};

/// Longer side of animated pictures \[pixel\]: larger ones are too slow to load and to show.
const ANIMATION_SIDE_LIMIT: u32 = 640;

/// All outputs of a run.
pub(super) struct Outputs<'a> {
    topology: &'a Topology,
    store: FrameStore,
    /// Where rigid bodies are, which nothing else tells.
    poses: Option<(PathBuf, File)>,
    sequences: Vec<FrameSequenceWriter<'a>>,
    /// Formats that are made at the end.
    containers: Vec<FrameFormat>,
    /// Folders and files that the user can look at, the best first.
    sequence_folders: Vec<PathBuf>,
    frame_stride: usize,
    style: PictureStyle,
    /// Pictures that animations can be made from.
    picture_sequence: Option<PictureSequence>,
    /// What draws pictures in place of the renderer of `cloth::io`.
    maker: Option<Rc<RefCell<PictureMaker<'a>>>>,
    /// What formats that can are to show beside the cloth.
    solids: Option<FrameSolids>,
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

impl<'a> Outputs<'a> {
    /// Outputs of a run from its start, the poses of `bodies` rigid bodies among them. Those of an earlier run in the same folder are
    /// removed.
    pub(super) fn create(
        folder: &RunFolder,
        topology: &'a Topology,
        style: PictureStyle,
        maker: Option<PictureMaker<'a>>,
        arguments: &RunArguments,
        bodies: usize,
    ) -> Result<Self, Failure> {
        // First of all, as it locks out a second run in the same folder.
        let store = FrameStore::create(&folder.store(), topology)?;
        // It would not fit the frames of the new run.
        file_remove(&folder.checkpoint())?;
        folder.outputs_remove(0)?;
        caches_remove(folder, topology)?;
        let path = folder.poses();
        file_remove(&path)?;
        let mut outputs = Self::new(folder, topology, store, style, maker, arguments)?;
        if bodies > 0 {
            let file = File::create(&path).map_err(WriteError::of(&path))?;
            outputs.poses = Some((path, file));
        }
        Ok(outputs)
    }

    /// Outputs of a run that goes on after `frame`; what comes after it is removed. `poses` has those of rigid bodies up to
    /// there, if there are any.
    pub(super) fn resume(
        folder: &RunFolder,
        topology: &'a Topology,
        style: PictureStyle,
        maker: Option<PictureMaker<'a>>,
        arguments: &RunArguments,
        (frame, poses): (u64, Option<&PoseLog>),
    ) -> Result<Self, Failure> {
        let mut store = FrameStore::open(&folder.store(), topology)?;
        let expected = frame + 1;
        let found = store.len();
        if (found as u64) < expected {
            return Err(Failure::input(StoreShort { file: folder.store(), found, expected }));
        }
        store.truncate(expected as usize)?;
        folder.outputs_remove(expected)?;
        caches_remove(folder, topology)?;
        let mut outputs = Self::new(folder, topology, store, style, maker, arguments)?;
        if let Some(poses) = poses {
            let path = folder.poses();
            let lines: String = (0..=frame).map(|k| pose_line(&poses.at(k as usize))).collect();
            let mut file = File::create(&path).map_err(WriteError::of(&path))?;
            file.write_all(lines.as_bytes()).map_err(WriteError::of(&path))?;
            outputs.poses = Some((path, file));
        }
        Ok(outputs)
    }

    fn new(
        folder: &RunFolder,
        topology: &'a Topology,
        store: FrameStore,
        style: PictureStyle,
        maker: Option<PictureMaker<'a>>,
        arguments: &RunArguments,
    ) -> Result<Self, Failure> {
        let maker = maker.map(|maker| Rc::new(RefCell::new(maker)));
        let mut sequences = Vec::new();
        let mut sequence_folders = Vec::new();
        let mut containers = Vec::new();
        for &format in &arguments.format.0 {
            if !format.is_sequence() {
                containers.push(format);
                continue;
            }
            let path = folder.sequence(format);
            let mut writer = FrameSequenceWriter::new(format, &path, folder.name(), topology)?;
            if format == FrameFormat::Png
                && let Some(maker) = &maker
            {
                writer = writer.with_maker(shared(maker));
            }
            sequences.push(writer.with_style(style.clone()).resume(&store)?);
            sequence_folders.push(path);
        }
        // The pictures before a resumed part may have been made with another size or scene.
        let is_reusable = arguments.format.0.contains(&FrameFormat::Png) && !arguments.resume;
        let picture_sequence = is_reusable.then(|| PictureSequence {
            folder: folder.sequence(FrameFormat::Png),
            name: folder.name().to_owned(),
        });
        Ok(Self {
            topology,
            store,
            poses: None,
            sequences,
            containers,
            sequence_folders,
            frame_stride: arguments.frame_stride.get(),
            style,
            picture_sequence,
            maker,
            solids: None,
        })
    }

    /// Shows `solids` in the formats that can.
    pub(super) fn with_solids(mut self, solids: Option<FrameSolids>) -> Self {
        let sequences = self.sequences.into_iter();
        self.sequences = sequences.map(|writer| writer.with_solids(solids.clone())).collect();
        self.solids = solids;
        self
    }

    /// Writes a frame into the store and the formats with one file per frame.
    pub(super) fn write(
        &mut self,
        frame: u64,
        state: &State,
        normals: &[[f64; 3]],
    ) -> Result<(), Failure> {
        self.store.append(state.time, &state.positions)?;
        if let Some((path, file)) = &mut self.poses {
            let line = pose_line(&state.colliders);
            file.write_all(line.as_bytes()).map_err(WriteError::of(path))?;
        }
        if !frame.is_multiple_of(self.frame_stride as u64) {
            return Ok(());
        }
        let frame = Frame {
            velocities: Some(&state.velocities),
            normals: Some(normals),
            ..Frame::new(frame, state.time, &state.positions)
        };
        for sequence in &mut self.sequences {
            sequence.write(&frame)?;
        }
        Ok(())
    }

    /// Waits until all frames in the store survive a loss of power.
    pub(super) fn sync(&self) -> Result<(), Failure> {
        Ok(self.store.sync()?)
    }

    /// Draws all frames with the maker of pictures into a folder, if there is one and clips need it.
    fn drawn(&self, folder: &RunFolder) -> Result<Option<TempDir>, Failure> {
        let is_clip = self.containers.iter().any(|format| format.is_picture());
        let Some(maker) = self.maker.as_ref().filter(|_| is_clip) else { return Ok(None) };
        if self.picture_sequence.is_some() {
            return Ok(None);
        }
        let drawn = TempDir::new_in(&folder.root).map_err(WriteError::of(&folder.root))?;
        let (format, name) = (FrameFormat::Png, folder.name());
        let mut writer = FrameSequenceWriter::new(format, drawn.path(), name, self.topology)?
            .with_style(self.style.clone())
            .with_maker(shared(maker));
        for index in (0..self.store.len()).filter(|index| index.is_multiple_of(self.frame_stride)) {
            let frame = self.store.frame(index)?;
            writer.write(&Frame::new(index as u64, frame.time, &frame.positions_f64()))?;
        }
        Ok(Some(drawn))
    }

    /// Makes the formats with all frames in one file, and says where to look.
    pub(super) fn finish(&self, folder: &RunFolder) -> Result<String, Failure> {
        let drawn = self.drawn(folder)?;
        let drawn_sequence = drawn.as_ref().map(|drawn| PictureSequence {
            folder: drawn.path().to_owned(),
            name: folder.name().to_owned(),
        });
        let options = ContainerOptions {
            frame_stride: (self.frame_stride > 1).then_some(self.frame_stride),
            style: animation_style(&self.style),
            picture_sequence: drawn_sequence.or_else(|| self.picture_sequence.clone()),
            solids: self.solids.clone(),
            ..ContainerOptions::default()
        };
        let mut files = Vec::new();
        for &format in &self.containers {
            let path = folder.container(format);
            let report = container_write(format, &path, self.topology, &self.store, &options)?;
            for warning in report.warnings {
                eprintln!("warning: {warning}");
            }
            for note in report.notes {
                eprintln!("note: {note}");
            }
            files.extend(report.files.iter().map(|path| format!("`{}`", path.display())));
        }
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

/// A maker of pictures that others use, too.
fn shared<'a>(maker: &Rc<RefCell<PictureMaker<'a>>>) -> PictureMaker<'a> {
    let maker = Rc::clone(maker);
    Box::new(move |frame| (maker.borrow_mut())(frame))
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
        assert_eq!(size(800, 450), [640, 360]);
        assert_eq!(size(450, 800), [360, 640]);
        assert_eq!(size(32, 18), [32, 18]);
        assert_eq!(size(8192, 1), [640, 1]);
    }
}
