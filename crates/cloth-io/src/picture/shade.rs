//! Computes the colour of what is visible.

use glam::{Vec2, Vec3};
use image::RgbImage;
use rayon::prelude::*;

use super::PictureStyle;
use super::camera::View;
use super::floor::{floor_color, floor_tile};
use super::geometry::{Geometry, Surface, linear};
use super::raster::{NOTHING, SAMPLES, Visibility};
use super::shadow::ShadowMap;
use super::sky::Sky;

/// Strong light, warm like the sun.
const KEY: Vec3 = Vec3::new(1.28, 1.23, 1.14);
/// Light of the open sky, a little blue.
const SKY: Vec3 = Vec3::new(0.44, 0.48, 0.55);
/// Light that the floor throws up.
const GROUND: Vec3 = Vec3::new(0.16, 0.15, 0.14);
/// Weak light from the side of the viewer, without shadow.
const FILL: Vec3 = Vec3::new(0.11, 0.12, 0.13);
/// Colour of colliders in linear light.
const SOLID: Vec3 = Vec3::new(0.5, 0.48, 0.45);

/// Shades one picture.
pub(super) struct Shader<'a> {
    geometry: &'a Geometry,
    view: &'a View,
    key: &'a ShadowMap,
    sky: &'a Sky,
    /// Background at the upper and the lower edge in linear light.
    background: [Vec3; 2],
    /// Length of the tiles of floors \[m\].
    floor_tile: f32,
    bytes: EncodeTable,
}

/// A sample that was shaded.
#[derive(Clone, Copy)]
struct Seen {
    triangle: usize,
    nearness: f32,
    color: Vec3,
}

/// What shades a point on a surface as a ray meets it.
struct Hit {
    /// Unit normal on the side of the viewer.
    normal: Vec3,
    /// Unit vector to the viewer.
    toward: Vec3,
    /// Whether the front of the triangle is seen.
    front: bool,
    /// Weights of the corners of the triangle.
    weights: [f32; 3],
    /// How much of the strong light reaches it.
    lit: f32,
    /// Light of the sky.
    sky: f32,
}

impl<'a> Shader<'a> {
    pub(super) fn new(
        geometry: &'a Geometry,
        view: &'a View,
        key: &'a ShadowMap,
        sky: &'a Sky,
        style: &PictureStyle,
    ) -> Self {
        let background = style.background.map(linear);
        let floor_tile = floor_tile(geometry.radius);
        Self { geometry, view, key, sky, background, floor_tile, bytes: EncodeTable::new() }
    }

    pub(super) fn image(&self, visibility: &Visibility) -> RgbImage {
        let mut image = RgbImage::new(self.view.width, self.view.height);
        let row_size = 3 * self.view.width as usize;
        let rows = image.par_chunks_exact_mut(row_size).enumerate();
        rows.for_each(|(row, pixels)| {
            let background = self.background(row);
            for (column, pixel) in pixels.chunks_exact_mut(3).enumerate() {
                let color = self.pixel(visibility, column, row, background);
                pixel.copy_from_slice(&self.bytes.encode(color));
            }
        });
        image
    }

    /// The mean of the samples. Samples that see the same part of a surface share one computation:
    /// edges are where the picture needs several.
    fn pixel(&self, visibility: &Visibility, column: usize, row: usize, background: Vec3) -> Vec3 {
        const COUNT: usize = SAMPLES * SAMPLES;
        let mut seen: [Option<Seen>; COUNT] = [None; COUNT];
        let mut sum = Vec3::ZERO;
        for sample in 0..COUNT {
            let (x, y) = (sample % SAMPLES, sample / SAMPLES);
            let index = (row * SAMPLES + y) * visibility.width + column * SAMPLES + x;
            let triangle = visibility.triangles[index];
            if triangle == NOTHING {
                sum += background;
                continue;
            }
            let triangle = triangle as usize;
            let nearness = visibility.nearness[index];
            let alike = |seen: &&Seen| self.alike(seen, triangle, nearness);
            if let Some(seen) = seen.iter().flatten().find(alike) {
                sum += seen.color;
                continue;
            }
            let place =
                |whole: usize, part: usize| whole as f32 + (part as f32 + 0.5) / SAMPLES as f32;
            let place = Vec2::new(place(column, x), place(row, y));
            let color = self.color(triangle, place, background);
            seen[sample] = Some(Seen { triangle, nearness, color });
            sum += color;
        }
        sum / COUNT as f32
    }

    /// Whether a sample of `triangle` looks like one `seen` before: the same surface at nearly the
    /// same depth, turned nearly the same way.
    fn alike(&self, seen: &Seen, triangle: usize, nearness: f32) -> bool {
        if seen.triangle == triangle {
            return true;
        }
        let surface = |triangle: usize| self.geometry.surface_of_triangle[triangle];
        if surface(seen.triangle) != surface(triangle)
            || (seen.nearness - nearness).abs() > 0.004 * nearness
        {
            return false;
        }
        let (a, b) =
            (self.geometry.flat_normal(seen.triangle), self.geometry.flat_normal(triangle));
        let dot = a.dot(b);
        dot > 0.0 && dot * dot > 0.8 * a.length_squared() * b.length_squared()
    }

    fn background(&self, row: usize) -> Vec3 {
        let [top, bottom] = self.background;
        let part = (row as f32 + 0.5) / self.view.height as f32;
        top.lerp(bottom, part)
    }

    /// The colour of `triangle` at `place` in the picture \[pixel\], ready for a screen.
    fn color(&self, triangle: usize, place: Vec2, background: Vec3) -> Vec3 {
        let surface = self.geometry.surface_of_triangle[triangle] as usize;
        match &self.geometry.surfaces[surface] {
            Surface::Plane { point, normal } => {
                self.plane(surface, *point, *normal, place, background)
            }
            Surface::Solid => {
                let hit = self.hit(triangle, place);
                tone(self.light(&hit, SOLID) + self.gloss(&hit, 0.06))
            }
            Surface::Cloth { color } => {
                let hit = self.hit(triangle, place);
                let mut color = *color;
                if !hit.front {
                    // The back is paler, so that folds can be read.
                    color = color.lerp(Vec3::splat(color.element_sum() / 3.0), 0.35) * 0.8;
                }
                if let Some(checks) = self.geometry.checks.get(triangle) {
                    color *= check_shade(checks, &hit.weights);
                }
                // Fibres that stand off the cloth catch light along its outline.
                let facing = hit.normal.dot(hit.toward).clamp(0.0, 1.0);
                let sheen = 0.35 * (1.0 - facing).powi(3);
                let color = color.lerp(Vec3::ONE, 0.25 * sheen) * (1.0 + sheen);
                tone(self.light(&hit, color) + self.gloss(&hit, 0.025))
            }
        }
    }

    fn hit(&self, triangle: usize, place: Vec2) -> Hit {
        let corners = self.geometry.triangles[triangle].map(|index| index as usize);
        let [a, b, c] = corners.map(|index| self.geometry.positions[index]);
        let ray = self.view.ray(place.x, place.y);
        let (ab, ac) = (b - a, c - a);
        let flat = ab.cross(ac);
        // Where the ray meets the plane of the triangle, as weights of the corners; the sample is
        // inside, so what rounding carries outside is pulled back, and so is what is not a number,
        // as degenerate triangles give.
        let inside = |weight: f32, limit: f32| if weight > 0.0 { weight.min(limit) } else { 0.0 };
        let from_a = self.view.eye - a;
        let determinant = flat.dot(ray);
        let turned = ray.cross(from_a);
        let wb = inside(ac.dot(turned) / determinant, 1.0);
        let wc = inside(-ab.dot(turned) / determinant, 1.0 - wb);
        let weights = if determinant == 0.0 { [1.0, 0.0, 0.0] } else { [1.0 - wb - wc, wb, wc] };
        let blend = |values: &[Vec3]| -> Vec3 {
            let parts = corners.iter().zip(weights);
            parts.map(|(&index, weight)| values[index] * weight).sum()
        };
        let point = blend(&self.geometry.positions);
        let toward = (self.view.eye - point).normalize_or(Vec3::Z);
        let front = flat.dot(toward) >= 0.0;
        let normal = blend(&self.geometry.normals);
        let normal = if front { normal } else { -normal };
        // At an outline the smooth normal can point away from the viewer; bend it back.
        let away = normal.dot(toward).min(0.0);
        let normal = (normal - 1.02 * away * toward).normalize_or(toward);
        let sky = self.sky.on_triangle(corners, weights, front);
        let lit = self.lit(point, normal);
        Hit { normal, toward, front, weights, lit, sky }
    }

    /// How much of the strong light reaches a point, nothing if it faces away.
    fn lit(&self, point: Vec3, normal: Vec3) -> f32 {
        if normal.dot(self.key.direction) > 0.0 { self.key.lit(point, normal) } else { 0.0 }
    }

    /// Light that a matt surface of `color` sends to the viewer.
    fn light(&self, hit: &Hit, color: Vec3) -> Vec3 {
        let facing = hit.normal.dot(self.key.direction).max(0.0);
        let lit = hit.lit;
        let sky = hit.sky;
        let down = 0.5 - 0.5 * hit.normal.z;
        let fill = hit.normal.dot(hit.toward).max(0.0) * (0.4 + 0.6 * sky);
        color * (KEY * (facing * lit) + SKY * sky + GROUND * down + FILL * fill)
    }

    /// A soft highlight of that `strength`.
    fn gloss(&self, hit: &Hit, strength: f32) -> Vec3 {
        let half = (hit.toward + self.key.direction).normalize_or(hit.normal);
        let shine = hit.normal.dot(half).max(0.0).powi(24);
        if shine < 0.01 {
            return Vec3::ZERO;
        }
        KEY * (strength * shine * hit.lit)
    }

    fn plane(
        &self,
        surface: usize,
        point: Vec3,
        normal: Vec3,
        place: Vec2,
        background: Vec3,
    ) -> Vec3 {
        let (first, second) = normal.any_orthonormal_pair();
        let meet = |x: f32, y: f32| {
            let ray = self.view.ray(x, y);
            let distance = (point - self.view.eye).dot(normal) / ray.dot(normal);
            self.view.eye + distance * ray
        };
        let hit_point = meet(place.x, place.y);
        let from_point = hit_point - point;
        let coordinates = |v: Vec3| Vec2::new(v.dot(first), v.dot(second));
        let right = coordinates(meet(place.x + 1.0, place.y) - hit_point);
        let down = coordinates(meet(place.x, place.y + 1.0) - hit_point);
        let width = right.abs() + down.abs();
        let radius = self.geometry.radius;
        // Tiles stay where they are when the scene moves: count them from the origin of the scene.
        let origin = self.view.local([0.0; 3]);
        let place = coordinates(hit_point - origin);
        let toward = (self.view.eye - hit_point).normalize_or(normal);
        let facing_normal = if normal.dot(toward) >= 0.0 { normal } else { -normal };
        let hit = Hit {
            normal: facing_normal,
            toward,
            front: true,
            weights: [0.0; 3],
            lit: self.lit(hit_point, facing_normal),
            sky: self.sky.on_plane(surface, hit_point),
        };
        let color = self.light(&hit, floor_color(place, width, self.floor_tile));
        // Haze blends the floor into the background before its edge.
        let reach = self.view.eye.length().max(radius);
        let haze = 1.0 - (-(from_point.length() / (3.2 * reach)).powi(2)).exp();
        tone(color).lerp(background, haze)
    }
}

/// Brightness of the checked pattern of a cloth: a soft product of waves, which does not flicker
/// like sharp checks do.
fn check_shade(checks: &[Vec2; 3], weights: &[f32; 3]) -> f32 {
    let place: Vec2 = checks.iter().zip(weights).map(|(&check, &weight)| check * weight).sum();
    let wave = |x: f32| (std::f32::consts::PI * x).sin();
    let check = (4.0 * wave(place.x) * wave(place.y)).clamp(-1.0, 1.0);
    1.0 + 0.09 * check
}

/// Compresses bright light into what a screen can show.
fn tone(color: Vec3) -> Vec3 {
    // Linear up to the knee, then a shoulder that reaches 1 at infinity.
    const KNEE: f32 = 0.6;
    let channel = |x: f32| {
        if x <= KNEE { x } else { 1.0 - (1.0 - KNEE) * (-(x - KNEE) / (1.0 - KNEE)).exp() }
    };
    Vec3::new(channel(color.x), channel(color.y), channel(color.z))
}

/// Linear light to sRGB by a table: the power would take a good part of the time of a picture.
struct EncodeTable(Vec<u8>);

impl EncodeTable {
    /// Enough for dark colours, where sRGB is steepest, to be half a step off at most.
    const STEPS: usize = 8192;

    fn new() -> Self {
        let entry = |step: usize| {
            let x = step as f32 / Self::STEPS as f32;
            let value =
                if x <= 0.003_130_8 { 12.92 * x } else { 1.055 * x.powf(1.0 / 2.4) - 0.055 };
            (255.0 * value).round() as u8
        };
        Self((0..=Self::STEPS).map(entry).collect())
    }

    fn encode(&self, color: Vec3) -> [u8; 3] {
        let scaled = color.clamp(Vec3::ZERO, Vec3::ONE) * Self::STEPS as f32 + 0.5;
        scaled.to_array().map(|step| self.0[(step as usize).min(Self::STEPS)])
    }
}
