//! Binary files: numbers of their header and content, bytes, length.

use fastrand::Rng;

use super::{LENGTH, REAL, WHOLE, any, changes};

/// A file with some changes; one in four in the first `header` bytes.
pub(crate) fn changed(rng: &mut Rng, bytes: &[u8], header: usize) -> Vec<u8> {
    let mut bytes = bytes.to_vec();
    for _ in 0..changes(rng) {
        if bytes.is_empty() {
            break;
        }
        let end = if rng.u8(..4) == 0 { header.clamp(1, bytes.len()) } else { bytes.len() };
        let at = rng.usize(..end);
        match rng.u8(..10) {
            0..3 => {
                let word = any(rng, &WHOLE).to_le_bytes();
                let size = *any(rng, &[4, 8]);
                put(&mut bytes, at / 4 * 4, &word[..size]);
            }
            3 => {
                let number = *any(rng, &REAL);
                put(&mut bytes, at / 4 * 4, &number.to_le_bytes());
            }
            4 => put(&mut bytes, at / 4 * 4, &(*any(rng, &REAL) as f32).to_le_bytes()),
            5 => bytes[at] ^= 1 << rng.u8(..8),
            6 => bytes[at] = rng.u8(..),
            7 => bytes.truncate(at),
            8 => {
                let end = (at + rng.usize(..64)).min(bytes.len());
                let part = bytes[at..end].to_vec();
                let to = rng.usize(..bytes.len());
                bytes.splice(to..to, part);
            }
            _ => {
                let more = rng.usize(..4096).min(LENGTH.saturating_sub(bytes.len()));
                bytes.resize(bytes.len() + more, rng.u8(..));
            }
        }
    }
    bytes
}

/// Writes over what is there, as far as that goes.
pub(crate) fn put(bytes: &mut [u8], at: usize, value: &[u8]) {
    for (byte, value) in bytes.iter_mut().skip(at).zip(value) {
        *byte = *value;
    }
}
