//! One frame of a frame store as bytes, see [`FrameStore`](super::FrameStore).

use crc32fast::Hasher;

/// Bytes of a checksum.
const CHECKSUM: usize = 4;
/// Bytes of a time.
const TIME: usize = 8;

/// A frame read back from a [`FrameStore`](crate::FrameStore).
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

/// How frames lie in the store.
#[derive(Clone, Copy, Debug)]
pub(super) struct RecordLayout {
    pub(super) particle_count: usize,
    /// Whether there are checksums; the first version had none.
    pub(super) checked: bool,
}

impl RecordLayout {
    /// Bytes of a record.
    pub(super) fn size(self) -> u64 {
        let checksum = if self.checked { CHECKSUM as u64 } else { 0 };
        self.head_size() as u64 + 12 * self.particle_count as u64 + checksum
    }

    /// Bytes before the positions: the time, and its own checksum, so that a time can be read and
    /// trusted alone.
    pub(super) fn head_size(self) -> usize {
        if self.checked { TIME + CHECKSUM } else { TIME }
    }

    /// The record of frame `index`, whose numbers are finite in single precision.
    pub(super) fn record(self, index: usize, time: f64, positions: &[[f64; 3]]) -> Vec<u8> {
        let mut record = Vec::with_capacity(self.size() as usize);
        record.extend_from_slice(&time.to_le_bytes());
        let mut hasher = hasher(index, &record);
        if self.checked {
            record.extend_from_slice(&hasher.clone().finalize().to_le_bytes());
        }
        let coordinates = positions.as_flattened().iter();
        record.extend(coordinates.flat_map(|&x| (x as f32).to_le_bytes()));
        if self.checked {
            hasher.update(&record[self.head_size()..]);
            record.extend_from_slice(&hasher.finalize().to_le_bytes());
        }
        record
    }

    /// The time in the first bytes of the record of frame `index`, or what is wrong with it.
    pub(super) fn time(self, index: usize, head: &[u8]) -> Result<f64, String> {
        self.head(index, head).map(|(time, _)| time)
    }

    /// The frame in the record of frame `index`, or what is wrong with it.
    pub(super) fn frame(self, index: usize, record: &[u8]) -> Result<StoredFrame, String> {
        let (head, rest) = record.split_at(self.head_size());
        let (time, mut hasher) = self.head(index, head)?;
        let (bytes, checksum) = rest.split_at(12 * self.particle_count);
        if self.checked {
            hasher.update(bytes);
            compare(hasher, checksum)?;
        }
        let positions: Vec<[f32; 3]> = bytes.chunks_exact(12).map(position).collect();
        let not_finite = |position: &[f32; 3]| position.iter().any(|x| !x.is_finite());
        match positions.iter().position(not_finite) {
            Some(particle) => Err(format!("the position of particle {particle} is not finite")),
            None => Ok(StoredFrame { time, positions }),
        }
    }

    /// The time, and the checksum so far.
    fn head(self, index: usize, head: &[u8]) -> Result<(f64, Hasher), String> {
        let (time, checksum) = head.split_at(TIME);
        let hasher = hasher(index, time);
        if self.checked {
            compare(hasher.clone(), checksum)?;
        }
        let time = f64::from_le_bytes(time.try_into().unwrap_or_default());
        if time.is_finite() { Ok((time, hasher)) } else { Err(format!("its time is {time}")) }
    }
}

/// A checksum that begins with the index: records that changed places are damage, too.
fn hasher(index: usize, time: &[u8]) -> Hasher {
    let mut hasher = Hasher::new();
    hasher.update(&(index as u64).to_le_bytes());
    hasher.update(time);
    hasher
}

fn compare(hasher: Hasher, stored: &[u8]) -> Result<(), String> {
    let found = hasher.finalize();
    let expected = u32::from_le_bytes(stored.try_into().unwrap_or_default());
    if found == expected {
        return Ok(());
    }
    Err(format!("its checksum is {expected:08x} but its content has {found:08x}"))
}

fn position(bytes: &[u8]) -> [f32; 3] {
    let mut position = [0.0; 3];
    for (coordinate, bytes) in position.iter_mut().zip(bytes.chunks_exact(4)) {
        *coordinate = f32::from_le_bytes(bytes.try_into().unwrap_or_default());
    }
    position
}
