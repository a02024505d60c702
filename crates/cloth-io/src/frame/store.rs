//! The append-only file of all frames of a run.
//!
//! Layout, little endian: a header of 64 bytes (magic `CLOTHFRM`, version u32, zero u32, particle
//! count n u64, topology hash u64, frames per second f64, zeros), then one record per frame: time
//! \[s\] f64 and n positions \[m\] of 3 × f32. All records have the same size, so the number of
//! frames follows from the size of the file, and a run that died inside a record loses only that
//! record.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::{FrameError, Topology};

const MAGIC: &[u8; 8] = b"CLOTHFRM";
const VERSION: u32 = 1;
const HEADER_SIZE: usize = 64;

/// All frames of a run in one append-only file, see the [format names](crate::FrameFormat) for
/// what can be made from it.
#[derive(Debug)]
pub struct FrameStore {
    path: PathBuf,
    /// Behind a lock because reading moves the position in the file.
    file: Mutex<File>,
    particle_count: usize,
    frame_count: usize,
    append: bool,
}

/// A frame read back from a [`FrameStore`].
#[derive(Clone, Debug, PartialEq)]
pub struct StoredFrame {
    /// Time since the start of the simulation \[s\].
    pub time: f64,
    /// Position of every particle \[m\].
    pub positions: Vec<[f32; 3]>,
}

impl StoredFrame {
    /// The positions in double precision \[m\].
    #[must_use]
    pub fn positions_f64(&self) -> Vec<[f64; 3]> {
        self.positions.iter().map(|p| p.map(f64::from)).collect()
    }
}

impl FrameStore {
    /// Creates an empty store for appending; an existing file is emptied.
    ///
    /// # Errors
    ///
    /// [`FrameError::Write`], [`FrameError::StoreLocked`] if another run appends to the file, or
    /// [`FrameError::Topology`].
    pub fn create(path: &Path, topology: &Topology) -> Result<Self, FrameError> {
        topology.check()?;
        let mut file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            // Only after the lock is ours.
            .truncate(false)
            .open(path)
            .map_err(FrameError::write(path))?;
        lock(path, &file)?;
        let mut header = [0; HEADER_SIZE];
        header[0..8].copy_from_slice(MAGIC);
        header[8..12].copy_from_slice(&VERSION.to_le_bytes());
        header[16..24].copy_from_slice(&(topology.particle_count as u64).to_le_bytes());
        header[24..32].copy_from_slice(&topology.hash().to_le_bytes());
        header[32..40].copy_from_slice(&topology.frames_per_second.to_le_bytes());
        file.set_len(0).and_then(|()| file.write_all(&header)).map_err(FrameError::write(path))?;
        Ok(Self::new(path, file, topology, 0, true))
    }

    /// Opens an existing store for appending. A partly written last record is cut off.
    ///
    /// # Errors
    ///
    /// [`FrameError::Read`], [`FrameError::StoreMagic`], [`FrameError::StoreVersion`],
    /// [`FrameError::StoreTopology`], [`FrameError::StoreRate`] or [`FrameError::StoreLocked`].
    pub fn open(path: &Path, topology: &Topology) -> Result<Self, FrameError> {
        Self::open_with(path, topology, true)
    }

    /// Opens an existing store for reading only, also while a run appends to it. A partly written
    /// last record is left out.
    ///
    /// # Errors
    ///
    /// As [`FrameStore::open`], except [`FrameError::StoreLocked`].
    pub fn open_read_only(path: &Path, topology: &Topology) -> Result<Self, FrameError> {
        Self::open_with(path, topology, false)
    }

    fn open_with(path: &Path, topology: &Topology, append: bool) -> Result<Self, FrameError> {
        topology.check()?;
        let read_error = |source| FrameError::Read { file: path.to_owned(), source };
        let mut file =
            OpenOptions::new().read(true).write(append).open(path).map_err(read_error)?;
        if append {
            lock(path, &file)?;
        }
        let mut header = [0; HEADER_SIZE];
        match file.read_exact(&mut header) {
            Err(error) if error.kind() == io::ErrorKind::UnexpectedEof => {
                let file = path.to_owned();
                return Err(FrameError::StoreMagic { file });
            }
            result => result.map_err(read_error)?,
        }
        check_header(path, &header, topology)?;

        let record = record_size(topology.particle_count);
        let size = file.metadata().map_err(read_error)?.len();
        let frame_count = size.saturating_sub(HEADER_SIZE as u64) / record;
        if append {
            file.set_len(HEADER_SIZE as u64 + frame_count * record)
                .map_err(FrameError::write(path))?;
        }
        let frame_count = usize::try_from(frame_count).unwrap_or(usize::MAX);
        Ok(Self::new(path, file, topology, frame_count, append))
    }

    fn new(path: &Path, file: File, topology: &Topology, frame_count: usize, append: bool) -> Self {
        Self {
            path: path.to_owned(),
            file: Mutex::new(file),
            particle_count: topology.particle_count,
            frame_count,
            append,
        }
    }

    /// Number of complete frames.
    #[must_use]
    pub fn len(&self) -> usize {
        self.frame_count
    }

    /// Whether there are no frames.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.frame_count == 0
    }

    /// The file.
    #[must_use]
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Number of particles in each frame.
    #[must_use]
    pub fn particle_count(&self) -> usize {
        self.particle_count
    }

    /// Appends a frame at `time` \[s\] with `positions` \[m\]; when this returns, the frame is with
    /// the operating system and survives the end of the process.
    ///
    /// # Errors
    ///
    /// [`FrameError::ParticleCount`], [`FrameError::Position`], [`FrameError::StoreReadOnly`], or
    /// [`FrameError::Write`], after which the store still has its earlier frames.
    pub fn append(&mut self, time: f64, positions: &[[f64; 3]]) -> Result<(), FrameError> {
        self.check_append()?;
        if positions.len() != self.particle_count {
            return Err(FrameError::ParticleCount {
                found: positions.len(),
                expected: self.particle_count,
            });
        }
        let mut record = Vec::with_capacity(8 + 12 * positions.len());
        record.extend_from_slice(&time.to_le_bytes());
        for (particle, position) in positions.iter().enumerate() {
            for &coordinate in position {
                let coordinate = coordinate as f32;
                if !coordinate.is_finite() {
                    return Err(FrameError::Position { particle });
                }
                record.extend_from_slice(&coordinate.to_le_bytes());
            }
        }
        let start = self.record_start(self.frame_count);
        let mut file = self.lock_file();
        let written = file.seek(SeekFrom::Start(start)).and_then(|_| file.write_all(&record));
        drop(file);
        written.map_err(FrameError::write(&self.path))?;
        self.frame_count += 1;
        Ok(())
    }

    /// Drops all frames from `frame_count` on, to resume from a checkpoint; more than there are
    /// changes nothing.
    ///
    /// # Errors
    ///
    /// [`FrameError::StoreReadOnly`] or [`FrameError::Write`].
    pub fn truncate(&mut self, frame_count: usize) -> Result<(), FrameError> {
        self.check_append()?;
        if frame_count < self.frame_count {
            let end = self.record_start(frame_count);
            let result = self.lock_file().set_len(end);
            result.map_err(FrameError::write(&self.path))?;
            self.frame_count = frame_count;
        }
        Ok(())
    }

    /// Waits until all frames are on the disk and survive a loss of power; for checkpoints.
    ///
    /// # Errors
    ///
    /// [`FrameError::Write`].
    pub fn sync(&self) -> Result<(), FrameError> {
        let result = self.lock_file().sync_data();
        result.map_err(FrameError::write(&self.path))
    }

    /// Reads frame `index`, zero based.
    ///
    /// # Errors
    ///
    /// [`FrameError::FrameIndex`] or [`FrameError::Read`].
    pub fn frame(&self, index: usize) -> Result<StoredFrame, FrameError> {
        let record = record_size(self.particle_count) as usize;
        let bytes = self.read(index, record)?;
        let (time, positions) = bytes.split_at(8);
        Ok(StoredFrame {
            time: f64::from_le_bytes(time.try_into().unwrap_or_default()),
            positions: positions.chunks_exact(12).map(position).collect(),
        })
    }

    /// Reads the time \[s\] of frame `index`, zero based, without its positions.
    ///
    /// # Errors
    ///
    /// As [`FrameStore::frame`].
    pub fn time(&self, index: usize) -> Result<f64, FrameError> {
        let bytes = self.read(index, 8)?;
        Ok(f64::from_le_bytes(bytes.try_into().unwrap_or_default()))
    }

    fn read(&self, index: usize, size: usize) -> Result<Vec<u8>, FrameError> {
        if index >= self.frame_count {
            let count = self.frame_count;
            return Err(FrameError::FrameIndex { index, count });
        }
        let mut bytes = vec![0; size];
        let mut file = self.lock_file();
        file.seek(SeekFrom::Start(self.record_start(index)))
            .and_then(|_| file.read_exact(&mut bytes))
            .map_err(|source| FrameError::Read { file: self.path.clone(), source })?;
        Ok(bytes)
    }

    fn check_append(&self) -> Result<(), FrameError> {
        if self.append {
            return Ok(());
        }
        let file = self.path.clone();
        Err(FrameError::StoreReadOnly { file })
    }

    fn record_start(&self, index: usize) -> u64 {
        HEADER_SIZE as u64 + index as u64 * record_size(self.particle_count)
    }

    fn lock_file(&self) -> MutexGuard<'_, File> {
        // A panic elsewhere cannot harm a file position that every use sets anew.
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn record_size(particle_count: usize) -> u64 {
    8 + 12 * particle_count as u64
}

fn position(bytes: &[u8]) -> [f32; 3] {
    let mut position = [0.0; 3];
    for (coordinate, bytes) in position.iter_mut().zip(bytes.chunks_exact(4)) {
        *coordinate = f32::from_le_bytes(bytes.try_into().unwrap_or_default());
    }
    position
}

fn lock(path: &Path, file: &File) -> Result<(), FrameError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(FrameError::StoreLocked { file: path.to_owned() }),
        // A file system without locks is no reason to refuse the run.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

fn check_header(
    path: &Path,
    header: &[u8; HEADER_SIZE],
    topology: &Topology,
) -> Result<(), FrameError> {
    let file = || path.to_owned();
    let word = |start: usize| {
        let mut bytes = [0; 8];
        bytes.copy_from_slice(&header[start..start + 8]);
        bytes
    };
    if &word(0) != MAGIC {
        return Err(FrameError::StoreMagic { file: file() });
    }
    let version = u64::from_le_bytes(word(8)) as u32;
    if version != VERSION {
        return Err(FrameError::StoreVersion { file: file(), found: version, expected: VERSION });
    }
    let particle_count = u64::from_le_bytes(word(16));
    let expected = topology.particle_count as u64;
    if particle_count != expected || u64::from_le_bytes(word(24)) != topology.hash() {
        return Err(FrameError::StoreTopology { file: file(), found: particle_count, expected });
    }
    let rate = f64::from_le_bytes(word(32));
    if rate != topology.frames_per_second {
        return Err(FrameError::StoreRate {
            file: file(),
            found: rate,
            expected: topology.frames_per_second,
        });
    }
    Ok(())
}
