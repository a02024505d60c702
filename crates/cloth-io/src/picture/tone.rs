//! From light to what a screen shows.

use glam::Vec3;

/// Compresses bright light into what a screen can show.
pub(super) fn tone(color: Vec3) -> Vec3 {
    Vec3::from(color.to_array().map(tone_channel))
}

/// The same for one of red, green and blue.
#[inline]
pub(super) fn tone_channel(light: f32) -> f32 {
    // Linear up to the knee, then a shoulder that reaches 1 at infinity.
    const KNEE: f32 = 0.6;
    let excess = (light - KNEE).max(0.0) * (1.0 / (1.0 - KNEE));
    // 1 - 1 / (1 + x + x²/2) bends like 1 - exp(-x), without its cost.
    let shoulder = 1.0 - 1.0 / (1.0 + excess + 0.5 * excess * excess);
    light.min(KNEE) + (1.0 - KNEE) * shoulder
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
        self.channel(color.to_array())
    }

    /// The same for several values of red, green or blue.
    #[inline]
    pub(super) fn channel<const N: usize>(&self, light: [f32; N]) -> [u8; N] {
        // The conversion makes zero of what is not a number.
        let steps = light
            .map(|light| (light * Self::STEPS as f32 + 0.5).clamp(0.0, Self::STEPS as f32) as i32);
        steps.map(|step| self.0.get(step as usize).copied().unwrap_or(u8::MAX))
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
