//! The floor: tiles in two shades, filtered so that they do not flicker far away.

use glam::{Vec2, Vec3};

/// Light and dark tile in linear light.
const TILES: [Vec3; 2] = [Vec3::new(0.50, 0.50, 0.49), Vec3::new(0.40, 0.405, 0.41)];

/// The colour of a floor of square tiles with edges of length `tile` \[m\] at `place` \[m\], averaged
/// over the footprint of a pixel with that `width` \[m\].
pub(super) fn floor_color(place: Vec2, width: Vec2, tile: f32) -> Vec3 {
    // The mean of a checked pattern over a box is a product of means of square waves.
    let mean = |place: f32, width: f32| {
        let width = width.abs().max(1e-4);
        (triangle_wave(place + 0.5 * width) - triangle_wave(place - 0.5 * width)) / width
    };
    let place = place / tile;
    let width = width / tile;
    let part = 0.5 - 0.5 * mean(place.x, width.x) * mean(place.y, width.y);
    TILES[0].lerp(TILES[1], part)
}

/// The integral of the square wave that is 1 on even and -1 on odd tiles.
fn triangle_wave(x: f32) -> f32 {
    // Like `rem_euclid`, which is slow; so far away that the conversion saturates, haze hides it.
    let half = 0.5 * x;
    let whole = half as i32 as f32;
    let part = 2.0 * (half - whole);
    let part = if part < 0.0 { part + 2.0 } else { part };
    part.min(2.0 - part)
}

/// The tile length, 1, 2 or 5 times a power of ten \[m\], of which a few fit across a scene with that
/// `radius` \[m\].
pub(super) fn floor_tile(radius: f32) -> f32 {
    let wanted = 0.4 * radius;
    let power = 10f32.powf(wanted.log10().floor());
    match wanted / power {
        part if part < 2.0 => power,
        part if part < 5.0 => 2.0 * power,
        _ => 5.0 * power,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn tiles_alternate_and_average_far_away() {
        let point = Vec2::splat(0.01);
        let here = floor_color(Vec2::new(0.5, 0.5), point, 1.0);
        let next = floor_color(Vec2::new(1.5, 0.5), point, 1.0);
        assert!(here.abs_diff_eq(TILES[0], 1e-3));
        assert!(next.abs_diff_eq(TILES[1], 1e-3));
        let far = floor_color(Vec2::new(0.5, 0.5), Vec2::splat(100.0), 1.0);
        assert!(far.abs_diff_eq(0.5 * (TILES[0] + TILES[1]), 0.01));
    }

    #[test]
    fn tile_lengths_are_round() {
        assert!((floor_tile(1.0) - 0.2).abs() < 1e-6);
        assert!((floor_tile(30.0) - 10.0).abs() < 1e-5);
    }
}
