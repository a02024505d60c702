//! The append-only file of all frames of a run.
//!
//! Layout, little endian: a header of 64 bytes (magic `CLOTHFRM`, version u32, zero u32, particle
//! count n u64, topology hash u64, frames per second f64, zeros, CRC-32 of all that u32), then one
//! record per frame: time \[s\] f64, CRC-32 of the index of the frame as u64 and of the time u32, n
//! positions \[m\] of 3 × f32, CRC-32 of the index, the time and the positions u32. All records have the
//! same size, so the number of frames follows from the size of the file, and a run that died inside a
//! record loses only that record. Version 1 had no checksums; its files are read, and go on without.

use std::fs::{File, OpenOptions, TryLockError};
use std::io::{self, Read, Seek, SeekFrom, Write};
use std::path::{Path, PathBuf};
use std::sync::{Mutex, MutexGuard, PoisonError};

use super::record::{RecordLayout, StoredFrame};
use super::{Frame, FrameError, Topology};
use crate::file::{file_open_with, output_check};

const MAGIC: &[u8; 8] = b"CLOTHFRM";
const VERSION: u32 = 2;
const HEADER_SIZE: usize = 64;
/// Where the checksum of the header is.
const HEADER_CHECKSUM: usize = HEADER_SIZE - 4;

/// All frames of a run in one append-only file, see the [format names](crate::FrameFormat) for
/// what can be made from it.
#[derive(Debug)]
pub struct FrameStore {
    path: PathBuf,
    /// Behind a lock because reading moves the position in the file.
    file: Mutex<File>,
    layout: RecordLayout,
    frame_count: usize,
    append: bool,
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
        output_check(path).map_err(FrameError::write(path))?;
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
        let checksum = crc32fast::hash(&header[..HEADER_CHECKSUM]);
        header[HEADER_CHECKSUM..].copy_from_slice(&checksum.to_le_bytes());
        file.set_len(0).and_then(|()| file.write_all(&header)).map_err(FrameError::write(path))?;
        let layout = RecordLayout { particle_count: topology.particle_count, checked: true };
        Ok(Self::new(path, file, layout, 0, true))
    }

    /// Opens an existing store for appending. A partly written last record is cut off.
    ///
    /// # Errors
    ///
    /// [`FrameError::Read`], [`FrameError::StoreMagic`], [`FrameError::StoreVersion`],
    /// [`FrameError::StoreHeader`], [`FrameError::StoreTopology`], [`FrameError::StoreRate`] or
    /// [`FrameError::StoreLocked`].
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
        let mut file = file_open_with(path, OpenOptions::new().read(true).write(append))
            .map_err(read_error)?;
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
        let version = check_header(path, &header, topology)?;

        let layout = RecordLayout { particle_count: topology.particle_count, checked: version > 1 };
        let record = layout.size();
        let size = file.metadata().map_err(read_error)?.len();
        let frame_count = size.saturating_sub(HEADER_SIZE as u64) / record;
        if append {
            file.set_len(HEADER_SIZE as u64 + frame_count * record)
                .map_err(FrameError::write(path))?;
        }
        let frame_count = usize::try_from(frame_count).unwrap_or(usize::MAX);
        Ok(Self::new(path, file, layout, frame_count, append))
    }

    fn new(
        path: &Path,
        file: File,
        layout: RecordLayout,
        frame_count: usize,
        append: bool,
    ) -> Self {
        Self { path: path.to_owned(), file: Mutex::new(file), layout, frame_count, append }
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
        self.layout.particle_count
    }

    /// Appends a frame at `time` \[s\] with `positions` \[m\]; when this returns, the frame is with
    /// the operating system and survives the end of the process.
    ///
    /// # Errors
    ///
    /// [`FrameError::ParticleCount`], [`FrameError::Position`] or [`FrameError::Time`] for numbers that
    /// are not finite in single precision, [`FrameError::StoreReadOnly`], or [`FrameError::Write`]; after
    /// all of them the store still has its earlier frames.
    pub fn append(&mut self, time: f64, positions: &[[f64; 3]]) -> Result<(), FrameError> {
        self.check_append()?;
        Frame::new(self.frame_count as u64, time, positions).check(self.layout.particle_count)?;
        let record = self.layout.record(self.frame_count, time, positions);
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
    /// [`FrameError::FrameIndex`], [`FrameError::Read`], or [`FrameError::StoreDamaged`] if what is
    /// there is not what was written, or has numbers that are not finite.
    pub fn frame(&self, index: usize) -> Result<StoredFrame, FrameError> {
        let bytes = self.read(index, self.layout.size() as usize)?;
        let frame = self.layout.frame(index, &bytes);
        frame.map_err(|problem| self.damaged(index, problem))
    }

    /// Reads the time \[s\] of frame `index`, zero based, without its positions.
    ///
    /// # Errors
    ///
    /// As [`FrameStore::frame`].
    pub fn time(&self, index: usize) -> Result<f64, FrameError> {
        let bytes = self.read(index, self.layout.head_size())?;
        self.layout.time(index, &bytes).map_err(|problem| self.damaged(index, problem))
    }

    fn damaged(&self, index: usize, problem: String) -> FrameError {
        FrameError::StoreDamaged { file: self.path.clone(), index, problem }
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
        HEADER_SIZE as u64 + index as u64 * self.layout.size()
    }

    fn lock_file(&self) -> MutexGuard<'_, File> {
        // A panic elsewhere cannot harm a file position that every use sets anew.
        self.file.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

fn lock(path: &Path, file: &File) -> Result<(), FrameError> {
    match file.try_lock() {
        Err(TryLockError::WouldBlock) => Err(FrameError::StoreLocked { file: path.to_owned() }),
        // A file system without locks is no reason to refuse the run.
        Ok(()) | Err(TryLockError::Error(_)) => Ok(()),
    }
}

/// Checks the header, and gives back the version of the format.
fn check_header(
    path: &Path,
    header: &[u8; HEADER_SIZE],
    topology: &Topology,
) -> Result<u32, FrameError> {
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
    if !(1..=VERSION).contains(&version) {
        return Err(FrameError::StoreVersion { file: file(), found: version, expected: VERSION });
    }
    let checksum = (u64::from_le_bytes(word(HEADER_SIZE - 8)) >> 32) as u32;
    // A flipped bit does not make an old file of a new one: there the checksum was zero.
    let expected = if version > 1 { crc32fast::hash(&header[..HEADER_CHECKSUM]) } else { 0 };
    if checksum != expected {
        return Err(FrameError::StoreHeader { file: file(), found: checksum, expected });
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
    Ok(version)
}
