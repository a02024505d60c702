//! The floor: tiles in two shades, filtered so that they do not flicker far away.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::camera::View;
use super::geometry::Plane;
use super::raster::{NOTHING, SAMPLES};

/// Light and dark tile in linear light.
const TILES: [Vec3; 2] = [Vec3::new(0.50, 0.50, 0.49), Vec3::new(0.40, 0.405, 0.41)];
/// Numbers of samples from here on are those of planes.
pub(super) const PLANE: u32 = u32::MAX - (1 << 16);
/// What stands for a pixel whose samples see different things.
pub(super) const EDGE: u32 = PLANE - 1;
/// Nothing of a plane is seen that is farther than so many times the point that the camera looks at.
const FAR: f32 = 1e3;

/// The planes of a picture as a camera sees them: all about them that has nothing to do with the
/// cloth, and so stays from one picture of a clip to the next.
pub(super) struct Floor {
    pub(super) planes: Vec<Plane>,
    /// How near each plane is at a place in the picture.
    nearness: Vec<PlaneNearness>,
    /// What is seen in each pixel if nothing is in front of it: the number of a plane or that of
    /// nothing at all its samples, or [`EDGE`].
    numbers: Vec<u32>,
    /// The plane in the middle of each of these pixels.
    points: PixelPoints,
    width: usize,
    tile: f32,
}

/// Points of a plane in pixels that follow each other in a row.
pub(super) struct FloorPoints<const N: usize> {
    /// Where they lie along the axes of the plane, from its point on \[m\].
    pub(super) along: [[f32; N]; 2],
    /// How much of the pixel is a dark tile.
    pub(super) part: [f32; N],
    /// How squarely the viewer sees it.
    pub(super) facing: [f32; N],
    /// How much haze there is in front of it.
    pub(super) haze: [f32; N],
}

/// Points of planes in all pixels; each value lies beside that of the next pixel, as processors read them
/// together.
#[derive(Default)]
struct PixelPoints {
    along: [Vec<f32>; 2],
    part: Vec<f32>,
    facing: Vec<f32>,
    haze: Vec<f32>,
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
        let width = view.width as usize;
        let mut floor = Self {
            planes,
            nearness,
            numbers: Vec::new(),
            points: PixelPoints::default(),
            width,
            tile: floor_tile(view.half_height()),
        };
        if floor.planes.is_empty() {
            return floor;
        }
        let count = width * view.height as usize;
        let pixel = |index: usize| [index % width, index / width];
        let number = |index| {
            let [first, rest @ ..] = floor.samples(pixel(index), view).map(|sample| sample.0);
            if rest.iter().all(|&number| number == first) { first } else { EDGE }
        };
        floor.numbers = (0..count).into_par_iter().map(number).collect();
        let point = |(index, &number)| match plane_of(number) {
            Some(plane) => floor.point_on(plane, pixel(index), view),
            None => FloorPoints::NONE,
        };
        let points: Vec<_> = floor.numbers.par_iter().enumerate().map(point).collect();
        let all = |value: fn(&FloorPoints<1>) -> f32| points.iter().map(value).collect();
        floor.points = PixelPoints {
            along: [all(|point| point.along[0][0]), all(|point| point.along[1][0])],
            part: all(|point| point.part[0]),
            facing: all(|point| point.facing[0]),
            haze: all(|point| point.haze[0]),
        };
        floor
    }

    /// The least nearness that is seen.
    fn least(&self, view: &View) -> f32 {
        if self.planes.is_empty() { 0.0 } else { (FAR * view.eye.length()).recip() }
    }

    /// What is seen in each pixel of a row if nothing is in front of it; nothing if there is no plane.
    pub(super) fn numbers(&self, row: usize) -> &[u32] {
        self.numbers.get(row * self.width..(row + 1) * self.width).unwrap_or_default()
    }

    /// Fills numbers and nearness of the samples of a row from column `start` on with what is seen if nothing is in
    /// front of it.
    pub(super) fn fill(
        &self,
        row: usize,
        start: usize,
        view: &View,
        numbers: &mut [u32],
        nearness: &mut [f32],
    ) {
        numbers.fill(NOTHING);
        // Nothing is behind the eye, and nothing that is too far is seen.
        nearness.fill(self.least(view));
        let y = sample_place(row);
        for (plane, line) in (PLANE..NOTHING).zip(&self.nearness) {
            let samples = numbers.iter_mut().zip(&mut *nearness);
            for (column, (number, nearest)) in (start as i32..).zip(samples) {
                let nearness = line.at(sample_place(column as usize), y);
                let is_nearer = nearness > *nearest;
                *nearest = if is_nearer { nearness } else { *nearest };
                *number = if is_nearer { plane } else { *number };
            }
        }
    }

    /// Numbers and nearness at the samples of a pixel if nothing is in front of it.
    pub(super) fn samples(
        &self,
        [column, row]: [usize; 2],
        view: &View,
    ) -> [(u32, f32); SAMPLES * SAMPLES] {
        let least = self.least(view);
        std::array::from_fn(|sample| {
            let x = sample_place(column * SAMPLES + sample % SAMPLES);
            let y = sample_place(row * SAMPLES + sample / SAMPLES);
            let mut nearest = (NOTHING, least);
            for (number, line) in (PLANE..NOTHING).zip(&self.nearness) {
                let nearness = line.at(x, y);
                if nearness > nearest.1 {
                    nearest = (number, nearness);
                }
            }
            nearest
        })
    }

    /// The point of plane number `plane` that is seen in a pixel.
    pub(super) fn point(
        &self,
        plane: usize,
        [column, row]: [usize; 2],
        view: &View,
    ) -> FloorPoints<1> {
        match self.numbers(row).get(column) {
            Some(&number) if plane_of(number) == Some(plane) => self.points([column, row], 1),
            _ => self.point_on(plane, [column, row], view),
        }
    }

    /// The points in `count` pixels from one on, all of which see one plane; behind them the last one again.
    #[inline]
    pub(super) fn points<const N: usize>(
        &self,
        [column, row]: [usize; 2],
        count: usize,
    ) -> FloorPoints<N> {
        let start = row * self.width + column;
        let take = |values: &[f32]| -> [f32; N] {
            let values = values.get(start..start + count).unwrap_or_default();
            if let Ok(values) = values.try_into() {
                return values;
            }
            let last = values.last().copied().unwrap_or_default();
            std::array::from_fn(|i| values.get(i).copied().unwrap_or(last))
        };
        FloorPoints {
            along: [take(&self.points.along[0]), take(&self.points.along[1])],
            part: take(&self.points.part),
            facing: take(&self.points.facing),
            haze: take(&self.points.haze),
        }
    }

    fn point_on(&self, number: usize, pixel: [usize; 2], view: &View) -> FloorPoints<1> {
        let plane = &self.planes[number];
        let place = Vec2::from(pixel.map(|index| index as f32 + 0.5));
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
        let from_point = along(point - plane.point);
        let toward = (view.eye - point).normalize_or(plane.normal);
        // Haze blends the floor into the background far away.
        let distance = (point - plane.point).length() / (3.2 * view.eye.length());
        FloorPoints {
            along: [[from_point.x], [from_point.y]],
            part: [tile_part(start + from_point, right.abs() + down.abs(), self.tile)],
            facing: [plane.normal.dot(toward).abs()],
            haze: [1.0 - (-distance * distance).exp()],
        }
    }
}

impl FloorPoints<1> {
    const NONE: Self = Self { along: [[0.0]; 2], part: [0.0], facing: [0.0], haze: [1.0] };
}

/// The middle of a column or row of samples \[pixel\].
#[inline]
pub(super) fn sample_place(sample: usize) -> f32 {
    (sample as i32 as f32 + 0.5) * (1.0 / SAMPLES as f32)
}

/// The number of the plane that a sample with this number sees.
#[inline]
pub(super) fn plane_of(number: u32) -> Option<usize> {
    (PLANE..NOTHING).contains(&number).then(|| (number - PLANE) as usize)
}

/// One of red, green and blue of the light and of the dark tile.
pub(super) fn tile(channel: usize) -> [f32; 2] {
    TILES.map(|tile| tile[channel])
}

/// How much is dark of a floor of square tiles with edges of length `tile` \[m\] at `place` \[m\], averaged
/// over the footprint of a pixel with that `width` \[m\].
fn tile_part(place: Vec2, width: Vec2, tile: f32) -> f32 {
    // The mean of a checked pattern over a box is a product of means of square waves.
    let mean = |place: f32, width: f32| {
        let width = width.abs().max(1e-4);
        (triangle_wave(place + 0.5 * width) - triangle_wave(place - 0.5 * width)) / width
    };
    let place = place / tile;
    let width = width / tile;
    0.5 - 0.5 * mean(place.x, width.x) * mean(place.y, width.y)
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
        let here = tile_part(Vec2::new(0.5, 0.5), point, 1.0);
        let next = tile_part(Vec2::new(1.5, 0.5), point, 1.0);
        assert!(here.abs() < 1e-3 && (next - 1.0).abs() < 1e-3, "{here} and {next}");
        let far = tile_part(Vec2::new(0.5, 0.5), Vec2::splat(100.0), 1.0);
        assert!((far - 0.5).abs() < 0.01, "{far}");
    }

    #[test]
    fn tile_lengths_are_round() {
        assert!((floor_tile(1.0) - 0.2).abs() < 1e-6);
        assert!((floor_tile(30.0) - 10.0).abs() < 1e-5);
    }
}
