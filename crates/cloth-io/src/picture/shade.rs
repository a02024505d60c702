//! Computes the colour of what is visible.

use glam::{Vec2, Vec3};

use super::camera::View;
use super::dust::Dust;
use super::floor::{EDGE, Floor, plane_of};
use super::geometry::{Cloths, Mesh, thread_color};
use super::plane_light::PlaneLight;
use super::raster::{BAND, Band, NOTHING, SAMPLES, Screen, Seen};
use super::shadow::ShadowMap;
use super::sky::Sky;
use super::tone::{EncodeTable, tone};

/// Strong light, warm like the sun.
pub(super) const KEY: Vec3 = Vec3::new(1.28, 1.23, 1.14);
/// Light of the open sky, a little blue.
pub(super) const SKY: Vec3 = Vec3::new(0.44, 0.48, 0.55);
/// Light that the floor throws up.
pub(super) const GROUND: Vec3 = Vec3::new(0.16, 0.15, 0.14);
/// Weak light from the side of the viewer, without shadow.
pub(super) const FILL: Vec3 = Vec3::new(0.11, 0.12, 0.13);
/// Side of the square of texels that soften the edge of the shadow of the strong light.
pub(super) const KEY_TAPS: usize = 4;

/// Pixels of a floor that are shaded together.
const RUN: usize = 16;

/// Room for what is known of the pixels of a row.
#[derive(Default)]
pub(super) struct Room {
    /// How much of each is seen through dust.
    clear: Vec<f32>,
    /// What all samples of each see.
    numbers: Vec<u32>,
}

/// Shades one picture.
pub(super) struct Shader<'a> {
    pub(super) view: &'a View,
    pub(super) screen: &'a Screen,
    pub(super) floor: &'a Floor,
    pub(super) solids: &'a Mesh,
    /// Colour of each solid in linear light.
    pub(super) solid_colors: &'a [Vec3],
    pub(super) cloths: &'a Cloths,
    /// What the lights do to each plane of the floor.
    pub(super) planes: Vec<PlaneLight<'a>>,
    pub(super) key: &'a ShadowMap,
    pub(super) sky: &'a Sky,
    pub(super) dust: &'a Dust,
    /// Background at the upper and the lower edge in linear light.
    pub(super) background: [Vec3; 2],
    pub(super) bytes: &'a EncodeTable,
}

/// A sample that was shaded.
#[derive(Clone, Copy)]
struct Shaded {
    seen: Seen,
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

impl Shader<'_> {
    /// Shades a row of the picture, the one with this number in `band`, which has a number too.
    pub(super) fn row(&self, band: &Band, place: [usize; 2], pixels: &mut [u8], room: &mut Room) {
        let [band_number, row_in_band] = place;
        let row = band_number * BAND + row_in_band;
        let Room { clear, numbers } = room;
        self.dust.veil(clear, band, place, self.floor, self.view);
        numbers.resize(self.view.width as usize, NOTHING);
        band.row(numbers, place, self.floor);
        let background = self.background(row);
        let background_bytes = self.bytes.encode(background);
        let is_clear = |column: usize| clear.get(column).is_none_or(|&clear| clear == 1.0);
        let mut column = 0;
        while column < numbers.len() {
            let number = numbers[column];
            let plane = plane_of(number);
            if (plane.is_some() || number == NOTHING) && is_clear(column) {
                // Most of a picture: what nothing is in front of, several pixels at a time.
                let end = (column..numbers.len())
                    .find(|&next| numbers[next] != number || !is_clear(next))
                    .unwrap_or(numbers.len());
                let pixels = &mut pixels[3 * column..3 * end];
                match plane {
                    Some(plane) => self.plane_run(plane, [column, row], pixels, background),
                    None => pixels.as_chunks_mut().0.fill(background_bytes),
                }
                column = end;
                continue;
            }
            let color = if number == EDGE {
                let samples = band.pixel(column, place, self.floor, self.view);
                self.mean(&samples, [column, row], background)
            } else {
                let center = Vec2::new(column as f32, row as f32) + 0.5;
                self.color(self.screen.seen(number), [column, row], center, background)
            };
            let clear = clear.get(column).copied().unwrap_or(1.0);
            let color = self.dust.color.lerp(color, clear);
            pixels[3 * column..][..3].copy_from_slice(&self.bytes.encode(color));
            column += 1;
        }
    }

    /// Shades `pixels` that follow one, all of which see one plane.
    fn plane_run(
        &self,
        plane: usize,
        [column, row]: [usize; 2],
        pixels: &mut [u8],
        background: Vec3,
    ) {
        let light = &self.planes[plane];
        for (run, pixels) in pixels.chunks_mut(3 * RUN).enumerate() {
            let points = self.floor.points::<RUN>([column + run * RUN, row], pixels.len() / 3);
            let colors = light.colors(&points, background);
            let [red, green, blue] = colors.map(|channel| self.bytes.channel(channel));
            for (i, pixel) in pixels.as_chunks_mut().0.iter_mut().enumerate() {
                *pixel = [red[i], green[i], blue[i]];
            }
        }
    }

    /// The mean of the samples. Samples that see the same part of a surface share one computation:
    /// edges are where the picture needs several.
    fn mean(
        &self,
        samples: &[(u32, f32); SAMPLES * SAMPLES],
        pixel: [usize; 2],
        background: Vec3,
    ) -> Vec3 {
        let mut shaded: [Option<Shaded>; SAMPLES * SAMPLES] = [None; SAMPLES * SAMPLES];
        let mut sum = Vec3::ZERO;
        for (sample, &(number, nearness)) in samples.iter().enumerate() {
            let seen = self.screen.seen(number);
            let alike = |shaded: &&Shaded| self.alike(shaded, seen, nearness);
            if let Some(shaded) = shaded.iter().flatten().find(alike) {
                sum += shaded.color;
                continue;
            }
            let place =
                |whole: usize, part: usize| whole as f32 + (part as f32 + 0.5) / SAMPLES as f32;
            let place =
                Vec2::new(place(pixel[0], sample % SAMPLES), place(pixel[1], sample / SAMPLES));
            let color = self.color(seen, pixel, place, background);
            shaded[sample] = Some(Shaded { seen, nearness, color });
            sum += color;
        }
        sum / (SAMPLES * SAMPLES) as f32
    }

    /// Whether a sample looks like one that was `shaded` before: the same surface at nearly the same
    /// depth, turned nearly the same way.
    fn alike(&self, shaded: &Shaded, seen: Seen, nearness: f32) -> bool {
        if shaded.seen == seen {
            return true;
        }
        let (
            Seen::Triangle { mesh, triangle: a },
            Seen::Triangle { mesh: other_mesh, triangle: b },
        ) = (shaded.seen, seen)
        else {
            return false;
        };
        let surfaces = &self.mesh(mesh).surface_of_triangle;
        if mesh != other_mesh
            || surfaces[a] != surfaces[b]
            || (shaded.nearness - nearness).abs() > 0.004 * nearness
        {
            return false;
        }
        let flat_normals = &self.mesh(mesh).flat_normals;
        let (a, b) = (flat_normals[a], flat_normals[b]);
        let dot = a.dot(b);
        dot > 0.0 && dot * dot > 0.8 * a.length_squared() * b.length_squared()
    }

    fn mesh(&self, number: usize) -> &Mesh {
        if number == 0 { self.solids } else { &self.cloths.mesh }
    }

    fn background(&self, row: usize) -> Vec3 {
        let [top, bottom] = self.background;
        let part = (row as f32 + 0.5) / self.view.height as f32;
        top.lerp(bottom, part)
    }

    /// The colour of what is `seen` at `place` in the picture \[pixel\], within `pixel`, ready for a
    /// screen.
    fn color(&self, seen: Seen, pixel: [usize; 2], place: Vec2, background: Vec3) -> Vec3 {
        match seen {
            Seen::Nothing => background,
            Seen::Plane(plane) => self.plane(plane, pixel, background),
            Seen::Triangle { mesh: 0, triangle } => {
                let hit = self.hit(0, triangle, place);
                let solid = self.solids.surface_of_triangle[triangle] as usize;
                tone(self.light(&hit, self.solid_colors[solid]) + self.gloss(&hit, 0.06))
            }
            Seen::Triangle { mesh, triangle } => {
                let hit = self.hit(mesh, triangle, place);
                let cloth = self.cloths.mesh.surface_of_triangle[triangle] as usize;
                let mut color = self.cloths.colors[cloth];
                if let Some(heat) = self.cloths.heat(triangle, &hit.weights) {
                    color = heat;
                } else {
                    if !hit.front {
                        // The back is paler, so that folds can be read.
                        color = color.lerp(Vec3::splat(color.element_sum() / 3.0), 0.35) * 0.8;
                    }
                    if let Some(checks) = self.cloths.checks.get(triangle) {
                        color *= check_shade(checks, &hit.weights);
                    }
                }
                if let Some(corners) = self.cloths.thread_corners(triangle) {
                    color = self.threads(color, triangle, corners, place);
                }
                // Fibres that stand off the cloth catch light along its outline.
                let facing = hit.normal.dot(hit.toward).clamp(0.0, 1.0);
                let sheen = 0.35 * (1.0 - facing).powi(3);
                let color = color.lerp(Vec3::ONE, 0.25 * sheen) * (1.0 + sheen);
                tone(self.light(&hit, color) + self.gloss(&hit, 0.025))
            }
        }
    }

    /// A cloth of `color` with its threads at `place` in the picture \[pixel\].
    fn threads(&self, color: Vec3, triangle: usize, corners: &[Vec2; 3], place: Vec2) -> Vec3 {
        // Beyond the edges of the triangle, too: neighbours beside each other see the same width of a pixel.
        let among = |place: Vec2| {
            let [wb, wc] = self.weights(1, triangle, place);
            corners[0] + wb * (corners[1] - corners[0]) + wc * (corners[2] - corners[0])
        };
        let (here, right, below) = (among(place), among(place + Vec2::X), among(place + Vec2::Y));
        let footprint = (right - here).abs().max((below - here).abs());
        let is_known = here.is_finite() && footprint.is_finite();
        if is_known { thread_color(color, here, footprint) } else { color }
    }

    /// Weights of the second and third corner of a triangle where the ray through `place` \[pixel\] meets its plane.
    fn weights(&self, number: usize, triangle: usize, place: Vec2) -> [f32; 2] {
        let mesh = self.mesh(number);
        let [a, b, c] = mesh.triangles[triangle].map(|index| mesh.positions[index as usize]);
        let ray = self.view.ray(place.x, place.y);
        let determinant = mesh.flat_normals[triangle].dot(ray);
        let turned = ray.cross(self.view.eye - a);
        [(c - a).dot(turned) / determinant, -(b - a).dot(turned) / determinant]
    }

    fn hit(&self, number: usize, triangle: usize, place: Vec2) -> Hit {
        let mesh = self.mesh(number);
        let corners = mesh.triangles[triangle].map(|index| index as usize);
        let flat = mesh.flat_normals[triangle];
        // The sample is inside, so what rounding carries outside is pulled back, and so is what is
        // not a number, as degenerate triangles give.
        let inside = |weight: f32, limit: f32| if weight > 0.0 { weight.min(limit) } else { 0.0 };
        let [wb, wc] = self.weights(number, triangle, place);
        let wb = inside(wb, 1.0);
        let wc = inside(wc, 1.0 - wb);
        let is_edge_on = flat.dot(self.view.ray(place.x, place.y)) == 0.0;
        let weights = if is_edge_on { [1.0, 0.0, 0.0] } else { [1.0 - wb - wc, wb, wc] };
        let blend = |values: &[Vec3]| -> Vec3 {
            let parts = corners.iter().zip(weights);
            parts.map(|(&index, weight)| values[index] * weight).sum()
        };
        let point = blend(&mesh.positions);
        let toward = (self.view.eye - point).normalize_or(Vec3::Z);
        let front = flat.dot(toward) >= 0.0;
        let normal = blend(&mesh.normals);
        let normal = if front { normal } else { -normal };
        // At an outline the smooth normal can point away from the viewer; bend it back.
        let away = normal.dot(toward).min(0.0);
        let normal = (normal - 1.02 * away * toward).normalize_or(toward);
        let sky = self.sky.on_triangle(number, corners, weights, front);
        let lit = self.lit(point, normal);
        Hit { normal, toward, front, weights, lit, sky }
    }

    /// How much of the strong light reaches a point, nothing if it faces away.
    fn lit(&self, point: Vec3, normal: Vec3) -> f32 {
        if normal.dot(self.key.direction) > 0.0 {
            self.key.lit::<KEY_TAPS>(point, normal)
        } else {
            0.0
        }
    }

    /// Light that a matt surface of `color` sends to the viewer.
    fn light(&self, hit: &Hit, color: Vec3) -> Vec3 {
        let facing = hit.normal.dot(self.key.direction).max(0.0);
        let down = 0.5 - 0.5 * hit.normal.z;
        let fill = hit.normal.dot(hit.toward).max(0.0) * (0.4 + 0.6 * hit.sky);
        color * (KEY * (facing * hit.lit) + SKY * hit.sky + GROUND * down + FILL * fill)
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

    fn plane(&self, number: usize, pixel: [usize; 2], background: Vec3) -> Vec3 {
        let point = self.floor.point(number, pixel, self.view);
        let colors = self.planes[number].colors(&point, background);
        Vec3::from(colors.map(|[channel]| channel))
    }
}

/// Brightness of the checked pattern of a cloth: a soft product of waves, which does not flicker
/// like sharp checks do.
fn check_shade(checks: &[Vec2; 3], weights: &[f32; 3]) -> f32 {
    let place: Vec2 = checks.iter().zip(weights).map(|(&check, &weight)| check * weight).sum();
    // Parabolas that look like a sine with a period of 2.
    let wave = |x: f32| {
        let half = 0.5 * x;
        let part = 2.0 * (half - (half as i32) as f32);
        let part = if part > 1.0 {
            part - 2.0
        } else if part < -1.0 {
            part + 2.0
        } else {
            part
        };
        4.0 * part * (1.0 - part.abs())
    };
    let check = (4.0 * wave(place.x) * wave(place.y)).clamp(-1.0, 1.0);
    1.0 + 0.09 * check
}
