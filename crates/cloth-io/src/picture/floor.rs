//! The floor: tiles in two shades, filtered so that they do not flicker far away.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::camera::View;
use super::geometry::Plane;

/// Light and dark tile in linear light.
const TILES: [Vec3; 2] = [Vec3::new(0.50, 0.50, 0.49), Vec3::new(0.40, 0.405, 0.41)];
/// Nothing of a plane is seen that is farther than so many times the point that the camera looks at.
const FAR: f32 = 1e3;

/// The planes of a picture as a camera sees them: all about them that has nothing to do with the
/// cloth, and so stays from one picture of a clip to the next.
pub(super) struct Floor {
    pub(super) planes: Vec<Plane>,
    /// How near each plane is at a place in the picture.
    nearness: Vec<PlaneNearness>,
    /// The nearest plane in the middle of each pixel, if nothing was in front of it.
    pixels: Vec<FloorPoint>,
    width: usize,
    tile: f32,
}

/// A point of a plane in a picture.
#[derive(Clone, Copy)]
pub(super) struct FloorPoint {
    /// Number of the plane; `u32::MAX` where there is none.
    pub(super) plane: u32,
    /// Where it is \[m\].
    pub(super) point: Vec3,
    /// Share of the light that it sends back.
    pub(super) color: Vec3,
    /// How squarely the viewer sees it.
    pub(super) facing: f32,
    /// How much haze there is in front of it.
    pub(super) haze: f32,
}

/// The nearness of a plane, which is linear on the screen.
#[derive(Clone, Copy)]
pub(super) struct PlaneNearness {
    /// In the upper left corner of the picture.
    start: f32,
    /// For each pixel to the right and downwards.
    steps: [f32; 2],
}

impl PlaneNearness {
    fn new(plane: &Plane, view: &View) -> Option<Self> {
        // A ray meets the plane at the depth t with n · (eye + t ray) = n · point.
        let scale = -plane.distance(view.eye).recip();
        let at = |x: f32, y: f32| scale * plane.normal.dot(view.ray(x, y));
        let start = at(0.0, 0.0);
        let (width, height) = (view.width as f32, view.height as f32);
        let steps = [(at(width, 0.0) - start) / width, (at(0.0, height) - start) / height];
        (start.is_finite() && steps.iter().all(|step| step.is_finite()))
            .then_some(Self { start, steps })
    }

    /// At column `x` and row `y` of the picture \[pixel\]; negative where the plane is not seen.
    #[inline]
    pub(super) fn at(self, x: f32, y: f32) -> f32 {
        self.start + self.steps[0] * x + self.steps[1] * y
    }
}

impl Floor {
    pub(super) fn new(planes: Vec<Plane>, view: &View) -> Self {
        let (planes, nearness) = planes
            .into_iter()
            .filter_map(|plane| Some((PlaneNearness::new(&plane, view)?, plane)))
            .map(|(nearness, plane)| (plane, nearness))
            .unzip();
        let mut floor = Self {
            planes,
            nearness,
            pixels: Vec::new(),
            width: view.width as usize,
            tile: floor_tile(view.half_height()),
        };
        if floor.planes.is_empty() {
            return floor;
        }
        let count = view.width as usize * view.height as usize;
        let pixel = |index: usize| {
            let place = Vec2::new((index % floor.width) as f32, (index / floor.width) as f32) + 0.5;
            let mut nearest = (floor.farthest(view), None);
            for (number, nearness) in floor.nearness.iter().enumerate() {
                let nearness = nearness.at(place.x, place.y);
                if nearness > nearest.0 {
                    nearest = (nearness, Some(number));
                }
            }
            nearest.1.map_or(FloorPoint::NONE, |plane| floor.point_on(plane, place, view))
        };
        floor.pixels = (0..count).into_par_iter().map(pixel).collect();
        floor
    }

    /// The least nearness that is seen.
    pub(super) fn farthest(&self, view: &View) -> f32 {
        (FAR * view.eye.length()).recip()
    }

    /// How near each plane is.
    pub(super) fn nearness(&self) -> &[PlaneNearness] {
        &self.nearness
    }

    /// The point of plane number `plane` that is seen in a pixel.
    pub(super) fn point(&self, plane: usize, [column, row]: [usize; 2], view: &View) -> FloorPoint {
        match self.pixels.get(row * self.width + column) {
            Some(point) if point.plane as usize == plane => *point,
            _ => self.point_on(plane, Vec2::new(column as f32, row as f32) + 0.5, view),
        }
    }

    fn point_on(&self, number: usize, place: Vec2, view: &View) -> FloorPoint {
        let plane = &self.planes[number];
        let meet = |x: f32, y: f32| {
            let ray = view.ray(x, y);
            view.eye - ray * (plane.distance(view.eye) / ray.dot(plane.normal))
        };
        let point = meet(place.x, place.y);
        let along = |v: Vec3| Vec2::new(v.dot(plane.axes[0]), v.dot(plane.axes[1]));
        let right = along(meet(place.x + 1.0, place.y) - point);
        let down = along(meet(place.x, place.y + 1.0) - point);
        // Tiles are counted from the origin of the scene, in whole pairs up to the point of the
        // plane so that single precision is enough for the rest.
        let pair = 2.0 * f64::from(self.tile);
        let start = (plane.place - (plane.place / pair).floor() * pair).as_vec2();
        let place = start + along(point - plane.point);
        let toward = (view.eye - point).normalize_or(plane.normal);
        // Haze blends the floor into the background far away.
        let distance = (point - plane.point).length() / (3.2 * view.eye.length());
        FloorPoint {
            plane: number as u32,
            point,
            color: tile_color(place, right.abs() + down.abs(), self.tile),
            facing: plane.normal.dot(toward).abs(),
            haze: 1.0 - (-distance * distance).exp(),
        }
    }
}

impl FloorPoint {
    const NONE: Self =
        Self { plane: u32::MAX, point: Vec3::ZERO, color: Vec3::ZERO, facing: 0.0, haze: 1.0 };
}

/// The colour of a floor of square tiles with edges of length `tile` \[m\] at `place` \[m\], averaged
/// over the footprint of a pixel with that `width` \[m\].
fn tile_color(place: Vec2, width: Vec2, tile: f32) -> Vec3 {
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
    let part = x.rem_euclid(2.0);
    part.min(2.0 - part)
}

/// The tile length, 1, 2 or 5 times a power of ten \[m\], of which a few fit between the middle and
/// the edge of a picture that shows `half_height` \[m\] there. It depends on nothing that moves.
fn floor_tile(half_height: f32) -> f32 {
    let wanted = 0.4 * half_height;
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
        let here = tile_color(Vec2::new(0.5, 0.5), point, 1.0);
        let next = tile_color(Vec2::new(1.5, 0.5), point, 1.0);
        assert!(here.abs_diff_eq(TILES[0], 1e-3));
        assert!(next.abs_diff_eq(TILES[1], 1e-3));
        let far = tile_color(Vec2::new(0.5, 0.5), Vec2::splat(100.0), 1.0);
        assert!(far.abs_diff_eq(0.5 * (TILES[0] + TILES[1]), 0.01));
    }

    #[test]
    fn tile_lengths_are_round() {
        assert!((floor_tile(1.0) - 0.2).abs() < 1e-6);
        assert!((floor_tile(30.0) - 10.0).abs() < 1e-5);
    }
}
