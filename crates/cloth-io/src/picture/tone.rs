//! From light to what a screen shows.

use glam::Vec3;

/// Compresses bright light into what a screen can show.
pub(super) fn tone(color: Vec3) -> Vec3 {
    // Linear up to the knee, then a shoulder that reaches 1 at infinity.
    const KNEE: f32 = 0.6;
    let excess = (color - KNEE).max(Vec3::ZERO) / (1.0 - KNEE);
    // 1 - 1 / (1 + x + x²/2) bends like 1 - exp(-x), without its cost.
    let shoulder = Vec3::ONE - (Vec3::ONE + excess + 0.5 * excess * excess).recip();
    color.min(Vec3::splat(KNEE)) + (1.0 - KNEE) * shoulder
}

/// Linear light to sRGB by a table: the power would take a good part of the time of a picture.
pub(super) struct EncodeTable(Vec<u8>);

impl EncodeTable {
    /// Enough for dark colours, where sRGB is steepest, to be half a step off at most.
    const STEPS: usize = 8192;

    pub(super) fn new() -> Self {
        let entry = |step: usize| {
            let x = step as f32 / Self::STEPS as f32;
            let value =
                if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            (255.0 * value).round() as u8
        };
        Self((0..=Self::STEPS).map(entry).collect())
    }

    #[inline]
    pub(super) fn encode(&self, color: Vec3) -> [u8; 3] {
        let scaled = color.max(Vec3::ZERO) * Self::STEPS as f32 + 0.5;
        scaled.to_array().map(|step| self.0[(step as usize).min(Self::STEPS)])
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn light_is_compressed_without_a_step() {
        let at = |x: f32| tone(Vec3::splat(x)).x;
        assert_eq!(at(0.3), 0.3);
        assert!((at(0.6001) - 0.6001).abs() < 1e-4);
        assert!(at(5.0) < 1.0 && at(5.0) > at(2.0) && at(2.0) > at(1.0));
    }

    #[test]
    fn colours_are_encoded_as_srgb() {
        let table = EncodeTable::new();
        assert_eq!(table.encode(Vec3::new(0.0, 1.0, 0.5)), [0, 255, 188]);
        assert_eq!(table.encode(Vec3::new(-1.0, 9.0, f32::NAN)), [0, 255, 0]);
    }
}
