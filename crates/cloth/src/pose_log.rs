//! Where colliders were.

use std::{
    fmt::Write,
    fs, io,
    path::{Path, PathBuf},
    sync::{Arc, PoisonError, RwLock},
};

use cloth_core::Pose;

/// Poses of all colliders, frame by frame; copies share their memory, so that a picture can be asked for
/// while the simulation goes on.
#[derive(Clone, Debug, Default)]
pub struct PoseLog(Arc<RwLock<Vec<Vec<Pose>>>>);

impl PoseLog {
    /// A log of frames up to `frame`, of which the last alone is known: colliders are there in all.
    #[must_use]
    pub fn new(frame: u64, poses: Vec<Pose>) -> Self {
        Self(Arc::new(RwLock::new(vec![poses; frame as usize + 1])))
    }

    /// Adds the next frame.
    pub fn push(&self, poses: &[Pose]) {
        self.0.write().unwrap_or_else(PoisonError::into_inner).push(poses.to_vec());
    }

    /// Reads the poses of `colliders` colliders, a line for each frame as [`pose_line`] writes it. A last line that is not complete
    /// is left out: a run that was interrupted may have left it.
    ///
    /// # Errors
    /// [`PoseLogError`] if the file cannot be read, has no line, or one that is something else.
    pub fn read(path: &Path, colliders: usize) -> Result<Self, PoseLogError> {
        let problem = |problem: String| PoseLogError { file: path.to_owned(), problem };
        let text =
            fs::read_to_string(path).map_err(|error: io::Error| problem(error.to_string()))?;
        let complete = text.rfind('\n').map_or("", |end| &text[..end]);
        let frames = (1..).zip(complete.lines()).map(|(number, line)| {
            poses_of_line(line, colliders)
                .ok_or_else(|| problem(format!("line {number} is not {colliders} poses")))
        });
        let frames: Vec<_> = frames.collect::<Result<_, _>>()?;
        if frames.is_empty() {
            return Err(problem("it has no frame".into()));
        }
        Ok(Self(Arc::new(RwLock::new(frames))))
    }

    /// Puts down what another log knows of frames that this one has: what was before a run went on from a checkpoint.
    pub fn earlier_set(&self, earlier: &Self) {
        let earlier = earlier.0.read().unwrap_or_else(PoisonError::into_inner).clone();
        let mut frames = self.0.write().unwrap_or_else(PoisonError::into_inner);
        frames.iter_mut().zip(earlier).for_each(|(frame, earlier)| *frame = earlier);
    }

    /// The poses of a frame since the start of this log; of the last one, for a later frame.
    #[must_use]
    pub fn at(&self, frame: usize) -> Vec<Pose> {
        let frames = self.0.read().unwrap_or_else(PoisonError::into_inner);
        frames.get(frame).or(frames.last()).cloned().unwrap_or_default()
    }
}

/// A file of poses that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("`{}` does not tell where rigid bodies were ({problem}); run the scene again, or remove the file to show them at their start", file.display())]
pub struct PoseLogError {
    file: PathBuf,
    problem: String,
}

/// The poses of a frame in a line of text: seven numbers for each collider, translation \[m\] and then rotation (x, y, z, w), with all
/// their digits.
#[must_use]
pub fn pose_line(poses: &[Pose]) -> String {
    let mut line = String::new();
    for number in poses.iter().flat_map(|pose| pose.translation.iter().chain(&pose.rotation)) {
        let space = if line.is_empty() { "" } else { " " };
        // A string takes whatever is written into it.
        let _ = write!(line, "{space}{number}");
    }
    line.push('\n');
    line
}

fn poses_of_line(line: &str, colliders: usize) -> Option<Vec<Pose>> {
    let numbers: Vec<f64> = line.split(' ').map(|word| word.parse().ok()).collect::<Option<_>>()?;
    let is_usable = numbers.len() == 7 * colliders && numbers.iter().all(|x| x.is_finite());
    let pose =
        |n: &[f64]| Pose { translation: [n[0], n[1], n[2]], rotation: [n[3], n[4], n[5], n[6]] };
    is_usable.then(|| numbers.chunks_exact(7).map(pose).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn poses_come_back_to_the_last_bit() {
        let frames: Vec<Vec<Pose>> = (1..4)
            .map(|frame| {
                let place = |k: f64| Pose {
                    translation: [1.0 / (f64::from(frame) + k), -1e-17, 2e30],
                    rotation: [0.5, -0.5, 0.5, 0.5_f64.sqrt().sqrt()],
                };
                vec![place(0.3), place(0.7)]
            })
            .collect();
        let folder = tempfile::tempdir().unwrap();
        let file = folder.path().join("poses.txt");
        let text: String = frames.iter().map(|poses| pose_line(poses)).collect();
        fs::write(&file, format!("{text}0.25 0.1")).unwrap();
        let log = PoseLog::read(&file, 2).unwrap();
        for (number, poses) in frames.iter().enumerate() {
            assert_eq!(&log.at(number), poses);
        }
        assert_eq!(log.at(9), frames[2], "the last one stays");
        let resumed = PoseLog::new(3, frames[0].clone());
        resumed.earlier_set(&log);
        resumed.push(&frames[1]);
        let expected = [0, 1, 2, 0, 1].map(|number: usize| frames[number].clone());
        assert_eq!([0, 1, 2, 3, 4].map(|frame| resumed.at(frame)), expected);
        for (text, problem) in [
            ("", "no frame"),
            ("1 2 3", "no frame"),
            ("1 2 3\n", "line 1"),
            ("1 2 3 0 0 0 nan 1 2 3 0 0 0 1\n", "line 1"),
        ] {
            fs::write(&file, text).unwrap();
            let error = PoseLog::read(&file, 2).unwrap_err().to_string();
            assert!(error.contains(problem) && error.contains("poses.txt"), "{error}");
        }
    }
}
