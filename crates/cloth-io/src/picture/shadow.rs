//! Maps of depths seen from a light, which tell what is in its shadow.

use glam::{Vec2, Vec3};
use rayon::prelude::*;

use super::camera::View;
use super::geometry::Geometry;

/// Texels of the map of the strong light along its side for each pixel along the longer side of the
/// picture: shadows as sharp as the picture can show.
const KEY_SIZE_PER_PIXEL: f32 = 1.3;
/// Least and greatest side of the map of the strong light \[texel\].
const KEY_SIZE_RANGE: [f32; 2] = [512.0, 2048.0];
/// Rows that one task fills.
const BAND: usize = 256;
/// Half of the side of the square of texels that soften the edge of a shadow.
const SOFTNESS: usize = 2;

/// Depths seen from a far light.
pub(super) struct ShadowMap {
    /// Unit vector towards the light.
    pub(super) direction: Vec3,
    right: Vec3,
    up: Vec3,
    center: Vec3,
    radius: f32,
    size: usize,
    nearness: Vec<f32>,
}

impl ShadowMap {
    /// The map of the strong light, which comes over the left shoulder of the viewer.
    pub(super) fn of_key_light(geometry: &Geometry, view: &View) -> Self {
        let level = Vec3::new(view.backward.x, view.backward.y, 0.0).normalize_or(Vec3::NEG_Y);
        let direction = (Vec3::Z * 1.25 + level * 0.62 - view.right * 0.75).normalize();
        let [least, greatest] = KEY_SIZE_RANGE;
        let size = KEY_SIZE_PER_PIXEL * view.width.max(view.height) as f32;
        Self::new(geometry, direction, size.clamp(least, greatest) as usize)
    }

    /// The map of a light in `direction`, a unit vector, of `size` \[texel\].
    pub(super) fn new(geometry: &Geometry, direction: Vec3, size: usize) -> Self {
        let (right, up) = direction.any_orthonormal_pair();
        let mut map = Self {
            direction,
            right,
            up,
            center: geometry.center,
            radius: 1.02 * geometry.radius,
            size,
            nearness: Vec::new(),
        };
        let vertices: Vec<Vec3> = geometry.positions.iter().map(|&p| map.texel(p)).collect();
        let casters = &geometry.triangles[..geometry.caster_count];
        let mut nearness = vec![f32::NEG_INFINITY; size * size];
        nearness.par_chunks_mut(BAND * size).enumerate().for_each(|(band, nearness)| {
            let mut band = Band { first_row: band * BAND, size, nearness };
            for triangle in casters {
                band.fill(triangle.map(|index| vertices[index as usize]));
            }
        });
        map.nearness = nearness;
        map
    }

    /// Rightward, upward and towards the light, from -1 to 1 within the map.
    fn local(&self, point: Vec3) -> Vec3 {
        let from_center = (point - self.center) / self.radius;
        Vec3::new(
            from_center.dot(self.right),
            from_center.dot(self.up),
            from_center.dot(self.direction),
        )
    }

    /// Column and row \[texel\] and towards the light.
    fn texel(&self, point: Vec3) -> Vec3 {
        let local = self.local(point);
        let size = self.size as f32;
        Vec3::new((0.5 + 0.5 * local.x) * size, (0.5 - 0.5 * local.y) * size, local.z)
    }

    /// How much of the light reaches `point`, from 0 to 1, softened over [`SOFTNESS`] texels.
    pub(super) fn lit(&self, point: Vec3, normal: Vec3) -> f32 {
        const REACH: f32 = SOFTNESS as f32;
        let texel = 2.0 / self.size as f32;
        // A surface must not shadow itself: step out of it by what the softening spans.
        let step = texel * self.radius * (1.0 + REACH);
        let place = self.texel(point + step * normal);
        let limit = place.z + 0.5 * texel;
        // The first of the texels, counted from a margin around the map so that it is not negative.
        let first = Vec2::new(place.x, place.y) - 0.5 + 1.0;
        let end = self.size as f32 + REACH;
        if !(first.min_element() >= 0.0 && first.max_element() < end) {
            // Nothing casts a shadow there.
            return 1.0;
        }
        let [column, row] = [first.x as usize, first.y as usize];
        let part = first - Vec2::new(column as f32, row as f32);
        // Inner texels weigh fully, the outermost by how far the softening reaches into them.
        let weights = |part: f32| {
            let mut weights = [1.0; 2 * SOFTNESS];
            weights[0] = 1.0 - part;
            weights[2 * SOFTNESS - 1] = part;
            weights
        };
        let (row_weights, column_weights) = (weights(part.y), weights(part.x));
        let lit = |nearness: f32| if nearness <= limit { 1.0 } else { 0.0 };
        let mut sum = 0.0;
        for (y, row_weight) in (row..).zip(row_weights) {
            let texels = y.checked_sub(SOFTNESS).and_then(|y| {
                let column = column.checked_sub(SOFTNESS)?;
                let inside = y < self.size && column + 2 * SOFTNESS <= self.size;
                let start = y * self.size + column;
                inside.then(|| self.nearness.get(start..start + 2 * SOFTNESS)).flatten()
            });
            let texels = texels.and_then(|texels| <[f32; 2 * SOFTNESS]>::try_from(texels).ok());
            let texels =
                texels.unwrap_or_else(|| std::array::from_fn(|x| self.nearness_at(column + x, y)));
            let row_sum: f32 = texels.iter().zip(column_weights).map(|(&n, w)| w * lit(n)).sum();
            sum += row_weight * row_sum;
        }
        // The weights of a row add up to this, wherever the point lies between the texels.
        const TOTAL: f32 = 2.0 * REACH - 1.0;
        sum / (TOTAL * TOTAL)
    }

    /// How near the light the surface at a texel is; both are counted from [`SOFTNESS`] before the
    /// map, beyond which there is nothing.
    fn nearness_at(&self, column: usize, row: usize) -> f32 {
        let inside = |index: usize| index.checked_sub(SOFTNESS).filter(|&index| index < self.size);
        match (inside(column), inside(row)) {
            (Some(column), Some(row)) => self.nearness[row * self.size + column],
            _ => f32::NEG_INFINITY,
        }
    }
}

/// Consecutive rows of a map. All casters are inside the map, nothing has to be clipped.
struct Band<'a> {
    first_row: usize,
    size: usize,
    nearness: &'a mut [f32],
}

impl Band<'_> {
    /// Enters a triangle with these columns, rows and nearnesses of its corners.
    fn fill(&mut self, [a, b, c]: [Vec3; 3]) {
        let (first, last) = (a.y.min(b.y).min(c.y) - 0.5, a.y.max(b.y).max(c.y) - 0.5);
        let top = ceiling(first).max(self.first_row);
        let bottom = ceiling(last).min(self.first_row + self.nearness.len() / self.size);
        if top >= bottom {
            return;
        }
        let (ab, ac) = (b - a, c - a);
        let area = ab.x * ac.y - ab.y * ac.x;
        if area == 0.0 {
            return;
        }
        let along = (ab.z * ac.y - ac.z * ab.y) / area;
        let down = (ac.z * ab.x - ab.z * ac.x) / area;
        for row in top..bottom {
            let y = row as f32 + 0.5;
            // Where the row crosses the edges.
            let (mut left, mut right) = (f32::INFINITY, f32::NEG_INFINITY);
            for (from, to) in [(a, b), (b, c), (c, a)] {
                if (from.y <= y) != (to.y <= y) {
                    let x = from.x + (to.x - from.x) * ((y - from.y) / (to.y - from.y));
                    left = left.min(x);
                    right = right.max(x);
                }
            }
            let start = ceiling(left - 0.5);
            let end = ceiling(right - 0.5).min(self.size);
            let base = (row - self.first_row) * self.size;
            let Some(texels) = self.nearness.get_mut(base + start..base + end) else {
                continue;
            };
            let at_start = a.z + along * (start as f32 + 0.5 - a.x) + down * (y - a.y);
            for (step, nearest) in texels.iter_mut().enumerate() {
                *nearest = nearest.max(at_start + along * step as f32);
            }
        }
    }
}

/// The least index that is not below `x`; zero for what is not a number.
fn ceiling(x: f32) -> usize {
    // The conversion saturates. Rounding functions are slow on processors that have no instruction
    // for them.
    let below = x as usize;
    below.saturating_add(usize::from((below as f32) < x))
}
