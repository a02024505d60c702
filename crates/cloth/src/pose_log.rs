//! Where colliders were.
//!
//! A text file, a line for each frame. All numbers are written in the same width, so that a frame is found without reading those
//! before it, and nothing of them stays in memory.

use std::{
    fmt::Write as _,
    fs::{File, OpenOptions},
    io::{self, Read, Seek, SeekFrom, Write as _},
    path::{Path, PathBuf},
    sync::{Arc, Mutex, MutexGuard, PoisonError},
};

use cloth_core::Pose;
use cloth_io::{file_open_with, output_check};

/// Characters of a number: the longest is `-2.2250738585072014e-308`. One more parts it from the next.
const NUMBER_WIDTH: usize = 24;
/// Numbers of a pose.
const POSE_NUMBERS: usize = 7;

/// Poses of all colliders, frame by frame, in a file; copies share it, so that a picture can be asked for while the
/// simulation goes on.
#[derive(Clone, Debug)]
pub struct PoseLog(Arc<Mutex<PoseFile>>);

#[derive(Debug)]
struct PoseFile {
    path: PathBuf,
    file: File,
    colliders: usize,
    frames: u64,
    /// The poses that were read or written last, for a file that can no longer be read.
    last: Vec<Pose>,
}

impl PoseLog {
    /// An empty log in the file `path`; what the file had in it is gone.
    ///
    /// # Errors
    /// [`PoseLogError`] if the file cannot be written.
    pub fn create(path: &Path, colliders: usize) -> Result<Self, PoseLogError> {
        let mut options = OpenOptions::new();
        options.read(true).write(true).create(true).truncate(true);
        let file = output_check(path).and_then(|_| options.open(path));
        let file = file.map_err(|error| PoseLogError::new(path, &error))?;
        Ok(Self::of(path, file, colliders, 0, Vec::new()))
    }

    /// The log in the file `path`, of which the first `frames` frames are kept, to go on after them. Frames that it does not have,
    /// as the file is missing or too short, get `poses`.
    ///
    /// # Errors
    /// [`PoseLogError`] if a line is something else, or the file cannot be read or written.
    pub fn resume(path: &Path, poses: &[Pose], frames: u64) -> Result<Self, PoseLogError> {
        let log = if path.exists() {
            Self::open(path, poses.len(), true)?
        } else {
            Self::create(path, poses.len())?
        };
        {
            let mut file = log.lock();
            file.frames = file.frames.min(frames);
            let end = file.start_of(file.frames);
            file.file.set_len(end).map_err(|error| PoseLogError::new(path, &error))?;
        }
        for _ in log.len()..frames {
            log.push(poses)?;
        }
        Ok(log)
    }

    /// Reads the poses of `colliders` colliders, as [`pose_line`] writes them. A last line that is not complete
    /// is left out: a run that was interrupted may have left it.
    ///
    /// # Errors
    /// [`PoseLogError`] if the file cannot be read, has no line, or one that is something else.
    pub fn read(path: &Path, colliders: usize) -> Result<Self, PoseLogError> {
        let log = Self::open(path, colliders, false)?;
        if log.is_empty() { Err(PoseLogError::new(path, &"it has no frame")) } else { Ok(log) }
    }

    fn open(path: &Path, colliders: usize, write: bool) -> Result<Self, PoseLogError> {
        let problem = |error: io::Error| PoseLogError::new(path, &error);
        let mut file =
            file_open_with(path, OpenOptions::new().read(true).write(write)).map_err(problem)?;
        let size = file.metadata().map_err(problem)?.len();
        let mut line = vec![0; line_size(colliders)];
        let frames = size / line.len() as u64;
        let mut last = Vec::new();
        for number in 1..=frames {
            file.read_exact(&mut line).map_err(problem)?;
            last = poses_of_line(&line, colliders)
                .ok_or_else(|| wrong_line(path, number, colliders))?;
        }
        // What follows the last line is the beginning of another one, or the file is something else.
        let rest = size % line.len() as u64;
        line.clear();
        Read::by_ref(&mut file).take(rest).read_to_end(&mut line).map_err(problem)?;
        if line.contains(&b'\n') {
            return Err(wrong_line(path, frames + 1, colliders));
        }
        Ok(Self::of(path, file, colliders, frames, last))
    }

    fn of(path: &Path, file: File, colliders: usize, frames: u64, last: Vec<Pose>) -> Self {
        let path = path.to_owned();
        Self(Arc::new(Mutex::new(PoseFile { path, file, colliders, frames, last })))
    }

    /// Appends the poses of a frame.
    ///
    /// # Errors
    /// [`PoseLogError`] if the file cannot be written, or if it is a log of another number of colliders.
    pub fn push(&self, poses: &[Pose]) -> Result<(), PoseLogError> {
        let mut log = self.lock();
        if poses.len() != log.colliders {
            let problem = format!("{} poses for {} colliders", poses.len(), log.colliders);
            return Err(PoseLogError::new(&log.path, &problem));
        }
        let start = log.start_of(log.frames);
        let line = pose_line(poses);
        let written =
            log.file.seek(SeekFrom::Start(start)).and_then(|_| log.file.write_all(line.as_bytes()));
        written.map_err(|error| PoseLogError::new(&log.path, &error))?;
        log.frames += 1;
        poses.clone_into(&mut log.last);
        Ok(())
    }

    /// Waits until all frames are on the disk and survive a loss of power; for checkpoints.
    ///
    /// # Errors
    /// [`PoseLogError`].
    pub fn sync(&self) -> Result<(), PoseLogError> {
        let log = self.lock();
        log.file.sync_data().map_err(|error| PoseLogError::new(&log.path, &error))
    }

    /// Number of frames.
    #[must_use]
    pub fn len(&self) -> u64 {
        self.lock().frames
    }

    /// Whether there are no frames.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The poses of a frame since the start of this log; of the last one, for a later frame. A picture can still be drawn if the
    /// file can no longer be read: colliders then stay where they were known last.
    #[must_use]
    pub fn at(&self, frame: usize) -> Vec<Pose> {
        let mut log = self.lock();
        let frame = (frame as u64).min(log.frames.saturating_sub(1));
        let mut line = vec![0; line_size(log.colliders)];
        let start = log.start_of(frame);
        let read =
            log.file.seek(SeekFrom::Start(start)).and_then(|_| log.file.read_exact(&mut line));
        if let Some(poses) = read.ok().and_then(|()| poses_of_line(&line, log.colliders)) {
            log.last = poses;
        }
        log.last.clone()
    }

    fn lock(&self) -> MutexGuard<'_, PoseFile> {
        // A panic elsewhere cannot harm a file position that every use sets anew.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl PoseFile {
    fn start_of(&self, frame: u64) -> u64 {
        frame * line_size(self.colliders) as u64
    }
}

/// A file of poses that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{}` does not tell where rigid bodies were ({problem}); run the scene again, or remove the file to show them at their start", file.display())]
pub struct PoseLogError {
    file: PathBuf,
    problem: String,
}

impl PoseLogError {
    fn new(file: &Path, problem: &impl ToString) -> Self {
        Self { file: file.to_owned(), problem: problem.to_string() }
    }
}

fn wrong_line(path: &Path, number: u64, colliders: usize) -> PoseLogError {
    PoseLogError::new(path, &format!("line {number} is not {colliders} poses"))
}

/// The poses of a frame in a line of text: seven numbers for each collider, translation \[m\] and then rotation (x, y, z, w), with all
/// their digits. Lines of as many colliders have the same length.
#[must_use]
pub fn pose_line(poses: &[Pose]) -> String {
    let mut line = String::with_capacity(line_size(poses.len()));
    for number in poses.iter().flat_map(|pose| pose.translation.iter().chain(&pose.rotation)) {
        // A string takes whatever is written into it.
        let _ = write!(line, "{number:>NUMBER_WIDTH$e} ");
    }
    line.pop();
    line.push('\n');
    line
}

/// Bytes of a line; a line without numbers still has its end.
const fn line_size(colliders: usize) -> usize {
    if colliders == 0 { 1 } else { colliders * POSE_NUMBERS * (NUMBER_WIDTH + 1) }
}

fn poses_of_line(line: &[u8], colliders: usize) -> Option<Vec<Pose>> {
    let line = std::str::from_utf8(line).ok()?.strip_suffix('\n')?;
    let words = line.split(' ').filter(|word| !word.is_empty());
    let numbers: Vec<f64> = words.map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let is_usable = numbers.len() == POSE_NUMBERS * colliders
        && numbers.iter().all(|x| x.is_finite())
        && !line.contains('\n');
    let pose =
        |n: &[f64]| Pose { translation: [n[0], n[1], n[2]], rotation: [n[3], n[4], n[5], n[6]] };
    is_usable.then(|| numbers.chunks_exact(POSE_NUMBERS).map(pose).collect())
}

#[cfg(test)]
mod tests {
    use std::fs;

    use super::*;

    fn poses(frame: i32) -> Vec<Pose> {
        let place = |k: f64| Pose {
            translation: [1.0 / (f64::from(frame) + k), -f64::MIN_POSITIVE, 2e30],
            rotation: [0.5, -0.5, 0.5, 0.5_f64.sqrt().sqrt()],
        };
        vec![place(0.3), place(0.7)]
    }

    #[test]
    fn poses_come_back_to_the_last_bit() {
        let frames: Vec<Vec<Pose>> = (1..4).map(poses).collect();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("poses.txt");
        let text: String = frames.iter().map(|poses| pose_line(poses)).collect();
        fs::write(&file, format!("{text}   1e0 2e")).unwrap();
        let log = PoseLog::read(&file, 2).unwrap();
        for (number, poses) in frames.iter().enumerate() {
            assert_eq!(&log.at(number), poses);
        }
        assert_eq!(log.at(9), frames[2], "the last one stays");
        let resumed = PoseLog::resume(&file, &frames[0], 2).unwrap();
        resumed.push(&frames[0]).unwrap();
        assert_eq!(
            [0, 1, 2, 3].map(|frame| resumed.at(frame)),
            [0, 1, 0, 0].map(|k: usize| frames[k].clone())
        );
        assert_eq!(fs::read_to_string(&file).unwrap().lines().count(), 3, "what was half is gone");
        let longer = PoseLog::resume(&file, &frames[1], 5).unwrap();
        assert_eq!(
            (longer.len(), longer.at(4), longer.at(2)),
            (5, frames[1].clone(), frames[0].clone())
        );
        assert!(resumed.push(&frames[0][..1]).unwrap_err().to_string().contains("1 poses for 2"));
    }

    #[test]
    fn files_that_are_no_poses_are_refused() {
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("poses.txt");
        let good = pose_line(&poses(1));
        for (text, problem) in [
            (String::new(), "no frame"),
            ("1 2 3".into(), "no frame"),
            ("1 2 3\n".into(), "line 1"),
            (good.replacen("5e-1", " nan", 1), "line 1"),
            (good.replacen("5e-1 ", "5e-1\n", 1), "line 1"),
            (format!("{good}nothing\n"), "line 2"),
        ] {
            fs::write(&file, text).unwrap();
            let error = PoseLog::read(&file, 2).unwrap_err().to_string();
            assert!(error.contains(problem) && error.contains("poses.txt"), "{error}");
        }
    }

    #[cfg(unix)]
    #[test]
    fn pipes_and_devices_are_no_pose_logs() {
        let folder = tempfile::tempdir().unwrap();
        let pipe = folder.path().join("pipe");
        assert!(std::process::Command::new("mkfifo").arg(&pipe).status().unwrap().success());
        let device = folder.path().join("zero");
        std::os::unix::fs::symlink("/dev/zero", &device).unwrap();
        for path in [&pipe, &device] {
            for log in [PoseLog::read(path, 2), PoseLog::resume(path, &poses(1), 3)] {
                let error = log.unwrap_err().to_string();
                assert!(error.contains("not a regular file"), "{error}");
            }
            assert!(PoseLog::create(path, 2).is_err());
        }
    }

    /// What is kept of a frame is its line in the file.
    #[test]
    fn the_log_does_not_grow_in_memory() {
        let folder = tempfile::tempdir().unwrap();
        let log = PoseLog::create(&folder.path().join("poses.txt"), 2).unwrap();
        for frame in 0..1000 {
            log.push(&poses(frame)).unwrap();
        }
        assert_eq!((log.at(0), log.at(500), log.at(999)), (poses(0), poses(500), poses(999)));
        let held = log.lock();
        assert_eq!((held.frames, held.last.len()), (1000, 2), "one frame of two poses");
    }
}
